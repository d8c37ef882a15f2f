# Copyright 2026 pam_actuation developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
What the age of the command at the driver's tick does to tracking behind on/off valves, offline.

Run ``python benchmarks/command_age.py``. Controller (200 Hz) and driver (100 Hz) run on a virtual
clock. A command arrives 0.3 ms after it was sent. The phase of the driver and the jitter of its
ticks are given, so that the age of the newest command is constant or flips by one period of the
controller. Each case runs twice: every command acts at once, and commands wait for a steady age.
Errors are root mean square over the last eight cycles of twenty, sines of +-10 mm about 14 mm.
``--figure FILE`` draws the ages over time.
"""

import argparse
from importlib import import_module
from pathlib import Path
import sys
import tempfile

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.control.config import load_controller
from pam_actuation.drivers.steady_age import SteadyAge
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_sim import load_rig
import results_page

RIG = 'dmsp_5_300_realistic'
MS = 1_000_000
WAY_NS = 300_000
PERIOD_NS = 10 * MS
WAIT_S = 0.015
CYCLES, LATE_CYCLES = 20, 8
SINE = """
name: sine
domain: contraction
segments:
  - rest: {{duration_s: 1.0}}
  - ramp: {{to_m: 0.004, duration_s: 2.0}}
  - hold: {{duration_s: 1.0}}
  - sine: {{center_m: 0.014, amplitude_m: 0.010, frequency_hz: {hz:g}, cycles: {cycles}}}
"""


def sine(hz, cycles=CYCLES):
    """Return the experiment."""
    return load_experiment(SINE.format(hz=hz, cycles=cycles))


def cases(count):
    """Return name to times of the driver's ticks [ns since the start]."""
    k = np.arange(-9, count)
    base, edge = k * PERIOD_NS, k * PERIOD_NS + WAY_NS
    rng = np.random.default_rng(0)

    def jitter(size_ms):
        return (rng.normal(0.0, size_ms, len(k)) * MS).astype(np.int64)

    return {
        'constant, 2.5 ms': base + 2_500_000,
        'constant, 5 ms': base,
        'jitter 0.3 ms rms about 2.5 ms': base + 2_500_000 + jitter(0.3),
        'each tick at random': edge + rng.choice([-200_000, 200_000], len(k)),
        'a second each in turn': edge + np.where((k // 100) % 2, 200_000, -200_000),
        'jitter 0.3 ms rms at the edge': edge + jitter(0.3)}


def simulated(experiment, ticks=None, wait_s=WAIT_S, seed=1, valve='hsv'):
    """Return the recording of one simulation."""
    rig = load_rig(RIG, valve=valve)
    with tempfile.TemporaryDirectory() as folder:
        return load_run(simulate_experiment(
            experiment, rig, load_controller(f'sofc_{valve}', rig), f'{folder}/bag', seed=seed,
            ticks=ticks, transport_ns=WAY_NS, driver={'command_wait_s': wait_s})['bag'])


def late_rmse_mm(run, hz):
    """Return the error of the last cycles [mm], at the stamps of the measurements."""
    moved, asked = run.topics['contraction'], run.topics['reference']
    wanted = np.interp(moved.stamp_ns, asked.stamp_ns, asked.values['contraction_m'])
    end_ns = asked.stamp_ns[-1]
    late = (moved.stamp_ns > end_ns - LATE_CYCLES / hz * 1e9) & (moved.stamp_ns <= end_ns)
    return 1e3 * float(np.sqrt(np.mean((moved.values['contraction_m'] - wanted)[late] ** 2)))


def ages_ms(run, way_ns=WAY_NS):
    """Return time [s], age of the newest command and of what acts [ms], at the ticks."""
    commands, ticks = run.topics['pressure_command'], run.topics['valve_signal'].stamp_ns
    ages, taken, rows = SteadyAge(round(WAIT_S * 1e9), PERIOD_NS), 0, []
    stamps, values = commands.stamp_ns, commands.values['pressure_pa']
    for now_ns in ticks.tolist():
        while taken < len(stamps) and stamps[taken] + way_ns <= now_ns:
            ages.take(int(stamps[taken]), float(values[taken]))
            taken += 1
        if taken:
            ages.at(now_ns, float(values[taken - 1]))
            rows.append((now_ns - run.start_ns, now_ns - stamps[taken - 1], ages.age_ns))
    at_ns, newest_ns, acts_ns = np.array(rows).T
    return at_ns * 1e-9, newest_ns * 1e-6, acts_ns * 1e-6


def draw(path, runs):
    """Draw the ages over time of named recordings, one below the other."""
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent / 'docs'))
    look = import_module('generate.drawing')
    with look.drawn(Path(path), rows=len(runs), height_in=1.6 * len(runs), sharex=True) as axes:
        for axis, (name, run) in zip(np.atleast_1d(axes), runs.items()):
            time_s, newest, acts = ages_ms(run)
            inside = (time_s > 5.5) & (time_s < 8.5)
            axis.plot(time_s[inside], newest[inside], lw=0.6, color=look.GREY,
                      label='newest command')
            axis.plot(time_s[inside], acts[inside], color=look.BLUE, label='what acts')
            axis.set(ylabel='age, ms', title=name, ylim=(-0.5, 8.5))
        np.atleast_1d(axes)[0].legend(ncols=2, loc='upper right')
        np.atleast_1d(axes)[-1].set(xlabel='time, s')


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--frequencies', default='0.25,0.5,1', help='of the sines [Hz], by commas')
    parser.add_argument('--figure', default=None, help='draw the ages over time into this SVG')
    results_page.add_write(parser, 'command_age')
    return parser


def show(args):
    """Print the table as Markdown."""
    frequencies = [float(text) for text in args.frequencies.split(',')]
    print('| age of the newest command | from–to [ms] |' + ''.join(
        f' {hz:g} Hz: at once | steady age |' for hz in frequencies))
    print('|---|---|' + '---|---|' * len(frequencies))
    drawings = {}
    for name in cases(0):
        cells, spread = '', ''
        for hz in frequencies:
            experiment = sine(hz)
            ticks = {'driver': np.sort(cases(round(experiment.duration_s * 100))[name])}
            for wait_s in (0.0, WAIT_S):
                run = simulated(experiment, ticks, wait_s)
                cells += f' {late_rmse_mm(run, hz):.3f} |'
            _, newest, _ = ages_ms(run)
            spread = f'{newest[20:].min():.1f}–{newest[20:].max():.1f}'
            drawings[name] = run
        print(f'| {name} | {spread} |{cells}', flush=True)
    if args.figure:
        draw(args.figure, {name: drawings[name] for name in (
            'each tick at random', 'a second each in turn', 'jitter 0.3 ms rms at the edge')})


def main():
    """Run."""
    args = command_line().parse_args()
    with results_page.printed(args, __file__):
        show(args)


if __name__ == '__main__':
    main()

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
Named experiments live and simulated from the same file: how far the recordings agree.

Run ``python benchmarks/live_against_simulated.py --experiments decay,knee_gait --seconds 15``.
Per experiment the live nodes run once, in real time. Everything is compared at the header
stamps of the live measurements, time zero being the first message of the experiment:

- *live - sim*: live recording less simulation, RMS.
- *noise*: simulations that differ in the seed of the sensors, RMS over six seeds. This is noise
  and what it does on its way through controller and driver.
- *timing*: two simulations without sensor noise, RMS. In one of them every loop ticks when it
  ticked in the live run, and every message is as late as the median one was there. This is phase,
  jitter and pauses of the loops, and transport.
- *live - re-timed*: live recording less noisy simulations with the live timing, RMS, median of six
  seeds. This is noise, and what is left unexplained.
- *among re-timed*: these six simulations less each other, RMS, median and largest of the fifteen
  pairs. The live recording would show this if it were one of them.
"""

import argparse
from dataclasses import dataclass
from itertools import combinations
import os
import sys
import tempfile

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.bags.series import table
from pam_actuation.bags.source import read_bag
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.rigging.session import run_experiment
from pam_sim import load_rig
from pam_sim.located_yaml import dump_yaml
import results_page

SIGNALS = {'pressure': ('pressure_pa', 'kPa', 1e-3), 'contraction': ('contraction_m', 'mm', 1e3),
           'force': ('force_n', 'N', 1.0)}
FIRST = ('reference', 'pressure_command', 'valve_command')
TICKS = {'plant': 'pressure', 'reference': FIRST, 'controller': 'controller_state',
         'driver': 'valve_signal'}
OTHER_SEEDS = range(11, 17)
BEFORE_NS = 50_000_000         # ticks taken over from before the start
DEFAULT = ('step_10mm', 'knee_gait', 'disturbance', 'random_steps', 'voltage_steps')


@dataclass
class Recording:
    """One run with its start: the first message that carries the wanted value."""

    run: object
    start_ns: int

    @classmethod
    def of(cls, path, contraction):
        """Load a bag; in contraction the pressure command is the controller's."""
        run = load_run(path)
        first = ('reference',) if contraction else FIRST[1:]
        return cls(run, min(int(run.topics[t].stamp_ns[0]) for t in first if t in run))

    def stamps(self, topics):
        """Return the sorted stamps of a topic, or of several together, ns since the start."""
        names = (topics,) if isinstance(topics, str) else topics
        stamps = [self.run.topics[name].stamp_ns for name in names if name in self.run]
        return np.sort(np.concatenate(stamps)) - self.start_ns

    def series(self, topic):
        """Return (seconds since the start, values in units for people)."""
        key, _, scale = SIGNALS[topic]
        one = self.run.topics[topic]
        return (one.stamp_ns - self.start_ns) * 1e-9, one.values[key] * scale


def rms_between(one, other, topic, duration_s):
    """Return the RMS of one recording less another, at the stamps of the first."""
    t, value = one.series(topic)
    inside = (t > 0.0) & (t < duration_s)
    return float(np.sqrt(np.mean((value - np.interp(t, *other.series(topic)))[inside] ** 2)))


def live_ticks(live, contraction):
    """Return when every loop of a live run ticked, for ``simulate_experiment``."""
    ticks = {}
    for loop, topics in TICKS.items():
        if loop == 'reference':
            topics = 'reference' if contraction else FIRST[1:]
        elif loop == 'controller' and not contraction:
            continue
        stamps = live.stamps(topics)
        ticks[loop] = stamps[stamps >= (0 if loop == 'reference' else -BEFORE_NS)]
    return ticks


def transport_ns(bag):
    """Return the median time from the stamp of a command to its arrival at the recorder [ns]."""
    for name, topic in read_bag(bag).topics.items():
        if name.endswith('/valve_signal'):
            stamps, _, _ = table('valve_signal', topic.payloads)
            return int(np.median(np.asarray(topic.log_time_ns) - stamps))
    return 0


def timing_ms(ticks, name):
    """Return (mean interval, its standard deviation, longest interval) of a loop [ms]."""
    gaps = np.diff(ticks[name]) * 1e-6
    return gaps.mean(), gaps.std(), gaps.max()


def compare(name, valve, seconds, folder, domain_id):
    """Run one experiment live and simulated; return (row, timing of its loops, transport)."""
    experiment = load_experiment(name)
    length = ''
    if seconds and seconds < experiment.duration_s:
        experiment = load_experiment(
            dump_yaml({**experiment.to_dict(), 'stop_after_s': seconds}))
        length = f'_{seconds:g}s'
    rig = load_rig('dmsp_5_300_realistic', valve=valve)
    contraction = experiment.domain == 'contraction'
    path = os.path.join(folder, f'{experiment.name}_{valve}{length}')     # of this length alone
    bag = f'{path}_live'
    if not os.path.exists(bag):
        result = run_experiment(experiment, rig, None, valve, bag, seed=1, domain_id=domain_id)
        if result.failure or result.findings:
            print(f'{name} {valve}: {result.failure} {result.findings}', flush=True)
    live = Recording.of(bag, contraction)
    ticks = live_ticks(live, contraction)
    quiet = rig.with_(sensors=dict.fromkeys(rig.sensors, 0.0))

    delay_ns = transport_ns(bag)

    def simulated(tag, one_rig, seed, at=None):
        controller = load_controller(f'sofc_{valve}', rig) if contraction else None
        done = simulate_experiment(
            experiment, one_rig, controller, f'{path}_{tag}', seed=seed, ticks=at, overwrite=True,
            transport_ns=delay_ns if at else 0)
        return Recording.of(done['bag'], contraction)

    plain = simulated('sim', rig, 2)
    others = [simulated(f'other{seed}', rig, seed) for seed in OTHER_SEEDS]
    retimed = [simulated(f'retimed{seed}', rig, seed, ticks) for seed in OTHER_SEEDS]
    quiet_plain, quiet_retimed = simulated('q', quiet, 1), simulated('q_retimed', quiet, 1, ticks)
    cells = []
    for topic, (_, unit, _) in SIGNALS.items():
        def between(one, other):
            return rms_between(one, other, topic, experiment.duration_s)

        a, t = between(live, plain), between(quiet_retimed, quiet_plain)
        n = np.sqrt(np.mean(np.square([between(other, plain) for other in others])))
        r = np.median([between(live, one) for one in retimed])
        among = [between(*pair) for pair in combinations(retimed, 2)]
        cells.append(f' {a:.3f} ({a / np.hypot(n, t):.2f}); {r:.3f} '
                     f'({np.median(among):.3f}–{max(among):.3f}) |')
        print(f'{experiment.name} {valve}, {topic} [{unit}]: live - simulated {a:.3f}, noise '
              f'{n:.3f}, timing {t:.3f}', file=sys.stderr, flush=True)
    row = f'| `{experiment.name}` | {experiment.duration_s:.0f} s |{"".join(cells)}'
    return row, {loop: timing_ms(ticks, loop) for loop in TICKS if loop in ticks}, delay_ns * 1e-6


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--experiments', default=','.join(DEFAULT), help='names, by commas')
    parser.add_argument('--valve', default='ppr', choices=('ppr', 'hsv'))
    parser.add_argument('--seconds', type=float, default=None, help='shorten each to this')
    parser.add_argument('--domain-id', type=int, default=None, help='ROS domain')
    parser.add_argument('--keep', default=None, metavar='DIR',
                        help='keep the bags here; a live bag found there is not run again')
    results_page.add_write(parser, 'live_against_simulated')
    return parser


def main():
    """Run and compare."""
    args = command_line().parse_args()
    with results_page.printed(args, __file__, args.valve):
        show(args)


def show(args):
    """Print both tables as Markdown."""
    timings, delays_ms = [], []
    print('| experiment | time |'
          + ''.join(f' {topic} [{unit}] |' for topic, (_, unit, _) in SIGNALS.items()))
    print('|---|---|---|---|---|')
    with tempfile.TemporaryDirectory() as temporary:
        for name in args.experiments.split(','):
            row, timing, delay_ms = compare(
                name, args.valve, args.seconds, args.keep or temporary, args.domain_id)
            print(row, flush=True)
            timings.append(timing)
            delays_ms.append(delay_ms)
    print('\n| loop | mean interval [ms] | standard deviation | longest |\n|---|---|---|---|')
    for loop in TICKS:
        of_loop = [timing[loop] for timing in timings if loop in timing]
        if of_loop:
            mean, spread, longest = zip(*of_loop)
            print(f'| {loop} | {min(mean):.2f}–{max(mean):.2f} | {min(spread):.2f}–'
                  f'{max(spread):.2f} | {max(longest):.1f} |')
    print(f'\nMedian transport: {min(delays_ms):.2f}–{max(delays_ms):.2f} ms.')


if __name__ == '__main__':
    main()

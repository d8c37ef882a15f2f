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
The baseline controllers, each tuned by the same search with the same budget as any other.

Run ``python benchmarks/baselines.py`` for the table of their errors: sines of +-10 mm about
14 mm, last of 20 cycles, noise on, and how long a tick takes. ``--tune`` searches the settings
anew, from the defaults of each controller, and writes the presets of ``config/controllers``.
``--tune random`` does so for motions that never repeat and are not announced; their presets have
``_random`` in their names.
"""

import argparse
from dataclasses import dataclass
import math
import time

from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.resources import config_dir
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.tune import tune
from pam_sim import load_rig
from pam_sim.files import write_text
from pam_sim.located_yaml import dump_yaml
import results_page

RIG = 'dmsp_5_300_realistic'
KINDS = {'pid_plain': 'PID', 'pid': 'PID + inverse, preview', 'lqi': 'LQI',
         'mpc': 'MPC', 'ilc': 'ILC + PID + inverse'}
# What a search begins with, beside the defaults.
STARTS = {'pid_plain': {}, 'pid': {'use_static_inverse': 1, 'lead_s': 0.1}, 'lqi': {},
          'mpc': {'change_weight': 5.0, 'disturbance_pa': 700.0}, 'ilc': {}}
WORDS = {
    'pid_plain': 'PID with anti-windup and without static inverse: knows nothing of the muscle.',
    'pid': 'PID with anti-windup on top of the static inverse with preview.',
    'lqi': 'LQI on a linear model that is identified on the rig when this is loaded.',
    'mpc': 'Model predictive control on a model that is identified on the rig when loaded.',
    'ilc': 'Iterative learning control on top of a PID with static inverse: for what repeats.'}
SOURCE = """#
# Only what differs from the defaults; every setting with its unit and range is listed in
# pam_actuation/control/{module}.py. Found by `python benchmarks/baselines.py --tune{option}`: rig
# {rig}, {valve}, {experiments},
# {rollouts} rollouts from the defaults, seed {seed}; held-out cost {before:.3f} -> {after:.3f} mm.
{suits}"""
SUITS = '# Gains suit the friction of that rig: without it, pid and lqi oscillate behind a PPR.\n'
FREQUENCIES_HZ = (0.1, 0.25, 0.5, 1.0)
ROLLOUTS, SEED = 3000, 1
CYCLES = 20


@dataclass(frozen=True)
class Purpose:
    """What baselines are tuned for: experiments, those of the check, preview, ending of names."""

    searched: tuple[str, ...]
    check: tuple[str, ...]
    preview_s: float = math.inf
    ending: str = ''


PURPOSES = {
    'sines': Purpose(('tuning_quarter_hz', 'tuning_half_hz', 'tuning_one_hz'), ('tuning_check',)),
    'random': Purpose(('tuning_random',), ('random_motion',), 0.0, '_random')}


def preset(kind, valve, ending=''):
    """Return the name of the preset of a kind of baseline for a valve."""
    if kind in ('mpc', 'ilc'):
        return f'{kind}{ending}_{valve}'
    return f'{kind}{ending}' + ('' if valve == 'ppr' else f'_{valve}')


def baselines():
    """Return (name, function of a rig that builds the controller) of every baseline."""
    return [(name, lambda rig, kind=kind: load_controller(
        preset(kind, rig.valve), rig)) for kind, name in KINDS.items()]


def sine(frequency_hz):
    """Return the experiment of one frequency."""
    return load_experiment(f"""
name: sine
segments:
  - rest: {{duration_s: 1.0}}
  - ramp: {{to_m: 0.004, duration_s: 2.0}}
  - hold: {{duration_s: 2.0}}
  - sine: {{center_m: 0.014, amplitude_m: 0.010, frequency_hz: {frequency_hz}, cycles: {CYCLES}}}
""")


def tick_us(controller):
    """Return how long a tick takes when it is called from Python [us], a sine being tracked."""
    ticks = 1000
    wanted = [0.014 + 0.010 * math.sin(2.0 * math.pi * k / 200.0) for k in range(ticks + 40)]
    for k in range(ticks):
        if k == ticks // 2:           # the ILC has found the cycle
            began = time.perf_counter()
        controller.step(wanted[k], wanted[k], 0.0, wanted[k + 25], 0.0, pressure_pa=4e5)
    return 1e6 * (time.perf_counter() - began) / (ticks - ticks // 2)


def show_errors(valves):
    """Print the error of the last cycle [mm] per frequency."""
    print('| controller | valve | ' + ' | '.join(f'{f:g} Hz' for f in FREQUENCIES_HZ)
          + ' | a tick [us] |')
    print('|---|---|' + '---|' * (len(FREQUENCIES_HZ) + 1))
    for valve in valves:
        rig = load_rig(RIG, valve=valve)
        loops = [ClosedLoop(rig, sine(frequency), seed=3) for frequency in FREQUENCIES_HZ]
        for name, build in baselines():
            errors = [1e3 * loop.run(build(rig)).cycle_rmse_m()[-1] for loop in loops]
            print(f'| {name} | {valve.upper()} | '
                  + ' | '.join(f'{error:.3f}' for error in errors)
                  + f' | {tick_us(build(rig)):.0f} |', flush=True)


def tune_presets(valve, jobs, purpose, kinds):
    """Search the settings of some baselines for a ``Purpose`` and write the presets."""
    rig = load_rig(RIG, valve=valve)
    experiments = [load_experiment(name) for name in purpose.searched]
    check = [*(load_experiment(name) for name in purpose.check), *experiments]
    for kind in kinds:
        if kind == 'ilc' and purpose.preview_s == 0.0:
            continue            # what does not repeat teaches it nothing
        start = load_controller(dump_yaml({
            'controller': kind.split('_')[0], 'settings': STARTS[kind]}), rig)
        result = tune(rig, start, experiments, budget=ROLLOUTS, seed=SEED, jobs=jobs,
                      held_out=check, preview_s=purpose.preview_s)
        settings = {**STARTS[kind], **{
            axis.name: result.controller.settings[axis.name] for axis in result.axes}}
        head = f'# {WORDS[kind]}\n' + SOURCE.format(
            option=' random' if purpose.ending else '', module=start.kind, rig=RIG,
            valve=valve, experiments=', '.join(purpose.searched),
            rollouts=result.rollouts, seed=SEED, before=result.held_out_before,
            after=result.held_out_after, suits=SUITS if start.kind in ('pid', 'lqi') else '')
        path = config_dir() / 'controllers' / f'{preset(kind, valve, purpose.ending)}.yaml'
        write_text(path, head + dump_yaml({
            'controller': start.kind, 'settings': settings}))
        print(f'{path}: {result.text()}', flush=True)


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--valve', default='ppr,hsv', help='valves, by commas')
    parser.add_argument('--tune', nargs='?', const='sines', choices=PURPOSES,
                        help='search the presets anew, for sines or for random motions')
    parser.add_argument('--kind', default=','.join(KINDS), help='with --tune: only these')
    parser.add_argument('--jobs', type=int, default=-1, help='threads; -1 = one a core')
    results_page.add_write(parser, 'baselines')
    return parser


def main():
    """Print the table, or tune."""
    args = command_line().parse_args()
    valves = args.valve.split(',')
    if args.tune:
        for valve in valves:
            tune_presets(valve, args.jobs, PURPOSES[args.tune], args.kind.split(','))
        return
    with results_page.printed(args, __file__):
        show_errors(valves)


if __name__ == '__main__':
    main()

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
Measure whether `pam investigate` finds what is hidden, and ends the ambiguity.

    python benchmarks/investigate.py realistic --write      # all hidden effects of a rig
    python benchmarks/investigate.py rivals --write         # names that one recording leaves

`realistic` asks the nominal model about `dmsp_5_300_realistic`. It also asks about rigs of the
independent simulator under test/hidden. They have the same effects in other equations, and valve
and friction are off by up to 30 %. A held-out `multisine` is then played on the same rig.

`rivals` begins with one recording of a hidden rig that leaves two names, as the examination of
`pam gap` does. The investigation plays what it suggests on the hidden rig until it ends.
"""

import argparse
from pathlib import Path
import sys
import tempfile
import time

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.investigate import Budget, Investigation, Question
from pam_actuation.investigate.recorder import Recorder
from pam_actuation.investigate.simulated import SimulatedRecorder
from pam_actuation.report.gap import free_run_overlay
from pam_sim import load_rig

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / 'test' / 'hidden'))

from hidden_rig import hidden_rig  # noqa: E402, I100
import results_page  # noqa: E402
import scoring_judge  # noqa: E402
import truth_cases  # noqa: E402

MODEL, REALISTIC = 'dmsp_5_300_hanging_mass', 'dmsp_5_300_realistic'
EXPERIMENT, HELD_OUT = 'pressure_identification', 'multisine'
HIDDEN = {'ppr': ('valve_dead_time', 'hysteresis', 'creep'),
          'hsv': ('valve_dead_time', 'hysteresis', 'creep', 'valve_dead_zone')}
SHOWN = {'pressure': (1e-3, 'kPa'), 'contraction': (1e3, 'mm'), 'force': (1.0, 'N')}
ROUNDS = 4


class HiddenRecorder(Recorder):
    """Records a rig of the independent simulator, with the sensors of its case."""

    def __init__(self, case):
        self._case, self.valve = case, case.valve

    def check(self, experiment):
        """Allow everything; what the rig cannot play fails when it is recorded."""

    def record(self, experiment, bag, seed, why, progress):
        """Play and record; a load cell is mounted where the experiment asks for one."""
        truth_cases.run_suggested(self._case, bag, experiment.to_dict())

    def to_dict(self):
        """Return what records; the look is not told of it."""
        return {'how': 'simulated', 'rig': f'hidden case {self._case.name}'}


def investigated(question, recorder, folder):
    """Run an investigation; return (outcome, its time in words)."""
    began, used = time.perf_counter(), time.process_time()
    outcome = Investigation(question, recorder, folder, Budget(ROUNDS, 600.0)).run()
    return outcome, (f'{(time.process_time() - used) / 60.0:.1f} min '
                     f'({(time.perf_counter() - began) / 60.0:.1f})')


def recorded_s(outcome):
    """Return how many seconds were recorded in all."""
    return sum(one['duration_s'] for each in outcome.rounds for one in each.recordings)


def closed(outcome):
    """Return in words how much of the gap of each signal is closed on the certify data."""
    return ', '.join(
        f'{name} {one["shrink_percent"]:.1f} %'
        for name, one in outcome.rounds[-1].gap['signals'].items()
        if one['shrink_percent'] is not None)


def held_out(rig, model, folder):
    """Return in words the error of the nominal and of the final model on another experiment."""
    bag = simulate_experiment(load_experiment(HELD_OUT), rig, None, folder / 'held_out',
                              seed=1000)['bag']
    run, told = load_run(bag), []
    nominal = load_rig(MODEL, valve=rig.valve)
    for before, after in zip(free_run_overlay(run, nominal), free_run_overlay(run, model)):
        factor, unit = SHOWN[before.signal]
        first, last = (float(np.sqrt(np.mean((one.recorded - one.simulated) ** 2))) * factor
                       for one in (before, after))
        told.append(f'{before.signal} {first:.3g} → {last:.3g} {unit}')
    return ', '.join(told)


def realistic(args):
    """Print one line per rig with the effects of a real one."""
    print('| rig | valve | rounds | recorded | hidden effects named | other names | ended '
          '| gap closed (certify) | held-out multisine, rms: nominal → final '
          '| processor time (wall) |\n'
          '|---|---|---|---|---|---|---|---|---|---|')
    for valve in args.valves.split(','):
        rigs = {REALISTIC: load_rig(REALISTIC, valve=valve)} | {
            f'hidden {seed}': hidden_rig(valve, seed)
            for seed in range(args.seed, args.seed + args.hidden)}
        for title, rig in rigs.items():
            with tempfile.TemporaryDirectory(prefix='investigate_') as folder:
                folder = Path(folder)
                outcome, time_used = investigated(
                    Question(load_rig(MODEL, valve=valve), load_experiment(EXPERIMENT)),
                    SimulatedRecorder(rig), folder / 'out')
                names = outcome.rounds[-1].names
                right = [name for name in HIDDEN[valve] if name in names]
                missed = [name for name in HIDDEN[valve] if name not in names]
                told = f'{len(right)} of {len(HIDDEN[valve])}' + (
                    f', not {", ".join(missed)}' if missed else '')
                print(f'| {title} | {valve} | {len(outcome.rounds)} | {recorded_s(outcome):.0f} s '
                      f'| {told} | {", ".join(n for n in names if n not in right) or "–"} '
                      f'| {outcome.ended}, {outcome.rounds[-1].verdict} | {closed(outcome)} | '
                      f'{held_out(rig, load_rig(str(folder / "out" / "model.yaml")), folder)} '
                      f'| {time_used} |', flush=True)


def cases_of(count, seed):
    """Return so many cases that one recording leaves open, of every sort in turn."""
    found = []
    for place in range(count):
        sort, rivals, protocol, with_force = truth_cases.AMBIGUITIES[
            place % len(truth_cases.AMBIGUITIES)]
        effect = rivals[place // len(truth_cases.AMBIGUITIES) % 2]
        valve = 'ppr' if sort == 'slow_transport' else ('ppr', 'hsv')[place // 2 % 2]
        found.append(truth_cases.Case(
            f'{place:03d}', 'ambiguous', valve, (seed, 5, place), (effect,), protocol, rivals,
            with_force))
    return found


def rivals(args):
    """Print one line per hidden rig, and how many ambiguities ended with the right name."""
    print('| case | valve | hidden | load cell | round 1 | played | last round | right | '
          'recorded | processor time (wall) |\n|---|---|---|---|---|---|---|---|---|---|')
    sets, right, wrong = 0, 0, 0
    for case in cases_of(args.number, args.seed):
        with tempfile.TemporaryDirectory(prefix='investigate_') as folder:
            folder = Path(folder)
            key = truth_cases.build(case, folder / 'case', with_gap=False)
            outcome, time_used = investigated(
                Question(load_rig(MODEL, valve=case.valve), load_experiment(EXPERIMENT),
                         (str(folder / 'case' / 'fit'),)), HiddenRecorder(case), folder / 'out')
        first, last = outcome.rounds[0], outcome.rounds[-1]
        answer = scoring_judge.read_answer(last.gap)
        is_right = scoring_judge.is_right(answer, key)
        was_set = len(first.rivals) > 1
        sets += was_set
        right += was_set and is_right
        wrong += was_set and bool(scoring_judge.wrong_names(answer, key)) and outcome.answered
        played = ', '.join(name for one in outcome.rounds[1:] for name in one.experiments)
        print(f'| {case.name} | {case.valve} | {case.effects[0]} '
              f'| {"yes" if case.with_force else "no"} | {first.found()} | {played or "–"} '
              f'| {last.found() if last is not first else "–"} | {"yes" if is_right else "no"} '
              f'| {recorded_s(outcome):.0f} s | {time_used} |', flush=True)
    print(f'\nOf {sets} recordings that left several names, {right} ended with the right single '
          f'name and {wrong} with a wrong one.')


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('part', choices=('realistic', 'rivals'))
    parser.add_argument('--valves', default='ppr,hsv')
    parser.add_argument('--hidden', type=int, default=1, metavar='N',
                        help='rigs of the independent simulator beside the realistic one')
    parser.add_argument('--number', type=int, default=20, metavar='N',
                        help='cases of rivals')
    parser.add_argument('--seed', type=int, default=81, help='of the hidden rigs')
    results_page.add_write(parser, 'investigate')
    return parser


def main():
    """Run one part."""
    args = command_line().parse_args()
    with results_page.printed(args, __file__, args.part):
        {'realistic': realistic, 'rivals': rivals}[args.part](args)
    return 0


if __name__ == '__main__':
    sys.exit(main())

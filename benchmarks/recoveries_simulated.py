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
Sensors lost and healed, controllers stopped and continued, at random times: simulated.

    python benchmarks/recoveries_simulated.py --times 100

The classes of the live nodes run in a closed loop on a virtual clock, for both valves, SOFC and
PID. There are many more faults than there is time for on live nodes (``recoveries.py``). The
muscle is held at 8.9 mm or follows a sine of 8 mm at 0.5 Hz; a fault lasts 0.12 to 3 s. The table
has the largest excursion beyond all that was wanted. Of the sine it is that beyond the largest
contraction of the same controller without a fault.

    python benchmarks/recoveries_simulated.py --random --times 200

With ``--random`` every fault is drawn: which, when, for how long, sensors, controller or air
supply. They strike one after the other, ten in a run. Half of the runs are on rigs of the
independent simulator under test/hidden, each with friction, valve and dead time of its own.
"""

import argparse
from pathlib import Path
import random
import statistics
import sys

import joblib
from tqdm import tqdm

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / 'test' / 'control'))

from faulty_rig import FaultyRig, hold, slow_sine  # noqa: E402, I100
from hidden_rig import hidden_rig  # noqa: E402
import results_page  # noqa: E402

CONTROLLERS = {'ppr': ('sofc_ppr', 'pid'), 'hsv': ('sofc_hsv', 'pid_hsv')}
LOST = ('nan', 'silent', 'past', 'future')
FAULTS = {'sensor lost and back': (LOST, (('pressure',), ('contraction',))),
          'controller stopped and continued': (('stopped',), ((),))}
REFERENCES = {'held at 8.9 mm': (hold, 3.5), 'sine at 0.5 Hz': (slow_sine, 9.0)}
BACK_S = 4.0
ALLOWED_M, LIMIT_PA = 1e-3, 600e3
HIDDEN_SEED = 841
DRAWN_CONTROLLERS = {
    'ppr': ('sofc_ppr', 'sofc_model_ppr', 'pid'), 'hsv': ('sofc_hsv', 'sofc_model_hsv', 'pid_hsv')}
DRAWN_FAULTS = {**FAULTS, 'air supply gone and back': (('no_supply',), ((),))}
IN_A_RUN = 10
WHERE = ('own rig', 'hidden rigs')


def play(valve, controller, fault, reference, number, seed):
    """Return the excursion [m] and the largest pressure [Pa gauge] of one fault."""
    rng = random.Random(f'{seed} {valve} {controller} {fault} {reference} {number}')
    wanted, start_s = REFERENCES[reference]
    kinds, topics = FAULTS[fault]
    rig = FaultyRig(valve, controller, seed=number)
    at_s = start_s + rng.uniform(0.0, 2.0)
    rig.run(at_s, wanted)
    usual_m = max(rig.excursion_m(start_s - 2.0), 0.0) if wanted is slow_sine else 0.0
    rig.run(rng.uniform(0.12, 3.0), wanted, rng.choice(kinds), rng.choice(topics))
    rig.run(BACK_S, wanted)
    return rig.excursion_m(at_s) - usual_m, max(rig.gauge_pa[round(at_s * 250.0):])


def play_drawn(valve, controller, where, number, seed):
    """Return (fault, excursion [m], largest pressure [Pa gauge]) of the faults of one run."""
    rng = random.Random(f'{seed} {valve} {controller} {where} {number}')
    wanted, start_s = REFERENCES[list(REFERENCES)[number % len(REFERENCES)]]
    moved = hidden_rig(valve, HIDDEN_SEED + number) if where == WHERE[1] else None
    rig = FaultyRig(valve, controller, seed=number, rig=moved)
    now_s, outcomes = start_s, []
    rig.run(start_s, wanted)
    usual_m = max(rig.excursion_m(start_s - 2.0), 0.0) if wanted is slow_sine else 0.0
    for _ in range(IN_A_RUN):
        fault = rng.choice(list(DRAWN_FAULTS))
        kinds, topics = DRAWN_FAULTS[fault]
        rests_s, lasts_s = rng.uniform(0.0, 2.0), rng.uniform(0.12, 3.0)
        at_s = now_s + rests_s
        rig.run(rests_s, wanted)
        rig.run(lasts_s, wanted, rng.choice(kinds), rng.choice(topics))
        rig.run(BACK_S, wanted)
        now_s = at_s + lasts_s + BACK_S
        outcomes.append((fault, rig.excursion_m(at_s) - usual_m,
                         max(rig.gauge_pa[round(at_s * 250.0):])))
    return outcomes


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--times', type=int, default=20, help='how often each fault strikes')
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--random', action='store_true',
                        help='all of it at random, on rigs of the independent simulator as well')
    results_page.add_write(parser, 'recoveries')
    return parser


def show(given):
    """Play and print the table; return 1 if an excursion was too large."""
    rows = [(valve, controller, fault, reference)
            for valve, names in CONTROLLERS.items() for controller in names
            for fault in FAULTS for reference in REFERENCES]
    tasks = [(*row, number) for row in rows for number in range(given.times)]
    found = joblib.Parallel(given.jobs, return_as='generator')(
        joblib.delayed(play)(*task, given.seed) for task in tasks)
    by_row = {row: [] for row in rows}
    for task, outcome in zip(tasks, tqdm(found, total=len(tasks), unit='fault', disable=None)):
        by_row[task[:4]].append(outcome)
    print('| valve | controller | reference | what happens | times '
          '| beyond the reference, median / largest | highest pressure |')
    print('|---|---|---|---|---|---|---|')
    worst_m = 0.0
    for (valve, controller, fault, reference), outcomes in by_row.items():
        beyond = [excursion for excursion, _ in outcomes]
        worst_m = max(worst_m, *beyond)
        print(f'| {valve} | `{controller}` | {reference} | {fault} | {len(outcomes)} '
              f'| {statistics.median(beyond) * 1e3:.2f} / {max(beyond) * 1e3:.2f} mm '
              f'| {max(pressure for _, pressure in outcomes) * 1e-3:.0f} kPa |')
    return 1 if worst_m > ALLOWED_M else 0


def show_drawn(given):
    """Play and print what random faults did; return 1 if an excursion or pressure is too large."""
    rows = [(valve, controller, where) for valve, names in DRAWN_CONTROLLERS.items()
            for controller in names for where in WHERE]
    runs = max(1, round(given.times / IN_A_RUN / len(WHERE)))
    tasks = [(*row, number) for row in rows for number in range(runs)]
    found = joblib.Parallel(given.jobs, return_as='generator')(
        joblib.delayed(play_drawn)(*task, given.seed) for task in tasks)
    by_row = {row: [] for row in rows}
    for task, outcomes in zip(tasks, tqdm(found, total=len(tasks), unit='run', disable=None)):
        by_row[task[:3]] += outcomes
    print('| valve | controller | rig | faults | beyond the reference, median | 95 % | largest '
          '| after | highest pressure |')
    print('|---|---|---|---|---|---|---|---|---|')
    worst_m, highest_pa = 0.0, 0.0
    for (valve, controller, where), outcomes in by_row.items():
        beyond = sorted(excursion for _, excursion, _ in outcomes)
        fault, largest_m, _ = max(outcomes, key=lambda outcome: outcome[1])
        pressure = max(pressure for _, _, pressure in outcomes)
        worst_m, highest_pa = max(worst_m, largest_m), max(highest_pa, pressure)
        print(f'| {valve} | `{controller}` | {where} | {len(outcomes)} '
              f'| {statistics.median(beyond) * 1e3:.2f} '
              f'| {beyond[round(0.95 * (len(beyond) - 1))] * 1e3:.2f} '
              f'| {largest_m * 1e3:.2f} mm | {fault} | {pressure * 1e-3:.0f} kPa |')
    return 1 if worst_m > ALLOWED_M or highest_pa > 1.02 * LIMIT_PA else 0


def main():
    """Play, print, and write where asked; return the exit code."""
    given = command_line().parse_args()
    with results_page.printed(given, __file__, 'random' * given.random):
        return (show_drawn if given.random else show)(given)


if __name__ == '__main__':
    sys.exit(main())

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
Whether `pam gap` names effects of the muscle as well where nobody recorded the valve command.

    python benchmarks/without_command.py                      # each effect once
    python benchmarks/without_command.py --seed 7 --number 2 --effects creep,hysteresis --nulls 4

Effects are behind a regulator and behind on/off valves in turn.

The rigs are those of the independent simulator under test/hidden. Each hides one effect of
muscle, load or a sensor, 0.6 to 1.5 times as large as usual, or nothing. `pam gap` answers two
times: with all that was recorded, and without valve signal and pressure command. Then the measured
pressure drives the model, in the search and in the proof.

Exit code 1 when a bar is missed.
"""

import argparse
from pathlib import Path
import sys
import tempfile
import time

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / 'test' / 'hidden'), str(ROOT), str(ROOT / 'benchmarks')]

from asking import pam_gap  # noqa: E402, I100
from hidden_effects import read, write  # noqa: E402
import results_page  # noqa: E402
from scoring_judge import is_in_set, is_right, read_answer, wrong_names  # noqa: E402
from truth_bags import copy_without  # noqa: E402
import truth_cases  # noqa: E402
from truth_effects import EFFECTS  # noqa: E402

COMMANDS = {'valve_signal', 'pressure_command'}
WAYS = ('with', 'without')
VALVES = 'ppr', 'hsv'
# Of the pressure sensor, whose reading is an input where it drives the model.
OF_INPUT = ('pressure_bias', 'pressure_gain', 'pressure_lag')
GROUPS = {'muscle': 'muscle', 'load': 'load', 'sensor': 'sensor of contraction or force',
          'input': 'sensor of the pressure', 'null': 'nothing hidden'}


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.strip().split('\n')[0])
    parser.add_argument('--seed', type=int, default=2026, help='of the examination')
    parser.add_argument('--number', type=int, default=1,
                        help='rigs for each effect (default: %(default)s)')
    parser.add_argument('--nulls', type=int, default=8,
                        help='rigs with nothing to find (default: %(default)s)')
    parser.add_argument('--effects', help='only these')
    parser.add_argument('--work', type=Path, help='keep recordings and answers here')
    results_page.add_write(parser, 'without_command')
    return parser


def main():
    """Record, ask, show; return the exit code."""
    args = command_line().parse_args()
    results_page.check(args, __file__)
    with tempfile.TemporaryDirectory(prefix='without_command_') as folder:
        work = args.work or Path(folder)
        found = [examined(case, work / case.name) for case in plan(args)]
    with results_page.printed(args, __file__):
        return show(found)


def plan(args):
    """Return the cases: every effect outside of the valve, then nothing."""
    wanted = args.effects.split(',') if args.effects else [
        name for name, hidden in EFFECTS.items() if hidden.subsystem != 'valve']
    # The kind gives the sizes that effects in pairs have.
    cases = [truth_cases.Case(
        f'{name}_{i}', 'two', VALVES[(i + k) % 2], (args.seed, 7, k, i), (name,))
        for i in range(args.number) for k, name in enumerate(wanted)]
    for i in range(args.nulls):
        valve, kind = VALVES[i % 2], ('null', 'hard_null')[i // 2 % 2]
        cases.append(truth_cases.Case(f'null_{i}', kind, valve, (args.seed, 8, i),
                                      with_force=i % 3 != 2))
    return cases


def examined(case, folder):
    """Return what is true of a case and what was answered, kept in its folder."""
    kept = folder / 'examined.json'
    if not kept.exists():
        key = truth_cases.build(case, folder / 'with', with_gap=False)
        (folder / 'without').mkdir()
        for part in ('fit', 'certify'):
            copy_without(folder / 'with' / part, folder / 'without' / part, COMMANDS)
        (folder / 'without' / 'model.yaml').write_bytes(
            (folder / 'with' / 'model.yaml').read_bytes())
        answers, used_s = {}, {}
        for way in WAYS:
            begun = time.process_time()
            answers[way] = pam_gap(folder / way, [folder / way / 'fit'], folder / f'gap_{way}')
            used_s[way] = time.process_time() - begun
        write(kept, {'key': key, 'answers': answers, 'used_s': used_s})
    return read(kept)


def group_of(key):
    """Return which row of the table a case belongs to."""
    if not key['effects']:
        return 'null'
    name, = key['effects']
    return 'input' if name in OF_INPUT else EFFECTS[name].subsystem


def show(found):
    """Print the tables; return the exit code."""
    print('| hidden | cases | command | right single name | set with the truth | wrong name | '
          'nothing named | processor, median |')
    print('|---|---|---|---|---|---|---|---|')
    for group, title in GROUPS.items():
        mine = [f for f in found if group_of(f['key']) == group]
        for way in WAYS if mine else ():
            print(f'| {title} | {len(mine)} | {way} | {row(mine, way)} |')
    print()
    other = [f for f in found if told(f, 'without') != told(f, 'with')]
    for f in other:
        print(f'- {f["key"]["name"]}: with {told(f, "with")}, without {told(f, "without")}')
    print(f'\nThe other {len(found) - len(other)} answers are the same.')
    # A set with the truth is right where no muscle was empty.
    right = {way: sum(sum(counts(f, way)[:2]) for f in found) for way in WAYS}
    alarms = sum(counts(f, 'without')[2] for f in found)
    valve = sum('valve' not in f['answers']['without'].get('not_judged', {}) for f in found)
    met = right['without'] >= 0.95 * right['with'] and alarms == 0 and valve == 0
    print(f'\nBar: {"met" if met else "**missed**"}. Without the command at least 95 % as many '
          f'are right or in a set as with it ({right["without"]} and {right["with"]}). There is '
          f'no wrong name ({alarms}), and the valve is judged nowhere ({valve}).')
    return int(not met)


def counts(one, way):
    """Return (right, set, wrong, nothing) of an answer, one of them 1; null: right or wrong."""
    answer, key = read_answer(one['answers'][way]), one['key']
    if not key['effects']:
        right = answer.verdict == 'no_gap'
        return int(right), 0, int(not right), 0
    if is_right(answer, key):
        return 1, 0, 0, 0
    if wrong_names(answer, key) or answer.verdict == 'crashed':
        return 0, 0, 1, 0
    return (0, 1, 0, 0) if is_in_set(answer, key) else (0, 0, 0, 1)


def told(one, way):
    """Return the answer in a word: names, a set, or the verdict."""
    answer = read_answer(one['answers'][way])
    return answer.label if answer.verdict != 'ambiguous' else 'set of ' + ' or '.join(
        answer.reported)


def row(mine, way):
    """Return the numbers of a row of the table."""
    sums = np.sum([counts(f, way) for f in mine], axis=0)
    used_s = float(np.median([f['used_s'][way] for f in mine]))
    return (f'{100 * sums[0] / len(mine):.0f} % ({sums[0]}/{len(mine)}) | {sums[1]} | {sums[2]} | '
            f'{sums[3]} | {used_s:.1f} s')


if __name__ == '__main__':
    sys.exit(main())

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
What each decision threshold of `pam gap` decides: halved and doubled, in groups and one by one.

    python benchmarks/criteria_ablation.py --work ablation                # a night on two cores
    python benchmarks/criteria_ablation.py --work ablation --minutes 40   # a piece; again to go on
    python benchmarks/criteria_ablation.py --work ablation --write       # table to docs/results

First hidden cases are answered as usual, and every comparison with a threshold is logged: how
near the compared value came to it. The cases with most thresholds within 20 % of a decision are
kept. On these all thresholds of a group are halved, then doubled. Where that changes an answer,
each threshold of the group is changed by itself. A case in which a threshold never came within
a factor of two of a decision cannot change, and is not asked again.

A share above one half is varied by its distance to one. Answers are kept one by one, so an
interrupted run goes on where it stopped.
"""

import argparse
import dataclasses
import json
import math
from pathlib import Path
import platform
import subprocess
import sys
import time

from joblib import delayed, Parallel
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
# The generator and the scorer live beside their tests; runs from the source tree as it stands.
sys.path[:0] = [str(ROOT / 'test' / 'hidden'), str(ROOT)]

from pam_actuation.bags.load import load_run  # noqa: E402, I100
from pam_sim import load_rig  # noqa: E402
from pam_sim.gap import find_gap  # noqa: E402
from pam_sim.gap.criteria import CRITERIA, Criteria, GROUPS, table  # noqa: E402
from scoring_judge import is_right, read_answer  # noqa: E402
import truth_cases  # noqa: E402

RESULTS = ROOT / 'docs' / 'results' / 'criteria_ablation.md'
CRITERION = {c.name: c for c in table()}
NEAR, FACTOR = 1.2, 2.0
NOTHING, NOT_ASKED = '–', 'not asked'
UNFINISHED = 3               # exit code
SECONDS = 3600.0             # of one search: time must never decide
# Their comparisons cannot be logged: a square root takes the number itself.
NOT_LOGGED = {'named_share'}


class Watched(float):
    """
    A threshold that logs how near compared values come to it.

    ``log`` is {name: [comparisons, least factor between value and threshold]}. What is derived by
    a sum has no factor and counts as equal to the value.
    """

    __array_ufunc__ = None               # NumPy leaves comparisons and arithmetic to this class

    def __new__(cls, value, name, log, exact=True):
        self = super().__new__(cls, value)
        self.name, self.log, self.exact = name, log, exact
        return self

    def _derived(self, value, exact):
        is_number = np.ndim(value) == 0
        return Watched(value, self.name, self.log, exact and self.exact) if is_number else value

    def _seen(self, other):
        entry = self.log.setdefault(self.name, [0, math.inf])
        values = np.abs(np.asarray(other, dtype=float)).ravel()
        entry[0] += values.size
        own = abs(float(self))
        for value in values[np.isfinite(values)]:
            between = 1.0 if not self.exact else max(value, own) / min(value, own) if (
                min(value, own) > 0.0) else (1.0 if value == own else math.inf)
            entry[1] = min(entry[1], between)

    def __lt__(self, other):
        self._seen(other)
        return float(self) < other

    def __le__(self, other):
        self._seen(other)
        return float(self) <= other

    def __gt__(self, other):
        self._seen(other)
        return float(self) > other

    def __ge__(self, other):
        self._seen(other)
        return float(self) >= other

    def __mul__(self, other):
        return self._derived(float(self) * other, True)

    __rmul__ = __mul__

    def __truediv__(self, other):
        return self._derived(float(self) / other, True)

    def __rtruediv__(self, other):
        return self._derived(other / float(self), True)

    def __add__(self, other):
        return self._derived(float(self) + other, False)

    __radd__ = __add__

    def __sub__(self, other):
        return self._derived(float(self) - other, False)

    def __rsub__(self, other):
        return self._derived(other - float(self), False)

    def __pow__(self, other):
        return self._derived(float(self) ** other, True)

    def __neg__(self):
        return self._derived(-float(self), True)


def varied(name, up):
    """Return a threshold halved or doubled; see the head of this file for shares."""
    value = CRITERION[name].value
    if is_near_one(name):
        return 1.0 - (1.0 - value) * (0.5 if up else 2.0)
    return type(value)(value * (FACTOR if up else 1.0 / FACTOR))


def is_near_one(name):
    """Return whether a threshold is a share that is varied by its distance to one."""
    return 0.5 < CRITERION[name].value < 1.0


def variant(names, up):
    """Return the Criteria with some of them changed."""
    return dataclasses.replace(CRITERIA, **{name: varied(name, up) for name in names})


def answer(folder, criteria):
    """Return the verdict and names of a case."""
    rig = load_rig(str(folder / 'model.yaml'))
    result = find_gap(load_run(folder / 'fit'), rig, load_run(folder / 'certify'),
                      seconds=SECONDS, criteria=criteria)
    data = result.to_dict()
    return {'verdict': result.verdict, 'ambiguity_set': data['ambiguity_set'],
            'names': sorted([e['name'] for e in result.effects]
                            + [p.name for p in result.parameters]),
            'right': bool(is_right(read_answer(data), read(folder / 'key.json')))}


def record(case, work):
    """Make a case, answer it as usual with every comparison logged, and keep that."""
    folder = work / 'cases' / case.name
    if not (folder / 'key.json').exists():
        write(folder.with_suffix('.key'), truth_cases.build(case, folder, with_gap=False))
        folder.with_suffix('.key').replace(folder / 'key.json')
    log = {}
    watched = Criteria(**{name: Watched(c.value, name, log) for name, c in CRITERION.items()})
    write(folder / 'usual.json', {'answer': answer(folder, watched), 'log': log})


def is_within_reach(name, log):
    """Return whether a factor of two on a threshold can change anything in a case."""
    count, between = log.get(name, (0, math.inf))
    return name in NOT_LOGGED or bool(count) and (
        between <= FACTOR or is_near_one(name))


def ask(folder, label, names, up):
    """Answer a case with thresholds changed, unless nothing can change or that was done."""
    usual = read(folder / 'usual.json')
    target = folder / f'{label}_{"up" if up else "down"}.json'
    if not target.exists():
        reachable = any(is_within_reach(name, usual['log']) for name in names)
        write(target, answer(folder, variant(names, up)) if reachable else usual['answer'])
    return read(target)


def each(until, function, arguments, jobs):
    """Return function(*a) of all arguments, None where some were not begun in time."""
    def begun(one):
        return (True, function(*one)) if time.time() < until else (False, None)

    found = Parallel(n_jobs=jobs)(delayed(begun)(one) for one in arguments)
    return [one for _, one in found] if all(done for done, _ in found) else None


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--work', type=Path, required=True, help='answers are kept here')
    parser.add_argument('--recorded', type=int, default=165, help='cases that are recorded')
    parser.add_argument('--number', type=int, default=60, help='of them, nearest to a decision')
    parser.add_argument('--seed', type=int, default=2026, help='of the cases')
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--minutes', type=float, default=math.inf)
    parser.add_argument('--write', action='store_true', help=f'write {RESULTS.name}')
    args = parser.parse_args()
    until = time.time() + 60.0 * args.minutes
    cases = truth_cases.plan(args.recorded, args.seed)
    if each(until, record, [(c, args.work) for c in cases if not (
            args.work / 'cases' / c.name / 'usual.json').exists()], args.jobs) is None:
        print('the minutes are over; start again to go on')
        return UNFINISHED
    folders = {c.name: args.work / 'cases' / c.name for c in cases}
    logs = {name: read(folder / 'usual.json')['log'] for name, folder in folders.items()}
    ranked = sorted(logs, key=lambda name: (-sum(
        between < NEAR for _, between in logs[name].values()), name))
    chosen = [folders[name] for name in ranked[:args.number]]
    rows = [('group or threshold', 'value', 'compared in', 'within 2 times in',
             'halved: changed', 'right', 'doubled: changed', 'right')]
    for group in GROUPS:
        names = [c.name for c in CRITERION.values() if c.group == group]
        moved = compared(until, chosen, f'group_{group}', names, args.jobs)
        rows.append((f'**{group}**', '', '', '', *moved))
        for name in names:
            seen = [log[name] for log in logs.values() if log.get(name)]
            near = sum(is_within_reach(name, log) for log in logs.values())
            one = compared(until, chosen, name, [name], args.jobs) if (
                near and (moved[0] or moved[2])) else (NOTHING,) * 4
            rows.append((f'`{name}`', f'{CRITERION[name].value:g}', len(seen), near, *one))
    text = report(rows, args, len(chosen), chosen)
    print(text)
    if args.write:
        RESULTS.write_text(text, encoding='utf-8')
    return UNFINISHED if any(NOT_ASKED in row for row in rows) else 0


def compared(until, folders, label, names, jobs):
    """Return (changed, right) for the thresholds halved, then the same doubled."""
    usual = [read(folder / 'usual.json')['answer'] for folder in folders]
    found = []
    for up in (False, True):
        answers = each(until, ask, [(folder, label, names, up) for folder in folders], jobs)
        if answers is None:
            return (NOT_ASKED,) * 4
        found += [sum(a != u for a, u in zip(answers, usual)), sum(a['right'] for a in answers)]
    return tuple(found)


def report(rows, args, number, folders):
    """Return the table as a page."""
    commit = subprocess.run(['git', 'rev-parse', '--short', 'HEAD'], cwd=ROOT, text=True,
                            capture_output=True, check=False).stdout.strip()
    right = sum(read(folder / 'usual.json')['answer']['right'] for folder in folders)
    lines = [
        '# Ablation of the decision thresholds', '',
        f'`python benchmarks/criteria_ablation.py --recorded {args.recorded} --number {number} '
        f'--seed {args.seed}` on {time.strftime("%Y-%m-%d")}, {platform.machine()}, commit '
        f'{commit}. {len(CRITERION)} thresholds; {args.recorded} cases recorded, the {number} '
        f'nearest to a decision asked again, {right} of them right as they are.', '',
        'Compared and within two times: cases out of all recorded. Changed: answers that differ '
        'in verdict, names or set. A dash: nothing in the group changed, or nothing could. Not '
        'asked: the minutes were over.', '']
    lines += ['| ' + ' | '.join(map(str, row)) + ' |' for row in rows]
    lines.insert(-len(rows) + 1, '|' + '---|' * len(rows[0]))
    return '\n'.join([*lines, ''])


def write(path, data):
    """Write data as a JSON file, whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix('.part')
    part.write_text(json.dumps(data), encoding='utf-8')
    part.replace(path)


def read(path):
    """Return the data of a JSON file."""
    return json.loads(path.read_text(encoding='utf-8'))


if __name__ == '__main__':
    sys.exit(main())

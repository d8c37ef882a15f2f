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

    python benchmarks/criteria_ablation.py --work ablation               # an hour, two cores
    python benchmarks/criteria_ablation.py --work ablation --minutes 40   # a piece; again to go on
    python benchmarks/criteria_ablation.py --work ablation --write       # table to docs/results
    python benchmarks/criteria_ablation.py --work ablation --check 5     # does memory change bits?

First hidden cases are answered as usual, and every comparison with a threshold is logged: how
near the compared value came to it. The cases with most thresholds within 20 % of a decision are
kept. On these all thresholds of a group are halved, then doubled. Where that changes the answer
of a case, each threshold of the group is changed there by itself, in the same direction. A case
in which a threshold never came within a factor of two of a decision cannot change, and is not
asked again.

All questions to a case are asked in a row, in one process. They repeat most fits of each other,
which :mod:`gap_memory` remembers. A share above one half is varied by its distance to one.
Answers are kept one by one, so an interrupted run goes on where it stopped.
"""

import argparse
from contextlib import contextmanager, ExitStack
import dataclasses
import json
import math
from pathlib import Path
import sys
import time
from unittest import mock

from gap_memory import Memory, remembered
import numpy as np
import results_page

ROOT = Path(__file__).resolve().parent.parent
# The generator and the scorer live beside their tests; runs from the source tree as it stands.
sys.path[:0] = [str(ROOT / 'test' / 'hidden'), str(ROOT)]

from pam_actuation.bags.load import load_run  # noqa: E402, I100
from pam_actuation.workers import Workers  # noqa: E402
from pam_sim import load_rig  # noqa: E402
from pam_sim.gap import find_gap, workflow  # noqa: E402
from pam_sim.gap.criteria import CRITERIA, Criteria, GROUPS, table  # noqa: E402
from pam_sim.gap.fit.solver import Solver  # noqa: E402
from scoring_judge import is_right, read_answer  # noqa: E402
import truth_cases  # noqa: E402

CRITERION = {c.name: c for c in table()}
NEAR, FACTOR = 1.2, 2.0
NOTHING = '–'
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


class HiddenCase:
    """
    A recorded case, ready to be searched.

    Parameters
    ----------
    folder : pathlib.Path
        Where its recordings, key and answers are.
    memory : Memory
        What its searches remember.

    """

    def __init__(self, folder, memory):
        self.folder, self.memory = folder, memory
        self.runs, self.rig = {}, load_rig(str(folder / 'model.yaml'))

    def _run(self, name):
        if name not in self.runs:
            self.runs[name] = load_run(self.folder / name)
        return self.runs[name]

    def search(self, criteria):
        """Return everything that a search finds, as a dictionary."""
        return find_gap(self._run('fit'), self.rig, self._run('certify'), seconds=SECONDS,
                        criteria=criteria).to_dict()

    def answer(self, criteria):
        """Return the verdict and names of a case, and whether they are right."""
        with remembered(self.memory), verdict_alone():
            data = self.search(criteria)
        return {'verdict': data['verdict'], 'ambiguity_set': data['ambiguity_set'],
                'names': sorted([e['name'] for e in data['effects']]
                                + [p['name'] for p in data['parameters']]),
                'right': bool(is_right(read_answer(data), read(self.folder / 'key.json')))}

    def ask(self, label, names, up):
        """Answer with thresholds changed, unless nothing can change or that was done."""
        usual = read(self.folder / 'usual.json')
        target = answered(self.folder, label, up)
        if not target.exists():
            near = [name for name in names if is_within_reach(name, usual['log'])]
            write(target, self.answer(variant(near, up)) if near else usual['answer'])
        return read(target) != usual['answer']


@contextmanager
def verdict_alone():
    """Leave out what the workflow only reports once it has its verdict."""
    with ExitStack() as stack:
        for name, nothing in (('places', []), ('fingerprint', {}), ('sizes_or_reasons', {}),
                              ('explain', '')):
            stack.enter_context(mock.patch.object(
                workflow, name, lambda *_, nothing=nothing: nothing))
        yield


def compares_bounds(settle):
    """Return ``Solver.settle`` that compares every number it fits with the bounds of its box."""
    def settled(solver, *arguments):
        x, errors = settle(solver, *arguments)
        for problem, (_, known_z) in zip(solver.problems, solver.split(x)[1]):
            abs(np.array([z for k, z in zip(problem.known, known_z) if k.of_rig
                          and k.name not in solver.hypothesis.numbers])) < solver.estimator.box
        return x, errors
    return settled


def record(case, work):
    """Make a case, answer it as usual with every comparison logged, and keep that."""
    folder = work / 'cases' / case.name
    if (folder / 'usual.json').exists():
        return
    if not (folder / 'key.json').exists():
        write(folder.with_suffix('.key'), truth_cases.build(case, folder, with_gap=False))
        folder.with_suffix('.key').replace(folder / 'key.json')
    log = {}
    watched = Criteria(**{name: Watched(c.value, name, log) for name, c in CRITERION.items()})
    with mock.patch.object(Solver, 'settle', compares_bounds(Solver.settle)):
        usual = HiddenCase(folder, Memory()).answer(watched)
    write(folder / 'usual.json', {'answer': usual, 'log': log})


def ask_groups(folder):
    """Ask a case with every group of thresholds changed."""
    case = HiddenCase(folder, Memory())
    for group, names in members().items():
        for up in (False, True):
            case.ask(f'group_{group}', names, up)


def ask_single(folder):
    """Ask a case with single thresholds changed, of the groups that changed its answer."""
    case, usual = HiddenCase(folder, Memory()), read(folder / 'usual.json')
    for group, names in members().items():
        for up in (False, True):
            if case.ask(f'group_{group}', names, up):
                for name in names:
                    if is_within_reach(name, usual['log']):
                        case.ask(name, [name], up)


def members():
    """Return the names of the thresholds of every group."""
    return {group: [c.name for c in CRITERION.values() if c.group == group] for group in GROUPS}


def answered(folder, label, up):
    """Return the file that holds an answer."""
    return folder / f'{label}_{"up" if up else "down"}.json'


def is_within_reach(name, log):
    """Return whether a factor of two on a threshold can change anything in a case."""
    count, between = log.get(name, (0, math.inf))
    return name in NOT_LOGGED or bool(count) and (
        between <= FACTOR or is_near_one(name))


def check(folders):
    """Print whether searches that remember find the same as those that do not."""
    for folder in folders:
        case, plain = HiddenCase(folder, Memory()), HiddenCase(folder, Memory())
        for group, names in members().items():
            for up in (False, True):
                criteria = variant(names, up)
                with remembered(case.memory):
                    found = case.search(criteria)
                wanted = plain.search(criteria)
                for data in (found, wanted):        # how long it took and how much was simulated
                    data.pop('runtime_s'), data.pop('simulations')
                same = json.dumps(found, default=str) == json.dumps(wanted, default=str)
                print(folder.name, group, 'up' if up else 'down', 'same' if same else 'OTHER',
                      flush=True)


def each(until, function, arguments, args):
    """Call function(*a) for all arguments; return whether all were begun in time."""
    done = True
    with Workers(args.jobs, args.cluster, processes=True) as workers:
        for _, result in workers.stream(begun, until, [(function, one) for one in arguments]):
            if isinstance(result, Exception):
                raise result
            done &= result
    return done


def begun(until, task):
    """Do a task; return False and do nothing after the end of the time."""
    function, arguments = task
    if time.time() >= until:
        return False
    function(*arguments)
    return True


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--work', type=Path, required=True, help='answers are kept here')
    parser.add_argument('--recorded', type=int, default=165, help='cases that are recorded')
    parser.add_argument('--number', type=int, default=60, help='of them, nearest to a decision')
    parser.add_argument('--seed', type=int, default=2026, help='of the cases')
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--cluster', metavar='ADDRESS', help='run on a Dask (tcp://) or Ray '
                        '(ray://) cluster that sees --work; its workers need test/hidden and '
                        'benchmarks in PYTHONPATH')
    parser.add_argument('--minutes', type=float, default=math.inf)
    parser.add_argument('--check', type=int, default=0, metavar='CASES',
                        help='compare so many of them with and without memory, no more')
    results_page.add_write(parser, 'criteria_ablation')
    return parser


def main():
    """Ask what is left to ask, print the table; return the exit code."""
    args = command_line().parse_args()
    results_page.check(args, __file__)
    until = time.time() + 60.0 * args.minutes
    cases = truth_cases.plan(args.recorded, args.seed)
    done = each(until, record, [(c, args.work) for c in cases], args)
    folders = [args.work / 'cases' / c.name for c in cases]
    logs = {folder: read(folder / 'usual.json')['log'] for folder in folders
            if (folder / 'usual.json').exists()}
    chosen = sorted(logs, key=lambda folder: (-sum(
        between < NEAR for _, between in logs[folder].values()), folder.name))[:args.number]
    if args.check:
        check(chosen[:args.check])
        return 0
    for ask in (ask_groups, ask_single):
        done = done and each(until, ask, [(folder,) for folder in chosen], args)
    with results_page.printed(args, __file__):
        print(report(logs, chosen))
    return 0 if done else UNFINISHED


def counted(folders, label, up):
    """Return (cases asked, answers that changed, of them right before, right now) of a label."""
    asked = [(read(f / 'usual.json')['answer'], read(answered(f, label, up)))
             for f in folders if answered(f, label, up).exists()]
    moved = [(usual, now) for usual, now in asked if usual != now]
    return (len(asked), len(moved), sum(u['right'] for u, _ in moved),
            sum(n['right'] for _, n in moved))


def rows_of(logs, chosen):
    """Return the rows of the table, group by group."""
    rows = [('group or threshold', 'value', 'compared in', 'within 2 times in',
             'halved: changed', 'right', 'doubled: changed', 'right')]
    for group, names in members().items():
        moved = [counted(chosen, f'group_{group}', up) for up in (False, True)]
        rows.append((f'**{group}**', '', '', '', *sum((cells(*m) for m in moved), ())))
        for name in names:
            seen = sum(bool(log.get(name)) for log in logs.values())
            near = sum(is_within_reach(name, log) for log in logs.values())
            own = [counted(chosen, name, up) for up in (False, True)]
            rows.append((f'`{name}`', f'{CRITERION[name].value:g}', seen, near,
                         *sum((cells(*o) for o in own), ())))
    return rows


def cells(asked, moved, before, now):
    """Return what two columns say."""
    return (NOTHING,) * 2 if not asked else (
        f'{moved} of {asked}', f'{before} → {now}' if moved else NOTHING)


def report(logs, chosen):
    """Return the table and what it counts."""
    right = sum(read(folder / 'usual.json')['answer']['right'] for folder in chosen)
    rows = rows_of(logs, chosen)
    lines = [
        f'{len(CRITERION)} thresholds; {len(logs)} cases recorded, the {len(chosen)} nearest to '
        f'a decision asked again, {right} of them right as they are.', '']
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

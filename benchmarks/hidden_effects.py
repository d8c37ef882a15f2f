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
How often `pam gap` names the hidden effect: rigs made by an independent simulator.

    python benchmarks/hidden_effects.py                      # 330 cases
    python benchmarks/hidden_effects.py --number 33 --seed 7 --jobs 2 --kinds single,null
    python benchmarks/hidden_effects.py --work exam --minutes 40     # a piece; again to go on

There are four phases. All cases are recorded, and the key is sealed. `pam gap` answers every case
from its bags. The experiments that it suggests for the ambiguous cases are run on the hidden rigs
and answered. Then the key is opened, and everything is scored. With --work DIR each recording and
each answer is kept as soon as it is there; an interrupted run goes on where it stopped. With
--minutes it stops by itself between two cases.

Exit code 1 when a bar is missed, 3 when the minutes were over before all was answered.
"""

import argparse
import json
import os
from pathlib import Path
import platform
import shutil
import sys
import tempfile
import time

from tqdm import tqdm

ROOT = Path(__file__).resolve().parent.parent
# The generator and the scorer live beside their tests; runs from the source tree as it stands.
sys.path[:0] = [str(ROOT / 'test' / 'hidden'), str(ROOT), str(ROOT / 'benchmarks')]

from asking import pam_gap  # noqa: E402, I100
from pam_actuation.workers import Workers  # noqa: E402
from pam_sim.files import write_text  # noqa: E402
import results_page  # noqa: E402
from scoring_table import scored, table  # noqa: E402
from scoring_text import report  # noqa: E402
import truth_cases  # noqa: E402
from truth_commands import NotRunnable  # noqa: E402
from truth_effects import EFFECTS  # noqa: E402
import truth_key  # noqa: E402

FAMILIES = {name: hidden.family for name, hidden in EFFECTS.items()}
SMALL = 0.3                  # materiality asked for where the gap is below 1 sigma
UNFINISHED = 3               # exit code


class OutOfMinutes(Exception):
    """The time for this piece of the examination is over."""


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--number', type=int, default=330, help='cases (default: 330)')
    parser.add_argument('--seed', type=int, default=2026, help='of the examination')
    parser.add_argument('--jobs', type=int, default=2, help='processes (default: 2)')
    parser.add_argument('--together', type=int, metavar='N', help='records that are answered at '
                        'the same time (default: --jobs); 1 times a record on all cores')
    parser.add_argument('--cluster', metavar='ADDRESS', help='run on a Dask (tcp://) or Ray '
                        '(ray://) cluster that sees --work; its workers need test/hidden and '
                        'benchmarks in PYTHONPATH')
    parser.add_argument('--kinds', help=f'only these, of {", ".join(truth_cases.SHARES)}')
    parser.add_argument('--rivals', type=int, default=0, metavar='N',
                        help='answer the first N cases by the other methods, too')
    parser.add_argument('--work', type=Path, help='keep recordings and answers here')
    parser.add_argument('--again', action='store_true',
                        help='with --work: keep the recordings, answer anew (only with the '
                        'first piece)')
    parser.add_argument('--seconds', type=float, default=None, help='time budget of `pam gap` for '
                        'one case (default: its own); on a busy machine give more')
    parser.add_argument('--minutes', type=float, default=float('inf'), metavar='N',
                        help='with --work: begin no case after N minutes; start again to go on')
    parser.add_argument('--out', type=Path, help='write the report here as well')
    results_page.add_write(parser, 'hidden_effects')
    parser.add_argument('--part', default='', metavar='WORD',
                        help='with --write: the part of the page with this word')
    return parser


def main():
    """Examine; return the exit code."""
    args = command_line().parse_args()
    results_page.check(args, __file__, args.part)
    args.together = args.together or args.jobs
    args.until = time.time() + 60.0 * args.minutes
    cases = truth_cases.plan(args.number, args.seed)
    if args.kinds:
        cases = [c for c in cases if c.kind in args.kinds.split(',')]
    if args.work:
        args.work.mkdir(parents=True, exist_ok=True)
        try:
            return examine(cases, args.work, args)
        except OutOfMinutes as reached:
            print(f'{reached}; start again to go on')
            return UNFINISHED
    with tempfile.TemporaryDirectory(prefix='hidden_effects_') as folder:
        return examine(cases, Path(folder), args)


def examine(cases, work, args):
    """Run the four phases; return the exit code."""
    if not (work / 'sealed.json').exists():
        keys = each(args, 'recording', record, [(c, work) for c in cases], args.jobs)
        (work / 'orders.json').write_text(json.dumps({
            c.name: SMALL if 0.0 < max(key['gap_sigma'].values()) < 1.0 else 1.0
            for c, key in zip(cases, keys)}), encoding='utf-8')
        truth_key.seal({c.name: key for c, key in zip(cases, keys)}, work)
        shutil.rmtree(work / 'recorded')
    orders = read(work / 'orders.json')
    if not {c.name for c in cases} <= set(orders):
        sys.exit(f'{work} holds another examination: give its --seed, at most its --number')
    if args.again:
        for path in (*work.glob('*/answer.json'), *work.glob('*/after.json')):
            path.unlink()
    each(args, 'answering', answer, [
        (work / c.name, 'answer', ['fit'], orders[c.name], args.seconds) for c in cases])
    each(args, 'next experiments', follow, [
        (c, work, orders[c.name], args.seconds) for c in cases if c.kind == 'ambiguous'])
    rivals = {}
    if args.rivals:
        from hidden_rivals import METHODS
        for name in METHODS:
            found = each(args, name, other, [
                (work / c.name, name) for c in cases[:args.rivals]], args.jobs)
            rivals[name] = [(c.name, one) for c, one in zip(cases, found)]
    answers = {c.name: read(work / c.name / 'answer.json') for c in cases}
    keys = truth_key.open_keys(work, answers, [c.name for c in cases])
    found = [scored(keys[c.name], answers[c.name]['result'],
                    (read(work / c.name / 'after.json') or {}).get('result'),
                    answers[c.name]['wall_s'], answers[c.name]['processor_s']) for c in cases]
    others = {name: [scored(keys[case], one) for case, one in given]
              for name, given in rivals.items()}
    text = '\n'.join([
        f'{len(cases)} cases, seed {args.seed}, {args.together} at a time on '
        f'{os.cpu_count()} cores ({platform.machine()}), '
        f'{sum(a["wall_s"] for a in answers.values()) / 60.0:.0f} min of answers.', '',
        report(found, FAMILIES, others), ''])
    with results_page.printed(args, __file__, args.part):
        print(text)
    if args.out:
        write_text(args.out, text)
    return int(any(row.met is False for row in table(found, FAMILIES)))


def each(args, what, function, arguments, jobs=None):
    """
    Return function(*a) of all arguments, in order, on ``jobs`` processes, with a progress bar.

    Raises OutOfMinutes where some were not begun in time.
    """
    found = {}
    with Workers(jobs or args.together, args.cluster, processes=True) as workers:
        for (number, *_), result in tqdm(
                workers.stream(in_time, args.until, [
                    (number, function, a) for number, a in enumerate(arguments)]),
                total=len(arguments), desc=what, disable=None):
            if isinstance(result, Exception):
                raise result
            found[number] = result
    done = sum(begun for begun, _ in found.values())
    if done < len(found):
        raise OutOfMinutes(f'{what}: {done} of {len(found)} done')
    return [found[number][1] for number in range(len(arguments))]


def in_time(until, task):
    """Return (True, what the function returns), (False, None) after the end of the time."""
    _, function, arguments = task
    return (True, function(*arguments)) if time.time() < until else (False, None)


def record(case, work):
    """Record one case unless that was done; return its key, kept until all are sealed."""
    kept = work / 'recorded' / f'{case.name}.json'
    if not kept.exists():
        shutil.rmtree(work / case.name, ignore_errors=True)
        write(kept, truth_cases.build(case, work / case.name))
    return read(kept)


def answer(folder, name, runs, materiality, seconds):
    """Call `pam gap` on the runs of a case, unless that was done; keep its result."""
    target = folder / f'{name}.json'
    if target.exists():
        return
    begun, used = time.perf_counter(), time.process_time()
    result = pam_gap(folder, [folder / run for run in runs], folder / name, materiality, seconds)
    write(target, {'result': result, 'wall_s': time.perf_counter() - begun,
                   'processor_s': time.process_time() - used})


def other(folder, name):
    """Return what another method answers, kept like the answers of `pam gap`."""
    from hidden_rivals import METHODS
    target = folder / f'{name.split()[0]}.json'
    if not target.exists():
        try:
            result = METHODS[name](folder)
        except Exception as error:                # as for `pam gap`: an answer, a wrong one
            result = {'verdict': 'crashed', 'reason': repr(error)}
        write(target, result)
    return read(target)


def follow(case, work, materiality, seconds):
    """Run the experiment suggested for an ambiguous case and answer again, with both runs."""
    folder = work / case.name
    suggestion = read(folder / 'answer.json')['result'].get('next_experiment') or {}
    experiment = suggestion.get('experiment')
    if not experiment or (folder / 'after.json').exists():
        return
    experiment = {**experiment, 'needs': [
        *(experiment.get('needs') or ()), *(suggestion.get('needs') or ())]}
    shutil.rmtree(folder / 'next', ignore_errors=True)
    try:
        truth_cases.run_suggested(case, folder / 'next', experiment)
    except (NotRunnable, TypeError, KeyError) as error:
        write(folder / 'after.json', {'result': {'verdict': 'crashed', 'reason': repr(error)}})
        return
    answer(folder, 'after', ['fit', 'next'], materiality, seconds)


def write(path, data):
    """Write data as a JSON file, whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix('.part')
    part.write_text(json.dumps(data), encoding='utf-8')
    part.replace(path)


def read(path):
    """Return the data of a JSON file, None if it is missing."""
    return json.loads(path.read_text(encoding='utf-8')) if path.exists() else None


if __name__ == '__main__':
    sys.exit(main())

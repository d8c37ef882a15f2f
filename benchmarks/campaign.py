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
Campaigns: what they find, what a kill costs them, and equal bytes on every kind of worker.

    python benchmarks/campaign.py page --work lab         # 200 recordings; again to go on
    python benchmarks/campaign.py kills --work lab        # killed 20 times
    python benchmarks/campaign.py clusters --work lab     # Dask and Ray on this machine
    python benchmarks/campaign.py losses --work lab       # a worker or the scheduler is lost
    python benchmarks/campaign.py places --work lab       # all that takes a cluster
    python benchmarks/campaign.py tune                    # the costs of a generation, two ways
    python benchmarks/campaign.py waits                   # what a search without generations gains

With --write each part goes into docs/results/campaign.md. `page` records and answers what is
missing in --work; the other parts take its first recordings. Exit code 1 when a bar is missed.
"""

import argparse
import functools
import os
from pathlib import Path
import statistics
import sys
import time

import joblib
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / 'benchmarks')]
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

import campaign_clusters  # noqa: E402, I100
import campaign_kills  # noqa: E402
import campaign_places  # noqa: E402
import campaign_records as lab  # noqa: E402
import campaign_waits  # noqa: E402
from pam_actuation.campaign import find_cases, run_campaign, Settings  # noqa: E402
from pam_actuation.campaign.changes import is_tested  # noqa: E402
from pam_actuation.campaign.findings import began, find  # noqa: E402
from pam_actuation.campaign.page import campaign_page  # noqa: E402
from pam_actuation.campaign.results import write_results  # noqa: E402
from pam_actuation.campaign.store import TIMES  # noqa: E402
from pam_actuation.control.config import load_controller  # noqa: E402
from pam_actuation.experiments import load_experiment  # noqa: E402
from pam_actuation.tuning.loops_of_rigs import loops_of  # noqa: E402
from pam_actuation.tuning.problem import cost_of, costs_of, Problem  # noqa: E402
from pam_actuation.tuning.space import default_axes, from_unit  # noqa: E402
from pam_actuation.workers import Workers  # noqa: E402
from pam_sim import load_rig  # noqa: E402
import results_page  # noqa: E402
from tqdm import tqdm  # noqa: E402

NEAR_DAYS = 1.0
EXPERIMENTS = ('tuning_quarter_hz', 'tuning_half_hz', 'tuning_one_hz')


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.strip().split('\n\n')[0])
    parser.add_argument('part', choices=(
        'page', 'kills', 'clusters', 'losses', 'places', 'tune', 'waits'))
    parser.add_argument('--work', type=Path, default=Path('lab'),
                        help='recordings and results are kept here (default: lab)')
    parser.add_argument('--jobs', type=int, default=2, help='processes (default: 2)')
    parser.add_argument('--cases', type=int, default=60,
                        help='recordings of kills, clusters and losses (default: 60)')
    parser.add_argument('--ray', action='store_true', help='of clusters and places: Ray as well')
    parser.add_argument('--kept', action='store_true',
                        help='of places: compare what an earlier run left in --work, run the rest')
    parser.add_argument('--kills', type=int, default=20, help='of kills (default: 20)')
    parser.add_argument('--seed', type=int, default=1, help='of the moments of kills')
    parser.add_argument('--seeds', type=int, default=4, help='of waits (default: 4)')
    parser.add_argument('--rounds', type=int, default=None,
                        help='of tune (default: 15) and losses (default: 10)')
    results_page.add_write(parser, 'campaign')
    return parser


def main():
    """Run one part; return the exit code."""
    args = command_line().parse_args()
    args.rounds = args.rounds or {'losses': 10}.get(args.part, 15)
    with results_page.printed(args, __file__, args.part):
        if args.part == 'kills':
            return campaign_kills.show(args)
        return {'page': page, 'tune': tune, 'clusters': campaign_clusters.show,
                'losses': campaign_clusters.losses,
                'places': campaign_places.show, 'waits': campaign_waits.show}[args.part](args)


def page(args):
    """Record, work on all, compare the page with what was put in; return the exit code."""
    load = os.getloadavg()[0]
    days = [(rig, day) for day in range(1, lab.DAYS + 1) for rig in range(1, lab.RIGS + 1)]
    with Workers(args.jobs, processes=True) as workers:
        for _, error in tqdm(workers.stream(lab.record_task, args.work / 'lab', days),
                             total=len(days), desc='recording', disable=None):
            if error is not None:
                raise error
    cases, out = find_cases(args.work / 'lab'), args.work / 'lab_out'
    with tqdm(total=len(cases), desc='campaign', disable=None) as bar:
        campaign = run_campaign(cases, Settings('gap', lab.MODEL), out, args.jobs,
                                progress=lambda done: bar.update(done - bar.n))
    began_s = time.perf_counter()
    found = find(campaign)
    write_results(campaign, found, out, campaign_page(campaign, found))
    page_s = time.perf_counter() - began_s
    first = find_cases(args.work / 'lab')[0].time
    rows, others = compared(found.changes, first)
    right = not (others or found.odd or campaign.failed)
    print('| rig | put in | from day | the page says | from day |\n|---|---|---|---|---|')
    for (rig, name, shape, day), (said, on) in zip(lab.TRUTH, rows):
        right &= said == shape and abs(on - day) <= NEAR_DAYS
        print(f'| {rig} | {name}, {shape} | {day} | {said} | {on:g} |')
    print(f'\nOther changes named: {", ".join(others) or "none"}. Recordings that stand out: '
          f'{len(found.odd)}. Failed: {len(campaign.failed)}. Series tested: '
          f'{sum(map(is_tested, found.series))} of {len(found.series)}.\n\n'
          'Sentences of the page:\n')
    print('\n'.join(f'- {one}' for one in found.sentences()))
    times = [tuple(map(float, line.split(',')[1:])) for line in
             (out / TIMES).read_text(encoding='utf-8').splitlines()]
    wall_s, cpu_s = (sum(column) for column in zip(*times))
    print(f'\n{len(times)} recordings took {cpu_s / 60:.1f} min of processor time, '
          f'{cpu_s / len(times):.2f} s each: {cpu_s / 60 / args.jobs:.1f} min on '
          f'{args.jobs} cores that do nothing else. '
          f'{"This machine was shared: they" if load > 1.0 else "They"} took '
          f'{wall_s / 60 / args.jobs:.1f} min with {args.jobs} processes. '
          f'Comparing them and writing the page took {page_s:.1f} s.')
    return int(not right)


def compared(changes, first):
    """
    Compare the changes that the page names with those that were put in.

    Parameters
    ----------
    changes : list of list of Change
        Those told together stand together.
    first : float
        Time of the first day [days].

    Returns
    -------
    rows : list of (str, float)
        Shape and day of each change that was put in, as the page says; "nothing" if it is silent.
    others : list of str
        All other changes.

    """
    told = {}
    for change in (one for group in changes for one in group):
        told.setdefault((change.series.rig, change.series.name), []).append(change)
    rows = []
    for rig, name, *_ in lab.TRUTH:
        found = told.get((rig, name))
        rows.append((found[0].shape, began(found[0]) - first + 1.0) if found
                    else ('nothing', float('nan')))
        told[rig, name] = found[1:] if found else []
    return rows, [' '.join(key) for key, found in told.items() for _ in found]


def tune(args):
    """Calculate the costs of generations in the former and the present way; return 0 if equal."""
    rig = load_rig('dmsp_5_300_realistic')
    controller = load_controller('sofc_ppr', rig)
    loops, _ = loops_of([rig], [load_experiment(one) for one in EXPERIMENTS], 0, controller, rig)
    problem, axes = Problem(loops, controller), default_axes(controller)
    random = np.random.default_rng(args.seed)
    spent, equal = {'before': [], 'now': []}, True
    with joblib.Parallel(n_jobs=args.jobs, prefer='threads') as parallel, \
            Workers(args.jobs) as workers:

        def before(points):
            call = joblib.delayed(functools.partial(cost_of, problem))
            return parallel(call(point) for point in points)

        ways = {'before': before, 'now': functools.partial(costs_of, workers, problem)}
        for number in range(args.rounds + 1):
            points = [from_unit(axes, point) for point in random.uniform(size=(24, len(axes)))]
            found = {}
            for name in sorted(ways, reverse=bool(number % 2)):
                wall, cpu = time.perf_counter(), time.process_time()
                found[name] = ways[name](points)
                if number:      # the first round compiles
                    spent[name].append((time.perf_counter() - wall, time.process_time() - cpu))
            equal &= found['before'] == found['now']
    print(f'{args.rounds} generations of 24 points on {len(loops)} loops, {args.jobs} threads. '
          'Both ways ran in turn in one process. Before, a task was always a point. Now the code '
          'asks first how many workers there are.\n')
    print('| | wall clock a generation, median [s] | processor time, median [s] |\n|---|---|---|')
    for name, measured in spent.items():
        wall, cpu = (statistics.median(column) for column in zip(*measured))
        print(f'| {name} | {wall:.2f} | {cpu:.3f} |')
    ratio = statistics.median(
        new[1] / old[1] for old, new in zip(spent['before'], spent['now']))
    print(f'\nNow against before: {ratio:.3f} times the processor time (median of pairs). Costs '
          f'are {"equal to the bit" if equal else "different"}.')
    return int(not equal)


if __name__ == '__main__':
    sys.exit(main())

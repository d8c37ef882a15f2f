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
Part `waits` of `benchmarks/campaign.py`: what a search without generations gains and costs.

``Overlapping`` is such a search: the differential evolution of ``pam tune``, but as soon as the
oldest point under way has its cost, another one is asked. A point is made from the costs of all
points but those under way, in the order of asking, so the number of workers changes nothing.
"""

from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
import math
import statistics
import sys
import time

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.tuning import search
from pam_actuation.tuning.loops_of_rigs import loops_of
from pam_actuation.tuning.problem import Problem
from pam_actuation.tuning.space import default_axes, from_unit
from pam_sim import load_rig

MEMBERS, LOOPS = 24, 3
GENERATIONS = 20
LONGEST = 2                     # times the rollouts, for the search that overlaps
TASK_S, WAITED = 0.1, 5         # mean length of a task that waits, generations
SIZES = (4, 8, 24, 72)
LENGTHS = {'equal': ((1, 1, 1), 0.0), 'loops 4 : 2 : 1': ((4, 2, 1), 0.0),
           'points differ': ((1, 1, 1), 0.5)}
PROBLEMS = (('sofc_ppr', 'ppr'), ('pid', 'ppr'), ('sofc_hsv', 'hsv'))
EXPERIMENTS = ('tuning_quarter_hz', 'tuning_half_hz', 'tuning_one_hz')


class Overlapping:
    """Asks for points of the unit cube, one for each cost it is told."""

    def __init__(self, start, members, seed):
        self.points = search._first_generation(start, members, seed)
        self.costs = np.full(members, np.inf)
        self.asked, self.told, self.seed = list(self.points), 0, seed

    def follow(self, cost):
        """Take the cost of the oldest point under way; return another point."""
        members, member = len(self.points), self.told % len(self.points)
        self.told += 1
        trial = self.asked.pop(0)
        if cost <= self.costs[member]:
            self.points[member], self.costs[member] = trial, cost
        random = np.random.default_rng((self.seed, self.told))
        one, other = random.choice(np.delete(np.arange(members), member), 2, replace=False)
        best = self.points[int(np.argmin(self.costs))]
        mutant = best + random.uniform(0.4, 0.9) * (self.points[one] - self.points[other])
        taken = random.uniform(size=len(mutant)) < 0.8
        taken[random.integers(len(mutant))] = True
        point = np.where(taken, mutant, self.points[member])
        outside = (point < 0.0) | (point > 1.0)
        point[outside] = random.uniform(size=int(outside.sum()))
        self.asked.append(point)
        return point


def show(args):
    """Measure waiting and quality; print; return 0."""
    print(f'{WAITED} generations of {MEMBERS} points on {LOOPS} loops. A task waits, '
          f'{1e3 * TASK_S:.0f} ms in the mean, in so many threads. Efficiency is the time waited '
          'in all, divided by wall clock and number. "Loops 4 : 2 : 1" has experiments of '
          'different length; where "points differ", their lengths scatter by 50 %.\n')
    print('| lengths | workers | points in turn | longest loops first (`pam tune`) | '
          'overlapping |\n|---|---|---|---|---|')
    for words, (loops, spread) in LENGTHS.items():
        lengths = lengths_of(loops, spread)
        for size in SIZES:
            told = [lengths.sum() / size / way(lengths, size)
                    for way in (in_turn, longest_first, overlapping)]
            print(f'| {words} | {size} | {" | ".join(f"{one:.2f}" for one in told)} |')
    print(f'\nThe same search, {MEMBERS * GENERATIONS * LOOPS} rollouts, from the middle of the '
          f'box, {args.seeds} seeds. The last column is the number of rollouts after which the '
          'overlapping search is as good, as a ratio: median, of an even number the upper one, '
          f'and each. At most {LONGEST} were tried: "> {LONGEST}" was not as good then.\n')
    print('| controller | cost in generations, median [mm] | overlapping | overlapping against '
          'generations, median (each) | rollouts for the same cost, median (each) |\n'
          '|---|---|---|---|---|')
    for name, valve in PROBLEMS:
        found = [quality(name, valve, seed) for seed in range(args.seeds)]
        usual, other, needed = (list(column) for column in zip(*found))
        ratios = [b / a for a, b in zip(usual, other)]
        print(f'| {name} | {statistics.median(usual):.4f} | {statistics.median(other):.4f} | '
              f'{statistics.median(ratios):.2f} ({", ".join(f"{r:.2f}" for r in ratios)}) | '
              f'{ratio_text(statistics.median_high(needed))} '
              f'({", ".join(map(ratio_text, needed))}) |')
    return 0


def ratio_text(ratio):
    """Return a ratio of rollouts as text; infinite is one that was not reached."""
    return f'> {LONGEST}' if math.isinf(ratio) else f'{ratio:.2f}'


def lengths_of(loops, spread):
    """Return how long tasks wait [s], shape (points, loops)."""
    random = np.random.default_rng(0)
    factor = np.exp(spread * random.standard_normal(MEMBERS * WAITED))
    return TASK_S * np.outer(factor / factor.mean(), np.array(loops) / np.mean(loops))


def in_turn(lengths, size):
    """Return the wall clock of generations [s], tasks point by point."""
    return _generations(lengths, size, lambda points: points.ravel())


def longest_first(lengths, size):
    """Return the wall clock of generations [s], with the longest experiments first."""
    def ordered(points):
        order = np.argsort(-lengths.mean(axis=0), kind='stable')
        equal = np.ptp(lengths.mean(axis=0)) < 1e-12
        return points.ravel() if equal else points[:, order].T.ravel()
    return _generations(lengths, size, ordered)


def _generations(lengths, size, ordered):
    began_s = time.perf_counter()
    with ThreadPoolExecutor(size) as pool:
        for generation in np.split(lengths, WAITED):
            list(pool.map(time.sleep, ordered(generation)))
    return time.perf_counter() - began_s


def overlapping(lengths, size):
    """Return the wall clock [s] with always ``MEMBERS`` points under way, told in order."""
    began_s = time.perf_counter()
    with ThreadPoolExecutor(size) as pool:
        def begin(point):
            return {pool.submit(time.sleep, one) for one in np.sort(point)[::-1]}
        coming = iter(lengths)
        points = [begin(next(coming)) for _ in range(MEMBERS)]
        while points:
            wait(set.union(*points[:1]), return_when=FIRST_COMPLETED)
            points[0] = {task for task in points[0] if not task.done()}
            if not points[0]:
                points.pop(0)
                further = next(coming, None)
                if further is not None:
                    points.append(begin(further))
    return time.perf_counter() - began_s


def quality(name, valve, seed):
    """Return both costs [mm], and the ratio of rollouts for the same cost (inf: not reached)."""
    rig = load_rig('dmsp_5_300_realistic', valve=valve)
    controller = load_controller(name, rig)
    loops, _ = loops_of([rig], [load_experiment(one) for one in EXPERIMENTS], 0, controller, rig)
    problem, axes = Problem(loops, controller), default_axes(controller)
    start, count = np.full(len(axes), 0.5), MEMBERS * GENERATIONS

    def cost(point):
        return problem.cost(from_unit(axes, point))

    usual = search.minimise(lambda points: [cost(point) for point in points], start, MEMBERS,
                            GENERATIONS, seed).cost
    other, told = Overlapping(start, MEMBERS, seed), []
    point = other.asked[0]
    while len(told) < count or min(told) > usual and len(told) < LONGEST * count:
        told.append(cost(point))
        other.follow(told[-1])
        point = other.asked[0]
    needed = next((k for k in range(1, len(told) + 1) if told[k - 1] <= usual), math.inf)
    print(f'{name} {seed}: {usual:.4f} {min(told[:count]):.4f} {ratio_text(needed / count)}',
          file=sys.stderr, flush=True)
    return usual, min(told[:count]), needed / count

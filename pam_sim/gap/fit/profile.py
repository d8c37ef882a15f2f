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
How far a number may be from its solution before the errors rise.

The covariance says it by the slopes at the solution. Where the data determine a combination of
numbers alone, these are nearly flat, and what they say is the error of their steps. So the errors
themselves are followed outwards: a number is held farther and farther away, all others are fitted
again, until the cost has risen as for 95 % (Raue et al. 2009, Bioinformatics 25(15), 1923). It
begins where the covariance has its end, which stays if the cost has risen about as much there.
"""

from collections.abc import Sequence
from itertools import product
import math
from typing import NamedTuple, Protocol

import numpy as np
from pam_sim.annotations import FloatArray

NORMAL_95 = 1.96
RISE_95 = 3.841              # of the cost; 95 % of chi squared with one degree of freedom
FARTHER = 2.0                # next try, where the cost has not risen enough
FLAT, FLAT_FARTHER = 0.1, 10.0       # share of the rise that is hardly one; next try there
TRIES = 12                   # an end
NEARLY = 0.9                 # of the rise wanted, that is enough
CLOSE = 0.03                 # of the way, between the last tries
LEAST_PART, MOST_PART = 0.1, 0.9     # of the way between two tries
STEEP = 30.0                 # times the rise wanted: far off, with no root to follow
STEPS = 5                    # of a fit, one simulation each
GAIN = 0.02                  # of the cost, which ends them
SIGNS = (-1.0, 1.0)          # of the way to both ends
TIGHT = 1e-9                 # least room of a number
ROUNDING = 1e-9              # information of a number that nothing depends on


class Problem(Protocol):
    """A bounded least-squares problem."""

    bounds: tuple[FloatArray, FloatArray]

    def residuals(self, x: FloatArray) -> FloatArray:
        """Return the weighted errors, then the priors."""

    def slopes(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of ``residuals``."""


def profile_ends(problem: Problem, x: FloatArray, groups: Sequence[Sequence[int]],
                 covariances: Sequence[FloatArray]) -> FloatArray:
    """
    Return all numbers at both ends of the 95 % interval of some of them.

    Parameters
    ----------
    problem : Problem
        With settled weights.
    x : numpy.ndarray, shape (K,)
        Its solution.
    groups : sequence of sequence of int
        Which numbers, P in all, those of one effect together. One of them on which nothing
        depends at the solution may make room for the others where it is at its bound: from
        there they are looked at again.
    covariances : sequence of numpy.ndarray, shape (K, K)
        By the likelihood first, then others by which numbers may be known less well.

    Returns
    -------
    numpy.ndarray, shape (P, 2, K)

    """
    slopes = _Slopes.at(problem, x)
    _, least = _fit(problem, x, -1, slopes)

    def widest(place: int) -> FloatArray:
        return max(covariances, key=lambda c: float(c[place, place]))

    def wanted(place: int) -> float:
        """Return by how much the cost rises: more, where another covariance is wider."""
        return RISE_95 * float(widest(place)[place, place] / covariances[0][place, place])

    def end(start: FloatArray, at: _Slopes, place: int, sign: float) -> FloatArray:
        own = widest(place)
        variance = float(own[place, place])
        return _end(problem, start, place, at, least, wanted(place),
                    NORMAL_95 * math.sqrt(variance), sign * own[:, place] / variance)

    def is_free(far: FloatArray, place: int) -> bool:
        """Tell whether a number is at its bound, and the cost is still the least."""
        return far[place] in (low[place], high[place]) and (
            _cost(problem, far) - least < FLAT * RISE_95)

    low, high = problem.bounds
    found = [np.zeros((0, 2, x.size))]
    for places in groups:
        ends = np.array([[end(x, slopes, place, sign) for sign in SIGNS] for place in places])
        starts = [far for place, pair in zip(places, np.array(ends)) for far in pair
                  if is_free(far, place)]
        for far in starts:
            there = _Slopes.at(problem, far)
            for (row, place), side in product(enumerate(places), (0, 1)):
                known = ends[row, side, place]
                if low[place] < known < high[place]:
                    _, cost = _fit(problem, np.where(np.arange(x.size) == place, known, far),
                                   place, there)
                    if cost - least < NEARLY * wanted(place):
                        ends[row, side] = end(far, there, place, SIGNS[side])
        found.append(ends)
    return np.concatenate(found)


def _end(problem: Problem, x: FloatArray, place: int, slopes: '_Slopes', least: float,
         wanted: float, first: float, way: FloatArray) -> FloatArray:
    """
    Return the numbers where the cost has risen as ``wanted``.

    ``first`` is how far that is by the covariance, ``way`` how all numbers change with the one.
    """
    low, high = problem.bounds
    room = max(float(high[place] - x[place] if way[place] > 0.0 else x[place] - low[place]), 0.0)
    shift = start = min(first, room)
    inside, inside_rise, near, outside = 0.0, 0.0, x, math.inf
    for _ in range(TRIES if start > TIGHT else 0):
        tried = np.clip(near + (shift - inside) * way, low, high)
        solved, cost = _fit(problem, tried, place, slopes)
        if cost - least > wanted:           # in a bent valley these slopes lead astray
            solved, cost = _fit(problem, solved, place, _Slopes.at(problem, solved))
        rise = max(cost - least, 0.0)
        if rise > NEARLY * wanted:
            outside = shift
            if shift == start and rise < STEEP * wanted:
                return solved
        else:
            inside, inside_rise, near = shift, rise, solved
        if inside >= room or outside - inside < CLOSE * outside:
            break
        if math.isinf(outside):
            shift = min(shift * (FLAT_FARTHER if rise < FLAT * wanted else FARTHER), room)
            continue
        part = 0.5
        if wanted < rise < STEEP * wanted:      # the root of the rise is nearly straight
            root = math.sqrt(inside_rise)
            part = (math.sqrt(wanted) - root) / (math.sqrt(rise) - root)
        shift = inside + min(max(part, LEAST_PART), MOST_PART) * (outside - inside)
    if math.isinf(outside) or outside <= start:
        return near
    return np.clip(near + (outside - inside) * way, low, high)


def _cost(problem: Problem, x: FloatArray) -> float:
    """Return the sum of the squared errors."""
    residuals = problem.residuals(x)
    return float(residuals @ residuals)


class _Slopes(NamedTuple):
    """Slopes of the errors, and as few rows as numbers with the same squares."""

    slopes: FloatArray
    root: FloatArray

    @classmethod
    def at(cls, problem: Problem, x: FloatArray) -> '_Slopes':
        """Return those at a point."""
        slopes = problem.slopes(x)
        return cls(slopes, np.linalg.cholesky(
            slopes.T @ slopes + ROUNDING * np.eye(x.size)).T)

    def target(self, residuals: FloatArray) -> FloatArray:
        """Return what the rows should give for the errors to vanish."""
        found: FloatArray = np.linalg.solve(self.root.T, -self.slopes.T @ residuals)
        return found


def _fit(problem: Problem, x: FloatArray, place: int, slopes: _Slopes
         ) -> tuple[FloatArray, float]:
    """Return (solution, cost) near a start with all numbers free but one, by given slopes."""
    from scipy.optimize import lsq_linear       # slow to import

    low, high = problem.bounds
    free = np.arange(x.size) != place
    residuals = problem.residuals(x)
    cost = float(residuals @ residuals)
    for _ in range(STEPS):
        step = lsq_linear(slopes.root[:, free], slopes.target(residuals), (
            np.minimum(low - x, -TIGHT)[free], np.maximum(high - x, TIGHT)[free]), 'bvls').x
        moved = np.array(x)
        moved[free] = np.clip(x[free] + step, low[free], high[free])
        found = problem.residuals(moved)
        gained = cost - float(found @ found)
        if not gained > 0.0:
            break
        x, residuals, cost = moved, found, cost - gained
        if gained < GAIN:
            break
    return x, cost

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
How well each number is known: the interval in which its profile likelihood stays near the best.

The profile of a number is the least cost that the others reach while it is held. Its 95 % interval
ends where that cost is 3.84 above the least one (Raue et al. 2009, Bioinformatics 25(15), 1923).
Noise between the samples of an input makes the cost rugged in numbers such as a skew of the
stamps. So where the others are caught, those with a prior begin once more from the solution.

An end that lies at the end of the range is open: the data do not exclude what is beyond.

With effects fitted along, many numbers end at a bound and valleys are bent. There the others are
fitted with slopes of their own at every point. An end is no nearer than that of the slopes at the
solution, all numbers within their bounds.
"""

from dataclasses import dataclass, replace
import math
from typing import Any

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.fit.profile import NORMAL_95, RISE_95
from pam_sim.gap.verify.uncertainty import NUMERICS
from pam_sim.identify.fit import Weighted
from pam_sim.identify.numbers import Number
from pam_sim.identify.secant import solve_from

FARTHER = 2.0                # next try, where the cost has not risen enough
FLAT, FLAT_FARTHER = 0.1, 10.0       # the same, where it has hardly risen
TRIES = 9
BETTER = RISE_95             # of the cost; what is less lies within the interval
CLOSE = 0.15                 # of the wanted rise
HALVINGS, ROUNDING = 8, 1e-9         # of a shift; least room of a number, and its information


@dataclass(frozen=True)
class Interval:
    """
    Where a number may be.

    Parameters
    ----------
    low, high : float
        Ends, SI.
    open_low, open_high : bool
        Whether an end is that of the range.
    points : tuple of (float, float)
        Values tried and by how much the cost rose, in rising order.

    """

    low: float
    high: float
    open_low: bool
    open_high: bool
    points: tuple[tuple[float, float], ...]

    def wider(self, number: Number, value: float, doubt: float) -> 'Interval':
        """Return it with a doubt of its number [coordinates] added in quadrature at both ends."""
        if doubt <= 0.0:
            return self
        at = number.coordinate(value)
        low, high = (number.coordinate(end) for end in (self.low, self.high))
        return replace(self, low=number.value(at - math.hypot(at - low, doubt)),
                       high=number.value(at + math.hypot(high - at, doubt)))


def straight_end(weighted: Weighted, x: FloatArray, place: int, slopes: FloatArray, most: float
                 ) -> float:
    """
    Return the shift of a number, without its sign, at which the cost rises enough by the slopes.

    Parameters
    ----------
    weighted, x, place, slopes
        As of ``profile``.
    most : float
        The shift without bounds of the other numbers, with its sign.

    """
    from scipy.optimize import lsq_linear       # slow to import

    free = np.arange(x.size) != place
    root = np.linalg.cholesky(slopes.T @ slopes + ROUNDING * np.eye(x.size)).T
    target = np.linalg.solve(root.T, -slopes.T @ weighted.residuals(x))
    low = np.minimum(weighted.low - x, -ROUNDING)[free]
    high = np.maximum(weighted.high - x, ROUNDING)[free]

    def cost(shift: float) -> float:
        return 2.0 * float(lsq_linear(
            root[:, free], target - shift * root[:, place], (low, high)).cost)

    least, near, far = cost(0.0), 0.0, 1.0
    if cost(most) - least <= RISE_95:
        return abs(most)
    for _ in range(HALVINGS):
        middle = 0.5 * (near + far)
        if cost(middle * most) - least > RISE_95:
            far = middle
        else:
            near = middle
    return far * abs(most)


def profile(weighted: Weighted, x: FloatArray, place: int, covariance: FloatArray,
            slopes: FloatArray) -> tuple[Interval, FloatArray | None]:
    """
    Return (interval of one number, a better solution that was met on the way or None).

    Parameters
    ----------
    weighted : Weighted
        With settled weights.
    x : numpy.ndarray
        The solution.
    place : int
        Which number.
    covariance : numpy.ndarray, shape (K, K)
        At the solution; where the look for the ends begins, and how the others follow.
    slopes : numpy.ndarray, shape (N, K)
        Of the residuals at the solution.

    """
    number = weighted.numbers[place]
    least = float(np.sum(weighted.residuals(x) ** 2))
    held = np.arange(x.size) == place
    sought = np.array([n.unknown for n in weighted.numbers])
    points = {0.0: 0.0}
    lowest: list[Any] = [least, None]
    follow = covariance[:, place] / max(covariance[place, place], 1e-300)

    def rise(shift: float, near: FloatArray) -> tuple[float, FloatArray]:
        start = np.array(near)
        start[place] = x[place] + shift
        if weighted.incomplete:
            solved, cost, _ = solve_from(weighted, start, held=held)
        else:
            solved, cost = weighted.follow(start, held, slopes)
            if cost - least > RISE_95:          # in a bent valley the slopes lead astray
                solved, cost, _ = solve_from(weighted, solved, slopes, held)
            if cost - least > RISE_95:
                solved, cost, _ = solve_from(weighted, solved, held=held)
            if cost - least > RISE_95:          # known numbers, such as a skew, are caught there
                other, less, _ = solve_from(weighted, np.where(sought | held, solved, x),
                                            held=held)
                solved, cost = (other, less) if less < cost else (solved, cost)
        if cost < lowest[0] - BETTER:
            lowest[:] = [cost, solved]
        points[shift] = cost - least
        return cost - least, solved

    ends, opened = [], []
    for sign, limit in ((-1.0, weighted.low[place]), (1.0, weighted.high[place])):
        room = abs(limit - x[place])
        shift = min(NORMAL_95 * float(np.sqrt(covariance[place, place])), room)
        if weighted.incomplete:
            shift = straight_end(weighted, x, place, slopes, sign * shift)
        inner, inner_rise, outer, first = 0.0, 0.0, None, len(points) + 1
        near, end, is_open = x, room, True
        for _ in range(TRIES):
            if shift <= 1e-9:
                break
            guess = near + follow * (sign * shift - (near[place] - x[place]))
            height, solved = rise(sign * shift, np.clip(guess, weighted.low, weighted.high))
            if abs(height / RISE_95 - 1.0) < CLOSE:
                end, is_open = shift, False
                break
            if height < RISE_95:
                inner, inner_rise, near = shift, max(height, 0.0), solved
                if shift >= room:
                    break
                end, is_open = room, True
            else:
                outer = (shift, height)
                if weighted.incomplete and len(points) == first and shift < room:
                    end, is_open = shift, False
                    break
            if outer is None:
                shift = min(shift * (FLAT_FARTHER if height < FLAT else FARTHER), room)
                continue
            # The root of the rise is nearly straight.
            low, high = np.sqrt(inner_rise), np.sqrt(outer[1])
            part = (np.sqrt(RISE_95) - low) / max(high - low, 1e-12)
            shift = inner + float(np.clip(part, 0.1, 0.9)) * (outer[0] - inner)
            end, is_open = shift, False
        best = number.value(float(x[place]))
        # Step and interpolation act on what scales a signal. A zero is only added to it.
        numerics = 0.0 if number.zero_of else NUMERICS * best
        least_width = math.hypot(numerics, number.resolution) / number.slope(best)
        ends.append(number.value(float(x[place] + sign * math.hypot(end, least_width))))
        opened.append(is_open)
    interval = Interval(ends[0], ends[1], opened[0], opened[1], tuple(
        (number.value(float(x[place] + shift)), points[shift]) for shift in sorted(points)))
    return interval, lowest[1]

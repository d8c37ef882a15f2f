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

"""Which numbers the data determine, which only together, and which not at all."""

from collections.abc import Sequence
from itertools import combinations
import math

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.fit.profile import NORMAL_95
from pam_sim.gap.verify.together import Combination, ROUND
from pam_sim.identify.numbers import Number
from pam_sim.identify.profile import Interval

DETERMINED, TOGETHER, UNDETERMINED = 'determined', 'only together', 'not determined'
# Ratio of the ends of an interval; or its share of the range of a zero, or of a small size.
NARROW_RATIO, NARROW_SHARE, NARROW_SHARE_OF_SMALL = 1.5, 0.02, 0.2
# How near to an end of its range a value is at that end, in distances to the other end of its
# interval.
NEAR_EDGE = 0.05
KNOWN = 0.5                  # standard deviation of what is worth telling, in coordinates
BETTER = 2.0                 # times as well known together as the better known one alone
COUNTS = 0.1                 # of the largest weight; a number of less has no weight of 1
GENTLE = 1e-12
# Standard deviation of a sum of coordinates, places of its numbers, and their weights.
Known = tuple[float, Sequence[int], FloatArray]


def is_narrow(number: Number, low: float, high: float) -> bool:
    """Tell whether an interval is short beside the range of the number."""
    least, most = sorted((abs(low), abs(high)))
    if low * high > 0.0 and most / least <= NARROW_RATIO:
        return True
    if number.is_scale:
        return False
    return high - low <= (NARROW_SHARE_OF_SMALL * number.small if number.is_size
                          else NARROW_SHARE * (number.upper - number.lower))


def is_at_edge(number: Number, value: float, interval: Interval) -> bool:
    """
    Tell whether the fit ends at an end of the allowed range, and would perhaps go on beyond it.

    A size of 0 is none: there is nothing below. Where the interval is open at both ends, the
    recordings say nothing, and the value lies anywhere.
    """
    if not number.unknown or interval.open_low == interval.open_high:
        return False
    at, low, high = (number.coordinate(v) for v in (value, interval.low, interval.high))
    if interval.open_high:
        return number.coordinate(number.upper) - at <= NEAR_EDGE * (at - low)
    return not number.is_size and at - number.coordinate(number.lower) <= NEAR_EDGE * (high - at)


def judge(numbers: Sequence[Number], intervals: Sequence[Interval], x: FloatArray,
          information: FloatArray) -> tuple[list[str], list[Combination]]:
    """
    Return (status of each unknown number, combinations).

    Parameters
    ----------
    numbers : list of Number
        The unknown ones.
    intervals : list of Interval
        Theirs.
    x : numpy.ndarray
        Their coordinates at the solution.
    information : numpy.ndarray, shape (K, K)
        Of the unknown numbers, all others accounted for.

    """
    statuses = []
    for j, (number, interval) in enumerate(zip(numbers, intervals)):
        if is_narrow(number, interval.low, interval.high):
            statuses.append(DETERMINED)
            continue
        # With the other unknown numbers given, would it be known?
        alone = NORMAL_95 / math.sqrt(max(float(information[j, j]), GENTLE))
        low, high = number.value(float(x[j]) - alone), number.value(float(x[j]) + alone)
        statuses.append(TOGETHER if is_narrow(number, low, high) else UNDETERMINED)
    group = [j for j, status in enumerate(statuses) if status == TOGETHER]
    if len(group) == 1:         # the others are known well enough to leave it to itself
        statuses[group[0]] = UNDETERMINED
        group = []
    covariance = np.linalg.inv(information + GENTLE * np.eye(len(numbers)))
    return statuses, _combinations([numbers[j] for j in group], x[group],
                                   np.linalg.inv(covariance[np.ix_(group, group)]))


def _combinations(numbers: Sequence[Number], x: FloatArray, information: FloatArray
                  ) -> list[Combination]:
    """
    Return what is known of numbers together: of pairs where that is enough, else of all.

    Sizes are combined by their logarithms, since what scales together in physics is a product.
    """
    if not numbers:
        return []
    values = np.array([n.value(float(c)) for n, c in zip(numbers, x)])
    product = all(n.lower >= 0.0 for n in numbers) and bool(np.all(values > 0.0))
    # What one unit of a coordinate is, in logarithms or in the number's own unit.
    units = np.array([n.slope(v) / (v if product else 1.0) for n, v in zip(numbers, values)])
    covariance = np.linalg.inv(information + GENTLE * np.eye(len(numbers)))
    pairs = [_best_known([i, j], covariance) for i, j in combinations(range(len(numbers)), 2)]
    joined = [{k} for k in range(len(numbers))]
    found = []
    for known in sorted(filter(None, pairs), key=lambda pair: pair[0]):
        groups = [next(g for g in joined if k in g) for k in known[1]]
        if groups[0] is groups[1]:
            continue
        groups[0] |= groups[1]
        joined.remove(groups[1])
        found.append(_combination(numbers, values, known, units, product))
    if not found and len(numbers) > 2:
        whole = _best_known(range(len(numbers)), covariance)
        if whole is not None:
            found.append(_combination(numbers, values, whole, units, product))
    return found


def _best_known(places: Sequence[int], covariance: FloatArray) -> Known | None:
    """Return the best known sum of coordinates, None where it tells no more than one of them."""
    chosen = covariance[np.ix_(places, places)]
    variance, axes = np.linalg.eigh(chosen)
    sd = math.sqrt(max(float(variance[0]), 0.0))
    alone = math.sqrt(float(np.min(np.diag(chosen))))
    return (sd, places, axes[:, 0]) if sd <= min(KNOWN, alone / BETTER) else None


def _combination(numbers: Sequence[Number], values: FloatArray, known: Known,
                 units: FloatArray, product: bool) -> Combination:
    sd, places, axis = known
    powers = axis / units[list(places)]
    size = np.abs(powers if product else axis)
    # The first weight becomes 1, so it must not be one that hardly counts.
    first = 0 if size[0] >= COUNTS * np.max(size) else int(np.argmax(size))
    order = [first, *(k for k in range(len(places)) if k != first)]
    weights = {numbers[places[k]].name: float(powers[k] / powers[first]) for k in order}
    half = abs(NORMAL_95 * sd / float(powers[first]))
    chosen = [float(values[places[k]]) for k in order]
    if not product:
        return Combination(weights, sum(v * w for v, w in zip(chosen, weights.values())), half,
                           False)
    # Powers of physics are whole.
    weights = {name: float(round(w)) if abs(w - round(w)) < ROUND and round(w) else w
               for name, w in weights.items()}
    return Combination(
        weights, math.prod(v ** w for v, w in zip(chosen, weights.values())), half, True)

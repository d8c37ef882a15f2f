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

"""What is known of several numbers together, where each alone may be almost anything."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
import math

import numpy as np
from pam_sim.annotations import FloatArray

WIDE = 0.25                  # half an interval, of the value: the number is not known alone
BETTER = 5.0                 # times as well known together as alone
SAME = 1e-6                  # numerics: slopes of two numbers that are one
ROUND = 0.03                 # how near to a whole number a power is one


@dataclass(frozen=True)
class Combination:
    """
    What is known of several numbers that are not known one by one.

    For ``product`` False: the sum of ``weights[name] * value`` is ``value``. For True the product
    of ``value ** weights[name]`` is. The first weight is 1.

    Parameters
    ----------
    weights : dict of str -> float
    value, half_width : float
        With the 95 % half width; of a product relative.
    product : bool

    """

    weights: dict[str, float]
    value: float
    half_width: float
    product: bool

    def text(self) -> str:
        """Return the combination as a formula."""
        if self.product:
            terms = ' · '.join(name if w == 1.0 else f'{name}^{w:.3g}'
                               for name, w in self.weights.items())
            return f'{terms} = {self.value:.4g} ± {100.0 * self.half_width:.2g} %'
        terms = ' + '.join({1.0: name, -1.0: f'-{name}'}.get(w, f'{w:.4g}·{name}')
                           for name, w in self.weights.items()).replace('+ -', '- ')
        return f'{terms} = {self.value:.4g} ± {self.half_width:.2g}'


def known_together(values: Mapping[str, tuple[float, str]], slopes: FloatArray,
                   covariances: Sequence[FloatArray], ends: FloatArray, least: float = 0.0
                   ) -> list[Combination]:
    """
    Return what is known of pairs of which neither number is known.

    Along the valley of equal errors both change. The weights are those by which their sum, or
    the product of their powers, is the same at both of its ends.

    Parameters
    ----------
    values : dict of str -> (float, str)
        The Q numbers with their units.
    slopes : numpy.ndarray, shape (Q, K)
        Their slopes by the K parameters that were fitted.
    covariances : sequence of numpy.ndarray, shape (K, K)
        Of those parameters, each by itself possible.
    ends : numpy.ndarray, shape (P, 2, Q)
        The numbers at both ends of intervals.
    least : float
        Relative; no combination is known better.

    """
    found = []
    own = [slopes @ one @ slopes.T for one in covariances]
    names, at = list(values), np.array([value for value, _ in values.values()])
    half = 0.5 * np.ptp(ends.reshape(-1, at.size), axis=0)
    for i, j in combinations(np.flatnonzero(half > WIDE * np.abs(at)), 2):
        if np.linalg.matrix_rank(_unit_rows(slopes[[i, j]]), SAME) < 2:
            continue            # two words for one parameter
        pair = [j, i] if at[j] > at[i] else [i, j]      # a difference above 0 reads best
        units = {list(values.values())[k][1] for k in pair}
        tried = [_pair(at[pair], [c[np.ix_(pair, pair)] for c in own],
                       ends[:, :, pair], product, product or len(units) == 1)
                 for product in (False, True)]
        best = max((one for one in tried if one is not None), key=lambda one: one[0],
                   default=None)
        if best is not None and best[0] >= BETTER:
            _, weight, value, width, product = best
            width = math.hypot(width, least if product else least * value)
            found.append(Combination({names[pair[0]]: 1.0, names[pair[1]]: weight},
                                     value, width, product))
    return found


def _unit_rows(rows: FloatArray) -> FloatArray:
    return rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)


def _pair(at: FloatArray, covariances: Sequence[FloatArray], ends: FloatArray, product: bool,
          is_whole: bool) -> tuple[float, float, float, float, bool] | None:
    """Return (times better known than alone, weight, value, half width, product) of a pair."""
    if product:
        if np.min(ends) <= 0.0 or np.min(at) <= 0.0:
            return None
        covariances = [c / np.outer(at, at) for c in covariances]
        at, ends = np.log(at), np.log(ends)
    half = 0.5 * np.ptp(ends.reshape(-1, 2), axis=0)
    far = ends[int(np.argmax(np.ptp(ends[:, :, 1], axis=1)))]
    first, second = far[1] - far[0]
    if first == 0.0 or second == 0.0:
        return None
    weight = -float(first / second)
    if is_whole and round(weight) and abs(weight - round(weight)) < ROUND:
        weight = float(round(weight))
    weights = np.array([1.0, weight])
    value = float(weights @ at)
    sd = max(math.sqrt(max(float(weights @ c @ weights), 0.0)) for c in covariances)
    width = math.hypot(1.96 * sd, float(np.max(np.abs(ends @ weights - value))))
    better = float(np.min(np.abs(weights) * half)) / max(width, 1e-300)
    return better, weight, math.exp(value) if product else value, width, product

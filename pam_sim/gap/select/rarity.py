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
How rare a value is by chance: Student's t, and Wilcoxon's signed ranks.

As scipy.stats has them, which takes half a second of processor time to import.
"""

import functools

import numpy as np
from pam_sim.annotations import FloatArray

EXACT = 50                   # values up to which the ranks are counted


def student_above(t: float, freedom: int) -> float:
    """Return how probable a larger t is, with so many degrees of freedom."""
    from scipy.special import stdtr       # slow to import
    return float(stdtr(freedom, -t))


def normal_deviation(above: float) -> float:
    """Return by how many deviations a normal value exceeds its mean so rarely."""
    from scipy.special import ndtri       # slow to import
    return float(-ndtri(above))


def normal_below(deviation: float) -> float:
    """Return how probable a normal value is that exceeds its mean by no more deviations."""
    from scipy.special import ndtr       # slow to import
    return float(ndtr(deviation))


def ranks_above(values: FloatArray) -> float:
    """Return how probable so many high signed ranks are (Wilcoxon 1945) where values mean 0."""
    from scipy.special import ndtr       # slow to import
    size, count = np.abs(values), values.size
    if np.unique(size).size < count or not size.all():      # equal ranks, or none: rare
        from scipy.stats import wilcoxon       # slow to import
        return float(wilcoxon(values, alternative='greater').pvalue)
    ranks = np.empty(count)
    ranks[np.argsort(size)] = np.arange(1.0, count + 1.0)
    total, mean = float(np.sum((values > 0.0) * ranks)), 0.25 * count * (count + 1)
    if count > EXACT:
        spread = np.sqrt(count * (count + 1.0) * (2.0 * count + 1.0) / 24.0)
        return float(ndtr(-(total - mean) / spread))
    chances, place = _chances(count), int(total)
    return float(chances[place:].sum() if place <= mean else 1.0 - chances[:place].sum())


@functools.lru_cache(maxsize=EXACT)
def _chances(count: int) -> FloatArray:
    """Return the probability of every sum of positive ranks."""
    found: FloatArray = np.ones(1)
    for rank in range(1, count + 1):
        one: FloatArray = np.zeros(found.size + rank)
        one[:found.size] = 0.5 * found
        one[rank:] += 0.5 * found
        found = one
    return found

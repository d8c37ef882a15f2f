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
Membership functions on an equidistant grid: triangular, or Gaussian and normalised.

At any value at most two neighbouring sets are active and the degrees sum to 1
(partition of unity), so a firing strength needs one index and one degree.
Outside the universe the outermost set is fully active (saturation). Both forms
cover the whole universe by construction.
"""

import math

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled

SET_COUNT = 7
SET_NAMES = ('NB', 'NM', 'NS', 'ZE', 'PS', 'PM', 'PB')
SET_WORDS = (
    'large negative', 'medium negative', 'small negative', 'about zero',
    'small positive', 'medium positive', 'large positive')


@compiled
def locate(value: float, lower: float, upper: float, count: int) -> tuple[int, float]:
    """
    Return the lower one of the two active sets and the degree of the upper one.

    Set k has its peak at ``lower + k (upper - lower) / (count - 1)``. The lower
    set has degree ``1 - degree``.
    """
    place = (value - lower) / (upper - lower) * (count - 1)
    if not place > 0.0:
        return 0, 0.0
    if place >= count - 1:
        return count - 2, 1.0
    index = int(place)
    return index, place - index


@compiled
def gaussian_degree(degree: float, width: float) -> float:
    """
    Return the degree of the upper set when both active sets are Gaussian.

    ``degree`` is the place between the peaks of two neighbouring sets, 0 to 1, ``width`` their
    standard deviation in distances of the peaks. The two are divided by their sum, which gives a
    logistic function of the place. The rest of the other set at a peak is subtracted, so that the
    degrees are continuous over the whole universe.
    """
    steepness = 1.0 / (width * width)
    least = 1.0 / (1.0 + math.exp(0.5 * steepness))
    share = 1.0 / (1.0 + math.exp((0.5 - degree) * steepness))
    return (share - least) / (1.0 - 2.0 * least)


@compiled
def locate_signed_logarithmic(value: float, fine: float, upper: float,
                              count: int) -> tuple[int, float]:
    """
    Return the lower active set and the degree of the upper one on a signed logarithmic grid.

    The sets are triangles over ``asinh(value / fine)``: evenly spaced below ``fine``,
    logarithmically above, from ``-upper`` to ``upper``.
    """
    return locate(math.asinh(value / fine) / math.asinh(upper / fine), -1.0, 1.0, count)


def signed_logarithmic_knots(fine: float, upper: float, count: int) -> FloatArray:
    """Return the values at which the sets of ``locate_signed_logarithmic`` have their peaks."""
    return fine * np.sinh(np.linspace(-1.0, 1.0, count) * math.asinh(upper / fine))


def memberships(value: float, lower: float = -1.0, upper: float = 1.0, count: int = SET_COUNT,
                gaussian_width: float | None = None) -> FloatArray:
    """Return the degrees of all sets at a value, shape (count,), for plots and tests."""
    degrees = np.zeros(count)
    index, degree = locate(float(value), lower, upper, count)
    if gaussian_width is not None:
        degree = gaussian_degree(degree, gaussian_width)
    degrees[index] += 1.0 - degree
    degrees[index + 1] += degree
    return degrees

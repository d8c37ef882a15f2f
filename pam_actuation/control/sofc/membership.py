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
Triangular membership functions with 50 % overlap on an equidistant grid.

At any value at most two neighbouring sets are active and the degrees sum to 1
(partition of unity), so a firing strength needs one index and one degree.
Outside the universe the outermost set is fully active (saturation).
"""

import numpy as np
from pam_sim.compiled import compiled

SET_COUNT = 7
SET_NAMES = ('NB', 'NM', 'NS', 'ZE', 'PS', 'PM', 'PB')
SET_WORDS = (
    'large negative', 'medium negative', 'small negative', 'about zero',
    'small positive', 'medium positive', 'large positive')


@compiled
def locate(value, lower, upper, count):
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


def memberships(value, lower=-1.0, upper=1.0, count=SET_COUNT):
    """Return the degrees of all sets at a value, shape (count,), for plots and tests."""
    degrees = np.zeros(count)
    index, degree = locate(float(value), lower, upper, count)
    degrees[index] += 1.0 - degree
    degrees[index + 1] += degree
    return degrees

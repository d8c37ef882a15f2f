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
Nearest monotone surface: contraction rises with pressure and falls with load.

This is isotonic regression in two directions: pool-adjacent-violators along each axis, joined by
Dykstra's projections. Source: Dykstra and Robertson 1982, Annals of Statistics 10(3), An algorithm
for isotonic regression for two or more independent variables.
"""

from collections.abc import Sequence

import numpy as np
from pam_sim.annotations import FloatArray

ROUNDS = 200


def rising(values: Sequence[float] | FloatArray) -> FloatArray:
    """Return the nearest non-decreasing sequence (least squares) of a 1-D array."""
    means, sizes = [], []
    for value in np.asarray(values, dtype=float):
        means.append(value)
        sizes.append(1)
        while len(means) > 1 and means[-2] > means[-1]:
            size = sizes[-2] + sizes[-1]
            means[-2:] = [(means[-2] * sizes[-2] + means[-1] * sizes[-1]) / size]
            sizes[-2:] = [size]
    return np.repeat(means, sizes)


def monotone_surface(strain: FloatArray) -> FloatArray:
    """
    Return the nearest surface that rises along axis 0 and falls along axis 1, not below zero.

    Parameters
    ----------
    strain : ndarray, shape (P, L)
        Contraction over pressure and load, as a fraction.

    """
    surface = np.maximum(strain, 0.0)
    by_pressure, by_load = np.zeros_like(surface), np.zeros_like(surface)
    for _ in range(ROUNDS):
        trial = surface + by_pressure
        up = np.array([rising(column) for column in trial.T]).T
        by_pressure = trial - up
        trial = up + by_load
        following = np.array([rising(row[::-1])[::-1] for row in trial])
        by_load = trial - following
        moved, surface = np.max(np.abs(following - surface)), following
        if moved < 1e-12:
            break
    # The rounds end a hair's breadth from monotone; running extremes close it exactly.
    surface = np.minimum.accumulate(np.maximum(surface, 0.0), axis=1)
    return np.maximum.accumulate(surface, axis=0)

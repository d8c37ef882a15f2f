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
Performance index: how far the last response was from the wanted one.

The output is the wanted correction of the *output* [m]: positive means that the
muscle should have contracted more. Zero along ``e + tau de/dt = 0``, the wanted
first-order decay of the error. Two forms:

* linear: ``p = clip(e + tau de, -limit, limit)`` (Jantzen's linear form).
* table: The 13-level table of Procyk and Mamdani (Automatica 15, 1979) as it is
  commonly reproduced, on quantised error and change of error, scaled to ``limit``.
"""

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled

LEVELS = 13
_POSITIVE_ROWS = (
    (0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4),
    (0, 0, 0, 0, 0, 0, 1, 1, 1, 2, 3, 4, 5),
    (0, 0, 0, 0, 0, 0, 2, 2, 2, 3, 4, 5, 6),
    (0, 0, 0, 0, 2, 3, 4, 4, 4, 4, 5, 5, 6),
    (0, 0, 0, 2, 4, 5, 6, 6, 6, 6, 6, 6, 6),
    (0, 0, 0, 2, 2, 3, 6, 6, 6, 6, 6, 6, 6),
    (0, 0, 0, 0, 0, 0, 6, 6, 6, 6, 6, 6, 6))


def _full_table() -> FloatArray:
    """Complete the rows of positive error by the antisymmetry P(-e, -ce) = -P(e, ce)."""
    table = np.zeros((LEVELS, LEVELS))
    for level in range(1, 7):
        table[6 + level] = _POSITIVE_ROWS[level]
        table[6 - level] = -np.array(_POSITIVE_ROWS[level][::-1])
    table[6] = _POSITIVE_ROWS[0] - np.array(_POSITIVE_ROWS[0][::-1])
    return table


TABLE = _full_table()     # rows error level -6..6, columns change-of-error level -6..6


@compiled
def index_linear(error_m: float, rate_m_per_s: float, tau_s: float, limit_m: float) -> float:
    """Return the linear performance index [m]."""
    return min(max(error_m + tau_s * rate_m_per_s, -limit_m), limit_m)


@compiled
def index_table(error_scaled: float, rate_scaled: float, limit_m: float) -> float:
    """Return the tabulated performance index [m] of error and change scaled to [-1, 1]."""
    row = int(np.rint(6.0 * min(max(error_scaled, -1.0), 1.0))) + 6
    column = int(np.rint(6.0 * min(max(rate_scaled, -1.0), 1.0))) + 6
    return TABLE[row, column] / 6.0 * limit_m

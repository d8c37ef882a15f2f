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
Gains of an observer whose readings do not come in every tick.

A law that estimates a state predicts it in every tick, and corrects it with each new reading.
Between two readings the error of the prediction grows. The gain that fits a reading in every tick
may then make the estimate diverge. So each number of ticks from reading to reading has a
stationary Kalman gain of its own.
"""

import numpy as np
from pam_actuation.control.inputs import MAX_AGE_S
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled
from pam_sim.errors import InputError

_DOUBLINGS = 16         # 65 536 readings


def riccati(a: FloatArray, b: FloatArray, q: FloatArray, r: FloatArray) -> FloatArray:
    """
    Return the solution of the discrete algebraic Riccati equation.

    Raises
    ------
    InputError
        There is none.

    """
    from scipy.linalg import solve_discrete_are       # slow to import, see lqi_model
    try:
        return solve_discrete_are(a, b, q, r)
    except np.linalg.LinAlgError:
        raise InputError('the Riccati equation has no solution for this model and these '
                         'weights') from None


def kalman_gains(a: FloatArray, c: FloatArray, spread: FloatArray, noise: float,
                 rate_hz: float) -> FloatArray:
    """
    Return the gains on the innovation, one row for each interval of readings from 1 tick on.

    Parameters
    ----------
    a, c : numpy.ndarray
        Matrix of the state from tick to tick, and what of it is measured.
    spread : numpy.ndarray
        Covariance of what disturbs the state in a tick.
    noise : float
        Variance of a reading.
    rate_hz : float
        Of the ticks. The last row is of readings so far apart that none is usable between them.

    Raises
    ------
    InputError
        The Riccati equation has no solution.

    """
    advances, spreads = [a], [spread]
    for _ in range(int(np.ceil(MAX_AGE_S * rate_hz))):
        advances.append(a @ advances[-1])
        spreads.append(a @ spreads[-1] @ a.T + spread)
    p = _stationary(np.array(advances), np.outer(c, c) / noise, np.array(spreads))
    # As in the versions that had no others.
    p[0] = riccati(a.T, c[:, None], spread, np.array([[noise]]))
    return np.array([one @ c / (c @ one @ c + noise) for one in p])


def _stationary(a: FloatArray, seen: FloatArray, spread: FloatArray) -> FloatArray:
    """
    Return the covariances of predictions for a stack of matrices, by doubling.

    That is the structure-preserving algorithm of Chu, Fan and Lin. A step doubles the number of
    readings since the start. For a whole stack it takes less time than one call of SciPy.
    """
    a, g, p = a.transpose(0, 2, 1), np.broadcast_to(seen, a.shape), spread
    for _ in range(_DOUBLINGS):
        turned = a.transpose(0, 2, 1)
        solved = np.linalg.solve(np.eye(len(seen)) + g @ p, np.concatenate([a, g], axis=2))
        advanced, gained = np.split(solved, 2, axis=2)
        a, g, p = a @ advanced, g + a @ gained @ turned, p + turned @ p @ advanced
    return p


@compiled
def gains_at(observer: FloatArray, width: int, ticks: float) -> int:
    """Return where the gains of so many ticks begin in rows of a width, one behind the other."""
    return (min(max(int(ticks), 1), observer.size // width) - 1) * width

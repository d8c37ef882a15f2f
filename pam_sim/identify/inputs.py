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
What noise of the measured inputs does to the numbers.

The measured pressure drives muscle and load. Its noise moves the simulated load for as long as
the load swings, and most where the load moves: on the edges, which tell the numbers. Weights for
the whole record take it for noise that is new in every sample. So the inputs are disturbed as
their noise and stamps do, and the solution is followed: how far the numbers scatter is a doubt
beside that of the outputs.
"""

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.identify.fit import Weighted
from pam_sim.identify.secant import bounded_step

DRAWS = 24


def scatter_by_inputs(weighted: Weighted, x: FloatArray, count: int, slopes: FloatArray,
                      seed: int = 0) -> FloatArray:
    """
    Return the covariance that noise of the inputs gives the first numbers, in coordinates.

    Parameters
    ----------
    weighted : Weighted
        With settled weights.
    x : numpy.ndarray, shape (K,)
        The solution.
    count : int
        How many numbers are sought.
    slopes : numpy.ndarray, shape (N, K)
        Of the residuals there.
    seed : int
        Of the draws.

    """
    random = np.random.default_rng(seed)
    room = weighted.low - x, weighted.high - x
    base = weighted.residuals(x)
    still = bounded_step(slopes, base, 0.0, *room)
    found = np.zeros((count, count))
    for _ in range(DRAWS):
        for problem in weighted.problems:
            problem.disturb(random)
        moved = (bounded_step(slopes, weighted.residuals(x), 0.0, *room) - still)[:count]
        found += np.outer(moved, moved) / DRAWS
    for problem in weighted.problems:
        problem.disturb(None)
    return found

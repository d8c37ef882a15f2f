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
A least-squares solver that simulates little: slopes are corrected along the way.

The slopes of a start cost one simulation for each number. Every step then corrects them by what
it learned (Broyden 1965, Mathematics of Computation 19, 577), so that a step costs one
simulation. They are calculated again where a step with corrected slopes fails.
"""

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.identify.fit import ROUNDS, TIGHT, Weighted

STEPS = 12
GAIN = 0.05                  # of the cost, which ends the steps
DAMPING, LEAST = 1e-3, 1e-6  # of a step, beside the squared slopes; and where steps succeed
HARDER, EASIER, HARDEST = 30.0, 0.1, 1e3     # factors on the damping, and its limit
TINY = 1e-300


def solve_from(weighted: Weighted, x: FloatArray, slopes: FloatArray | None = None,
               held: BoolArray | None = None) -> tuple[FloatArray, float, FloatArray]:
    """
    Return (solution, cost, slopes there) near a start.

    Parameters
    ----------
    weighted : Weighted
        The problem.
    x : numpy.ndarray, shape (K,)
        The start.
    slopes : numpy.ndarray, shape (N, K), optional
        Of the residuals near the start; calculated by default.
    held : numpy.ndarray of bool, shape (K,), optional
        Numbers that stay; none by default.

    Returns
    -------
    tuple
        The cost is the sum of the squared residuals.

    """
    fresh, again = slopes is None, True         # slopes are calculated again once
    slopes = weighted.slopes(x) if slopes is None else np.array(slopes)
    free = np.arange(x.size) if held is None else np.flatnonzero(~held)
    residuals = weighted.residuals(x)
    cost, damping = float(residuals @ residuals), DAMPING
    if not free.size:
        return x, cost, slopes
    for _ in range(STEPS):
        step = np.zeros(x.size)
        step[free] = bounded_step(
            slopes[:, free], residuals, damping, weighted.low[free] - x[free],
            weighted.high[free] - x[free])
        moved = np.clip(x + step, weighted.low, weighted.high)
        step = moved - x
        if not np.any(step):
            break
        found = weighted.residuals(moved)
        now = float(found @ found)
        if np.isfinite(now):
            scale = np.sum(slopes ** 2, axis=0)
            length = float(step @ (scale * step))
            slopes += np.outer(found - residuals - slopes @ step, scale * step / max(length, TINY))
        if now < cost:
            gained, cost, x, residuals = cost - now, now, moved, found
            damping = max(damping * EASIER, LEAST)
            fresh = False
            if gained < GAIN:
                break
        elif fresh or not again:
            damping *= HARDER
            if damping > HARDEST:
                break
        else:
            slopes, fresh, again = weighted.slopes(x), True, False
    return x, cost, slopes


def settle(weighted: Weighted, x: FloatArray) -> FloatArray:
    """Return the solution near a start, once weights and errors agree."""
    for _ in range(ROUNDS):
        if weighted.retemper(x):
            break
        x, _, _ = solve_from(weighted, x)
    return x


def bounded_step(slopes: FloatArray, residuals: FloatArray, damping: float, low: FloatArray,
                 high: FloatArray) -> FloatArray:
    """Return the damped step within its limits, from the normal equations."""
    from scipy.optimize import lsq_linear       # slow to import

    scale = np.sqrt(np.maximum(np.sum(slopes ** 2, axis=0), TINY))
    scaled = slopes / scale
    square = scaled.T @ scaled + damping * np.eye(scale.size)
    root = np.linalg.cholesky(square).T
    return lsq_linear(root, -np.linalg.solve(root.T, scaled.T @ residuals), (
        np.minimum(low, -TIGHT) * scale, np.maximum(high, TIGHT) * scale), 'bvls').x / scale

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
The search itself: differential evolution in the unit cube, one generation at a time.

Storn and Price (Journal of Global Optimization 11, 1997) as ``scipy.optimize``
has it. A cost of learning closed loops is rugged and cheap; a population that
samples the whole box does not get stuck in the first valley.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.short_repr import short_repr
from scipy.optimize import differential_evolution

if TYPE_CHECKING:
    from scipy._lib._util import _FunctionWrapper

SMALLEST = 5                    # members differential evolution needs
MEMBERS = 24                    # fewer settle too early, also with few settings
BUDGET_USED = 'budget used up'
ALL_ALIKE = 'all points of a generation cost the same'
_NEAR = 0.12                    # spread of the cloud about the start, in widths of the box


@short_repr
@dataclass
class Found:
    """Best point and its cost, and why the search ended."""

    point: np.ndarray
    cost: float
    reason: str


def default_members(evaluations: int) -> int:
    """Return the size of a generation: 24, less where that leaves no ten generations."""
    return int(min(max(evaluations // 10, SMALLEST), MEMBERS))


def minimise(costs_of: Callable[..., Any], start: FloatArray, members: int, generations: int,
             seed: int, patience: int = 0) -> Found:
    """
    Search the unit cube for the smallest cost.

    Parameters
    ----------
    costs_of : callable
        Takes a list of points, returns their costs in the same order.
    start : numpy.ndarray, shape (n,)
        Stands in the first generation, with a cloud about it and points anywhere.
    members : int
        Points of a generation.
    generations : int
        Largest number of generations, the first one included.
    seed : int
        Same seed, same points.
    patience : int
        End after so many generations without a better point; 0 = never.

    Returns
    -------
    Found

    """
    best = {'cost': np.inf, 'since': 0, 'generations': 0}

    def mapped(_: '_FunctionWrapper', points: FloatArray) -> list[float]:
        """Evaluate a whole generation; ``differential_evolution`` calls it as ``map``."""
        costs = costs_of([np.array(point) for point in points])
        best['since'] = 0 if min(costs) < best['cost'] else best['since'] + 1
        best['cost'] = min(best['cost'], min(costs))
        best['generations'] += 1
        return costs

    # A Generator works under the present and the former name of the argument.
    found = differential_evolution(
        lambda point: 0.0, [(0.0, 1.0)] * len(start), workers=mapped, updating='deferred',
        init=_first_generation(start, members, seed), maxiter=max(generations - 1, 1),
        seed=np.random.default_rng(seed), tol=0.0, polish=False, mutation=(0.4, 0.9),
        recombination=0.8, callback=lambda *_, **__: bool(patience) and best['since'] >= patience)
    stopped = bool(patience) and best['since'] >= patience
    reason = BUDGET_USED if best['generations'] >= generations else ALL_ALIKE
    if stopped:
        reason = f'no progress in {patience} generations'
    return Found(found.x, float(found.fun), reason)


def _first_generation(start: FloatArray, members: int, seed: int) -> FloatArray:
    """Return the start, a cloud around it, and as many points anywhere in the unit cube."""
    random = np.random.default_rng(seed)
    near = start + random.normal(0.0, _NEAR, (members, len(start)))
    near[1::2] = random.uniform(0.0, 1.0, near[1::2].shape)
    near[0] = start
    return np.clip(near, 0.0, 1.0)

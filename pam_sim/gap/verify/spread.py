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

"""What the doubt about the parameters of a model leaves on the certify data."""

from collections.abc import Callable, Mapping, Sequence
import math
from typing import TypeVar

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.verify.validation import Validation

Signal = TypeVar('Signal', str, tuple[str, str])

SMALL_STEP = 0.3             # of a number, in its standard deviation


def spread_of_numbers(validation: Validation) -> dict[str, float]:
    """
    Return what the calibrated model may be off on the certify data by its numbers alone.

    Parameters
    ----------
    validation : Validation
        With the calibrated model.

    Returns
    -------
    dict of str -> float
        By signal the rms, in its unit.

    """
    def run(found: Fit) -> dict[str, FloatArray]:
        validation.simulations += 1
        return {s: values[validation.part[s]] for s, values in validation.run(found).items()}

    return spread_of_runs(validation.estimator.spread(validation.base), run, {
        s: values[validation.part[s]] for s, values in validation.refit.items()})


def spread_of_runs(spread: tuple[Sequence[FloatArray], Callable[[int, float], Fit]],
                   run: Callable[[Fit], Mapping[Signal, FloatArray]],
                   usual: Mapping[Signal, FloatArray]) -> dict[Signal, float]:
    """
    Return how far runs of a fit may be off by the doubt about its numbers, rms by signal.

    Parameters
    ----------
    spread : tuple
        What ``Estimator.spread`` returns.
    run : callable
        ``run(fit)``: its signals.
    usual : dict of numpy.ndarray
        The signals of the fit itself.

    """
    covariances, at = spread
    changes = []
    for j, step in enumerate(SMALL_STEP * np.sqrt(np.diag(covariances[0]))):
        moved = run(at(j, step))
        changes.append({s: (moved[s] - usual[s]) / step for s in usual})
    found = {}
    for s in usual:
        by_number = np.column_stack([change[s] for change in changes])
        found[s] = max(math.sqrt(float(np.mean(np.einsum(
            'nk,kl,nl->n', by_number, c, by_number)))) for c in covariances)
    return found

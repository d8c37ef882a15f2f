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
What the doubt about the numbers of a model leaves: of an effect, and on the certify data.

Numbers may stand in for an effect as far as their ranges go. And one motion may hardly show a
number that another rests on: a slow one the damping, say.
"""

import math

import numpy as np
from scipy.optimize import lsq_linear

SMALL_STEP = 0.3             # of a number, in its standard deviation
FLAT = 1e-12                 # of the largest variance; less is none


def distance_to_none(covariance, x, none, low, high):
    """
    Return by how many standard deviations a fit differs from the nearest one without an effect.

    Parameters
    ----------
    covariance : numpy.ndarray, shape (K, K)
        Of all that was fitted.
    x : numpy.ndarray, shape (K,)
        The fit.
    none : numpy.ndarray of bool, shape (K,)
        Which numbers are 0 without the effect.
    low, high : numpy.ndarray, shape (K,)
        Ranges, within which the others move to make up for it.

    Returns
    -------
    float

    """
    variance, axes = np.linalg.eigh(covariance)
    whitened = axes.T / np.sqrt(np.maximum(variance, FLAT * variance.max()))[:, np.newaxis]
    away = whitened[:, none] @ x[none]
    if none.all():
        return float(np.linalg.norm(away))
    inside, rest = np.clip(x, low, high), ~none
    nearest = lsq_linear(whitened[:, rest], away, (
        low[rest] - inside[rest], high[rest] - inside[rest]), method='bvls')
    return math.sqrt(2.0 * nearest.cost)


def spread_of_numbers(proof, problem, base, whole):
    """
    Return what the calibrated model may be off on the certify data by its numbers alone.

    Parameters
    ----------
    proof : Proof
        Of the final model.
    problem : Problem
        That it was fitted to.
    base : Found
        Numbers calibrated alone.
    whole : bool
        As of the Proof.

    Returns
    -------
    dict of str -> float
        By signal the rms, in its unit.

    """
    covariances, at = problem.spread(base)
    changes = []
    for j, step in enumerate(SMALL_STEP * np.sqrt(np.diag(covariances[0]))):
        moved = proof.run(at(j, step), whole)
        changes.append({s: (moved[s] - proof.refit[s]) / step for s in moved})
    proof.simulations += len(changes)
    found = {}
    for s, chosen in proof.part.items():
        by_number = np.column_stack([change[s][chosen] for change in changes])
        found[s] = max(math.sqrt(float(np.mean(np.einsum(
            'nk,kl,nl->n', by_number, c, by_number)))) for c in covariances)
    return found

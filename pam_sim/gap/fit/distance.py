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

"""How far a fit is from the nearest one without an effect."""

import math

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray

FLAT = 1e-12                 # of the largest variance; less is none


def distance_to_none(covariance: FloatArray, x: FloatArray, none: BoolArray, low: FloatArray,
                     high: FloatArray) -> float:
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
    from scipy.optimize import lsq_linear       # slow to import

    variance, axes = np.linalg.eigh(covariance)
    whitened = axes.T / np.sqrt(np.maximum(variance, FLAT * variance.max()))[:, np.newaxis]
    away = whitened[:, none] @ x[none]
    if none.all():
        return float(np.linalg.norm(away))
    inside, rest = np.clip(x, low, high), ~none
    nearest = lsq_linear(whitened[:, rest], away, (
        low[rest] - inside[rest], high[rest] - inside[rest]), method='bvls')
    return math.sqrt(2.0 * nearest.cost)

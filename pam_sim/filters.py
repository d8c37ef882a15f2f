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
Two filters of sampled signals: a local polynomial, and a lag of first order.

They give what ``savgol_filter`` and ``lfilter`` of scipy.signal do. To import that package takes a
second of processor time, since it brings scipy.stats along.
"""

import functools
import math

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.compiled import allocating_entry_point


def local_polynomial(values: FloatArray, steps: int, order: int, deriv: int = 0,
                     step: float = 1.0) -> FloatArray:
    """
    Return a signal, or a derivative of it, by least-squares polynomials (Savitzky and Golay 1964).

    Parameters
    ----------
    values : numpy.ndarray, shape (N,)
        Evenly spaced.
    steps : int
        Samples of a window, odd, at most N. Within half a window of an end, the polynomial of the
        last whole window counts.
    order : int
        Of the polynomial, less than ``steps``.
    deriv : int
        Which derivative.
    step : float
        Distance of the samples.

    """
    from scipy.ndimage import convolve1d       # slow to import
    values = np.asarray(values, dtype=float)
    found = convolve1d(values, weights(steps, order, deriv, step), mode='constant')
    half, place = steps // 2, np.arange(steps, dtype=float)
    for edge, own, kept in ((slice(0, steps), slice(0, half), slice(0, half)),
                            (slice(values.size - steps, None), slice(values.size - half, None),
                             slice(steps - half, None))):
        fitted = np.polyder(np.polyfit(place, values[edge], order), deriv)
        found[own] = np.polyval(fitted, place[kept]) / step ** deriv
    return found


@functools.lru_cache(maxsize=32)
def weights(steps: int, order: int, deriv: int = 0, step: float = 1.0) -> FloatArray:
    """Return the weights of the samples of a window, the last one first; not to be written to."""
    from scipy.linalg import lstsq       # slow to import
    place = np.arange(steps - 1 - steps // 2, -steps // 2, -1.0)
    wanted = np.zeros(order + 1)
    wanted[deriv] = math.factorial(deriv) / step ** deriv
    powers = place ** np.arange(order + 1.0)[:, np.newaxis]
    found: FloatArray = lstsq(powers, wanted, cond=float(np.finfo(float).eps) * steps)[0]
    found.flags.writeable = False
    return found


def first_order(values: FloatArray, keep: float, now: float, before: float = 0.0,
                start: float = 0.0) -> FloatArray:
    """
    Return y of a filter of first order: ``y[n] = keep y[n-1] + now x[n] + before x[n-1]``.

    Parameters
    ----------
    values : numpy.ndarray, shape (..., N)
        Of x; each row on its own.
    keep, now, before : float
        Factors.
    start : float
        What the samples before the first one add to its y.

    """
    rows = np.ascontiguousarray(values, dtype=float)
    found = np.empty_like(rows)
    flat = -1, rows.shape[-1]
    _filter_into(rows.reshape(flat), keep, now, before, start, found.reshape(flat))
    return found


@allocating_entry_point
def _filter_into(values: FloatArray, keep: float, now: float, before: float, start: float,
                 found: FloatArray) -> None:
    """Fill ``found`` with what ``first_order`` returns."""
    for i in range(values.shape[0]):
        rest = start
        for j in range(values.shape[1]):
            found[i, j] = rest + now * values[i, j]
            rest = before * values[i, j] + keep * found[i, j]

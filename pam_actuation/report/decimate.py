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

"""Thin a trace for a page without hiding its extremes."""

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import FloatArray


def decimate_min_max(xs: ArrayLike, ys: ArrayLike,
                     max_points: int = 2400) -> tuple[FloatArray, FloatArray]:
    """
    Keep the smallest and the largest value of every bin, in their order.

    A spike of one sample therefore stays visible, unlike with every n-th sample.
    Non-finite values are left out before binning.

    Parameters
    ----------
    xs, ys : array_like, shape (N,)
        Abscissa (ascending) and value.
    max_points : int
        Largest number of points returned, at least 4.

    Returns
    -------
    (x, y) : numpy.ndarray, numpy.ndarray
        At most ``max_points`` of the given points, ends included.

    """
    x, y = np.asarray(xs, dtype=float), np.asarray(ys, dtype=float)
    good = np.isfinite(x) & np.isfinite(y)
    x, y = x[good], y[good]
    if x.size <= max_points:
        return x, y
    bins = max(int(max_points) // 2 - 1, 1)
    edges = np.linspace(0, x.size, bins + 1).astype(int)
    starts, place = edges[:-1], np.repeat(np.arange(bins), np.diff(edges))
    kept = [np.array([0, x.size - 1])]
    for extreme in np.minimum.reduceat(y, starts), np.maximum.reduceat(y, starts):
        at = np.flatnonzero(y == extreme[place])
        kept.append(at[np.searchsorted(at, starts)])       # the first one of each bin
    keep = np.unique(np.concatenate(kept))
    return x[keep], y[keep]


def decimate_steps(xs: ArrayLike, ys: ArrayLike,
                   max_points: int = 2400) -> tuple[FloatArray, FloatArray]:
    """
    Thin a held (zero order) signal: first drop repeats, then as ``decimate_min_max``.

    Both ends of every plateau are kept, so that a step stays a step.
    """
    x, y = np.asarray(xs, dtype=float), np.asarray(ys, dtype=float)
    if x.size > 2:
        changed = np.flatnonzero(np.diff(y) != 0.0)
        keep = np.unique(np.concatenate(([0], changed, changed + 1, [x.size - 1])))
        x, y = x[keep], y[keep]
    return decimate_min_max(x, y, max_points)

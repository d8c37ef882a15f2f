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
A smooth path through values of a motion that was measured or designed elsewhere.

Where velocity has a corner, the acceleration jumps. Feed-forward of a moved mass then jumps with
every value, which costs valve and learning more than the motion does. A cubic spline has no such
corners, but swings beyond steps; there the monotone cubic counts.
"""

from typing import TYPE_CHECKING

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray

if TYPE_CHECKING:
    from scipy.interpolate import CubicHermiteSpline

# Of the whole range: how far the path may go beyond two neighbours, and beyond all values.
MOST_BEYOND, MOST_OUTSIDE = 0.01, 0.001


def smooth_path(time_s: FloatArray, values: FloatArray,
                repeats: bool = False) -> 'CubicHermiteSpline':
    """
    Return a path of cubics through values.

    It is a cubic spline, whose acceleration has no jumps. Where that would go beyond two
    neighbours by more than ``MOST_BEYOND`` of the whole range, as beside a step, or beyond all
    values by more than ``MOST_OUTSIDE`` of it, the path takes the slopes of a monotone cubic
    (PCHIP; Fritsch & Butland 1984, SIAM J. Sci. Stat. Comput. 5(2)).

    Parameters
    ----------
    time_s : ndarray, shape (N,)
        Times of the values [s], rising; at least two.
    values : ndarray, shape (N,)
        In any unit.
    repeats : bool
        The values are a cycle that is repeated: the last one is the first, and the cycles follow
        one another without a corner.

    """
    from scipy.interpolate import CubicHermiteSpline, CubicSpline
    time_s, values = np.asarray(time_s, dtype=float), np.array(values, dtype=float)
    if repeats:
        values[-1] = values[0]      # to the last bit
    whole = float(np.ptp(values))
    if len(values) > 2 and whole > 0.0:
        spline = CubicSpline(time_s, values, bc_type='periodic' if repeats else 'not-a-knot')
        slopes = np.asarray(spline(time_s, 1))
    else:
        slopes = _monotone(time_s, values, repeats)
    calm = None
    while True:
        path = CubicHermiteSpline(time_s, values, slopes)
        beyond = _too_far(path, values, whole)
        if calm is None and beyond.any():
            calm = _monotone(time_s, values, repeats)
        nodes = np.flatnonzero(np.append(beyond, False) | np.append(False, beyond))
        if calm is None or (slopes[nodes] == calm[nodes]).all():
            return path
        slopes[nodes] = calm[nodes]
        if repeats and (nodes == 0).any() | (nodes == len(values) - 1).any():
            slopes[[0, -1]] = calm[0]


def _monotone(time_s: FloatArray, values: FloatArray, repeats: bool) -> FloatArray:
    """Return the slopes of the monotone cubic at the values."""
    from scipy.interpolate import PchipInterpolator
    if not repeats:
        return np.asarray(PchipInterpolator(time_s, values)(time_s, 1))
    # One neighbour more on either side: no corner between cycles.
    period = time_s[-1] - time_s[0]
    longer = np.concatenate([[time_s[-2] - period], time_s, [time_s[1] + period]])
    path = PchipInterpolator(longer, np.concatenate([[values[-2]], values, [values[1]]]))
    return np.asarray(path(time_s, 1))


def _too_far(path: 'CubicHermiteSpline', values: FloatArray, whole: float) -> BoolArray:
    """Return which cubics go too far beyond their two ends, or all values, shape (N - 1,)."""
    lowest, highest = np.minimum(values[:-1], values[1:]), np.maximum(values[:-1], values[1:])
    low = np.maximum(lowest - MOST_BEYOND * whole, values.min() - MOST_OUTSIDE * whole)
    high = np.minimum(highest + MOST_BEYOND * whole, values.max() + MOST_OUTSIDE * whole)
    a, b, c, d = path.c
    width = np.diff(path.x)
    root = np.sqrt(np.maximum(b * b - 3.0 * a * c, 0.0))
    found = np.zeros(len(width), dtype=bool)
    for sign in (-1.0, 1.0):    # the places where the rate is 0, in a form that takes a = 0
        over = -b + sign * root
        with np.errstate(divide='ignore', invalid='ignore'):
            for place in (over / (3.0 * a), c / over):
                s = np.where((place > 0.0) & (place < width), place, 0.0)
                value = ((a * s + b) * s + c) * s + d
                found |= (value < low) | (value > high)
    return found

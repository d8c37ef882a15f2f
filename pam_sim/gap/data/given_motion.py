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
The measured motion, without what the noise of its sensor would make of it.

The model takes the motion as it is given: its speed becomes damping, and its direction that of dry
friction. Noise at rest would turn that direction hundreds of times a second.
"""

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.noise import noise_of

WINDOW_S = 0.061             # of the parabolas that smooth; passes what is slower than 15 Hz
PARABOLA_GAIN = 2.25         # variance of the middle of a parabola through N values, times N
MOSTLY = 0.5                 # share of the time
DERIVATIVES_S = 0.101        # of the cubics whose derivatives are taken
STILL_SD = 3.0               # a move within so many deviations of the noise left is none


def given_motion(time_s: FloatArray, values: FloatArray, grid_s: FloatArray
                 ) -> tuple[FloatArray, BoolArray]:
    """
    Return a measured contraction [m] on an even grid, smoothed, and still where it rests.

    And where it rests, or moves by less than its noise: the direction of dry friction is not
    known there. Nowhere where that is the greater part, as in a muscle that is held. One that is
    held all the time stays at the median.

    Parameters
    ----------
    time_s, values : numpy.ndarray, shape (M,)
        What was measured.
    grid_s : numpy.ndarray, shape (N,)
        Evenly spaced instants.

    """
    from scipy.signal import savgol_filter       # slow to import
    steps = 2 * int(0.5 * WINDOW_S / (grid_s[1] - grid_s[0])) + 1
    y = savgol_filter(np.interp(grid_s, time_s, values), steps, 2)
    within = max(WINDOW_S / float(np.median(np.diff(time_s))), PARABOLA_GAIN)
    noise = noise_of(time_s, values).sd * float(np.sqrt(PARABOLA_GAIN / within))
    found = followed(y, STILL_SD * noise)
    if np.ptp(found) <= STILL_SD * noise:        # held: what is left of the noise is no motion
        found = np.full(y.size, float(np.median(y)))
    hidden = np.append((np.diff(found) == 0.0) & (np.diff(y) != 0.0), False)
    return found, hidden & (np.mean(hidden) < MOSTLY)


def hardly_moves(contraction_m: FloatArray) -> bool:
    """Return whether a muscle is held, as in an isometric rig."""
    return bool(np.ptp(contraction_m) < CRITERIA.min_contraction_move_m)


def followed(values: FloatArray, play: float) -> FloatArray:
    """Return what follows values with a play to either side, set in its middle at the start."""
    place, found = float(values[0]), []
    for value in values.tolist():
        place = min(max(place, value - play), value + play)
        found.append(place)
    return np.array(found)


def smooth_motion(time_s: FloatArray, contraction_m: FloatArray, grid_s: FloatArray
                  ) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return contraction [m], rate [m/s] and acceleration [m/s^2] on an even grid, smoothed.

    Parameters
    ----------
    time_s, contraction_m : numpy.ndarray, shape (M,)
        What was measured.
    grid_s : numpy.ndarray, shape (N,)
        Evenly spaced instants.

    """
    from scipy.signal import savgol_filter       # slow to import
    dt_s = float(grid_s[1] - grid_s[0])
    x = np.interp(grid_s, time_s, contraction_m)
    steps = 2 * int(0.5 * DERIVATIVES_S / dt_s) + 1
    x_m, v, a = (savgol_filter(x, steps, 3, deriv=k, delta=dt_s) for k in range(3))
    return x_m, v, a

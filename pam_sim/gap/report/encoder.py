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
Whether an error of the contraction is one of its sensor, or of a force behind a stiffness.

A sensor errs in metres, whatever the muscle does. A force that is missing moves the muscle by
itself over the stiffness, which changes with pressure and contraction. Both may follow the
contraction, its rate and its slow memory. What follows them better as it is, is of the sensor.
"""

import math

import numpy as np
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.data.means import behind
from pam_sim.gap.data.recording import GRID_S, Recording
from pam_sim.gap.report.location import AT_STOP_M
from pam_sim.gap.subsystems.simulation import pressure_driven, simulate_driven
from pam_sim.rig import Rig

MEMORIES_S = (0.3, 1.0, 3.0, 10.0)
MEAN_S, FOLD_S = 0.1, 2.0    # of the means that are compared, and of what is left out at a time
STEP_M = 5e-5                # of the slope of the force
LEAST_SHARE_OF_STIFFNESS = 0.1       # of the median; softer it is none
LEAST_MEANS = 100


def sensor_part(rig: Rig, recording: Recording, time_s: FloatArray, errors: FloatArray,
                criteria: Criteria) -> float | None:
    """
    Return which share of an error of the contraction follows it as that of a sensor does.

    Parameters
    ----------
    rig : pam_sim.Rig
        The calibrated model.
    recording : Recording
        Of the certify data.
    time_s, errors : numpy.ndarray, shape (N,)
        Instants [s] and errors of muscle and load on the measured pressure [m].
    criteria : Criteria
        Decision thresholds.

    Returns
    -------
    float or None
        None where it follows a force over a stiffness as well, or neither.

    """
    x, v, _ = recording.motion
    lifted = x > AT_STOP_M
    driven = pressure_driven(rig)
    tension, further = (simulate_driven(driven, recording, x + step).force_n
                        for step in (0.0, STEP_M))
    stiffness = (tension - further) / STEP_M
    usual = float(np.median(stiffness[lifted])) if lifted.any() else 0.0
    if usual <= 0.0:
        return None
    softness = usual / np.maximum(stiffness, LEAST_SHARE_OF_STIFFNESS * usual)
    features = np.column_stack([np.ones(x.size), x, v, *(
        x - behind(x, memory, GRID_S) for memory in MEMORIES_S)])
    place = np.clip(np.rint(time_s / GRID_S).astype(int), 0, x.size - 1)
    span = (time_s // MEAN_S).astype(int)
    used = np.flatnonzero(np.bincount(span, ~lifted[place], minlength=span.max() + 1) == 0)
    used = used[np.bincount(span, minlength=span.max() + 1)[used] > 0]
    if used.size < LEAST_MEANS:
        return None
    count = np.bincount(span)[used]

    def means(values: FloatArray) -> FloatArray:
        return np.bincount(span, values)[used] / count

    fold = (used * MEAN_S // FOLD_S).astype(int)
    y = means(errors)
    as_sensor, as_force = (_left_out(np.column_stack([means((column * by)[place])
                                                      for column in features.T]), y, fold)
                           for by in (np.ones(x.size), softness))
    part = 1.0 - float(np.sum(as_sensor ** 2) / np.sum((y - y.mean()) ** 2))
    _, first = np.unique(fold, return_inverse=True)
    ratio = np.log((np.bincount(first, as_force ** 2) + 1e-18) / (
        np.bincount(first, as_sensor ** 2) + 1e-18))
    t = float(ratio.mean()) / max(float(ratio.std(ddof=1)) / math.sqrt(ratio.size), 1e-9)
    return part if part > criteria.greater_part and t > criteria.ahead_t else None


def _left_out(columns: FloatArray, y: FloatArray, fold: IntArray) -> FloatArray:
    """Return what a linear fit leaves of even folds fitted to odd ones, and the reverse."""
    left = np.empty_like(y)
    for odd in (0, 1):
        mine = fold % 2 == odd
        factors, *_ = np.linalg.lstsq(columns[~mine], y[~mine], rcond=None)
        left[mine] = y[mine] - columns[mine] @ factors
    return left

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

"""What tuning minimises: tracking error, in mm, degrees or N, late ones more than early ones."""

import numpy as np
from pam_sim.annotations import FloatArray

LATE_SHARE = 0.3          # of the experiment, counted from its end
_EARLY_WEIGHT = 0.25
_WORST_WEIGHT = 0.1
LOST = 1e3                # cost of a run that is not finite, mm, degrees or N


def tracking_cost(error: FloatArray, start_tick: int = 0) -> float:
    """
    Return the cost of one run, in the unit of the error.

    It is the root mean square error of the last part of the run. A quarter of that of the whole
    run and a tenth of the worst late error are added. The quarter rewards fast learning.

    Parameters
    ----------
    error : numpy.ndarray
        Reference minus contraction [mm], angle [degrees] or force [N] at every tick.
    start_tick : int
        First tick that counts: the start from rest is the same for all controllers.

    """
    counted = np.asarray(error)[start_tick:]
    if not np.all(np.isfinite(counted)):
        return LOST
    late = counted[-max(1, int(len(counted) * LATE_SHARE)):]
    return float(
        np.sqrt(np.mean(late ** 2)) + _EARLY_WEIGHT * np.sqrt(np.mean(counted ** 2))
        + _WORST_WEIGHT * np.max(np.abs(late)))

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
Whether a recorded supply pressure moves.

It is a witness: where it stands still, no reservoir empties, and where it moves, a model with a
constant one has a gap.
"""

from collections.abc import Iterable

import numpy as np
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.data.means import means_of
from pam_sim.gap.data.noise import noise_of
from pam_sim.gap.data.recording import Recording

MEAN_S = 1.0                 # of the means whose scatter tells
DRIFT_SD = 0.2               # of a sensor over a recording, in its standard deviations
LEAST_MEANS = 5


def supply_scatter(recording: Recording) -> tuple[float, float, float] | None:
    """
    Return how far the recorded supply pressure moves, how far noise would move it, its noise [Pa].

    The first two are standard deviations of means over a second. None where it is not recorded
    or the recording is too short.
    """
    if recording.supply is None or recording.valve != 'hsv' or recording.pressure_given:
        return None
    time_s, values = recording.supply
    if time_s.size < LEAST_MEANS:
        return None
    noise = noise_of(time_s, values)
    means = means_of(values, time_s, MEAN_S)
    if means.size < LEAST_MEANS or noise.sd <= 0.0:
        return None
    most = np.bincount((time_s // MEAN_S).astype(int)).max()
    return float(means.std()), noise.sd * float(np.hypot(
        1.0 / np.sqrt(most), DRIFT_SD)), noise.sd


def supply_stands(recordings: Iterable[Recording], criteria: Criteria) -> bool:
    """Return whether the supply pressure was recorded in all recordings and moves in none."""
    found = [supply_scatter(one) for one in recordings]
    return bool(found) and all(
        one is not None and one[0] < criteria.likely_sd * one[1] for one in found)

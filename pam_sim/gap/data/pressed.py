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

"""The highest pressure that recordings held: an experiment that is proposed stays below it."""

from collections.abc import Iterable

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.units import P_ATM_PA

HELD_PERCENT = 99.5          # of the samples are below it; noise and overshoot are above


def recorded_gauge_pa(pressures: Iterable[FloatArray]) -> float:
    """Return the highest pressure [Pa gauge] of recordings, single samples aside."""
    return max(float(np.percentile(one, HELD_PERCENT)) for one in pressures) - P_ATM_PA

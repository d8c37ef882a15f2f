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

"""A change of the reading of the encoder, of a form that is tried."""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.unnamed import reading

INPUTS = reading.INPUTS
EFFECT = reading.term_of_reading('contraction')
sensor_commit = reading.remember


@compiled
def sensor(pressure_pa: float, contraction_m: float, force_n: float, state: np.record,
           par: np.record, plant: np.record) -> tuple[float, float, float]:
    """Return the readings with the terms."""
    change = reading.change_of(pressure_pa, contraction_m, force_n, state, par, plant)
    return pressure_pa, contraction_m + change, force_n

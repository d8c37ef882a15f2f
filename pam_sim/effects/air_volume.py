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

"""The volume of the air in the rig without its effects, as the effects on pressure see it."""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Numbers
from pam_sim.muscle.geometry import volume_m3

VOLUME = 'dead_volume_m3', 'length_m', 'thread_squared_m2', 'inverse_4_pi_n2'


def pack_volume(numbers: Numbers) -> dict[str, float]:
    """Return the packed values of ``VOLUME``."""
    return dict(zip(VOLUME, (numbers.parameters['V_dead'], *numbers.muscle.shape)))


@compiled
def air_volume_m3(contraction_m: float, par: np.record) -> float:
    """Return the volume [m^3] of muscle and dead volume at a contraction."""
    return par.dead_volume_m3 + volume_m3(
        contraction_m, par.length_m, par.thread_squared_m2, par.inverse_4_pi_n2)

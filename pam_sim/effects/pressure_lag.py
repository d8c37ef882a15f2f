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

"""The pressure sensor is slower than the others: tau dy/dt = p - y."""

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.lag import advance_sampled, lag_of_sensor

EFFECT = lag_of_sensor('pressure', 'p', lambda numbers: numbers.pressure_pa)


@compiled
def sensor_commit(pressure_pa: float, state: np.record, par: np.record) -> None:
    """Advance the lagged reading by one step."""
    advance_sampled(pressure_pa, state, par)


@compiled
def sensor(contraction_m: float, force_n: float, state: np.record) -> tuple[float, float, float]:
    """Return the readings with the lag."""
    return state.reading, contraction_m, force_n

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

"""Scale of the pressure sensor, on gauge pressure: the reading is p_atm + (1 + e) p_g."""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.effects.fitting import Fitting
from pam_sim.parameters import Parameter
from pam_sim.units import P_ATM_PA

EFFECT = Effect(
    name='pressure_gain',
    family='sensor',
    subsystem='sensor',
    sentence='The gauge pressure reading is off by a factor.',
    source='Scale error of a sensor; size: design choice.',
    equation='p_read = p_atm + (1 + e) p_g',
    parameters=(
        Parameter('gain_error', '-', 0.02, -0.5, 1.0, description='Scale less one.'),
    ),
    amplitude=('gain_error',),
    reported=(Reported('gain_error', '-', lambda values, rig: values['gain_error']),),
    fitting=Fitting(sensor_signal='pressure', sensor_change='gain'),
)


@compiled
def sensor(pressure_pa: float, contraction_m: float, force_n: float,
           par: np.record) -> tuple[float, float, float]:
    """Return the readings with the scale."""
    return pressure_pa + par.gain_error * (pressure_pa - P_ATM_PA), contraction_m, force_n

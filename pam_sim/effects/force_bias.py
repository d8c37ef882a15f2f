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

"""Offset of the force sensor: the reading is F + b."""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.effects.fitting import Fitting
from pam_sim.parameters import Parameter

EFFECT = Effect(
    name='force_bias',
    family='sensor',
    subsystem='sensor',
    sentence='The force reading is off by a constant.',
    source='Zero error of a sensor; size: design choice.',
    equation='F_read = F_cell + b',
    parameters=(
        Parameter('bias_n', 'N', 1.0, -50.0, 50.0, description='Offset of the reading.'),
    ),
    amplitude=('bias_n',),
    reported=(Reported('bias_n', 'N', lambda values, rig: values['bias_n']),),
    order=60,               # after lag and scale
    fitting=Fitting(sensor_signal='force', sensor_change='bias'),
)


@compiled
def sensor(pressure_pa: float, contraction_m: float, force_n: float,
           par: np.record) -> tuple[float, float, float]:
    """Return the readings with the offset."""
    return pressure_pa, contraction_m, force_n + par.bias_n

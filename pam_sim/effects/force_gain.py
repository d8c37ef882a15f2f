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

"""Scale of the load cell: the reading is (1 + e) F."""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.effects.fitting import Fitting
from pam_sim.parameters import Parameter

EFFECT = Effect(
    name='force_gain',
    family='sensor',
    subsystem='sensor',
    sentence='The force reading is off by a factor.',
    source='Scale error of a sensor; size: design choice.',
    equation='F_read = (1 + e) F_cell',
    parameters=(
        Parameter('gain_error', '-', 0.02, -0.5, 1.0, description='Scale less one.'),
    ),
    amplitude=('gain_error',),
    reported=(Reported('gain_error', '-', lambda values, rig: values['gain_error']),),
    fitting=Fitting(sensor_signal='force', sensor_change='gain'),
)


@compiled
def sensor(pressure_pa: float, contraction_m: float, force_n: float,
           par: np.record) -> tuple[float, float, float]:
    """Return the readings with the scale."""
    return pressure_pa, contraction_m, force_n * (1.0 + par.gain_error)

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

"""The contraction sensor is slower than the others: tau dy/dt = x - y."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import DELAY_STARTS_S, Fitting, FreeParameter
from pam_sim.effects.lag import advance_sampled, pack_sampled, READING, SAMPLED
from pam_sim.parameters import Parameter


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return {'reading': numbers.contraction_m, 'true': numbers.contraction_m}


EFFECT = Effect(
    name='contraction_lag',
    family='sensor',
    subsystem='sensor',
    sentence='The contraction sensor follows its signal with a lag of its own.',
    source='First order filter of a sensor; size: design choice.',
    equation='x_read = y, tau dy/dt = x - y',
    parameters=(
        Parameter('time_constant_s', 's', 0.010, 0.0, 1.0, description='Lag of the sensor.'),
    ),
    amplitude=('time_constant_s',),
    reported=(Reported('time_constant_s', 's', lambda values, rig: values['time_constant_s']),),
    packed=SAMPLED,
    pack=pack_sampled,
    states=READING,
    initial=_initial,
    active=lambda values, numbers: values['time_constant_s'] >= 1e-9,
    order=30,               # before scale and offset
    fitting=Fitting(
        free=(FreeParameter('time_constant_s', 0.01, 0.0, 0.2, starts=DELAY_STARTS_S),),
        delay='time_constant_s',
        sensor_signal='contraction', sensor_change='lag'),
)


@compiled
def sensor_commit(contraction_m: float, state: np.record, par: np.record) -> None:
    """Advance the lagged reading by one step."""
    advance_sampled(contraction_m, state, par)


@compiled
def sensor(pressure_pa: float, force_n: float, state: np.record) -> tuple[float, float, float]:
    """Return the readings with the lag."""
    return pressure_pa, state.reading, force_n

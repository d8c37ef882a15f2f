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

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import DELAY_STARTS_S, Fitting, FreeParameter
from pam_sim.effects.lag import advance_sampled, pack_sampled, READING, SAMPLED
from pam_sim.parameters import Parameter


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return {'reading': numbers.pressure_pa, 'true': numbers.pressure_pa}


EFFECT = Effect(
    name='pressure_lag',
    family='sensor',
    subsystem='sensor',
    sentence='The pressure sensor follows its signal with a lag of its own.',
    source='First order filter of a sensor; size: design choice.',
    equation='p_read = y, tau dy/dt = p - y',
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
        sensor_signal='pressure', sensor_change='lag'),
)


@compiled
def sensor_commit(pressure_pa: float, state: np.record, par: np.record) -> None:
    """Advance the lagged reading by one step."""
    advance_sampled(pressure_pa, state, par)


@compiled
def sensor(contraction_m: float, force_n: float, state: np.record) -> tuple[float, float, float]:
    """Return the readings with the lag."""
    return state.reading, contraction_m, force_n

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
The valve of a regulator follows what its loop asks for with a lag, so the pressure overshoots.

    T_i dw/dt = r - w,   dp/dt = w

Here r is the rate that the first order lag asks for, within its limits, and T_i = 0 leaves it as
it is. Without limits this is T_m T_i p'' + T_m p' + p = p_set, with damping ratio
sqrt(T_m / T_i) / 2. The mean of w over a physics step is used, exact for a held r.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.effects.lag import HELD, mean_of_held, pack_held
from pam_sim.parameters import Parameter
from pam_sim.records import record


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return pack_held({'time_constant_s': values['inner_lag_s']}, numbers)


EFFECT = Effect(
    name='regulator_overshoot',
    family='transport',
    subsystem='valve',
    sentence='The valve inside the regulator lags behind its loop, so that the pressure '
             'overshoots.',
    source='Second order lag of a closed loop; electronic regulators overshoot when set to be '
           'fast.',
    equation='dp/dt = w, T_i dw/dt = r - w, r the rate of the first order lag; damping ratio '
             'sqrt(T_m / T_i) / 2',
    parameters=(
        Parameter('inner_lag_s', 's', 0.040, 0.0, 1.0,
                  description='Lag T_i of the valve inside the regulator.'),
    ),
    amplitude=('inner_lag_s',),
    reported=(Reported('inner_lag_s', 's', lambda values, rig: values['inner_lag_s']),),
    states=record('rate_pa_per_s', 'asked_pa_per_s', 'calls'),
    packed=HELD,
    pack=_pack,
    valves=('ppr',),
    order=45,               # after the limits of the flow, before what leaks behind it
    fitting=Fitting(
        free=(FreeParameter('inner_lag_s', 0.02, 0.0, 0.5, starts=(0.04, 0.01)),),
        limits=('tube_lag',)),
)


@compiled
def pressure_rate(rate_pa_per_s: float, state: np.record, par: np.record) -> float:
    """Return the mean rate of the step, were this one asked for all along."""
    state.asked_pa_per_s += rate_pa_per_s
    state.calls += 1.0
    mean_pa_per_s, _ = mean_of_held(rate_pa_per_s, state.rate_pa_per_s, par)
    return mean_pa_per_s


@compiled
def commit(state: np.record, par: np.record) -> None:
    """Advance the valve towards the mean of what was asked for."""
    if state.calls > 0.0:
        _, state.rate_pa_per_s = mean_of_held(
            state.asked_pa_per_s / state.calls, state.rate_pa_per_s, par)
        state.asked_pa_per_s = 0.0
        state.calls = 0.0

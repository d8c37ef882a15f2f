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
Line and pilot stage in series: two first order lags, stated as their sum.

    tau (1 - s) dw/dt = u - w,  tau s dy/dt = w - y

PPR: y is the set point that reaches the regulator. HSV: y is the opening of each valve.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.effects.lag import HELD, mean_of_held, pack_held
from pam_sim.effects.tube_lag import EFFECT as _SIBLING
from pam_sim.parameters import Parameter
from pam_sim.records import record

_SHORTEST_S = 1e-9             # of a stage that is not there
_NAMES = () if _SIBLING.states is None else _SIBLING.states.names or ()
_STAGES = 'first', 'second'


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    at_rest = _SIBLING.initial(values, numbers)
    return {f'{stage}_{name}': value for stage in _STAGES for name, value in at_rest.items()}


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    whole_s, second = values['time_constant_s'], values['second_stage_share']
    packed: dict[str, Any] = {}
    for stage, share in zip(_STAGES, (1.0 - second, second)):
        held = pack_held({'time_constant_s': max(share * whole_s, _SHORTEST_S)}, numbers)
        packed[stage] = [held[name] for name in HELD.names or ()]
    return packed


EFFECT = Effect(
    name='tube_lag_two_stage',
    variant_of='tube_lag',
    family=_SIBLING.family,
    subsystem=_SIBLING.subsystem,
    sentence='Line and pilot stage add a lag each between command and flow.',
    source='Two first order lags in series; design choice.',
    equation='tau (1 - s) dw/dt = u - w, tau s dy/dt = w - y, y for u (PPR: set point; HSV: '
             'opening of each valve)',
    parameters=(
        *_SIBLING.parameters,
        Parameter('second_stage_share', '-', 0.2, 0.0, 0.5,
                  description='Share s of the second stage in the extra time constant.'),
    ),
    amplitude=_SIBLING.amplitude,
    reported=_SIBLING.reported,
    states=record(*(f'{stage}_{name}' for stage in _STAGES for name in _NAMES)),
    packed=record(*((stage, HELD) for stage in _STAGES)),
    pack=_pack,
    initial=_initial,
    order=_SIBLING.order,
    fitting=Fitting(
        free=(
            FreeParameter('time_constant_s', 0.01, 0.0, 0.5),
            FreeParameter('second_stage_share', 0.2, 0.02, 0.5, True, ends=())),
        refinement=True),
)


@compiled
def set_point(set_point_pa: float, time_constant_s: float, state: np.record,
              par: np.record) -> tuple[float, float]:
    """Return the set point of the PPR behind both stages."""
    mean_pa, state.first_set_point_pa = mean_of_held(
        set_point_pa, state.first_set_point_pa, par.first)
    mean_pa, state.second_set_point_pa = mean_of_held(
        mean_pa, state.second_set_point_pa, par.second)
    return mean_pa, time_constant_s


@compiled
def flow_opening(fill: float, vent: float, state: np.record,
                 par: np.record) -> tuple[float, float]:
    """Return the openings of the HSV pair behind both stages."""
    mean_fill, state.first_fill_opening = mean_of_held(fill, state.first_fill_opening, par.first)
    mean_vent, state.first_vent_opening = mean_of_held(vent, state.first_vent_opening, par.first)
    mean_fill, state.second_fill_opening = mean_of_held(
        mean_fill, state.second_fill_opening, par.second)
    mean_vent, state.second_vent_opening = mean_of_held(
        mean_vent, state.second_vent_opening, par.second)
    return mean_fill, mean_vent

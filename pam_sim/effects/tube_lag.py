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
An extra first order lag of the line or of a pilot stage.

    tau dy/dt = u - y

PPR: y is the set point that reaches the regulator. HSV: y is the opening of
each valve. The mean of y over a physics step is used, exact for a held u.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_sim.compiled import compiled, interpreted
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import DELAY_STARTS_S, Fitting, FreeParameter
from pam_sim.effects.lag import HELD, mean_of_held, pack_held
from pam_sim.parameters import Parameter
from pam_sim.records import record
from pam_sim.valve.hsv import clip_duty
from pam_sim.valve.ppr import set_point_of


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    if numbers.valve == 'ppr':
        voltage, *_ = numbers.signal
        return {'set_point_pa': set_point_of(
            voltage, numbers.parameters, numbers.parameters['p_atm'])}
    fill, vent = numbers.signal
    duty = interpreted(clip_duty)
    return {'fill_opening': duty(fill), 'vent_opening': duty(vent)}


EFFECT = Effect(
    name='tube_lag',
    family='transport',
    subsystem='valve',
    sentence='Line or pilot stage add a lag of their own between command and flow.',
    source='First order lag; pilot stage of an electro-pneumatic regulator, tube of 1-2 m '
           '(design value).',
    equation='tau dy/dt = u - y, y for u (PPR: set point; HSV: opening of each valve)',
    parameters=(
        Parameter('time_constant_s', 's', 0.020, 0.0, 1.0, description='Extra time constant.'),
    ),
    amplitude=('time_constant_s',),
    reported=(Reported('time_constant_s', 's', lambda values, rig: values['time_constant_s']),),
    states=record('set_point_pa', 'fill_opening', 'vent_opening'),
    packed=HELD,
    pack=pack_held,
    initial=_initial,
    order=40,               # before the threshold of the main stage
    fitting=Fitting(
        free=(FreeParameter('time_constant_s', 0.01, 0.0, 0.5, starts=DELAY_STARTS_S),),
        delay='time_constant_s'),
)


@compiled
def set_point(set_point_pa: float, time_constant_s: float, state: np.record,
              par: np.record) -> tuple[float, float]:
    """Return the lagged set point of the PPR."""
    mean_pa, state.set_point_pa = mean_of_held(set_point_pa, state.set_point_pa, par)
    return mean_pa, time_constant_s


@compiled
def flow_opening(fill: float, vent: float, state: np.record,
                 par: np.record) -> tuple[float, float]:
    """Return the lagged openings of the HSV pair."""
    mean_fill, state.fill_opening = mean_of_held(fill, state.fill_opening, par)
    mean_vent, state.vent_opening = mean_of_held(vent, state.vent_opening, par)
    return mean_fill, mean_vent

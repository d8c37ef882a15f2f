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

"""Play of a regulator: the output follows the command only after the play is used up."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter
from pam_sim.records import record
from pam_sim.valve.ppr import set_point_of


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    voltage, *_ = numbers.signal
    return {'set_point_pa': set_point_of(
        voltage, numbers.parameters, numbers.parameters['p_atm'])}


EFFECT = Effect(
    name='valve_hysteresis',
    family='valve_nonlinearity',
    subsystem='valve',
    sentence='The pressure of the regulator depends on the direction from which the command '
             'came.',
    source='Play operator, e.g. Visintin (1994), Differential Models of Hysteresis; size: design '
           'value, below 0.5 % of full scale.',
    equation='p_set -> y, y = clip(y_before, p_set - w, p_set + w)',
    parameters=(
        Parameter('half_width_pa', 'Pa', 2e3, 0.0, 100e3, description='Half of the play.'),
    ),
    amplitude=('half_width_pa',),
    reported=(Reported('half_width_pa', 'Pa', lambda values, rig: values['half_width_pa']),),
    states=record('set_point_pa'),
    initial=_initial,
    valves=('ppr',),
    order=30,               # the command's side of every lag
    fitting=Fitting(free=(FreeParameter('half_width_pa', 2e3, 0.0, 5e4),)),
)


@compiled
def set_point(set_point_pa: float, time_constant_s: float, state: np.record,
              par: np.record) -> tuple[float, float]:
    """Return the set point behind the play."""
    width = par.half_width_pa
    played_pa: float = min(max(state.set_point_pa, set_point_pa - width), set_point_pa + width)
    state.set_point_pa = played_pa
    return played_pa, time_constant_s

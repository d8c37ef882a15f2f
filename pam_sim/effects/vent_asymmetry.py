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
Venting is slower than filling by a ratio, or quicker where it is below 1.

PPR: the time constant is longer by the ratio while the pressure falls towards
its set point. HSV: the flow through the vent valve is smaller by the ratio.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter
from pam_sim.records import record


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    ratio = 1.0 + values['ratio_minus_1']
    return {'ratio': ratio, 'inverse_ratio': 1.0 / ratio}


EFFECT = Effect(
    name='vent_asymmetry',
    family='valve_nonlinearity',
    subsystem='valve',
    sentence='Venting takes longer than filling.',
    opposite='Venting is quicker than filling.',
    source='Design choice of form; measured on proportional valves with muscles: falling steps '
           '1.5 to 2 times slower than rising ones.',
    equation='PPR: T_m -> r T_m while p > p_set; HSV: mdot_vent -> mdot_vent / r; '
             'r = 1 + ratio_minus_1',
    parameters=(
        Parameter('ratio_minus_1', '-', 0.4, -0.5, 9.0,
                  description='Time of venting over time of filling, less one.'),
    ),
    amplitude=('ratio_minus_1',),
    reported=(Reported(
        'vent_to_fill_time_ratio', '-', lambda values, rig: 1.0 + values['ratio_minus_1']),),
    packed=record('ratio', 'inverse_ratio'),
    pack=_pack,
    order=60,               # after what changes the set point
    fitting=Fitting(free=(FreeParameter('ratio_minus_1', 0.2, -0.4, 4.0),)),
)


@compiled
def set_point(set_point_pa: float, time_constant_s: float, pressure_pa: float,
              par: np.record) -> tuple[float, float]:
    """Return the time constant longer while venting."""
    if set_point_pa < pressure_pa:
        return set_point_pa, time_constant_s * par.ratio
    return set_point_pa, time_constant_s


@compiled
def valve_flow(fill_kg_per_s: float, vent_kg_per_s: float, par: np.record) -> tuple[float, float]:
    """Return the vent flow smaller."""
    return fill_kg_per_s, vent_kg_per_s * par.inverse_ratio

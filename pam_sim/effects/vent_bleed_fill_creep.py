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
A regulator whose two valves close before the set point; the pilot stage does the rest slowly.

The vent is that of ``vent_bleed``. The fill valve likewise closes below the set point, by a
distance of its own, and then lets the pressure creep up.
"""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.effects.vent_bleed import closing_vent, EFFECT as _SIBLING
from pam_sim.parameters import Parameter

EFFECT = Effect(
    name='vent_bleed_fill_creep',
    variant_of='vent_bleed',
    family=_SIBLING.family,
    subsystem=_SIBLING.subsystem,
    sentence='Both valves of the regulator close before the set point, which is then reached '
             'slowly.',
    source='Read off measured steps of a DMSP-10-250 behind a regulator '
           '(github.com/tbazina/pam_lqi_pid): filling ends about 10 kPa below, venting 20 kPa '
           'above.',
    equation='e = p_g - K_m u: as vent_bleed for e > 0, mirrored for e < 0 with w_fill '
             'and b_fill',
    parameters=(
        *_SIBLING.parameters,
        Parameter('fill_closing_pressure_pa', 'Pa', 10e3, 0.0, 200e3,
                  description='Distance below the set point at which the fill valve closes.'),
        Parameter('creep_rate_pa_per_s', 'Pa/s', 2e3, 1.0, 1e9,
                  description='Rate at which the pressure rises while the fill valve is closed.'),
    ),
    amplitude=('closing_pressure_pa', 'fill_closing_pressure_pa'),
    reported=(
        *_SIBLING.reported,
        Reported('fill_closing_pressure_pa', 'Pa',
                 lambda values, rig: values['fill_closing_pressure_pa']),
        Reported('creep_rate_pa_per_s', 'Pa/s', lambda values, rig: values['creep_rate_pa_per_s']),
    ),
    valves=('ppr',),
    order=_SIBLING.order,
    fitting=Fitting(
        free=(
            *_SIBLING.fitting.free,
            # Less is not told from none: then it is the other form.
            FreeParameter('fill_closing_pressure_pa', 5e3, 1e3, 1e5),
            FreeParameter('creep_rate_pa_per_s', 3e3, 3e2, 3e5, True)),
        refinement=True,
        together=('valve_dead_time_by_direction', 'flow_limit')),
)


@compiled
def set_point(set_point_pa: float, time_constant_s: float, pressure_pa: float,
              par: np.record) -> tuple[float, float]:
    """Return the set point the open valve aims at, or the lag of what it leaves."""
    above_pa = pressure_pa - set_point_pa
    if above_pa >= 0.0:
        aim_pa, lag_s = closing_vent(
            above_pa, time_constant_s, par.closing_pressure_pa, par.bleed_rate_pa_per_s)
        return set_point_pa + aim_pa, lag_s
    aim_pa, lag_s = closing_vent(
        -above_pa, time_constant_s, par.fill_closing_pressure_pa, par.creep_rate_pa_per_s)
    return set_point_pa - aim_pa, lag_s

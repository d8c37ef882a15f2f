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
A regulator whose vent closes above the set point and then bleeds.

The vent valve answers to what the pressure exceeds the set point by, e, less its closing
pressure w. Below that only the bleed of the pilot stage is left, at a rate b until the lag
itself is slower:

    dp/dt = -(e - w) / T_m - b    for e > w
    dp/dt = -min(b, e / T_m)      for 0 < e <= w

A bleed quicker than w / T_m would be quicker than the lag, so it is that of the lag.
"""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter

EFFECT = Effect(
    name='vent_bleed',
    family='valve_nonlinearity',
    subsystem='valve',
    sentence='The vent of the regulator closes above the set point and then bleeds slowly.',
    source='Read off measured steps of a DMSP-10-250 behind a regulator '
           '(github.com/tbazina/pam_lqi_pid): the vent closes about 20 kPa above the set point, '
           'then 10 kPa/s; regulators with an exhaust and a bleed orifice.',
    equation='e = p_g - K_m u: dp/dt = -(e - w)/T_m - b for e > w, -min(b, e/T_m) for '
             '0 < e <= w',
    parameters=(
        Parameter('closing_pressure_pa', 'Pa', 20e3, 0.0, 200e3,
                  description='Distance above the set point at which the vent closes.'),
        Parameter('bleed_rate_pa_per_s', 'Pa/s', 10e3, 1.0, 1e9,
                  description='Rate at which the pressure falls while the vent is closed.'),
    ),
    amplitude=('closing_pressure_pa',),
    reported=(
        Reported('closing_pressure_pa', 'Pa', lambda values, rig: values['closing_pressure_pa']),
        Reported('bleed_rate_pa_per_s', 'Pa/s', lambda values, rig: values['bleed_rate_pa_per_s']),
    ),
    valves=('ppr',),
    order=65,               # after what changes set point and lag
    fitting=Fitting(
        free=(
            FreeParameter('closing_pressure_pa', 5e3, 0.0, 1e5),
            FreeParameter('bleed_rate_pa_per_s', 1e4, 1e3, 3e5, True)),
        limits=('valve_dead_zone', 'vent_asymmetry'),
        together=('valve_dead_time_by_direction', 'flow_limit')),
)


@compiled
def closing_vent(above_pa: float, time_constant_s: float, closing_pa: float,
                 rate_pa_per_s: float) -> tuple[float, float]:
    """Return (aim above the set point [Pa], lag [s]) of a valve at a distance not negative."""
    if above_pa > closing_pa:
        return max(closing_pa - rate_pa_per_s * time_constant_s, 0.0), time_constant_s
    return 0.0, max(time_constant_s, above_pa / rate_pa_per_s)


@compiled
def set_point(set_point_pa: float, time_constant_s: float, pressure_pa: float,
              par: np.record) -> tuple[float, float]:
    """Return the set point the open vent aims at, or the lag of the bleed."""
    above_pa = pressure_pa - set_point_pa
    if above_pa <= 0.0:
        return set_point_pa, time_constant_s
    aim_pa, lag_s = closing_vent(
        above_pa, time_constant_s, par.closing_pressure_pa, par.bleed_rate_pa_per_s)
    return set_point_pa + aim_pa, lag_s

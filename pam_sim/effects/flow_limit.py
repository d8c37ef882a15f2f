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
Choked flow caps the pressure rate of a regulator, fill and vent apart.

    -r_v g(p, p_atm) V400 / (g400 V(x))  <=  dp/dt  <=  r_f g(p_s, p) V400 / (g400 V(x))

Here g(p1, p2) = p1 psi(p2 / p1) of ISO 6358, with b = 0.3. V400 and g400 hold at 400 kPa
gauge, x = 10 mm and nominal supply. So r_f and r_v are the caps there. p_s is the rig's own
supply.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_sim.compiled import compiled, interpreted
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import check_parameters, Parameter
from pam_sim.records import record
from pam_sim.units import P_ATM_PA
from pam_sim.valve import hsv
from pam_sim.valve.flow import mass_flow_kg_per_s

CRITICAL_RATIO = 0.3
_GAUGE_PA, _CONTRACTION_M = 400e3, 0.010
_NOMINAL_SUPPLY_PA = check_parameters(hsv.PARAMETERS, {})['supply_pa']
_NO_LIMIT = 1e30
_RATES = (4e5, 1e6, 2.5e6)         # Pa/s, of the screening


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    volume = numbers.parameters['V_dead'] + numbers.muscle.volume_m3(
        _CONTRACTION_M, _GAUGE_PA)
    p = P_ATM_PA + _GAUGE_PA
    fill = vent = _NO_LIMIT
    if values['fill_rate_at_400kpa_pa_per_s'] > 0.0:
        flow = interpreted(mass_flow_kg_per_s)(_NOMINAL_SUPPLY_PA, p, 1.0, CRITICAL_RATIO)
        fill = values['fill_rate_at_400kpa_pa_per_s'] * volume / flow
    if values['vent_rate_at_400kpa_pa_per_s'] > 0.0:
        flow = interpreted(mass_flow_kg_per_s)(p, P_ATM_PA, 1.0, CRITICAL_RATIO)
        vent = values['vent_rate_at_400kpa_pa_per_s'] * volume / flow
    return {'fill_m3_per_s': fill, 'vent_m3_per_s': vent,
            'supply_pa': numbers.parameters['supply_pa'], 'atmosphere_pa': P_ATM_PA}


EFFECT = Effect(
    name='flow_limit',
    family='valve_nonlinearity',
    subsystem='valve',
    sentence='The regulator cannot fill or vent faster than choked flow allows.',
    source='ISO 6358, b = 0.3; model of an electro-pneumatic regulator with orifice flow caps.',
    equation='-r_v G(p, p_atm) <= dp/dt <= r_f G(p_s, p), G = g V400 / (g400 V), g(p1, p2) '
             '= p1 psi(p2 / p1), b = 0.3',
    parameters=(
        Parameter('fill_rate_at_400kpa_pa_per_s', 'Pa/s', 1.5e6, 0.0, 1e9,
                  description='Highest filling rate at 400 kPa gauge and 10 mm; 0 for no limit.'),
        Parameter('vent_rate_at_400kpa_pa_per_s', 'Pa/s', 1.0e6, 0.0, 1e9,
                  description='Highest venting rate at 400 kPa gauge and 10 mm; 0 for no limit.'),
    ),
    amplitude=('fill_rate_at_400kpa_pa_per_s', 'vent_rate_at_400kpa_pa_per_s'),
    reported=(
        Reported('fill_rate_at_400kpa_pa_per_s', 'Pa/s',
                 lambda values, rig: values['fill_rate_at_400kpa_pa_per_s']),
        Reported('vent_rate_at_400kpa_pa_per_s', 'Pa/s',
                 lambda values, rig: values['vent_rate_at_400kpa_pa_per_s']),
    ),
    packed=record('fill_m3_per_s', 'vent_m3_per_s', 'supply_pa', 'atmosphere_pa'),
    pack=_pack,
    valves=('ppr',),
    order=40,               # the regulator's own rate: before what leaks behind it
    fitting=Fitting(
        free=(
            FreeParameter('fill_rate_at_400kpa_pa_per_s', 1e6, 5e4, 5e7, True, _RATES),
            FreeParameter('vent_rate_at_400kpa_pa_per_s', 1e6, 5e4, 5e7, True, _RATES))),
)


@compiled
def pressure_rate(rate_pa_per_s: float, pressure_pa: float, volume_m3: float,
                  par: np.record) -> float:
    """Return the pressure rate within what the orifices let through."""
    if rate_pa_per_s > 0.0:
        cap = par.fill_m3_per_s / volume_m3
        return min(rate_pa_per_s, mass_flow_kg_per_s(
            par.supply_pa, pressure_pa, cap, CRITICAL_RATIO))
    cap = par.vent_m3_per_s / volume_m3
    return max(rate_pa_per_s, -mass_flow_kg_per_s(
        pressure_pa, par.atmosphere_pa, cap, CRITICAL_RATIO))

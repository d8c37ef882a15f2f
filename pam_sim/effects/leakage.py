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
Air lost from muscle or fitting: an orifice to the atmosphere, ISO 6358, b = 0.5.

HSV: the flow is missing in the muscle. PPR: the regulator makes up for it and is
left with a small droop.
"""

from collections.abc import Mapping
from typing import Any, TYPE_CHECKING

import numpy as np

from pam_sim.compiled import compiled, interpreted
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter
from pam_sim.records import record
from pam_sim.units import (
    GAS_CONSTANT_AIR, P_ATM_PA, RHO_REFERENCE, T_REFERENCE_K, TEMPERATURE_K)
from pam_sim.valve.flow import mass_flow_kg_per_s

if TYPE_CHECKING:
    from pam_sim.rig import Rig

CRITICAL_RATIO = 0.5
_KG_PER_S_PA = RHO_REFERENCE * (T_REFERENCE_K / TEMPERATURE_K) ** 0.5


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return {'conductance_kg_per_s_pa': values['conductance_m3_per_s_pa'] * _KG_PER_S_PA,
            'atmosphere_pa': P_ATM_PA, 'rt_j_per_kg': GAS_CONSTANT_AIR * TEMPERATURE_K}


def flow_at_400kpa(values: Mapping[str, float], rig: 'Rig') -> float:
    """Return the mass flow of the orifice at 400 kPa gauge [kg/s]."""
    return float(interpreted(mass_flow_kg_per_s)(
        400e3 + P_ATM_PA, P_ATM_PA, values['conductance_m3_per_s_pa'] * _KG_PER_S_PA,
        CRITICAL_RATIO))


EFFECT = Effect(
    name='leakage',
    family='loss',
    subsystem='valve',
    sentence='Air escapes from the muscle or a fitting.',
    source='ISO 6358 orifice to the atmosphere.',
    equation='mdot_leak = C rho0 p psi(p_atm / p), b = 0.5; dp/dt -> dp/dt - R T mdot_leak '
             '/ (V + V_dead)',
    parameters=(
        Parameter('conductance_m3_per_s_pa', 'm3/(s Pa)', 2.0e-13, 0.0, 1e-9,
                  description='Sonic conductance of the leak.'),
    ),
    amplitude=('conductance_m3_per_s_pa',),
    reported=(
        Reported('conductance_m3_per_s_pa', 'm3/(s Pa)',
                 lambda values, rig: values['conductance_m3_per_s_pa']),
        Reported('mass_flow_at_400kpa_kg_per_s', 'kg/s', flow_at_400kpa),
    ),
    packed=record('conductance_kg_per_s_pa', 'atmosphere_pa', 'rt_j_per_kg'),
    pack=_pack,
    fitting=Fitting(free=(FreeParameter('conductance_m3_per_s_pa', 2e-13, 0.0, 1e-10),)),
)


@compiled
def mass_flow(flow_kg_per_s: float, pressure_pa: float, par: np.record) -> float:
    """Return the net flow less the leak."""
    return flow_kg_per_s - mass_flow_kg_per_s(
        pressure_pa, par.atmosphere_pa, par.conductance_kg_per_s_pa, CRITICAL_RATIO)


@compiled
def pressure_rate(rate_pa_per_s: float, pressure_pa: float, volume_m3: float,
                  par: np.record) -> float:
    """Return the pressure rate behind the PPR less the leak's share."""
    lost = mass_flow_kg_per_s(
        pressure_pa, par.atmosphere_pa, par.conductance_kg_per_s_pa, CRITICAL_RATIO)
    return rate_pa_per_s - par.rt_j_per_kg / volume_m3 * lost

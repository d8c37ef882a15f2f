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
Air lost through an orifice and a slit side by side, as through a hole and a worn seal.

The flow of a slit is laminar and grows with p^2 - p_atm^2, where that of a choked orifice
grows with p.
"""

from collections.abc import Mapping
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_sim.annotations import Number
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.effects.leakage import CRITICAL_RATIO, EFFECT as _SIBLING, flow_at_400kpa
from pam_sim.parameters import Parameter
from pam_sim.records import record
from pam_sim.units import P_ATM_PA
from pam_sim.valve.flow import mass_flow_kg_per_s

if TYPE_CHECKING:
    from pam_sim.rig import Rig

_SQUARED = (400e3 + P_ATM_PA) ** 2 - P_ATM_PA**2


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return {**_SIBLING.pack(values, numbers),
            'slit_kg_per_s_pa2': values['slit_flow_at_400kpa_kg_per_s'] / _SQUARED}


def slit_share(pressure_pa: Number) -> Number:
    """Return the flow of a slit at pressures [Pa absolute], as a share of that at 400 kPa."""
    return np.maximum(np.square(pressure_pa) - P_ATM_PA**2, 0.0) / _SQUARED


def _flow_at_400kpa(values: Mapping[str, float], rig: 'Rig') -> float:
    return flow_at_400kpa(values, rig) + values['slit_flow_at_400kpa_kg_per_s']


def _conductance(values: Mapping[str, float], rig: 'Rig') -> float:
    """Return the conductance of an orifice that loses as much at 400 kPa."""
    return _flow_at_400kpa(values, rig) / flow_at_400kpa({'conductance_m3_per_s_pa': 1.0}, rig)


EFFECT = Effect(
    name='leakage_slit',
    variant_of='leakage',
    family=_SIBLING.family,
    subsystem=_SIBLING.subsystem,
    sentence='Air escapes through a hole and through a slit.',
    source='ISO 6358 orifice; isothermal laminar flow of a gas through a narrow slit (Reynolds).',
    equation='mdot_leak = C rho0 p psi(p_atm / p) + mdot_400 (p^2 - p_atm^2) / (p_400^2 - '
             'p_atm^2), b = 0.5; else as leakage',
    parameters=(
        *_SIBLING.parameters,
        Parameter('slit_flow_at_400kpa_kg_per_s', 'kg/s', 0.0, 0.0, 1e-3,
                  description='Mass flow of the slit at 400 kPa gauge.'),
    ),
    amplitude=(*_SIBLING.amplitude, 'slit_flow_at_400kpa_kg_per_s'),
    reported=(
        Reported('conductance_m3_per_s_pa', 'm3/(s Pa)', _conductance),
        Reported('mass_flow_at_400kpa_kg_per_s', 'kg/s', _flow_at_400kpa),
    ),
    packed=record('slit_kg_per_s_pa2', *(_SIBLING.packed.names or ())),
    pack=_pack,
    fitting=Fitting(
        free=(
            FreeParameter('conductance_m3_per_s_pa', 2e-13, 0.0, 1e-10),
            FreeParameter('slit_flow_at_400kpa_kg_per_s', 1e-7, 0.0, 1e-4))),
)


@compiled
def lost_kg_per_s(pressure_pa: float, par: np.record) -> float:
    """Return the mass flow of orifice and slit [kg/s]."""
    atmosphere_pa = par.atmosphere_pa
    lost = mass_flow_kg_per_s(
        pressure_pa, atmosphere_pa, par.conductance_kg_per_s_pa, CRITICAL_RATIO)
    if pressure_pa > atmosphere_pa:
        lost += par.slit_kg_per_s_pa2 * (
            pressure_pa - atmosphere_pa) * (pressure_pa + atmosphere_pa)
    return lost


@compiled
def mass_flow(flow_kg_per_s: float, pressure_pa: float, par: np.record) -> float:
    """Return the net flow less the leak."""
    return flow_kg_per_s - lost_kg_per_s(pressure_pa, par)


@compiled
def pressure_rate(rate_pa_per_s: float, pressure_pa: float, volume_m3: float,
                  par: np.record) -> float:
    """Return the pressure rate behind the PPR less the leak's share."""
    return rate_pa_per_s - par.rt_j_per_kg / volume_m3 * lost_kg_per_s(pressure_pa, par)

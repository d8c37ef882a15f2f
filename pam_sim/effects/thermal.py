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
The air in the muscle is not isothermal; it exchanges heat with the wall.

    d(m cv T)/dt = m_in cp T_0 - m_out cp T - p dV/dt + hA (T_0 - T)

with p V = m R T, wall and supply at T_0 = 293.15 K, hA = m_ref cv / tau and
m_ref = 8e-5 kg, so that tau is the time constant at that mass. Linear in T,
hence solved by an exponential with the coefficients of the middle of the step.
The flow out of the vent grows with sqrt(T_0 / T) (ISO 6358); air let in has T_0.
A time constant of zero is the isothermal rig, a very long one the adiabatic one.
"""

from collections.abc import Mapping
import math
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter
from pam_sim.records import record
from pam_sim.units import GAS_CONSTANT_AIR, TEMPERATURE_K

GAMMA = 1.4
REFERENCE_MASS_KG = 8e-5
_SMALL_LOSS = 0.02


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    # hA / cv and R T_0.
    return {'conductance_kg_per_s': REFERENCE_MASS_KG / values['heat_exchange_time_s'],
            'ambient_rt_j_per_kg': GAS_CONSTANT_AIR * TEMPERATURE_K}


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    ambient = GAS_CONSTANT_AIR * TEMPERATURE_K
    return {'rt_j_per_kg': ambient, 'stage_rt_j_per_kg': ambient}


EFFECT = Effect(
    name='thermal',
    family='volume',
    subsystem='valve',
    sentence='The air warms when compressed and cools when vented, and takes time to exchange '
             'heat.',
    source='First law for an open volume, e.g. Richer and Hurmuzlu (2000), ASME J. Dynamic '
           'Systems, Measurement, and Control 122(3).',
    equation='d(m cv T)/dt = mdot_fill cp T_0 - mdot_vent cp T - p dV/dt + hA (T_0 - T), '
             'p (V + V_dead) = m R T, mdot_vent -> mdot_vent sqrt(T_0 / T), hA = m_ref cv / tau, '
             'T_0 = 293.15 K, m_ref = 8e-5 kg, cv = R / 0.4, cp = 1.4 cv; air that the vent lets '
             'in has T_0',
    parameters=(
        Parameter('heat_exchange_time_s', 's', 0.2, 0.0, 1e3,
                  description='Time constant of the heat exchange at 8e-5 kg; 0 is isothermal.'),
    ),
    amplitude=('heat_exchange_time_s',),
    reported=(Reported(
        'heat_exchange_time_s', 's', lambda values, rig: values['heat_exchange_time_s']),),
    # At the start and at a stage of the step.
    states=record('rt_j_per_kg', 'stage_rt_j_per_kg'),
    packed=record('conductance_kg_per_s', 'ambient_rt_j_per_kg'),
    pack=_pack,
    initial=_initial,
    valves=('hsv',),
    active=lambda values, numbers: values['heat_exchange_time_s'] >= 1e-9,
    order=70,               # scales the flows that the other effects leave
    fitting=Fitting(
        free=(
            FreeParameter('heat_exchange_time_s', 0.2, 0.01, 20.0, True, (0.05, 0.2, 1.0)),)),
)


@compiled
def air_rt(mass_kg: float, inflow_kg_per_s: float, outflow_kg_per_s: float, pressure_pa: float,
           volume_m3: float, elapsed_s: float, state: np.record, par: np.record) -> float:
    """Return R T of the air ``elapsed_s`` into the step."""
    if outflow_kg_per_s < 0.0:          # air of the room through an open vent
        inflow_kg_per_s -= outflow_kg_per_s
        outflow_kg_per_s = 0.0
    before = state.rt_j_per_kg
    start_m3 = mass_kg * before / pressure_pa
    # The balance of energy less that of mass, divided by m cv: dT/dt = a - b T.
    middle = mass_kg + 0.5 * elapsed_s * (inflow_kg_per_s - outflow_kg_per_s)
    share = elapsed_s / middle
    loss = share * (
        inflow_kg_per_s + (GAMMA - 1.0) * outflow_kg_per_s + par.conductance_kg_per_s) + (
        GAMMA - 1.0) * 2.0 * (volume_m3 - start_m3) / (volume_m3 + start_m3)
    source = share * (GAMMA * inflow_kg_per_s + par.conductance_kg_per_s) * par.ambient_rt_j_per_kg
    if abs(loss) < _SMALL_LOSS:
        # (1 - exp(-loss)) / loss as a series, to the last bits; in pairs, which need not wait.
        square = loss * loss
        mean = (1.0 - loss * (1.0 / 2.0)) + square * (
            (1.0 / 6.0 - loss * (1.0 / 24.0)) + square * (1.0 / 120.0 - loss * (1.0 / 720.0)))
    else:
        mean = (1.0 - math.exp(-loss)) / loss
    after = before + (source - loss * before) * mean
    state.stage_rt_j_per_kg = after
    return after


@compiled
def valve_flow(fill_kg_per_s: float, vent_kg_per_s: float, state: np.record,
               par: np.record) -> tuple[float, float]:
    """Return the vent flow of air at its temperature."""
    if vent_kg_per_s > 0.0:
        return fill_kg_per_s, vent_kg_per_s * math.sqrt(
            par.ambient_rt_j_per_kg / state.stage_rt_j_per_kg)
    return fill_kg_per_s, vent_kg_per_s


@compiled
def commit(state: np.record) -> None:
    """Keep the temperature of the end of the step."""
    state.rt_j_per_kg = state.stage_rt_j_per_kg

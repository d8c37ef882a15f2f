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
"""A change of the regulator's set point or of its speed, of a form that is tried."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers
from pam_sim.effects.unnamed import terms
from pam_sim.units import P_ATM_PA

INPUTS = (terms.SET_POINT, terms.DISTANCE, terms.PRESSURE, terms.CONTRACTION, terms.TIME)
AIM, QUICKNESS, SWING = range(3)
SLOWEST = 0.1                # of the regulator: however large the term


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return terms.packed_of(INPUTS, values, numbers.substep_s)


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    gauge = numbers.pressure_pa - P_ATM_PA
    return terms.memory_of(values, (gauge, 0.0, gauge, numbers.contraction_m, 0.0))


EFFECT = Effect(
    name='set_point_term', family='unnamed', subsystem='valve',
    sentence='A change of the set point found from data.', source='', equation='',
    parameters=terms.parameters_of(INPUTS), amplitude=terms.AMPLITUDES, valves=('ppr',),
    states=terms.STATES, packed=terms.PACKED, pack=_pack, initial=_initial, order=90)


@compiled
def set_point(set_point_pa: float, time_constant_s: float, pressure_pa: float,
              contraction_m: float, state: np.record, par: np.record,
              plant: np.record) -> tuple[float, float]:
    """Return set point and time constant with the terms."""
    gauge = set_point_pa - P_ATM_PA
    distance = set_point_pa - pressure_pa
    now = pressure_pa - P_ATM_PA
    terms.remember(gauge, distance, now, contraction_m, plant.time_s, par.step_s, state, par)
    change = terms.term_sum(
        AIM, gauge, distance, now, contraction_m, plant.time_s, 0.0, state, par)
    quicker = terms.term_sum(
        QUICKNESS, gauge, distance, now, contraction_m, plant.time_s, 0.0, state, par)
    for k in range(int(par.used)):
        slot = par.slots[k]
        if slot.channel == SWING and slot.first != 0.0:
            state.memory[k] = terms.swung(
                state.memory[k], distance, par.step_s, slot.shape_1, slot.first)
            return pressure_pa + time_constant_s * state.memory[k], time_constant_s
    return set_point_pa + change, time_constant_s / max(1.0 + quicker, SLOWEST)

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
"""A change of the flows of the switching valves, of a form that is tried."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers
from pam_sim.effects.unnamed import terms
from pam_sim.records import record
from pam_sim.units import P_ATM_PA

INPUTS = (terms.PRESSURE, terms.CONTRACTION, terms.OPENING_FILL, terms.OPENING_VENT, terms.TIME)
NET, FILL, VENT = range(3)
FLOW_SCALE = 1e-5            # kg/s: an amplitude of NET is in these


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return terms.packed_of(INPUTS, values)


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return terms.memory_of(values, (
        numbers.pressure_pa - P_ATM_PA, numbers.contraction_m, 0.0, 0.0, 0.0))


EFFECT = Effect(
    name='flow_term', family='unnamed', subsystem='valve',
    sentence='A change of the flows found from data.', source='', equation='',
    parameters=terms.parameters_of(INPUTS), amplitude=terms.AMPLITUDES, valves=('hsv',),
    states=record('filling', 'venting', *terms.OF_SLOTS), packed=terms.PACKED, pack=_pack,
    initial=_initial, order=90)


@compiled
def flow_opening(fill: float, vent: float, state: np.record) -> tuple[float, float]:
    """Keep the openings for the terms."""
    state.filling = fill
    state.venting = vent
    return fill, vent


@compiled
def valve_flow(fill_kg_per_s: float, vent_kg_per_s: float, pressure_pa: float, state: np.record,
               par: np.record, plant: np.record) -> tuple[float, float]:
    """Return both flows, each larger or smaller by the terms, none turned round."""
    gauge = pressure_pa - P_ATM_PA
    more = terms.term_sum(FILL, gauge, plant.contraction_m, state.filling, state.venting,
                          plant.time_s, 0.0, state, par)
    beside = terms.term_sum(VENT, gauge, plant.contraction_m, state.filling, state.venting,
                            plant.time_s, 0.0, state, par)
    return fill_kg_per_s * max(1.0 + more, 0.0), vent_kg_per_s * max(1.0 + beside, 0.0)


@compiled
def mass_flow(flow_kg_per_s: float, pressure_pa: float, contraction_m: float, state: np.record,
              par: np.record, plant: np.record) -> float:
    """Return the net flow with the terms."""
    return flow_kg_per_s + FLOW_SCALE * terms.term_sum(
        NET, pressure_pa - P_ATM_PA, contraction_m, state.filling, state.venting, plant.time_s,
        0.0, state, par)


@compiled
def commit(pressure_pa: float, contraction_m: float, elapsed_s: float, state: np.record,
           par: np.record, plant: np.record) -> None:
    """Advance what the terms remember."""
    terms.remember(pressure_pa - P_ATM_PA, contraction_m, state.filling, state.venting,
                   plant.time_s, elapsed_s, state, par)

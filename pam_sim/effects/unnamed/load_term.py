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
"""A force of the load side, or dry friction of its guide, of a form that is tried."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers
from pam_sim.effects.unnamed import terms

INPUTS = (terms.CONTRACTION, terms.SPEED, terms.TIME)
FORCE, DRY = range(2)


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return terms.packed_of(INPUTS, values)


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return terms.memory_of(values, (numbers.contraction_m, 0.0, 0.0, 0.0, 0.0))


EFFECT = Effect(
    name='load_term', family='unnamed', subsystem='load',
    sentence='A force of the load found from data.', source='', equation='',
    parameters=terms.parameters_of(INPUTS), amplitude=terms.AMPLITUDES,
    states=terms.STATES, packed=terms.PACKED, pack=_pack, initial=_initial, order=90)


@compiled
def load_force(force_n: float, contraction_m: float, velocity_m_per_s: float, elapsed_s: float,
               state: np.record, par: np.record, plant: np.record) -> float:
    """Return the force against contraction with the terms."""
    return force_n + terms.term_sum(
        FORCE, contraction_m, velocity_m_per_s, plant.time_s, 0.0, 0.0, elapsed_s, state, par)


@compiled
def load_friction(level_n: float, contraction_m: float, velocity_m_per_s: float,
                  state: np.record, par: np.record, plant: np.record) -> float:
    """Return the level of dry friction with the terms, not negative."""
    return max(level_n + terms.term_sum(
        DRY, contraction_m, velocity_m_per_s, plant.time_s, 0.0, 0.0, 0.0, state, par), 0.0)


@compiled
def commit(contraction_m: float, velocity_m_per_s: float, elapsed_s: float, state: np.record,
           par: np.record, plant: np.record) -> None:
    """Advance what the terms remember."""
    terms.remember(contraction_m, velocity_m_per_s, plant.time_s, 0.0, 0.0, elapsed_s, state,
                   par)

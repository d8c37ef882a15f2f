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
"""A change of the reading of the encoder, of a form that is tried."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers
from pam_sim.effects.fitting import Fitting
from pam_sim.effects.unnamed import terms
from pam_sim.units import P_ATM_PA

INPUTS = (terms.PRESSURE, terms.CONTRACTION, terms.READ_FORCE, terms.TIME)
READING = 0


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return terms.packed_of(INPUTS, values)


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return terms.memory_of(values, (
        numbers.pressure_pa - P_ATM_PA, numbers.contraction_m, numbers.force_n, 0.0, 0.0))


EFFECT = Effect(
    name='contraction_reading_term', family='unnamed', subsystem='sensor',
    sentence='A change of the reading found from data.', source='', equation='',
    parameters=terms.parameters_of(INPUTS), amplitude=terms.AMPLITUDES,
    states=terms.STATES, packed=terms.PACKED, pack=_pack, initial=_initial, order=90,
    fitting=Fitting(sensor_signal='contraction'))


@compiled
def sensor(pressure_pa: float, contraction_m: float, force_n: float, state: np.record,
           par: np.record, plant: np.record) -> tuple[float, float, float]:
    """Return the readings with the terms."""
    change = terms.term_sum(
        READING, pressure_pa - P_ATM_PA, contraction_m, force_n, plant.time_s, 0.0, 0.0, state,
        par)
    return pressure_pa, contraction_m + change, force_n


@compiled
def sensor_commit(pressure_pa: float, contraction_m: float, force_n: float, dt_s: float,
                  state: np.record, par: np.record, plant: np.record) -> None:
    """Advance what the terms remember."""
    terms.remember(pressure_pa - P_ATM_PA, contraction_m, force_n, plant.time_s, 0.0, dt_s, state,
                   par)

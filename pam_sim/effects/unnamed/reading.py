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

"""What a stand-in for a term of a reading is made of, whichever sensor it changes."""

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


def term_of_reading(signal: str) -> Effect:
    """Declare the stand-in for a term of the reading of a signal."""
    return Effect(
        name=f'{signal}_reading_term', family='unnamed', subsystem='sensor',
        sentence='A change of the reading found from data.', source='', equation='',
        parameters=terms.parameters_of(INPUTS), amplitude=terms.AMPLITUDES,
        states=terms.STATES, packed=terms.PACKED, pack=_pack, initial=_initial, order=90,
        fitting=Fitting(sensor_signal=signal))


@compiled
def change_of(pressure_pa: float, contraction_m: float, force_n: float, state: np.record,
              par: np.record, plant: np.record) -> float:
    """Return what the terms add to a reading."""
    return terms.term_sum(
        READING, pressure_pa - P_ATM_PA, contraction_m, force_n, plant.time_s, 0.0, 0.0, state,
        par)


@compiled
def remember(pressure_pa: float, contraction_m: float, force_n: float, dt_s: float,
             state: np.record, par: np.record, plant: np.record) -> None:
    """Advance what the terms remember."""
    terms.remember(pressure_pa - P_ATM_PA, contraction_m, force_n, plant.time_s, 0.0, dt_s, state,
                   par)

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
What a stand-in for a term of a reading is made of, whichever sensor it changes.

Nothing else of the rig feels it. So the readings with the terms follow from a simulation without
them, ``with_terms``.
"""

from collections.abc import Callable, Mapping
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled, entry_point, source_key
from pam_sim.effects.effect import Effect, Numbers
from pam_sim.effects.fitting import Fitting, OTHER_CHANGE
from pam_sim.effects.unnamed import terms
from pam_sim.records import columns, part, values_of
from pam_sim.rollout import layout
from pam_sim.rollout.layout import OUTPUT
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_sim.rig import Rig

INPUTS = (terms.PRESSURE, terms.CONTRACTION, terms.READ_FORCE, terms.TIME)
READING = 0
_SIGNAL = {f'{signal}_reading_term': signal for signal in ('contraction', 'force')}


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return terms.packed_of(INPUTS, values)


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return terms.memory_of(values, (
        numbers.pressure_pa - P_ATM_PA, numbers.contraction_m, numbers.force_n, 0.0, 0.0))


def of_reading(name: str) -> str:
    """Return the signal whose reading a stand-in changes, nothing for another effect."""
    return _SIGNAL.get(name, '')


def term_of_reading(signal: str) -> Effect:
    """Declare the stand-in for a term of the reading of a signal."""
    return Effect(
        name=f'{signal}_reading_term', family='unnamed', subsystem='sensor',
        sentence='A change of the reading found from data.', source='', equation='',
        parameters=terms.parameters_of(INPUTS), amplitude=terms.AMPLITUDES,
        states=terms.STATES, packed=terms.PACKED, pack=_pack, initial=_initial, order=90,
        fitting=Fitting(sensor_signal=signal, sensor_change=OTHER_CHANGE))


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


def with_terms(outputs: FloatArray, signal: str, values: Mapping[str, float],
               rig: 'Rig') -> FloatArray:
    """
    Return the readings of a signal with the terms, from a simulation without them.

    Parameters
    ----------
    outputs : numpy.ndarray
        Rows of ``rollout.layout.OUTPUT``; they stay as they are.
    signal : {'contraction', 'force'}
        Which reading.
    values : dict
        All parameters of the stand-in.
    rig : pam_sim.Rig
        The one that was simulated.

    """
    seen = columns(outputs, OUTPUT)
    read = np.array(seen[{'contraction': 'contraction_m', 'force': 'force_n'}[signal]])
    par = values_of(terms.PACKED, terms.packed_of(INPUTS, values))
    state = values_of(terms.STATES, terms.memory_of(values, (
        seen['true_pressure_pa'][0] - P_ATM_PA, seen['true_contraction_m'][0],
        rig.force_at_start_n(seen['true_contraction_m'][0]), 0.0, 0.0)))
    # What terms read is without the zeros of the sensors.
    _add_terms(outputs, rig.parameters['pressure_zero_pa'], rig.parameters['contraction_zero_m'],
               rig.parameters['force_zero_n'], state, par, read)
    return read


def _entry(key: int) -> Callable[..., None]:
    """Return the loop over all rows as a unit of compiled code, stored under ``key``."""
    @entry_point
    def add_terms(outputs: FloatArray, zero_pa: float, zero_m: float, zero_n: float,
                  state: FloatArray, par: FloatArray, read: FloatArray) -> None:
        """Add the terms to the readings, one a row."""
        if key < 0:         # never; makes the key part of what is stored
            return
        memories, numbers = part(state, 0, terms.STATES), part(par, 0, terms.PACKED)
        flat, width = outputs.reshape(outputs.size), outputs.shape[1]
        time_s = 0.0
        for row in range(read.size):
            seen = part(flat, row * width, OUTPUT)
            if row > 0:
                terms.remember(
                    seen.true_pressure_pa - P_ATM_PA, seen.true_contraction_m, seen.true_force_n,
                    seen.time_s, 0.0, seen.time_s - time_s, memories, numbers)
            time_s = seen.time_s
            read[row] += terms.term_sum(
                READING, seen.pressure_pa - zero_pa - P_ATM_PA, seen.contraction_m - zero_m,
                seen.force_n - zero_n, time_s, 0.0, 0.0, memories, numbers)
    return add_terms


_add_terms = _entry(source_key(terms, layout))

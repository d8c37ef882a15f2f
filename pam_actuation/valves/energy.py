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

"""Air and electrical energy a valve takes."""

from typing import TYPE_CHECKING

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled
from pam_sim.effects.leakage import CRITICAL_RATIO
from pam_sim.effects.leakage_slit import slit_share
from pam_sim.errors import InputError
from pam_sim.parameters import check_parameters, Parameter
from pam_sim.units import P_ATM_PA, RHO_REFERENCE
from pam_sim.valve.flow import mass_flow_kg_per_s

if TYPE_CHECKING:
    from pam_actuation.valves.chain import Record
    from pam_sim.rig import Rig

_DESIGN = 'design value'
POWER_PARAMETERS = (
    Parameter('ppr_power_w', 'W', 4.0, 0.0, 100.0, 0.0,
              'Regulator with its sensor and electronics, at rest as in motion.', _DESIGN),
    Parameter('hsv_peak_power_w', 'W', 10.0, 0.0, 100.0, 0.0,
              'Coil of one on/off valve while it is pulled in.', _DESIGN),
    Parameter('hsv_peak_time_s', 's', 0.002, 0.0, 0.1, 0.0,
              'Time of the peak at the start of a pulse.', _DESIGN),
    Parameter('hsv_hold_power_w', 'W', 2.5, 0.0, 100.0, 0.0,
              'Coil of one on/off valve for the rest of a pulse.', _DESIGN),
)


def power_values(given: dict[str, float] | tuple[()] = ()) -> dict[str, float]:
    """Return all power numbers, checked, design values where none is given."""
    return check_parameters(POWER_PARAMETERS, dict(given), 'power')


def pulse_energy_j(lengths_s: list[float] | tuple[float, ...], power: dict[str, float]) -> float:
    """Return the electrical energy [J] of pulses: peak first, then hold."""
    lengths = np.asarray(lengths_s, dtype=float)
    peak = np.minimum(lengths, power['hsv_peak_time_s'])
    return float(np.sum(peak) * power['hsv_peak_power_w']
                 + np.sum(lengths - peak) * power['hsv_hold_power_w'])


def normal_litres(mass_kg: float) -> float:
    """Return litres of air at the reference atmosphere of ISO 8778."""
    return mass_kg / RHO_REFERENCE * 1e3


def supplied_kg(record: 'Record', rig: 'Rig') -> FloatArray:
    """
    Return the air [kg] taken from the supply since the start of a record, per sample.

    HSV: what flowed through the fill valve. PPR: every rise of the air mass and, if the rig leaks,
    the leak against which the pressure is held. The bleed of the regulator itself is not modelled.
    """
    if rig.valve == 'hsv':
        return record.filled_kg - record.filled_kg[0]
    change = np.diff(record.air_mass_kg)
    for leak in (rig.effect('leakage'), rig.effect('leakage_slit')):
        if leak is not None:
            lost = _lost_kg_per_s(record.true_pressure_pa, **leak.parameters)
            change = change + 0.5 * (lost[1:] + lost[:-1]) * np.diff(record.time_s)
    return np.concatenate([[0.0], np.cumsum(np.maximum(change, 0.0))])


def _lost_kg_per_s(pressure_pa: FloatArray, conductance_m3_per_s_pa: float,
                   slit_flow_at_400kpa_kg_per_s: float = 0.0) -> FloatArray:
    lost = np.empty(len(pressure_pa))
    _leak_flow(pressure_pa, conductance_m3_per_s_pa * RHO_REFERENCE, lost)
    return lost + slit_flow_at_400kpa_kg_per_s * slit_share(pressure_pa)


@compiled
def _leak_flow(pressure_pa: FloatArray, conductance_kg_per_s_pa: float,
               flow_kg_per_s: FloatArray) -> None:
    for k in range(len(pressure_pa)):
        flow_kg_per_s[k] = mass_flow_kg_per_s(
            pressure_pa[k], P_ATM_PA, conductance_kg_per_s_pa, CRITICAL_RATIO)


def power_arguments(texts: list[str]) -> dict[str, float] | None:
    """
    Return the numbers of ``NAME=VALUE`` texts.

    Raises
    ------
    InputError
        No ``=``, unknown name, not a number, or out of bounds.

    """
    given = {}
    for item in texts:
        name, equals, value = item.partition('=')
        try:
            given[name.strip()] = float(value)
        except ValueError:
            raise InputError(f'`{item}` is not NAME=NUMBER', '--power') from None
    return power_values(given)

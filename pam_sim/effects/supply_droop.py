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
A reservoir feeds the fill valve; a compressor refills it within a band.

    V_r dp_s/dt = R T (m_compressor - m_fill)

The compressor starts when p_s has fallen to the nominal supply less the band
and stops at the nominal supply. Isothermal; at the start the reservoir is full.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.errors import InputError
from pam_sim.parameters import Parameter
from pam_sim.records import record
from pam_sim.units import GAS_CONSTANT_AIR, TEMPERATURE_K

_SMALLEST_M3 = 1e-6         # below, one step would empty it


def pa_per_kg(values: Mapping[str, float], name: str) -> float:
    """
    Return by how much a reservoir changes per mass of air [Pa/kg].

    Raises
    ------
    InputError
        It has a volume so small that one step would empty it. The text names the effect.

    """
    volume = values['reservoir_volume_m3']
    if volume < _SMALLEST_M3:
        raise InputError(f'`reservoir_volume_m3` is {volume:g}; allowed 0 (no reservoir) or at '
                         f'least {_SMALLEST_M3:g} m3', name)
    return GAS_CONSTANT_AIR * TEMPERATURE_K / volume


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    full = numbers.parameters['supply_pa']
    return {'pa_per_kg': pa_per_kg(values, 'supply_droop'),
            'compressor_flow_kg_per_s': values['compressor_flow_kg_per_s'],
            'low_pa': full - values['band_pa'], 'high_pa': full}


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return {'pressure_pa': numbers.parameters['supply_pa']}


EFFECT = Effect(
    name='supply_droop',
    family='loss',
    subsystem='valve',
    sentence='The supply pressure falls with use until the reservoir is refilled.',
    source='Mass balance of the reservoir; two-point control of the compressor (design values).',
    equation='V_r dp_s/dt = R T (mdot_compressor - mdot_fill), compressor on below p_s0 - '
             'band, off at p_s0',
    parameters=(
        Parameter('reservoir_volume_m3', 'm3', 1e-3, 0.0, 10.0,
                  description='Volume of the reservoir; 0 for a supply that does not fall.'),
        Parameter('band_pa', 'Pa', 100e3, 1e3, 500e3,
                  description='Fall of the supply pressure at which the compressor starts.'),
        Parameter('compressor_flow_kg_per_s', 'kg/s', 2e-4, 0.0, 0.1,
                  description='Air the running compressor delivers.'),
    ),
    amplitude=('reservoir_volume_m3',),
    reported=(Reported(
        'reservoir_volume_m3', 'm3', lambda values, rig: values['reservoir_volume_m3']),),
    states=record('pressure_pa', 'change_pa', 'filled_kg', 'compressor_runs'),
    packed=record('pa_per_kg', 'compressor_flow_kg_per_s', 'low_pa', 'high_pa'),
    pack=_pack,
    initial=_initial,
    valves=('hsv',),
    fitting=Fitting(
        reservoir=('reservoir_volume_m3', 'band_pa', 'compressor_flow_kg_per_s'),
        free=(
            # A compressor that starts once more or less makes other valleys of the misfit.
            FreeParameter('reservoir_volume_m3', 1e-3, 2e-5, 0.1, True,
                          (2e-4, 4e-4, 7e-4, 1.2e-3, 2.5e-3, 5e-3)),)),
)


@compiled
def supply(state: np.record) -> float:
    """Return the pressure of the reservoir at the middle of the step, by the last change."""
    return state.pressure_pa + 0.5 * state.change_pa


@compiled
def commit(elapsed_s: float, state: np.record, par: np.record, plant: np.record) -> None:
    """Take what the fill valve let through out of the reservoir."""
    used = plant.filled_kg - state.filled_kg
    given = par.compressor_flow_kg_per_s * elapsed_s if state.compressor_runs != 0.0 else 0.0
    change = par.pa_per_kg * (given - used)
    now = state.pressure_pa + change
    state.pressure_pa = now
    state.change_pa = change
    state.filled_kg = plant.filled_kg
    if now <= par.low_pa:
        state.compressor_runs = 1.0
    elif now >= par.high_pa:
        state.compressor_runs = 0.0
    plant.supply_pa = now

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
A line refills the reservoir of the fill valve, as from a regulator or the mains of a building.

    V_r dp_s/dt = V_r (p_s0 - p_s) / tau - R T m_fill

The line gives the more air the further the pressure has fallen. Isothermal; at the start the
reservoir is full.
"""

from collections.abc import Mapping
import math
from typing import Any

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.effects.supply_droop import EFFECT as _SIBLING, pa_per_kg
from pam_sim.parameters import Parameter
from pam_sim.records import record


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return {'pa_per_kg': pa_per_kg(values, 'supply_droop_line'),
            'refill_time_s': values['refill_time_s'], 'full_pa': numbers.parameters['supply_pa']}


EFFECT = Effect(
    name='supply_droop_line',
    variant_of='supply_droop',
    family=_SIBLING.family,
    subsystem=_SIBLING.subsystem,
    sentence='The supply pressure falls with use, and a line refills the reservoir.',
    source='Mass balance of the reservoir; a line that gives air in proportion to the fall of '
           'pressure across it (design choice of form).',
    equation='V_r dp_s/dt = V_r (p_s0 - p_s) / tau - R T mdot_fill',
    parameters=(
        _SIBLING.parameters[0],
        Parameter('refill_time_s', 's', 2.0, 0.01, 1e4,
                  description='Time constant with which the line refills the reservoir.'),
    ),
    amplitude=_SIBLING.amplitude,
    reported=_SIBLING.reported,
    states=record('pressure_pa', 'change_pa', 'filled_kg'),
    packed=record('pa_per_kg', 'refill_time_s', 'full_pa'),
    pack=_pack,
    initial=_SIBLING.initial,
    valves=_SIBLING.valves,
    fitting=Fitting(
        free=(FreeParameter('reservoir_volume_m3', 1e-3, 2e-5, 0.1, True, (2e-4, 1e-3, 5e-3)),
              FreeParameter('refill_time_s', 2.0, 0.05, 60.0, True, (0.3, 4.0)))),
)


@compiled
def supply(state: np.record) -> float:
    """Return the pressure of the reservoir at the middle of the step, by the last change."""
    return state.pressure_pa + 0.5 * state.change_pa


@compiled
def commit(elapsed_s: float, state: np.record, par: np.record, plant: np.record) -> None:
    """Take what the fill valve let through out of the reservoir, and refill that."""
    used = plant.filled_kg - state.filled_kg
    # The solution where air is taken evenly over the step.
    ratio = elapsed_s / par.refill_time_s
    refilled = -math.expm1(-ratio)
    change = refilled * (par.full_pa - state.pressure_pa)
    if ratio > 0.0:
        change -= par.pa_per_kg * used * refilled / ratio
    now = state.pressure_pa + change
    state.pressure_pa = now
    state.change_pa = change
    state.filled_kg = plant.filled_kg
    plant.supply_pa = now

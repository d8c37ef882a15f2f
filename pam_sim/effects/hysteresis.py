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
Rate-independent memory of the braid: Maxwell slip, four elements in parallel.

    F -> F - (F0 + k_p p_g) sum_j w_j z_j,   dz_j = dx / W_j clipped to [-1, 1]

Generalised Maxwell slip, Al-Bender, Lampaert, Swevers (2005), IEEE Trans.
Automatic Control 50(11); for muscles Vo-Minh et al. (2011), Mechatronics 21.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.effects.loop_level import (
    LEVEL, LEVEL_AMPLITUDE, LEVEL_FREE, level_parameters, loop_level_n, LOOP_REPORTED,
    pack_level)
from pam_sim.parameters import Parameter
from pam_sim.records import record

# Break-away travel and weight of each element, design values.
WIDTHS_M = (0.1e-3, 0.4e-3, 1.2e-3, 3.0e-3)
WEIGHTS = (0.25, 0.30, 0.25, 0.20)
_ELEMENTS = len(WIDTHS_M)


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    scale = values['width_scale']
    return {**pack_level(values, numbers),
            'inverse_width_per_m': [1.0 / (width * scale) for width in WIDTHS_M],
            'weight': WEIGHTS}


EFFECT = Effect(
    name='hysteresis',
    family='friction',
    subsystem='muscle',
    sentence='The force depends on the path: presliding friction of the braid with memory.',
    source='Maxwell slip, Al-Bender et al. 2005; Vo-Minh et al. 2011.',
    equation='F -> F - (F_0 + k_p p_g) sum_j w_j z_j, dz_j = dx / W_j clipped to -1 <= z_j <= 1, '
             'W_j = 0.1, 0.4, 1.2, 3.0 mm times width_scale, w_j = 0.25, 0.30, 0.25, 0.20',
    parameters=(
        *level_parameters(),
        Parameter('width_scale', '-', 1.0, 0.1, 10.0,
                  description='Scale of the break-away travels 0.1, 0.4, 1.2, 3.0 mm.'),
    ),
    amplitude=LEVEL_AMPLITUDE,
    reported=LOOP_REPORTED,
    states=record(('slip', _ELEMENTS)),
    packed=record(*LEVEL, ('inverse_width_per_m', _ELEMENTS), ('weight', _ELEMENTS)),
    pack=_pack,
    fitting=Fitting(
        free=(*LEVEL_FREE, FreeParameter('width_scale', 1.0, 0.35, 5.0, True, (0.5, 1.5))),
        limits=('coulomb_friction', 'pressure_friction'), remembers=True),
)


@compiled
def muscle_force(force_n: float, pressure_pa: float, dx_m: float, state: np.record,
                 par: np.record) -> float:
    """Return the force less the slip elements' share at travel ``dx_m`` from the step start."""
    level = loop_level_n(pressure_pa, par)
    if level <= 0.0:
        return force_n
    total = 0.0
    for j in range(_ELEMENTS):
        z = state.slip[j] + dx_m * par.inverse_width_per_m[j]
        total += par.weight[j] * min(max(z, -1.0), 1.0)
    return force_n - level * total


@compiled
def commit(dx_m: float, state: np.record, par: np.record) -> None:
    """Advance the slip states."""
    for j in range(_ELEMENTS):
        z = state.slip[j] + dx_m * par.inverse_width_per_m[j]
        state.slip[j] = min(max(z, -1.0), 1.0)

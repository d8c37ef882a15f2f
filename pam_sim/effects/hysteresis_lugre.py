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
Friction by bristles that bend before they slip: LuGre.

    F -> F - sigma0 z - sigma1 dz/dt,   dz/dt = v - sigma0 |v| z / g
    g = (F0 + k_p p_g) (1 + (s - 1) exp(-(v / v_s)^2))

Canudas de Wit, Olsson, Astrom, Lischinsky (1995), IEEE Trans. Automatic Control
40(3); its viscous term is the muscle's damping already. Over the travel dx of a
step with g held the bristle equation is linear and solved exactly,

    z -> z_g + (z - z_g) exp(-|dx| / |z_g|),   z_g = g / sigma0 sgn(dx),

so that it stays stable however stiff the bristles. With s = 1 and sigma1 = 0 it
does not depend on the rate. It forgets: a small cycle inside a large one drifts
instead of closing.
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
from pam_sim.effects.presliding import at_rest, bent
from pam_sim.parameters import Parameter
from pam_sim.records import record


_NARROW_M, _AT_PA = 1e-4, 4e5      # a loop that is narrower at this pressure is dry friction


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return {**pack_level(values, numbers), 'stiffness_n_per_m': values['stiffness_n_per_m'],
            'inverse_stiffness_m_per_n': 1.0 / values['stiffness_n_per_m'],
            'bristle_damping_n_s_per_m': values['bristle_damping_n_s_per_m'],
            'static_excess': values['static_ratio'] - 1.0,
            'inverse_stribeck_s_per_m': 1.0 / values['stribeck_m_per_s']}


def _is_dry(values: Mapping[str, float]) -> bool:
    """
    Return whether bristles slip after so short a way that they are dry friction.

    Their stiffness alone does not tell: a small force bends stiff ones as little as a large
    one bends stiffer ones.
    """
    force_n = values['force_n'] + _AT_PA * values['force_per_pa']
    return force_n < _NARROW_M * values['stiffness_n_per_m']


EFFECT = Effect(
    name='hysteresis_lugre',
    family='friction',
    subsystem='muscle',
    variant_of='hysteresis',
    sentence='The braid sticks elastically before it slips, and slips more easily once it moves.',
    source='LuGre, Canudas de Wit, Olsson, Astrom, Lischinsky (1995), IEEE Trans. Automatic '
           'Control 40(3). Sizes: design values.',
    equation='F -= sigma0 z + sigma1 dz/dt, dz/dt = v - sigma0 |v| z / g, '
             'g = (F0 + k_p p_g) (1 + (s - 1) exp(-(v / v_s)^2))',
    parameters=(
        *level_parameters('sliding friction'),
        Parameter('stiffness_n_per_m', 'N/m', 2.2e3, 10.0, 1e7,
                  description='Stiffness sigma0 of the bristles.'),
        Parameter('bristle_damping_n_s_per_m', 'N s/m', 5.0, 0.0, 200.0,
                  description='Damping sigma1 of the bristles.'),
        Parameter('static_ratio', '-', 1.1, 1.0, 3.0,
                  description='Friction at break-away over sliding friction, s.'),
        Parameter('stribeck_m_per_s', 'm/s', 2e-3, 1e-4, 1.0,
                  description='Speed v_s at which the friction falls to the sliding one.'),
    ),
    amplitude=LEVEL_AMPLITUDE,
    reported=LOOP_REPORTED,
    states=record('bending_m'),
    packed=record(*LEVEL, 'stiffness_n_per_m', 'inverse_stiffness_m_per_n',
                  'bristle_damping_n_s_per_m', 'static_excess', 'inverse_stribeck_s_per_m'),
    pack=_pack,
    fitting=Fitting(
        free=(*LEVEL_FREE, FreeParameter('stiffness_n_per_m', 2e3, 200.0, 1e4, True)),
        is_limit=_is_dry),
)


@compiled
def bending_when_sliding(pressure_pa: float, velocity_m_per_s: float, par: np.record) -> float:
    """Return the bristles' bending [m] in steady sliding, g / sigma0; 0 without friction."""
    level = loop_level_n(pressure_pa, par)
    if level <= 0.0:
        return 0.0
    level *= 1.0 + par.static_excess * at_rest(velocity_m_per_s, par)
    return level * par.inverse_stiffness_m_per_n


@compiled
def muscle_force(force_n: float, pressure_pa: float, velocity_m_per_s: float, dx_m: float,
                 state: np.record, par: np.record) -> float:
    """Return the force less that of the bristles at travel ``dx_m`` from the step start."""
    sliding_m = bending_when_sliding(pressure_pa, velocity_m_per_s, par)
    if sliding_m <= 0.0:
        return force_n
    inverse_sliding_per_m = 1.0 / sliding_m
    z = bent(state.bending_m, dx_m, sliding_m, inverse_sliding_per_m)
    rate = velocity_m_per_s - abs(velocity_m_per_s) * z * inverse_sliding_per_m
    return force_n - par.stiffness_n_per_m * z - par.bristle_damping_n_s_per_m * rate


@compiled
def commit(pressure_pa: float, velocity_m_per_s: float, dx_m: float, state: np.record,
           par: np.record) -> None:
    """Advance the bending of the bristles."""
    sliding_m = bending_when_sliding(pressure_pa, velocity_m_per_s, par)
    state.bending_m = (bent(state.bending_m, dx_m, sliding_m, 1.0 / sliding_m)
                       if sliding_m > 0.0 else 0.0)

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
Damping that grows less than the velocity: F -> F - c v / (1 + |v| / v0).

Shear thinning as of Cross (1965), J. Colloid Science 20(5), with an exponent of 1, as a damper:
linear below the speed v0, ever less above it.
"""

from collections.abc import Mapping
from typing import Any, TYPE_CHECKING

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.effects.viscous_damping import EFFECT as _SIBLING
from pam_sim.parameters import Parameter
from pam_sim.records import record

if TYPE_CHECKING:
    from pam_sim.rig import Rig

_AT_M_PER_S = 0.05


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return {'damping_n_s_per_m': values['damping_n_s_per_m'],
            'inverse_speed_s_per_m': 1.0 / values['speed_m_per_s']}


def _reported(values: Mapping[str, float], rig: 'Rig') -> float:
    return values['damping_n_s_per_m'] * _AT_M_PER_S / (
        1.0 + _AT_M_PER_S / values['speed_m_per_s'])


EFFECT = Effect(
    name='viscous_damping_thinning',
    family=_SIBLING.family,
    subsystem=_SIBLING.subsystem,
    variant_of='viscous_damping',
    sentence='The muscle resists fast motion by less than in proportion to its speed.',
    source='Shear thinning, Cross (1965), J. Colloid Science 20(5); as a damper of a muscle and '
           'in size a design choice.',
    equation='F -> F - c v / (1 + |v| / v0)',
    parameters=(
        *_SIBLING.parameters,
        Parameter('speed_m_per_s', 'm/s', 0.2, 1e-3, 100.0,
                  description='Speed v0 at which the force is half of what is in proportion.'),
    ),
    amplitude=_SIBLING.amplitude,
    reported=(Reported('force_at_50mm_per_s_n', 'N', _reported),),
    packed=record('damping_n_s_per_m', 'inverse_speed_s_per_m'),
    pack=_pack,
    fitting=Fitting(
        free=(
            FreeParameter('damping_n_s_per_m', 20.0, -200.0, 1000.0),
            FreeParameter('speed_m_per_s', 0.2, 0.02, 5.0, True, ends=()))),
)


@compiled
def muscle_force(force_n: float, velocity_m_per_s: float, par: np.record) -> float:
    """Return the force less that of the damper."""
    return force_n - par.damping_n_s_per_m * velocity_m_per_s / (
        1.0 + abs(velocity_m_per_s) * par.inverse_speed_s_per_m)

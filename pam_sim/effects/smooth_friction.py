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
Friction that never sticks: F -> F - (F_c + F_400 p_g / 400 kPa) tanh(v / v_s).

Coulomb friction as simulators smooth it, and as a film between the surfaces makes it: above v_s
it is dry friction, but at rest nothing holds and the muscle creeps until the forces balance. With
2 N at 1 mm/s a step of 1 ms is off by 0.15 % of the range of the force in one sample, by less at
2 mm/s.
"""

import math

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.parameters import Parameter
from pam_sim.units import P_ATM_PA

_FORCE, _PER_PA, _INVERSE_SPEED = range(3)
_AT_PA = 4e5


def _pack(values, numbers):
    return (values['force_n'], values['force_at_400kpa_n'] / _AT_PA,
            1.0 / values['speed_m_per_s'])


EFFECT = Effect(
    name='smooth_friction',
    family='friction',
    subsystem='muscle',
    relative_of=('coulomb_friction', 'pressure_friction'),
    sentence='Friction inside the muscle is that of a dry contact, but it does not stick.',
    source='Regularised Coulomb friction, as many simulators have it. Sizes: design values.',
    equation='F -> F - (F_c + F400 p_g / 400 kPa) tanh(v / v_s)',
    parameters=(
        Parameter('force_n', 'N', 2.0, 0.0, 50.0, description='Constant part of the level.'),
        Parameter('force_at_400kpa_n', 'N', 0.0, 0.0, 100.0,
                  description='Part of the level that grows with gauge pressure.'),
        Parameter('speed_m_per_s', 'm/s', 2e-3, 2e-4, 0.1,
                  description='Speed v_s above which the friction is that of a dry contact.'),
    ),
    amplitude=('force_n', 'force_at_400kpa_n'),
    reported=(Reported('force_n', 'N', lambda values, rig: values['force_n']),),
    pack=_pack,
)


@compiled
def muscle_force(force_n, pressure_pa, contraction_m, velocity_m_per_s, dx_m, elapsed_s,
                 state, i, par, k):
    """Return the force less that of the contact."""
    level_n = par[k + _FORCE] + par[k + _PER_PA] * max(pressure_pa - P_ATM_PA, 0.0)
    return force_n - level_n * math.tanh(velocity_m_per_s * par[k + _INVERSE_SPEED])

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
Parallel elastic force of a tube that stiffens: F -> F - k x (1 + x / x_h).

The first term of any hardening law. Rubber between threads stiffens as they crowd.
"""

from pam_sim.compiled import compiled
from pam_sim.effects.bladder_stiffness import EFFECT as _SIBLING
from pam_sim.effects.effect import Effect, Reported
from pam_sim.parameters import Parameter

_STIFFNESS, _PER_M = range(2)
_AT_M = 14e-3               # where the secant is that of a linear spring fitted over the stroke


def _pack(values, numbers):
    return values['stiffness_n_per_m'], 1.0 / values['hardening_m']


EFFECT = Effect(
    name='bladder_stiffness_progressive',
    family=_SIBLING.family,
    subsystem=_SIBLING.subsystem,
    variant_of='bladder_stiffness',
    sentence='The rubber tube resists contraction like a spring that stiffens.',
    source='Spring with a linear rise of its secant; form and size: design choice.',
    equation='F -> F - k x (1 + x / x_h); stated as the secant at 14 mm',
    parameters=(
        *_SIBLING.parameters,
        Parameter('hardening_m', 'm', 0.1, 2e-3, 100.0,
                  description='Contraction x_h at which the secant has doubled.'),
    ),
    amplitude=_SIBLING.amplitude,
    reported=(Reported(
        'stiffness_n_per_m', 'N/m', lambda values, rig: values['stiffness_n_per_m'] * (
            1.0 + _AT_M / values['hardening_m'])),),
    pack=_pack,
)


@compiled
def map_output(tension_n, pressure_pa, contraction_m, state, i, par, k):
    """Return the tension less that of the tube."""
    return tension_n - par[k + _STIFFNESS] * contraction_m * (
        1.0 + contraction_m * par[k + _PER_M])

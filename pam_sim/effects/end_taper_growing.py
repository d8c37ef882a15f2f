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

"""Ends that taper the more the muscle contracts: F(p, k eps), k = 1 + a + b eps."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.effects.end_taper import EFFECT as _SIBLING, force_change_n
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter

if TYPE_CHECKING:
    from pam_sim.rig import Rig

_AT_M = 10e-3                # contraction for which the factor is stated


def _there(values: Mapping[str, float], rig: 'Rig') -> float:
    """Return the strain factor less one at 10 mm."""
    return values['k_minus_1'] + values['k_per_strain'] * _AT_M / rig.muscle.length_m


EFFECT = Effect(
    name='end_taper_growing',
    variant_of='end_taper',
    family=_SIBLING.family,
    subsystem=_SIBLING.subsystem,
    sentence='The ends taper the more the muscle contracts: force falls ever faster with strain.',
    source='Tondu and Lopez (2000), IEEE Control Systems Magazine 20(2), parameter k; first order '
           'in strain: design choice.',
    equation='F(p, eps) -> F(p, k eps), k = 1 + k_minus_1 + k_per_strain eps; stated at 10 mm',
    parameters=(
        *_SIBLING.parameters,
        Parameter('k_per_strain', '-', 0.0, -5.0, 5.0,
                  description='By what the strain factor grows per strain.'),
    ),
    amplitude=(*_SIBLING.amplitude, 'k_per_strain'),
    reported=(
        Reported('k_minus_1', '-', _there),
        Reported('force_change_at_500kpa_10mm_n', 'N',
                 lambda values, rig: force_change_n({'k_minus_1': _there(values, rig)}, rig)),
    ),
    fitting=Fitting(
        free=(
            FreeParameter('k_minus_1', 0.05, -0.3, 1.0),
            FreeParameter('k_per_strain', 0.2, -3.0, 3.0)),
        refinement=True),
)


@compiled
def map_input(gauge_pa: float, strain: float, par: np.record) -> tuple[float, float]:
    """Return the strain scaled."""
    return gauge_pa, strain * (1.0 + par.k_minus_1 + par.k_per_strain * strain)

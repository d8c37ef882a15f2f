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

"""Ends that are not cylindrical make the braid work at a larger strain: F(p, k eps)."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.parameters import Parameter

if TYPE_CHECKING:
    from pam_sim.rig import Rig


def force_change_n(values: Mapping[str, float], rig: 'Rig') -> float:
    """Return the change of tension at 500 kPa gauge and 10 mm, N."""
    strain = 10e-3 / rig.muscle.length_m
    force_n = rig.muscle.law.law.force_n
    return float(rig.parameters['force_map_gain'] * (
        force_n(500e3, (1.0 + values['k_minus_1']) * strain, 'allow')
        - force_n(500e3, strain, 'allow')))


EFFECT = Effect(
    name='end_taper',
    family='static_map',
    subsystem='muscle',
    sentence='The tapered ends shorten the part that contracts: force falls faster with strain.',
    source='Tondu and Lopez (2000), IEEE Control Systems Magazine 20(2), parameter k.',
    equation='F(p, eps) -> F(p, k eps), k = 1 + k_minus_1',
    parameters=(
        Parameter('k_minus_1', '-', 0.05, -0.3, 1.0, description='Strain factor less one.'),
    ),
    amplitude=('k_minus_1',),
    reported=(
        Reported('k_minus_1', '-', lambda values, rig: values['k_minus_1']),
        Reported('force_change_at_500kpa_10mm_n', 'N', force_change_n),
    ),
)


@compiled
def map_input(gauge_pa: float, strain: float, par: np.record) -> tuple[float, float]:
    """Return the strain scaled."""
    return gauge_pa, strain * (1.0 + par.k_minus_1)

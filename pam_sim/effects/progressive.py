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
A spring that stiffens, F = k x (1 + x / x_h), as the effects of this kind share it.

The first term of any hardening law; ``stiffness_n_per_m`` is the first parameter of an effect.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Numbers, Reported
from pam_sim.effects.fitting import FreeParameter
from pam_sim.parameters import Parameter
from pam_sim.records import record

SOURCE = 'Spring with a linear rise of its secant; form and size: design choice.'
HARDENING = Parameter('hardening_m', 'm', 0.1, 2e-3, 100.0,
                      description='Contraction x_h at which the secant has doubled.')
HARDENING_FREE = FreeParameter('hardening_m', 0.1, 0.01, 1.0, True, ends=())
_AT_M = 14e-3               # where the secant is that of a linear spring fitted over the stroke
SECANT_REPORTED = (Reported(
    'stiffness_n_per_m', 'N/m', lambda values, rig: values['stiffness_n_per_m'] * (
        1.0 + _AT_M / values['hardening_m'])),)
PROGRESSIVE = record('stiffness_n_per_m', 'inverse_hardening_per_m')


def pack_progressive(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    """Return the packed values: stiffness, inverse hardening."""
    return {'stiffness_n_per_m': values['stiffness_n_per_m'],
            'inverse_hardening_per_m': 1.0 / values['hardening_m']}


@compiled
def spring_n(contraction_m: float, par: np.record) -> float:
    """Return the force of the spring [N] at a contraction."""
    return par.stiffness_n_per_m * contraction_m * (
        1.0 + contraction_m * par.inverse_hardening_per_m)

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
The level of friction that the effects with a loop share: F_h = F0 + k_p p_g.

An effect lists ``level_parameters`` among its parameters and packs the fields ``LEVEL`` with
``pack_level``.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Numbers, Reported
from pam_sim.effects.fitting import FreeParameter
from pam_sim.parameters import Parameter

LEVEL_AMPLITUDE = ('force_n', 'force_per_pa')
LEVEL = 'force_n', 'force_per_pa', 'atmosphere_pa'
LOOP_REPORTED = (Reported(
    'loop_half_width_at_400kpa_n', 'N',
    lambda values, rig: values['force_n'] + 400e3 * values['force_per_pa']),)

LEVEL_FREE = (FreeParameter('force_n', 1.0, 0.0, 50.0, starts=(1.0,)),
              FreeParameter('force_per_pa', 4e-6, 0.0, 2e-4, starts=(2e-6,)))


def level_parameters(what: str = 'half width of the loop') -> tuple[Parameter, Parameter]:
    """Return the two Parameters of the level, for people called ``what``."""
    return (
        Parameter('force_n', 'N', 0.5, 0.0, 50.0,
                  description=f'{what.capitalize()} at zero gauge pressure.'),
        Parameter('force_per_pa', 'N/Pa', 4.5e-6, 0.0, 2e-4,
                  description=f'Growth of the {what} with gauge pressure.'),
    )


def pack_level(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    """Return the packed values of the level."""
    return {'force_n': values['force_n'], 'force_per_pa': values['force_per_pa'],
            'atmosphere_pa': numbers.parameters['p_atm']}


@compiled
def loop_level_n(pressure_pa: float, par: np.record) -> float:
    """Return the level [N] at an absolute pressure [Pa]; it may be negative far below one bar."""
    return par.force_n + par.force_per_pa * (pressure_pa - par.atmosphere_pa)

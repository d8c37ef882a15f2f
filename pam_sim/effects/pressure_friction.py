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

"""Dry friction of thread on thread, growing with gauge pressure: |F_f| <= F400 p_g / 400 kPa."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter
from pam_sim.records import record
from pam_sim.units import P_ATM_PA

_REFERENCE_PA = 400e3


def _pack(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    return {'force_per_pa': values['force_at_400kpa_n'] / _REFERENCE_PA, 'atmosphere_pa': P_ATM_PA}


EFFECT = Effect(
    name='pressure_friction',
    family='friction',
    subsystem='muscle',
    sentence='Dry friction inside the muscle grows with pressure.',
    source='Tondu and Lopez (2000), IEEE Control Systems Magazine 20(2): contact pressure times '
           'a constant friction coefficient.',
    equation='F -> F - F_f, |F_f| <= F400 p_g / 400 kPa at rest, equal to it against v sliding',
    parameters=(
        Parameter('force_at_400kpa_n', 'N', 2.0, 0.0, 100.0,
                  description='Friction level at 400 kPa gauge.'),
    ),
    amplitude=('force_at_400kpa_n',),
    reported=(Reported(
        'force_at_400kpa_n', 'N', lambda values, rig: values['force_at_400kpa_n']),),
    packed=record('force_per_pa', 'atmosphere_pa'),
    pack=_pack,
    fitting=Fitting(free=(FreeParameter('force_at_400kpa_n', 1.0, 0.0, 100.0),)),
)


@compiled
def muscle_friction(level_n: float, pressure_pa: float, par: np.record) -> float:
    """Return the friction level with this part added."""
    return level_n + par.force_per_pa * max(pressure_pa - par.atmosphere_pa, 0.0)

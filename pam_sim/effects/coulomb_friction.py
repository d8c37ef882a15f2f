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

"""Constant dry friction inside the muscle: |F_f| <= F_c, full and against motion when sliding."""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter

EFFECT = Effect(
    name='coulomb_friction',
    family='friction',
    subsystem='muscle',
    sentence='Dry friction inside the muscle holds it until the force exceeds a constant level.',
    source="Coulomb's law of friction.",
    equation='F -> F - F_f, |F_f| <= F_c at rest, F_f = F_c sign(v) sliding',
    parameters=(
        Parameter('force_n', 'N', 2.0, 0.0, 50.0, description='Friction level.'),
    ),
    amplitude=('force_n',),
    reported=(Reported('force_n', 'N', lambda values, rig: values['force_n']),),
    fitting=Fitting(free=(FreeParameter('force_n', 1.0, 0.0, 50.0),)),
)


@compiled
def muscle_friction(level_n: float, par: np.record) -> float:
    """Return the friction level with this part added."""
    return level_n + par.force_n

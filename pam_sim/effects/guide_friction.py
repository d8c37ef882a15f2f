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

"""Dry friction of rail or joint, outside the load cell's muscle side: the cell carries it."""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter

EFFECT = Effect(
    name='guide_friction',
    family='friction',
    subsystem='load',
    sentence='Dry friction of rail or joint holds the load; the load cell reads it.',
    source="Coulomb's law of friction.",
    equation='m dv/dt = F - c v - m g - F_ext - F_guide, |F_guide| <= F_c at rest, F_guide '
             '= F_c sign(v) sliding; F_cell -> F_cell + F_guide',
    parameters=(
        Parameter('force_n', 'N', 2.0, 0.0, 50.0, description='Friction level of the guide.'),
    ),
    amplitude=('force_n',),
    reported=(Reported('force_n', 'N', lambda values, rig: values['force_n']),),
    fitting=Fitting(free=(FreeParameter('force_n', 1.0, 0.0, 50.0),)),
)


@compiled
def load_friction(level_n: float, par: np.record) -> float:
    """Return the friction level of the guide with this part added."""
    return level_n + par.force_n

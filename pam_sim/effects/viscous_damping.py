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

"""Velocity-dependent force beside the nominal damping: F -> F - c v."""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter

EFFECT = Effect(
    name='viscous_damping',
    family='damping',
    subsystem='muscle',
    sentence='The muscle resists fast motion more (or less) than the nominal damping says.',
    source='Linear damper; the parameter damping_n_s_per_m by another name.',
    equation='F -> F - c v',
    parameters=(
        Parameter('damping_n_s_per_m', 'N s/m', 20.0, -200.0, 1000.0,
                  description='Damping on top of the nominal one.'),
    ),
    amplitude=('damping_n_s_per_m',),
    reported=(Reported(
        'force_at_50mm_per_s_n', 'N', lambda values, rig: 0.05 * values['damping_n_s_per_m']),),
    fitting=Fitting(
        free=(FreeParameter('damping_n_s_per_m', 20.0, -200.0, 1000.0),),
        same_as='damping_n_s_per_m'),
)


@compiled
def muscle_force(force_n: float, velocity_m_per_s: float, par: np.record) -> float:
    """Return the force less that of the damper."""
    return force_n - par.damping_n_s_per_m * velocity_m_per_s

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

"""Parallel elastic force of the tube: F -> F - k x."""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter

EFFECT = Effect(
    name='bladder_stiffness',
    family='static_map',
    subsystem='muscle',
    sentence='The rubber tube resists contraction like a spring beside the braid.',
    source='Linear parallel spring; size: design choice.',
    equation='F -> F - k x',
    parameters=(
        Parameter('stiffness_n_per_m', 'N/m', 200.0, -2e3, 1e4,
                  description='Parallel stiffness, relaxed at zero contraction.'),
    ),
    amplitude=('stiffness_n_per_m',),
    reported=(Reported(
        'stiffness_n_per_m', 'N/m', lambda values, rig: values['stiffness_n_per_m']),),
    fitting=Fitting(
        free=(
            # It takes force; one that gave some would be an error of the force map.
            FreeParameter('stiffness_n_per_m', 200.0, 0.0, 1e4),),
        same_without_force='spring_n_per_m'),
)


@compiled
def map_output(tension_n: float, contraction_m: float, par: np.record) -> float:
    """Return the tension less that of the tube."""
    return tension_n - par.stiffness_n_per_m * contraction_m

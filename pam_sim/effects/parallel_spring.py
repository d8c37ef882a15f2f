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

"""Elastic load beside the mass, relaxed at zero contraction: k x against contraction."""

import numpy as np
from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.parameters import Parameter

EFFECT = Effect(
    name='parallel_spring',
    family='load',
    subsystem='load',
    sentence='A spring beside the mass pulls against contraction; the load cell reads it.',
    source='Linear spring; size: design choice.',
    equation='m dv/dt = F - c v - m g - F_ext - k x, F_cell -> F_cell + k x',
    parameters=(
        Parameter('stiffness_n_per_m', 'N/m', 300.0, 0.0, 1e4,
                  description='Stiffness of the spring.'),
    ),
    amplitude=('stiffness_n_per_m',),
    reported=(Reported(
        'stiffness_n_per_m', 'N/m', lambda values, rig: values['stiffness_n_per_m']),),
)


@compiled
def load_force(force_n: float, contraction_m: float, par: np.record) -> float:
    """Return the force against contraction with the spring's added."""
    return force_n + par.stiffness_n_per_m * contraction_m

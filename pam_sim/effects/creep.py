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
Viscoelastic drift of the rubber: two relaxing springs beside the muscle.

    F -> F - sum_j k_j (x - q_j),   dq_j/dt = (x - q_j) / tau_j

Generalised Maxwell solid, e.g. Findley, Lai, Onaran (1976), ch. 5.
"""

from collections.abc import Mapping
from typing import Any, TYPE_CHECKING

import numpy as np

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Numbers, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter
from pam_sim.records import record

if TYPE_CHECKING:
    from pam_sim.rig import Rig


def _initial(values: Mapping[str, float], numbers: Numbers) -> dict[str, Any]:
    # Relaxed at the start.
    return {'anchor_1_m': numbers.contraction_m, 'anchor_2_m': numbers.contraction_m}


def _relaxing_stiffness(values: Mapping[str, float], rig: 'Rig') -> float:
    return values['stiffness_1_n_per_m'] + values['stiffness_2_n_per_m']


def _creep_fraction(values: Mapping[str, float], rig: 'Rig') -> float:
    """Return relaxing over static stiffness at 400 kPa gauge and 8.9 mm (5 kg at rest)."""
    length, x, d = rig.muscle.length_m, 8.86e-3, 1e-5
    near, far = rig.muscle.law.law.force_n(400e3, [(x - d) / length, (x + d) / length], 'allow')
    static = rig.parameters['force_map_gain'] * (near - far) / (2.0 * d)
    return float(_relaxing_stiffness(values, rig) / static) if static > 0.0 else 0.0


EFFECT = Effect(
    name='creep',
    family='slow',
    subsystem='muscle',
    sentence='At constant pressure the muscle goes on moving for seconds: the rubber relaxes.',
    source='Generalised Maxwell solid with two branches.',
    equation='F -> F - sum_j k_j (x - q_j), dq_j/dt = (x - q_j) / tau_j, j = 1, 2',
    parameters=(
        Parameter('stiffness_1_n_per_m', 'N/m', 57.0, 0.0, 5e3,
                  description='Relaxing spring of the fast branch.'),
        Parameter('time_constant_1_s', 's', 1.0, 0.02, 20.0,
                  description='Relaxation time of the fast branch.'),
        Parameter('stiffness_2_n_per_m', 'N/m', 57.0, 0.0, 5e3,
                  description='Relaxing spring of the slow branch.'),
        Parameter('time_constant_2_s', 's', 20.0, 0.02, 1e3,
                  description='Relaxation time of the slow branch.'),
    ),
    amplitude=('stiffness_1_n_per_m', 'stiffness_2_n_per_m'),
    reported=(
        Reported('relaxing_stiffness_n_per_m', 'N/m', _relaxing_stiffness),
        Reported('creep_fraction_at_400kpa', '-', _creep_fraction),
    ),
    states=record('anchor_1_m', 'anchor_2_m'),
    initial=_initial,
    fitting=Fitting(
        free=(
            FreeParameter('stiffness_1_n_per_m', 50.0, 0.0, 5e3),
            FreeParameter('stiffness_2_n_per_m', 50.0, 0.0, 5e3),
            FreeParameter('time_constant_1_s', 1.0, 0.15, 4.0, True, ends=('lower',)),
            FreeParameter('time_constant_2_s', 10.0, 4.0, 100.0, True, ends=('upper',))),
        limits=('viscous_damping', 'bladder_stiffness'), remembers=True),
)


@compiled
def relaxed(anchor_m: float, contraction_m: float, dx_m: float, elapsed_s: float,
            time_constant_s: float) -> float:
    """Return the anchor after ``elapsed_s`` with x rising linearly by dx (trapezoidal rule)."""
    middle = contraction_m - 0.5 * dx_m
    return anchor_m + elapsed_s / (time_constant_s + 0.5 * elapsed_s) * (middle - anchor_m)


@compiled
def muscle_force(force_n: float, contraction_m: float, dx_m: float, elapsed_s: float,
                 state: np.record, par: np.record) -> float:
    """Return the force less that of the relaxing springs."""
    q1 = relaxed(state.anchor_1_m, contraction_m, dx_m, elapsed_s, par.time_constant_1_s)
    q2 = relaxed(state.anchor_2_m, contraction_m, dx_m, elapsed_s, par.time_constant_2_s)
    return (force_n - par.stiffness_1_n_per_m * (contraction_m - q1)
            - par.stiffness_2_n_per_m * (contraction_m - q2))


@compiled
def commit(contraction_m: float, dx_m: float, elapsed_s: float, state: np.record,
           par: np.record) -> None:
    """Advance the anchors of the springs."""
    state.anchor_1_m = relaxed(
        state.anchor_1_m, contraction_m, dx_m, elapsed_s, par.time_constant_1_s)
    state.anchor_2_m = relaxed(
        state.anchor_2_m, contraction_m, dx_m, elapsed_s, par.time_constant_2_s)

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

from pam_sim.compiled import compiled
from pam_sim.effects.effect import Effect, Reported
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.parameters import Parameter

_K1, _TAU1, _K2, _TAU2 = range(4)


def _initial(values, numbers):
    return numbers.contraction_m, numbers.contraction_m      # relaxed at the start


def _relaxing_stiffness(values, rig):
    return values['stiffness_1_n_per_m'] + values['stiffness_2_n_per_m']


def _creep_fraction(values, rig):
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
    states=2,
    initial=_initial,
    fitting=Fitting(
        free=(
            FreeParameter('stiffness_1_n_per_m', 50.0, 0.0, 5e3),
            FreeParameter('stiffness_2_n_per_m', 50.0, 0.0, 5e3),
            FreeParameter('time_constant_1_s', 1.0, 0.15, 4.0, True, ends=('lower',)),
            FreeParameter('time_constant_2_s', 10.0, 4.0, 100.0, True, ends=('upper',))),
        limits=('viscous_damping', 'bladder_stiffness')),
)


@compiled
def relaxed(anchor_m, contraction_m, dx_m, elapsed_s, time_constant_s):
    """Return the anchor after ``elapsed_s`` with x rising linearly by dx (trapezoidal rule)."""
    middle = contraction_m - 0.5 * dx_m
    return anchor_m + elapsed_s / (time_constant_s + 0.5 * elapsed_s) * (middle - anchor_m)


@compiled
def muscle_force(force_n, pressure_pa, contraction_m, velocity_m_per_s, dx_m, elapsed_s,
                 state, i, par, k):
    """Return the force less that of the relaxing springs."""
    q1 = relaxed(state[i], contraction_m, dx_m, elapsed_s, par[k + _TAU1])
    q2 = relaxed(state[i + 1], contraction_m, dx_m, elapsed_s, par[k + _TAU2])
    return (force_n - par[k + _K1] * (contraction_m - q1)
            - par[k + _K2] * (contraction_m - q2))


@compiled
def commit(pressure_pa, contraction_m, velocity_m_per_s, dx_m, elapsed_s, state, i, par, k):
    """Advance the anchors of the springs."""
    state[i] = relaxed(state[i], contraction_m, dx_m, elapsed_s, par[k + _TAU1])
    state[i + 1] = relaxed(state[i + 1], contraction_m, dx_m, elapsed_s, par[k + _TAU2])

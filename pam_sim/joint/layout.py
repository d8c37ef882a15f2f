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
Records of the four arrays of the joint step, as ``pam_sim.rollout.layout`` has for a muscle.

All float64, SI. Torques and angles: flexion positive.
"""

from pam_sim.records import record

# Held during one step.
INPUT = record(
    'flexor_signal_0',              # as the inputs of the muscle
    'flexor_signal_1',
    'extensor_signal_0',
    'extensor_signal_1',
    'torque_n_m',                   # external
)

# After the step.
OUTPUT = record(
    'time_s',                       # since the start
    'angle_rad',
    'velocity_rad_per_s',
    'acceleration_rad_per_s2',
    'torque_n_m',                   # of both tendons
)

STATE = record(
    'steps',                        # done
    'angle_rad',
    'velocity_rad_per_s',
    'flexor_force_n',               # without dry friction
    'flexor_dry_n',                 # level of dry friction
    'extensor_force_n',
    'extensor_dry_n',
)

PARAMETERS = record(
    'dt_s',                         # one step
    'substeps',                     # coupling steps in it
    'substep_s',
    'flexor_radius_m',
    'extensor_radius_m',
    'flexor_zero_m',                # contraction at angle 0
    'extensor_zero_m',
    'weight_torque_n_m',            # m g l
    'inverse_inertia_per_kg_m2',
    'damping_n_m_s',
    'friction_n_m',
    'lower_rad',                    # the nearer of end stop and stretched braid
    'upper_rad',
    'hanging_rad',
)

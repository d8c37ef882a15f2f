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
Index constants of the arrays of the joint step, as ``pam_sim.rollout.layout`` for a muscle.

All float64, SI. Torques and angles: flexion positive.
"""

# -- inputs, held during one step ---------------------------------------------------------
IN_FLEXOR_0 = 0             # valve signals, as INP_SIGNAL_0 and _1 of the muscle
IN_FLEXOR_1 = 1
IN_EXTENSOR_0 = 2
IN_EXTENSOR_1 = 3
IN_TORQUE = 4               # N m, external
IN_SIZE = 5

# -- outputs after the step ------------------------------------------------------------------
OUT_TIME = 0                # s since the start
OUT_ANGLE = 1               # rad
OUT_VELOCITY = 2            # rad/s
OUT_ACCELERATION = 3        # rad/s^2
OUT_TORQUE = 4              # N m of both tendons
OUT_SIZE = 5

# -- state ---------------------------------------------------------------------------------
S_STEPS = 0
S_ANGLE = 1                 # rad
S_VELOCITY = 2              # rad/s
S_FLEXOR_FORCE = 3          # N, without dry friction
S_FLEXOR_DRY = 4            # N, level of dry friction
S_EXTENSOR_FORCE = 5
S_EXTENSOR_DRY = 6
STATE_SIZE = 7

# -- parameters ------------------------------------------------------------------------------
PAR_DT = 0                  # s, one step
PAR_SUBSTEPS = 1            # coupling steps in it
PAR_SUBSTEP = 2             # s
PAR_FLEXOR_RADIUS = 3       # m
PAR_EXTENSOR_RADIUS = 4     # m
PAR_FLEXOR_ZERO = 5         # m, contraction at angle 0
PAR_EXTENSOR_ZERO = 6       # m
PAR_WEIGHT_TORQUE = 7       # N m, m g l
PAR_INVERSE_INERTIA = 8     # 1/(kg m^2)
PAR_DAMPING = 9             # N m s
PAR_FRICTION = 10           # N m
PAR_LOWER = 11              # rad, the nearer of end stop and stretched braid
PAR_UPPER = 12              # rad
PAR_HANGING = 13            # rad
PAR_SIZE = 14

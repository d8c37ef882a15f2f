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
The controller of a joint as a tick calls it: one law of the angle, one of the torque.

Every change between them is bumpless: each starts from what the other one commanded last. While
one runs each muscle is asked for 5 kPa at least, so that a driver that vents is always seen.
"""

import math
from typing import TYPE_CHECKING

from pam_actuation.control.following import FOLLOWS
from pam_actuation.control.joint_torque import JointTorque
from pam_actuation.control.modes.joint import JointController
from pam_actuation.control.modes.tracked import JOINT
from pam_actuation.control.tick import split_stamps, STAMPED_OF_JOINT, TickInputs
from pam_sim.joint.parameters import SIDES
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig

_LEAST_PA = P_ATM_PA + 5_000.0
_EFFORT_NAMES = ('follows_torque', 'joint_effort_stamp_sec', 'joint_effort_stamp_nanosec',
                 'wanted_torque_n_m')
# Recordings of versions before lack them, and cannot be replayed from their states alone.
CO_CONTRACTION = 'asked_co_contraction_pa'
PROVES = tuple(f'{side}_proves' for side in SIDES)
ADDED_NAMES = (CO_CONTRACTION, *PROVES)


class JointLaw:
    """
    Both laws of a joint.

    Parameters
    ----------
    controller : JointController
        Tracks the angle.
    joint : pam_sim.joint.JointRig
        Its muscles turn wanted torques into pressures.

    """

    tracked = JOINT
    stamped = STAMPED_OF_JOINT

    def __init__(self, controller: JointController, joint: 'JointRig') -> None:
        self.controller = controller
        self.torque = JointTorque(joint, controller)
        self.places = tuple(joint.muscles)
        self._none_proves = (False,) * len(self.places)
        self.names = (*controller.state_names, *_EFFORT_NAMES, *JointTorque.STATE_NAMES,
                      *ADDED_NAMES)

    def pause(self) -> None:
        """Forget the motion: the next step starts bumplessly."""
        self.controller.pause()
        self.torque.pause()

    def limit_pressure(self, highest_pa: float) -> None:
        """Keep all commands below a pressure [absolute Pa] as well; NaN: no such limit."""
        self.controller.limit_pressure(highest_pa)
        self.torque.limit_pressure(highest_pa)

    def step(self, inputs: TickInputs) -> tuple[float, ...]:
        """Return the wanted absolute pressures [Pa] of flexor and extensor."""
        if math.isfinite(inputs.co_contraction_pa):
            self.controller.want_co_contraction(inputs.co_contraction_pa - P_ATM_PA)
        commands_pa = self._torque(inputs) if inputs.effort.follows else self._angle(inputs)
        return tuple(max(command_pa, _LEAST_PA) for command_pa in commands_pa)

    def _angle(self, inputs: TickInputs) -> tuple[float, float]:
        self.torque.pause()
        return self.controller.step(
            inputs.position, inputs.reference, inputs.reference_rate, inputs.lead_reference,
            inputs.lead_reference_rate, inputs.learning, inputs.elapsed_s, inputs.pressures_pa,
            inputs.forces_n, inputs.held_back, inputs.ages_s)

    def _torque(self, inputs: TickInputs) -> tuple[float, float]:
        flexor_n, extensor_n = inputs.forces_n
        if inputs.held_back != FOLLOWS:
            flexor_n = extensor_n = math.nan        # the feedback stands still
        flexor_pa, extensor_pa = inputs.pressures_pa
        commands_pa = self.torque.step(
            inputs.position, inputs.effort.torque_n_m, self.controller.wanted_co_contraction_pa,
            (flexor_n, extensor_n), (flexor_pa, extensor_pa))
        self.controller.stand_aside(commands_pa)
        return commands_pa

    def internals(self, inputs: TickInputs) -> tuple[float, ...]:
        """Return what both laws report of their tick, and the wanted torque."""
        effort = inputs.effort
        return (*self.controller.state_values(), float(effort.follows),
                *split_stamps([effort.stamp_ns]), effort.torque_n_m, *self.torque.state_values(),
                inputs.co_contraction_pa, *map(float, inputs.proves or self._none_proves))

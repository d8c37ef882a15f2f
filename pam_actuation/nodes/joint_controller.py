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

"""The controller of a joint on ROS: angle and set points in, two pressure commands out."""

from collections.abc import Sequence
import sys
from typing import Any, TYPE_CHECKING

from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.nodes import qos
from pam_actuation.nodes.controller_node import ACCEPT_OTHER_RIG
from pam_actuation.nodes.controller_node import ControllerNode
from pam_actuation.nodes.diagnostics import Values
from pam_actuation.nodes.learning_switch import LearningSwitch
from pam_actuation.nodes.parameters import valve_of_rig
from pam_actuation.nodes.runner import run
from std_msgs.msg import String

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig


class JointNode(LearningSwitch, ControllerNode):
    """
    Control a joint with its two muscles; at every end ask both drivers to vent.

    It tracks an angle or, without one, a torque. Its namespace is that of the joint. The
    drivers of the muscles run in ``flexor`` and ``extensor`` below it. It publishes the URDF
    of the joint on ``robot_description``. The parameter ``muscle`` is the name of the joint
    in the URDF, in trajectories and in efforts.
    """

    NAME = 'joint_controller'
    REALTIME_RANK = 1
    LIVE = ('learning',)
    PARAMETERS = (
        node_parameter(
            'controller', '', 'Controller preset or file with mode joint. Empty: the preset '
            'that fits the valve and the size of the joint.'),
        node_parameter('joint', 'joint_dmsp_5_300_realistic',
                       'Joint the controller is made for: preset or path.'),
        valve_of_rig('Valves of the joint. Empty: those of its preset or file.'),
        ACCEPT_OTHER_RIG,
        node_parameter('learning', True, 'Whether the rules change while running.'),
    )

    _description: Any = None        # publisher

    def load_rig(self) -> 'JointRig':
        """Return the joint that the controller is made for."""
        from pam_sim.joint import load_joint
        return load_joint(self.value('joint'), valve=self.value('valve_type') or None)

    def preset_for(self, rig: 'JointRig') -> str:
        """Return the name of the controller preset that fits a joint."""
        from pam_actuation.control.modes.files import joint_preset_for
        return joint_preset_for(rig, rig.valve)

    def setup(self) -> None:
        """Load the controller, create the topics, describe the joint."""
        from pam_sim.joint.urdf import joint_urdf
        joint = self.load_rig()
        self.build(joint)
        self._description = self.create_publisher(String, 'robot_description', qos.LATCHED)
        self._description.publish(String(data=joint_urdf(joint, self.value('muscle'))))
        self.create_topics()
        self._own_services = (self.create_freeze_service(),)

    def teardown(self) -> None:
        """Take service and description back."""
        super().teardown()
        if self._description is not None:
            self.destroy_publisher(self._description)
        self._description = None

    def diagnostic_values(self) -> Values:
        """Add whether the rules change."""
        values = super().diagnostic_values()
        return values if self.loop is None else (*values, ('learning', self.learning))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run(JointNode, args)


if __name__ == '__main__':
    sys.exit(main())

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

"""The controller of a joint on ROS: angle and wishes in, two pressure commands out."""

from collections.abc import Sequence
import sys
from typing import Any

from pam_actuation.messages import Pressure
from pam_actuation.nodes import qos
from pam_actuation.nodes.controller_node import ACCEPT_OTHER_RIG
from pam_actuation.nodes.controller_node import FOLLOWING
from pam_actuation.nodes.controller_node import report_reason
from pam_actuation.nodes.diagnostics import Values
from pam_actuation.nodes.learning_switch import LearningSwitch
from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.parameters import NodeParameter
from pam_actuation.nodes.refusals import RefusalLog
from pam_actuation.nodes.runner import run
from pam_actuation.nodes.senders import SensorEar
from pam_sim.joint.parameters import SIDES
from pam_sim.units import P_ATM_PA
from std_msgs.msg import String

GIVING = 'giving the wanted torque'
MEASURED = 'joint_state'
INPUTS = {
    'joint_trajectory': 'on_named_trajectory', 'joint_reference': 'on_joint_reference',
    'joint_effort': 'on_named_efforts', 'co_contraction': 'on_co_contraction',
    MEASURED: 'on_joint_state'}


class JointNode(LearningSwitch, ManagedNode):
    """
    Control a joint with its two muscles; at every end ask both drivers to vent.

    It tracks an angle or, without one, a torque. Its namespace is that of the joint. The
    drivers of the muscles run in ``flexor`` and ``extensor`` below it. It publishes the URDF
    of the joint on ``robot_description``. The parameter ``muscle`` is the name of the joint
    in the URDF, in trajectories and in efforts.
    """

    NAME = 'joint_controller'
    REALTIME_RANK = 1
    PARAMETERS = (
        NodeParameter(
            'controller', '', 'Controller preset or file with mode joint. Empty: the preset '
            'that fits the valve and the size of the joint.'),
        NodeParameter('joint', 'joint_dmsp_5_300_realistic', 'Joint the controller is made for: '
                      'preset or path.'),
        NodeParameter('valve_type', 'ppr', 'Valves of the joint.', choices=('ppr', 'hsv')),
        ACCEPT_OTHER_RIG,
        NodeParameter(
            'learning', True, 'Whether the rules change while running.', live=True),
    )

    loop: Any = None            # a JointControllerLoop, once configured

    def setup(self) -> None:
        """Load the controller, create the topics."""
        from pam_actuation.control.config import load_controller
        from pam_actuation.control.joint_loop import JointControllerLoop
        from pam_actuation.control.modes.files import joint_preset_for
        from pam_sim.joint import load_joint
        from pam_sim.joint.urdf import joint_urdf
        valve = self.value('valve_type')
        joint = load_joint(self.value('joint'), valve=valve)
        name = self.value('controller') or joint_preset_for(joint, valve)
        accept = self.value('accept_other_rig')
        spare = load_controller(name, joint, accept_other_rig=accept)
        spare.step(0.0, 0.0, 0.0, 0.0, 0.0)         # compiled before time counts
        controller = load_controller(name, joint, accept_other_rig=accept)
        if controller.other_rig:
            self.get_logger().warning(f'the controller was {controller.other_rig}')
        self.loop = JointControllerLoop(controller, joint, self.value('muscle'))
        self._description = self.create_publisher(String, 'robot_description', qos.LATCHED)
        self._description.publish(String(data=joint_urdf(joint, self.value('muscle'))))
        self._commands = [f'{side}/pressure_command' for side in SIDES]
        for topic in (*self._commands, 'controller_state'):
            self.add_publisher(topic)
        self._inputs = [
            (topic, self.add_subscription(topic, writers=topic == MEASURED),
             getattr(self.loop, handler)) for topic, handler in INPUTS.items()]
        self._ear = SensorEar(self, next(
            subscription for topic, subscription, _ in self._inputs if topic == MEASURED))
        self._sides = [
            (topic, k, self.add_subscription(f'{side}/{topic}'), handler)
            for topic, handler in (('followed_pressure', self.loop.on_followed_pressure),
                                   ('pressure', self.loop.on_pressure),
                                   ('force', self.loop.on_force))
            for k, side in enumerate(SIDES)]
        self._refusals = RefusalLog(self.get_logger())
        self._freeze_service = self.create_freeze_service()

    def teardown(self) -> None:
        """Take service and description back."""
        self.destroy_service(self._freeze_service)
        self.destroy_publisher(self._description)
        self.loop = None

    def start(self) -> None:
        """Begin without memory of a former run; what was learned stays."""
        self.discard_arrived()
        self.loop.forget()
        self.add_loop(1.0 / self.loop.rate_hz)

    def tick(self) -> None:
        """Take the newest inputs, compute, send both commands and internals."""
        for topic, subscription, handler in self._inputs:
            taken = subscription.take()
            for message, _ in taken:
                handler(message)
            if topic == MEASURED:
                measured = taken
        for topic, side, subscription, handler in self._sides:
            for message, _ in subscription.take():
                handler(side, message)
        now_ns = self.now_ns()      # only now, see ControllerNode
        self.loop.two_sensors = self._ear.took(measured, now_ns)
        commands, state = self.loop.tick(now_ns, self.learning)
        for topic, command in zip(self._commands, commands):
            self.send(topic, command)
        self.send('controller_state', state)
        self._refusals.note(
            self.loop.refusal, self.loop.references.refusal, self.loop.efforts.refusal)
        report_reason(
            self.diagnostics, self.loop.reason,
            GIVING if self.loop.follows_torque else FOLLOWING)

    def safe_stop(self, why: str) -> None:
        """Command atmospheric pressure: both drivers vent."""
        if self.publishers_counted:
            for topic in self._commands:
                self.send(topic, Pressure(self.now_ns(), P_ATM_PA))

    def diagnostic_values(self) -> Values:
        """Add whether the rules change, and wishes that were refused."""
        values = super().diagnostic_values()
        if self.loop is None:
            return values
        return (*values, ('learning', self.learning),
                ('follows', 'torque' if self.loop.follows_torque else 'angle'),
                ('references.refused', self.loop.rejected_references),
                ('references.refusal', self.loop.refusal or self.loop.references.refusal),
                ('efforts.refused', self.loop.efforts.rejected),
                ('efforts.refusal', self.loop.efforts.refusal))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run(JointNode, args)


if __name__ == '__main__':
    sys.exit(main())

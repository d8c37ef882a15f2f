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

"""The joint on ROS: valve signals of two muscles in, angle and their measurements out."""

from collections.abc import Sequence
import sys

from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.nodes.parameters import valve_of_rig
from pam_actuation.nodes.physics_node import MAX_SEED, PhysicsNode
from pam_actuation.nodes.runner import run


class JointSimulator(PhysicsNode):
    """
    Simulate two muscles, their valves and the limb they turn, in real time with 1 ms steps.

    Its namespace is that of the joint. The muscles have ``flexor`` and ``extensor`` below it,
    each with the topics of a rig. Timing is that of the plant simulator.
    """

    NAME = 'joint_simulator'
    REALTIME_RANK = 2
    PARAMETERS = (
        node_parameter(
            'joint', 'joint_dmsp_5_300_realistic', 'Joint preset, or path of its file.'),
        valve_of_rig('Valves of both muscles. Empty: those of the preset or file of the joint.'),
        node_parameter('seed', 0, 'Seed of noise and stamp jitter.', 0, MAX_SEED - 1),
        node_parameter(
            'publish_rate_hz', 250.0, 'Rate of the measurements [Hz].', 200.0, 1000.0),
    )

    def setup(self) -> None:
        """Load the joint, create the topics."""
        from pam_sim.joint import load_joint
        self.set_up(load_joint(self.value('joint'), valve=self.value('valve_type') or None))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run(JointSimulator, args)


if __name__ == '__main__':
    sys.exit(main())

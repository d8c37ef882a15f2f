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

"""The rig on ROS: valve signal in, measured pressure, contraction and force out."""

import sys

from pam_actuation.nodes.conversions import from_ros
from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.parameters import NodeParameter
from pam_actuation.nodes.runner import run

MAX_SEED = 2**31 - 1


class PlantSimulator(ManagedNode):
    """
    Simulate valve, muscle, load and sensors in real time with 1 ms steps.

    Physics runs up to the present at every tick. A valve signal or a disturbance acts from
    its own stamp on if physics has not passed it yet, else at once, and is held without limit.
    """

    NAME = 'plant_simulator'
    PARAMETERS = (
        NodeParameter('rig', 'dmsp_5_300_realistic', 'Rig preset, or path of a model file.'),
        NodeParameter('valve_type', 'ppr', 'Valve of the rig.', choices=('ppr', 'hsv')),
        NodeParameter('seed', 0, 'Seed of noise and stamp jitter.', 0, MAX_SEED),
        NodeParameter(
            'publish_rate_hz', 250.0, 'Rate of the measurements [Hz].', 200.0, 1000.0),
    )

    plant = None

    def setup(self):
        """Load the rig, create the sensors' publishers."""
        from pam_actuation.plant_loop import PlantLoop
        from pam_sim import load_rig
        rig = load_rig(self.value('rig'), valve=self.value('valve_type'))
        rig.plant().step((0.0,) * len(rig.signal_names))     # compiled before time counts
        self.plant = PlantLoop(rig, seed=self.value('seed'))
        for topic in ('pressure', 'contraction', 'force'):
            self.add_publisher(topic)
        if rig.valve == 'hsv':
            self.add_publisher('supply_pressure')
        self.signals = self.add_subscription('valve_signal')
        self.disturbances = self.add_subscription('external_force')

    def start(self):
        """Begin with the clock at the present."""
        self.plant.advance_to(self.now_ns())
        self._sampled_steps = None
        self.add_loop(1.0 / self.value('publish_rate_hz'))

    def diagnostic_values(self):
        """Add how the physics keeps up with the clock."""
        values = super().diagnostic_values()
        if self.plant is None:
            return values
        return (*values, ('physics.steps', self.plant.steps),
                ('physics.skipped_s', f'{self.plant.skipped_s:.3f}'))

    def tick(self):
        """Apply what arrived, run physics to the present, measure."""
        now_ns = self.now_ns()
        arrived = [(from_ros('external_force', message), self.plant.set_external_force)
                   for message, _ in self.disturbances.take()]
        arrived += [(from_ros('valve_signal', message), self.plant.set_signal)
                    for message, _ in self.signals.take()]
        for plain, apply in sorted(arrived, key=lambda item: item[0].stamp_ns):
            self.plant.advance_to(min(plain.stamp_ns, now_ns))
            apply(plain)
        self.plant.advance_to(now_ns)
        if self.plant.steps == self._sampled_steps:
            return              # right after a late tick: there is nothing new to measure
        self._sampled_steps = self.plant.steps
        for topic, plain in self.plant.sample(now_ns).items():
            self.send(topic, plain)


def main(args=None):
    """Run the node; return its exit code."""
    return run(PlantSimulator, args)


if __name__ == '__main__':
    sys.exit(main())

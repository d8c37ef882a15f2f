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

from collections.abc import Sequence
import sys
from typing import Any

from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.nodes import lockstep
from pam_actuation.nodes.diagnostics import Values
from pam_actuation.nodes.endpoints import full_name
from pam_actuation.nodes.lockstep import TickInput
from pam_actuation.nodes.parameters import valve_of_rig
from pam_actuation.nodes.physics_node import MAX_SEED, PhysicsNode
from pam_actuation.nodes.runner import run
from pam_actuation.nodes.simulated_time import CLOCK_TOPIC
from pam_actuation.nodes.simulated_time import PlantTime
from pam_sim.errors import InputError
from std_srvs.srv import SetBool
from std_srvs.srv import Trigger


class PlantSimulator(PhysicsNode):
    """
    Simulate valve, muscle, load and sensors in real time with 1 ms steps.

    At every tick the physics runs up to the present. A valve signal or a disturbance acts from
    its own stamp on, or at once if the physics has passed that time. It is held without limit.
    With a stamp ahead of the clock, a valve signal acts at once and a disturbance at its stamp.
    With use_sim_time the plant makes the time and is the only publisher of ``/clock``.
    """

    NAME = 'plant_simulator'
    REALTIME_RANK = 2
    PARAMETERS = (
        node_parameter('rig', 'dmsp_5_300_realistic', 'Rig preset, or path of a model file.'),
        valve_of_rig('Valve of the rig. Empty: that of its preset or file.'),
        node_parameter('seed', 0, 'Seed of noise and stamp jitter.', 0, MAX_SEED),
        node_parameter(
            'publish_rate_hz', 250.0, 'Rate of the measurements [Hz].', 100.0, 1000.0),
        node_parameter(
            'clock_rate', 1.0, 'With use_sim_time: simulated seconds per second; 0, in lockstep '
            'only: as fast as the nodes answer.', 0.0, 1000.0),
    )

    simulated_time: PlantTime | None
    _clock_services: Sequence[Any] = ()

    def check(self) -> None:
        """Refuse a clock that nothing would hold back."""
        if self.value('clock_rate') == 0.0 and not self.participants:
            raise InputError('0 is allowed in lockstep only', 'parameter clock_rate')

    def setup(self) -> None:
        """Load the rig, create the topics and what steers the clock."""
        from pam_sim import load_rig
        self.set_up(load_rig(self.value('rig'), valve=self.value('valve_type') or None))
        if self.uses_simulated_time:
            self._clock_services = [
                self.create_service(SetBool, '~/pause', self._on_pause),
                self.create_service(Trigger, '~/step', self._on_step)]

    def teardown(self) -> None:
        """Take the services back."""
        for service in self._clock_services:
            self.destroy_service(service)
        self._clock_services = ()

    def make_simulated_time(self) -> PlantTime:
        """Make the time that the others follow; InputError if somebody else does."""
        if self.count_publishers(CLOCK_TOPIC):
            raise InputError('another node publishes it; the plant is the only clock', CLOCK_TOPIC)
        followers = tuple(full_name(self.get_namespace(), name)
                          for name in self.participants if name != self.NAME)
        return PlantTime(
            self, self.tick_inputs(lockstep.PLANT_PATIENCE_S),
            1.0 / self.value('publish_rate_hz'), self.value('clock_rate'), followers)

    def inputs_of_a_tick(self) -> list[TickInput]:
        """Return the signal of the driver and, where there is one, the disturbance."""
        if lockstep.DRIVER not in self.participants:
            return []
        (signals, _), (disturbances, _) = (
            self.inputs[topic] for topic in ('valve_signal', 'external_force'))
        return [lockstep.Stamped(signals), lockstep.StampedIfSent(disturbances)]

    def _on_pause(self, request: Any, response: Any) -> Any:
        assert self.simulated_time is not None
        self.simulated_time.paused = request.data
        response.success = True
        response.message = 'paused' if request.data else 'going on'
        return response

    def _on_step(self, request: Any, response: Any) -> Any:
        assert self.simulated_time is not None
        response.success = self.simulated_time.paused
        response.message = 'not paused'
        if response.success:
            self.simulated_time.step()
            response.message = f'one step of {1e3 / self.value("publish_rate_hz"):g} ms'
        return response

    def diagnostic_values(self) -> Values:
        """Add the clock it makes."""
        values = super().diagnostic_values()
        if self.plant is None or self.simulated_time is None:
            return values
        return (*values, ('clock.rate', f'{self.simulated_time.achieved_rate:.3f}'),
                ('clock.paused', self.simulated_time.paused),
                ('clock.waits_for', ' '.join(self.simulated_time.waits_for)))

    def tick(self) -> None:
        """Apply what arrived, run physics to the present, measure."""
        arrived = self.arrived()
        messages = self.measured(self.now_ns(), arrived)
        if not messages:
            return
        if self.simulated_time is not None and self.participants:
            self.simulated_time.publish()       # first: the others wake up and await the rest
        for topic, plain in messages.items():
            self.send(topic, plain)
        if self.simulated_time is not None and not self.participants:
            self.simulated_time.publish()       # last: a tick finds what was measured for it


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run(PlantSimulator, args)


if __name__ == '__main__':
    sys.exit(main())

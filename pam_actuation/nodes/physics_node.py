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

"""What the nodes of simulated physics share: they follow the clock and measure what is new."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TYPE_CHECKING

from pam_actuation.messages import ACTIVE, Message
from pam_actuation.nodes.diagnostics import OK, Values, WARN
from pam_actuation.nodes.endpoints import PolledSubscription
from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.timing import Latency
from pam_actuation.plant_loop import Backlog
from pam_actuation.topics.table import short_name

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

Arrived = tuple[Any, Callable[[Any], object]]      # a plain message, and what takes it
MAX_SEED = 2**31 - 1


class PhysicsNode(ManagedNode):
    """
    Run ``plant``, a ``PlantLoop``, up to the present at every tick.

    What arrives acts from its own stamp on if physics has not passed it yet, else at once. A
    valve signal whose stamp lies ahead acts at once as well, and a disturbance waits for it.
    How old it then is stands in the diagnostics, for the whole run (``input.latency``).
    Derived nodes have the parameters ``seed`` and ``publish_rate_hz`` and call ``set_up`` with
    their rig.
    """

    plant: Any = None           # a PlantLoop, once configured
    _latency: Latency | None = None

    def set_up(self, rig: 'Rig | JointRig') -> None:
        """Build the plant of a rig, publish its sensors, listen to its valve signals."""
        from pam_actuation.plant_loop import PlantLoop
        PlantLoop(rig).step(1)              # compiled before time counts
        self.plant = plant = PlantLoop(rig, seed=self.value('seed'))
        for topic in plant.topics:
            self.add_publisher(topic)
        self.inputs: dict[str, tuple[PolledSubscription, Callable[..., object]]] = {
            topic: (self.add_subscription(topic, writers=short_name(topic) == 'valve_signal'),
                    take) for topic, take in plant.takes().items()}

    def start(self) -> None:
        """Begin with the clock at the present."""
        self.plant.advance_to(self.now_ns())
        self._sampled_steps: int | None = None
        self._latency = Latency()
        self._backlog: Backlog[Arrived] = Backlog()
        self.add_loop(1.0 / self.value('publish_rate_hz'))

    def tick(self) -> None:
        """Apply what arrived, run physics to the present, measure."""
        arrived = self.arrived()
        for topic, plain in self.measured(self.now_ns(), arrived).items():
            self.send(topic, plain)

    def arrived(self) -> list[Arrived]:
        """Return what arrived since the last call, each with what takes it."""
        return [(message, partial(take, writer=info['writer']) if 'writer' in info else take)
                for subscription, take in self.inputs.values()
                for message, info in subscription.take()]

    def measured(self, now_ns: int, arrived: Sequence[Arrived]) -> dict[str, Message]:
        """
        Apply what arrived, run physics to a time, measure.

        Parameters
        ----------
        now_ns : int
            Time of the tick.
        arrived : list of tuple
            Plain messages, each with the callable that takes it.

        Returns
        -------
        dict
            Messages by topic; empty right after a late tick, when there is nothing new, and for
            a moment after a standstill.

        """
        self.plant.follow(now_ns)
        if self.simulated_time is None:
            taken = self._backlog.take(now_ns, arrived)
            if taken is None:
                return {}
            arrived = taken
        for plain, apply in sorted(arrived, key=lambda item: item[0].stamp_ns):
            self.plant.advance_to(min(plain.stamp_ns, now_ns))
            apply(plain)
            if self.simulated_time is None and self._latency is not None:
                self._latency.add(now_ns - plain.stamp_ns)
        self.plant.advance_to(now_ns)
        problems = self.plant.problems(now_ns)
        self.diagnostics.update(WARN if problems else OK, '; '.join((ACTIVE, *problems)))
        if self.plant.steps == self._sampled_steps:
            return {}
        self._sampled_steps = self.plant.steps
        return self.plant.sample(now_ns)

    def diagnostic_values(self) -> Values:
        """Add what could not be used or waits, and how the physics keeps up with the clock."""
        values = super().diagnostic_values()
        if self.plant is None:
            return values
        if self._latency is not None:
            values = (*values, *self._latency.values('input.latency'))
        unusable = ((f'{place}valve_signal.unusable', muscle.signal.unusable)
                    for place, muscle in self.plant.muscles.items())
        disturbance = self.plant.disturbance
        return (*values, *unusable, ('disturbances.waiting', disturbance.waiting),
                ('disturbances.refused', disturbance.refused),
                ('disturbances.refusal', disturbance.refusal),
                ('physics.steps', self.plant.steps),
                ('physics.skipped_s', f'{self.plant.skipped_s:.3f}'))

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
How the loops of the live nodes hang on a bus: what a tick sends, and who takes it.

A loop says with ``takes()`` which topics it takes. ``prefix`` is the namespace of a muscle within
a rig of several, such as ``flexor/``.
"""

from collections.abc import Callable, Mapping
from typing import Protocol

from pam_actuation.loops.bus import Bus, Take, Tick
from pam_actuation.messages import Message, Pressure, ValveSignal


class Takes(Protocol):
    """A loop that takes messages."""

    def takes(self) -> Mapping[str, Take]:
        """Return what takes each topic."""


class Plant(Takes, Protocol):
    """What a plant on a clock does."""

    def advance_to(self, now_ns: int) -> int:
        """Step the physics up to a time."""

    def sample(self, now_ns: int) -> Mapping[str, Message]:
        """Read the sensors."""


class Reference(Protocol):
    """What a reference on a clock does."""

    def tick(self, now_ns: int) -> Mapping[str, Message]:
        """Return what is wanted from now on, by topic."""


class Controller(Takes, Protocol):
    """What a controller on a clock does."""

    def sent(self, now_ns: int, learning: bool) -> Mapping[str, Message]:
        """Run one tick; return commands and internals by topic."""


class Driver(Takes, Protocol):
    """What a valve driver on a clock does."""

    def act(self, now_ns: int) -> ValveSignal:
        """Run one tick; return the valve signal."""

    def followed(self) -> Pressure | None:
        """Return the pressure that the driver follows."""


def attach(bus: Bus, loop: Takes, prefix: str = '') -> None:
    """Have a loop take its topics."""
    for topic, take in loop.takes().items():
        bus.connect(f'{prefix}{topic}', take)


def attach_plant(bus: Bus, plant: Plant) -> Tick:
    """
    Have a plant on a clock take its topics; return its tick, which measures.

    A message acts from its stamp on, where physics has not passed that yet. A valve signal whose
    stamp lies ahead acts at once, and a disturbance waits in the plant.
    """
    def from_its_stamp(apply: Take) -> Take:
        def take(message: Message) -> None:
            plant.advance_to(min(message.stamp_ns, bus.now_ns))
            apply(message)
        return take

    for topic, apply in plant.takes().items():
        bus.connect(topic, from_its_stamp(apply))

    def tick(now_ns: int) -> None:
        plant.advance_to(now_ns)
        for topic, message in plant.sample(now_ns).items():
            bus.send(topic, message, now_ns)

    return tick


def reference_tick(bus: Bus, reference: Reference) -> Tick:
    """Return the tick of a reference."""
    def tick(now_ns: int) -> None:
        for topic, message in reference.tick(now_ns).items():
            bus.send(topic, message, now_ns)

    return tick


def controller_tick(bus: Bus, control: Controller) -> Callable[[int, bool], None]:
    """Return the tick of a controller: ``tick(now_ns, learning)``."""
    def tick(now_ns: int, learning: bool = True) -> None:
        for topic, message in control.sent(now_ns, learning).items():
            bus.send(topic, message, now_ns)

    return tick


def driver_tick(bus: Bus, driver: Driver, prefix: str = '',
                done: Tick | None = None) -> Tick:
    """Return the tick of a driver; ``done(now_ns)`` is called at its end."""
    signal_topic = f'{prefix}valve_signal'

    def tick(now_ns: int) -> None:
        bus.send(signal_topic, driver.act(now_ns), now_ns)
        send_followed(bus, driver, now_ns, prefix)
        if done is not None:
            done(now_ns)

    return tick


def signal_tick(bus: Bus, driver: Driver, prefix: str = '') -> Tick:
    """Return the tick of a driver that does not say which pressure it follows."""
    topic = f'{prefix}valve_signal'

    def tick(now_ns: int) -> None:
        bus.send(topic, driver.act(now_ns), now_ns)

    return tick


def send_followed(bus: Bus, driver: Driver, now_ns: int, prefix: str = '') -> Pressure | None:
    """Send the pressure that a driver follows; return it, None where it is an opening."""
    followed = driver.followed()
    if followed is not None:
        bus.send(f'{prefix}followed_pressure', followed, now_ns)
    return followed

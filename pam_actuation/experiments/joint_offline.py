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
The live loops of a joint on a virtual clock: plant, both drivers and the controller.

The loops are the ones the nodes call, joined by messages that take no time.
"""

from collections.abc import Callable
from typing import Any, TYPE_CHECKING

from pam_actuation.drivers.for_rig import driver_loops
from pam_actuation.loops.bus import Bus, every
from pam_actuation.loops.wiring import attach, attach_plant, driver_tick
from pam_actuation.messages import ControllerState, Message, Pressure, START_NS
from pam_actuation.plant_loop import PlantLoop
from pam_sim.joint.parameters import SIDES
from pam_sim.units import NS_PER_S, P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.control.loop import ControllerLoop
    from pam_sim.joint.rig import JointRig


class JointLoops:
    """
    A simulated joint and all that drives it, one tick of the controller at a time.

    Parameters
    ----------
    joint : pam_sim.joint.JointRig
    control : pam_actuation.control.loop.ControllerLoop
        Whoever steps this hands it its set points.
    seed : int
        Of the sensor noise.
    on_sent : callable, optional
        As of ``Bus``.

    """

    def __init__(self, joint: 'JointRig', control: 'ControllerLoop', seed: int = 0,
                 on_sent: Callable[[str, Message, int], object] | None = None) -> None:
        self.control = control
        self.plant = PlantLoop(joint, seed)
        drivers = driver_loops(joint, control.controller.driver)
        self.drivers = list(drivers.values())
        self.period_ns = round(NS_PER_S / control.rate_hz)
        self.now_ns = START_NS
        self.state: ControllerState | None = None       # the newest
        self.ticks = 0
        self._commands: tuple[Pressure, ...] = (Pressure(START_NS, P_ATM_PA),) * len(drivers)
        self._instead: dict[str, Any] = {}
        self.plant.advance_to(self.now_ns)
        self._bus = bus = Bus(on_sent=on_sent)
        first_ns = START_NS + self.period_ns
        bus.add(attach_plant(bus, self.plant), every(control.rate_hz, first_ns))
        bus.add(self._tick_control, every(control.rate_hz, first_ns))
        for place, driver in drivers.items():
            attach(bus, driver, place)
            bus.add(driver_tick(bus, driver, place), every(driver.rate_hz, first_ns))
        for topic, take in control.takes().items():
            bus.connect(topic, self._unless_replaced(topic, take))

    def _unless_replaced(self, topic: str,
                         take: Callable[[Any], object]) -> Callable[[Any], None]:
        """Return what hands on a message, or what stands in its place in this tick."""
        def taken(message: Any) -> None:
            both = self._instead.get(topic.rpartition('/')[2], message)
            take(self._instead.get(topic, both))
        return taken

    def _tick_control(self, now_ns: int) -> None:
        self._commands, self.state = self.control.tick(now_ns)
        self.ticks += 1
        for side, command in zip(SIDES, self._commands):
            self._bus.send(f'{side}/pressure_command', command, now_ns)

    def tick(self, **instead: Any) -> tuple[Pressure, ...]:
        """
        Run one period; return the commands of flexor and extensor as ``Pressure``.

        ``instead``: measurements by topic in place of those of the plant, None for one that
        is missing; ``joint_state``, ``pressure`` and ``force`` (of both muscles), or those
        of one, such as ``flexor/pressure``.
        """
        self._instead = instead
        self.now_ns += self.period_ns
        self._bus.run_until(self.now_ns)
        return self._commands

    def internal(self, name: str) -> float:
        """Return a number of the newest ``controller_state``."""
        assert self.state is not None, 'after the first tick'
        return self.state.values[self.state.names.index(name)]

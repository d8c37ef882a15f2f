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
The simulated rig on a clock: valve signal in, measurements out, no ROS.

The plant replaces the hardware behind the topics. It holds the last valve signal without limit,
steps its physics up to a given time and reads its sensors on request. The simulator node and the
offline simulation both use it.
"""

from collections.abc import Callable, Hashable, Iterable
import math
from typing import Any, Generic, TYPE_CHECKING, TypeVar

from pam_actuation.messages import (
    Contraction, Force, Pressure, SAFE_EFFORTS, VALVE_NAMES, ValveSignal)
from pam_sim.rig import Rig
from pam_sim.sensors import SensorChain

if TYPE_CHECKING:
    from pam_sim.plant import Plant

_NS = 1_000_000_000
SAFE_COUNTS_NS = 100_000_000     # a safe signal against the openings of others


class HeldSignal:
    """
    The valve signal that acts: the last effort of each name, held without limit.

    Where several send, as a driver and somebody who should not, one of them saying *vent* is
    enough: its safe signal acts for 0.1 s, whatever the others say. Of two openings the later
    one acts, as on a valve.

    Parameters
    ----------
    valve : {'ppr', 'hsv'}

    """

    def __init__(self, valve: str) -> None:
        self._names = VALVE_NAMES[valve]
        self._safe = SAFE_EFFORTS[valve]
        self._last = self.efforts = (0.0,) * len(self._names)
        # writer to the time until which its safe signal counts
        self._safe_until_ns: dict[Hashable, int] = {}
        self.taken = 0
        self.ignored = 0

    def take(self, message: ValveSignal, writer: Hashable = None, now_ns: int = 0) -> None:
        """
        Take efforts by name; anything not finite or unknown is ignored and counted.

        ``writer`` is who sent it, None where that is not known; ``now_ns`` the time of the plant.
        """
        self.taken += 1
        efforts = list(self._last)
        for name, effort in zip(message.names, message.efforts):
            if name in self._names and math.isfinite(effort):
                efforts[self._names.index(name)] = float(effort)
            else:
                self.ignored += 1
        self._last = self.efforts = tuple(efforts)
        if writer is not None and self._another_vents(writer, now_ns):
            self.efforts = self._safe

    def _another_vents(self, writer: Hashable, now_ns: int) -> bool:
        if self._last == self._safe:
            self._safe_until_ns[writer] = now_ns + SAFE_COUNTS_NS
        else:
            self._safe_until_ns.pop(writer, None)
        self._safe_until_ns = {one: until_ns for one, until_ns in self._safe_until_ns.items()
                               if now_ns <= until_ns <= now_ns + SAFE_COUNTS_NS}
        return bool(self._safe_until_ns.keys() - {writer})


def muscle_readings(plant: 'Plant', sensors: SensorChain, stamp_ns: int,
                    time_s: float) -> dict[str, Any]:
    """
    Read the sensors of one muscle; return the messages by short topic name.

    Stamped ``stamp_ns`` with the jitter of the sensor settings. Contraction carries no
    velocity: the rig does not measure one. ``supply_pressure`` is there for the HSV only.
    """
    pressure_pa, contraction_m, force_n, jitter_ns = sensors.read(
        time_s, plant.pressure_pa, plant.contraction_m, plant.force_n)
    stamp_ns += int(jitter_ns)
    messages = {
        'pressure': Pressure(stamp_ns, float(pressure_pa)),
        'contraction': Contraction(stamp_ns, float(contraction_m)),
        'force': Force(stamp_ns, float(force_n)),
    }
    if plant.rig.valve == 'hsv':
        messages['supply_pressure'] = Pressure(stamp_ns, float(plant.supply_pa))
    return messages


class PlantClock:
    """
    Physics in fixed steps that follows a clock in integer nanoseconds.

    Derived classes have ``step``, which does a number of steps.

    Parameters
    ----------
    dt_s : float
        Step of the physics.
    longest_catch_up_s : float
        The most time one call of ``advance_to`` simulates; more than that is skipped and
        counted.

    Attributes
    ----------
    steps : int
        Physics steps done.
    overruns : int
        Calls that came so late that time was skipped.
    skipped_s : float
        That time.

    """

    def __init__(self, dt_s: float, longest_catch_up_s: float) -> None:
        self.dt_ns = round(dt_s * _NS)
        self.longest_catch_up_ns = round(longest_catch_up_s * _NS)
        self._start_ns: int | None = None
        self.steps = 0
        self.overruns = 0
        self.skipped_s = 0.0

    @property
    def now_ns(self) -> int | None:
        """Return the time of the plant's state [ns], None before the start."""
        return None if self._start_ns is None else self._start_ns + self.steps * self.dt_ns

    def step(self, count: int) -> None:
        """Advance the plant by some steps."""
        raise NotImplementedError

    def advance_to(self, now_ns: int) -> int:
        """
        Step the physics up to ``now_ns``; return the number of steps done.

        The first call only sets the start time. A clock that goes back does nothing
        until it has caught up.
        """
        if self._start_ns is None:
            self._start_ns = now_ns
            return 0
        behind_ns = now_ns - (self._start_ns + self.steps * self.dt_ns)
        if behind_ns > self.longest_catch_up_ns:
            skipped_ns = (behind_ns - self.longest_catch_up_ns) // self.dt_ns * self.dt_ns
            self._start_ns += skipped_ns
            self.overruns += 1
            self.skipped_s += skipped_ns / _NS
            behind_ns -= skipped_ns
        count = max(behind_ns // self.dt_ns, 0)
        if count:
            self.step(count)
        self.steps += count
        return count


Arrived = TypeVar('Arrived')


class Backlog(Generic[Arrived]):
    """
    Holds back what arrives just after the plant stood still, until the rest is there.

    A process that was stopped finds its clock far ahead and its messages still on their way
    through the middleware. Physics that went on at once would let the valve signal from before
    act all that time: a filling valve would fill a muscle that was vented long ago.

    Parameters
    ----------
    after_s : float
        Time between two calls [s] from which it was a standstill.
    patience_s : float
        How long the messages may take to arrive then [s].

    """

    def __init__(self, after_s: float = 0.05, patience_s: float = 0.02) -> None:
        self._after_ns = round(after_s * _NS)
        self._patience_ns = round(patience_s * _NS)
        self._last_ns: int | None = None
        self._until_ns = 0
        self._held: list[Arrived] = []

    def take(self, now_ns: int, arrived: Iterable[Arrived]) -> list[Arrived] | None:
        """Return what is to be applied now, as a list; None while more may be on its way."""
        last_ns, self._last_ns = self._last_ns, now_ns
        if last_ns is not None and now_ns - last_ns > self._after_ns:
            self._until_ns = now_ns + self._patience_ns
        self._held += arrived
        if last_ns is not None and last_ns <= now_ns < self._until_ns:
            return None
        taken, self._held = self._held, []
        return taken


class PlantLoop(PlantClock):
    """
    A live plant of one muscle on a clock.

    Parameters
    ----------
    rig : pam_sim.rig.Rig
    seed : int
        Of the sensor noise.
    longest_catch_up_s : float
        As of ``PlantClock``.
    **initial
        Where it starts, as for :meth:`pam_sim.rig.Rig.pack`.

    """

    def __init__(self, rig: Rig, seed: int = 0, longest_catch_up_s: float = 0.25,
                 **initial: float) -> None:
        self.rig = rig
        self.plant = rig.plant(seed, **initial)
        super().__init__(self.plant.dt_s, longest_catch_up_s)
        self.sensors = SensorChain(rig.sensors, seed)
        self._held = HeldSignal(rig.valve)
        self._external_n = 0.0

    @property
    def signal(self) -> tuple[float, ...]:
        """Return the efforts that act on the valve."""
        return self._held.efforts

    @property
    def signals(self) -> int:
        """Return the number of valve messages taken."""
        return self._held.taken

    @property
    def signals_ignored(self) -> int:
        """Return the number of efforts that were not usable."""
        return self._held.ignored

    def takes(self) -> dict[str, Callable[[Any], None]]:
        """Return what takes each topic, by short name."""
        return {'external_force': self.set_external_force, 'valve_signal': self.set_signal}

    def set_signal(self, message: ValveSignal, writer: Hashable = None) -> None:
        """Take a valve signal: efforts by name, anything not finite or unknown is ignored."""
        self._held.take(message, writer, self.now_ns or 0)

    def set_external_force(self, message: Force) -> None:
        """Take the disturbance force on the load [N]; not finite is ignored."""
        if math.isfinite(message.force_n):
            self._external_n = float(message.force_n)

    def step(self, count: int) -> None:
        """Advance the plant by some steps with the signal held."""
        self.plant.step(self._held.efforts, self._external_n, steps=count)

    def sample(self, now_ns: int) -> dict[str, Any]:
        """
        Read the sensors; return the messages by short topic name.

        Stamps are the time of the plant's state (at most one step before ``now_ns``)
        with the jitter of the rig's sensor settings; else as ``muscle_readings``.
        """
        stamp_ns = now_ns if self.now_ns is None else self.now_ns
        return muscle_readings(self.plant, self.sensors, stamp_ns, self.plant.time_s)

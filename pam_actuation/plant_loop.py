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
The simulated rig on a clock: valve signals in, measurements out, no ROS.

The plant replaces the hardware behind the topics, of one muscle or of a joint with two. It holds
the last valve signal of each muscle without limit, steps its physics up to a given time and reads
its sensors on request. The simulator nodes and the offline simulation use it.
"""

from collections.abc import Callable, Hashable, Iterable
from functools import partial
from operator import attrgetter
from typing import Any, Generic, TYPE_CHECKING, TypeVar

from pam_actuation.disturbance import Disturbance
from pam_actuation.held_signal import HeldSignal
from pam_actuation.messages import (
    Contraction, Force, JointAngle, Pressure, Torque, ValveSignal)
from pam_sim.sensors import SensorChain
from pam_sim.sensors.encoder import Encoder
from pam_sim.units import NS_PER_S

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig
    from pam_sim.plant import Plant
    from pam_sim.rig import Rig

_EFFORTS = attrgetter('efforts')


class PlantMuscle:
    """
    One muscle of a plant on a clock: the signal held on its valve, and its sensors.

    Parameters
    ----------
    place : str
        Of the muscle below the namespace of its rig, as in ``Rig.muscles``.
    plant : pam_sim.plant.Plant
    seed : int
        Of the sensor noise.

    """

    def __init__(self, place: str, plant: 'Plant', seed: int) -> None:
        self.plant = plant
        self.signal = HeldSignal(plant.rig.valve)
        self.sensors = SensorChain(plant.rig.sensors, seed)
        self._pressure, self._contraction, self._force, self._supply = topics = tuple(
            f'{place}{topic}' for topic in (
                'pressure', 'contraction', 'force', 'supply_pressure'))
        self._knows_supply = plant.rig.valve == 'hsv'
        self.topics = topics if self._knows_supply else topics[:-1]

    def read(self, messages: dict[str, Any], stamp_ns: int, time_s: float) -> None:
        """
        Read the sensors; enter the messages by topic.

        Stamped ``stamp_ns`` with the jitter of the sensor settings. Contraction carries no
        velocity: the rig does not measure one. ``supply_pressure`` is there for the HSV only.
        """
        plant = self.plant
        pressure_pa, contraction_m, force_n, jitter_ns = self.sensors.read(
            time_s, plant.pressure_pa, plant.contraction_m, plant.force_n)
        stamp_ns += jitter_ns
        messages[self._pressure] = Pressure(stamp_ns, pressure_pa)
        messages[self._contraction] = Contraction(stamp_ns, contraction_m)
        messages[self._force] = Force(stamp_ns, force_n)
        if self._knows_supply:
            messages[self._supply] = Pressure(stamp_ns, plant.supply_pa)


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
        self.dt_ns = round(dt_s * NS_PER_S)
        self.longest_catch_up_ns = round(longest_catch_up_s * NS_PER_S)
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

    def follow(self, now_ns: int) -> None:
        """
        Go on from a clock that went back by more than ``longest_catch_up_s``; else do nothing.

        It begins anew where a recording is played again, or where the computer sets it.
        """
        present_ns = self.now_ns
        if present_ns is not None and present_ns - now_ns > self.longest_catch_up_ns:
            self._start_ns = now_ns - self.steps * self.dt_ns

    def advance_to(self, now_ns: int) -> int:
        """
        Step the physics up to ``now_ns``; return the number of steps done.

        The first call only sets the start time. A clock that goes back does nothing
        until it has caught up, unless ``follow`` is told.
        """
        if self._start_ns is None:
            self._start_ns = now_ns
            return 0
        behind_ns = now_ns - (self._start_ns + self.steps * self.dt_ns)
        if behind_ns > self.longest_catch_up_ns:
            skipped_ns = (behind_ns - self.longest_catch_up_ns) // self.dt_ns * self.dt_ns
            self._start_ns += skipped_ns
            self.overruns += 1
            self.skipped_s += skipped_ns / NS_PER_S
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
        self._after_ns = round(after_s * NS_PER_S)
        self._patience_ns = round(patience_s * NS_PER_S)
        self._last_ns: int | None = None
        self._until_ns = 0
        self._held: list[Arrived] = []

    def take(self, now_ns: int, arrived: Iterable[Arrived]) -> list[Arrived] | None:
        """Return what is to be applied now, as a list; None while more may be on its way."""
        last_ns, self._last_ns = self._last_ns, now_ns
        self._held += arrived
        if last_ns is None or now_ns < last_ns:         # the first call, or a clock set back
            self._until_ns = now_ns
        elif now_ns - last_ns > self._after_ns and last_ns >= self._until_ns:
            # One wait for a standstill: where all calls are late, each would begin another.
            self._until_ns = now_ns + self._patience_ns
        if now_ns < self._until_ns:
            return None
        taken, self._held = self._held, []
        return taken


class PlantLoop(PlantClock):
    """
    A live plant on a clock: one muscle with its load, or the muscles of a joint with its limb.

    Parameters
    ----------
    rig : pam_sim.rig.Rig or pam_sim.joint.JointRig
    seed : int
        Of the sensor noise; the second muscle has the next one.
    longest_catch_up_s : float
        As of ``PlantClock``.
    **initial
        Where it starts, as for ``plant`` of the rig.

    Attributes
    ----------
    muscles : dict of str to PlantMuscle
        By their place as in ``Rig.muscles``.
    disturbance : Disturbance
        On its load or limb.

    """

    def __init__(self, rig: 'Rig | JointRig', seed: int = 0,
                 longest_catch_up_s: float = 0.25, **initial: float) -> None:
        self.rig = rig
        self.plant: Any = rig.plant(seed, **initial)
        super().__init__(self.plant.dt_s, longest_catch_up_s)
        self.muscles = {place: PlantMuscle(place, plant, seed + k)
                        for k, (place, plant) in enumerate(self.plant.muscles.items())}
        self._signals = [muscle.signal for muscle in self.muscles.values()]
        self._encoder: Encoder | None = None
        if '' not in rig.muscles:       # of a joint
            self._encoder = Encoder((seed, len(rig.muscles)))
        self.disturbance = Disturbance(
            'external_torque' if self._encoder else 'external_force', self.dt_ns)

    @property
    def topics(self) -> tuple[str, ...]:
        """Return the topics of the measurements, relative to the namespace of the rig."""
        of_joint = () if self._encoder is None else ('joint_state',)
        return (*of_joint, *(topic for muscle in self.muscles.values() for topic in muscle.topics))

    def takes(self) -> dict[str, Callable[[Any], None]]:
        """Return what takes each topic, by name relative to the namespace of the rig."""
        takes: dict[str, Callable[[Any], None]] = {
            f'{place}valve_signal': partial(self.set_signal, place=place)
            for place in self.muscles}
        if self._encoder:
            return {**takes, 'external_torque': self.set_external_torque}
        return {**takes, 'external_force': self.set_external_force}

    def set_signal(self, message: ValveSignal, writer: Hashable = None, place: str = '') -> None:
        """Take a valve signal: efforts by name, anything not finite or unknown is ignored."""
        self.muscles[place].signal.take(message, writer, self.now_ns or 0)

    def set_external_force(self, message: Force) -> None:
        """Take the disturbance force on the load [N], for its stamp."""
        self.disturbance.take(message.stamp_ns, message.force_n, self.now_ns)

    def set_external_torque(self, message: Torque) -> None:
        """Take the disturbance torque on the limb [N m], for its stamp."""
        self.disturbance.take(message.stamp_ns, message.torque_n_m, self.now_ns)

    def step(self, count: int) -> None:
        """Advance the plant by some steps with the signals held."""
        for steps in self.disturbance.parts(count, self.now_ns):
            self.plant.step(*map(_EFFORTS, self._signals), self.disturbance.acts, steps=steps)

    def problems(self, now_ns: int) -> list[str]:
        """Return what is wrong with what it takes, a sentence each."""
        texts = [muscle.signal.problem(f'{place}valve_signal', now_ns)
                 for place, muscle in self.muscles.items()]
        return [text for text in (*texts, self.disturbance.problem(now_ns)) if text]

    def sample(self, now_ns: int) -> dict[str, Any]:
        """
        Read the sensors; return the messages by topic, relative to the namespace of the rig.

        Stamps are the time of the plant's state (at most one step before ``now_ns``)
        with the jitter of the rig's sensor settings; see ``PlantMuscle.read``. Of a joint
        ``joint_state`` carries the angle of an encoder and the torque of both tendons, which
        no sensor measures: it is for people.
        """
        now_of_plant_ns = self.now_ns
        stamp_ns = now_ns if now_of_plant_ns is None else now_of_plant_ns
        plant, messages = self.plant, {}
        if self._encoder is not None:
            messages['joint_state'] = JointAngle(
                stamp_ns, self._encoder.read(plant.angle_rad), plant.torque_n_m)
        time_s = plant.time_s
        for muscle in self.muscles.values():
            muscle.read(messages, stamp_ns, time_s)
        return messages

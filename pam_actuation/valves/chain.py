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
A valve with its driver on a simulated rig: pressure command in, signals out.

Driver and plant are the classes of the live nodes, on one clock and one bus; sensors are read
at the rate of the plant node.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pam_actuation.drivers.config import DriverConfig
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.loops.bus import Bus
from pam_actuation.loops.wiring import attach, attach_plant, signal_tick
from pam_actuation.messages import Message, Pressure, START_NS, ValveSignal
from pam_actuation.plant_loop import PlantLoop
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.response import Response
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA

STEP_S = 0.001
SENSOR_EVERY = 4                    # steps between two readings: 250 Hz
_STEP_NS = 1_000_000
_LONGEST_S = 1e6                    # of a signal held in one go: nothing is left out
# What a driver that has long followed commands does is measured, not how it begins.
_AT_ONCE = {'resume_rate_pa_per_s': 1e9}


class Record(Response):
    """
    What a chain did: a Response with the command and the valve signal that were there.

    Attributes
    ----------
    command_pa : ndarray, shape (N,)
        Wanted gauge pressure; NaN where a signal was imposed.
    signal : ndarray, shape (N, 1) or (N, 2)
        PPR voltage [V], or HSV fill and vent duty, held from row i to i + 1.

    """

    def __init__(self, outputs: FloatArray, command_pa: FloatArray, signal: FloatArray) -> None:
        super().__init__(outputs)
        self.command_pa = command_pa
        self.signal = signal

    @property
    def gauge_pa(self) -> FloatArray:
        """Return the true gauge pressure [Pa] at the ends of the steps, shape (N,)."""
        return self.true_pressure_pa[1:] - P_ATM_PA


class Bench:
    """
    A rig and what its driver is told of it; ``chain`` starts a measurement.

    Parameters
    ----------
    rig : pam_sim.rig.Rig
        With the valve and fidelity to look at.
    seed : int
        Of the sensor noise.

    Raises
    ------
    InputError
        The PWM period of on/off valves is no whole number of steps.

    """

    def __init__(self, rig: Rig, seed: int = 0) -> None:
        steps = rig.parameters['pwm_period_s'] / STEP_S
        if rig.valve == 'hsv' and abs(steps - round(steps)) > 1e-6:
            raise InputError(f'`pwm_period_s` is {steps:g} ms; the measurements need a whole '
                             'number of ms', rig.name)
        self.rig, self.seed = rig, seed
        self._config = driver_config(rig, _AT_ONCE)

    def chain(self, start_gauge_pa: float) -> 'Chain':
        """Return a new Chain that rests at a gauge pressure [Pa]."""
        return Chain(self.rig, self._config, start_gauge_pa, self.seed)


class _RecordedPlant(PlantLoop):
    """A plant on a clock that keeps the signal and the outputs of every step."""

    def __init__(self, rig: Rig, seed: int, **initial: Any) -> None:
        super().__init__(rig, seed, _LONGEST_S, **initial)
        self._rows: list[FloatArray] = [self.plant.outputs[np.newaxis]]
        self._acted: list[tuple[float, ...]] = []

    def step(self, count: int) -> None:
        """Advance the plant by some steps with the signal held."""
        signal = self.muscles[''].signal.efforts
        self._rows.append(self.plant.roll(signal, steps=count))
        self._acted += [signal] * count

    def taken(self) -> tuple[FloatArray, FloatArray]:
        """Return (outputs, signals) since the last call; outputs begin with the row before."""
        outputs, signals = np.concatenate(self._rows), np.array(self._acted, dtype=float)
        self._rows, self._acted = [self.plant.outputs[np.newaxis]], []
        return outputs, signals


class Chain:
    """One valve, its driver and the rig, from rest at a pressure on; made by a Bench."""

    def __init__(self, rig: Rig, config: DriverConfig, start_gauge_pa: float, seed: int) -> None:
        self.rig = rig
        self.driver = DriverLoop(rig.valve, config)
        start_pa = P_ATM_PA + float(start_gauge_pa)
        self._plant = _RecordedPlant(rig, seed, initial_pressure_pa=start_pa)
        self._plant.advance_to(START_NS)
        self._every = max(round(self.driver.period_s / STEP_S), 1)
        self._steps = 0
        self._bus = Bus()
        attach(self._bus, self.driver)
        self._measure = attach_plant(self._bus, self._plant)
        self._drive = signal_tick(self._bus, self.driver)
        self._tick_before(start_pa)

    def _tick_before(self, command_pa: float) -> None:
        """Call the driver one period before the start: it knows the time of a tick then."""
        before_ns = self._time_ns(-self._every)
        if self._every % SENSOR_EVERY == 0:
            readings: dict[str, Message] = {}
            self._plant.muscles[''].read(readings, before_ns, 0.0)
            for topic, message in readings.items():
                self._bus.send(topic, message, before_ns)
        self._bus.send('pressure_command', Pressure(before_ns, command_pa), before_ns)
        self._bus.deliver(before_ns)
        self.driver.tick(before_ns)

    def _time_ns(self, step: int) -> int:
        return START_NS + step * _STEP_NS

    def follow(self, command_gauge_pa: ArrayLike) -> Record:
        """
        Follow a pressure command, one value per millisecond.

        Raises
        ------
        InputError
            The driver vented: the command is nothing this rig can follow.

        """
        command = np.array(command_gauge_pa, dtype=float)
        first, end = self._steps, self._steps + len(command)
        readings, ticks = (range(first + -first % every, end, every)
                           for every in (SENSOR_EVERY, self._every))
        ticks_of_driver = [first, *ticks] if first % self._every else [*ticks]
        wanted_pa = iter((P_ATM_PA + command[np.subtract(ticks_of_driver, first)]).tolist())

        def drive(now_ns: int) -> None:
            self.driver.on_command(Pressure(now_ns, next(wanted_pa)))
            self._drive(now_ns)

        # At equal times: measure, then command and act.
        self._bus.add(self._measure, map(self._time_ns, readings))
        self._bus.add(drive, map(self._time_ns, ticks_of_driver))
        self._bus.run_until()
        outputs, signals = self._advance(len(command))
        if self.driver.safety.vents:
            raise InputError('the driver vented during the comparison; see its limits', 'rig')
        return Record(outputs, command, signals)

    def impose(self, signal: Iterable[float], duration_s: float) -> Record:
        """Hold a valve signal, past the driver, as when it has lost its power."""
        self._plant.set_signal(ValveSignal(
            self._time_ns(self._steps), self.rig.signal_names, tuple(signal)))
        outputs, signals = self._advance(round(duration_s / STEP_S))
        return Record(outputs, np.full(len(signals), np.nan), signals)

    def _advance(self, steps: int) -> tuple[FloatArray, FloatArray]:
        """Run the plant to so many steps after the last call; return what it kept."""
        self._bus.deliver(self._time_ns(self._steps + steps))
        self._steps += steps
        self._plant.advance_to(self._time_ns(self._steps))
        return self._plant.taken()

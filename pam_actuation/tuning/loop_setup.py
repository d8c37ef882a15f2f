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

"""What a closed loop gets: timing, reference, sensor noise, where rules learn, driver laws."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
import math
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.drivers import hsv_kernel, ppr
from pam_actuation.drivers.config import DriverConfig
from pam_actuation.drivers.hsv import initial_state
from pam_actuation.drivers.hsv_config import check_pulses
from pam_actuation.slow_rise import LONGEST_STEP_S
from pam_actuation.tuning.loop_parts import Driver, READINGS, RISE
from pam_sim.annotations import FloatArray
from pam_sim.declared import number_of, shown
from pam_sim.errors import InputError
from pam_sim.records import fields, zeros
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.control.compiled_controller import CompiledController
    from pam_actuation.control.modes.wrapped import WrappedLaw
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.rig import Rig

PHYSICS_S = 0.001
LATENCY_S = 0.003           # of the live nodes
_PERIOD = 'hsv.period_s'
# Noise and step of a sensor, by what it reads.
_SENSORS = {'pressure_pa': ('pressure_noise_pa', 'pressure_step_pa'),
            'contraction_m': ('contraction_noise_m', 'contraction_step_m'),
            'force_n': ('force_noise_n', 'force_step_n')}

Learns = bool | Callable[[float], bool]       # whether, or a function of the time [s]
Course = Callable[[float], float]             # of the time [s]


def steps_per_tick(rate_hz: float) -> int:
    """
    Return the number of physics steps in a controller period.

    Raises
    ------
    InputError
        It is no whole number.

    """
    rate_hz = number_of(rate_hz, 'rate_hz')
    steps = round(1.0 / (rate_hz * PHYSICS_S)) if rate_hz > 0.0 else 0
    if steps < 1 or abs(steps * PHYSICS_S * rate_hz - 1.0) > 1e-9:
        second = round(1.0 / PHYSICS_S)
        rates = [rate for rate in range(20, second + 1) if second % rate == 0]
        raise InputError(
            f'is {rate_hz:g} Hz; a rollout needs a whole number of {PHYSICS_S * 1e3:g} ms steps '
            f'in a period, such as {", ".join(map(str, rates))} Hz', 'rate_hz')
    return steps


def latency_steps(latency_s: float | None, steps: int) -> int:
    """
    Return the physics steps from a measurement to the new valve signal.

    Parameters
    ----------
    latency_s : float or None
        Latency [s]. None is that of the live nodes, or the longest that fits.
    steps : int
        Physics steps in a controller period.

    Raises
    ------
    InputError
        It is below 0, or not below one period.

    """
    period_s = steps * PHYSICS_S
    if latency_s is None:
        latency_s = min(LATENCY_S, period_s - PHYSICS_S)
    elif not 0.0 <= number_of(latency_s, 'latency_s') < period_s:
        raise InputError(
            f'is {latency_s:g} s; allowed is 0 to less than the period of the controller, '
            f'{period_s:g} s', 'latency_s')
    return min(round(latency_s / PHYSICS_S), steps - 1)


def sampled(course: Course, times_s: Sequence[float], name: str,
            lowest: float = -math.inf) -> FloatArray:
    """
    Return the values of a function of time at N times, shape (N,).

    Raises
    ------
    InputError
        It is no function, or a value is no finite number or below ``lowest``.

    """
    if not callable(course):
        raise InputError(f'is {shown(course)}; give a function of the time [s], such as '
                         f'`lambda time_s: {shown(course)}`', name)
    values = np.empty(len(times_s))
    for place, time_s in enumerate(times_s):
        value = course(time_s)
        try:
            values[place] = value
        except (TypeError, ValueError):
            values[place] = math.nan
        if not lowest <= values[place] < math.inf:
            raise InputError(f'is {shown(value)} at {time_s:g} s; a finite number'
                             + (f' from {lowest:g} on' if lowest > -math.inf else '')
                             + ' is needed', name)
    return values


def fresh_rise(slow_start: bool, rate_hz: float) -> FloatArray:
    """Return the ``RISE`` of a controller that begins; it limits nothing without slow start."""
    rise = zeros(RISE)
    if slow_start:
        start = fields(rise, RISE)
        start.active, start.allowed_pa = 1.0, P_ATM_PA
        start.period_s = min(1.0 / rate_hz, LONGEST_STEP_S)
    return rise


def first_periodic_tick(experiment: 'Experiment', rate_hz: float) -> int:
    """Return the first tick of the periodic part, of the whole where there is none."""
    cycles = experiment.cycles
    return 0 if cycles is None else int(cycles[0] * rate_hz)


def sensor_noise(rig: 'Rig', ticks: int,
                 seed: int | tuple[int, int]) -> tuple[FloatArray, FloatArray]:
    """
    Return the noise and the steps of a rig's sensors as arrays of ``READINGS``.

    One for every tick, one behind the other, and one.
    """
    sensors = dict(rig.sensors)
    names = [_SENSORS[reading] for reading in READINGS.names or ()]
    sigma = np.array([sensors.get(noise, 0.0) for noise, _ in names])
    steps = np.array([float(sensors.get(step, 0.0)) for _, step in names])
    noise = np.random.default_rng(seed).standard_normal((ticks, len(names))) * sigma
    return noise.ravel(), steps


def learning_mask(controller: 'CompiledController | WrappedLaw', learn: Learns, ticks: int,
                  rate_hz: float) -> FloatArray:
    """
    Return 1.0 at every tick in which the rules may change, else 0.0.

    ``learn``: bool, or callable of the time [s]; InputError for what is neither.
    """
    if not callable(learn) and not isinstance(learn, (bool, int, np.bool_)):
        raise InputError(f'is {shown(learn)}; give True, False, or a function of the time [s]',
                         'learn')
    may = controller.freeze_learning is False
    if callable(learn):
        return np.array([float(may and learn(k / rate_hz)) for k in range(ticks)])
    return np.full(ticks, float(may and learn))


def _rates_for(period_s: float) -> str:
    """Return the rates of controllers whose ticks fit a period of the driver."""
    second, period = round(1.0 / PHYSICS_S), round(period_s / PHYSICS_S)
    if abs(period * PHYSICS_S - period_s) > 1e-9:
        return 'none; a period of whole milliseconds has some'
    rates = [second // steps for steps in range(period, 0, -1)
             if second % steps == period % steps == 0]
    return f'{", ".join(map(str, rates))} Hz'


class DriverLaw:
    """
    A driver law at a controller's rate.

    Attribute ``hsv`` tells which law it is. A regulator is told of each command as it comes, a
    pair of valves once a period.
    """

    def __init__(self, rig: 'Rig', config: DriverConfig, rate_hz: float) -> None:
        """Take the valve of ``rig`` and what the driver knows, a ``DriverConfig``."""
        self.hsv = rig.valve == 'hsv'
        self._config = config
        self._tick_s = 1.0 / rate_hz

    def fresh(self, asked: Mapping[str, float] | None = None) -> tuple[Driver, int]:
        """
        Return (state, par, out), all new, and the ticks per step of the law.

        ``asked``: what a controller asks for, by name.

        Raises
        ------
        InputError
            The period of a pair of valves is no whole number of ticks, or too short for them.

        """
        config = DriverConfig.from_parameters(asked, self._config) if asked else self._config
        if not self.hsv:
            law = replace(config.ppr, period_s=self._tick_s)
            return (zeros(ppr.STATE), law.par(), zeros(ppr.OUTPUT)), 1
        period_s = config.hsv.period_s
        every = round(period_s / self._tick_s)
        if every < 1 or abs(every * self._tick_s - period_s) > 1e-9:
            raise InputError(
                f'the driver acts every {period_s:g} s; a rollout needs a whole number of the '
                f"controller's ticks in that, not of {self._tick_s:g} s; allowed rates are "
                f'{_rates_for(period_s)}', _PERIOD)
        check_pulses(config.hsv, 'parameter')
        return (initial_state(), config.hsv.par(), zeros(hsv_kernel.OUTPUT)), every

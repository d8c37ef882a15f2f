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
A closed loop with a plant of somebody else: another simulator, in which nothing is ours.

Controller, driver law, sensor noise and timing are those of ``ClosedLoop``. With a ``Plant`` of
the rig in place of the foreign one the numbers are the same to the bit. Every tick calls from
Python what is compiled as a whole there, so a run takes a few times as long.
"""

from collections.abc import Callable, Sequence
import math
from typing import Any, Protocol, TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from pam_actuation.control.following import FOLLOWS, LESS
from pam_actuation.drivers import hsv_kernel, hsv_model, ppr
from pam_actuation.slow_rise import SlowRise
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.loop_parts import DISTURBANCE, READINGS, WANTED
from pam_actuation.tuning.loop_setup import Course, learning_mask, Learns, PHYSICS_S
from pam_sim.annotations import FloatArray
from pam_sim.declared import shown
from pam_sim.errors import InputError
from pam_sim.records import cells, size_of
from pam_sim.rollout.simulate import STRAIN_RANGE
from pam_sim.units import HIGHEST_PA, LOWEST_PA

if TYPE_CHECKING:
    from pam_actuation.control.compiled_controller import CompiledController
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.rig import Rig

_NUMBERS = 'dt_s', 'supply_pa', 'pressure_pa', 'contraction_m', 'force_n'


class ForeignPlant(Protocol):
    """
    What a plant has to have: steps of 1 ms, and what its sensors would read without noise.

    Pressures are absolute [Pa]. The supply pressure is written where its course was given.
    """

    dt_s: float
    supply_pa: float

    @property
    def pressure_pa(self) -> float:
        """Return the pressure in the muscle [Pa]."""

    @property
    def contraction_m(self) -> float:
        """Return the contraction [m]."""

    @property
    def force_n(self) -> float:
        """Return the force at the load cell [N]."""

    def step(self, signal: Sequence[float], external_force_n: float = 0.0, *,
             steps: int = 1) -> None:
        """Advance with the valve signal held: a voltage, or fill and vent duty."""


class ForeignLoop(ClosedLoop):
    """
    A controller tracking on a plant of somebody else.

    Parameters
    ----------
    plant : callable
        Takes nothing and returns a ``ForeignPlant`` at its start; called once per run.
    rig : pam_sim.rig.Rig
        What controller and driver believe in: its valve, its sensors, its supply pressure.
    experiment : Experiment
        Domain ``contraction``.
    supply_pa : callable, optional
        Supply pressure [absolute Pa] as a function of time [s]; by default that of the plant.
    **more
        As of ``ClosedLoop``.

    Raises
    ------
    InputError
        As of ``ClosedLoop``, or a plant instead of what returns one; from ``run``, as of
        ``check_plant``, or where the plant becomes something that is not finite, or contracts
        by more than a muscle of ``rig`` can, as in mm.

    """

    def __init__(self, plant: Callable[[], ForeignPlant], rig: 'Rig', experiment: 'Experiment',
                 supply_pa: Course | None = None, **more: Any) -> None:
        super().__init__(rig, experiment, supply_pa=supply_pa, **more)
        if not callable(plant):
            raise InputError('cannot be called; give what returns a plant at its start, '
                             'such as `rig.plant`', 'plant')
        self._plant = plant
        self._own_supply = supply_pa is None
        self._remade = (plant, rig, experiment, supply_pa, more)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle what it is made of."""
        return _made, self._remade

    def run_raw(self, controller: 'CompiledController',
                learn: Learns = True) -> npt.NDArray[np.void]:
        """Return a ``LOG`` of ``rollouts`` for every tick, shape (ticks,)."""
        self.check(controller)
        from pam_actuation.tuning.rollouts import LOG
        plant = self._plant()
        check_plant(plant)
        controller.pause()
        log = np.empty(self.ticks * size_of(LOG))
        rows = log.reshape(self.ticks, size_of(LOG))
        noises = self._noise.reshape(self.ticks, size_of(READINGS)).tolist()
        wanted = self._reference.rows(controller.lead_s).reshape(
            self.ticks, size_of(WANTED)).tolist()
        disturbances = self._disturbance.view(DISTURBANCE)
        forces = disturbances['external_force_n'].tolist()
        supplies = disturbances['supply_pa'].tolist()
        learns = learning_mask(controller, learn, self.ticks, self.rate_hz).tolist()
        pressure_step, contraction_step, force_step = self._quantum.tolist()
        law, (steps, every, latency) = self._fresh_driver(controller.driver)
        drive = driver_function(law, self.hsv)
        rise = SlowRise(active=self.slow_start)
        signal: tuple[float, ...] = (0.0, 0.0) if self.hsv else (0.0,)
        for tick in range(self.ticks):
            before, supply_pa = signal, plant.supply_pa
            if not self._own_supply:
                supply_pa, plant.supply_pa = supplies[max(tick - 1, 0)], supplies[tick]
            true_pa, true_m, true_n = plant.pressure_pa, plant.contraction_m, plant.force_n
            pressure_noise, contraction_noise, force_noise = noises[tick]
            measured_pa = quantised(true_pa + pressure_noise, pressure_step)
            measured_m = quantised(true_m + contraction_noise, contraction_step)
            reference, rate, lead, lead_rate = wanted[tick]
            command_pa = rise.limited(controller.step(
                measured_m, reference, rate, lead, lead_rate, learns[tick] > 0.0,
                pressure_pa=measured_pa, force_n=quantised(true_n + force_noise, force_step),
                held_back=LESS if rise.limiting else FOLLOWS), 1.0 / self.rate_hz)
            if tick % every == 0:
                signal = drive(command_pa, measured_pa, supply_pa, measured_m)
            if latency:
                plant.step(before, forces[tick], steps=latency)
            plant.step(signal, forces[tick], steps=steps - latency)
            rows[tick] = (true_m, true_pa, true_n, command_pa, signal[0], signal[-1]
                          if self.hsv else 0.0, measured_m)
        if not np.all(np.isfinite(rows)):
            raise InputError('becomes something that is not finite', 'plant')
        found = log.view(LOG)
        low, high = (share * self.rig.muscle.length_m for share in STRAIN_RANGE)
        reached_m = found['contraction_m']
        if reached_m.min() < low or reached_m.max() > high:
            raise InputError(
                f'has contraction_m from {reached_m.min():.3g} to {reached_m.max():.3g}; a muscle '
                f'of {self.rig.muscle.length_m:g} m allows {low:g} to {high:g} m', 'plant')
        return found


def check_plant(plant: ForeignPlant) -> None:
    """
    Refuse an object that cannot stand for a plant.

    Raises
    ------
    InputError
        A reading is no number, the pressure is not absolute and in Pa, the method `step` is
        missing, or the step is another one.

    """
    for name in _NUMBERS:
        value = getattr(plant, name, None)
        try:
            float(value)    # type: ignore[arg-type]  # None is no number
        except (TypeError, ValueError):
            raise InputError(f'has {name} = {shown(value)}; a number is needed', 'plant') from None
    if not callable(getattr(plant, 'step', None)):
        raise InputError('has no method `step`; write `step(signal, external_force_n=0.0, *, '
                         'steps=1)`', 'plant')
    if not LOWEST_PA <= float(plant.pressure_pa) <= HIGHEST_PA:
        raise InputError(f'has pressure_pa = {shown(plant.pressure_pa)}; allowed is {LOWEST_PA:g} '
                         f'to {HIGHEST_PA:g}, absolute and in Pa', 'plant')
    if plant.dt_s != PHYSICS_S:
        raise InputError(f'steps by {plant.dt_s:g} s, allowed is {PHYSICS_S:g} s', 'plant')


def _made(plant: Callable[[], ForeignPlant], rig: 'Rig', experiment: 'Experiment',
          supply_pa: Course | None, more: dict[str, Any]) -> ForeignLoop:
    """Return the loop again, after its way through a pickle."""
    return ForeignLoop(plant, rig, experiment, supply_pa, **more)


def quantised(value: float, step_size: float) -> float:
    """Quantise a reading, 0 = no quantisation."""
    return round(value / step_size) * step_size if step_size > 0.0 else value


def driver_function(law: tuple[FloatArray, FloatArray, FloatArray],
                    hsv: bool) -> Callable[[float, float, float, float], tuple[float, ...]]:
    """Return the driver law as a function of command, pressure, supply and contraction."""
    state, par, out = law
    if hsv:
        seen, duties = cells(state, hsv_model.STATE), cells(out, hsv_kernel.OUTPUT)

        def pair(command_pa: float, measured_pa: float, supply_pa: float,
                 measured_m: float) -> tuple[float, ...]:
            seen.age_s[...] = 0.0
            seen.contraction_m[...] = measured_m
            seen.contraction_age_s[...] = 0.0
            hsv_kernel.hsv_step(state, par, command_pa, measured_pa, supply_pa, out)
            return duties.fill_duty.item(), duties.vent_duty.item()
        return pair
    signal = cells(out, ppr.OUTPUT).signal_v

    def regulator(command_pa: float, measured_pa: float, supply_pa: float,
                  measured_m: float) -> tuple[float, ...]:
        ppr.ppr_step(state, par, command_pa, math.nan, math.nan, out)
        return (signal.item(),)
    return regulator

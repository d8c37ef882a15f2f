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
Closed-loop rollouts in compiled code: thousands of times faster than real time.

``ClosedLoop`` fixes rig, experiment and noise once; ``run`` then puts any
controller on it. The same compiled steps as in the live nodes are used
(controller, driver law, plant), only the clock differs.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
import importlib
import math
from typing import Any, TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from pam_actuation.control.modes.tracked import CONTRACTION
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.messages import VALVE_NAMES
from pam_actuation.tuning.cost import tracking_cost
from pam_actuation.tuning.loop_checks import (
    check_controller, check_drivers, check_free, check_parts)
from pam_actuation.tuning.loop_parts import DISTURBANCE, Driver
from pam_actuation.tuning.loop_setup import (
    Course, DriverLaw, first_periodic_tick, fresh_rise, latency_steps,
    learning_mask, Learns, PHYSICS_S, sampled, sensor_noise, steps_per_tick)
from pam_actuation.tuning.sampled_reference import SampledReference
from pam_actuation.tuning.tracking_errors import Cycles, TrackingErrors
from pam_sim.annotations import FloatArray
from pam_sim.declared import check_whole
from pam_sim.errors import InputError
from pam_sim.records import fields, size_of, zeros
from pam_sim.rollout import layout
from pam_sim.rollout.kernel import refuse_terms
from pam_sim.short_repr import short_repr
from pam_sim.units import LOWEST_PA

if TYPE_CHECKING:
    from pam_actuation.control.compiled_controller import CompiledController
    from pam_actuation.drivers.config import DriverConfig
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.rig import Rig
    import pandas as pd

# The module with ``KIND_rollout``, the compiled loop of a law.
ROLLOUTS = {'sofc': 'rollouts', 'pid': 'rollouts', 'lqi': 'rollouts',
            'ilc': 'baseline_rollouts', 'mpc': 'baseline_rollouts'}


@short_repr
@dataclass
class LoopResult(TrackingErrors):
    """
    One tracked experiment, sampled at the controller's ticks.

    ``reference_m`` and ``contraction_m`` are true values (no sensor noise), so that errors
    are those of the muscle. ``cycle_s`` is (start, period, count) of the periodic part or None.
    """

    time_s: FloatArray
    reference_m: FloatArray
    contraction_m: FloatArray
    pressure_pa: FloatArray
    command_pa: FloatArray
    force_n: FloatArray
    signal: FloatArray
    cycle_s: Cycles | None = None
    controller: 'CompiledController | None' = field(default=None, repr=False)

    @property
    def error_m(self) -> FloatArray:
        """Return reference minus contraction [m]."""
        return self.reference_m - self.contraction_m

    @property
    def error(self) -> FloatArray:
        """Return reference minus contraction [m]."""
        return self.error_m

    def rmse_m(self, start_s: float = 0.0, end_s: float = math.inf) -> float:
        """Return the root mean square error [m] within a span of time."""
        return self.rmse(start_s, end_s)

    def cycle_rmse_m(self) -> FloatArray:
        """Return the root mean square error [m] of every cycle, shape (cycles,)."""
        return self.cycle_rmse()

    def to_dataframe(self) -> 'pd.DataFrame':
        """Return all signals as one pandas table, a row for each tick, in SI."""
        import pandas as pd     # takes a second to load
        names = VALVE_NAMES['hsv' if self.signal.shape[1] == 2 else 'ppr']
        return pd.DataFrame({
            **{name: getattr(self, name) for name in (
                'time_s', 'reference_m', 'contraction_m', 'pressure_pa', 'command_pa', 'force_n')},
            **dict(zip(names, self.signal.T))})


class MuscleLoop:
    """
    A rig, an experiment and one realisation of the sensor noise.

    Parameters
    ----------
    rig : pam_sim.rig.Rig
        Its ``valve`` decides on the driver law.
    experiment : Experiment
        Domain ``contraction``.
    seed : int
        Seed of the sensor noise.
    rate_hz : float
        Controller rate; a whole number of physics steps per period.
    latency_s : float, optional
        From the measurement to the new valve signal, in whole milliseconds below one period. By
        default 0.003 as of the live nodes (transport and scheduling), or the longest that fits.
    external_force_n : callable or None
        Force [N] against contraction as a function of time [s]; by default the disturbance of
        the experiment.
    supply_pa : callable or None
        Supply pressure [absolute Pa] as a function of time [s]; that of the rig by default.
    driver : DriverConfig, optional
        What the valve driver knows; by default the data sheet of ``rig``. Give that of the
        nominal rig where ``rig`` differs from what its model file says.
    preview_s : float
        How far ahead the controller is told the reference; without limit by default.
    slow_start : bool
        Whether commands rise slowly from the atmosphere at the start, as those of a real run;
        by default the first one acts at once.

    Raises
    ------
    InputError
        The experiment is not in contraction, the load does not move freely, the rate does not fit
        the physics step, or a seed, latency, preview, force or supply pressure is not what is
        allowed.

    """

    DOMAIN: str

    def __init__(self, rig: 'Rig', experiment: 'Experiment', seed: int = 0, rate_hz: float = 200.0,
                 latency_s: float | None = None, external_force_n: Course | None = None,
                 driver: 'DriverConfig | None' = None, supply_pa: Course | None = None,
                 preview_s: float = math.inf, slow_start: bool = False) -> None:
        self._arguments = (
            rig, experiment, seed, rate_hz, latency_s, external_force_n, driver, supply_pa,
            preview_s, slow_start)
        from pam_sim.rig import Rig
        check_parts(rig, Rig, experiment, self.DOMAIN)
        if driver is not None:
            check_drivers([driver], 1, 'driver')
        steps = steps_per_tick(rate_hz)
        check_whole(seed, 0, 'seed')
        self.rig = rig
        self.rate_hz = rate_hz
        self.experiment = experiment
        self.hsv = rig.valve == 'hsv'
        self.slow_start = slow_start
        self._state, self._par = rig.pack()
        refuse_terms(self._par)
        dt_s = fields(self._par, layout.PARAMETERS).dt_s
        if dt_s != PHYSICS_S:
            raise InputError(f'the rig is packed for {dt_s} s, not {PHYSICS_S} s')
        self._reference = SampledReference(experiment, rate_hz, preview_s)
        self.ticks = self._reference.ticks
        self._noise, self._quantum = sensor_noise(rig, self.ticks, seed)
        self._disturbance = np.zeros(self.ticks * size_of(DISTURBANCE))
        disturbances = self._disturbance.view(DISTURBANCE)
        disturbances['supply_pa'] = rig.parameters['supply_pa']
        if external_force_n is None and experiment.disturbance:
            external_force_n = experiment.external_force_n
        for name, course, lowest in (('external_force_n', external_force_n, -math.inf),
                                     ('supply_pa', supply_pa, LOWEST_PA)):
            if course is not None:
                disturbances[name] = sampled(
                    course, [k * (1.0 / rate_hz) for k in range(self.ticks)], name, lowest)
        fields(self._state, layout.STATE).supply_pa = disturbances['supply_pa'][0]
        self._driver = DriverLaw(rig, driver or driver_config(rig), rate_hz)
        self._steps = steps, latency_steps(latency_s, steps)

    def __repr__(self) -> str:
        """Return rig, experiment and rate in one line."""
        return (f'{type(self).__name__}({self.rig.name!r}, {self.rig.valve}, '
                f'{self.experiment!r}, {self.rate_hz:g} Hz)')

    @property
    def reference_m(self) -> FloatArray:
        """Wanted contraction [m] at every tick."""
        return self._reference.values

    @property
    def start_tick(self) -> int:
        """First tick of the periodic part, of the whole where there is none."""
        return first_periodic_tick(self.experiment, self.rate_hz)

    def _fresh_driver(
            self, asked: Mapping[str, float] | None) -> tuple[Driver, tuple[int, int, int]]:
        """Return the driver law at its start and ``timing``, as ``rollouts.sense`` has them."""
        driver, every = self._driver.fresh(asked)
        steps, latency = self._steps
        return driver, (steps, every, latency)

    def _fresh_plant(
            self,
            contraction_m: float = 0.0) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return new state, par, inp, out of the plant at its start."""
        from pam_sim.rollout.kernel import look
        inputs = zeros(layout.INPUT)
        fields(inputs, layout.INPUT).contraction_m = contraction_m
        plant = (self._state.copy(), self._par.copy(), inputs, zeros(layout.OUTPUT))
        look(*plant)
        return plant


class ClosedLoop(MuscleLoop):
    """A muscle with its load, tracking a wanted contraction; see ``MuscleLoop``."""

    DOMAIN = 'contraction'

    def __init__(self, rig: 'Rig', *arguments: Any, **named: Any) -> None:
        super().__init__(rig, *arguments, **named)
        check_free(rig)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle what it is made of: a cluster gets kilobytes, not the arrays."""
        return ClosedLoop, self._arguments

    def run(self, controller: 'CompiledController', learn: Learns = True) -> LoopResult:
        """
        Track the experiment; the controller's rules change in place.

        Parameters
        ----------
        controller : CompiledController
            Of any law in ``ROLLOUTS``.
            Starts as after ``pause``.
        learn : bool or callable
            Whether the rules may change, possibly as a function of time [s].

        Returns
        -------
        LoopResult

        Raises
        ------
        InputError
            The controller runs at another rate, tracks something else, or is made for the other
            valve.

        """
        log = self.run_raw(controller, learn)
        n = self.ticks
        return LoopResult(
            np.arange(n) / self.rate_hz, self.reference_m.copy(), log['contraction_m'],
            log['pressure_pa'], log['command_pa'], log['force_n'],
            np.column_stack([log[name] for name in ('signal_0', 'signal_1')[:1 + self.hsv]]),
            self.experiment.cycles, controller)

    def check(self, controller: 'CompiledController') -> None:
        """Raise InputError for a controller that cannot run here, see ``run``."""
        check_controller(controller, CONTRACTION, self.rig.valve, self.rate_hz)

    def tracked(self, controller: 'CompiledController'
                ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return time [s], reference and error [mm] of tracking the experiment."""
        run = self.run(controller)
        return run.time_s, run.reference_m * 1e3, run.error_m * 1e3

    def cost(self, controller: 'CompiledController') -> float:
        """Return the cost [mm] of tracking the experiment; the rules change in place."""
        contraction_m = self.run_raw(controller)['contraction_m']
        return tracking_cost((self.reference_m - contraction_m) * 1e3, self.start_tick)

    def run_raw(self, controller: 'CompiledController',
                learn: Learns = True) -> npt.NDArray[np.void]:
        """Return a ``LOG`` of ``rollouts`` for every tick, shape (ticks,)."""
        self.check(controller)
        from pam_actuation.tuning.rollouts import LOG       # brings the compiler with it
        controller.pause()
        log = np.empty(self.ticks * size_of(LOG))
        _rollout_of(controller.kind)(
            self.ticks, controller.compiled_arguments(), self._fresh_plant(), self.hsv,
            *self._fresh_driver(controller.driver),
            self._reference.rows(controller.lead_s), self._noise, self._quantum,
            self._disturbance, learning_mask(controller, learn, self.ticks, self.rate_hz),
            fresh_rise(self.slow_start, self.rate_hz), controller.input_array, log)
        return log.view(LOG)


def _rollout_of(kind: str) -> Callable[..., None]:
    """
    Return the compiled loop of a law, whose module is imported with the first of its kind.

    Raises
    ------
    InputError
        There is none for this law.

    """
    if kind not in ROLLOUTS:
        raise InputError(f'there is no compiled loop of a {kind} controller; there are those of '
                         f'{", ".join(ROLLOUTS)}', 'controller')
    module = importlib.import_module(f'pam_actuation.tuning.{ROLLOUTS[kind]}')
    rollout: Callable[..., None] = getattr(module, f'{kind}_rollout')
    return rollout

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

from dataclasses import dataclass, field, replace
import functools
import hashlib
import math
from pathlib import Path

import numpy as np
from pam_actuation.control import compiled_entry, pid
from pam_actuation.control.sofc import step as sofc_step_module
from pam_actuation.drivers import hsv_kernel, ppr
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.hsv import initial_state
from pam_sim.errors import InputError
from pam_sim.rollout import layout
from pam_sim.rollout.generate import kernel_hash, load_cached_module

PHYSICS_S = 0.001
_MAX_LEAD_S = 0.5


@functools.cache
def compiled_rollouts():
    """Return the module with ``sofc_rollout`` and ``pid_rollout``, compiled for this kernel."""
    source = (Path(__file__).parent / 'rollout_template.py').read_text(encoding='utf-8')
    key = hashlib.sha256(source.encode())
    key.update(kernel_hash().encode())
    for names in (sofc_step_module.SOURCES, pid.SOURCES):
        key.update(str(compiled_entry.source_key(*names)).encode())
    for module in (hsv_kernel, ppr):
        key.update(Path(module.__file__).read_bytes())
    return load_cached_module('pam_closed_loop', source, key.hexdigest()[:12])


@dataclass
class LoopResult:
    """
    One tracked experiment, sampled at the controller's ticks.

    ``reference_m`` and ``contraction_m`` are true values (no sensor noise), so that errors
    are those of the muscle. ``cycle_s`` is (start, period, count) of the periodic part or None.
    """

    time_s: np.ndarray
    reference_m: np.ndarray
    contraction_m: np.ndarray
    pressure_pa: np.ndarray
    command_pa: np.ndarray
    force_n: np.ndarray
    signal: np.ndarray
    cycle_s: tuple = None
    controller: object = field(default=None, repr=False)

    @property
    def error_m(self):
        """Reference minus contraction [m]."""
        return self.reference_m - self.contraction_m

    def rmse_m(self, start_s=0.0, end_s=math.inf):
        """Return the root mean square error [m] within a span of time."""
        chosen = (self.time_s >= start_s) & (self.time_s < end_s)
        if not chosen.any():
            raise InputError(f'no samples between {start_s} and {end_s} s')
        return float(np.sqrt(np.mean(self.error_m[chosen] ** 2)))

    def cycle_rmse_m(self):
        """Return the root mean square error [m] of every cycle, shape (cycles,)."""
        if self.cycle_s is None:
            raise InputError('the experiment has no periodic part')
        start_s, period_s, count = self.cycle_s
        return np.array([
            self.rmse_m(start_s + k * period_s, start_s + (k + 1) * period_s)
            for k in range(count)])


class ClosedLoop:
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
    latency_s : float
        From the measurement to the new valve signal, below one period (transport and
        scheduling of the live nodes).
    external_force_n : callable or None
        Force [N] against contraction as a function of time [s].
    supply_pa : callable or None
        Supply pressure [absolute Pa] as a function of time [s]; that of the rig by default.
    driver : DriverConfig, optional
        What the valve driver knows; by default the data sheet of ``rig``. Give that of the
        nominal rig where ``rig`` differs from what its model file says.

    Raises
    ------
    InputError
        The experiment is not in contraction, or the rate does not fit the physics step.

    """

    def __init__(self, rig, experiment, seed=0, rate_hz=200.0, latency_s=0.003,
                 external_force_n=None, driver=None, supply_pa=None):
        if experiment.domain != 'contraction':
            raise InputError(
                f'experiment {experiment.name} is in {experiment.domain}; only contraction can '
                'be tracked')
        steps = round(1.0 / (rate_hz * PHYSICS_S))
        if steps < 1 or abs(steps * PHYSICS_S * rate_hz - 1.0) > 1e-9:
            raise InputError(
                f'{rate_hz:g} Hz is no whole number of {PHYSICS_S * 1e3:g} ms steps per period')
        self.rig = rig
        self.rate_hz = rate_hz
        self.experiment = experiment
        self.hsv = rig.valve == 'hsv'
        self._state, self._par = rig.pack()
        if self._par[layout.PAR_DT] != PHYSICS_S:
            raise InputError(
                f'the rig is packed for {self._par[layout.PAR_DT]} s, not {PHYSICS_S} s')
        period_s = 1.0 / rate_hz
        self.ticks = int(round(experiment.duration_s * rate_hz))
        ahead = int(math.ceil(_MAX_LEAD_S * rate_hz)) + 2
        wanted = [experiment.at(k * period_s) for k in range(self.ticks + ahead)]
        self._position = np.array([value for value, _ in wanted], dtype=float)
        self._rate = np.array([rate for _, rate in wanted], dtype=float)
        sensors = dict(rig.sensors)
        sigma = np.array([sensors.get(name, 0.0) for name in (
            'pressure_noise_pa', 'contraction_noise_m', 'force_noise_n')])
        self._noise = np.random.default_rng(seed).standard_normal((self.ticks, 3)) * sigma
        self._quantum = np.array([float(sensors.get(name, 0.0)) for name in (
            'pressure_step_pa', 'contraction_step_m', 'force_step_n')])
        self._disturbance = np.zeros((self.ticks, 2))
        self._disturbance[:, 1] = rig.parameters['supply_pa']
        for column, course in enumerate((external_force_n, supply_pa)):
            if course is not None:
                self._disturbance[:, column] = [course(k * period_s) for k in range(self.ticks)]
        driver = driver if driver is not None else driver_config(rig)
        self._hsv_config = driver.hsv
        self._ppr_config = replace(driver.ppr, period_s=period_s)
        driver_period = driver.hsv.period_s if self.hsv else period_s
        latency = min(int(round(latency_s / PHYSICS_S)), steps - 1)
        self._timing = (steps, max(1, round(driver_period * rate_hz)), latency)

    @property
    def reference_m(self):
        """Wanted contraction [m] at every tick."""
        return self._position[:self.ticks]

    @property
    def start_tick(self):
        """First tick of the periodic part, of the whole where there is none."""
        cycles = self.experiment.cycles
        return 0 if cycles is None else int(cycles[0] * self.rate_hz)

    def _driver(self):
        """Return fresh state, par, out of the driver law."""
        if self.hsv:
            return initial_state(), self._hsv_config.par(), np.zeros(hsv_kernel.OUT_SIZE)
        return np.zeros(ppr.PPR_STATE_SIZE), self._ppr_config.par(), np.zeros(ppr.PPR_OUT_SIZE)

    def run(self, controller, learn=True):
        """
        Track the experiment; the controller's rules change in place.

        Parameters
        ----------
        controller : SelfOrganizingFuzzyController or PidController
            Starts as after ``pause``.
        learn : bool or callable
            Whether the rules may change, possibly as a function of time [s].

        Returns
        -------
        LoopResult

        Raises
        ------
        InputError
            The controller runs at another rate.

        """
        if controller.rate_hz != self.rate_hz:
            raise InputError(
                f'the controller runs at {controller.rate_hz:g} Hz, this loop at '
                f'{self.rate_hz:g} Hz')
        log = self.run_raw(controller, learn)
        n = self.ticks
        return LoopResult(
            np.arange(n) / self.rate_hz, self._position[:n], log[:, 0], log[:, 1], log[:, 3],
            log[:, 2], log[:, 4:6] if self.hsv else log[:, 4:5], self.experiment.cycles,
            controller)

    def run_raw(self, controller, learn=True):
        """Return the log (ticks, LOG_SIZE) of ``rollout_template`` for a controller."""
        module = compiled_rollouts()
        controller.pause()
        may = controller.freeze_learning is False
        if callable(learn):
            mask = np.array([float(may and learn(k / self.rate_hz)) for k in range(self.ticks)])
        else:
            mask = np.full(self.ticks, float(may and learn))
        state = self._state.copy()
        plant_inp, plant_out = np.zeros(layout.INP_SIZE), np.zeros(layout.OUT_SIZE)
        from pam_sim.rollout.kernel import look
        look(state, self._par, plant_inp, plant_out)
        log = np.empty((self.ticks, module.LOG_SIZE))
        rollout = module.sofc_rollout if controller.kind == 'sofc' else module.pid_rollout
        rollout(
            (state, self._par.copy(), plant_inp, plant_out), self.hsv, self._driver(), self._timing,
            controller.lead_s * self.rate_hz, (self._position, self._rate), self._noise,
            self._quantum, self._disturbance, mask, controller.compiled_arguments(), log)
        return log

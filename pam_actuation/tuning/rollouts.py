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
The whole closed loop as compiled code: controller, driver law, valve, muscle, load.

Timing of one controller tick: measure, controller, driver (every
``driver_every`` ticks), then the physics steps of one period; the new valve
signal arrives after ``latency_steps`` of them.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from pam_actuation.control.inputs import INPUT
from pam_actuation.control.lqi import lqi_step
from pam_actuation.control.pid import pid_step
from pam_actuation.control.sofc.step import sofc_step
from pam_actuation.tuning.loop_parts import (
    DISTURBANCE, drive, Driver, Plant, read, READINGS, Rows, WANTED)
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled, entry_point, source_key
from pam_sim.records import part, record
from pam_sim.rollout import layout
from pam_sim.rollout.kernel import step

# What is kept of a tick.
LOG = record(
    'contraction_m',                  # true, at the tick
    'pressure_pa',                    # absolute, true
    'force_n',
    'command_pa',                     # absolute
    'signal_0',                       # V or fill duty
    'signal_1',                       # vent duty
    'measured_m',
)


@compiled
def sense(tick: int, plant_out: np.record, noise: np.record, quantum: np.record,
          wanted: np.record, learn: FloatArray, inp: np.record, log: np.record) -> None:
    """Fill the inputs of the controller and the measured part of the log."""
    inp.contraction_m = read(
        plant_out.contraction_m + noise.contraction_m, quantum.contraction_m)
    inp.pressure_pa = read(plant_out.pressure_pa + noise.pressure_pa,
                           quantum.pressure_pa)
    inp.force_n = read(plant_out.force_n + noise.force_n, quantum.force_n)
    inp.reference_m = wanted.reference
    inp.reference_rate_m_per_s = wanted.rate
    inp.lead_reference_m = wanted.lead
    inp.lead_rate_m_per_s = wanted.lead_rate
    inp.learning = learn[tick]
    inp.elapsed_s = np.nan
    log.contraction_m = plant_out.true_contraction_m
    log.pressure_pa = plant_out.true_pressure_pa
    log.force_n = plant_out.true_force_n
    log.measured_m = inp.contraction_m


@compiled
def actuate(tick: int, command_pa: float, measured_pa: float, hsv: bool, driver: Driver,
            driver_every: int, steps: int, latency_steps: int, disturbances: Rows,
            plant: Plant, log: np.record) -> None:
    """Run the driver law where it is due and the physics of one controller period."""
    plant_state, plant_par, plant_inp, plant_out = plant
    acting = part(plant_inp, 0, layout.INPUT)
    signal_0, signal_1 = acting.signal_0, acting.signal_1
    if tick % driver_every == 0:
        supply_pa = disturbances[max(tick - 1, 0)].supply_pa
        signal_0, signal_1 = drive(
            driver, hsv, command_pa, measured_pa, supply_pa, log.measured_m)
    acting.external_force_n = disturbances[tick].external_force_n
    part(plant_par, 0, layout.PARAMETERS).supply_pa = disturbances[tick].supply_pa
    for j in range(steps):
        if j == latency_steps:
            acting.signal_0 = signal_0
            acting.signal_1 = signal_1
        step(plant_state, plant_par, plant_inp, plant_out)
    log.command_pa = command_pa
    log.signal_0 = signal_0
    log.signal_1 = signal_1


def _entries(key: int) -> tuple[Callable[..., None], ...]:
    """Return the rollouts as units of compiled code, stored under ``key``."""
    @entry_point
    def sofc_rollout(
            plant: Plant, hsv: bool, driver: Driver, timing: tuple[int, int, int],
            reference: FloatArray, noise: FloatArray, quantum: FloatArray,
            disturbance: FloatArray, learn: FloatArray, controller: Any, inputs: FloatArray,
            log: FloatArray) -> None:
        """
        Track a reference with the self-organizing controller; its rules change in place.

        Parameters
        ----------
        plant : tuple
            state, par, inp, out of the kernel; ``out`` holds the start.
        hsv : bool
            Which driver law is used.
        driver : tuple
            state, par, out of the driver law.
        timing : tuple of int
            Physics steps per tick, ticks per driver step, latency in physics steps.
        reference : float64[:]
            N ``WANTED`` in m and m/s.
        noise, quantum : float64[:]
            N ``READINGS`` of sensor noise, one behind the other, and those of the sensors' steps.
        disturbance : float64[:]
            N ``DISTURBANCE``.
        learn : float64[:]
            1 where the rules may change (N).
        controller, inputs : tuple, float64[:]
            Arguments of ``sofc_step``; the one that holds its inputs.
        log : float64[:]
            N ``LOG``, written.

        """
        if key < 0:         # never; makes the key part of what is stored
            return
        _, _, _, plant_out = plant
        seen = part(plant_out, 0, layout.OUTPUT)
        steps, driver_every, latency_steps = timing
        wanted, noises = reference.view(WANTED), noise.view(READINGS)
        disturbances = disturbance.view(DISTURBANCE)
        inp, steps_of, log_rows = part(inputs, 0, INPUT), part(quantum, 0, READINGS), log.view(LOG)
        for tick in range(log_rows.shape[0]):
            sense(tick, seen, noises[tick], steps_of, wanted[tick], learn, inp, log_rows[tick])
            command_pa = sofc_step(*controller)
            actuate(tick, command_pa, inp.pressure_pa, hsv, driver, driver_every, steps,
                    latency_steps, disturbances, plant, log_rows[tick])

    @entry_point
    def pid_rollout(
            plant: Plant, hsv: bool, driver: Driver, timing: tuple[int, int, int],
            reference: FloatArray, noise: FloatArray, quantum: FloatArray,
            disturbance: FloatArray, learn: FloatArray, controller: Any, inputs: FloatArray,
            log: FloatArray) -> None:
        """Track a reference with the PID; arguments as ``sofc_rollout``, of ``pid_step``."""
        if key < 0:
            return
        _, _, _, plant_out = plant
        seen = part(plant_out, 0, layout.OUTPUT)
        steps, driver_every, latency_steps = timing
        wanted, noises = reference.view(WANTED), noise.view(READINGS)
        disturbances = disturbance.view(DISTURBANCE)
        inp, steps_of, log_rows = part(inputs, 0, INPUT), part(quantum, 0, READINGS), log.view(LOG)
        for tick in range(log_rows.shape[0]):
            sense(tick, seen, noises[tick], steps_of, wanted[tick], learn, inp, log_rows[tick])
            command_pa = pid_step(*controller)
            actuate(tick, command_pa, inp.pressure_pa, hsv, driver, driver_every, steps,
                    latency_steps, disturbances, plant, log_rows[tick])

    @entry_point
    def lqi_rollout(
            plant: Plant, hsv: bool, driver: Driver, timing: tuple[int, int, int],
            reference: FloatArray, noise: FloatArray, quantum: FloatArray,
            disturbance: FloatArray, learn: FloatArray, controller: Any, inputs: FloatArray,
            log: FloatArray) -> None:
        """Track a reference with the LQI; arguments as ``sofc_rollout``, of ``lqi_step``."""
        if key < 0:
            return
        _, _, _, plant_out = plant
        seen = part(plant_out, 0, layout.OUTPUT)
        steps, driver_every, latency_steps = timing
        wanted, noises = reference.view(WANTED), noise.view(READINGS)
        disturbances = disturbance.view(DISTURBANCE)
        inp, steps_of, log_rows = part(inputs, 0, INPUT), part(quantum, 0, READINGS), log.view(LOG)
        for tick in range(log_rows.shape[0]):
            sense(tick, seen, noises[tick], steps_of, wanted[tick], learn, inp, log_rows[tick])
            command_pa = lqi_step(*controller)
            actuate(tick, command_pa, inp.pressure_pa, hsv, driver, driver_every, steps,
                    latency_steps, disturbances, plant, log_rows[tick])

    return sofc_rollout, pid_rollout, lqi_rollout


sofc_rollout, pid_rollout, lqi_rollout = _entries(source_key(
    sense, actuate, sofc_step, pid_step, lqi_step))

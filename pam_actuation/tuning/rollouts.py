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
    DISTURBANCE, drive, Driver, Plant, read_muscle, READINGS, RISE, risen, WANTED)
from pam_sim.annotations import FloatArray
from pam_sim.compiled import entry_point, inlined, source_key
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


@inlined
def sense(tick: int, plant: Plant, hsv: bool, driver: Driver, timing: tuple[int, int, int],
          reference: FloatArray, noise: FloatArray, quantum: FloatArray, disturbance: FloatArray,
          learn: FloatArray, rise: FloatArray, inputs: FloatArray, log: FloatArray) -> None:
    """
    Fill the inputs of the controller and the measured part of the log.

    Parameters
    ----------
    tick : int
        Which one.
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
    rise : float64[:]
        ``RISE`` of the commands, written by ``actuate``.
    inputs : float64[:]
        Inputs of the law (``inputs.INPUT``), written.
    log : float64[:]
        N ``LOG``, written.

    """
    _, _, _, plant_out = plant
    seen, off = part(plant_out, 0, layout.OUTPUT), noise.view(READINGS)[tick]
    steps_of, wanted = part(quantum, 0, READINGS), reference.view(WANTED)[tick]
    inp, row = part(inputs, 0, INPUT), log.view(LOG)[tick]
    read_muscle(seen, off, steps_of, inp)
    inp.reference_m = wanted.reference
    inp.reference_rate_m_per_s = wanted.rate
    inp.lead_reference_m = wanted.lead
    inp.lead_rate_m_per_s = wanted.lead_rate
    inp.learning = learn[tick]
    inp.elapsed_s = np.nan
    inp.held_back = part(rise, 0, RISE).limiting        # LESS
    row.contraction_m = seen.true_contraction_m
    row.pressure_pa = seen.true_pressure_pa
    row.force_n = seen.true_force_n
    row.measured_m = inp.contraction_m


@inlined
def actuate(tick: int, command_pa: float, plant: Plant, hsv: bool, driver: Driver,
            timing: tuple[int, int, int], reference: FloatArray, noise: FloatArray,
            quantum: FloatArray, disturbance: FloatArray, learn: FloatArray, rise: FloatArray,
            inputs: FloatArray, log: FloatArray) -> None:
    """Run the driver law where it is due and the physics of a period; others as of ``sense``."""
    plant_state, plant_par, plant_inp, plant_out = plant
    steps, driver_every, latency_steps = timing
    disturbances, row = disturbance.view(DISTURBANCE), log.view(LOG)[tick]
    acting, seen = part(plant_inp, 0, layout.INPUT), part(plant_out, 0, layout.OUTPUT)
    command_pa = risen(part(rise, 0, RISE), command_pa)
    signal_0, signal_1 = acting.signal_0, acting.signal_1
    if tick % driver_every == 0:
        signal_0, signal_1 = drive(
            driver, hsv, command_pa, part(inputs, 0, INPUT).pressure_pa, seen.supply_pa,
            row.measured_m)
    acting.external_force_n = disturbances[tick].external_force_n
    part(plant_par, 0, layout.PARAMETERS).supply_pa = disturbances[tick].supply_pa
    for j in range(steps):
        if j == latency_steps:
            acting.signal_0 = signal_0
            acting.signal_1 = signal_1
        step(plant_state, plant_par, plant_inp, plant_out)
    row.command_pa = command_pa
    row.signal_0 = signal_0
    row.signal_1 = signal_1


def _entries(key: int) -> tuple[Callable[..., None], ...]:
    """Return the rollouts as units of compiled code, stored under ``key``."""
    @entry_point
    def sofc_rollout(ticks: int, controller: Any, *loop: Any) -> None:
        """
        Track a reference with the self-organizing controller; its rules change in place.

        ``controller``: arguments of ``sofc_step``; ``loop``: those of ``sense`` from ``plant`` on.
        """
        if key >= 0:        # always; makes the key part of what is stored
            for tick in range(ticks):
                sense(tick, *loop)
                actuate(tick, sofc_step(*controller), *loop)

    @entry_point
    def pid_rollout(ticks: int, controller: Any, *loop: Any) -> None:
        """Track a reference with the PID; arguments as ``sofc_rollout``, of ``pid_step``."""
        if key >= 0:
            for tick in range(ticks):
                sense(tick, *loop)
                actuate(tick, pid_step(*controller), *loop)

    @entry_point
    def lqi_rollout(ticks: int, controller: Any, *loop: Any) -> None:
        """Track a reference with the LQI; arguments as ``sofc_rollout``, of ``lqi_step``."""
        if key >= 0:
            for tick in range(ticks):
                sense(tick, *loop)
                actuate(tick, lqi_step(*controller), *loop)

    return sofc_rollout, pid_rollout, lqi_rollout


sofc_rollout, pid_rollout, lqi_rollout = _entries(source_key(
    sense, actuate, sofc_step, pid_step, lqi_step))

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
The closed loop of force mode as compiled code.

Timing of a tick as in ``rollouts``.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from pam_actuation.control.modes.force import FORCE_INPUT, force_inputs
from pam_actuation.control.sofc.step import sofc_step
from pam_actuation.tuning.loop_parts import (
    drive, Driver, look_up, Plant, read_muscle, READINGS, RISE, risen, WANTED)
from pam_sim.annotations import FloatArray
from pam_sim.compiled import entry_point, inlined, source_key
from pam_sim.records import part, record
from pam_sim.rollout import layout
from pam_sim.rollout.kernel import step

# What is kept of a tick; pressures absolute, what is measured true and at the tick.
FORCE_LOG = record('force_n', 'contraction_m', 'pressure_pa', 'command_pa')


@inlined
def sense(tick: int, plant: Plant, hsv: bool, driver: Driver, timing: tuple[int, int, int],
          reference: FloatArray, noise: FloatArray, quantum: FloatArray, way_m: FloatArray,
          learn: FloatArray, rise: FloatArray, raw: FloatArray, log: FloatArray) -> None:
    """
    Fill the inputs in newtons and the measured part of the log.

    Parameters
    ----------
    tick, plant, hsv, driver, timing, reference, noise, quantum, learn, rise
        As of ``rollouts.sense``, the reference in N and N/s.
    way_m : float64[:]
        Contraction of the driven or isometric load at every tick and at the end (N + 1); linear
        in between.
    raw : float64[:]
        Array of ``FORCE_INPUT``, written.
    log : float64[:]
        N ``FORCE_LOG``, written.

    """
    _, _, _, plant_out = plant
    seen, off = part(plant_out, 0, layout.OUTPUT), noise.view(READINGS)[tick]
    steps_of, wanted = part(quantum, 0, READINGS), reference.view(WANTED)[tick]
    inp, row = part(raw, 0, FORCE_INPUT), log.view(FORCE_LOG)[tick]
    read_muscle(seen, off, steps_of, inp)
    inp.reference_n = wanted.reference
    inp.reference_rate_n_per_s = wanted.rate
    inp.lead_reference_n = wanted.lead
    inp.lead_rate_n_per_s = wanted.lead_rate
    inp.learning = learn[tick]
    inp.elapsed_s = np.nan
    inp.held_back = part(rise, 0, RISE).limiting
    row.force_n = seen.true_force_n
    row.contraction_m = seen.true_contraction_m
    row.pressure_pa = seen.true_pressure_pa


@inlined
def actuate(tick: int, command_pa: float, plant: Plant, hsv: bool, driver: Driver,
            timing: tuple[int, int, int], reference: FloatArray, noise: FloatArray,
            quantum: FloatArray, way_m: FloatArray, learn: FloatArray, rise: FloatArray,
            raw: FloatArray, log: FloatArray) -> None:
    """Run the driver law where it is due and the physics of a period; others as of ``sense``."""
    plant_state, plant_par, plant_inp, plant_out = plant
    steps, driver_every, latency_steps = timing
    acting, inp = part(plant_inp, 0, layout.INPUT), part(raw, 0, FORCE_INPUT)
    command_pa = risen(part(rise, 0, RISE), command_pa)
    signal_0, signal_1 = acting.signal_0, acting.signal_1
    if tick % driver_every == 0:
        signal_0, signal_1 = drive(
            driver, hsv, command_pa, inp.pressure_pa,
            part(plant_out, 0, layout.OUTPUT).supply_pa, inp.contraction_m)
    for j in range(steps):
        if j == latency_steps:
            acting.signal_0 = signal_0
            acting.signal_1 = signal_1
        acting.contraction_m = look_up(way_m, tick + (j + 1.0) / steps)
        step(plant_state, plant_par, plant_inp, plant_out)
    log.view(FORCE_LOG)[tick].command_pa = command_pa


def _entry(key: int) -> Callable[..., None]:
    """Return the rollout as a unit of compiled code, stored under ``key``."""
    @entry_point
    def force_rollout(ticks: int, mode: Any, law: Any, *loop: Any) -> None:
        """
        Track a force; the rules of the law change in place.

        ``mode``: arguments of ``force_inputs``; ``law``: those of ``sofc_step``; ``loop``: those
        of ``sense`` from ``plant`` on.
        """
        if key >= 0:        # always; makes the key part of what is stored
            for tick in range(ticks):
                sense(tick, *loop)
                force_inputs(*mode)
                actuate(tick, sofc_step(*law), *loop)

    return force_rollout


force_rollout = _entry(source_key(sense, actuate, force_inputs, sofc_step))

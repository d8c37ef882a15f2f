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
Closed loops of force mode and joint mode as compiled code.

Timing of a tick as in ``rollouts``.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from pam_actuation.control.following import FOLLOWS, UNKNOWN
from pam_actuation.control.modes.force import FORCE_INPUT, force_inputs
from pam_actuation.control.modes.joint import (
    COMMANDS, JOINT_INPUT, joint_inputs, joint_outputs)
from pam_actuation.control.sofc.step import sofc_step
from pam_actuation.tuning.loop_parts import (
    drive, Driver, JOINT_READINGS, look_up, Plant, read, READINGS, RISE, risen, WANTED)
from pam_sim.annotations import FloatArray
from pam_sim.compiled import allocating_entry_point, source_key
from pam_sim.joint import layout as joint_layout
from pam_sim.joint.kernel import joint_step
from pam_sim.records import part, record, size_of
from pam_sim.rollout import layout
from pam_sim.rollout.kernel import step

# What is kept of a tick; pressures absolute, what is measured true and at the tick.
FORCE_LOG = record('force_n', 'contraction_m', 'pressure_pa', 'command_pa')
JOINT_LOG = record(
    'angle_rad', 'flexor_pressure_pa', 'extensor_pressure_pa', 'flexor_command_pa',
    'extensor_command_pa', 'flexor_force_n', 'extensor_force_n')
_FORCE_INPUT_SIZE, _JOINT_INPUT_SIZE = size_of(FORCE_INPUT), size_of(JOINT_INPUT)
_COMMANDS_SIZE = size_of(COMMANDS)


def _entries(key: int) -> tuple[Callable[..., None], ...]:
    """Return the rollouts as units of compiled code, stored under ``key``."""
    @allocating_entry_point
    def force_rollout(
            plant: Plant, hsv: bool, driver: Driver, timing: tuple[int, int, int],
            reference: FloatArray, noise: FloatArray, quantum: FloatArray, way_m: FloatArray,
            learn: FloatArray, rise: FloatArray, mode: tuple[FloatArray, FloatArray, FloatArray],
            inverse: FloatArray, law: Any, inputs: FloatArray, log: FloatArray) -> None:
        """
        Track a force; the rules of the law change in place.

        Parameters
        ----------
        plant, hsv, driver, timing, reference, noise, quantum, learn, rise
            As of ``rollouts.sense``, the reference in N and N/s.
        way_m : float64[:]
            Contraction of the driven or isometric load at every tick and at the end (N + 1);
            linear in between.
        mode : tuple
            par, surface and state of ``force_inputs``.
        inverse : float64[:]
            Static inverse of the law.
        law, inputs : tuple, float64[:]
            Arguments of ``sofc_step``; the one that holds its inputs.
        log : float64[:]
            N ``FORCE_LOG``, written.

        """
        if key < 0:         # never; makes the key part of what is stored
            return
        plant_state, plant_par, plant_inp, plant_out = plant
        steps, driver_every, latency_steps = timing
        wanted = reference.view(WANTED)
        par, surface, state = mode
        acting, seen = part(plant_inp, 0, layout.INPUT), part(plant_out, 0, layout.OUTPUT)
        noises, rows = noise.view(READINGS), log.view(FORCE_LOG)
        steps_of = part(quantum, 0, READINGS)
        raw_array = np.zeros(_FORCE_INPUT_SIZE)
        raw = part(raw_array, 0, FORCE_INPUT)
        start = part(rise, 0, RISE)
        signal_0, signal_1 = acting.signal_0, acting.signal_1
        for tick in range(rows.shape[0]):
            row, off = rows[tick], noises[tick]
            row.force_n = seen.true_force_n
            row.contraction_m = seen.true_contraction_m
            row.pressure_pa = seen.true_pressure_pa
            raw.pressure_pa = read(
                seen.pressure_pa + off.pressure_pa, steps_of.pressure_pa)
            raw.contraction_m = read(
                seen.contraction_m + off.contraction_m, steps_of.contraction_m)
            raw.force_n = read(seen.force_n + off.force_n, steps_of.force_n)
            raw.reference_n = wanted[tick].reference
            raw.reference_rate_n_per_s = wanted[tick].rate
            raw.lead_reference_n = wanted[tick].lead
            raw.lead_rate_n_per_s = wanted[tick].lead_rate
            raw.learning = learn[tick]
            raw.elapsed_s = np.nan
            raw.held_back = start.limiting
            force_inputs(par, surface, state, raw_array, inverse, inputs)
            command_pa = risen(start, sofc_step(*law))
            row.command_pa = command_pa
            if tick % driver_every == 0:
                signal_0, signal_1 = drive(driver, hsv, command_pa, raw.pressure_pa)
            for j in range(steps):
                if j == latency_steps:
                    acting.signal_0 = signal_0
                    acting.signal_1 = signal_1
                acting.contraction_m = look_up(way_m, tick + (j + 1.0) / steps)
                step(plant_state, plant_par, plant_inp, plant_out)

    @allocating_entry_point
    def joint_rollout(
            plant: tuple[Plant, Plant, Plant], hsv: tuple[bool, bool],
            drivers: tuple[Driver, Driver], timing: tuple[int, int, int],
            reference: FloatArray, noise: FloatArray, quantum: FloatArray,
            torque_n_m: FloatArray, learn: FloatArray, rises: tuple[FloatArray, FloatArray],
            mode: tuple[FloatArray, FloatArray], law: Any, inputs: FloatArray,
            log: FloatArray) -> None:
        """
        Track an angle; the rules of the law change in place.

        Parameters
        ----------
        plant : tuple
            Arguments of ``joint_step``: joint, flexor, extensor.
        hsv, drivers : tuple of bool, tuple of tuple
            Driver law of flexor and extensor, its state, par and out.
        timing, reference, learn
            As of ``rollouts.sense``, the reference in rad and rad/s.
        noise, quantum : float64[:]
            N ``JOINT_READINGS`` of sensor noise, one behind the other, and those of the steps.
        torque_n_m : float64[:]
            External torque on the limb (N).
        rises : tuple of float64[:]
            ``RISE`` of the commands of flexor and extensor.
        mode : tuple
            par and state of ``joint_inputs`` and ``joint_outputs``.
        law, inputs : tuple, float64[:]
            Arguments of ``sofc_step``; the one that holds its inputs.
        log : float64[:]
            N ``JOINT_LOG``, written.

        """
        if key < 0:
            return
        joint, flexor, extensor = plant
        joint_inp, _, _, joint_out = joint
        acting = part(joint_inp, 0, joint_layout.INPUT)
        seen = part(joint_out, 0, joint_layout.OUTPUT)
        _, _, _, flexor_out = flexor
        _, _, _, extensor_out = extensor
        flexor_seen = part(flexor_out, 0, layout.OUTPUT)
        extensor_seen = part(extensor_out, 0, layout.OUTPUT)
        flexor_hsv, extensor_hsv = hsv
        flexor_driver, extensor_driver = drivers
        steps, driver_every, latency_steps = timing
        wanted = reference.view(WANTED)
        par, state = mode
        flexor_rises, extensor_rises = rises
        flexor_rise, extensor_rise = part(flexor_rises, 0, RISE), part(extensor_rises, 0, RISE)
        noises, rows = noise.view(JOINT_READINGS), log.view(JOINT_LOG)
        steps_of = part(quantum, 0, JOINT_READINGS)
        raw_array = np.zeros(_JOINT_INPUT_SIZE)
        raw = part(raw_array, 0, JOINT_INPUT)
        command_array = np.zeros(_COMMANDS_SIZE)
        commands = part(command_array, 0, COMMANDS)
        flexor_0 = flexor_1 = extensor_0 = extensor_1 = 0.0
        for tick in range(rows.shape[0]):
            row, off = rows[tick], noises[tick]
            row.angle_rad = seen.angle_rad
            row.flexor_pressure_pa = flexor_seen.true_pressure_pa
            row.extensor_pressure_pa = extensor_seen.true_pressure_pa
            row.flexor_force_n = flexor_seen.true_force_n
            row.extensor_force_n = extensor_seen.true_force_n
            raw.angle_rad = read(
                seen.angle_rad + off.angle_rad, steps_of.angle_rad)
            raw.flexor_pressure_pa = read(
                flexor_seen.pressure_pa + off.flexor_pressure_pa,
                steps_of.flexor_pressure_pa)
            raw.extensor_pressure_pa = read(
                extensor_seen.pressure_pa + off.extensor_pressure_pa,
                steps_of.extensor_pressure_pa)
            raw.flexor_force_n = read(
                flexor_seen.force_n + off.flexor_force_n, steps_of.flexor_force_n)
            raw.extensor_force_n = read(
                extensor_seen.force_n + off.extensor_force_n, steps_of.extensor_force_n)
            raw.reference_rad = wanted[tick].reference
            raw.reference_rate_rad_per_s = wanted[tick].rate
            raw.lead_reference_rad = wanted[tick].lead
            raw.lead_rate_rad_per_s = wanted[tick].lead_rate
            raw.learning = learn[tick]
            raw.elapsed_s = np.nan
            raw.held_back = FOLLOWS
            if flexor_rise.limiting + extensor_rise.limiting > 0.0:
                raw.held_back = UNKNOWN
            joint_inputs(par, raw_array, inputs)
            u_pa = sofc_step(*law)
            joint_outputs(par, state, u_pa, raw_array, command_array)
            commands.flexor_pa = risen(flexor_rise, commands.flexor_pa)
            commands.extensor_pa = risen(extensor_rise, commands.extensor_pa)
            row.flexor_command_pa = commands.flexor_pa
            row.extensor_command_pa = commands.extensor_pa
            if tick % driver_every == 0:
                flexor_0, flexor_1 = drive(
                    flexor_driver, flexor_hsv, commands.flexor_pa, raw.flexor_pressure_pa)
                extensor_0, extensor_1 = drive(
                    extensor_driver, extensor_hsv, commands.extensor_pa, raw.extensor_pressure_pa)
            acting.torque_n_m = torque_n_m[tick]
            for j in range(steps):
                if j == latency_steps:
                    acting.flexor_signal_0 = flexor_0
                    acting.flexor_signal_1 = flexor_1
                    acting.extensor_signal_0 = extensor_0
                    acting.extensor_signal_1 = extensor_1
                joint_step(joint, flexor, extensor)

    return force_rollout, joint_rollout


force_rollout, joint_rollout = _entries(source_key(
    force_inputs, joint_inputs, joint_outputs, sofc_step, step, joint_step, drive, look_up, read,
    risen,    layout, joint_layout))

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
The closed loop of joint mode as compiled code.

Timing of a tick as in ``rollouts``.
"""

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from pam_actuation.control.following import FOLLOWS, UNKNOWN
from pam_actuation.control.modes.joint import (
    COMMANDS, JOINT_INPUT, joint_inputs, joint_outputs)
from pam_actuation.control.sofc.step import sofc_step
from pam_actuation.tuning.loop_parts import (
    drive, Driver, JOINT_READINGS, Plant, read, RISE, risen, WANTED)
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled, entry_point, inlined, source_key
from pam_sim.joint import layout as joint_layout
from pam_sim.joint.kernel import joint_step
from pam_sim.records import part, record
from pam_sim.rollout import layout

# What is kept of a tick; pressures absolute, what is measured true and at the tick.
JOINT_LOG = record(
    'angle_rad', 'flexor_pressure_pa', 'extensor_pressure_pa', 'flexor_command_pa',
    'extensor_command_pa', 'flexor_force_n', 'extensor_force_n')
Plants: TypeAlias = tuple[Plant, Plant, Plant]


@compiled
def sense(tick: int, plants: Plants, hsv: tuple[bool, bool], drivers: tuple[Driver, Driver],
          timing: tuple[int, int, int], reference: FloatArray, noise: FloatArray,
          quantum: FloatArray, torque_n_m: FloatArray, learn: FloatArray,
          rises: tuple[FloatArray, FloatArray], raw: FloatArray, commands: FloatArray,
          log: FloatArray) -> None:
    """
    Fill the inputs of the joint and the measured part of the log.

    Parameters
    ----------
    tick, timing, reference, learn
        As of ``rollouts.sense``, the reference in rad and rad/s.
    plants : tuple
        Arguments of ``joint_step``: joint, flexor, extensor.
    hsv, drivers : tuple of bool, tuple of tuple
        Driver law of flexor and extensor, its state, par and out.
    noise, quantum : float64[:]
        N ``JOINT_READINGS`` of sensor noise, one behind the other, and those of the steps.
    torque_n_m : float64[:]
        External torque on the limb (N).
    rises : tuple of float64[:]
        ``RISE`` of the commands of flexor and extensor.
    raw : float64[:]
        Array of ``JOINT_INPUT``, written.
    commands : float64[:]
        Array of ``COMMANDS``.
    log : float64[:]
        N ``JOINT_LOG``, written.

    """
    (_, _, _, joint_out), (_, _, _, flexor_out), (_, _, _, extensor_out) = plants
    flexor_rise, extensor_rise = rises
    seen = part(joint_out, 0, joint_layout.OUTPUT)
    flexor, extensor = part(flexor_out, 0, layout.OUTPUT), part(extensor_out, 0, layout.OUTPUT)
    off, steps_of = noise.view(JOINT_READINGS)[tick], part(quantum, 0, JOINT_READINGS)
    wanted = reference.view(WANTED)[tick]
    inp, row = part(raw, 0, JOINT_INPUT), log.view(JOINT_LOG)[tick]
    inp.angle_rad = read(seen.angle_rad + off.angle_rad, steps_of.angle_rad)
    inp.flexor_pressure_pa = read(
        flexor.pressure_pa + off.flexor_pressure_pa, steps_of.flexor_pressure_pa)
    inp.extensor_pressure_pa = read(
        extensor.pressure_pa + off.extensor_pressure_pa, steps_of.extensor_pressure_pa)
    inp.flexor_force_n = read(flexor.force_n + off.flexor_force_n, steps_of.flexor_force_n)
    inp.extensor_force_n = read(
        extensor.force_n + off.extensor_force_n, steps_of.extensor_force_n)
    inp.reference_rad = wanted.reference
    inp.reference_rate_rad_per_s = wanted.rate
    inp.lead_reference_rad = wanted.lead
    inp.lead_rate_rad_per_s = wanted.lead_rate
    inp.learning = learn[tick]
    inp.elapsed_s = np.nan
    inp.held_back = FOLLOWS
    if part(flexor_rise, 0, RISE).limiting + part(extensor_rise, 0, RISE).limiting > 0.0:
        inp.held_back = UNKNOWN
    row.angle_rad = seen.angle_rad
    row.flexor_pressure_pa = flexor.true_pressure_pa
    row.extensor_pressure_pa = extensor.true_pressure_pa
    row.flexor_force_n = flexor.true_force_n
    row.extensor_force_n = extensor.true_force_n


@inlined
def drive_muscle(driver: Driver, hsv: bool, command_pa: float, measured_pa: float,
                 seen: np.record, noise_m: float, step_m: float) -> tuple[float, float]:
    """
    Run the driver law of a muscle; return its two valve signals.

    Parameters
    ----------
    driver, hsv, command_pa, measured_pa
        As of ``drive``.
    seen : record
        ``layout.OUTPUT`` of the muscle, of which the driver is told supply and contraction.
    noise_m, step_m : float
        Noise and step of that contraction.

    """
    return drive(driver, hsv, command_pa, measured_pa, seen.supply_pa,
                 read(seen.contraction_m + noise_m, step_m))


@compiled
def actuate(tick: int, plants: Plants, hsv: tuple[bool, bool], drivers: tuple[Driver, Driver],
            timing: tuple[int, int, int], reference: FloatArray, noise: FloatArray,
            quantum: FloatArray, torque_n_m: FloatArray, learn: FloatArray,
            rises: tuple[FloatArray, FloatArray], raw: FloatArray, commands: FloatArray,
            log: FloatArray) -> None:
    """Run the driver laws where they are due and the physics of a period; as of ``sense``."""
    joint, flexor, extensor = plants
    joint_inp, _, _, _ = joint
    _, _, _, flexor_out = flexor
    _, _, _, extensor_out = extensor
    off, steps_of = noise.view(JOINT_READINGS)[tick], part(quantum, 0, JOINT_READINGS)
    flexor_hsv, extensor_hsv = hsv
    flexor_driver, extensor_driver = drivers
    flexor_rise, extensor_rise = rises
    steps, driver_every, latency_steps = timing
    acting, inp = part(joint_inp, 0, joint_layout.INPUT), part(raw, 0, JOINT_INPUT)
    wanted, row = part(commands, 0, COMMANDS), log.view(JOINT_LOG)[tick]
    row.flexor_command_pa = risen(part(flexor_rise, 0, RISE), wanted.flexor_pa)
    row.extensor_command_pa = risen(part(extensor_rise, 0, RISE), wanted.extensor_pa)
    flexor_0, flexor_1 = acting.flexor_signal_0, acting.flexor_signal_1
    extensor_0, extensor_1 = acting.extensor_signal_0, acting.extensor_signal_1
    if tick % driver_every == 0:
        flexor_0, flexor_1 = drive_muscle(
            flexor_driver, flexor_hsv, row.flexor_command_pa, inp.flexor_pressure_pa,
            part(flexor_out, 0, layout.OUTPUT), off.flexor_contraction_m,
            steps_of.flexor_contraction_m)
        extensor_0, extensor_1 = drive_muscle(
            extensor_driver, extensor_hsv, row.extensor_command_pa, inp.extensor_pressure_pa,
            part(extensor_out, 0, layout.OUTPUT), off.extensor_contraction_m,
            steps_of.extensor_contraction_m)
    acting.torque_n_m = torque_n_m[tick]
    for j in range(steps):
        if j == latency_steps:
            acting.flexor_signal_0 = flexor_0
            acting.flexor_signal_1 = flexor_1
            acting.extensor_signal_0 = extensor_0
            acting.extensor_signal_1 = extensor_1
        joint_step(joint, flexor, extensor)


def _entry(key: int) -> Callable[..., None]:
    """Return the rollout as a unit of compiled code, stored under ``key``."""
    @entry_point
    def joint_rollout(ticks: int, before: Any, law: Any, state: FloatArray, *loop: Any) -> None:
        """
        Track an angle; the rules of the law change in place.

        ``before``: arguments of ``joint_inputs``; ``law``: those of ``sofc_step``; ``state``: of
        ``joint_outputs``; ``loop``: arguments of ``sense`` from ``plants`` on.
        """
        if key >= 0:        # always; makes the key part of what is stored
            par, raw, _ = before
            commands = loop[-2]
            for tick in range(ticks):
                sense(tick, *loop)
                joint_inputs(*before)
                joint_outputs(par, state, sofc_step(*law), raw, commands)
                actuate(tick, *loop)

    return joint_rollout


joint_rollout = _entry(source_key(
    sense, actuate, joint_inputs, joint_outputs, sofc_step))

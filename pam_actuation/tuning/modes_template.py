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

Not imported by its name: ``compiled_modes`` loads this text as a module of its own,
named after the hash of everything it is compiled from. Timing of a tick as in
``rollout_template``.
"""

from numba import njit
import numpy as np
from pam_actuation.control import inputs as place
from pam_actuation.control.modes.force import force_inputs
from pam_actuation.control.modes.joint import EXTENSOR, FLEXOR, joint_inputs, joint_outputs
from pam_actuation.control.sofc.step import sofc_step
from pam_actuation.tuning.loop_parts import drive, look_up, read, want
from pam_sim.joint import layout as joint_layout
from pam_sim.joint.kernel import joint_step
from pam_sim.rollout import layout
from pam_sim.rollout.kernel import step

FORCE_LOG_FORCE = 0             # N, true, at the tick
FORCE_LOG_CONTRACTION = 1       # m
FORCE_LOG_PRESSURE = 2          # Pa absolute
FORCE_LOG_COMMAND = 3           # Pa absolute
FORCE_LOG_SIZE = 4

JOINT_LOG_ANGLE = 0             # rad, true, at the tick
JOINT_LOG_FLEXOR_PRESSURE = 1   # Pa absolute
JOINT_LOG_EXTENSOR_PRESSURE = 2
JOINT_LOG_FLEXOR_COMMAND = 3    # Pa absolute
JOINT_LOG_EXTENSOR_COMMAND = 4
JOINT_LOG_FLEXOR_FORCE = 5      # N
JOINT_LOG_EXTENSOR_FORCE = 6
JOINT_LOG_SIZE = 7


@njit(cache=True, error_model='numpy', nogil=True)
def force_rollout(plant, hsv, driver, timing, lead_ticks, reference, noise, quantum, way_m,
                  learn, mode, law, inp, log):
    """
    Track a force; the rules of the law change in place.

    Parameters
    ----------
    plant, hsv, driver, timing, lead_ticks, reference, noise, quantum, learn
        As of ``rollout_template.sofc_rollout``, the reference in N and N/s.
    way_m : float64[:]
        Contraction of the driven or isometric load at every tick and at the end (N + 1);
        linear in between.
    mode : tuple
        par, surface and state of ``force_inputs``.
    law, inp : tuple, float64[:]
        Arguments of ``sofc_step``; the one that holds its inputs.
    log : float64[:, :]
        (N, FORCE_LOG_SIZE), written.

    """
    plant_state, plant_par, plant_inp, plant_out = plant
    steps, driver_every, latency_steps = timing
    position, rate = reference
    raw = np.zeros(inp.shape[0])
    signal_0 = plant_inp[layout.INP_SIGNAL_0]
    signal_1 = plant_inp[layout.INP_SIGNAL_1]
    for tick in range(log.shape[0]):
        row = log[tick]
        row[FORCE_LOG_FORCE] = plant_out[layout.OUT_TRUE_FORCE]
        row[FORCE_LOG_CONTRACTION] = plant_out[layout.OUT_TRUE_CONTRACTION]
        row[FORCE_LOG_PRESSURE] = plant_out[layout.OUT_TRUE_PRESSURE]
        raw[place.IN_PRESSURE] = read(
            plant_out[layout.OUT_PRESSURE] + noise[tick, 0], quantum[0])
        raw[place.IN_CONTRACTION] = read(
            plant_out[layout.OUT_CONTRACTION] + noise[tick, 1], quantum[1])
        raw[place.IN_FORCE] = read(plant_out[layout.OUT_FORCE] + noise[tick, 2], quantum[2])
        want(tick, position, rate, lead_ticks, learn, raw)
        force_inputs(mode[0], mode[1], mode[2], raw, law[1], inp)
        command_pa = sofc_step(*law)
        row[FORCE_LOG_COMMAND] = command_pa
        if tick % driver_every == 0:
            signal_0, signal_1 = drive(driver, hsv, command_pa, raw[place.IN_PRESSURE])
        for j in range(steps):
            if j == latency_steps:
                plant_inp[layout.INP_SIGNAL_0] = signal_0
                plant_inp[layout.INP_SIGNAL_1] = signal_1
            plant_inp[layout.INP_CONTRACTION] = look_up(way_m, tick + (j + 1.0) / steps)
            step(plant_state, plant_par, plant_inp, plant_out)


@njit(cache=True, error_model='numpy', nogil=True)
def joint_rollout(plant, hsv, drivers, timing, lead_ticks, reference, noise, quantum, torque_n_m,
                  learn, mode, law, inp, log):
    """
    Track an angle; the rules of the law change in place.

    Parameters
    ----------
    plant : tuple
        Arguments of ``joint_step``: joint, flexor, extensor.
    hsv, drivers : tuple of bool, tuple of tuple
        Driver law of flexor and extensor, its state, par and out.
    timing, lead_ticks, reference, learn
        As of ``rollout_template.sofc_rollout``, the reference in rad and rad/s.
    noise, quantum : float64 arrays
        (N, 5) and (5): angle, pressures and forces of flexor and extensor.
    torque_n_m : float64[:]
        External torque on the limb (N).
    mode : tuple
        par and state of ``joint_inputs`` and ``joint_outputs``.
    law, inp : tuple, float64[:]
        Arguments of ``sofc_step``; the one that holds its inputs.
    log : float64[:, :]
        (N, JOINT_LOG_SIZE), written.

    """
    joint, flexor, extensor = plant
    steps, driver_every, latency_steps = timing
    position, rate = reference
    raw = np.zeros(inp.shape[0])
    pressures_pa = np.zeros(2)
    forces_n = np.zeros(2)
    commands_pa = np.zeros(2)
    signals = np.zeros(4)
    for tick in range(log.shape[0]):
        row = log[tick]
        row[JOINT_LOG_ANGLE] = joint[3][joint_layout.OUT_ANGLE]
        row[JOINT_LOG_FLEXOR_PRESSURE] = flexor[3][layout.OUT_TRUE_PRESSURE]
        row[JOINT_LOG_EXTENSOR_PRESSURE] = extensor[3][layout.OUT_TRUE_PRESSURE]
        row[JOINT_LOG_FLEXOR_FORCE] = flexor[3][layout.OUT_TRUE_FORCE]
        row[JOINT_LOG_EXTENSOR_FORCE] = extensor[3][layout.OUT_TRUE_FORCE]
        raw[place.IN_CONTRACTION] = read(
            joint[3][joint_layout.OUT_ANGLE] + noise[tick, 0], quantum[0])
        raw[place.IN_PRESSURE] = raw[place.IN_FORCE] = np.nan
        pressures_pa[FLEXOR] = read(
            flexor[3][layout.OUT_PRESSURE] + noise[tick, 1], quantum[1])
        pressures_pa[EXTENSOR] = read(
            extensor[3][layout.OUT_PRESSURE] + noise[tick, 2], quantum[2])
        forces_n[FLEXOR] = read(flexor[3][layout.OUT_FORCE] + noise[tick, 3], quantum[3])
        forces_n[EXTENSOR] = read(extensor[3][layout.OUT_FORCE] + noise[tick, 4], quantum[4])
        want(tick, position, rate, lead_ticks, learn, raw)
        joint_inputs(mode[0], raw, pressures_pa, forces_n, inp)
        u_pa = sofc_step(*law)
        joint_outputs(mode[0], mode[1], u_pa, pressures_pa, commands_pa)
        row[JOINT_LOG_FLEXOR_COMMAND] = commands_pa[FLEXOR]
        row[JOINT_LOG_EXTENSOR_COMMAND] = commands_pa[EXTENSOR]
        if tick % driver_every == 0:
            signals[0], signals[1] = drive(
                drivers[0], hsv[0], commands_pa[FLEXOR], pressures_pa[FLEXOR])
            signals[2], signals[3] = drive(
                drivers[1], hsv[1], commands_pa[EXTENSOR], pressures_pa[EXTENSOR])
        joint[0][joint_layout.IN_TORQUE] = torque_n_m[tick]
        for j in range(steps):
            if j == latency_steps:
                joint[0][joint_layout.IN_FLEXOR_0] = signals[0]
                joint[0][joint_layout.IN_FLEXOR_1] = signals[1]
                joint[0][joint_layout.IN_EXTENSOR_0] = signals[2]
                joint[0][joint_layout.IN_EXTENSOR_1] = signals[3]
            joint_step(joint, flexor, extensor)

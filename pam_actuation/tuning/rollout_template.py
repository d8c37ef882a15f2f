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

Not imported by its name: ``closed_loop`` loads this text as a module of its own,
named after the hash of everything it is compiled from (the plant kernel, the
controllers, the driver laws), so that no stale machine code survives a change.

Timing of one controller tick: measure, controller, driver (every
``driver_every`` ticks), then the physics steps of one period; the new valve
signal arrives after ``latency_steps`` of them.
"""

from numba import njit
from pam_actuation.control import inputs as place
from pam_actuation.control.lqi import lqi_step
from pam_actuation.control.pid import pid_step
from pam_actuation.control.sofc.step import sofc_step
from pam_actuation.tuning.loop_parts import drive, read, want
from pam_sim.compiled import compiled
from pam_sim.rollout import layout
from pam_sim.rollout.kernel import step

LOG_CONTRACTION = 0       # m, true, at the tick
LOG_PRESSURE = 1          # Pa absolute, true
LOG_FORCE = 2             # N
LOG_COMMAND = 3           # Pa absolute
LOG_SIGNAL_0 = 4          # V or fill duty
LOG_SIGNAL_1 = 5          # vent duty
LOG_MEASURED = 6          # m
LOG_SIZE = 7


@compiled
def _sense(tick, plant_out, noise, quantum, position, rate, lead_ticks, learn, inp, log):
    """Fill the inputs of the controller and the measured part of the log."""
    inp[place.IN_CONTRACTION] = read(
        plant_out[layout.OUT_CONTRACTION] + noise[tick, 1], quantum[1])
    inp[place.IN_PRESSURE] = read(plant_out[layout.OUT_PRESSURE] + noise[tick, 0], quantum[0])
    inp[place.IN_FORCE] = read(plant_out[layout.OUT_FORCE] + noise[tick, 2], quantum[2])
    want(tick, position, rate, lead_ticks, learn, inp)
    log[tick, LOG_CONTRACTION] = plant_out[layout.OUT_TRUE_CONTRACTION]
    log[tick, LOG_PRESSURE] = plant_out[layout.OUT_TRUE_PRESSURE]
    log[tick, LOG_FORCE] = plant_out[layout.OUT_TRUE_FORCE]
    log[tick, LOG_MEASURED] = inp[place.IN_CONTRACTION]


@compiled
def _actuate(tick, command_pa, measured_pa, hsv, driver, driver_every, steps, latency_steps,
             disturbance, plant_state, plant_par, plant_inp, plant_out, log):
    """Run the driver law where it is due and the physics of one controller period."""
    signal_0 = plant_inp[layout.INP_SIGNAL_0]
    signal_1 = plant_inp[layout.INP_SIGNAL_1]
    if tick % driver_every == 0:
        supply_pa = disturbance[max(tick - 1, 0), 1]
        signal_0, signal_1 = drive(driver, hsv, command_pa, measured_pa, supply_pa)
    plant_inp[layout.INP_EXTERNAL_FORCE] = disturbance[tick, 0]
    plant_par[layout.PAR_SUPPLY] = disturbance[tick, 1]
    for j in range(steps):
        if j == latency_steps:
            plant_inp[layout.INP_SIGNAL_0] = signal_0
            plant_inp[layout.INP_SIGNAL_1] = signal_1
        step(plant_state, plant_par, plant_inp, plant_out)
    log[tick, LOG_COMMAND] = command_pa
    log[tick, LOG_SIGNAL_0] = signal_0
    log[tick, LOG_SIGNAL_1] = signal_1


@njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
def sofc_rollout(plant, hsv, driver, timing, lead_ticks, reference, noise, quantum, disturbance,
                 learn, controller, log):
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
    lead_ticks : float
        Preview in ticks.
    reference : tuple
        Position [m] and rate [m/s] per tick, longer than ``log`` by the preview.
    noise, quantum, disturbance, learn : float64 arrays
        Sensor noise (N, 3) and steps (3) of pressure, contraction, force; external force [N]
        and supply pressure [Pa] (N, 2); 1 where the rules may change (N).
    controller : tuple
        Arguments of ``sofc_step``.
    log : float64[:, :]
        (N, LOG_SIZE), written.

    """
    plant_state, plant_par, plant_inp, plant_out = plant
    steps, driver_every, latency_steps = timing
    position, rate = reference
    inp = controller[8]
    for tick in range(log.shape[0]):
        _sense(tick, plant_out, noise, quantum, position, rate, lead_ticks, learn, inp, log)
        command_pa = sofc_step(*controller)
        _actuate(tick, command_pa, inp[place.IN_PRESSURE], hsv, driver, driver_every, steps,
                 latency_steps, disturbance, plant_state, plant_par, plant_inp, plant_out, log)


@njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
def pid_rollout(plant, hsv, driver, timing, lead_ticks, reference, noise, quantum, disturbance,
                learn, controller, log):
    """Track a reference with the PID; arguments as ``sofc_rollout``, of ``pid_step``."""
    plant_state, plant_par, plant_inp, plant_out = plant
    steps, driver_every, latency_steps = timing
    position, rate = reference
    inp = controller[3]
    for tick in range(log.shape[0]):
        _sense(tick, plant_out, noise, quantum, position, rate, lead_ticks, learn, inp, log)
        command_pa = pid_step(*controller)
        _actuate(tick, command_pa, inp[place.IN_PRESSURE], hsv, driver, driver_every, steps,
                 latency_steps, disturbance, plant_state, plant_par, plant_inp, plant_out, log)


@njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
def lqi_rollout(plant, hsv, driver, timing, lead_ticks, reference, noise, quantum, disturbance,
                learn, controller, log):
    """Track a reference with the LQI; arguments as ``sofc_rollout``, of ``lqi_step``."""
    plant_state, plant_par, plant_inp, plant_out = plant
    steps, driver_every, latency_steps = timing
    position, rate = reference
    inp = controller[3]
    for tick in range(log.shape[0]):
        _sense(tick, plant_out, noise, quantum, position, rate, lead_ticks, learn, inp, log)
        command_pa = lqi_step(*controller)
        _actuate(tick, command_pa, inp[place.IN_PRESSURE], hsv, driver, driver_every, steps,
                 latency_steps, disturbance, plant_state, plant_par, plant_inp, plant_out, log)

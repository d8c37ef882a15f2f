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
The compiled closed loop with further baselines; see ``rollouts``, whose loop this is.

Each is a unit of compiled code of its own: a change of one law compiles no other anew.
"""

from collections.abc import Callable
from typing import Any

from pam_actuation.control.ilc import ilc_step
from pam_actuation.control.inputs import INPUT
from pam_actuation.control.mpc import mpc_step
from pam_actuation.tuning.loop_parts import DISTURBANCE, Driver, Plant, READINGS, WANTED
from pam_actuation.tuning.rollouts import actuate, LOG, sense
from pam_sim.annotations import FloatArray
from pam_sim.compiled import entry_point, source_key
from pam_sim.records import part
from pam_sim.rollout import layout


def _of_ilc(key: int) -> Callable[..., None]:
    """Return the rollout of the ILC as a unit of compiled code, stored under ``key``."""
    @entry_point
    def ilc_rollout(
            plant: Plant, hsv: bool, driver: Driver, timing: tuple[int, int, int],
            reference: FloatArray, noise: FloatArray, quantum: FloatArray,
            disturbance: FloatArray, learn: FloatArray, controller: Any, inputs: FloatArray,
            log: FloatArray) -> None:
        """Track a reference with the ILC; arguments as ``sofc_rollout``, of ``ilc_step``."""
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
            command_pa = ilc_step(*controller)
            actuate(tick, command_pa, inp.pressure_pa, hsv, driver, driver_every, steps,
                    latency_steps, disturbances, plant, log_rows[tick])

    return ilc_rollout


def _of_mpc(key: int) -> Callable[..., None]:
    """Return the rollout of the MPC as a unit of compiled code, stored under ``key``."""
    @entry_point
    def mpc_rollout(
            plant: Plant, hsv: bool, driver: Driver, timing: tuple[int, int, int],
            reference: FloatArray, noise: FloatArray, quantum: FloatArray,
            disturbance: FloatArray, learn: FloatArray, controller: Any, inputs: FloatArray,
            log: FloatArray) -> None:
        """Track a reference with the MPC; arguments as ``sofc_rollout``, of ``mpc_step``."""
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
            command_pa = mpc_step(*controller)
            actuate(tick, command_pa, inp.pressure_pa, hsv, driver, driver_every, steps,
                    latency_steps, disturbances, plant, log_rows[tick])

    return mpc_rollout


ilc_rollout = _of_ilc(source_key(sense, actuate, ilc_step))
mpc_rollout = _of_mpc(source_key(sense, actuate, mpc_step))

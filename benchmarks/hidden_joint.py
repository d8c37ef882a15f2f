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
Joints of the independent simulator under test/hidden, in the place of the small joint.

``HiddenJointLoop(valve, seed, experiment)`` is a closed loop of ``joint_dmsp_5_300_realistic`` for
controller and drivers. What moves has other equations: bristles or Dahl's equation for friction,
air as mass and energy. Friction, valve and dead time of each muscle are off by up to 30 %, mass
and inertia of the limb by up to 20 %.
"""

from pathlib import Path
import sys

import numpy as np
from pam_actuation.tuning.foreign_plant import driver_function, quantised
from pam_actuation.tuning.joint_loop import JointLoop
from pam_actuation.tuning.loop_parts import JOINT_READINGS, WANTED
from pam_actuation.tuning.loop_setup import learning_mask
from pam_sim.joint import load_joint
from pam_sim.records import size_of

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / 'test' / 'hidden'))

import truth_joint  # noqa: E402, I100
import truth_live_joint  # noqa: E402
import truth_realistic  # noqa: E402

JOINT = 'joint_dmsp_5_300_realistic'
LIMB_OFF = 0.2


def hidden_joint(valve, seed):
    """Return the hidden joint of a seed at rest."""
    mass, inertia, damping = truth_joint.LIMB
    factor = np.random.default_rng([seed, 3]).uniform(1.0 - LIMB_OFF, 1.0 + LIMB_OFF)
    numbers = [truth_realistic.realistic_numbers(valve, 2 * seed + side) for side in range(2)]
    return truth_live_joint.LiveJoint(
        numbers, valve, (factor * mass, factor * inertia, damping))


class HiddenJointLoop(JointLoop):
    """The closed loop of a joint, on a hidden one; every tick is called from Python."""

    def __init__(self, valve, hidden_seed, experiment, **more):
        super().__init__(load_joint(JOINT, valve=valve), experiment, **more)
        self._valve, self._hidden_seed = valve, hidden_seed

    def run_raw(self, controller, learn=True):
        """Return a ``JOINT_LOG`` of ``joint_rollouts`` for every tick, shape (ticks,)."""
        from pam_actuation.tuning.joint_rollouts import JOINT_LOG
        plant = hidden_joint(self._valve, self._hidden_seed)
        controller.pause()
        log = np.empty(self.ticks * size_of(JOINT_LOG))
        rows = log.reshape(self.ticks, size_of(JOINT_LOG))
        noises = self._noise.reshape(self.ticks, size_of(JOINT_READINGS)).tolist()
        wanted = self._reference.rows(controller.lead_s).reshape(
            self.ticks, size_of(WANTED)).tolist()
        learns = learning_mask(controller, learn, self.ticks, self.rate_hz).tolist()
        quanta = self._quantum.tolist()
        laws, (steps, every, latency) = self._fresh_drivers(controller.driver)
        hsv = self._valve == 'hsv'
        drives = [driver_function(law, hsv) for law in laws]
        signals = [(0.0, 0.0) if hsv else (0.0,)] * 2
        for tick in range(self.ticks):
            true = (plant.angle_rad, *plant.pressures_pa, *plant.forces_n)
            angle, flexor_pa, extensor_pa, flexor_n, extensor_n = (
                quantised(value + noise, quantum)
                for value, noise, quantum in zip(true, noises[tick], quanta))
            reference, rate, lead, lead_rate = wanted[tick]
            commands = controller.step(
                angle, reference, rate, lead, lead_rate, learns[tick] > 0.0,
                pressures_pa=(flexor_pa, extensor_pa), forces_n=(flexor_n, extensor_n))
            before = signals
            if tick % every == 0:
                signals = [drive(command_pa, pressure_pa, np.nan, np.nan) for
                           drive, command_pa, pressure_pa in zip(
                               drives, commands, (flexor_pa, extensor_pa))]
            if latency:
                plant.step(before, latency)
            plant.step(signals, steps - latency)
            rows[tick] = (*true[:3], *commands, *true[3:])
        return log.view(JOINT_LOG)

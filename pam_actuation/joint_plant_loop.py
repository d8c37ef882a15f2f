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
The simulated joint on a clock: valve signals of two muscles in, measurements out, no ROS.

The counterpart of ``plant_loop`` for a flexor and an extensor that turn one limb.
"""

from collections.abc import Callable, Hashable
from functools import partial
import math
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.messages import JointAngle, ValveSignal
from pam_actuation.plant_loop import HeldSignal, muscle_readings, PlantClock
from pam_sim.joint.parameters import SIDES
from pam_sim.sensors import SensorChain

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig

ANGLE_NOISE_RAD = 5e-4                      # design value of an encoder on the joint
ANGLE_STEP_RAD = 2.0 * math.pi / 2 ** 14    # of 14 bit a turn


class JointPlantLoop(PlantClock):
    """
    A live joint that follows a clock in integer nanoseconds.

    Parameters
    ----------
    joint : pam_sim.joint.JointRig
    seed : int
        Of the sensor noise; the extensor has the next one.
    longest_catch_up_s : float
        As of ``PlantClock``.

    """

    def __init__(self, joint: 'JointRig', seed: int = 0, longest_catch_up_s: float = 0.25) -> None:
        self.joint = joint
        self.plant = joint.plant(seed)
        super().__init__(self.plant.dt_s, longest_catch_up_s)
        rigs = (joint.flexor, joint.extensor)
        self.signals = {side: HeldSignal(rig.valve) for side, rig in zip(SIDES, rigs)}
        self.sensors = {side: SensorChain(rig.sensors, seed + k)
                        for k, (side, rig) in enumerate(zip(SIDES, rigs))}
        self._noise = np.random.default_rng((seed, len(SIDES)))

    def takes(self) -> dict[str, Callable[[Any], None]]:
        """Return what takes each topic, by name relative to the joint."""
        return {f'{side}/valve_signal': partial(self.set_signal, side) for side in SIDES}

    def set_signal(self, side: str, message: ValveSignal, writer: Hashable = None) -> None:
        """Take a valve signal of one muscle."""
        self.signals[side].take(message, writer, self.now_ns or 0)

    def step(self, count: int) -> None:
        """Advance the joint by some steps with the signals held."""
        for _ in range(count):
            self.plant.step(self.signals['flexor'].efforts, self.signals['extensor'].efforts)

    def sample(self, now_ns: int) -> dict[str, Any]:
        """
        Read the sensors; return the messages by topic, relative to the joint.

        ``joint_state`` carries the angle of an encoder and the torque of both tendons, which
        no sensor measures: it is for people.
        """
        stamp_ns = now_ns if self.now_ns is None else self.now_ns
        plant = self.plant
        angle = plant.angle_rad + ANGLE_NOISE_RAD * self._noise.standard_normal()
        angle = round(angle / ANGLE_STEP_RAD) * ANGLE_STEP_RAD
        messages = {'joint_state': JointAngle(stamp_ns, angle, plant.torque_n_m)}
        for side in SIDES:
            readings = muscle_readings(
                getattr(plant, side), self.sensors[side], stamp_ns, plant.time_s)
            messages.update({f'{side}/{topic}': plain for topic, plain in readings.items()})
        return messages

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

"""The hidden joint step by step, for a controller that acts on what it measures."""

import numpy as np
import truth_joint
import truth_numbers
import truth_rig as rig


@rig.jit
def hold(numbers, valve, y, work, anchors, plays, raw, motion, limb, pulls, start, steps):
    """Advance held inputs of both muscles by steps of the rig; angle and speed are ``motion``."""
    middle, d = work[0], work[1]
    angle, speed = motion[0], motion[1]
    inputs = np.zeros((2, 2))
    for k in range(steps):
        t = (start + k) * rig.STEP_S
        for j in range(2):
            inputs[j, 0], inputs[j, 1] = rig.acting(
                raw[j, 0], raw[j, 1], t, plays[j], valve, numbers[j])
            pulls[j] = truth_joint.pull_of(
                y[j], inputs[j, 0], inputs[j, 1], t, anchors[j], valve, numbers[j], d[j])
        angle, speed = truth_joint.advance(
            y, middle, d, inputs, t, anchors, valve, numbers, pulls, angle, speed, limb)
    motion[0], motion[1] = angle, speed


class LiveJoint:
    """
    A hidden joint, from rest at atmosphere, its limb hanging.

    Parameters
    ----------
    numbers : pair of dict
        Numbers of flexor and extensor that are not neutral.
    valve : {'ppr', 'hsv'}
    limb : tuple
        As ``truth_joint.LIMB``.

    Attributes
    ----------
    pressures_pa, forces_n : pair of float
        Absolute pressures and tensions of flexor and extensor.

    """

    dt_s = 1e-3

    def __init__(self, numbers, valve='ppr', limb=truth_joint.LIMB):
        self._n = np.array([truth_numbers.numbers(**one) for one in numbers])
        self._valve, self._limb = rig.PPR if valve == 'ppr' else rig.HSV, limb
        self._y, self._work = np.zeros((2, rig.SIZE)), np.zeros((2, 2, rig.SIZE))
        self._anchors, self._plays = np.zeros((2, 6)), np.zeros((2, 3))
        self._raw, self._motion, self._pulls = np.zeros((2, 2)), np.zeros(2), np.zeros(2)
        for j in range(2):
            truth_joint.start_muscle(
                self._y[j], self._anchors[j], truth_joint.AT_ZERO, self._valve, self._n[j])
        self._given = [(0.0, 0.0), (0.0, 0.0)]
        self._waiting, self._done = [], 0

    @property
    def angle_rad(self):
        """Return the angle of the joint."""
        return self._motion[0].item()

    @property
    def pressures_pa(self):
        """Return the pressures in flexor and extensor."""
        return tuple(rig.pressure_of(self._y[j], self._valve, self._n[j]) for j in range(2))

    @property
    def forces_n(self):
        """Return the tensions of flexor and extensor."""
        return tuple(self._pulls.tolist())

    def step(self, signals, steps=1):
        """Advance by ``steps`` times ``dt_s``; each signal acts after the delay of its valve."""
        for j, signal in enumerate(signals):
            given = (float(signal[0]), float(signal[-1]))
            if given != self._given[j]:
                self._given[j] = given
                late = int(round(self._n[j, rig.DELAY] / rig.STEP_S))
                self._waiting.append((self._done + late, j, given))
        fine = int(round(self.dt_s / rig.STEP_S))
        for _ in range(steps):
            for due in [one for one in self._waiting if one[0] <= self._done]:
                self._waiting.remove(due)
                self._raw[due[1]] = due[2]
            hold(self._n, self._valve, self._y, self._work, self._anchors, self._plays,
                 self._raw, self._motion, self._limb, self._pulls, self._done, fine)
            self._done += fine

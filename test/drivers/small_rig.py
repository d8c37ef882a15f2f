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
A small independent model of the rig for the driver tests, written from the equations.

Plain Python, fixed 1 ms steps: muscle force map, 5 kg hanging mass, ISO 6358 valve pair
with dead time and opening and closing times (duty-averaged), or a first-order regulator.
"""

from collections import deque
import math
import random

P_ATM = 101_325.0
RT = 287.05 * 293.15


def force(p_pa, contraction_m):
    """Return the muscle force [N]."""
    p = (p_pa - P_ATM) * 1e-3
    e = 100.0 * contraction_m / 0.3
    return max(0.0, (-0.00680486 * p + 46.3339) * math.exp(-0.42779 * e)
               - 0.00817055 * e * p + 0.256907 * p - 56.3953)


def volume(x):
    """Return the volume [m^3] with dead volume, and its slope [m^2]."""
    angle = math.radians(28.6)
    thread = 0.3 / math.cos(angle)
    turns = 0.3 * math.tan(angle) / (math.pi * 0.005)
    length = 0.3 - x
    scale = 4.0 * math.pi * turns ** 2
    return length * (thread ** 2 - length ** 2) / scale + 3.0e-6, (
        3.0 * length ** 2 - thread ** 2) / scale


def flow(c, up, down):
    """Return the mass flow [kg/s] of an open valve."""
    r = down / up
    if r >= 1.0:
        return 0.0
    psi = 1.0 if r <= 0.38 else math.sqrt(max(0.0, 1.0 - ((min(r, 0.999) - 0.38) / 0.62) ** 2))
    if r > 0.999:
        psi *= (1.0 - r) / 0.001
    return c * 1.185 * up * psi


class SmallRig:
    """The rig in 1 ms steps; ``measured_pa`` adds noise."""

    def __init__(self, dead_time_s=0.03, open_s=0.0017, close_s=0.002, c=2e-10,
                 supply_pa=801_325.0, noise_pa=300.0, leak=0.0, extra_m3=0.0, seed=1,
                 hysteresis=True):
        """Start at rest and at atmospheric pressure."""
        self.p, self.x, self.v, self.time_s = P_ATM, 0.0, 0.0, 0.0
        self.c, self.supply_pa, self.leak, self.extra_m3 = c, supply_pa, leak, extra_m3
        self.open_s, self.close_s = open_s, close_s
        self.line = deque([(0.0, 0.0)] * (round(dead_time_s / 0.001) + 1))
        self.noise_pa = noise_pa
        self.slip = [0.0] * 4 if hysteresis else []
        self.random = random.Random(seed)

    def _opening(self, duty):
        if duty <= self.open_s / 0.01:
            return 0.0
        if (1.0 - duty) * 0.01 < self.close_s:
            return 1.0
        return min(1.0, duty + (self.close_s - self.open_s) / 0.01)

    def step(self, fill, vent):
        """Go on by 1 ms."""
        self.line.append((fill, vent))
        self.line.popleft()
        fill, vent = (self._opening(d) for d in self.line[0])
        for _ in range(2):
            self._substep(fill, vent, 0.0005)
        self.time_s += 0.001

    def _substep(self, fill, vent, dt):
        vol, slope = volume(self.x)
        net = (fill * flow(self.c, self.supply_pa, self.p)
               - vent * flow(self.c, self.p, P_ATM) - flow(self.leak, self.p, P_ATM))
        rate = (RT * net - self.p * slope * self.v) / (vol + self.extra_m3)
        self.p = max(P_ATM, self.p + rate * dt)
        level = 0.5 + 4.5e-6 * (self.p - P_ATM)
        dry = level * sum(w * z for w, z in zip((0.25, 0.3, 0.25, 0.2), self.slip))
        acc = (force(self.p, self.x) - 25.0 * self.v - dry) / 5.0 - 9.80665
        self.v += acc * dt
        self.x += self.v * dt
        for i, width in enumerate((1e-4, 4e-4, 1.2e-3, 3e-3)[:len(self.slip)]):
            self.slip[i] = min(1.0, max(-1.0, self.slip[i] + self.v * dt / width))
        if self.x <= 0.0 or self.x >= 0.075:
            self.x, self.v = min(max(self.x, 0.0), 0.075), 0.0

    def measured_pa(self):
        """Return a reading with noise."""
        return self.p + self.random.gauss(0.0, self.noise_pa)

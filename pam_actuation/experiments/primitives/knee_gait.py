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
Walk: the contraction of a knee flexor over strides.

The curve is a design profile, not measured data: five harmonics drawn through the landmarks of
level walking that every text on gait shows (for instance D. A. Winter, Biomechanics and Motor
Control of Human Movement, chapter 3). The leg is nearly straight at heel contact and flexes by
about 19 degrees while it is loaded. 6 degrees follow in mid-stance, about 61 degrees in swing and
3 degrees just before the next contact.
"""

from dataclasses import dataclass
import math

from pam_actuation.experiments.primitives.base import key, Primitive

# Knee flexion in degrees: mean, then (cosine, sine) of each harmonic of the stride, which
# begins with heel contact.
MEAN_DEG = 22.8
HARMONICS_DEG = ((-3.8, -18.4), (-13.5, 8.3), (-0.4, 4.5), (0.2, 0.2), (-0.6, 0.6))


def knee_flexion_deg(stride: float) -> tuple[float, float]:
    """Return knee flexion [degrees] and its rate per stride; 0 and 1 are heel contacts."""
    angle, rate = MEAN_DEG, 0.0
    for k, (c, s) in enumerate(HARMONICS_DEG, start=1):
        w = 2.0 * math.pi * k
        angle += c * math.cos(w * stride) + s * math.sin(w * stride)
        rate += w * (s * math.cos(w * stride) - c * math.sin(w * stride))
    return angle, rate


def _straightest() -> float:
    """Return the place in the stride where the knee is straightest, by bisection of the rate."""
    below, above = 0.93, 0.999
    for _ in range(60):
        middle = 0.5 * (below + above)
        if knee_flexion_deg(middle)[1] < 0.0:
            below = middle
        else:
            above = middle
    return above


BEGIN = _straightest()
LOWEST_DEG = knee_flexion_deg(BEGIN)[0]
HIGHEST_DEG = max(knee_flexion_deg(k / 2000.0)[0] for k in range(2000))


@dataclass
class KneeGait(Primitive):
    """
    Level walking: from ``low`` with a straight knee to ``high`` at the largest flexion.

    A flexor on a lever of constant length shortens in proportion to the angle. Begins and
    ends at ``low`` with rate 0, just before heel contact.
    """

    QUANTITIES = ('low', 'high')
    start: float
    low: float = key('value of the straightest knee')
    high: float = key('value of the most flexed knee')
    frequency_hz: float = key('strides per second, 0.5 to 1.2')
    cycles: int = key('number of strides')

    def problem(self) -> str:
        """Refuse what is no walking."""
        if not 0.5 <= self.frequency_hz <= 1.2:
            return f'frequency_hz is {self.frequency_hz:g}; walking is 0.5 to 1.2 Hz'
        return '' if self.low < self.high else 'low must be below high'

    @property
    def duration_s(self) -> float:
        """Length of all strides together."""
        return int(self.cycles) / self.frequency_hz

    @property
    def periods(self) -> tuple[float, int]:
        """Return (length of a stride in s, strides)."""
        return 1.0 / self.frequency_hz, int(self.cycles)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return value and rate."""
        angle, rate = knee_flexion_deg(BEGIN + t_s * self.frequency_hz)
        scale = (self.high - self.low) / (HIGHEST_DEG - LOWEST_DEG)
        return self.low + scale * (angle - LOWEST_DEG), scale * rate * self.frequency_hz


PRIMITIVE = KneeGait

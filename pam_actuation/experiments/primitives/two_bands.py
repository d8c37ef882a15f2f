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

"""Repeat one motion in a low and in a high band."""

from dataclasses import dataclass

from pam_actuation.experiments.primitives.base import key, least_jerk, Primitive, raised_cosine


@dataclass
class TwoBands(Primitive):
    """The same sine about a low and then about a high centre, with a smooth move to each."""

    QUANTITIES = ('low_center', 'high_center', 'amplitude')
    start: float
    low_center: float = key('centre of the low band')
    high_center: float = key('centre of the high band')
    amplitude: float = key('half of the way from end to end')
    frequency_hz: float = key('repetitions per second')
    cycles: int = key('how often it is repeated in each band')
    move_s: float = key('time of the move to each band')

    def problem(self) -> str:
        """Refuse bands in the wrong order."""
        return '' if self.low_center < self.high_center else (
            'low_center must be below high_center')

    @property
    def band_s(self) -> float:
        """Length of a move and the cycles that follow."""
        return self.move_s + int(self.cycles) / self.frequency_hz

    @property
    def duration_s(self) -> float:
        """Length of both bands."""
        return 2.0 * self.band_s

    def at(self, t_s: float) -> tuple[float, float]:
        """Return value and rate; each band begins and ends at its lowest point."""
        lows = (self.low_center - self.amplitude, self.high_center - self.amplitude)
        second = bool(t_s >= self.band_s)       # of a NumPy time it is no index
        left = min(t_s, self.duration_s) - (self.band_s if second else 0.0)
        if left < self.move_s:
            return least_jerk(lows[0] if second else self.start, lows[second], self.move_s, left)
        center = self.high_center if second else self.low_center
        return raised_cosine(center, self.amplitude, self.frequency_hz, left - self.move_s)


PRIMITIVE = TwoBands

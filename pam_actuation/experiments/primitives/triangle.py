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

"""Move at constant rate between two values."""

from dataclasses import dataclass

from pam_actuation.experiments.primitives.base import key, Primitive


@dataclass
class Triangle(Primitive):
    """Triangle between two values at constant rate, starting from ``low``."""

    QUANTITIES = ('low', 'high')
    start: float
    low: float = key('lower end')
    high: float = key('upper end')
    period_s: float = key('time to and fro')
    cycles: float = key('how often it is repeated')

    @property
    def duration_s(self) -> float:
        """Length of all cycles together."""
        return self.period_s * self.cycles

    @property
    def periods(self) -> tuple[float, int]:
        """Return (period in s, whole cycles)."""
        return self.period_s, int(self.cycles)

    def problem(self) -> str:
        """Refuse two values in the wrong order."""
        return '' if self.low < self.high else 'low must be below high'

    def at(self, t_s: float) -> tuple[float, float]:
        """Return value and rate of the triangle."""
        phase = (t_s / self.period_s) % 1.0
        if t_s >= self.duration_s:
            phase = self.cycles % 1.0
        slope = 2.0 * (self.high - self.low) / self.period_s
        if phase < 0.5:
            return self.low + (self.high - self.low) * 2.0 * phase, slope
        return self.high - (self.high - self.low) * (2.0 * phase - 1.0), -slope


PRIMITIVE = Triangle

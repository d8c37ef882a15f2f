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

"""Climb equal steps."""

from dataclasses import dataclass

from pam_actuation.experiments.primitives.base import key, Primitive


@dataclass
class Staircase(Primitive):
    """Equal steps from one value to another, each held for ``hold_s``."""

    JUMPS = True
    QUANTITIES = ('low', 'high')
    start: float
    low: float = key('value of the first stair')
    high: float = key('value of the last stair')
    steps: int = key('number of jumps; the holds are one more')
    hold_s: float = key('time of each hold')

    @property
    def duration_s(self) -> float:
        """Length of all holds together."""
        return self.hold_s * (int(self.steps) + 1)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return the value of the present stair and rate 0; high may be below low."""
        k = min(int(t_s / self.hold_s), int(self.steps))
        return self.low + (self.high - self.low) * k / int(self.steps), 0.0


PRIMITIVE = Staircase

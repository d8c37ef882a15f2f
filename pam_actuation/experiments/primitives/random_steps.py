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

"""Jump at random."""

from dataclasses import dataclass

from pam_actuation.experiments.primitives.base import key, Primitive
from pam_actuation.random_levels import RandomLevels


@dataclass
class RandomSteps(Primitive):
    """Steps to uniformly random values, held for uniformly random times."""

    JUMPS = True
    QUANTITIES = ('low', 'high')
    start: float
    low: float = key('lowest value')
    high: float = key('highest value')
    min_hold_s: float = key('shortest hold')
    max_hold_s: float = key('longest hold')
    duration_s: float = key('how long it lasts')
    seed: int = key('of the random numbers', default=1)

    def problem(self) -> str:
        """Refuse values and holds in the wrong order."""
        if not self.low < self.high:
            return 'low must be below high'
        return '' if self.min_hold_s <= self.max_hold_s else (
            'min_hold_s must not be above max_hold_s')

    def __post_init__(self) -> None:
        """Draw all steps once, from the seed."""
        if not self.problem():
            self._levels = RandomLevels(
                self.low, self.high, self.min_hold_s, self.max_hold_s, self.duration_s, self.seed)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return the value of the present step and rate 0."""
        return self._levels.at(t_s), 0.0


PRIMITIVE = RandomSteps

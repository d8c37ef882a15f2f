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

import bisect
from dataclasses import dataclass

import numpy as np
from pam_actuation.experiments.primitives.base import Primitive


@dataclass
class RandomSteps(Primitive):
    """Steps to uniformly random values, held for uniformly random times."""

    JUMPS = True
    QUANTITIES = ('low', 'high')
    start: float
    low: float
    high: float
    min_hold_s: float
    max_hold_s: float
    duration_s: float
    seed: int = 1

    def problem(self):
        """Refuse values and holds in the wrong order."""
        if not self.low < self.high:
            return 'low must be below high'
        return '' if self.min_hold_s <= self.max_hold_s else (
            'min_hold_s must not be above max_hold_s')

    def __post_init__(self):
        """Draw all steps once, from the seed."""
        self._times, self._values = [], []
        if self.problem():
            return
        rng = np.random.default_rng(int(self.seed))
        t = 0.0
        while t < self.duration_s:
            self._times.append(t)
            self._values.append(float(rng.uniform(self.low, self.high)))
            t += max(float(rng.uniform(self.min_hold_s, self.max_hold_s)), 0.01)

    def at(self, t_s):
        """Return the value of the present step and rate 0."""
        return self._values[max(bisect.bisect_right(self._times, t_s) - 1, 0)], 0.0


PRIMITIVE = RandomSteps

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

"""Levels drawn at random, each held for a random time: an excitation for identification."""

import bisect
from dataclasses import dataclass, field

import numpy as np

SHORTEST_HOLD_S = 0.01


@dataclass
class RandomLevels:
    """
    Uniformly distributed levels, held for uniformly distributed times.

    Parameters
    ----------
    low, high : float
        Range of the levels, in any unit.
    min_hold_s, max_hold_s : float
        Range of the holds; none is shorter than ``SHORTEST_HOLD_S``.
    duration_s : float
        Levels are drawn for so long.
    seed : int
        The same seed gives the same levels.

    """

    low: float
    high: float
    min_hold_s: float
    max_hold_s: float
    duration_s: float
    seed: int
    _times: list[float] = field(default_factory=list, init=False, repr=False)
    _values: list[float] = field(default_factory=list, init=False, repr=False)

    def __post_init__(self) -> None:
        """Draw all levels once."""
        rng = np.random.default_rng(int(self.seed))
        t = 0.0
        while t < self.duration_s:
            self._times.append(t)
            self._values.append(float(rng.uniform(self.low, self.high)))
            t += max(float(rng.uniform(self.min_hold_s, self.max_hold_s)), SHORTEST_HOLD_S)

    def at(self, t_s: float) -> float:
        """Return the level at a time [s]; outside of all holds the nearest one."""
        return self._values[max(bisect.bisect_right(self._times, t_s) - 1, 0)]

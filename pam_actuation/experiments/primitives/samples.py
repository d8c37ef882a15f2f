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
"""Follow values given one by one, such as a motion that was measured."""

from dataclasses import dataclass
from functools import cached_property

from pam_actuation.experiments.primitives.base import key, Primitive
from pam_actuation.experiments.smooth_path import smooth_path

MOST_VALUES = 15_000        # the text of an experiment stays below what a file may have


@dataclass
class Samples(Primitive):
    """
    Smooth through values at equal distances of time; never beyond the smallest and the largest.

    Between them the path is a cubic spline, and beside a step a monotone cubic (``smooth_path``).
    With several cycles the last value must be the first, and the cycles follow one another
    without a corner.
    """

    QUANTITIES = ('values',)
    start: float
    values: list[float] = key('the values in order, at least two')
    every_s: float = key('time from one value to the next')
    cycles: int = key('how often it is repeated', 1)

    def problem(self) -> str:
        """Refuse too few or too many values, and a cycle that does not close."""
        if not 2 <= len(self.values) <= MOST_VALUES:
            return f'has {len(self.values)} values; allowed are 2 to {MOST_VALUES}'
        if self.cycles > 1 and self.values[0] != self.values[-1]:
            return (f'begins with {self.values[0]:g} and ends with {self.values[-1]:g}; with '
                    f'{self.cycles:g} cycles the last value must be the first')
        return ''

    @property
    def period_s(self) -> float:
        """Time of one cycle [s]."""
        return (len(self.values) - 1) * self.every_s

    @property
    def duration_s(self) -> float:
        """Length of all cycles together."""
        return self.period_s * int(self.cycles)

    @property
    def periods(self) -> tuple[float, int] | None:
        """Return (period in s, cycles), None where nothing is repeated."""
        return (self.period_s, int(self.cycles)) if self.cycles > 1 else None

    @cached_property
    def _cubics(self) -> list[list[float]]:
        """Return the four coefficients of each interval, highest power first; time in s."""
        import numpy as np
        path = smooth_path(np.arange(len(self.values)) * self.every_s, np.array(self.values),
                           self.cycles > 1)
        cubics: list[list[float]] = path.c.T.tolist()
        return cubics

    @cached_property
    def _range(self) -> tuple[float, float]:
        """Return the smallest and the largest value."""
        return min(self.values), max(self.values)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return value and rate."""
        t_s = min(max(t_s, 0.0), self.duration_s)
        if t_s >= self.duration_s - 1e-9:
            a, b, c, _ = self._cubics[-1]
            return self.values[-1], (3.0 * a * self.every_s + 2.0 * b) * self.every_s + c
        t_s %= self.period_s
        place = min(int(t_s / self.every_s), len(self._cubics) - 1)
        a, b, c, d = self._cubics[place]
        s = t_s - place * self.every_s
        low, high = self._range
        value = min(max(((a * s + b) * s + c) * s + d, low), high)
        return value, (3.0 * a * s + 2.0 * b) * s + c


PRIMITIVE = Samples

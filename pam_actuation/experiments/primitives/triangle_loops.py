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

"""Turn back within a slow triangle: nested hysteresis loops."""

from dataclasses import dataclass

from pam_actuation.experiments.primitives.base import along, key, Primitive


@dataclass
class TriangleLoops(Primitive):
    """Slow triangle with inner loops: at even places it turns back by ``depth``."""

    QUANTITIES = ('low', 'high', 'depth')
    start: float
    low: float = key('lower end')
    high: float = key('upper end')
    depth: float = key('how far each inner loop turns back')
    loops: int = key('inner loops on each branch')
    period_s: float = key('time to and fro without the inner loops')
    cycles: int = key('how often it is repeated', default=1)

    def problem(self) -> str:
        """Refuse loops that would not lie within the triangle."""
        if not self.low < self.high:
            return 'low must be below high'
        longest = (self.high - self.low) / (self.loops + 1)
        if not 0.0 < self.depth <= longest:
            return (f'depth is {self.depth:g}; with loops {self.loops:g} allowed is above 0, to '
                    f'{longest:g}, the distance of two turning points')
        return ''

    def __post_init__(self) -> None:
        """Lay the path through all turning points of one cycle."""
        share = (self.high - self.low) / (self.loops + 1)
        path = [self.low]
        for k in range(1, int(self.loops) + 1):
            turn = self.low + k * share
            path += [turn, turn - self.depth, turn]
        path.append(self.high)
        for k in range(1, int(self.loops) + 1):
            turn = self.high - k * share
            path += [turn, turn + self.depth, turn]
        self._path = [*path, self.low]

    @property
    def rate(self) -> float:
        """Speed on the whole path: that of the triangle without inner loops."""
        return 2.0 * (self.high - self.low) / self.period_s

    @property
    def cycle_s(self) -> float:
        """Length of one cycle, inner loops included."""
        return self.period_s + 4.0 * int(self.loops) * self.depth / self.rate

    @property
    def duration_s(self) -> float:
        """Length of all cycles together."""
        return self.cycle_s * int(self.cycles)

    @property
    def periods(self) -> tuple[float, int]:
        """Return (length of a cycle in s, cycles)."""
        return self.cycle_s, int(self.cycles)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return value and rate."""
        if t_s >= self.duration_s:
            return self.low, 0.0
        return along(self._path, self.rate, t_s % self.cycle_s)


PRIMITIVE = TriangleLoops

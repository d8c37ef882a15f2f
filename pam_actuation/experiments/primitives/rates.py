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

"""Go the same path at several rates."""

from dataclasses import dataclass

from pam_actuation.experiments.primitives.base import along, key, Primitive


@dataclass
class Rates(Primitive):
    """The same triangle, once or more per rate, from slow to fast; periods fall geometrically."""

    QUANTITIES = ('low', 'high')
    start: float
    low: float = key('lower end')
    high: float = key('upper end')
    slow_period_s: float = key('longest time to and fro')
    fast_period_s: float = key('shortest time to and fro')
    rates: int = key('number of rates')
    cycles: int = key('how often each rate is repeated', default=1)

    def problem(self) -> str:
        """Refuse values and periods in the wrong order, and a single rate."""
        if not self.low < self.high:
            return 'low must be below high'
        if not self.fast_period_s < self.slow_period_s:
            return 'fast_period_s must be below slow_period_s'
        return '' if self.rates >= 2 else 'rates must be 2 or more'

    @property
    def all_periods_s(self) -> tuple[float, ...]:
        """Return the period of every rate [s], the slowest first."""
        ratio = self.fast_period_s / self.slow_period_s
        last = max(int(self.rates) - 1, 1)
        return tuple(self.slow_period_s * ratio ** (k / last) for k in range(int(self.rates)))

    @property
    def duration_s(self) -> float:
        """Length of all cycles at all rates together."""
        return int(self.cycles) * sum(self.all_periods_s)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return value and rate."""
        left, span = max(t_s, 0.0), self.high - self.low
        for period_s in self.all_periods_s:
            if left < period_s * int(self.cycles):
                return along((self.low, self.high, self.low), 2.0 * span / period_s,
                             left % period_s)
            left -= period_s * int(self.cycles)
        return self.low, 0.0


PRIMITIVE = Rates

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

"""A trajectory between its points: the cubic through positions and rates, or a straight line."""

from bisect import bisect_right
import math
from typing import NamedTuple, TYPE_CHECKING

if TYPE_CHECKING:
    from pam_actuation.messages import AngleTrajectory, ReferenceTrajectory

    Trajectory = ReferenceTrajectory | AngleTrajectory


class Course(NamedTuple):
    """
    A trajectory with its points one by one.

    Parameters
    ----------
    message : ReferenceTrajectory or AngleTrajectory
    times_ns : tuple of int
        When each point holds.
    values : tuple of float
        Of the tracked quantity.
    rates : tuple of float
        Per second; empty, or not finite, where none is told.

    """

    message: 'Trajectory'
    times_ns: tuple[int, ...]
    values: tuple[float, ...]
    rates: tuple[float, ...]

    def at(self, time_ns: int, jump_per_s: float) -> tuple[float, float]:
        """
        Return value and rate per second at a time, straight beyond the ends.

        A change that exceeds the rates of both points by ``jump_per_s`` is a jump: the first
        point holds until the time of the second.
        """
        times, values = self.times_ns, self.values
        after = bisect_right(times, time_ns)
        if after == 0 or after == len(times):
            i = 0 if after == 0 else after - 1
            rate = self._rate(i)
            return values[i] + rate * (time_ns - times[i]) * 1e-9, rate
        i = after - 1
        span_s = (times[after] - times[i]) * 1e-9
        part = (time_ns - times[i]) * 1e-9 / span_s
        x0, x1 = values[i], values[after]
        v0, v1 = self._rate(i, math.nan), self._rate(after, math.nan)
        if math.isnan(v0) or math.isnan(v1):
            return x0 + (x1 - x0) * part, (x1 - x0) / span_s
        if abs((x1 - x0) / span_s - 0.5 * (v0 + v1)) > jump_per_s:
            return x0 + v0 * part * span_s, v0
        a, b = span_s * v0 - (x1 - x0), (x1 - x0) - span_s * v1
        bend = part * (1.0 - part) * ((1.0 - part) * a + part * b)
        slope = ((1.0 - 2.0 * part) * ((1.0 - part) * a + part * b)
                 + part * (1.0 - part) * (b - a))
        return x0 + (x1 - x0) * part + bend, ((x1 - x0) + slope) / span_s

    def _rate(self, index: int, missing: float = 0.0) -> float:
        """Return the rate of a point, ``missing`` where there is none."""
        rates = self.rates
        if index < len(rates) and math.isfinite(rates[index]):
            return rates[index]
        return missing

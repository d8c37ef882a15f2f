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
from operator import sub
from typing import NamedTuple, TYPE_CHECKING

if TYPE_CHECKING:
    from pam_actuation.messages import AngleTrajectory, NamedTrajectory, ReferenceTrajectory

    Trajectory = ReferenceTrajectory | AngleTrajectory | NamedTrajectory


class Course(NamedTuple):
    """
    A trajectory with its points one by one.

    Parameters
    ----------
    message : ReferenceTrajectory, AngleTrajectory or NamedTrajectory
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
        if _is_jump(x1 - x0, span_s, v0, v1, jump_per_s):       # never where a rate is not told
            return x0 + v0 * part * span_s, v0
        return joined(x0, x1, v0, v1, span_s, part)

    def beyond(self, lower: float, upper: float, jump_per_s: float) -> tuple[int, float] | None:
        """
        Return when it first leaves a range between its points, and to what value; None: never.

        Its points lie within the range; where they are joined by straight lines, so does the rest.
        """
        times, values = self.times_ns, self.values
        # How far a cubic may reach beyond the values of its points.
        reach = self._fastest() * max(map(sub, times[1:], times), default=0) * 1e-9
        if lower <= min(values) - reach and max(values) + reach <= upper:
            return None
        for i, (x0, x1) in enumerate(zip(values, values[1:])):
            v0, v1 = self._rate(i, math.nan), self._rate(i + 1, math.nan)
            span_s = (times[i + 1] - times[i]) * 1e-9
            # A cubic stays within the hull of its four control points.
            hull = x0 + span_s * v0 / 3.0, x0 + span_s * v0, x1 - span_s * v1 / 3.0
            if math.isnan(v0 + v1) or lower <= min(hull) <= max(hull) <= upper:
                continue
            a, b = span_s * v0 - (x1 - x0), (x1 - x0) - span_s * v1
            parts = sorted(_zeros(3.0 * (a - b), 2.0 * (b - 2.0 * a), span_s * v0))
            if _is_jump(x1 - x0, span_s, v0, v1, jump_per_s):
                parts = [1.0 - 1e-9]        # it is farthest out just before
            for part in parts:
                time_ns = times[i] + int(part * (times[i + 1] - times[i]))
                value, _ = self.at(time_ns, jump_per_s)
                if not lower <= value <= upper:
                    return time_ns, value
        return None

    def contradiction(self, jump_per_s: float) -> tuple[int, float, float] | None:
        """
        Return time, told rate and that of the positions where the rates belong to another motion.

        None where they do not. They do where most segments that are told to move faster than
        ``jump_per_s`` move slower than told by more than that. A jump is faster than told.
        """
        if self._fastest() <= jump_per_s:
            return None
        fast, found = 0, []
        for i in range(len(self.times_ns) - 1):
            told = 0.5 * (self._rate(i, math.nan) + self._rate(i + 1, math.nan))
            if not abs(told) > jump_per_s:
                continue
            fast += 1
            moves = (self.values[i + 1] - self.values[i]) / (
                (self.times_ns[i + 1] - self.times_ns[i]) * 1e-9)
            if abs(told) - abs(moves) > jump_per_s:
                found.append((self.times_ns[i], told, moves))
        return found[0] if 2 * len(found) > fast else None

    def _fastest(self) -> float:
        """Return the highest rate that is told, 0 where none is."""
        return max(map(abs, filter(math.isfinite, self.rates)), default=0.0)

    def _rate(self, index: int, missing: float = 0.0) -> float:
        """Return the rate of a point, ``missing`` where there is none."""
        rates = self.rates
        if index < len(rates) and math.isfinite(rates[index]):
            return rates[index]
        return missing


def joined(x0: float, x1: float, v0: float, v1: float, span_s: float,
           part: float) -> tuple[float, float]:
    """
    Return value and rate per second between two points ``span_s`` apart.

    They are joined by a cubic, by a straight line where a rate is NaN. ``part`` is that of the
    time between them, 0 to 1.
    """
    if math.isnan(v0) or math.isnan(v1):
        return x0 + (x1 - x0) * part, (x1 - x0) / span_s
    a, b = span_s * v0 - (x1 - x0), (x1 - x0) - span_s * v1
    bend = part * (1.0 - part) * ((1.0 - part) * a + part * b)
    slope = ((1.0 - 2.0 * part) * ((1.0 - part) * a + part * b)
             + part * (1.0 - part) * (b - a))
    return x0 + (x1 - x0) * part + bend, ((x1 - x0) + slope) / span_s


def _is_jump(change: float, span_s: float, v0: float, v1: float, jump_per_s: float) -> bool:
    """Return whether a change is more than the rates before and after it explain."""
    return abs(change / span_s - 0.5 * (v0 + v1)) > jump_per_s


def _zeros(square: float, linear: float, constant: float) -> list[float]:
    """Return where between 0 and 1 a polynomial of second order is zero."""
    root = linear * linear - 4.0 * square * constant
    if root < 0.0:
        return []
    far = -0.5 * (linear + math.copysign(math.sqrt(root), linear))
    zeros = [top / bottom for top, bottom in ((far, square), (constant, far)) if bottom != 0.0]
    return [zero for zero in zeros if 0.0 < zero < 1.0]

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

"""A chain of primitives in one domain: a value and its rate over time."""

import bisect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Any, TYPE_CHECKING

from pam_actuation.control.modes import tracked
from pam_actuation.experiments.primitives import make_primitive
from pam_sim.errors import InputError
from pam_sim.units import allowed_range, P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.experiments.primitives.base import Primitive

CHECK_EVERY_S = 0.01        # as often as the reference is sent
_MOST_CHECKS = 100_000
_ROUNDING_S = 1e-9          # of times that are sums
_SHOWN = {'pa': 'Pa', 'n': 'N', 'v': 'V'}       # units as people write them
LONGEST_S = 6 * 3600.0


@dataclass(frozen=True)
class Domain:
    """
    What a value means.

    ``unit`` is its suffix in files, ``rest`` the rest value and ``lower``..``upper`` its range.
    ``fastest`` is the highest rate per second of a value that does not jump. It is a design value,
    beyond what any muscle or valve of this kind follows.
    """

    name: str
    unit: str
    rest: float
    lower: float
    upper: float
    fastest: float


# In a file: hsv_duty above 0 is the duty of the filling valve, below 0 of the venting one.
DOMAINS = {d.name: d for d in (
    Domain('contraction', 'm', 0.0, 0.0, 0.25, tracked.CONTRACTION.fastest),
    Domain('force', 'n', 0.0, 0.0, 10_000.0, tracked.FORCE.fastest),
    Domain('joint_angle', 'rad', 0.0, -3.15, 3.15, tracked.JOINT.fastest),
    Domain('pressure', 'pa', P_ATM_PA, P_ATM_PA, 1_300_000.0, 2e7),
    Domain('ppr_voltage', 'v', 0.0, 0.0, 12.0, 200.0),      # a rig: to its ppr_highest_v
    Domain('hsv_duty', 'duty', -1.0, -1.0, 1.0, 100.0),
)}
FORCE = Domain('disturbance', 'n', 0.0, -200.0, 200.0, 10_000.0)


TRACKED = ('contraction', 'force')      # domains that a controller of one muscle tracks


Segment = tuple[str, Mapping[str, Any], str]      # name, arguments, place in the file


class Chain:
    """
    Primitives one after another, each from where the former ended.

    Parameters
    ----------
    domain : Domain
        What the values mean.
    segments : list of (name, arguments, where)
        The primitives in order, with the keys of the file and ``file:line``.
    stop_after_s : float, optional
        End before the last primitive does. All are checked; what follows is then left out.

    Raises
    ------
    InputError
        Unknown primitive or key; a value or rate outside the domain's range, or that cannot be
        calculated.

    """

    def __init__(self, domain: Domain, segments: Sequence[Segment],
                 stop_after_s: float | None = None) -> None:
        self.domain = domain
        self.segments: list[Primitive] = []
        self._starts: list[float] = []
        self._raw = [(name, dict(arguments or {})) for name, arguments, _ in segments]
        value, t = domain.rest, 0.0
        for name, arguments, where in segments:
            try:
                primitive = make_primitive(
                    name, arguments, value, domain.rest, domain.unit, where, domain.name)
                t += primitive.duration_s
                if t > LONGEST_S:
                    raise InputError(
                        f'after {name} the experiment is {t:.6g} s long; allowed is up to '
                        f'{LONGEST_S:g} s', where)
                self._check_range(primitive, name, where)
                value = primitive.end
            except InputError:
                raise
            except (ArithmeticError, ValueError) as error:
                raise InputError(
                    f'{name} cannot be calculated with these keys: {error}', where) from error
            self.segments.append(primitive)
            self._starts.append(t - primitive.duration_s)
        self.whole_s = t
        self.duration_s = t if stop_after_s is None else min(stop_after_s, t)
        played = bisect.bisect_left(self._starts, self.duration_s - _ROUNDING_S)
        del self.segments[played:], self._starts[played:]
        last, left = self.segments[-1], self.duration_s - self._starts[-1]
        self._end = last.end if left >= last.duration_s - _ROUNDING_S else last.at(left)[0]

    def _check_range(self, primitive: 'Primitive', name: str, where: str) -> None:
        domain, duration_s = self.domain, primitive.duration_s
        unit = _SHOWN.get(domain.unit, domain.unit)
        count = min(max(round(duration_s / CHECK_EVERY_S), 200), _MOST_CHECKS)
        samples = [(duration_s * k / count, *primitive.at(duration_s * k / count))
                   for k in range(count + 1)]
        # By the value that is farthest out, the last of equal ones: what a person has written.
        beyond, t, worst = max(
            (math.inf if math.isnan(value) else max(domain.lower - value, value - domain.upper),
             t, value) for t, value, _ in samples)
        if beyond > 1e-9:
            allowed = allowed_range(domain.lower, domain.upper, unit)
            raise InputError(
                f'{name} reaches {worst:.6g} {unit} after {t:.3g} s; allowed for '
                f'{domain.name} is {allowed}', where)
        # Between two of these as well: a spike of one value is at rest on it.
        halves = [duration_s * (k + 0.5) / count for k in range(count)]
        for t, rate in (*((t, rate) for t, _, rate in samples),
                        *((t, primitive.at(t)[1]) for t in halves)):
            if not abs(rate) <= domain.fastest:
                raise InputError(
                    f'{name} moves at {abs(rate):.4g} {unit}/s after {t:.3g} s; allowed '
                    f'for {domain.name} is up to {domain.fastest:g} {unit}/s', where)

    def _index(self, t_s: float) -> int:
        return max(bisect.bisect_right(self._starts, t_s) - 1, 0)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return (value, rate) at t_s since the start; outside, the end values at rest."""
        if t_s < 0.0:
            return self.segments[0].at(0.0)[0], 0.0
        if t_s >= self.duration_s:
            return self._end, 0.0
        k = self._index(t_s)
        return self.segments[k].at(t_s - self._starts[k])

    def shuts_valve(self, t_s: float) -> bool:
        """Tell whether the primitive at t_s shuts the valve; never outside the chain."""
        return 0.0 <= t_s < self.duration_s and self.segments[self._index(t_s)].SHUTS_VALVE

    @property
    def periodic_parts(self) -> tuple[tuple[float, float, int], ...]:
        """Return (start_s, period_s, count of whole periods) of every periodic primitive."""
        found = [(start, *segment.periods)
                 for start, segment in zip(self._starts, self.segments) if segment.periods]
        end = self.duration_s + _ROUNDING_S
        return tuple((start, period_s, min(count, int((end - start) / period_s)))
                     for start, period_s, count in found)

    def extremes(self) -> tuple[float, float]:
        """Return the lowest and highest value, looked at every 10 ms."""
        count = min(max(round(self.duration_s / CHECK_EVERY_S), 1), _MOST_CHECKS)
        values = [self.at(self.duration_s * k / count)[0] for k in range(count + 1)]
        return min(values), max(values)

    def jumps(self, least: float) -> list[tuple[float, str, float, float]]:
        """
        Return where the value jumps by more than ``least`` although no step is asked for.

        A list of (time [s], name of the primitive that begins there, value before, value after).
        """
        found, before = [], self.domain.rest
        for (name, _), segment, start in zip(self._raw, self.segments, self._starts):
            after = segment.at(0.0)[0]
            if abs(after - before) > least and not segment.JUMPS:
                found.append((start, name, before, after))
            before = segment.end
        return found

    def share_above(self, limit: float) -> float:
        """Return the share of the time, 0 to 1, in which the value is above a limit."""
        count = min(max(round(self.duration_s / CHECK_EVERY_S), 1), _MOST_CHECKS)
        return sum(self.at(self.duration_s * k / count)[0] > limit
                   for k in range(count + 1)) / (count + 1)

    def plain(self) -> list[dict[str, Any]]:
        """Return the list of segments as it stands in a file."""
        return [{name: arguments} for name, arguments in self._raw]

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

"""
What messages on ``reference`` and ``reference_trajectory`` ask for, and why some are not usable.

A message has a position (of a muscle its contraction, of a joint its angle) or an effort, as its
ROS type calls them. One of the other kind has nothing for the controller.
"""

import math
from typing import Any, NamedTuple

from pam_actuation.control.course import Course
from pam_actuation.control.modes.tracked import CONTRACTION, FORCE, JOINT, Tracked


class _Kind(NamedTuple):
    """Attribute of the value, its ROS field, attribute of the rate; the same of the other kind."""

    value: str
    ros: str
    rate: str | None
    other: str | None
    other_ros: str


_KINDS = {
    CONTRACTION: _Kind('contraction_m', 'position', 'velocity_m_per_s', 'force_n', 'effort'),
    FORCE: _Kind('force_n', 'effort', None, 'contraction_m', 'position'),
    JOINT: _Kind('angle_rad', 'position', 'rate_rad_per_s', None, '')}
_UNITS = {CONTRACTION: 'm', FORCE: 'N', JOINT: 'rad'}


class ReferenceValues:
    """
    The values of references of one tracked quantity.

    Parameters
    ----------
    tracked : Tracked
    allowed : tuple of float
        Lowest and highest value.
    jump_per_s : float
        As of ``Course``.

    """

    def __init__(self, tracked: Tracked, allowed: tuple[float, float],
                 jump_per_s: float = math.inf) -> None:
        self._kind, self._unit = _KINDS[tracked], _UNITS[tracked]
        self._follows = 'an angle' if tracked == JOINT else f'a {tracked.mode}'
        self._lower, self._upper = allowed
        self._fastest, self._jump_per_s = tracked.fastest, jump_per_s

    def of(self, message: Any) -> Any:
        """Return what a message asks for: a number, of a trajectory a tuple of them."""
        return getattr(message, self._kind.value)

    def rate_of(self, message: Any, missing: Any) -> Any:
        """Return the rate of a message (of a trajectory a tuple), ``missing`` without any."""
        return missing if self._kind.rate is None else getattr(message, self._kind.rate)

    def why_not(self, message: Any) -> str:
        """Return why a ``Reference`` or ``AngleReference`` is not usable, '' if it is."""
        other = self._kind.other
        if math.isnan(self.of(message)) and other and math.isfinite(getattr(message, other)):
            return self._wrong_kind('a reference')
        return self._unusable('a reference', self.of(message)) or self._too_fast(
            'a reference', self.rate_of(message, math.nan))

    def why_not_trajectory(self, message: Any) -> str:
        """Return why a trajectory is not usable, '' if it is."""
        times, values = message.time_from_start_ns, self.of(message)
        if not times:
            return 'a trajectory has no points'
        if not values and self._kind.other and getattr(message, self._kind.other):
            return self._wrong_kind('a trajectory')
        if len(times) != len(values):
            return f'a trajectory has {len(times)} times and {len(values)} {self._kind.ros}s'
        for k, (before_ns, after_ns) in enumerate(zip(times, times[1:])):
            if after_ns <= before_ns:
                return f'the time_from_start of a trajectory does not rise at points[{k + 1}]'
        whys = (self._unusable(f'points[{k}] of a trajectory', value)
                for k, value in enumerate(values))
        fast = (self._too_fast(f'points[{k}] of a trajectory', rate)
                for k, rate in enumerate(self.rate_of(message, ())))
        return next(filter(None, (*whys, *fast)), '') or self._wrong_course(message)

    def course(self, message: Any) -> Course:
        """Return a trajectory with its points one by one."""
        times = tuple(message.stamp_ns + offset for offset in message.time_from_start_ns)
        return Course(message, times, self.of(message), self.rate_of(message, ()))

    def _wrong_course(self, message: Any) -> str:
        """Return why the rates of a trajectory do not fit its positions, '' if they do."""
        course, unit = self.course(message), self._unit
        beyond = course.beyond(self._lower, self._upper, self._jump_per_s)
        if beyond is not None:
            time_ns, value = beyond
            return (f'the velocities of a trajectory lead to {self._kind.ros} {value:g} {unit} '
                    f'at time_from_start {(time_ns - message.stamp_ns) * 1e-9:.3f} s, which is '
                    f'not within {self._lower:g} to {self._upper:g} {unit}')
        contradiction = course.contradiction(self._jump_per_s)
        if contradiction is None:
            return ''
        time_ns, told, moves = contradiction
        return (f'the velocities of a trajectory do not fit its positions: from time_from_start '
                f'{(time_ns - message.stamp_ns) * 1e-9:.3f} s on {told:g} {unit}/s are told, and '
                f'the positions change by {moves:g} {unit}/s; another unit?')

    def _too_fast(self, what: str, rate: float) -> str:
        """Return why a rate is not usable, '' if it is, or is not told."""
        if abs(rate) <= self._fastest or not math.isfinite(rate):
            return ''
        unit = f'{self._unit}/s'
        return (f'{what} has velocity {rate:g} {unit}, which is not within '
                f'{-self._fastest:g} to {self._fastest:g} {unit}')

    def _wrong_kind(self, what: str) -> str:
        kind = self._kind
        return (f'{what} has {kind.other_ros} but no {kind.ros}; '
                f'this controller follows {self._follows}')

    def _unusable(self, what: str, value: float) -> str:
        """Return why a value is not usable, '' if it is."""
        ros, lower, upper, unit = self._kind.ros, self._lower, self._upper, self._unit
        if math.isnan(value):
            return f'{what} has no {ros}, or one that is not a number'
        if math.isfinite(value) and lower <= value <= upper:
            return ''
        return (f'{what} has {ros} {value:g} {unit}, which is not within '
                f'{lower:g} to {upper:g} {unit}')

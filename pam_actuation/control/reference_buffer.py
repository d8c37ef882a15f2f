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
The wanted contraction (or force, or joint angle) now and a little ahead, from what was published.

``reference`` alone is extrapolated (``reference_motion``); a ``reference_trajectory``
is interpolated (cubic through positions and rates). Rules:

* A trajectory counts while its stamp is at most ``TRAJECTORY_LIFE_S`` old and its end has not
  passed; then its times are absolute and each message replaces the former. Beyond its end the last
  point goes on with its rate. A change that exceeds the rates of both points by ``JUMP_PER_S`` is
  a jump. The first point then holds until the time of the second, so the controller sees a jump
  and not a steep ramp. One that is newer than any ``reference`` is a whole movement, sent once: it
  counts to its end.
* One that begins later counts from its first point on, in the preview as well. Until then what
  counted before goes on: a former trajectory, else the reference. It is held for that long.
* Beyond the ends of a trajectory, the allowed values bound what is wanted.
* Otherwise the newest ``reference`` counts. Its rate is trusted for ``TRUST_S``, within the
  allowed values. After that the position stands still, with a rate of zero. The preview comes back
  to it until ``LOST_S``, with the rate of that way. Nothing is known of a motion meanwhile
  (``guesses``).
* After ``LOST_S`` without either the reference is lost. The last position is held with zero rate
  until ``HOLD_S``. Then there is none and the muscle must be vented. A new message resumes at
  once.
* A reference stamped more than ``MAX_AHEAD_NS`` ahead, or a trajectory whose first point is more
  than ``TRAJECTORY_LIFE_S`` ahead, does not count: it could not grow old.
* A reference older than the one held, or one that is older than ``HOLD_S``, does not count, nor
  does a trajectory that ended so long ago. Else a sender with old stamps would vent a muscle that
  another one moves. After the clock was set back, what is held is ahead, and is dropped first.
* While a driver does not follow, what was stamped more than ``TRUST_S`` ago is dropped. A sender
  that lives goes on. Of one that does not, nothing is left that would move the muscle later.
"""

from collections.abc import Sequence
import math
from typing import TYPE_CHECKING

from pam_actuation.control.course import Course
from pam_actuation.control.modes.tracked import CONTRACTION, FORCE, JOINT, Tracked
from pam_actuation.control.reference_motion import ReferenceMotion, Scale
from pam_actuation.control.reference_values import ReferenceValues

if TYPE_CHECKING:
    from pam_actuation.control.course import Trajectory
    from pam_actuation.messages import AngleReference, Reference

    SetPoint = Reference | AngleReference

TRAJECTORY_LIFE_S = 1.0
TRUST_S = 0.2
LOST_S = 0.5
HOLD_S = 2.0
MAX_AHEAD_NS = 20_000_000       # of the stamp of any input

# By what is tracked, the rate [unit/s] beyond what the points say that is a jump. 4 rad/s are
# about 0.05 m/s on a small pulley.
JUMP_PER_S = {CONTRACTION: 0.05, FORCE: math.inf, JOINT: 4.0}

SCALES = {CONTRACTION: Scale(1e-3, 1e-3), FORCE: Scale(5.0, 2.0), JOINT: Scale(0.04, 0.05)}

NONE, FRESH, HELD, LOST, DROPPED = range(5)     # what ``state`` can be


class ReferenceBuffer:
    """
    Newest reference and trajectory; answers what is wanted at a time.

    What arrives counts at once. ``judge`` then refuses what its stamp makes unusable.

    Parameters
    ----------
    tracked : Tracked
        What the messages ask for. Those that ask for a force carry no rate of it; between
        points of a trajectory it is that of the line through them.
    allowed : tuple of float
        Lowest and highest value; a message that asks for more is refused, not followed half way.
        So is one with a rate beyond ``tracked.fastest``.

    Attributes
    ----------
    refused : int
        Messages that were not usable.
    refusal : str
        Why the newest of them was not, '' before the first.

    """

    def __init__(self, tracked: Tracked = CONTRACTION,
                 allowed: tuple[float, float] = (-math.inf, math.inf)) -> None:
        self._jump_per_s = JUMP_PER_S[tracked]
        self._values = ReferenceValues(tracked, allowed, self._jump_per_s)
        self._allowed = allowed
        self.refused = 0
        self.refusal = ''
        self._motion = ReferenceMotion(SCALES[tracked])
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self.reference: SetPoint | None = None
        self._accepted: SetPoint | None = None
        self._arrived: list[SetPoint] = []          # not judged yet
        self._followed: SetPoint | None = None      # the newest of the motion
        self._motion.forget()
        self._courses: list[Course] = []            # that count now or later, the newest last
        self._arrived_courses: list[Course] = []
        self._keeps_until_ns = 0    # what counted before a trajectory that begins later
        self._dropped = False       # since the last that counted

    def drop_stored(self, now_ns: int) -> None:
        """Forget what was stamped more than ``TRUST_S`` ago, after ``judge``."""
        oldest_ns = now_ns - round(TRUST_S * 1e9)
        if self.reference is not None and self.reference.stamp_ns < oldest_ns:
            self.reference = self._accepted = self._followed = None
            self._motion.forget()
            self._dropped = True
        kept = [course for course in self._courses if course.message.stamp_ns >= oldest_ns]
        self._dropped = self._dropped or len(kept) < len(self._courses)
        self._courses = kept

    @property
    def trajectory(self) -> 'Trajectory | None':
        """Return the newest trajectory that is held, which may begin later."""
        courses = self._arrived_courses or self._courses
        return courses[-1].message if courses else None

    def counting(self, now_ns: int) -> 'Trajectory | None':
        """Return the trajectory that counts, or was the last to; None where a reference does."""
        course = self._begun(now_ns)
        if course is None or (
                self.reference is not None and now_ns > self._counts_until_ns(course)):
            return None
        return course.message

    def set_reference(self, message: 'SetPoint') -> bool:
        """Take a ``Reference``; one that is not usable is ignored and False returned."""
        why = self._values.why_not(message)
        if why:
            return self._refuse(why)
        self._arrived.append(message)
        self.reference = message
        return True

    def _refuse(self, why: str) -> bool:
        self.refused += 1
        self.refusal = why
        return False

    def set_trajectory(self, message: 'Trajectory') -> bool:
        """
        Take a ``ReferenceTrajectory``; an unusable one is ignored and False returned.

        Usable: at least one point, equal lengths, allowed values and rates, also between the
        points, times strictly rising.
        """
        why = self._values.why_not_trajectory(message)
        if why:
            return self._refuse(why)
        self._arrived_courses.append(self._values.course(message))
        return True

    def judge(self, now_ns: int) -> None:
        """Refuse what arrived with a stamp that is too far ahead of a time or too old."""
        self.refuse_ahead(now_ns)
        self._refuse_old(now_ns)
        if self._waits(now_ns) and self.state(now_ns) in (FRESH, HELD):
            self._keeps_until_ns = self._courses[-1].times_ns[0]

    def refuse_ahead(self, now_ns: int) -> None:
        """Forget what is stamped too far ahead of a time."""
        limit_ns = now_ns + MAX_AHEAD_NS
        arrived, self._arrived = self._arrived, []
        for message in arrived:
            if message.stamp_ns > limit_ns:
                self._refuse(f'a reference is stamped more than {MAX_AHEAD_NS * 1e-9:g} s ahead')
            else:
                self._arrived.append(message)
        # The clock may have been set back: then the former one is ahead as well.
        if self._accepted is not None and self._accepted.stamp_ns > limit_ns:
            self._accepted = None
        self.reference = self._arrived[-1] if self._arrived else self._accepted
        begin_ns = now_ns + round(TRAJECTORY_LIFE_S * 1e9)
        courses, self._arrived_courses = self._arrived_courses, []
        for course in courses:
            if course.times_ns[0] > begin_ns:
                self._refuse(f'a trajectory begins more than {TRAJECTORY_LIFE_S:g} s ahead')
            else:
                self._arrived_courses.append(course)
        self._courses = [one for one in self._courses if one.times_ns[0] <= begin_ns]

    def _refuse_old(self, now_ns: int) -> None:
        """Of what arrived let count what is not too old; what was held before stays else."""
        held = self._accepted
        for message in self._arrived:
            if held is not None and message.stamp_ns < held.stamp_ns:
                self._refuse(_reference_too_old(message, now_ns) or (
                    'a reference is stamped before the newest one; is there a second sender?'))
            else:
                held = message
        if held is not None and held is not self._accepted:
            why = _reference_too_old(held, now_ns)
            if why:
                self._refuse(why)
                held = self._accepted
        self.reference = self._accepted = held
        usable: list[Course] = []
        for course in reversed(self._arrived_courses):
            why = _course_too_old(course, now_ns)
            if why:
                self._refuse(why)
                continue
            usable.append(course)
            if course.times_ns[0] <= now_ns:        # it replaces those before
                break
        self._courses = _needed((*self._courses, *reversed(usable)), now_ns)
        if self._arrived or self._arrived_courses:
            self._dropped = self._dropped and self.reference is None and not self._courses
        self._arrived, self._arrived_courses = [], []

    def uses_trajectory(self, now_ns: int) -> bool:
        """Return whether a trajectory is what counts now."""
        return self._used(now_ns, now_ns) is not None

    def _used(self, now_ns: int, time_ns: int) -> Course | None:
        """Return the trajectory that counts for a time, judged at ``now_ns``, None for none."""
        course = self._begun(max(time_ns, now_ns))      # a reading is older than now
        if course is None or now_ns > self._counts_until_ns(course):
            return None
        return course

    def _begun(self, time_ns: int) -> Course | None:
        """Return the newest trajectory that has begun at a time, None for none."""
        for course in reversed((*self._courses, *self._arrived_courses)):
            if course.times_ns[0] <= min(time_ns, self._counts_until_ns(course)):
                return course
        return None

    def _waits(self, now_ns: int) -> bool:
        """Return whether the newest trajectory begins later."""
        return bool(self._courses) and self._courses[-1].times_ns[0] > now_ns

    def _is_whole_movement(self, course: Course) -> bool:
        """Tell whether a trajectory was sent after the last reference."""
        return self.reference is None or self.reference.stamp_ns < course.message.stamp_ns

    def state(self, now_ns: int) -> int:
        """Return ``NONE``, ``FRESH``, ``HELD``, ``LOST`` or ``DROPPED`` for a time."""
        # The latest times anything was known for.
        times_ns = [] if self.reference is None else [self.reference.stamp_ns]
        course = self._begun(now_ns)
        if course is not None:
            times_ns.append(self._counts_until_ns(course))
            if now_ns <= times_ns[-1]:
                return FRESH
        if not times_ns:
            return DROPPED if self._dropped else NONE
        age_s = (now_ns - max(times_ns)) * 1e-9
        if age_s <= LOST_S:
            return FRESH
        keeps = self._waits(now_ns) and now_ns <= self._keeps_until_ns
        return HELD if age_s <= HOLD_S or keeps else LOST

    def _counts_until_ns(self, course: Course) -> int:
        """Return until when a trajectory counts [ns]: its end, or less with a reference."""
        end_ns = course.times_ns[-1]
        if self._is_whole_movement(course):
            return end_ns
        return min(end_ns, course.message.stamp_ns + round(TRAJECTORY_LIFE_S * 1e9))

    def at(self, now_ns: int, time_ns: int) -> tuple[float, float]:
        """
        Return (position, rate per second) wanted at ``time_ns``, judged at ``now_ns``.

        Only valid unless ``state`` is ``NONE`` or ``DROPPED``.
        """
        course = self._used(now_ns, time_ns)
        if course is not None:
            return self._within(*course.at(time_ns, self._jump_per_s))
        reference, course = self.reference, self._begun(now_ns)
        if course is not None and self._is_whole_movement(course):
            return course.values[-1], 0.0
        assert reference is not None        # else there is nothing to ask for
        self._follow(reference)
        age_s = (now_ns - reference.stamp_ns) * 1e-9
        ahead_s = (time_ns - now_ns) * 1e-9
        position, rate = self._within(*self._motion.at(
            reference.stamp_ns + round(min(age_s, TRUST_S) * 1e9)))
        if age_s <= TRUST_S:
            return position + rate * ahead_s, rate
        if ahead_s <= 0.0:      # from TRUST_S on it stands still
            moves_s = min(ahead_s + age_s - TRUST_S, 0.0)
            return position + rate * moves_s, rate if moves_s < 0.0 else 0.0
        fades_s = LOST_S - TRUST_S
        if age_s >= LOST_S:
            return position, 0.0
        return (position + rate * ahead_s * ((LOST_S - age_s) / fades_s),
                -rate * ahead_s / fades_s)

    def guesses(self, now_ns: int) -> bool:
        """Return whether what counts now is a motion of which nothing is known any more."""
        reference, course = self.reference, self._begun(now_ns)
        if reference is None or (now_ns - reference.stamp_ns) * 1e-9 <= TRUST_S or (
                course is not None and (
                    self._is_whole_movement(course) or self.uses_trajectory(now_ns))):
            return False
        self._follow(reference)
        return self._motion.at(reference.stamp_ns + round(TRUST_S * 1e9))[1] != 0.0

    def _follow(self, reference: 'SetPoint') -> None:
        """Let the motion go on to a reference, if that is a new one."""
        if reference is not self._followed:
            values = self._values
            self._motion.take(reference.stamp_ns, values.of(reference),
                              values.rate_of(reference, math.nan))
            self._followed = reference

    def _within(self, position: float, rate: float) -> tuple[float, float]:
        """Return both, of a position beyond the allowed ones the nearest of them, at rest."""
        lower, upper = self._allowed
        if not lower <= position <= upper:      # nobody asked for that; its rate led there
            return min(max(position, lower), upper), 0.0
        return position, rate


def _needed(courses: Sequence[Course], now_ns: int) -> list[Course]:
    """Return those that count now or later: each replaces the former from its begin on."""
    needed: list[Course] = []
    for course in reversed(courses):
        if not needed or course.times_ns[0] < needed[-1].times_ns[0]:
            needed.append(course)
        if needed[-1].times_ns[0] <= now_ns:
            break
    return needed[::-1]


def _reference_too_old(message: 'SetPoint', now_ns: int) -> str:
    stamp_ns = message.stamp_ns
    return _too_old('a reference', 'is stamped', stamp_ns, stamp_ns, now_ns)


def _course_too_old(course: Course, now_ns: int) -> str:
    return _too_old(
        'a trajectory', 'ended', course.times_ns[-1], course.message.stamp_ns, now_ns)


def _too_old(what: str, did: str, newest_ns: int, stamp_ns: int, now_ns: int) -> str:
    """Return why nothing is known of what is wanted now, '' if the time is not that old."""
    age_s = (now_ns - newest_ns) * 1e-9
    if age_s <= HOLD_S:
        return ''
    if stamp_ns == 0:
        return f'the header.stamp of {what} is zero; fill it with the time it is for'
    return f'{what} {did} {age_s:.1f} s ago; is header.stamp filled?'

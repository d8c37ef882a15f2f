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
A goal of ``FollowJointTrajectory`` for one joint: checked, then followed and judged.

Knows neither ROS nor the time. ``goal_of`` turns what a client sent into a :class:`JointGoal`,
which says at any time what angle is wanted, what to send to the controller, and how it ended.
"""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from pam_actuation.control.course import Course, joined
from pam_actuation.control.joint_trajectory import MOST_S, TOLERANCE_RAD
from pam_actuation.control.modes.tracked import JOINT
from pam_actuation.messages import AngleTrajectory, NamedTrajectory
from pam_sim.units import NS_PER_S

# As in control_msgs/action/FollowJointTrajectory.
SUCCESSFUL, INVALID_GOAL, INVALID_JOINTS, OLD_HEADER_TIMESTAMP = 0, -1, -2, -3
PATH_TOLERANCE_VIOLATED, GOAL_TOLERANCE_VIOLATED = -4, -5
STEP_NS, AHEAD_NS = 20_000_000, 600_000_000     # of what is sent; the joint moves alone so long
SILENT_NS = 500_000_000         # an angle that is older says nothing of the present one
SLACK_RAD = 1e-6                # at the stops, for angles that were rounded on their way


class GoalRefused(Exception):
    """A goal that cannot be followed: ``code`` of the action, and why in one sentence."""

    def __init__(self, code: int, why: str) -> None:
        super().__init__(why)
        self.code = code


@dataclass(frozen=True)
class Tolerance:
    """What a client asks of one joint [rad, rad/s, rad/s^2]: 0 the default, -1 none."""

    name: str
    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0


@dataclass(frozen=True)
class Limits:
    """
    What the server holds goals to.

    Parameters
    ----------
    joint : str
        Name of the joint.
    range_rad : (float, float)
        Its stops.
    path_rad, goal_rad : float
        Default tolerances on the way and at the end; 0: none.
    goal_time_s : float
        Default time for the joint to arrive after the last point.

    """

    joint: str
    range_rad: tuple[float, float]
    path_rad: float = 0.0
    goal_rad: float = 0.05
    goal_time_s: float = 2.0


@dataclass(frozen=True)
class Outcome:
    """How a goal ended: ``code`` of the action and one sentence."""

    code: int
    text: str


@dataclass(frozen=True)
class JointGoal:
    """
    A goal that can be followed.

    Parameters
    ----------
    times_ns : tuple of int
        Absolute times of the points, rising; the first is the begin, where the joint is.
    angles_rad, rates_rad_per_s : tuple of float
        One a point; a rate that is NaN is not given.
    path_rad, goal_rad : float
        Tolerances; infinite: none.
    arrive_ns : int
        Time by which the joint must be there.

    """

    times_ns: tuple[int, ...]
    angles_rad: tuple[float, ...]
    rates_rad_per_s: tuple[float, ...]
    path_rad: float
    goal_rad: float
    arrive_ns: int

    @property
    def end_ns(self) -> int:
        """Return the time of the last point."""
        return self.times_ns[-1]

    def at(self, time_ns: int) -> tuple[float, float]:
        """
        Return wanted angle [rad] and rate [rad/s] at a time.

        Points are joined by cubics where both have a rate, else by straight lines. Before the
        first and after the last point the joint stands still.
        """
        times, angles = self.times_ns, self.angles_rad
        if time_ns <= times[0]:
            return angles[0], 0.0
        if time_ns >= times[-1]:
            return angles[-1], 0.0
        k = next(k for k, end_ns in enumerate(times) if time_ns < end_ns) - 1
        span_ns, rates = times[k + 1] - times[k], self.rates_rad_per_s
        return joined(angles[k], angles[k + 1], rates[k], rates[k + 1], span_ns / NS_PER_S,
                      (time_ns - times[k]) / span_ns)

    def ahead(self, now_ns: int) -> AngleTrajectory:
        """Return what to send now: the next 0.6 s, so that a dead server stops the joint."""
        after_ns = tuple(range(0, AHEAD_NS + 1, STEP_NS))
        wanted = [self.at(now_ns + one) for one in after_ns]
        return AngleTrajectory(now_ns, after_ns, tuple(angle for angle, _ in wanted),
                               tuple(rate for _, rate in wanted))

    def outcome(self, now_ns: int, measured_ns: int, angle_rad: float) -> Outcome | None:
        """
        Return how the goal ended, None while it goes on.

        Parameters
        ----------
        now_ns : int
            Present time [ns].
        measured_ns, angle_rad : int, float
            Stamp [ns] and value [rad] of the newest measured angle.

        """
        wanted, _ = self.at(measured_ns)
        error = angle_rad - wanted
        if now_ns - measured_ns > SILENT_NS or not math.isfinite(angle_rad):
            return Outcome(PATH_TOLERANCE_VIOLATED, 'no measured angle for '
                           f'{(now_ns - measured_ns) / NS_PER_S:.1f} s')
        if measured_ns < self.end_ns:
            return None if abs(error) <= self.path_rad else Outcome(
                PATH_TOLERANCE_VIOLATED, f'{abs(error):.3f} rad from the wanted '
                f'{wanted:.3f} rad; allowed on the way are {self.path_rad:g} rad')
        if abs(error) <= self.goal_rad:
            return Outcome(SUCCESSFUL, f'arrived, {abs(error):.3f} rad from {wanted:.3f} rad')
        if now_ns < self.arrive_ns:
            return None
        return Outcome(
            GOAL_TOLERANCE_VIOLATED, f'{abs(error):.3f} rad from {wanted:.3f} rad, '
            f'{(now_ns - self.end_ns) / NS_PER_S:.1f} s after the last point; allowed are '
            f'{self.goal_rad:g} rad')

    def stopped(self, now_ns: int) -> 'JointGoal':
        """Return the goal of standing still at the angle that is wanted now."""
        angle, _ = self.at(now_ns)
        return JointGoal((now_ns,), (angle,), (0.0,), math.inf, math.inf, now_ns)


def goal_of(trajectory: NamedTrajectory, limits: Limits, now_ns: int, from_rad: float,
            path: Sequence[Tolerance] = (), goal: Sequence[Tolerance] = (),
            goal_time_s: float = 0.0) -> JointGoal:
    """
    Return the goal that a client asks for.

    Parameters
    ----------
    trajectory : NamedTrajectory
        Of this joint alone; a stamp of 0 means now.
    limits : Limits
        Joint, stops and default tolerances.
    now_ns : int
        Present time [ns].
    from_rad : float
        Angle that is wanted or measured now: the joint goes from there to the first point.
    path, goal : sequence of Tolerance
        Of the client.
    goal_time_s : float
        Of the client, 0: the default.

    Raises
    ------
    GoalRefused
        Another joint, points that do not fit, an angle outside the stops, also between the
        points, a velocity that no joint has, a trajectory that is over, a tolerance of
        what is not measured.

    """
    if tuple(trajectory.names) != (limits.joint,):
        raise GoalRefused(INVALID_JOINTS, f'joint_names are {list(trajectory.names)}; this '
                          f'server moves {limits.joint!r} alone')
    angles, rates = _checked_points(trajectory, limits)
    begin_ns = trajectory.stamp_ns or now_ns
    times = [begin_ns + after_ns for after_ns, _, _ in trajectory.points]
    if trajectory.stamp_ns and times[-1] <= now_ns:
        raise GoalRefused(OLD_HEADER_TIMESTAMP, 'the last point was '
                          f'{(now_ns - times[-1]) / NS_PER_S:.3f} s ago')
    if times[-1] - now_ns > MOST_S * NS_PER_S:
        raise GoalRefused(INVALID_GOAL, f'ends in {(times[-1] - now_ns) / NS_PER_S:.0f} s; '
                          f'allowed are {MOST_S:g} s')
    if not math.isfinite(from_rad):
        raise GoalRefused(INVALID_GOAL, 'the angle of the joint is not known')
    coming = next(k for k, time_ns in enumerate(times) if time_ns > now_ns or k == len(times) - 1)
    arrive_s = goal_time_s if goal_time_s > 0.0 else limits.goal_time_s
    # What lies in the past is left out; the joint begins where it is, with a rate given for now.
    starts = coming > 0 and times[coming - 1] == now_ns
    course = Course(
        trajectory, (now_ns, *(max(one, now_ns + 1) for one in times[coming:])),
        (from_rad, *angles[coming:]),
        (rates[coming - 1] if starts else math.nan, *rates[coming:]))
    lower, upper = limits.range_rad
    beyond = course.beyond(lower - TOLERANCE_RAD, upper + TOLERANCE_RAD, math.inf)
    if beyond is not None:
        raise GoalRefused(INVALID_GOAL, f'the velocities lead to {beyond[1]:g} rad at '
                          f'time_from_start {(beyond[0] - begin_ns) / NS_PER_S:.3f} s; the stops '
                          f'allow {lower:g} to {upper:g} rad')
    return JointGoal(
        course.times_ns, course.values, course.rates,
        _tolerance(path, limits.joint, limits.path_rad, 'path'),
        _tolerance(goal, limits.joint, limits.goal_rad, 'goal'),
        max(times[-1], now_ns) + round(arrive_s * NS_PER_S))


def _checked_points(trajectory: NamedTrajectory,
                    limits: Limits) -> tuple[list[float], list[float]]:
    """Return angles and rates of the points; GoalRefused."""
    if not trajectory.points:
        raise GoalRefused(INVALID_GOAL, 'the trajectory has no points')
    angles, rates, before_ns = [], [], -1
    lower, upper = limits.range_rad
    for k, (after_ns, positions, velocities) in enumerate(trajectory.points):
        place = f'points[{k}]'
        if len(positions) != 1 or len(velocities) > 1:
            raise GoalRefused(INVALID_GOAL, f'{place} has {len(positions)} positions and '
                              f'{len(velocities)} velocities; one joint has one position')
        if after_ns <= before_ns:
            raise GoalRefused(INVALID_GOAL, f'{place}.time_from_start is '
                              f'{after_ns / NS_PER_S:g} s; times must rise from 0 s on')
        angle, rate = positions[0], velocities[0] if velocities else math.nan
        if not lower - SLACK_RAD <= angle <= upper + SLACK_RAD:     # NaN neither
            raise GoalRefused(INVALID_GOAL, f'{place} is at {angle:g} rad; the stops allow '
                              f'{lower:g} to {upper:g} rad')
        if velocities and not abs(rate) <= JOINT.fastest:
            raise GoalRefused(INVALID_GOAL, f'{place} has the velocity {rate:g} rad/s; allowed '
                              f'are {-JOINT.fastest:g} to {JOINT.fastest:g} rad/s')
        angles.append(min(max(angle, lower), upper))
        rates.append(rate)
        before_ns = after_ns
    return angles, rates


def _tolerance(asked: Sequence[Tolerance], joint: str, default: float, what: str) -> float:
    """Return a tolerance of the position [rad], infinite for none; GoalRefused."""
    found = default
    for one in asked:
        if one.name != joint:
            raise GoalRefused(INVALID_JOINTS, f'{what}_tolerance names the joint {one.name!r}; '
                              f'this server moves {joint!r} alone')
        if one.velocity > 0.0 or one.acceleration > 0.0:
            raise GoalRefused(INVALID_GOAL, f'{what}_tolerance limits velocity or acceleration, '
                              'which are not measured')
        if one.position > 0.0:
            found = one.position
        elif one.position < 0.0:
            return math.inf
        elif math.isnan(one.position):
            raise GoalRefused(INVALID_GOAL, f'{what}_tolerance is not a number')
    return found if found > 0.0 else math.inf

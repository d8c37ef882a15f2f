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

"""Test goals of FollowJointTrajectory without ROS: what is refused, wanted, sent and judged."""

import math

from pam_actuation.control.trajectory_goal import (
    AHEAD_NS, goal_of, GOAL_TOLERANCE_VIOLATED, GoalRefused, INVALID_GOAL, INVALID_JOINTS, Limits,
    OLD_HEADER_TIMESTAMP, PATH_TOLERANCE_VIOLATED, SUCCESSFUL, Tolerance)
from pam_actuation.messages import NamedTrajectory
from pam_sim.units import NS_PER_S as NS
import pytest

NOW_NS = 1_700_000_000 * NS
LIMITS = Limits('knee', (-0.5, 1.0), path_rad=0.2, goal_rad=0.05, goal_time_s=1.0)
NAN = math.nan


def sent(*points, stamp_ns=0, names=('knee',)):
    """Return a trajectory of (time_s, angle) or (time_s, angle, rate)."""
    return NamedTrajectory(stamp_ns, names, tuple(
        (round(one[0] * NS), (one[1],), tuple(one[2:])) for one in points))


def made(*points, start=0.0, **options):
    stamp_ns = options.pop('stamp_ns', 0)
    return goal_of(sent(*points, stamp_ns=stamp_ns), LIMITS, NOW_NS, start, **options)


def at(goal, time_s):
    return goal.at(NOW_NS + round(time_s * NS))


def test_straight_lines_from_where_the_joint_is():
    goal = made((1.0, 0.4), (3.0, 0.0), start=0.2)
    assert at(goal, -1.0) == (0.2, 0.0)
    assert at(goal, 0.5) == pytest.approx((0.3, 0.2))
    assert at(goal, 2.0) == pytest.approx((0.2, -0.2))
    assert at(goal, 9.0) == (0.0, 0.0)


def test_cubics_where_both_ends_have_a_rate():
    goal = made((1.0, 0.0, 0.5), (2.0, 0.5, -0.3), start=0.0)
    assert at(goal, 0.5) == pytest.approx((0.0, 0.0))           # no rate is known at the begin
    for time_s, angle, rate in ((1.0, 0.0, 0.5), (2.0, 0.5, -0.3)):
        for side in (-1e-6, 1e-6):
            wanted, slope = at(goal, time_s + side)
            assert wanted == pytest.approx(angle, abs=1e-5)
            if (side > 0) == (time_s == 1.0):
                assert slope == pytest.approx(rate, abs=1e-4)
    begun = made((0.0, 0.0, 0.0), (1.0, 0.4, 0.0), start=0.01)     # as planners send it
    assert at(begun, 0.0)[0] == 0.01 and at(begun, 1e-6)[1] == pytest.approx(0.0, abs=1e-4)
    step = 1e-4                                                  # the rate is that of the angle
    for time_s in (1.2, 1.5, 1.9):
        before, after = at(goal, time_s - step)[0], at(goal, time_s + step)[0]
        assert at(goal, time_s)[1] == pytest.approx((after - before) / (2 * step), abs=1e-5)


def test_what_is_sent_is_the_wanted_angle_of_the_next_moments():
    goal = made((1.0, 0.4), start=0.0)
    now_ns = NOW_NS + NS // 2
    message = goal.ahead(now_ns)
    assert message.stamp_ns == now_ns and message.time_from_start_ns[0] == 0
    assert message.time_from_start_ns[-1] == AHEAD_NS
    steps = {b - a for a, b in zip(message.time_from_start_ns, message.time_from_start_ns[1:])}
    assert steps == {20_000_000}
    for after_ns, angle, rate in zip(message.time_from_start_ns, message.angle_rad,
                                     message.rate_rad_per_s):
        assert (angle, rate) == goal.at(now_ns + after_ns)
    assert message.angle_rad[-1] == 0.4 and message.rate_rad_per_s[-1] == 0.0


def test_a_trajectory_under_way_is_taken_up_and_a_later_one_waits():
    goal = made((1.0, 0.4), (2.0, 0.0), stamp_ns=NOW_NS - round(1.5 * NS), start=0.3)
    assert goal.end_ns == NOW_NS + NS // 2 and at(goal, 0.25) == pytest.approx((0.15, -0.6))
    later = made((0.0, 0.1), (1.0, 0.4), stamp_ns=NOW_NS + 2 * NS, start=0.1)
    assert at(later, 1.0) == pytest.approx((0.1, 0.0)) and at(later, 2.5)[0] == pytest.approx(0.25)


def judged(goal, time_s, angle_rad, age_s=0.0):
    now_ns = NOW_NS + round(time_s * NS)
    found = goal.outcome(now_ns, now_ns - round(age_s * NS), angle_rad)
    return None if found is None else found.code


def test_how_a_goal_ends():
    goal = made((1.0, 0.4))
    assert judged(goal, 0.5, 0.2) is None and judged(goal, 0.5, 0.39) is None
    assert judged(goal, 0.5, 0.41) == PATH_TOLERANCE_VIOLATED
    assert judged(goal, 1.0, 0.36) == SUCCESSFUL
    assert judged(goal, 1.0, 0.1) is None                   # it may come late
    assert judged(goal, 1.9, 0.36) == SUCCESSFUL
    assert judged(goal, 2.1, 0.1) == GOAL_TOLERANCE_VIOLATED
    assert judged(goal, 1.05, 0.36, age_s=0.1) is None      # measured before the last point
    assert judged(goal, 0.9, 0.36, age_s=0.6) == PATH_TOLERANCE_VIOLATED
    assert judged(goal, 0.5, NAN) == PATH_TOLERANCE_VIOLATED
    late = goal.outcome(NOW_NS + 3 * NS, NOW_NS + 3 * NS, 0.1)
    assert late.text == ('0.300 rad from 0.400 rad, 2.0 s after the last point; '
                         'allowed are 0.05 rad')


def test_tolerances_of_the_client_come_before_the_defaults():
    goal = made((1.0, 0.4), path=[Tolerance('knee', 0.01)], goal=[Tolerance('knee', 0.3)],
                goal_time_s=5.0)
    assert judged(goal, 0.5, 0.22) == PATH_TOLERANCE_VIOLATED
    assert judged(goal, 1.0, 0.15) == SUCCESSFUL and judged(goal, 5.9, 0.0) is None
    free = made((1.0, 0.4), path=[Tolerance('knee', -1.0)], goal=[Tolerance('knee', 0.0)])
    assert judged(free, 0.5, -0.4) is None and judged(free, 1.0, 0.3) is None


def test_a_goal_that_is_stopped_stands_where_it_was_to_be():
    stopped = made((1.0, 0.4)).stopped(NOW_NS + NS // 2)
    assert at(stopped, 0.5) == at(stopped, 7.0) == (pytest.approx(0.2), 0.0)
    assert stopped.ahead(NOW_NS + NS).angle_rad == pytest.approx([0.2] * 31)


@pytest.mark.parametrize('points, options, code, why', [
    ([(1.0, 0.2)], {'names': ('hip', 'knee')}, INVALID_JOINTS, "this server moves 'knee' alone"),
    ([(1.0, 0.2)], {'names': ()}, INVALID_JOINTS, 'joint_names are'),
    ([], {}, INVALID_GOAL, 'no points'),
    ([(1.0, 0.2), (1.0, 0.3)], {}, INVALID_GOAL, r'points\[1\].time_from_start is 1 s'),
    ([(-1.0, 0.2)], {}, INVALID_GOAL, 'must rise from 0 s on'),
    ([(1.0, 1.2)], {}, INVALID_GOAL, 'at 1.2 rad; the stops allow -0.5 to 1 rad'),
    ([(1.0, NAN)], {}, INVALID_GOAL, 'at nan rad'),
    ([(1.0, 0.2, math.inf)], {}, INVALID_GOAL, 'the velocity inf'),
    ([(1.0, 0.2, -57.3)], {}, INVALID_GOAL, 'velocity -57.3 rad/s; allowed are -20 to 20 rad/s'),
    ([(1.0, 0.9, 1.5), (2.0, 0.9, -1.5)], {}, INVALID_GOAL,
     'lead to 1.275 rad at time_from_start 1.500 s; the stops allow -0.5 to 1 rad'),
    ([(1.0, 0.2, 0.0, 0.0)], {}, INVALID_GOAL, '1 positions and 2 velocities'),
    ([(1.0, 0.2)], {'stamp_ns': NOW_NS - 3 * NS}, OLD_HEADER_TIMESTAMP, '2.000 s ago'),
    ([(4000.0, 0.2)], {}, INVALID_GOAL, 'ends in 4000 s; allowed are 3600 s')])
def test_what_cannot_be_followed_is_refused_in_one_sentence(points, options, code, why):
    with pytest.raises(GoalRefused, match=why) as error:
        goal_of(sent(*points, **options), LIMITS, NOW_NS, 0.0)
    assert error.value.code == code


@pytest.mark.parametrize('tolerance, code', [
    (Tolerance('hip', 0.1), INVALID_JOINTS), (Tolerance('knee', 0.1, 0.1), INVALID_GOAL),
    (Tolerance('knee', 0.1, 0.0, 0.1), INVALID_GOAL), (Tolerance('knee', NAN), INVALID_GOAL)])
def test_a_tolerance_that_cannot_be_held_is_refused(tolerance, code):
    for which in ('path', 'goal'):
        with pytest.raises(GoalRefused, match=f'^{which}_tolerance') as error:
            made((1.0, 0.2), **{which: [tolerance]})
        assert error.value.code == code


def test_nothing_begins_from_an_angle_that_is_not_known():
    with pytest.raises(GoalRefused, match='not known'):
        made((1.0, 0.2), start=NAN)

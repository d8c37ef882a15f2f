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

"""Test trajectories of larger stacks: names, times, starts and refusals."""

import math

from pam_actuation.control.joint_setpoint import JointSetpoint
from pam_actuation.control.joint_trajectory import angle_trajectory
from pam_actuation.control.modes.tracked import JOINT
from pam_actuation.control.reference_buffer import FRESH, HELD, LOST, NONE, ReferenceBuffer
from pam_actuation.messages import AngleReference, NamedTrajectory
from pam_sim.errors import InputError
import pytest

NOW_NS = 5_000_000_000_000
MS = 1_000_000
POINTS = ((0, (0.1, 0.5), (0.0, 1.0)), (100 * MS, (0.2, 0.6), (0.0, 1.0)))


def taken(names=('left', 'right'), points=POINTS, joint='right', stamp_ns=NOW_NS,
          present_rad=math.nan):
    return angle_trajectory(stamp_ns, names, points, joint, (-0.2, 1.0), NOW_NS, present_rad)


def buffer_with(trajectory):
    buffer = ReferenceBuffer(JOINT)
    assert buffer.set_trajectory(trajectory)
    return buffer


def wanted(trajectory, after_ms):
    """Return angle and rate wanted some time from now."""
    return buffer_with(trajectory).at(NOW_NS, NOW_NS + after_ms * MS)


def test_a_joint_is_found_by_its_name():
    assert taken().angle_rad == (0.5, 0.6) and taken().rate_rad_per_s == (1.0, 1.0)
    assert taken(joint='left').angle_rad == (0.1, 0.2)
    assert taken((), ((0, (0.3,), ()),)).angle_rad == (0.3,)


def test_a_stamp_of_zero_means_now():
    assert taken(stamp_ns=0) == taken()


def test_without_rates_points_lie_on_straight_lines():
    line = taken(points=((0, (0.0, 0.0), ()), (100 * MS, (0.0, 0.5), ())))
    assert wanted(line, 50) == pytest.approx((0.25, 5.0))


def test_it_goes_to_the_first_point_from_where_the_joint_is():
    later = tuple((time_ns + 200 * MS, *rest) for time_ns, *rest in POINTS)
    trajectory = taken(points=later, present_rad=0.1)
    assert wanted(trajectory, 0) == pytest.approx((0.1, 2.0))
    assert wanted(trajectory, 100)[0] == pytest.approx(0.3)
    assert wanted(trajectory, 200)[0] == pytest.approx(0.5)
    unknown = buffer_with(taken(points=later))      # no angle known: waited for
    assert unknown.state(NOW_NS) == NONE and unknown.state(NOW_NS + 200 * MS) == FRESH


def test_one_in_the_future_is_waited_for_and_one_that_began_is_joined():
    ahead = taken(stamp_ns=NOW_NS + 100 * MS, present_rad=0.4)
    assert wanted(ahead, 50)[0] == pytest.approx(0.45)
    begun = taken(stamp_ns=NOW_NS - 50 * MS, present_rad=-0.1)
    assert wanted(begun, 0)[0] == pytest.approx(0.55)


def test_a_whole_movement_counts_to_its_end_although_references_came_before():
    buffer = buffer_with(taken(points=((0, (0.0, 0.0), ()), (3000 * MS, (0.0, 0.9), ()))))
    assert buffer.set_reference(AngleReference(NOW_NS - MS, 0.7, 0.0))
    for after_ms, state, angle in ((1500, FRESH, 0.45), (3100, FRESH, 0.9), (4900, HELD, 0.9)):
        time_ns = NOW_NS + after_ms * MS
        assert buffer.state(time_ns) == state
        assert buffer.at(time_ns, time_ns)[0] == pytest.approx(angle)
    assert buffer.state(NOW_NS + 5100 * MS) == LOST
    assert buffer.set_reference(AngleReference(NOW_NS + 5200 * MS, 0.7, 0.0))
    assert buffer.at(NOW_NS + 5200 * MS, NOW_NS + 5200 * MS)[0] == 0.7


@pytest.mark.parametrize('change, words', [
    ({'joint': 'hip'}, 'left, right do not name this joint, hip'),
    ({'points': ()}, 'no points'),
    ({'points': ((0, (0.1,), ()),)}, '1 positions and 0 velocities for 2 joints'),
    ({'points': ((0, (0.1, 0.1), (0.0,)),)}, '2 positions and 1 velocities'),
    ({'points': POINTS[::-1]}, 'does not rise'),
    ({'points': ((0, (0.1, 1.5), ()),)}, '1.5 rad is outside'),
    ({'points': ((0, (0.1, math.nan), ()),)}, 'nan rad is outside'),
    ({'points': ((0, (0.1, 0.1), (0.0, 57.3)),)},
     r'points\[0\]: velocity 57.3 rad/s is beyond what a joint does, -20 to 20 rad/s'),
    ({'stamp_ns': NOW_NS - 200 * MS}, 'in the past'),
    ({'stamp_ns': NOW_NS + 86_400_000 * MS},
     r'ends in 86400 s, allowed are 3600 s; is header.stamp of another clock\?')])
def test_what_is_wrong_is_said(change, words):
    with pytest.raises(InputError, match=words):
        taken(**change)


def test_a_joint_refuses_a_trajectory_whose_velocities_lead_beyond_its_stops():
    setpoint = JointSetpoint((-1.0, 1.0), 'right', (1e5, 7e5))
    for points in (((0, (0.9,), (1.5,)), (1000 * MS, (0.9,), (-1.5,))),
                   ((100 * MS, (0.9,), (1.5,)), (1100 * MS, (0.9,), (-1.5,)))):
        setpoint.on_trajectory(NamedTrajectory(NOW_NS, ('right',), points))
        setpoint.begin(NOW_NS, 0.0)
    assert setpoint.references.state(NOW_NS) == NONE and setpoint.refused == 2
    assert dict(setpoint.values())['references.refusal'] == (
        'the velocities of a trajectory lead to position 1.275 rad at time_from_start 0.600 s, '
        'which is not within -1.02 to 1.02 rad')

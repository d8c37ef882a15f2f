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

"""What a refused reference says: which field is missing or of another kind, or the value."""

import math

from pam_actuation.control.joint_trajectory import angle_trajectory
from pam_actuation.control.modes.tracked import CONTRACTION, FORCE, JOINT
from pam_actuation.control.reference_buffer import ReferenceBuffer
from pam_actuation.messages import AngleReference, Reference, ReferenceTrajectory
from pam_actuation.topics import codec
from pam_actuation.topics.cdr import Point, trajectory_bytes
import pytest

ALLOWED = {CONTRACTION: (-0.01, 0.1), FORCE: (-40.0, 120.0), JOINT: (-1.0, 1.0)}
MS = 1_000_000


def refusal(tracked, message):
    buffer = ReferenceBuffer(tracked, ALLOWED[tracked])
    take = buffer.set_trajectory if isinstance(
        message, ReferenceTrajectory) else buffer.set_reference
    assert take(message) is (buffer.refused == 0)
    return buffer.refusal


@pytest.mark.parametrize('tracked, message, why', [
    (CONTRACTION, Reference(1), 'a reference has no position, or one that is not a number'),
    (CONTRACTION, Reference(1, force_n=30.0),
     'a reference has effort but no position; this controller follows a contraction'),
    (CONTRACTION, Reference(1, 10.0),
     'a reference has position 10 m, which is not within -0.01 to 0.1 m'),
    (CONTRACTION, Reference(1, math.inf),
     'a reference has position inf m, which is not within -0.01 to 0.1 m'),
    (FORCE, Reference(1, 0.01),
     'a reference has position but no effort; this controller follows a force'),
    (FORCE, Reference(1, force_n=500.0),
     'a reference has effort 500 N, which is not within -40 to 120 N'),
    (JOINT, AngleReference(1, math.nan),
     'a reference has no position, or one that is not a number'),
    (JOINT, AngleReference(1, 20.0),
     'a reference has position 20 rad, which is not within -1 to 1 rad'),
    (CONTRACTION, Reference(1, 0.02, force_n=30.0), '')])
def test_a_refused_reference_names_its_field_or_value(tracked, message, why):
    assert refusal(tracked, message) == why


@pytest.mark.parametrize('tracked, points, why', [
    (CONTRACTION, (), 'a trajectory has no points'),
    (CONTRACTION, (Point(0, (0.01,), (), ()), Point(0, (0.02,), (), ())),
     'the time_from_start of a trajectory does not rise at points[1]'),
    (CONTRACTION, (Point(0, (0.01,), (), ()), Point(MS, (10.0,), (), ())),
     'points[1] of a trajectory has position 10 m, which is not within -0.01 to 0.1 m'),
    (CONTRACTION, (Point(0, (0.01,), (), ()), Point(MS, (), (), ())),
     'points[1] of a trajectory has no position, or one that is not a number'),
    (CONTRACTION, (Point(0, (), (), (30.0,)), Point(MS, (), (), (30.0,))),
     'a trajectory has effort but no position; this controller follows a contraction'),
    (FORCE, (Point(0, (0.01,), (), ()),),
     'a trajectory has position but no effort; this controller follows a force'),
    (FORCE, (Point(0, (), (), (30.0,)),), '')])
def test_a_refused_trajectory_names_its_point(tracked, points, why):
    raw = trajectory_bytes(MS, ('muscle',), points, '')
    assert refusal(tracked, codec.decode('reference_trajectory', raw)) == why


def test_a_trajectory_of_unequal_lengths_says_so():
    assert refusal(CONTRACTION, ReferenceTrajectory(1, (0, MS), (0.01,))) == (
        'a trajectory has 2 times and 1 positions')


@pytest.mark.parametrize('every', [1, 3])
@pytest.mark.parametrize('rate', [math.inf, -math.inf])
def test_a_rate_that_is_not_finite_counts_as_left_empty(rate, every):
    """On ``reference`` one left empty is NaN."""
    buffers = ReferenceBuffer(), ReferenceBuffer()
    for k in range(60):
        now = k * 20 * MS
        for buffer, unusable in zip(buffers, (math.nan, rate)):
            buffer.set_reference(Reference(
                now, 1e-4 * k, 0.005 if k % every else unusable))
            buffer.judge(now)
        a, b = (buffer.at(now + 5 * MS, now + 100 * MS) for buffer in buffers)
        assert a == b and all(map(math.isfinite, a))
    assert [buffer.refused for buffer in buffers] == [0, 0]


@pytest.mark.parametrize('rates', [(math.nan,), (math.inf,), (-math.inf,)])
def test_a_rate_of_a_point_that_is_not_finite_counts_as_left_empty(rates):
    found = []
    for velocities in ((), rates):
        points = [Point(0, (0.0,), (0.0,), ()), Point(100 * MS, (0.01,), velocities, ())]
        raw = trajectory_bytes(MS, ('knee',), points, '')
        of_joint = codec.decode('joint_trajectory', raw)
        joint = angle_trajectory(MS, of_joint.names, of_joint.points, 'knee', (-1.0, 1.0), MS, 0.0)
        for tracked, message in (
                (CONTRACTION, codec.decode('reference_trajectory', raw)), (JOINT, joint)):
            buffer = ReferenceBuffer(tracked, ALLOWED[tracked])
            assert buffer.set_trajectory(message)
            found.append([buffer.at(MS, MS + k * 10 * MS) for k in range(12)])
    assert found[:2] == found[2:] and found[0][5][0] == pytest.approx(0.005)

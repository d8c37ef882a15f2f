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
from random import Random

from pam_actuation.control.joint_trajectory import angle_trajectory
from pam_actuation.control.modes.tracked import CONTRACTION, FORCE, JOINT
from pam_actuation.control.reference_buffer import ReferenceBuffer
from pam_actuation.messages import (
    AngleReference, AngleTrajectory, Reference, ReferenceTrajectory)
from pam_actuation.topics import codec
from pam_actuation.topics.cdr import Point, trajectory_bytes
import pytest

ALLOWED = {CONTRACTION: (-0.01, 0.1), FORCE: (-40.0, 120.0), JOINT: (-1.0, 1.0)}
MS = 1_000_000


def refusal(tracked, message):
    buffer = ReferenceBuffer(tracked, ALLOWED[tracked])
    take = buffer.set_trajectory if isinstance(
        message, (AngleTrajectory, ReferenceTrajectory)) else buffer.set_reference
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
    (CONTRACTION, Reference(1, 0.02, 2.0),
     'a reference has velocity 2 m/s, which is not within -1 to 1 m/s'),
    (JOINT, AngleReference(1, 0.3, -1e6),
     'a reference has velocity -1e+06 rad/s, which is not within -20 to 20 rad/s'),
    (JOINT, AngleReference(1, 0.3, math.inf), ''),      # as one that is not told
    (JOINT, AngleReference(1, 0.3, 20.0), ''),
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
    (CONTRACTION, (Point(0, (0.01,), (0.0,), ()), Point(MS, (0.01,), (-1.5,), ())),
     'points[1] of a trajectory has velocity -1.5 m/s, which is not within -1 to 1 m/s'),
    (CONTRACTION, (Point(0, (0.09,), (0.0,), ()), Point(500 * MS, (0.09,), (0.03,), ()),
                   Point(1500 * MS, (0.09,), (-0.06,), ())),
     'the velocities of a trajectory lead to position 0.101547 m at time_from_start 1.077 s, '
     'which is not within -0.01 to 0.1 m'),
    # A jump: the first point goes on with its rate until the time of the second.
    (CONTRACTION, (Point(0, (0.01,), (-0.9,), ()), Point(100 * MS, (0.02,), (0.0,), ())),
     'the velocities of a trajectory lead to position -0.08 m at time_from_start 0.100 s, '
     'which is not within -0.01 to 0.1 m'),
    (CONTRACTION, (Point(0, (0.01,), (0.02,), ()), Point(100 * MS, (0.011,), (0.6,), ()),
                   Point(200 * MS, (0.012,), (0.6,), ()), Point(300 * MS, (0.013,), (0.0,), ())),
     'the velocities of a trajectory do not fit its positions: from time_from_start 0.000 s on '
     '0.31 m/s are told, and the positions change by 0.01 m/s; another unit?'),
    # Jumps, and a motion that begins anew as a sawtooth does.
    (CONTRACTION, (Point(0, (0.01,), (0.0,), ()), Point(20 * MS, (0.03,), (0.1,), ()),
                   Point(40 * MS, (0.032,), (0.1,), ()), Point(60 * MS, (0.032,), (0.1,), ()),
                   Point(80 * MS, (0.034,), (0.1,), ())), ''),
    (CONTRACTION, (Point(0, (0.09,), (0.03,), ()), Point(1000 * MS, (0.09,), (-0.03,), ())), ''),
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


def test_a_cubic_is_searched_for_where_it_is_farthest_out():
    """Compare with a search of many points: one that leaves the range is refused, others not."""
    random = Random(3)
    refused = 0
    for _ in range(300):
        span_ns = random.choice((20, 300, 1000)) * MS
        angles = tuple(random.uniform(-1.0, 1.0) for _ in range(3))
        rates = tuple(random.uniform(-4.0, 4.0) for _ in range(3))
        message = AngleTrajectory(1, (0, span_ns, 2 * span_ns), angles, rates)
        buffer = ReferenceBuffer(JOINT)
        assert buffer.set_trajectory(message)
        asked = [buffer.at(1, 1 + 2 * span_ns * k // 2000)[0] for k in range(2000)]
        if 0.999 < max(map(abs, asked)) < 1.001:
            continue
        refused += max(map(abs, asked)) > 1.0
        assert bool(refusal(JOINT, message)) is (max(map(abs, asked)) > 1.0)
    assert 50 < refused < 250


@pytest.mark.parametrize('first, asked', [(0.9, 1.0), (-0.9, -1.0)])
def test_the_rate_of_a_reference_leads_nowhere_beyond_what_is_allowed(first, asked):
    buffer = ReferenceBuffer(JOINT, ALLOWED[JOINT])
    assert buffer.set_reference(AngleReference(MS, first, 10.0 * first))
    for after_ms in (20, 200, 1000):
        now_ns = (1 + after_ms) * MS
        assert buffer.at(now_ns, now_ns + 100 * MS) == (asked, 0.0)

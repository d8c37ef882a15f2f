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

"""A trajectory that begins later counts from its first point on, within the allowed values."""

from pam_actuation.control.loop import ControllerLoop
from pam_actuation.control.modes.tracked import CONTRACTION
from pam_actuation.control.reference_buffer import FRESH, HELD, LOST, NONE, ReferenceBuffer
from pam_actuation.messages import Contraction, Reference, ReferenceTrajectory
import pytest
from straight_rig import sofc

MS = 1_000_000
START = 1_700_000_000_000_000_000


def moving(stamp_ns, begin_ms, first_m=0.005, rate_m_per_s=0.06, last_ms=200):
    """Return a straight motion whose first point is ``begin_ms`` after the stamp."""
    return ReferenceTrajectory(
        stamp_ns, (begin_ms * MS, (begin_ms + last_ms) * MS),
        (first_m, first_m + rate_m_per_s * last_ms * 1e-3), (rate_m_per_s, rate_m_per_s))


def buffer_with(*messages, now_ns=START, allowed=(-0.01, 0.1)):
    """Return a buffer that took messages in one tick."""
    buffer = ReferenceBuffer(CONTRACTION, allowed)
    for message in messages:
        take = buffer.set_reference if isinstance(message, Reference) else buffer.set_trajectory
        assert take(message)
    buffer.judge(now_ns)
    return buffer


def wanted_m(buffer, after_ms, ahead_ms=0):
    now_ns = START + after_ms * MS
    buffer.judge(now_ns)
    return buffer.at(now_ns, now_ns + ahead_ms * MS)[0]


def test_until_its_first_point_the_reference_goes_on():
    buffer = buffer_with(Reference(START, 0.014, 0.0), moving(START, 900))
    assert buffer.at(START, START) == (0.014, 0.0) and not buffer.uses_trajectory(START)
    for after_ms in range(0, 900, 20):
        buffer.set_reference(Reference(START + after_ms * MS, 0.014, 0.0))
        assert wanted_m(buffer, after_ms) == 0.014
    assert wanted_m(buffer, 900) == 0.005 and buffer.uses_trajectory(START + 900 * MS)
    assert wanted_m(buffer, 950) == pytest.approx(0.008)


def test_the_preview_sees_its_begin():
    buffer = buffer_with(Reference(START, 0.014, 0.0), moving(START, 50))
    assert wanted_m(buffer, 0, 49) == 0.014
    assert wanted_m(buffer, 0, 50) == 0.005
    assert wanted_m(buffer, 0, 100) == pytest.approx(0.008)


def test_a_controller_does_not_lower_its_load_before():
    loop, seen = ControllerLoop(sofc()), []
    for k in range(180):
        now_ns = START + k * 5 * MS
        loop.take('contraction', Contraction(now_ns, 0.014 + 1e-9 * k))
        loop.take('reference', Reference(now_ns, 0.014, 0.0))
        if k == 10:
            loop.take('reference_trajectory', moving(now_ns, 900))
        _, state = loop.tick(now_ns)
        seen.append(dict(zip(state.names, state.values))['reference_m'])
    assert set(seen) == {0.014}


def test_until_then_a_former_trajectory_goes_on():
    former = ReferenceTrajectory(START, (0, 1000 * MS), (0.01, 0.02), (0.01, 0.01))
    buffer = buffer_with(former)
    buffer.set_trajectory(moving(START + 100 * MS, 500))
    assert wanted_m(buffer, 100) == pytest.approx(0.011)
    assert wanted_m(buffer, 599) == pytest.approx(0.01599)
    assert wanted_m(buffer, 600) == 0.005


def test_where_each_is_replaced_before_it_begins_each_counts_in_turn():
    """A planner 50 ms ahead that sends every 20 ms."""
    buffer = buffer_with(moving(START, 0, 0.01, 0.01))
    for after_ms in range(0, 2000, 5):
        if after_ms % 20 == 0:
            buffer.set_trajectory(moving(
                START + after_ms * MS, 50, 0.01 + 1e-5 * (after_ms + 50), 0.01))
        assert wanted_m(buffer, after_ms) == pytest.approx(0.01 + 1e-5 * after_ms)
        assert buffer.state(START + after_ms * MS) == FRESH
    assert len(buffer._courses) < 5


def test_alone_it_is_waited_for():
    buffer = buffer_with(moving(START, 900))
    assert buffer.state(START) == buffer.state(START + 899 * MS) == NONE
    assert buffer.state(START + 900 * MS) == FRESH and wanted_m(buffer, 900) == 0.005


def test_a_reference_is_held_until_then_and_one_that_is_lost_stays_so():
    buffer = buffer_with(Reference(START - 1500 * MS, 0.014, 0.0), moving(START, 900))
    assert buffer.state(START) == buffer.state(START + 899 * MS) == HELD
    assert wanted_m(buffer, 899) == 0.014 and wanted_m(buffer, 900) == 0.005
    assert buffer.state(START + 900 * MS) == FRESH
    lost = buffer_with(Reference(START - 1500 * MS, 0.014, 0.0))
    late_ns = START + 600 * MS
    lost.set_trajectory(moving(late_ns, 900))
    lost.judge(late_ns)
    assert lost.state(late_ns) == LOST and lost.state(late_ns + 900 * MS) == FRESH


@pytest.mark.parametrize('first_m, rate_m_per_s, ahead_ms, bound_m', [
    (0.015, 0.06, 400, 0.03), (0.015, -0.06, 400, 0.0)])
def test_the_preview_beyond_its_end_stays_within_the_allowed_values(
        first_m, rate_m_per_s, ahead_ms, bound_m):
    buffer = buffer_with(moving(START, 0, first_m, rate_m_per_s), allowed=(0.0, 0.03))
    now_ns = START + 100 * MS
    assert buffer.at(now_ns, now_ns + ahead_ms * MS) == (bound_m, 0.0)

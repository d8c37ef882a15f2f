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

"""What a wanted value must be stamped with: a sender with old stamps moves and vents nothing."""

from pam_actuation.control.joint_setpoint import JointSetpoint
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.control.modes.tracked import CONTRACTION, FORCE
from pam_actuation.control.reference_buffer import FRESH, HELD, LOST, NONE, ReferenceBuffer
from pam_actuation.messages import (
    AngleReference, AngleTrajectory, Contraction, NamedEfforts, Reference, ReferenceTrajectory)
from pam_actuation.nodes.refusals import RefusalLog
from pam_sim.units import P_ATM_PA
import pytest
from straight_rig import sofc

MS = 1_000_000
START = 1_700_000_000_000_000_123
OLD_NS = 5_000 * MS


def drive(references_at, ticks=300):
    """Tick at 200 Hz; return loop, reasons and commands. ``references_at(k, now)``: of a tick."""
    loop, reasons, commands_pa = ControllerLoop(sofc()), [], []
    for k in range(ticks):
        now = START + k * 5 * MS
        loop.take('contraction', Contraction(now, 0.01 + 1e-9 * k))
        for stamp_ns, wanted_m in references_at(k, now):
            loop.take('reference', Reference(stamp_ns, wanted_m))
        (command,), _ = loop.tick(now)
        reasons.append(loop.reason)
        commands_pa.append(command.pressure_pa)
    return loop, reasons, commands_pa


def planner(k, now):
    return [(now, 0.01)] if k % 4 == 0 else []


@pytest.mark.parametrize('ticks_later', [0, 2])
@pytest.mark.parametrize('first', [True, False])
def test_a_second_planner_with_old_stamps_changes_nothing(ticks_later, first):
    def both(k, now):
        old = [(now - OLD_NS, 0.02)] if k % 4 == ticks_later else []
        return old + planner(k, now) if first else planner(k, now) + old

    loop, reasons, commands_pa = drive(both)
    alone, _, expected_pa = drive(planner)
    assert set(reasons) == {'ok'} and commands_pa == expected_pa
    assert loop.rejected_references >= 74 and alone.rejected_references == 0
    assert loop.references.refusal == 'a reference is stamped 5.0 s ago; is header.stamp filled?'


@pytest.mark.parametrize('stamp_of, why', [
    (lambda now: 0, 'the header.stamp of a reference is zero'),
    (lambda now: now - 2_001 * MS, 'a reference is stamped 2.0 s ago')])
def test_a_planner_alone_whose_stamps_are_old_is_refused_with_a_reason(stamp_of, why):
    loop, reasons, commands_pa = drive(
        lambda k, now: [(stamp_of(now), wanted) for _, wanted in planner(k, now)], ticks=40)
    assert set(reasons) == {'no reference yet'} and set(commands_pa) == {P_ATM_PA}
    assert loop.rejected_references == 10 and why in loop.references.refusal
    assert ('references.refused', 10) in loop.setpoint.values()


def test_one_that_is_late_but_not_lost_still_counts():
    _, reasons, _ = drive(
        lambda k, now: [(now - 1_000 * MS, wanted) for _, wanted in planner(k, now)], ticks=8)
    assert set(reasons) == {'reference lost, holding its last position'}


def test_one_older_than_the_one_held_is_refused():
    buffer = ReferenceBuffer()
    for after_ms, refused in ((0, 0), (20, 0), (10, 1), (20, 1), (40, 1)):
        buffer.set_reference(Reference(START + after_ms * MS, 0.01))
        buffer.judge(START + 40 * MS)
        assert buffer.refused == refused
    assert buffer.reference.stamp_ns == START + 40 * MS
    assert 'before the newest one' in buffer.refusal


@pytest.mark.parametrize('back_s', [1, 3600])
def test_after_the_clock_was_set_back_new_references_count_at_once(back_s):
    buffer = ReferenceBuffer()
    for now in (START, START - back_s * 1_000 * MS):
        buffer.set_reference(Reference(now, 0.01))
        buffer.judge(now)
        assert buffer.reference.stamp_ns == now
    assert buffer.refused == 0


def test_of_those_that_waited_the_newest_counts_and_none_is_refused():
    buffer = ReferenceBuffer()
    for k in range(300):                    # a controller that stood still for 3 s
        buffer.set_reference(Reference(START + 10 * k * MS, 0.01))
    buffer.judge(START + 3_000 * MS)
    assert buffer.refused == 0 and buffer.reference.stamp_ns == START + 2_990 * MS


@pytest.mark.parametrize('first', [True, False])
def test_a_trajectory_that_ended_long_ago_does_not_replace_one_that_counts(first):
    buffer = ReferenceBuffer()
    good = ReferenceTrajectory(START, (0, 500 * MS), (0.01, 0.01), (0.0, 0.0))
    old = ReferenceTrajectory(START - OLD_NS, (0, 500 * MS), (0.02, 0.02), (0.0, 0.0))
    for trajectory in (old, good) if first else (good, old):
        buffer.set_trajectory(trajectory)
        buffer.judge(START)
    assert buffer.trajectory == good and buffer.refused == 1
    assert buffer.refusal == 'a trajectory ended 4.5 s ago; is header.stamp filled?'
    buffer.clear()
    assert buffer.state(START) == NONE


def test_one_that_was_held_grows_old_as_before():
    buffer = ReferenceBuffer()
    buffer.set_reference(Reference(START, 0.01))
    for now in (START, START + 2_001 * MS):
        buffer.judge(now)
    assert buffer.state(START + 2_001 * MS) == LOST and buffer.refused == 0


def test_a_joint_keeps_what_its_sound_sender_wants():
    setpoint = JointSetpoint((-1.0, 1.0), 'knee', (1e5, 7e5))
    setpoint.takes()['joint_reference'](AngleReference(START, 0.1))
    setpoint.begin(START, 0.0)
    setpoint.takes()['joint_reference'](AngleReference(START - OLD_NS, 0.5))
    for begin_ns, angle_rad in ((START, 0.2), (START - OLD_NS, 0.5)):     # within one tick
        setpoint.on_trajectory(AngleTrajectory(
            begin_ns, (0, 500 * MS), (angle_rad, angle_rad), (0.0, 0.0)))
    setpoint.begin(START + MS, 0.0)
    assert setpoint.references.reference == AngleReference(START, 0.1)
    assert setpoint.references.trajectory.angle_rad == (0.2, 0.2)
    assert setpoint.refused == 2
    assert setpoint.refusals[:2] == (
        'joint_trajectory: lies in the past',
        'a reference is stamped 5.0 s ago; is header.stamp filled?')


def test_the_log_tells_a_reason_once_whatever_its_numbers():
    lines = []
    log = RefusalLog(lines.append)
    for age_s in (5.0, 5.1, 12.0):
        log.note('', f'a reference is stamped {age_s} s ago', '')
    log.note('', 'a reference is stamped before the newest one', '')
    assert lines == ['a set point was refused: a reference is stamped 5.0 s ago',
                     'a set point was refused: a reference is stamped before the newest one']


def test_the_log_is_no_flood_where_good_and_bad_messages_come_in_turn():
    """As of a sender that sends each joint a trajectory of its own, on one topic."""
    lines, time_s = [], [0.0]
    log = RefusalLog(lines.append, lambda: time_s[0])
    other, old = 'joint_names right do not name this joint, left', 'a reference is 5 s old'

    def after(s, *refusals):
        time_s[0] += s
        lines.clear()
        log.note(*refusals)
        return [line.removeprefix('a set point was refused: ') for line in lines]

    assert after(0.0, other, '') == [other]
    for _ in range(1000):
        assert after(0.02, '', '') == after(0.02, other, '') == []
    assert after(0.02, other, old) == [old]
    assert after(60.0, '', '') == after(1.0, other, old) == []      # it stood until a second ago
    after(1.0, '', '')
    assert after(11.0, other, '') == [other]


def states_after(last_ns, state_at):
    return [state_at(last_ns + ms * MS) for ms in (500, 501, 2_000, 2_001, 30_000)]


@pytest.mark.parametrize('tracked, field', [(CONTRACTION, 'contraction_m'), (FORCE, 'force_n')])
def test_a_long_trajectory_that_was_replaced_does_not_hide_that_the_reference_is_lost(
        tracked, field):
    buffer = ReferenceBuffer(tracked)
    buffer.set_trajectory(ReferenceTrajectory(
        START, (0, 60_000 * MS), **{field: (0.005, 0.02)}))
    buffer.judge(START)
    assert buffer.state(START + 4_000 * MS) == FRESH        # a whole movement, to its end
    last_ns = START + 5_000 * MS
    buffer.set_reference(Reference(last_ns, **{'contraction_m': 0.01, field: 0.01}))
    buffer.judge(last_ns)
    assert states_after(last_ns, buffer.state) == [FRESH, HELD, HELD, LOST, LOST]


def test_a_joint_follows_a_torque_where_the_reference_that_replaced_a_trajectory_is_old():
    setpoint = JointSetpoint((-1.0, 1.0), 'knee', (1e5, 7e5))
    setpoint.on_trajectory(AngleTrajectory(START, (0, 60_000 * MS), (0.0, 0.4), (0.0, 0.0)))
    setpoint.begin(START, 0.0)
    last_ns = START + 5_000 * MS
    setpoint.references.set_reference(AngleReference(last_ns, -0.1, 0.0))
    setpoint.begin(last_ns, 0.0)
    assert states_after(last_ns, setpoint.references.state) == [FRESH, HELD, HELD, LOST, LOST]
    later_ns = last_ns + 600 * MS
    setpoint.on_efforts(NamedEfforts(later_ns, ('knee',), (0.05,)))
    setpoint.begin(later_ns, 0.0)
    assert setpoint.effort.follows and setpoint.efforts.refusal == ''

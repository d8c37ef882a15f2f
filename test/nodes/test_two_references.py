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

"""Test that a controller warns of two nodes that send one reference, and names both."""

import logging
from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy')

from pam_actuation.control.config import load_controller                    # noqa: E402, I100
from pam_actuation.control.loop import ControllerLoop                       # noqa: E402
from pam_actuation.messages import (                                        # noqa: E402
    AngleReference, Contraction, is_fault, JointAngle, LEVEL_ERROR, LEVEL_OK, LEVEL_WARN,
    NamedTrajectory, Pressure, Reference)
from pam_actuation.nodes.controller_node import ControllerNode, FOLLOWING   # noqa: E402
from pam_sim import load_rig                                                # noqa: E402
from pam_sim.joint import load_joint                                        # noqa: E402

MS = 1_000_000
START = 1_700_000_000_000_000_000


class Controller(ControllerNode):
    """A controller node without ROS: what arrives and who sends it is given."""

    participants, stopping = (), False

    def __init__(self, loop):
        self.loop, self.now, self.arriving, self.said = loop, START, {}, []
        self.learning = True
        self.diagnostics = SimpleNamespace(update=lambda *said: self.said.append(said))
        self.create_topics()

    def add_subscription(self, name, writers=False, **other):
        def take():
            found, self.arriving[name] = self.arriving.get(name, []), []
            return [(message, {'writer': writer} if writers else {}) for message, writer in found]
        return SimpleNamespace(topic=f'/leg/{name}', take=take)

    def get_publishers_info_by_topic(self, topic):
        return [SimpleNamespace(endpoint_gid=name.encode(), node_namespace='/', node_name=name)
                for name in ('gait', 'teleop', 'encoder')]

    def get_logger(self):
        return logging.getLogger('test')

    def add_publisher(self, topic):
        pass

    def send(self, topic, message):
        pass

    def now_ns(self):
        return self.now

    def run(self, ticks, sensors, wanted):
        """Tick at 200 Hz; ``wanted(k, now_ns)`` returns (topic, message, writer) of a tick."""
        self.said.clear()
        for k in range(ticks):
            self.now += 5 * MS
            for message in sensors(self.now):
                topic = {'JointAngle': 'joint_state'}.get(
                    type(message).__name__, type(message).__name__.lower())
                self.arriving.setdefault(topic, []).append((message, b'encoder'))
            for topic, message, writer in wanted(k, self.now):
                self.arriving.setdefault(topic, []).append((message, writer))
            self.tick()
        return self.said


@pytest.fixture
def muscle():
    return Controller(ControllerLoop(load_controller('pid', load_rig('dmsp_5_300_hanging_mass'))))


@pytest.fixture
def joint():
    rig = load_joint('joint_dmsp_5_300_realistic', valve='ppr')
    return Controller(ControllerLoop(load_controller('sofc_joint_ppr', rig), rig, 'knee'))


def measured(now_ns):
    return Contraction(now_ns, 0.01 + now_ns % 7 * 1e-9), Pressure(now_ns, 3e5)


def angle(now_ns):
    return (JointAngle(now_ns, 0.1 + now_ns % 7 * 1e-9),)


def reference(writer, wanted_m):
    return lambda now_ns: ('reference', Reference(now_ns, wanted_m), writer)


GAIT, TELEOP = reference(b'gait', 0.004), reference(b'teleop', 0.013)


def test_two_planners_are_warned_of_and_named_and_followed_on(muscle):
    said = muscle.run(40, measured, lambda k, now: [(GAIT, TELEOP)[k % 4 // 2](now)]
                      if k % 2 == 0 else [])
    assert said[-1] == (LEVEL_WARN, f'{FOLLOWING}; two publishers send /leg/reference: '
                        '/gait and /teleop, stop one of them')
    assert muscle.loop.reason == 'ok' and muscle.loop.two_sensors == ''
    said = muscle.run(240, measured, lambda k, now: [GAIT(now)])
    assert said[-1] == (LEVEL_OK, FOLLOWING)


def test_a_planner_that_takes_the_place_of_another_is_no_second_one(muscle):
    said = muscle.run(80, measured, lambda k, now: [(GAIT if k < 40 else TELEOP)(now)])
    assert set(said) == {(LEVEL_OK, FOLLOWING)}


def test_two_planners_of_which_one_has_old_stamps_are_named_too(muscle):
    old = reference(b'teleop', 0.013)
    said = muscle.run(40, measured, lambda k, now: [GAIT(now), old(now - 5_000 * MS)])
    assert said[-1][0] == LEVEL_WARN and '/gait and /teleop' in said[-1][1]
    assert muscle.loop.rejected_references == 40


def test_two_planners_of_a_joint_are_named(joint):
    said = joint.run(40, angle, lambda k, now: [
        ('joint_reference', AngleReference(now, 0.1), (b'gait', b'teleop')[k % 2])])
    assert said[-1] == (LEVEL_WARN, f'{FOLLOWING}; two publishers send /leg/joint_reference: '
                        '/gait and /teleop, stop one of them')


def test_trajectories_of_several_joints_may_have_several_senders(joint):
    def trajectory(now_ns, name, writer):
        return 'joint_trajectory', NamedTrajectory(
            now_ns, (name,), ((100 * MS, (0.1,), ()),)), writer

    said = joint.run(40, angle, lambda k, now: [
        trajectory(now, 'knee', b'gait'), trajectory(now, 'hip', b'teleop')])
    assert not any('publishers' in text for _, text in said)


def in_mm(now_ns):
    """Return a contraction in millimetres, as of a board that knows no metres."""
    return Contraction(now_ns, 10.0 + now_ns % 7 * 1e-9), Pressure(now_ns, 3e5)


def not_a_number(now_ns):
    return Contraction(now_ns, float('nan')), Pressure(now_ns, 3e5)


@pytest.mark.parametrize('sensors, why', [
    (in_mm, 'contraction is outside what the muscle can do, 10000 mm, believable are -10 to '),
    (not_a_number, 'contraction is not a finite number'),
    (lambda now_ns: (Pressure(now_ns, 3e5),), 'contraction is older than 0.1 s')])
def test_a_controller_that_vents_for_its_sensor_reports_an_error(muscle, sensors, why):
    """As a driver does that vents: ``pam up`` ended with exit code 0, and nothing had moved."""
    assert muscle.run(40, measured, lambda k, now: [GAIT(now)])[-1] == (LEVEL_OK, FOLLOWING)
    level, said = muscle.run(40, sensors, lambda k, now: [GAIT(now), TELEOP(now)])[-1]
    assert level == LEVEL_ERROR and said.startswith(why) and 'two publishers' in said
    assert is_fault(level, said)


def test_a_sensor_that_is_late_for_a_moment_at_rest_is_no_error(muscle):
    assert muscle.run(40, measured, lambda k, now: [])[-1][1] == 'no reference yet'
    late = muscle.run(220, lambda now_ns: (), lambda k, now: [])
    assert late[100] == (LEVEL_WARN, 'contraction is older than 0.1 s')
    assert {level for level, _ in late} == {LEVEL_WARN}
    said = muscle.run(20, lambda now_ns: (), lambda k, now: [])
    assert said[-1] == (LEVEL_ERROR, 'contraction is older than 0.1 s')     # dead
    assert muscle.run(1, measured, lambda k, now: [])[-1] == (LEVEL_WARN, 'no reference yet')


def test_a_controller_that_waits_warns(muscle):
    assert muscle.run(40, lambda now_ns: (), lambda k, now: [])[-1] == (
        LEVEL_WARN, 'no contraction measured yet')
    assert muscle.run(40, measured, lambda k, now: [])[-1] == (LEVEL_WARN, 'no reference yet')

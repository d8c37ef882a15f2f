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

"""Test how plain messages become ROS messages and come back."""

import math

import pytest

pytest.importorskip('rclpy')

from pam_actuation import messages                                          # noqa: E402, I100
from pam_actuation.bags.codecs import decode, encode, TOPIC_TYPES           # noqa: E402
from pam_actuation.nodes.conversions import diagnostic_array, from_ros      # noqa: E402
from pam_actuation.nodes.conversions import MESSAGE_TYPES, RosWriter        # noqa: E402
from rclpy.serialization import serialize_message                           # noqa: E402

STAMP_NS = 1_700_000_000_123_456_789
SAMPLES = {
    'reference': messages.Reference(STAMP_NS, 0.0123, -0.004),
    'reference_trajectory': messages.ReferenceTrajectory(
        STAMP_NS, (0, 20_000_000, 1_040_000_000), (0.01, 0.011, 0.012), (0.0, 0.1, -0.1)),
    'pressure_command': messages.Pressure(STAMP_NS, 345_678.9),
    'followed_pressure': messages.Pressure(STAMP_NS, 234_567.8),
    'valve_signal': messages.ValveSignal(STAMP_NS, ('fill_duty', 'vent_duty'), (0.25, 0.0)),
    'pressure': messages.Pressure(STAMP_NS, 101_325.0),
    'supply_pressure': messages.Pressure(STAMP_NS, 801_325.0),
    'contraction': messages.Contraction(STAMP_NS, 0.014, 0.02),
    'force': messages.Force(STAMP_NS, 49.03),
    'external_force': messages.Force(STAMP_NS, -3.5),
    'controller_state': messages.ControllerState(STAMP_NS, ('tick', 'error_m'), (7.0, 1e-4)),
}

JOINT_SAMPLES = {
    'joint_state': messages.JointAngle(STAMP_NS, 0.25, -1.5),
    'joint_reference': messages.AngleReference(STAMP_NS, 0.25, -0.1),
    'joint_effort': messages.NamedEfforts(STAMP_NS, ('hip', 'knee'), (1.5, -20.0)),
    'co_contraction': messages.Pressure(STAMP_NS, 401_325.0),
}


@pytest.mark.parametrize('topic', JOINT_SAMPLES)
def test_there_and_back_for_a_joint(topic):
    full = f'/left_knee/{topic}'
    assert from_ros(full, RosWriter(full).fill(JOINT_SAMPLES[topic])) == JOINT_SAMPLES[topic]


def test_a_trajectory_arrives_with_names_and_points():
    sent = messages.AngleTrajectory(STAMP_NS, (0, 20_000_000), (0.2, 0.3), (0.0, 5.0))
    message = RosWriter('joint_trajectory', 'knee').fill(sent)
    assert from_ros('/left/joint_trajectory', message) == messages.NamedTrajectory(
        STAMP_NS, ('knee',), ((0, (0.2,), (0.0,)), (20_000_000, (0.3,), (5.0,))))


def test_a_torque_not_known_is_empty_on_the_wire():
    message = RosWriter('joint_state', 'knee').fill(messages.JointAngle(STAMP_NS, 0.25))
    assert (list(message.name), list(message.effort)) == (['knee'], [])
    assert math.isnan(from_ros('joint_state', message).torque_n_m)


def test_every_topic_of_a_bag_has_a_ros_message():
    assert {*MESSAGE_TYPES, 'diagnostics'} == set(TOPIC_TYPES)
    for topic, message_type in MESSAGE_TYPES.items():
        package, _, name = TOPIC_TYPES[topic].split('/')
        assert (message_type.__module__.split('.')[0], message_type.__name__) == (package, name)


@pytest.mark.parametrize('topic', SAMPLES)
def test_there_and_back(topic):
    assert from_ros(topic, RosWriter(topic).fill(SAMPLES[topic])) == SAMPLES[topic]


FORCES = {
    'reference': messages.Reference(STAMP_NS, force_n=42.5),
    'reference_trajectory': messages.ReferenceTrajectory(
        STAMP_NS, (0, 20_000_000), force_n=(42.5, 43.0))}


@pytest.mark.parametrize('topic', FORCES)
def test_a_wanted_force_travels_in_effort(topic):
    message = RosWriter(topic).fill(FORCES[topic])
    assert repr(from_ros(topic, message)) == repr(FORCES[topic])
    assert repr(decode(topic, serialize_message(message))) == repr(FORCES[topic])
    assert encode(topic, FORCES[topic]) == encode(topic, decode(topic, serialize_message(message)))


@pytest.mark.parametrize('topic', SAMPLES)
def test_the_bytes_mean_the_same_in_a_bag(topic):
    data = serialize_message(RosWriter(topic).fill(SAMPLES[topic]))
    assert decode(topic, data) == SAMPLES[topic]


def test_a_writer_forgets_the_message_before():
    writer = RosWriter('reference_trajectory')
    writer.fill(SAMPLES['reference_trajectory'])
    short = messages.ReferenceTrajectory(STAMP_NS + 1, (0,), (0.5,), (0.0,))
    assert from_ros('reference_trajectory', writer.fill(short)) == short


def test_what_was_not_measured_is_empty_on_the_wire_and_not_a_number_inside():
    message = RosWriter('contraction').fill(messages.Contraction(STAMP_NS, 0.01))
    assert len(message.velocity) == 0
    assert math.isnan(from_ros('contraction', message).velocity_m_per_s)
    message.position = []
    assert math.isnan(from_ros('contraction', message).contraction_m)


def test_a_status_keeps_level_reason_and_values():
    status = messages.Status(STAMP_NS, 2, '/muscle/valve_driver', 'vented', (('a', 1), ('b', '2')))
    only, = diagnostic_array(status).status
    assert (only.level, only.name, only.message) == (b'\x02', '/muscle/valve_driver', 'vented')
    assert [(item.key, item.value) for item in only.values] == [('a', '1'), ('b', '2')]

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

"""Test that bytes of plain messages are those of the ROS messages they stand for."""

from array import array
import math
import struct

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue  # noqa: E402, I100
from geometry_msgs.msg import WrenchStamped                                 # noqa: E402
from live_rig import wait_for                                               # noqa: E402
from pam_actuation import messages                                          # noqa: E402
from pam_actuation.nodes.endpoints import CountedPublisher                  # noqa: E402
from pam_actuation.nodes.endpoints import PolledSubscription                # noqa: E402
from pam_actuation.nodes.ros_messages import class_of, set_stamp            # noqa: E402
from pam_actuation.rigging.client import RigClient                          # noqa: E402
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
from pam_actuation.topics.codec import decode, encode, Reader, Writer       # noqa: E402
from pam_actuation.topics.contents import Numbers                           # noqa: E402
from pam_actuation.topics.table import RECORDED, TOPICS                     # noqa: E402
from rclpy.serialization import deserialize_message, serialize_message      # noqa: E402
from rosbags.typesys import get_typestore, Stores                           # noqa: E402
from sensor_msgs.msg import FluidPressure, JointState                       # noqa: E402
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint       # noqa: E402

NAN = math.nan
STAMP_NS = 1_700_000_000_123_456_789
TIMES_NS = (0, 20_000_000, 1_040_000_000)
DUTIES = ('fill_duty', 'vent_duty')


def joint(name=('knee',), position=(), velocity=(), effort=()):
    return JointState(name=list(name), position=array('d', position),
                      velocity=array('d', velocity), effort=array('d', effort))


def wrench(force_n=0.0, torque_n_m=0.0):
    message = WrenchStamped()
    message.wrench.force.x = force_n
    message.wrench.torque.y = torque_n_m
    return message


def path(*points):
    """Return a trajectory of (positions, velocities, efforts), a point at each of TIMES_NS."""
    message = JointTrajectory(joint_names=['knee'])
    for time_ns, (positions, velocities, effort) in zip(TIMES_NS, points):
        point = JointTrajectoryPoint(
            positions=list(positions), velocities=list(velocities), effort=list(effort))
        set_stamp(point.time_from_start, time_ns)
        message.points.append(point)
    return message


# Topic, plain message and the ROS message it stands for, stamp apart.
SAMPLES = [
    ('pressure', messages.Pressure(STAMP_NS, 101_325.0), FluidPressure(fluid_pressure=101_325.0)),
    ('pressure_command', messages.Pressure(0, 2e5), FluidPressure(fluid_pressure=2e5)),
    ('followed_pressure', messages.Pressure(-1, 3e5), FluidPressure(fluid_pressure=3e5)),
    ('supply_pressure', messages.Pressure(STAMP_NS, 8e5), FluidPressure(fluid_pressure=8e5)),
    ('co_contraction', messages.Pressure(STAMP_NS, 4e5), FluidPressure(fluid_pressure=4e5)),
    ('force', messages.Force(STAMP_NS, 49.03), wrench(49.03)),
    ('external_force', messages.Force(STAMP_NS, -3.5), wrench(-3.5)),
    ('external_torque', messages.Torque(STAMP_NS, -1.5), wrench(torque_n_m=-1.5)),
    ('contraction', messages.Contraction(STAMP_NS, 0.014, 0.02),
     joint(position=(0.014,), velocity=(0.02,))),
    ('contraction', messages.Contraction(STAMP_NS, 0.014), joint(position=(0.014,))),
    ('reference', messages.Reference(STAMP_NS, 0.0123, -0.004),
     joint(position=(0.0123,), velocity=(-0.004,))),
    ('reference', messages.Reference(STAMP_NS, 0.0123), joint(position=(0.0123,))),
    ('reference', messages.Reference(STAMP_NS, force_n=42.5), joint(effort=(42.5,))),
    ('reference_trajectory', messages.ReferenceTrajectory(
        STAMP_NS, TIMES_NS, (0.01, 0.011, 0.012), (0.0, 0.1, -0.1)),
     path(((0.01,), (0.0,), ()), ((0.011,), (0.1,), ()), ((0.012,), (-0.1,), ()))),
    ('reference_trajectory', messages.ReferenceTrajectory(
        STAMP_NS, TIMES_NS[:2], force_n=(42.5, 43.0)),
     path(((), (), (42.5,)), ((), (), (43.0,)))),
    ('reference_trajectory', messages.ReferenceTrajectory(STAMP_NS, ()), path()),
    ('valve_signal', messages.ValveSignal(STAMP_NS, DUTIES, (0.25, 0.0)),
     joint(DUTIES, effort=(0.25, 0.0))),
    ('valve_command', messages.ValveSignal(STAMP_NS, ('ppr_voltage',), (4.5,)),
     joint(('ppr_voltage',), effort=(4.5,))),
    ('valve_signal', messages.ValveSignal(STAMP_NS, (), ()), joint(())),
    ('controller_state', messages.ControllerState(STAMP_NS, ('tick', 'error_m'), (7.0, 1e-4)),
     joint(('tick', 'error_m'), position=(7.0, 1e-4))),
    ('joint_state', messages.JointAngle(STAMP_NS, 0.25, -1.5),
     joint(position=(0.25,), effort=(-1.5,))),
    ('joint_state', messages.JointAngle(STAMP_NS, 0.25), joint(position=(0.25,))),
    ('joint_reference', messages.AngleReference(STAMP_NS, 0.25, -0.1),
     joint(position=(0.25,), velocity=(-0.1,))),
    ('joint_effort', messages.NamedEfforts(STAMP_NS, ('hip', 'knee'), (1.5, -20.0)),
     joint(('hip', 'knee'), effort=(1.5, -20.0))),
    ('joint_effort', messages.NamedEfforts(STAMP_NS, (), (1.5,)), joint((), effort=(1.5,))),
    ('marker', messages.Marker(STAMP_NS, 'à 6 bar', '/pam_view_1'),
     DiagnosticArray(status=[DiagnosticStatus(
         level=b'\0', name='/pam_view_1', message='à 6 bar')])),
]
ONE_OF_EACH = {topic: plain for topic, plain, _ in reversed(SAMPLES)}


def stamped(message, stamp_ns):
    """Return a ROS message with its stamp set."""
    set_stamp(message.header.stamp, stamp_ns)
    return message


def sent_as(topic, raw):
    """Return the ROS message that bytes are."""
    return deserialize_message(raw, class_of(topic))


@pytest.mark.parametrize('topic, plain, message', SAMPLES)
def test_bytes_are_those_of_the_ros_message(topic, plain, message):
    full, wanted = f'/left/{topic}', stamped(message, plain.stamp_ns)
    assert sent_as(full, Writer(full, 'knee').fill(plain)) == wanted
    raw = bytes(serialize_message(wanted))
    for found in (Reader(full)(raw), decode(full, raw)):
        assert repr(found) == repr(plain)


def test_there_is_a_sample_of_every_topic():
    """Plain numbers in a bag are held against ROS's own serializer in test_middleware_bytes.py."""
    others = {topic.name for topic in TOPICS if topic.name not in RECORDED
              or not isinstance(topic.content, Numbers)}
    assert others <= {*ONE_OF_EACH, 'joint_trajectory', 'diagnostics'}


def test_a_trajectory_of_a_joint_arrives_with_names_and_points():
    sent = messages.AngleTrajectory(STAMP_NS, TIMES_NS[:2], (0.2, 0.3), (0.0, 5.0))
    raw = Writer('joint_trajectory', 'knee').fill(sent)
    assert sent_as('joint_trajectory', raw) == stamped(
        path(((0.2,), (0.0,), ()), ((0.3,), (5.0,), ())), STAMP_NS)
    assert Reader('/left/joint_trajectory')(raw) == messages.NamedTrajectory(
        STAMP_NS, ('knee',), ((0, (0.2,), (0.0,)), (TIMES_NS[1], (0.3,), (5.0,))))


def test_what_a_point_of_a_trajectory_leaves_out_is_no_number():
    raw = bytes(serialize_message(stamped(
        path(((0.01,), (), ()), ((), (0.1,), ()), ((0.02,), (0.1,), ())), STAMP_NS)))
    found = Reader('reference_trajectory')(raw)
    assert repr(found) == repr(decode('reference_trajectory', raw)) == repr(
        messages.ReferenceTrajectory(
            STAMP_NS, TIMES_NS, (0.01, NAN, 0.02), (NAN, 0.1, 0.1)))


def test_a_status_keeps_level_reason_and_values():
    status = messages.Status(
        STAMP_NS, 2, '/muscle/valve_driver', 'vented', (('a', 1), ('b', '2')), 'pam_actuation')
    wanted = stamped(DiagnosticArray(status=[DiagnosticStatus(
        level=b'\x02', name='/muscle/valve_driver', message='vented', hardware_id='pam_actuation',
        values=[KeyValue(key='a', value='1'), KeyValue(key='b', value='2')])]), STAMP_NS)
    assert sent_as('diagnostics', encode('diagnostics', status)) == wanted
    only, = Reader('/diagnostics')(bytes(serialize_message(wanted)))
    assert only == messages.Status(*[
        *(getattr(status, name) for name in ('stamp_ns', 'level', 'name', 'message')),
        (('a', '1'), ('b', '2')), 'pam_actuation'])


@pytest.mark.parametrize('topic', ONE_OF_EACH)
def test_bytes_are_exact(topic):
    first, second = (Writer(topic, '', 'a').fill(ONE_OF_EACH[topic]) for _ in range(2))
    assert first == second
    store, type_name = get_typestore(Stores.ROS2_JAZZY), next(
        one.type_name for one in TOPICS if one.name == topic)
    message = store.deserialize_cdr(first, type_name)      # refuses what is too long
    assert bytes(store.serialize_cdr(message, type_name)) == first


# What one topic carries one after the other: other numbers, others missing, other names.
SERIES = {
    'pressure': [messages.Pressure(STAMP_NS, 2e5), messages.Pressure(STAMP_NS + 5, -NAN)],
    'force': [messages.Force(0, 1.0), messages.Force(-1, -2.5), messages.Force(STAMP_NS, 1e300)],
    'contraction': [
        messages.Contraction(STAMP_NS, 0.01), messages.Contraction(STAMP_NS + 1, 0.02, 0.3),
        messages.Contraction(STAMP_NS + 2, 0.03, -0.1), messages.Contraction(STAMP_NS + 3, NAN)],
    'reference': [
        messages.Reference(STAMP_NS, 0.01, 0.1), messages.Reference(STAMP_NS, 0.0, 0.0),
        messages.Reference(STAMP_NS, force_n=2.0), messages.Reference(STAMP_NS, 0.02)],
    'reference_trajectory': [
        messages.ReferenceTrajectory(STAMP_NS, TIMES_NS, (0.1, 0.2, 0.3), (0.0, 0.0, 0.0)),
        messages.ReferenceTrajectory(STAMP_NS + 1, (0,), (0.5,), (0.0,))],
    'valve_signal': [
        messages.ValveSignal(1, DUTIES, (0.5, 0.0)), messages.ValveSignal(2, DUTIES, (0.0, 1.0)),
        messages.ValveSignal(3, ('ppr_voltage',), (4.5,)), messages.ValveSignal(4, (), ())],
    'joint_state': [messages.JointAngle(1, 0.2, -3.0), messages.JointAngle(2, 0.3)],
}


@pytest.mark.parametrize('topic, series', SERIES.items())
def test_a_changed_layout_is_noticed(topic, series):
    writer, reader = Writer(topic, 'knee'), Reader(topic)
    for plain in [*series, *reversed(series)]:
        sent = writer.fill(plain)
        assert sent == Writer(topic, 'knee').fill(plain)
        assert repr(reader(sent)) == repr(plain)


def test_names_and_frame_of_another_sender_move_the_numbers():
    reader = Reader('contraction')
    plain = messages.Contraction(STAMP_NS, 0.01, 0.5)
    for muscle in ('m', 'rectus_femoris', 'm'):
        for frame_id in ('', 'thigh'):
            message = stamped(joint((muscle,), (0.01,), (0.5,)), STAMP_NS)
            message.header.frame_id = frame_id
            assert reader(bytes(serialize_message(message))) == plain
            assert sent_as('contraction', Writer(
                'contraction', muscle, frame_id).fill(plain)) == message


def test_a_text_that_is_no_utf8_is_read_as_rclpy_reads_it():
    raw = Writer('pressure', frame_id='br?cke').fill(messages.Pressure(3, 2.5e5))
    raw = raw.replace(b'?', b'\xfc')
    assert sent_as('pressure', raw).header.frame_id == 'br\ufffdcke'
    assert Reader('pressure')(raw) == decode('pressure', raw) == messages.Pressure(3, 2.5e5)


def test_bytes_of_a_big_endian_machine_are_read_too():
    raw = (b'\x00\x00\x00\x00' + struct.pack('>iI', 3, 7) + struct.pack('>I', 1) + bytes(4)
           + struct.pack('>dd', 2.5e5, 0.0))
    reader = Reader('pressure')
    assert reader(raw) == messages.Pressure(3_000_000_007, 2.5e5)
    assert reader(Writer('pressure').fill(messages.Pressure(9, 1e5))).pressure_pa == 1e5


@pytest.mark.parametrize('topic', ['pressure', 'contraction', 'force', 'reference_trajectory'])
@pytest.mark.parametrize('raw', [
    b'', b'\x00\x01\x00\x00', b'\x00\x01\x00\x00' + b'\xff' * 40, b'\x00\x00' + bytes(9),
    b'\x00\x01\x00\x00' + bytes(8) + b'\x00\x00\x10\x00' + b'a' * 60])
def test_bytes_that_are_no_message_are_dropped_and_the_next_one_is_read(topic, raw):
    reader, plain = Reader(topic), ONE_OF_EACH[topic]
    good = bytes(serialize_message(sent_as(topic, Writer(topic).fill(plain))))
    assert [reader(one) for one in (good, raw, good)] == [plain, None, plain]


@pytest.mark.ros
def test_a_node_drops_bytes_that_are_no_message():
    lock = DomainLock()
    client = RigClient(lock.domain_id)
    try:
        kind, topic = class_of('pressure'), '/muscle/pressure'
        publisher = CountedPublisher(client.node, kind, topic)
        subscription = PolledSubscription(
            client.node, kind, topic, raw=True, read=Reader(topic))
        wait_for(lambda: subscription.publishers, 10.0, 'the publisher')
        publisher.publish(b'\x00\x01\x00\x00' + b'\xff' * 40)
        publisher.publish(Writer(topic).fill(ONE_OF_EACH['pressure']))
        taken = []
        wait_for(lambda: taken.extend(subscription.take()) or taken, 10.0, 'the message')
        assert [message for message, _ in taken] == [ONE_OF_EACH['pressure']]
        assert subscription.received == 1
    finally:
        client.close()
        lock.release()

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

"""Test that the short way between plain messages and bytes gives what ROS messages give."""

import math
import struct

import pytest

pytest.importorskip('rclpy')

from live_rig import wait_for                                               # noqa: E402, I100
from pam_actuation import messages                                          # noqa: E402
from pam_actuation.bags.codecs import TOPIC_TYPES                           # noqa: E402
from pam_actuation.nodes.conversions import RosWriter, type_of              # noqa: E402
from pam_actuation.nodes.endpoints import CountedPublisher                  # noqa: E402
from pam_actuation.nodes.endpoints import PolledSubscription                # noqa: E402
from pam_actuation.nodes.wire import WireReader, WireWriter                 # noqa: E402
from pam_actuation.rigging.client import RigClient                          # noqa: E402
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
from rclpy.serialization import deserialize_message, serialize_message      # noqa: E402
from rosbags.typesys import get_typestore, Stores                           # noqa: E402
from test_conversions import JOINT_SAMPLES, SAMPLES, STAMP_NS               # noqa: E402

NAN = math.nan
# What one topic carries one after the other: other numbers, others missing, other names.
SERIES = {
    'pressure': [messages.Pressure(STAMP_NS, 2e5), messages.Pressure(STAMP_NS + 5, -NAN)],
    'force': [messages.Force(0, 1.0), messages.Force(-1, -2.5), messages.Force(STAMP_NS, 1e300)],
    'contraction': [
        messages.Contraction(STAMP_NS, 0.01), messages.Contraction(STAMP_NS + 1, 0.02, 0.3),
        messages.Contraction(STAMP_NS + 2, 0.03, -0.1), messages.Contraction(STAMP_NS + 3, NAN)],
    'reference': [messages.Reference(STAMP_NS, 0.01, 0.1), messages.Reference(STAMP_NS, 0.0, 0.0)],
    'valve_signal': [
        messages.ValveSignal(1, ('fill_duty', 'vent_duty'), (0.5, 0.0)),
        messages.ValveSignal(2, ('fill_duty', 'vent_duty'), (0.0, 1.0)),
        messages.ValveSignal(3, ('ppr_voltage',), (4.5,)), messages.ValveSignal(4, (), ())],
    'joint_state': [messages.JointAngle(1, 0.2, -3.0), messages.JointAngle(2, 0.3)],
}


def sent_as(topic, raw):
    """Return the ROS message that bytes are."""
    return deserialize_message(raw, type_of(topic))


@pytest.mark.parametrize('topic, plain', [*SAMPLES.items(), *JOINT_SAMPLES.items()])
def test_bytes_are_those_of_the_ros_message(topic, plain):
    full = f'/left/{topic}'
    wanted = RosWriter(full).fill(plain)
    sent = WireWriter(full).fill(plain)
    assert (sent_as(full, sent) if isinstance(sent, bytes) else sent) == wanted
    assert WireReader(full)(serialize_message(wanted)) == plain


@pytest.mark.parametrize('topic', [topic for topic in SAMPLES if topic != 'reference_trajectory'])
def test_bytes_are_exact(topic):
    first, second = (WireWriter(topic, '', 'a').fill(SAMPLES[topic]) for _ in range(2))
    assert first == second
    store = get_typestore(Stores.ROS2_JAZZY)
    message = store.deserialize_cdr(first, TOPIC_TYPES[topic])      # refuses what is too long
    assert bytes(store.serialize_cdr(message, TOPIC_TYPES[topic])) == first


@pytest.mark.parametrize('topic, series', SERIES.items())
def test_a_changed_layout_is_noticed(topic, series):
    writer, reader, ros = WireWriter(topic, 'knee'), WireReader(topic), RosWriter(topic, 'knee')
    for plain in [*series, *reversed(series)]:
        sent = writer.fill(plain)
        assert repr(sent_as(topic, sent)) == repr(ros.fill(plain))
        assert repr(reader(sent)) == repr(plain)


def test_names_and_frame_of_another_sender_move_the_numbers():
    reader = WireReader('contraction')
    plain = messages.Contraction(STAMP_NS, 0.01, 0.5)
    for muscle in ('m', 'rectus_femoris', 'm'):
        for frame_id in ('', 'thigh'):
            assert reader(serialize_message(
                RosWriter('contraction', muscle, frame_id).fill(plain))) == plain
    sent = WireWriter('contraction', 'm', 'thigh').fill(plain)
    assert sent_as('contraction', sent) == RosWriter('contraction', 'm', 'thigh').fill(plain)


def test_bytes_of_a_big_endian_machine_are_read_too():
    raw = (b'\x00\x00\x00\x00' + struct.pack('>iI', 3, 7) + struct.pack('>I', 1) + bytes(4)
           + struct.pack('>dd', 2.5e5, 0.0))
    reader = WireReader('pressure')
    assert reader(raw) == messages.Pressure(3_000_000_007, 2.5e5)
    assert reader(WireWriter('pressure').fill(messages.Pressure(9, 1e5))).pressure_pa == 1e5


@pytest.mark.parametrize('topic', ['pressure', 'contraction', 'force', 'reference_trajectory'])
@pytest.mark.parametrize('raw', [
    b'', b'\x00\x01\x00\x00', b'\x00\x01\x00\x00' + b'\xff' * 40,
    b'\x00\x01\x00\x00' + bytes(8) + b'\x00\x00\x10\x00' + b'a' * 60])
def test_bytes_that_are_no_message_are_dropped_and_the_next_one_is_read(topic, raw):
    reader, plain = WireReader(topic), SAMPLES[topic]
    good = bytes(serialize_message(RosWriter(topic).fill(plain)))
    assert [reader(one) for one in (good, raw, good)] == [plain, None, plain]


@pytest.mark.ros
def test_a_node_drops_bytes_that_are_no_message():
    lock = DomainLock()
    client = RigClient(lock.domain_id)
    try:
        kind, topic = type_of('pressure'), '/muscle/pressure'
        publisher = CountedPublisher(client.node, kind, topic)
        subscription = PolledSubscription(
            client.node, kind, topic, raw=True, read=WireReader(topic))
        wait_for(lambda: subscription.publishers, 10.0, 'the publisher')
        publisher.publish(b'\x00\x01\x00\x00' + b'\xff' * 40)
        publisher.publish(WireWriter(topic).fill(SAMPLES['pressure']))
        taken = []
        wait_for(lambda: taken.extend(subscription.take()) or taken, 10.0, 'the message')
        assert [message for message, _ in taken] == [SAMPLES['pressure']]
        assert subscription.received == 1
    finally:
        client.close()
        lock.release()

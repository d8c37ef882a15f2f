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

"""Reading in tables: the bytes, their order and what does not fit, against a slow reader."""

import io
import struct

from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
import numpy as np
from pam_actuation import messages
from pam_actuation.bags import mcap_scan, series
from pam_actuation.bags.payloads import Payloads
from pam_actuation.bags.record_walk import walk_messages
from pam_actuation.bags.record_walk_compiled import walk_many_messages
from pam_actuation.topics import cdr, codec
from pam_actuation.topics.definitions import typestore
import pytest


def mcap_bytes(payloads, topics=('/a', '/b'), **options):
    """Return an MCAP file with the payloads dealt to the topics in turn."""
    stream = io.BytesIO()
    writer = Writer(stream, **options)
    writer.start('ros2')
    schema = writer.register_schema('std_msgs/msg/String', 'ros2msg', b'string data')
    channels = [writer.register_channel(topic, 'cdr', schema) for topic in topics]
    for i, raw in enumerate(payloads):
        writer.add_message(channels[i % len(topics)], i, raw, 2 * i, i)
    writer.finish()
    return stream.getvalue()


@pytest.mark.parametrize('options', [
    {}, {'chunk_size': 2_000}, {'compression': CompressionType.LZ4}, {'use_chunking': False},
    {'compression': CompressionType.NONE, 'enable_crcs': False}])
def test_messages_of_every_length_come_in_order(options):
    rng = np.random.default_rng(3)
    sizes = [*rng.integers(0, 9, 900), *rng.integers(0, 900, 100), 3_000_000, 0, 5]
    payloads = [rng.bytes(int(size)) for size in sizes]
    data = mcap_bytes(payloads, **options)
    content = mcap_scan.scan(data)
    assert content.damage is None and content.finished
    found = {channel.topic: channel.messages for channel in content.channels.values()}
    wanted = {'/a': [], '/b': []}
    for _, channel, message in make_reader(io.BytesIO(data)).iter_messages(log_time_order=False):
        wanted[channel.topic].append((message.data, message.log_time, message.publish_time))
    for topic, expected in wanted.items():
        raws, log_ns, publish_ns = zip(*expected)
        assert found[topic].payloads == list(raws)
        assert list(found[topic].log_time_ns) == list(log_ns)
        assert list(found[topic].publish_time_ns) == list(publish_ns)


def test_walk_is_the_same_without_compiler():
    record = struct.pack('<BQHIQQ', 5, 22 + 3, 1, 0, 1, 2) + b'abc'
    for data in (record * 3, record * 3 + b'\x07' + bytes(40), record + record[:-1], b'',
                 record + b'\x05' + struct.pack('<Q', 2**64 - 1) + bytes(40),
                 record + b'\x05' + struct.pack('<Q', 21) + bytes(40)):
        view = np.frombuffer(data, dtype=np.uint8)
        results = []
        for one in (walk_many_messages, walk_messages):
            positions = np.full(2, -1)
            results.append([*one(view, 0, positions), *positions])
        assert results[0] == results[1]
    assert results[0][:2] == [1, len(record)]


def different_layouts():
    """Return JointStates of one length whose names differ, more than are read together."""
    return [
        messages.ControllerState(i, (f'x{i % 40:03d}', 'y'), (float(i), -float(i)))
        for i in range(200)]


def test_layouts_that_differ_are_read_one_by_one():
    sample = different_layouts()
    raws = [codec.encode('controller_state', one) for one in sample]
    assert len(set(map(len, raws))) == 1
    raws[7] = raws[7][:4] + bytes(len(raws[7]) - 4)
    raws[11:150:7] = [
        bytes(typestore().serialize_cdr(
            typestore().deserialize_cdr(raw, 'sensor_msgs/msg/JointState'),
            'sensor_msgs/msg/JointState', little_endian=False)) for raw in raws[11:150:7]]
    stamp_ns, values, bad = series.table('controller_state', raws)
    assert not bad.any() and stamp_ns[7] == 0
    for i, one in enumerate(sample):
        if i != 7:
            assert stamp_ns[i] == i
            assert values[one.names[0]][i] == i and values['y'][i] == -i
            assert np.isnan(values[f'x{(i + 1) % 40:03d}'][i])


def test_stamps_of_any_stamped_message():
    raws = [codec.encode('pressure', messages.Pressure(i * 10**9 + 5, 1.0)) for i in range(5)]
    raws.append(codec.encode('contraction', messages.Contraction(7, 1.0, 2.0)))
    assert list(series.stamps(raws)) == [*(i * 10**9 + 5 for i in range(5)), 7]
    for bad in (b'', raws[0][:11], b'\x00\x00' + raws[0][2:]):
        with pytest.raises(cdr.CdrError):
            series.stamps([*raws, bad])


def test_payloads_of_two_bags_are_joined():
    first, second = Payloads([b'a', b'bb', b'c']), Payloads([b'dd', b'', b'e'])
    first.extend(second)
    assert list(first) == [b'a', b'bb', b'c', b'dd', b'', b'e'] and len(first) == 6
    assert first != [b'a'] and first != [b'a', b'bb', b'c', b'dd', b'', b'x']
    assert sorted(int(i) for indices, _ in first.tables() for i in indices) == list(range(6))


def damaged(data, before, after):
    """Return the damage found where the bytes ``before`` are replaced."""
    assert data.count(before) >= 1
    return mcap_scan.scan(data.replace(before, after, 1))


def test_what_cannot_be_is_damage():
    plain = mcap_bytes([b'12345678'] * 4, use_chunking=False)
    message = struct.pack('<BQHI', 5, 30, 1, 2)
    foreign = damaged(plain, message, struct.pack('<BQHI', 5, 30, 9, 2))
    assert 'unknown channel' in foreign.damage.problem and foreign.message_count == 2
    short = damaged(plain, message, struct.pack('<BQHI', 5, 3, 1, 2))
    assert 'shorter than its head' in short.damage.problem and short.message_count == 2
    beyond = damaged(plain, message, struct.pack('<BQHI', 5, 2**63 + 5, 1, 2))
    assert 'ends inside a record' in beyond.damage.problem and beyond.message_count == 2

    chunked = mcap_bytes([b'12345678'] * 4, compression=CompressionType.NONE, enable_crcs=False)
    longer = damaged(chunked, message, struct.pack('<BQHI', 5, 10_000, 1, 2))
    assert 'longer than its chunk' in longer.damage.problem and longer.message_count == 2
    packed = mcap_bytes([b'12345678'] * 4)
    begin = packed.index(b'\x06', 30) + 9
    size = packed[begin + 16:begin + 24]
    huge = damaged(packed, size, struct.pack('<Q', 2**40))
    assert 'claims 1099511627776 bytes' in huge.damage.problem

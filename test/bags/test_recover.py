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

"""Repairing a recording that broke off: whole again, nothing altered, nothing thrown away."""

import random
import shutil

from mcap.data_stream import RecordBuilder
from mcap.reader import make_reader
from mcap.records import Attachment
from mcap.writer import CompressionType, IndexType, Writer
from pam_actuation.bags import disk, recover
from pam_actuation.bags.check import independent_readers
from pam_actuation.bags.info import bag_info
from pam_actuation.bags.load import load_run
from pam_actuation.bags.mcap_salvage import Walk
from pam_actuation.bags.mcap_write import MAGIC, McapWriter, RECORD
from pam_actuation.bags.recover import recover_bag
from pam_actuation.bags.source import read_bag
from pam_actuation.bags.writer import BagWriter
from pam_actuation.topics.table import RECORDED
from pam_sim.errors import InputError
import pytest
from sample_bag import example_messages, METADATA, START_NS, write_bag
import yaml

COUNT = 300
TOPICS = len(RECORDED)


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    bag = write_bag(tmp_path_factory.mktemp('whole') / 'run', COUNT)
    return (bag / 'run_0.mcap').read_bytes(), read_bag(bag)


def broken(tmp_path, data):
    """Return a bag as a killed recorder leaves it: one file, no metadata.yaml."""
    bag = tmp_path / 'run'
    bag.mkdir(exist_ok=True)
    for path in bag.iterdir():
        path.unlink()
    (bag / 'run_0.mcap').write_bytes(data)
    return bag


def assert_is_beginning(bag, original):
    for name, topic in bag.topics.items():
        reference = original.topics[name]
        count = len(topic.payloads)
        assert list(topic.payloads) == list(reference.payloads)[:count]
        assert list(topic.log_time_ns) == list(reference.log_time_ns)[:count]
        assert list(topic.publish_time_ns) == list(reference.publish_time_ns)[:count]


def test_a_file_cut_anywhere_becomes_a_whole_bag(tmp_path, whole):
    data, original = whole
    rng = random.Random(4)
    for length in (0, 5, 30, 300, *(rng.randrange(len(data)) for _ in range(4))):
        bag = broken(tmp_path, data[:length])
        done = recover_bag(bag)
        assert done.changed and done.files[0].rebuilt and not done.files[0].kept
        assert sorted(path.name for path in bag.iterdir()) == ['metadata.yaml', 'run_0.mcap']
        found = read_bag(bag)
        assert_is_beginning(found, original)
        assert done.messages == sum(found.counts.values())
        facts = yaml.safe_load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
        assert facts['version'] == 9 and facts['message_count'] == done.messages
        for counts in independent_readers(bag).values():
            assert sum(counts.values()) == done.messages
        assert not recover_bag(bag).changed
    info = bag_info(broken_and_repaired(tmp_path, data))
    assert info.recovered and info.complete is False
    assert any('broke off' in remark for remark in info.remarks)


def broken_and_repaired(tmp_path, data):
    bag = broken(tmp_path, data[:len(data) // 2])
    recover_bag(bag)
    return bag


def test_the_repaired_bag_has_all_of_a_finished_one(tmp_path, whole):
    data, _ = whole
    bag = broken_and_repaired(tmp_path, data)
    with open(bag / 'run_0.mcap', 'rb') as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert len(summary.channels) == TOPICS and summary.chunk_indexes
        assert all(index.message_index_offsets for index in summary.chunk_indexes)
        messages = list(reader.iter_messages())
        assert len(messages) == summary.statistics.message_count
        times = [message.log_time for _, _, message in messages]
        assert times == sorted(times) and times[0] == summary.statistics.message_start_time
        names = [record.name for record in reader.iter_metadata()]
    assert names == ['pam_experiment', 'pam_recovery', 'rosbag2']
    facts = yaml.safe_load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert facts['custom_data'] == METADATA
    topic = facts['topics_with_message_count'][0]['topic_metadata']
    assert topic['offered_qos_profiles'][0]['reliability'] == 'reliable'
    assert topic['type_description_hash'].startswith('RIHS01_')
    assert load_run(bag).metadata['experiment_name'] == 'sine'


def test_a_whole_bag_is_not_touched(tmp_path):
    bag = write_bag(tmp_path / 'run', 20)
    before = {path.name: (path.read_bytes(), path.stat().st_ino) for path in bag.iterdir()}
    done = recover_bag(bag)
    assert not done.changed and 'whole' in done.sentences()[0]
    assert before == {
        path.name: (path.read_bytes(), path.stat().st_ino) for path in bag.iterdir()}
    (bag / 'metadata.yaml').unlink()
    assert recover_bag(bag).changed
    assert (bag / 'metadata.yaml').read_bytes() == before['metadata.yaml'][0]


def test_a_damaged_chunk_is_left_out_and_the_former_file_kept(tmp_path, whole):
    data, original = whole
    with_hole = bytearray(data)
    with open(broken(tmp_path, data) / 'run_0.mcap', 'rb') as stream:
        second = make_reader(stream).get_summary().chunk_indexes[1]
    with_hole[second.chunk_start_offset + second.chunk_length // 2] ^= 0xff
    bag = broken(tmp_path, with_hole)
    done = recover_bag(bag)
    file, = done.files
    assert file.kept == 'run_0.mcap.damaged'
    assert (bag / file.kept).read_bytes() == with_hole
    found = read_bag(bag)
    assert 0 < done.messages < sum(original.counts.values())
    for name, topic in found.topics.items():
        assert set(topic.payloads) <= set(original.topics[name].payloads)
        assert topic.payloads[-1] == original.topics[name].payloads[-1]


def test_a_damaged_first_chunk_costs_what_is_in_it_alone(tmp_path, whole):
    data, original = whole
    bag = broken(tmp_path, data)
    with open(bag / 'run_0.mcap', 'rb') as stream:
        first, second = make_reader(stream).get_summary().chunk_indexes[:2]
    spoiled = bytearray(data)
    spoiled[first.chunk_start_offset + first.chunk_length // 2] ^= 0xff
    bag = broken(tmp_path, spoiled)
    with pytest.raises(InputError, match='no message before that .* `pam info --recover` keeps'):
        read_bag(bag)
    file, = recover_bag(bag).files
    assert (bag / file.kept).read_bytes() == spoiled
    found = read_bag(bag)
    assert found.topics.keys() == original.topics.keys()
    for name, topic in found.topics.items():
        reference, count = original.topics[name], len(topic.payloads)
        assert list(topic.payloads) == list(reference.payloads)[-count:]
        behind = int((reference.log_time_ns >= second.message_start_time).sum())
        assert 0 < behind <= count + 1
    for counts in independent_readers(bag).values():
        assert sum(counts.values()) == sum(found.counts.values())
    # Without an end the definitions are lost with the chunk.
    bag = broken(tmp_path, spoiled[:len(spoiled) * 3 // 4])
    assert recover_bag(bag).messages == 0


def test_an_unreadable_description_is_lost_not_forgotten(tmp_path, whole):
    data, original = whole
    name = b'pam_experiment'
    length_of_map = data.index(name) + len(name)
    spoiled = data[:length_of_map] + b'\xff' * 4 + data[length_of_map + 4:]
    bag = broken(tmp_path, spoiled)
    done = recover_bag(bag)
    assert done.changed and done.files[0].unreadable_bytes > 100
    assert (bag / done.files[0].kept).read_bytes() == spoiled
    found = read_bag(bag)
    assert_is_beginning(found, original)
    assert done.messages == sum(original.counts.values())


@pytest.mark.parametrize('text', ('[' * 100_000, 'a: ' * 3000, 'n: 1e999999999', '- 2024-99-99'))
def test_a_description_that_is_none_is_made_anew(tmp_path, whole, text):
    data, original = whole
    bag = broken(tmp_path, data)
    (bag / 'metadata.yaml').write_text(text)
    assert recover_bag(bag).changed
    assert read_bag(bag).counts == original.counts


def test_zeros_behind_the_last_chunk_are_an_end_not_damage(tmp_path, whole):
    data, original = whole
    bag = broken(tmp_path, data)
    with open(bag / 'run_0.mcap', 'rb') as stream:
        last = make_reader(stream).get_summary().chunk_indexes[-1]
    bag = broken(tmp_path, data[:last.chunk_start_offset] + bytes(4096))
    file, = recover_bag(bag).files
    assert file.unreadable_bytes == 4096 and not file.kept
    assert_is_beginning(read_bag(bag), original)


def split(directory):
    """Return the writer of a bag of three files that is not finished."""
    writer = BagWriter(directory, METADATA, max_file_s=0.25)
    payload = example_payload()
    writer.add_topic('/muscle/pressure', 'sensor_msgs/msg/FluidPressure')
    for i in range(120):
        writer.write('/muscle/pressure', payload, START_NS + i * 5_000_000, START_NS)
    return writer


def test_a_split_recording_is_repaired_from_all_its_files(tmp_path):
    writer = split(tmp_path / 'run')
    writer.flush()
    writer.abandon()
    names = ['run_0.mcap', 'run_1.mcap', 'run_2.mcap']
    assert [path.name for path in writer.files] == names
    done = recover_bag(tmp_path / 'run')
    assert [file.rebuilt for file in done.files] == [False, False, True]
    facts = yaml.safe_load((tmp_path / 'run' / 'metadata.yaml').read_text())[
        'rosbag2_bagfile_information']
    assert facts['relative_file_paths'] == names
    assert [file['message_count'] for file in facts['files']] == [50, 50, 20]
    assert facts['duration'] == {'nanoseconds': 119 * 5_000_000}
    for counts in independent_readers(tmp_path / 'run').values():
        assert counts == {'/muscle/pressure': 120}


def example_payload():
    from pam_actuation.topics.codec import encode
    return encode('pressure', example_messages()['pressure'])


def test_foreign_files_are_indexed_too(tmp_path):
    path = tmp_path / 'foreign.mcap'
    for chunked in (False, True):
        with open(path, 'wb') as stream:
            writer = Writer(
                stream, use_chunking=chunked, index_types=IndexType.NONE,
                compression=CompressionType.LZ4, chunk_size=2000)
            writer.start(profile='ros2')
            schema = writer.register_schema('pkg/msg/Odd', 'ros2msg', b'int8 x')
            channel = writer.register_channel('/odd', 'cdr', schema)
            for i in range(200):
                writer.add_message(channel, START_NS + i, bytes(range(30)), START_NS + 2 * i, i)
            writer.finish()
        assert recover_bag(path).files[0].rebuilt
        with open(path, 'rb') as stream:
            messages = [m for _, _, m in make_reader(stream).iter_messages()]
        assert [m.sequence for m in messages] == list(range(200))
        assert messages[7].publish_time == START_NS + 14
        assert messages[7].data == bytes(range(30))


def test_a_copy_beside_a_whole_bag_is_no_part_of_it(tmp_path):
    bag = write_bag(tmp_path / 'run', 20)
    shutil.copy(bag / 'run_0.mcap', bag / 'run_0_filtered.mcap')
    before = (bag / 'metadata.yaml').read_bytes()
    done = recover_bag(bag)
    assert not done.changed and done.unlisted == ['run_0_filtered.mcap']
    assert done.sentences()[1].startswith('run_0_filtered.mcap stays as it is: metadata.yaml does')
    assert (bag / 'metadata.yaml').read_bytes() == before
    (bag / 'metadata.yaml').unlink()
    assert len(recover_bag(bag).files) == 2


@pytest.mark.parametrize('change, told', [
    (lambda text: text, 'run_1.mcap named in metadata.yaml is missing; copy it here, or remove'),
    (lambda text: text.replace('run_1.mcap', '../run_1.mcap'), 'lists run_1.mcap, which is no')])
def test_a_bag_without_one_of_its_files_is_not_made_whole(tmp_path, change, told):
    split(tmp_path / 'run').close()
    (tmp_path / 'run' / 'run_1.mcap').rename(tmp_path / 'run_1.mcap')
    description = tmp_path / 'run' / 'metadata.yaml'
    description.write_text(change(description.read_text()))
    before = description.read_bytes()
    with pytest.raises(InputError, match=told):
        recover_bag(tmp_path / 'run')
    assert description.read_bytes() == before


def with_extras():
    """Return the bytes of a file with an attachment and a record of an application."""
    pieces, builder = [], RecordBuilder()
    Attachment(1, START_NS, 'photo.png', 'image/png', bytes(range(200))).write(builder)
    writer = McapWriter(pieces.append)
    schema = writer.add_schema('pkg/msg/Odd', 'ros2msg', b'int8 x')
    channel = writer.add_channel('/odd', schema, {})
    for i in range(100):
        if i == 40:
            writer.copy_private(0x80, b'of an application')
        if i == 60:
            assert writer.copy_attachment(builder.end()[RECORD.size:])
        writer.add_message(channel, START_NS + i, bytes(30), START_NS + i)
    writer.close_chunk()
    data = b''.join(pieces)
    writer.finish()
    return data, b''.join(pieces)


def test_attachments_and_records_of_applications_are_no_damage(tmp_path):
    cut, data = with_extras()
    path = tmp_path / 'run_0.mcap'
    path.write_bytes(data)
    done = recover_bag(path)
    assert not done.changed and done.messages == 100 and path.read_bytes() == data
    path.write_bytes(cut)
    file, = recover_bag(path).files
    assert (file.rebuilt, file.messages, file.unreadable_bytes, file.kept) == (True, 100, 0, '')
    with open(path, 'rb') as stream:
        reader = make_reader(stream, validate_crcs=True)
        attachment, = reader.iter_attachments()
        assert (attachment.name, attachment.data) == ('photo.png', bytes(range(200)))
        assert len(list(reader.iter_messages())) == 100
        assert reader.get_summary().statistics.attachment_count == 1
    assert b'of an application' in path.read_bytes()
    assert not recover_bag(path).changed
    spoiled = bytearray(data)
    spoiled[data.index(bytes(range(200))) + 7] ^= 1
    path.write_bytes(spoiled)
    file, = recover_bag(path).files
    assert file.messages == 100 and file.unreadable_bytes > 200
    assert (tmp_path / file.kept).read_bytes() == spoiled


def test_a_whole_file_of_another_writer_with_an_attachment_stays_as_it_is(tmp_path):
    path = tmp_path / 'foreign.mcap'
    with open(path, 'wb') as stream:
        writer = Writer(stream)
        writer.start(profile='ros2')
        channel = writer.register_channel(
            '/odd', 'cdr', writer.register_schema('pkg/msg/Odd', 'ros2msg', b'int8 x'))
        writer.add_message(channel, START_NS, bytes(9), START_NS)
        writer.add_attachment(START_NS, START_NS, 'notes.txt', 'text/plain', b'a note')
        writer.finish()
    before = path.read_bytes()
    assert not recover_bag(path).changed and path.read_bytes() == before


def test_a_damaged_length_in_a_finished_file_keeps_the_former_one(tmp_path, whole):
    data, original = whole
    with open(broken(tmp_path, data) / 'run_0.mcap', 'rb') as stream:
        second = make_reader(stream).get_summary().chunk_indexes[1]
    spoiled = bytearray(data)
    spoiled[second.chunk_start_offset + 8] ^= 0x40
    bag = broken(tmp_path, spoiled)
    file, = recover_bag(bag).files
    assert (bag / file.kept).read_bytes() == spoiled
    assert_is_beginning(read_bag(bag), original)


def test_what_follows_a_damaged_head_is_not_copied_into_memory():
    class Watched(bytes):

        longest = 0

        def __getitem__(self, place):
            found = super().__getitem__(place)
            if isinstance(place, slice):
                Watched.longest = max(Watched.longest, len(found))
            return found

    for end, damaged in ((b'\0', False), (b'\1', True)):
        walk = Walk(Watched(MAGIC + bytes(2**23) + end))
        assert list(walk) == [] and walk.bytes == 2**23 + 1 and walk.inside is damaged
    assert Watched.longest <= 2**20


def test_what_cannot_be_repaired_is_told(tmp_path, whole, monkeypatch):
    data, _ = whole
    with pytest.raises(InputError, match='no .mcap file'):
        recover_bag(tmp_path)
    other = tmp_path / 'other.mcap'
    other.write_bytes(b'something else')
    with pytest.raises(InputError, match='not an MCAP file'):
        recover_bag(other)
    writer = BagWriter(tmp_path / 'live', METADATA)
    with pytest.raises(InputError, match='still being recorded'):
        recover_bag(tmp_path / 'live')
    writer.close()
    bag = broken(tmp_path, data[:len(data) // 2])

    def refuse(stream, piece):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(disk, 'write_all', refuse)
    with pytest.raises(InputError, match='No space left'):
        recover.recover_bag(bag)
    assert [path.name for path in bag.iterdir()] == ['run_0.mcap']
    assert (bag / 'run_0.mcap').read_bytes() == data[:len(data) // 2]

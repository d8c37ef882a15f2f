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

"""The written bag: Jazzy layout, and readable by the two independent readers."""

from dataclasses import replace
from pathlib import Path
import tracemalloc

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
import numpy as np
from pam_actuation.bags import layout
from pam_actuation.bags.check import independent_readers
from pam_actuation.bags.source import read_bag
from pam_actuation.bags.writer import BagWriter
from pam_actuation.topics import codec, definitions
from pam_actuation.topics.quality import LATCHED, Quality, Service, USUAL
from pam_actuation.topics.table import BY_NAME, RECORDED
from pam_sim.errors import InputError
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from sample_bag import example_messages, full_name, METADATA, START_NS, STEP_NS, write_bag
import yaml

COUNT = 30
CHUNKS = 1000


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return write_bag(tmp_path_factory.mktemp('bags') / 'run', COUNT)


def test_rosbags_reads_every_message(bag):
    for opened in (bag, bag / 'run_0.mcap'):
        with AnyReader([Path(opened)]) as reader:
            topics = {connection.topic for connection in reader.connections}
            assert topics == {full_name(short) for short in RECORDED}
            decoded = 0
            for connection, log_time_ns, raw in reader.messages():
                message = reader.deserialize(raw, connection.msgtype)
                stamp = message.header.stamp
                stamp_ns = stamp.sec * 10**9 + stamp.nanosec
                assert log_time_ns == stamp_ns + 400_000
                decoded += 1
            assert decoded == reader.message_count == COUNT * len(RECORDED)


def test_rosbags_sees_the_metadata_file(bag):
    with Reader(bag) as reader:
        assert reader.ros_distro == 'jazzy'
        assert reader.start_time == START_NS + 400_000
        assert reader.duration == (COUNT - 1) * STEP_NS + 1
        for connection in reader.connections:
            profile, = connection.ext.offered_qos_profiles
            assert (profile.history.name, profile.reliability.name) == ('KEEP_LAST', 'RELIABLE')
            assert connection.digest == definitions.type_hash(connection.msgtype)


def test_each_topic_states_the_quality_of_its_publisher(tmp_path, monkeypatch):
    latched = replace(BY_NAME['marker'], service=Service(LATCHED, LATCHED, LATCHED))
    monkeypatch.setitem(BY_NAME, 'marker', latched)
    with BagWriter(tmp_path / 'run', {}) as writer:
        for name in ('pressure', 'marker'):
            writer.add_topic(f'/muscle/{name}', BY_NAME[name].type_name)
        writer.add_topic('/bench/imu', 'sensor_msgs/msg/Imu')
    facts = yaml.safe_load((tmp_path / 'run' / 'metadata.yaml').read_text())[layout.METADATA_ROOT]
    stated = {}
    for row in facts['topics_with_message_count']:
        profile, = row['topic_metadata']['offered_qos_profiles']
        stated[row['topic_metadata']['name']] = Quality(
            profile['depth'], profile['reliability'], profile['durability'])
    assert stated == {'/muscle/pressure': USUAL.publisher, '/muscle/marker': LATCHED,
                      '/bench/imu': USUAL.publisher}
    with open(tmp_path / 'run' / 'run_0.mcap', 'rb') as stream:
        for channel in make_reader(stream).get_summary().channels.values():
            profile, = yaml.safe_load(channel.metadata['offered_qos_profiles'])
            assert profile['depth'] == stated[channel.topic].depth


def test_mcap_ros2_decodes_with_the_embedded_definitions(bag):
    sample = example_messages(0)
    with open(bag / 'run_0.mcap', 'rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        seen = {}
        for _, channel, message, decoded in reader.iter_decoded_messages():
            seen.setdefault(channel.topic, []).append((message, decoded))
    assert {topic: len(found) for topic, found in seen.items()} == {
        full_name(short): COUNT for short in RECORDED}
    message, pressure = seen['/muscle/pressure'][0]
    assert pressure.fluid_pressure == sample['pressure'].pressure_pa
    assert message.log_time - message.publish_time == 300_000 and message.sequence == 0
    assert seen['/muscle/contraction'][0][1].name == ['muscle']
    assert seen['/diagnostics'][0][1].status[0].values[1].value == '200.0'
    assert seen['/muscle/reference_trajectory'][0][1].points[1].positions == [0.015]


def test_a_file_of_series_is_that_of_their_messages(tmp_path):
    """Equal times, chunks that close in between, and a message before and after."""
    steps = {'pressure': 3, 'contraction': 2, 'force': 5}
    series = {}
    for short, step in steps.items():
        stamp_ns = np.arange(START_NS, START_NS + 6000 * STEP_NS, step * STEP_NS)
        series[f'/muscle/{short}'] = stamp_ns, codec.encode_series(
            short, stamp_ns, np.sin(stamp_ns - START_NS + step))
    rows = sorted((int(t), place, name, row.tobytes())
                  for place, (name, (stamp_ns, data)) in enumerate(series.items())
                  for t, row in zip(stamp_ns, data))
    other = next(iter(series['/muscle/pressure'][1])).tobytes()
    for folder in 'series', 'messages':
        with BagWriter(tmp_path / folder / 'run') as bag:
            for name in series:
                bag.add_topic(name, RECORDED[name.rsplit('/')[-1]].type_name)
            bag.write('/muscle/pressure', other, START_NS - 7, START_NS - 7)
            if folder == 'series':
                bag.write_series(series)
            else:
                for stamp, _, name, data in rows:
                    bag.write(name, data, stamp, stamp)
            bag.write('/muscle/pressure', other, START_NS + 5, START_NS + 5)
            assert sum(bag.counts.values()) == len(rows) + 2
    one, two = ({path.name: path.read_bytes() for path in (tmp_path / folder / 'run').iterdir()}
                for folder in ('series', 'messages'))
    assert one == two and len(one) == 2
    assert len(one['run_0.mcap']) > 100_000


def test_file_is_laid_out_as_jazzy_does(bag):
    with open(bag / 'run_0.mcap', 'rb') as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert reader.get_header().profile == 'ros2'
        summary = reader.get_summary()
        assert {chunk.compression for chunk in summary.chunk_indexes} == {'zstd'}
        assert all(schema.encoding == 'ros2msg' for schema in summary.schemas.values())
        for channel in summary.channels.values():
            schema = summary.schemas[channel.schema_id]
            assert channel.message_encoding == 'cdr'
            assert channel.metadata['topic_type_hash'] == definitions.type_hash(schema.name)
            profile, = yaml.safe_load(channel.metadata['offered_qos_profiles'])
            assert profile['durability'] == 'volatile'
        assert sum(1 for _ in reader.iter_messages()) == COUNT * len(RECORDED)
        records = [(record.name, record.metadata) for record in reader.iter_metadata()]
    assert [name for name, _ in records] == ['rosbag2', 'pam_experiment', 'rosbag2']
    assert records[1][1] == METADATA
    final = yaml.safe_load(records[2][1]['serialized_metadata'])
    assert yaml.safe_load(records[0][1]['serialized_metadata'])['message_count'] == 0
    assert final == yaml.safe_load((bag / 'metadata.yaml').read_text())[layout.METADATA_ROOT]


def test_metadata_file_is_version_9(bag):
    text = (bag / 'metadata.yaml').read_text()
    root, = yaml.safe_load(text).items()
    assert root[0] == 'rosbag2_bagfile_information'
    facts = root[1]
    assert list(facts) == [
        'version', 'storage_identifier', 'duration', 'starting_time', 'message_count',
        'topics_with_message_count', 'compression_format', 'compression_mode',
        'relative_file_paths', 'files', 'custom_data', 'ros_distro']
    assert facts['version'] == 9 and facts['storage_identifier'] == 'mcap'
    assert facts['duration'] == {'nanoseconds': (COUNT - 1) * STEP_NS}
    assert facts['relative_file_paths'] == ['run_0.mcap']
    assert facts['files'][0]['message_count'] == facts['message_count']
    assert facts['custom_data'] == METADATA
    topic = facts['topics_with_message_count'][0]
    assert topic['message_count'] == COUNT
    assert list(topic['topic_metadata']) == [
        'name', 'type', 'serialization_format', 'offered_qos_profiles', 'type_description_hash']
    profile, = topic['topic_metadata']['offered_qos_profiles']
    assert profile['history'] == 'keep_last' and profile['liveliness'] == 'automatic'
    assert profile['deadline'] == {'sec': 9223372036, 'nsec': 854775807}
    assert topic['topic_metadata']['type_description_hash'].startswith('RIHS01_')
    assert '&' not in text and [path.name for path in bag.iterdir() if path.name[0] == '.'] == []


def test_known_type_hashes():
    # As `ros2 topic info --verbose` prints them on Jazzy.
    assert definitions.type_hash('sensor_msgs/msg/JointState') == (
        'RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e')


def test_bag_without_messages_opens(tmp_path):
    with BagWriter(tmp_path / 'empty', {}) as writer:
        writer.add_topic('/muscle/pressure', RECORDED['pressure'].type_name)
    with Reader(tmp_path / 'empty') as reader:
        assert reader.message_count == 0
    with Reader(tmp_path / 'empty' / 'empty_0.mcap') as reader:
        assert reader.message_count == 0


def test_existing_directories_are_respected(tmp_path, bag):
    taken = tmp_path / 'taken'
    write_bag(taken, 1)
    with pytest.raises(InputError, match='not empty'):
        BagWriter(taken, {})
    with BagWriter(taken, {}, overwrite=True) as writer:
        assert writer.counts == {}
    foreign = tmp_path / 'foreign'
    foreign.mkdir()
    (foreign / 'thesis.txt').write_text('mine')
    with pytest.raises(InputError, match='holds no bag'):
        BagWriter(foreign, {}, overwrite=True)
    assert (foreign / 'thesis.txt').read_text() == 'mine'
    with pytest.raises(InputError, match='a file has this name'):
        BagWriter(foreign / 'thesis.txt', {})


def test_topics_are_checked(tmp_path):
    with BagWriter(tmp_path / 'run', {}) as writer:
        writer.add_topic('/muscle/pressure', 'sensor_msgs/msg/FluidPressure')
        writer.add_topic('/muscle/pressure', 'sensor_msgs/msg/FluidPressure')
        with pytest.raises(InputError, match='cannot also be'):
            writer.add_topic('/muscle/pressure', 'sensor_msgs/msg/JointState')
        with pytest.raises(InputError, match='full topic name'):
            writer.add_topic('pressure', 'sensor_msgs/msg/FluidPressure')
        with pytest.raises(InputError, match='pam_msgs/msg/Muscle'):
            writer.add_topic('/muscle/x', 'pam_msgs/msg/Muscle')


def test_several_records(tmp_path):
    records = {'pam_experiment': {'valve': 'hsv'}, 'calibration': {'gain': 2}}
    BagWriter(tmp_path / 'run', records).close()
    with open(tmp_path / 'run' / 'run_0.mcap', 'rb') as stream:
        found = {record.name: record.metadata for record in make_reader(stream).iter_metadata()}
    assert found['pam_experiment'] == {'valve': 'hsv'}
    assert found['calibration'] == {'gain': '2'}
    facts = yaml.safe_load((tmp_path / 'run' / 'metadata.yaml').read_text())
    assert facts[layout.METADATA_ROOT]['custom_data'] == {'valve': 'hsv'}


def test_same_messages_give_the_same_bytes(tmp_path):
    for parent in ('a', 'b'):
        (tmp_path / parent).mkdir()
        write_bag(tmp_path / parent / 'run', 5)
    assert (tmp_path / 'a/run/run_0.mcap').read_bytes() == (
        tmp_path / 'b/run/run_0.mcap').read_bytes()
    assert (tmp_path / 'a/run/metadata.yaml').read_bytes() == (
        tmp_path / 'b/run/metadata.yaml').read_bytes()


def test_hours_of_recording_need_no_memory(tmp_path):
    names = [f'/m{k}/pressure' for k in range(12)]
    raw = codec.encode('pressure', example_messages()['pressure'])
    sizes = []
    with BagWriter(tmp_path / 'run', METADATA) as writer:
        for name in names:
            writer.add_topic(name, RECORDED['pressure'].type_name)
        tracemalloc.start()
        try:
            for i in range(CHUNKS + 1):
                for name in names:
                    writer.write(name, raw, START_NS + i, START_NS + i)
                writer.flush()
                if i in (CHUNKS // 4, CHUNKS):
                    sizes.append(tracemalloc.get_traced_memory()[0])
        finally:
            tracemalloc.stop()
    # The index alone would be about 200 bytes for each of the chunks between.
    assert sizes[1] - sizes[0] < 10_000
    with open(writer.file, 'rb') as stream:
        summary = make_reader(stream).get_summary()
    assert len(summary.chunk_indexes) == CHUNKS + 1 == summary.statistics.chunk_count
    assert all(len(chunk.message_index_offsets) == 12 for chunk in summary.chunk_indexes)
    assert [path.name for path in sorted((tmp_path / 'run').iterdir())] == [
        'metadata.yaml', 'run_0.mcap']


@pytest.mark.parametrize('limits', ({'max_file_s': 0.05 * 4}, {'max_file_bytes': 100_000}))
def test_split_bags_are_one_bag_everywhere(tmp_path, limits):
    count = 3000
    raw = codec.encode('controller_state', example_messages()['controller_state'])
    with BagWriter(tmp_path / 'run', METADATA, **limits) as writer:
        writer.add_topic('/muscle/controller_state', RECORDED['controller_state'].type_name)
        writer.add_topic('/muscle/pressure', RECORDED['pressure'].type_name)
        for i in range(count):
            writer.write('/muscle/controller_state', raw, START_NS + i * 500_000, START_NS)
    files = writer.files
    assert len(files) >= 3 and [file.name for file in files] == [
        f'run_{k}.mcap' for k in range(len(files))]
    facts = yaml.safe_load((tmp_path / 'run' / 'metadata.yaml').read_text())[
        layout.METADATA_ROOT]
    assert facts['relative_file_paths'] == [file.name for file in files]
    assert sum(file['message_count'] for file in facts['files']) == count
    assert facts['message_count'] == count
    for first, second in zip(facts['files'], facts['files'][1:]):
        end = first['starting_time']['nanoseconds_since_epoch'] + first['duration'][
            'nanoseconds']
        assert second['starting_time']['nanoseconds_since_epoch'] == end + 500_000
    if 'max_file_s' in limits:
        assert {f['message_count'] for f in facts['files'][:-1]} == {400}
    for counts in independent_readers(tmp_path / 'run').values():
        assert counts == {'/muscle/controller_state': count}
    found = read_bag(tmp_path / 'run')
    assert found.counts == {'/muscle/controller_state': count, '/muscle/pressure': 0}
    assert list(found.topics['/muscle/controller_state'].log_time_ns) == [
        START_NS + i * 500_000 for i in range(count)]
    # Every file alone is a bag too, with the experiment inside.
    assert read_bag(files[1]).experiment == METADATA


def test_limits_too_small_for_a_file_are_refused(tmp_path):
    for limits in ({'max_file_bytes': 5000}, {'max_file_s': 0.01}, {'max_file_s': -1.0}):
        with pytest.raises(InputError, match='give 0'):
            BagWriter(tmp_path / 'run', **limits)
    assert not (tmp_path / 'run').exists()

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

"""Loading: this package's bags, those of others, and those that are broken."""

from pathlib import Path
import shutil

import mcap_ros2.writer
import numpy as np
from pam_actuation import messages
from pam_actuation.bags.load import load_run
from pam_actuation.bags.source import read_bag
from pam_actuation.bags.writer import BagWriter
from pam_actuation.topics import codec, definitions
from pam_actuation.topics.table import OF_A_RUN, RECORDED
from pam_sim.errors import InputError
from pam_sim.run import Run
from pam_sim.units import unit_of
import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from sample_bag import example_messages, METADATA, START_NS, STEP_NS, write_bag
from sample_foreign import write_mcap, write_with_rosbags

COUNT = 40
VALUES = {
    **{name: {value: unit_of(value) for value in topic.numeric.always}
       for name, topic in OF_A_RUN.items() if topic.numeric},
    'pressure': {'pressure_pa': 'Pa'},
    'pressure_command': {'pressure_pa': 'Pa'},
    'supply_pressure': {'pressure_pa': 'Pa'},
    'followed_pressure': {'pressure_pa': 'Pa'},
    'contraction': {'contraction_m': 'm', 'velocity_m_per_s': 'm/s'},
    'reference': {'contraction_m': 'm', 'velocity_m_per_s': 'm/s'},
    'force': {'force_n': 'N'},
    'external_force': {'force_n': 'N'},
    'valve_signal': {'ppr_voltage': 'V'},
    'valve_command': {'ppr_voltage': 'V'},
    'controller_state': {'tick': '1', 'error_m': 'm', 'learning': '1'},
}


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return write_bag(tmp_path_factory.mktemp('bags') / 'run', COUNT)


def assert_same_run(run, valve='ppr', count=COUNT):
    assert isinstance(run, Run)
    for short in VALUES:
        one = run.topics[short]
        assert one.stamp_ns.dtype == np.int64 and len(one) == count
        for i in range(count):
            message = example_messages(i, valve)[short]
            assert one.stamp_ns[i] == message.stamp_ns
            if hasattr(message, 'names'):
                numbers = getattr(message, 'efforts', None) or message.values
                expected = dict(zip(message.names, numbers))
            else:
                expected = {name: getattr(message, name) for name in VALUES[short]}
            assert {name: column[i] for name, column in one.values.items()} == expected
    assert run.reference_trajectories == tuple(
        example_messages(i)['reference_trajectory'] for i in range(count))


def test_every_topic_is_loaded_exactly(bag):
    run = load_run(bag)
    assert_same_run(run)
    assert {short: one.unit for short, one in run.topics.items()} == VALUES
    assert run.namespace == '/muscle' and run.metadata == METADATA and run.valve == 'ppr'
    assert run.remarks == () and run.path == str(bag)


def test_lone_file_and_directory_without_metadata(bag, tmp_path):
    lone = tmp_path / 'other_name.mcap'
    shutil.copy(bag / 'run_0.mcap', lone)
    assert_same_run(load_run(lone))
    assert_same_run(load_run(tmp_path))
    assert load_run(lone).metadata == METADATA
    assert_same_run(load_run(bag / 'metadata.yaml'))


def test_hsv_signals(tmp_path):
    run = load_run(write_bag(tmp_path / 'run', 5, valve='hsv'))
    assert set(run.topics['valve_signal'].values) == {'fill_duty', 'vent_duty'}
    assert run.topics['valve_signal'].unit == {'fill_duty': '1', 'vent_duty': '1'}
    assert run.valve == 'hsv'


def test_missing_optional_topics(tmp_path):
    kept = {'pressure', 'contraction', 'valve_signal'}
    run = load_run(write_bag(tmp_path / 'run', 5, leave_out=set(RECORDED) - kept))
    assert set(run.topics) == kept
    assert run.reference_trajectories == ()


@pytest.mark.parametrize('plugin, compression', [
    (StoragePlugin.MCAP, None), (StoragePlugin.SQLITE3, None),
    (StoragePlugin.MCAP, CompressionMode.STORAGE), (StoragePlugin.SQLITE3, CompressionMode.FILE),
    (StoragePlugin.MCAP, CompressionMode.MESSAGE),
    (StoragePlugin.SQLITE3, CompressionMode.MESSAGE)])
def test_bags_of_another_writer(tmp_path, plugin, compression):
    directory = write_with_rosbags(
        tmp_path / 'foreign', COUNT, plugin, compression, ('/rig_7/hip', '/rig_7/knee'))
    for namespace in ('/rig_7/hip', '/rig_7/knee'):
        run = load_run(directory, namespace)
        assert_same_run(run)
        assert run.namespace == namespace and run.metadata == {}
    assert read_bag(directory).storage == plugin.name.lower()
    if compression in (CompressionMode.FILE, CompressionMode.MESSAGE):
        return
    data_file, = (path for path in directory.iterdir() if path.name != 'metadata.yaml')
    assert_same_run(load_run(data_file, '/rig_7/hip'))
    (directory / 'metadata.yaml').unlink()
    assert_same_run(load_run(directory, '/rig_7/knee'))


@pytest.mark.parametrize('compression, options', [
    ('', {}), ('', {'use_chunking': False}), ('lz4', {'chunk_size': 500}),
    ('zstd', {'enable_crcs': False})])
def test_other_ways_to_write_mcap(tmp_path, compression, options):
    path = write_mcap(tmp_path / 'plain', COUNT, compression, namespace='', **options)
    run = load_run(path)
    assert_same_run(run)
    assert run.namespace == ''


@pytest.mark.parametrize('type_name', ['sensor_msgs/msg/JointState', 'sensor_msgs/JointState'])
def test_bags_of_the_mcap_library(tmp_path, type_name):
    path = tmp_path / 'by_library.mcap'
    with open(path, 'wb') as stream:
        writer = mcap_ros2.writer.Writer(stream)
        schema = writer.register_msgdef(
            type_name, definitions.schema_text('sensor_msgs/msg/JointState'))
        for i in range(COUNT):
            writer.write_message('/contraction', schema, {
                'header': {'stamp': {'sec': i, 'nanosec': 5}, 'frame_id': 'rig'},
                'name': ['m'], 'position': [0.001 * i], 'velocity': [], 'effort': []}, i, i)
        writer.finish()
    one = load_run(path).topics['contraction']
    np.testing.assert_array_equal(one.stamp_ns, [i * 10**9 + 5 for i in range(COUNT)])
    np.testing.assert_array_equal(
        one.values['contraction_m'], [0.001 * i for i in range(COUNT)])
    assert np.isnan(one.values['velocity_m_per_s']).all()


def test_split_bag_is_read_in_order(tmp_path, bag):
    for number in (0, 2, 10):
        part = write_bag(
            tmp_path / f'part{number}', COUNT,
            change=lambda short, i, message, n=number: message if i // 4 == n // 2 else None)
        shutil.copy(part / f'part{number}_0.mcap', tmp_path / f'split_{number}.mcap')
    run = load_run(tmp_path)
    wanted = [START_NS + i * STEP_NS for i in (*range(0, 8), *range(20, 24))]
    assert list(run.topics['pressure'].stamp_ns) == wanted and run.remarks == ()


def test_namespace_is_chosen_or_asked_for(tmp_path):
    both = write_bag(tmp_path / 'both', 5, namespaces=('/left/knee', '/right/knee'))
    with pytest.raises(InputError, match='/left/knee, /right/knee'):
        load_run(both)
    assert load_run(both, namespace='/right/knee').namespace == '/right/knee'
    assert load_run(both, namespace='left/knee/').namespace == '/left/knee'
    with pytest.raises(InputError, match='/ankle; the bag has /left/knee, /right/knee'):
        load_run(both, namespace='ankle')


def test_namespaces_that_are_no_muscle_do_not_disturb(tmp_path):
    with BagWriter(tmp_path / 'run', {}) as writer:
        for name, type_name in (
                ('/muscle/pressure', 'sensor_msgs/msg/FluidPressure'),
                ('/muscle/contraction', 'sensor_msgs/msg/JointState'),
                ('/weather/pressure', 'sensor_msgs/msg/FluidPressure'),
                ('/arm/force', 'geometry_msgs/msg/WrenchStamped'),
                ('/hand/contraction', 'geometry_msgs/msg/WrenchStamped'),
                ('/muscle/force', 'std_msgs/msg/Float64'),
                ('/image', 'sensor_msgs/msg/Image')):
            writer.add_topic(name, type_name)
            short = name.rsplit('/', 1)[-1]
            if short in RECORDED:
                raw = codec.encode(short, example_messages()[short])
                writer.write(name, raw, START_NS, START_NS)
    run = load_run(tmp_path / 'run')
    assert run.namespace == '/muscle' and set(run.topics) == {'pressure', 'contraction'}
    assert any('/muscle/force is std_msgs/msg/Float64' in remark for remark in run.remarks)


def test_bag_without_a_muscle(tmp_path):
    path = write_bag(tmp_path / 'run', 2, leave_out=('pressure', 'contraction'))
    with pytest.raises(InputError, match='no messages on a pressure or contraction topic') as told:
        load_run(path)
    assert 'pam import' not in str(told.value)
    with BagWriter(tmp_path / 'other', {}) as writer:
        writer.add_topic('/plc/p', 'std_msgs/msg/Float64')
        writer.write('/plc/p', b'\x00\x01\x00\x00' + bytes(8), START_NS, START_NS)
    with pytest.raises(InputError, match='`pam import BAG --preview` shows .*its topics: /plc/p'):
        load_run(tmp_path / 'other')


def test_stamps_out_of_order_are_sorted_stably_and_said(tmp_path):
    stamps = [0, 2, 1, 1, 3]
    with BagWriter(tmp_path / 'run', {}) as writer:
        writer.add_topic('/muscle/pressure', 'sensor_msgs/msg/FluidPressure')
        for i, stamp in enumerate(stamps):
            raw = codec.encode('pressure', messages.Pressure(stamp, 2e5 + i))
            writer.write('/muscle/pressure', raw, START_NS + i, START_NS + i)
    run = load_run(tmp_path / 'run')
    one = run.topics['pressure']
    assert list(one.stamp_ns) == [0, 1, 1, 2, 3]
    assert list(one.values['pressure_pa'] - 2e5) == [0, 2, 3, 1, 4]
    assert any('goes back once' in note for note in run.notes)
    assert any('1 messages repeat' in note for note in run.notes)
    assert not run.remarks      # two senders overtake each other by so little


def test_messages_without_stamps(tmp_path):
    def unstamped(short, i, message):
        if short == 'pressure':
            return messages.Pressure(0, message.pressure_pa)
        if short == 'force' and i == 3:
            return messages.Force(0, 1.0)
        if short == 'contraction' and i % 3 != 1:
            return messages.Contraction(0, message.contraction_m)
        return message

    run = load_run(write_bag(tmp_path / 'run', 6, change=unstamped))
    assert run.topics['pressure'].stamp_ns[0] == START_NS + 400_000
    assert len(run.topics['force']) == 5
    # They are left out also where they are most of the messages.
    assert list(run.topics['contraction'].stamp_ns) == [START_NS + i * STEP_NS for i in (1, 4)]
    assert any('contraction: 4 messages without a header stamp' in one for one in run.left_out)
    assert run.start_ns == START_NS and not any('goes back' in one for one in run.remarks)
    assert any('receive times' in remark for remark in run.remarks)
    assert any('1 messages without a header stamp' in remark for remark in run.remarks)


def test_valve_signal_is_what_the_valve_holds(tmp_path):
    nan = float('nan')
    signals = [
        (('fill_duty',), (nan,)), (('fill_duty', 'vent_duty'), (0.1, 0.2)),
        (('vent_duty',), (0.3,)), (('fill_duty', 'vent_duty'), (nan, 0.4)),
        (('vent_duty', 'fill_duty'), (0.6, 0.5))]

    def change(short, i, message):
        if short != 'valve_signal':
            return message
        return messages.ValveSignal(message.stamp_ns, *signals[i])

    one = load_run(write_bag(tmp_path / 'run', 5, change=change)).topics['valve_signal']
    assert list(one.values['fill_duty']) == [0.1, 0.1, 0.1, 0.5]
    assert list(one.values['vent_duty']) == [0.2, 0.3, 0.4, 0.6]


def test_undecodable_messages_are_left_out(tmp_path, monkeypatch):
    with BagWriter(tmp_path / 'run', {}) as writer:
        writer.add_topic('/muscle/pressure', 'sensor_msgs/msg/FluidPressure')
        for i in range(5):
            raw = codec.encode('pressure', messages.Pressure(START_NS + i, 2e5))
            raw = raw[:12] if i == 2 else raw
            writer.write('/muscle/pressure', raw, START_NS + i, START_NS + i)
    run = load_run(tmp_path / 'run')
    assert len(run.topics['pressure']) == 4
    assert any('1 messages are not' in remark for remark in run.remarks)


@pytest.fixture
def whole_file(bag):
    return (bag / 'run_0.mcap').read_bytes()


@pytest.mark.parametrize('content, said', [
    (b'', 'the file is empty'),
    (b'hello, this is a text\n', 'not an MCAP file'),
    (b'\x89MC', 'the recording ended early'),
    (b'\x89MCAP0\r\n', 'the recording ended early'),
    (b'\x89MCAP0\r\n' + bytes(range(256)) * 3, 'no message can be read'),
])
def test_files_that_are_no_bag(tmp_path, content, said):
    path = tmp_path / 'bad.mcap'
    path.write_bytes(content)
    for recover in (False, True):
        with pytest.raises(InputError) as caught:
            load_run(path, recover=recover)
        assert said in str(caught.value) and str(path) in str(caught.value)
        assert '\n' not in str(caught.value)


def test_recording_that_ended_early(tmp_path):
    whole = write_bag(tmp_path / 'run', 2000)
    data = (whole / 'run_0.mcap').read_bytes()
    path = tmp_path / 'cut.mcap'
    path.write_bytes(data[:len(data) * 2 // 3])
    with pytest.raises(InputError, match=r'ended early .* \d+ messages .* can still be read'):
        load_run(path)
    run = load_run(path, recover=True)
    complete = load_run(whole)
    count = len(run.topics['pressure'])
    assert 500 < count < 2000
    np.testing.assert_array_equal(
        run.topics['pressure'].values['pressure_pa'],
        complete.topics['pressure'].values['pressure_pa'][:count])
    assert any('ended early' in remark for remark in run.remarks)
    path.write_bytes(data[:-1])
    with pytest.raises(InputError, match=f'{2000 * len(RECORDED)} messages'):
        load_run(path)


def test_damage_in_the_middle_is_found(tmp_path, bag):
    whole = write_bag(tmp_path / 'run', 2000)
    path = whole / 'run_0.mcap'
    data = bytearray(path.read_bytes())
    middle = data.index(b'zstd', len(data) // 2) + 2000
    data[middle:middle + 4] = b'\x00\xff\x00\xff'
    path.write_bytes(data)
    with pytest.raises(InputError, match='damaged'):
        load_run(whole)
    assert 0 < len(load_run(whole, recover=True).topics['pressure']) < 2000


def test_places_without_a_bag(tmp_path):
    with pytest.raises(InputError, match='no such file'):
        load_run(tmp_path / 'nowhere')
    with pytest.raises(InputError, match='no bag in this directory'):
        load_run(tmp_path)
    with pytest.raises(InputError, match='None is no path of a bag'):
        load_run(None)
    text = tmp_path / 'notes.txt'
    text.write_text('notes')
    with pytest.raises(InputError, match='not a bag'):
        load_run(text)
    database = tmp_path / 'x.db3'
    database.write_bytes(b'no database')
    with pytest.raises(InputError, match='not a readable rosbag2 bag'):
        load_run(database)


def test_names_and_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match='cannot be read: File name too long'):
        load_run(tmp_path / ('x' * 300))
    (tmp_path / 'folder.mcap').mkdir()
    with pytest.raises(InputError, match='no bag in this directory'):
        load_run(tmp_path)


@pytest.mark.parametrize('text', [
    '', 'a: [', 'x: 2026-99-99', '[' * 5000, '- ' * 5000 + 'x', 'a: 1\n',
    'rosbag2_bagfile_information: {}\n',
    'rosbag2_bagfile_information:\n  relative_file_paths: []\n',
    'rosbag2_bagfile_information:\n  relative_file_paths: [5]\n'])
def test_foreign_metadata_file(tmp_path, bag, text):
    shutil.copytree(bag, tmp_path / 'run')
    (tmp_path / 'run' / 'metadata.yaml').write_text(text)
    with pytest.raises(InputError, match='not the metadata of a rosbag2 bag'):
        load_run(tmp_path / 'run')


def test_missing_data_file(tmp_path, bag):
    (tmp_path / 'run').mkdir()
    shutil.copy(bag / 'metadata.yaml', tmp_path / 'run')
    with pytest.raises(InputError, match='run_0.mcap named in metadata.yaml is missing'):
        load_run(Path(tmp_path / 'run'))

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

"""Bags of other storages that are not as their metadata says, or have none."""

from pathlib import Path
import shutil
import sqlite3

from pam_actuation.bags import layout
from pam_actuation.bags.directory import by_number
from pam_actuation.bags.info import bag_info, render_text
from pam_actuation.bags.load import load_run
from pam_actuation.bags.recover import recover_bag
from pam_actuation.bags.source import read_bag
from pam_actuation.bags.writer import BagWriter
from pam_actuation.cli.main import main
from pam_actuation.topics.codec import encode
from pam_actuation.topics.table import RECORDED
from pam_sim.errors import InputError
import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from sample_bag import example_messages, METADATA, START_NS, STEP_NS, write_bag
from sample_foreign import write_with_rosbags
import zstandard

COUNT = 30


def change_metadata(bag, change):
    """Let ``change`` edit what metadata.yaml says."""
    file = bag / layout.METADATA_FILE
    content = layout.from_yaml(file.read_text())
    change(content[layout.METADATA_ROOT])
    file.write_text(layout.to_yaml(content))


def delete_rows(database, condition):
    with sqlite3.connect(database) as connection:
        connection.execute(f'DELETE FROM messages WHERE {condition}')


def test_lost_rows_of_a_database_are_told(tmp_path, capsys):
    bag = write_with_rosbags(tmp_path / 'run', COUNT, StoragePlugin.SQLITE3)
    whole = COUNT * len(RECORDED)
    delete_rows(bag / 'run.db3', f'timestamp >= {START_NS + 20 * STEP_NS}')
    kept = 20 * len(RECORDED)
    info = bag_info(bag)
    assert (info.message_count, info.absent, info.complete) == (kept, whole - kept, False)
    told, = info.remarks
    assert f'announces {whole} messages, the files hold {kept}' in told
    assert f'20 of {COUNT} on /muscle/' in told and f'{len(RECORDED) - 3} more topics' in told
    assert f'{whole - kept} announced and in no file' in render_text(info)
    assert 'Nothing is known to be missing' not in render_text(info)
    assert main(['info', str(bag)]) == 1
    capsys.readouterr()
    # A program that reads one topic alone hears the same of the whole bag.
    assert any('announces' in remark for remark in load_run(bag).remarks)


def test_a_database_that_lacks_one_topic_names_it(tmp_path):
    bag = write_with_rosbags(tmp_path / 'run', COUNT, StoragePlugin.SQLITE3)
    delete_rows(bag / 'run.db3', f'topic_id = 1 AND timestamp < {START_NS + 5 * STEP_NS}')
    told, = bag_info(bag).remarks
    assert f'({COUNT - 5} of {COUNT} on /muscle/' in told and told.count(' on ') == 1


@pytest.mark.parametrize('compressed', [False, True])
def test_messages_are_read_whatever_metadata_says_of_their_quality_of_service(
        tmp_path, compressed):
    bag = write_bag(tmp_path / 'run', COUNT)
    file = bag / 'run_0.mcap'
    if compressed:
        (bag / 'run_0.mcap.zstd').write_bytes(zstandard.compress(file.read_bytes()))
        file.unlink()

    def forget(facts):
        for row in facts['topics_with_message_count']:
            row['topic_metadata']['offered_qos_profiles'] = []
        facts['custom_data'] = None
        if compressed:
            facts.update(compression_mode='FILE', compression_format='zstd',
                         relative_file_paths=['run_0.mcap.zstd'])
    change_metadata(bag, forget)
    run = load_run(bag)
    assert len(run['pressure']) == COUNT and run.remarks == ()
    assert run.metadata == METADATA         # of the record in the file
    assert bag_info(bag).storage == 'mcap'


def test_a_damaged_compressed_file_is_refused(tmp_path):
    bag = write_with_rosbags(tmp_path / 'run', COUNT, StoragePlugin.SQLITE3, CompressionMode.FILE)
    file = bag / 'run.db3.zstd'
    data = bytearray(file.read_bytes())
    data[len(data) // 2:len(data) // 2 + 50] = bytes(50)
    file.write_bytes(data)
    with pytest.raises(InputError, match='run.db3.zstd: the compressed file is damaged'):
        load_run(bag)


def test_a_storage_that_nobody_here_reads_is_named(tmp_path):
    bag = write_bag(tmp_path / 'run', 3)
    change_metadata(bag, lambda facts: facts.update(storage_identifier='tape'))
    with pytest.raises(InputError, match='its storage is tape; allowed: mcap, sqlite3'):
        load_run(bag)


def test_parts_of_a_database_without_metadata_are_read_in_order(tmp_path):
    bag = write_with_rosbags(tmp_path / 'run', COUNT, StoragePlugin.SQLITE3)
    parts = tmp_path / 'parts'
    parts.mkdir()
    for number, (begin, end) in {2: (0, 10), 9: (10, 20), 10: (20, 30)}.items():
        part = parts / f'part_{number}.db3'
        shutil.copy(bag / 'run.db3', part)
        begin_ns, end_ns = START_NS + begin * STEP_NS, START_NS + end * STEP_NS
        delete_rows(part, f'timestamp < {begin_ns} OR timestamp >= {end_ns}')
    run = load_run(parts)
    assert list(run['pressure'].stamp_ns) == [START_NS + i * STEP_NS for i in range(COUNT)]
    assert run.remarks == ()


@pytest.mark.parametrize('plugin', list(StoragePlugin), ids=lambda plugin: plugin.name)
def test_a_lone_file_of_compressed_messages_is_read(tmp_path, plugin):
    bag = write_with_rosbags(tmp_path / 'run', COUNT, plugin, CompressionMode.MESSAGE)
    run = load_run(next(file for file in bag.iterdir() if file.name != layout.METADATA_FILE))
    assert len(run['pressure']) == len(run['contraction']) == COUNT and run.remarks == ()
    assert len(run.reference_trajectories) == COUNT


@pytest.fixture
def killed(tmp_path):
    """Return a folder as a killed `ros2 bag record --compression-mode file` leaves it."""
    bag, name = tmp_path / 'run', '/muscle/pressure'
    with BagWriter(bag, METADATA, max_file_s=0.25) as writer:
        writer.add_topic(name, 'sensor_msgs/msg/FluidPressure')
        raw = encode('pressure', example_messages()['pressure'])
        for time_ns in range(START_NS, START_NS + 120 * STEP_NS, STEP_NS):
            writer.write(name, raw, time_ns, time_ns)
    (bag / layout.METADATA_FILE).unlink()
    first, second, _ = sorted(bag.glob('*.mcap'))
    for file in (first, second):
        packed = zstandard.compress(file.read_bytes())
        # It was being compressed: the plain one is still there.
        file.with_name(f'{file.name}.zstd').write_bytes(
            packed[:len(packed) // 2] if file is second else packed)
    first.unlink()
    return bag


def test_compressed_files_without_metadata_belong_to_the_recording(killed):
    bag = read_bag(killed)
    assert bag.counts == {'/muscle/pressure': 120} and not bag.remarks
    assert list(bag.topics['/muscle/pressure'].log_time_ns) == [
        START_NS + i * STEP_NS for i in range(120)]
    lone = killed / 'run_0.mcap.zstd'
    assert read_bag(lone).counts == {'/muscle/pressure': 50}
    for file in killed.glob('*.mcap'):
        file.unlink()
    (killed / 'run_1.mcap.zstd').unlink()
    assert read_bag(killed).counts == {'/muscle/pressure': 50}


def test_files_are_in_order_of_their_numbers_however_they_are_compressed():
    names = ['run_2.mcap.zstd', 'run_9.mcap', 'run_10.mcap.zstd', 'run_11.mcap']
    assert [file.name for file in sorted(map(Path, sorted(names)), key=by_number)] == names


def test_a_folder_with_compressed_files_is_repaired_once_they_are_unpacked(killed, capsys):
    before = sorted(killed.iterdir())
    with pytest.raises(InputError, match='`zstd -d run_0.mcap.zstd -o run_0.mcap`'):
        recover_bag(killed)
    assert main(['info', str(killed), '--recover']) == 2
    assert 'unpack each such file first' in capsys.readouterr().err
    assert sorted(killed.iterdir()) == before
    packed = killed / 'run_0.mcap.zstd'
    packed.with_suffix('').write_bytes(zstandard.decompress(packed.read_bytes()))
    assert recover_bag(killed).messages == 120
    assert read_bag(killed).counts == {'/muscle/pressure': 120}


def test_two_recordings_in_one_folder_are_refused(tmp_path):
    for name in ('one', 'other'):
        write_bag(tmp_path / name, 30)
        file, = (tmp_path / name).glob('*.mcap')
        (tmp_path / 'both').mkdir(exist_ok=True)
        shutil.copy(file, tmp_path / 'both' / f'{name}.mcap')
    with pytest.raises(InputError, match='one.mcap and other.mcap have messages of /muscle/'
                       '.* at the same times, so they are two recordings; give one of the files'):
        load_run(tmp_path / 'both')
    assert load_run(tmp_path / 'both' / 'one.mcap').duration_s > 0.0

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

"""The recorder's count: what came, what was written, what was dropped, what never came."""

import errno
import io
import shutil
import threading
import time

from mcap.records import DataEnd
from mcap.stream_reader import StreamReader
from pam_actuation.bags import disk
from pam_actuation.bags.check import independent_readers
from pam_actuation.bags.info import bag_info
from pam_actuation.bags.load import load_run
from pam_actuation.bags.mcap_scan import scan
from pam_actuation.bags.mcap_write import MAGIC
from pam_actuation.bags.place import check_bag_target
from pam_actuation.bags.recorder import RecorderCore, SequenceCheck
from pam_actuation.bags.source import read_bag
from pam_actuation.bags.writer import BagWriter
from pam_actuation.topics import codec
from pam_actuation.topics.table import RECORDED
from pam_sim.errors import InputError
import pytest
from sample_bag import example_messages, METADATA, START_NS

TOPIC = '/muscle/pressure'


def payload(i):
    return codec.encode('pressure', example_messages(i)['pressure'])


class HeldWriter(BagWriter):
    """A bag on a disk that stands still until ``go`` is set."""

    def __init__(self, directory):
        super().__init__(directory, METADATA)
        self.go = threading.Event()
        self.waiting = threading.Event()

    def write(self, *args):
        self.waiting.set()
        assert self.go.wait(10.0)
        super().write(*args)


class FullDiskWriter(BagWriter):
    """A bag on a disk with room for ``room`` messages."""

    room = 0

    def write(self, *args):
        if sum(self.counts.values()) >= self.room:
            raise OSError(errno.ENOSPC, 'No space left on device')
        super().write(*args)


def recorder_on(writer, **options):
    core = RecorderCore(writer, **options)
    core.add_topic(TOPIC, RECORDED['pressure'].type_name)
    return core


def test_everything_received_is_written(tmp_path):
    core = recorder_on(BagWriter(tmp_path / 'run', METADATA))
    for i in range(3000):
        assert core.receive(TOPIC, payload(i), START_NS + i - 5, START_NS + i, sequence=i + 1)
    summary = core.close()
    assert summary is core.close()
    assert summary.complete and summary.written == summary.received == 3000
    counts = summary.counts[TOPIC]
    assert (counts.lost, counts.missed_at_start, counts.dropped) == (0, 0, 0)
    bag = read_bag(tmp_path / 'run')
    assert bag.topics[TOPIC].payloads == [payload(i) for i in range(3000)]
    assert list(bag.topics[TOPIC].publish_time_ns[:2]) == [START_NS - 5, START_NS - 4]
    assert list(bag.topics[TOPIC].log_time_ns[:2]) == [START_NS, START_NS + 1]
    assert bag.records['pam_recording'][f'{TOPIC}.written'] == '3000'
    assert bag.records['pam_recording'][f'{TOPIC}.lost'] == '0'


def test_several_threads_may_hand_over(tmp_path):
    core = recorder_on(BagWriter(tmp_path / 'run', METADATA))

    def send(name):
        core.add_topic(name, RECORDED['pressure'].type_name)
        for i in range(500):
            core.receive(name, payload(i), START_NS + i, START_NS + i, sequence=i + 1)

    threads = [threading.Thread(target=send, args=(f'/m{n}/pressure',)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    summary = core.close()
    assert summary.complete and summary.written == 2000
    counts = read_bag(tmp_path / 'run').counts
    assert counts == {TOPIC: 0, **{f'/m{n}/pressure': 500 for n in range(4)}}


def test_unknown_send_time_becomes_the_receive_time(tmp_path):
    core = recorder_on(BagWriter(tmp_path / 'run', METADATA))
    core.receive(TOPIC, payload(0), 0, START_NS)
    summary = core.close()
    assert summary.counts[TOPIC].lost is None
    assert list(read_bag(tmp_path / 'run').topics[TOPIC].publish_time_ns) == [START_NS]


def test_a_disk_that_cannot_follow_drops_and_counts(tmp_path):
    writer = HeldWriter(tmp_path / 'run')
    core = recorder_on(writer, max_queued=10)
    assert core.receive(TOPIC, payload(0), START_NS, START_NS, 1)
    assert writer.waiting.wait(10.0)
    taken = [core.receive(TOPIC, payload(i), START_NS, START_NS, i + 1) for i in range(1, 31)]
    assert taken == [True] * 10 + [False] * 20
    assert core.counts[TOPIC].dropped == 20 and core.queued == 10
    writer.go.set()
    summary = core.close()
    counts = summary.counts[TOPIC]
    assert not summary.complete
    assert (counts.received, counts.written, counts.dropped, counts.lost) == (31, 11, 20, 0)
    assert read_bag(tmp_path / 'run').counts[TOPIC] == 11


def test_a_full_disk_is_reported_and_the_beginning_kept(tmp_path):
    FullDiskWriter.room = 4000
    core = recorder_on(FullDiskWriter(tmp_path / 'run', METADATA))
    for i in range(6000):
        core.receive(TOPIC, payload(i), START_NS + i, START_NS + i, i + 1)
    summary = core.close()
    assert 'No space left on device' in summary.write_error and not summary.complete
    counts = summary.counts[TOPIC]
    assert counts.received == 6000 == counts.written + counts.dropped
    assert counts.written == 4000
    # There was room for the end of the file: the bag is whole, and says what is missing.
    assert len(load_run(tmp_path / 'run').topics['pressure']) == 4000
    info = bag_info(tmp_path / 'run')
    assert info.complete is False and info.dropped == 2000
    assert any('No space left' in remark for remark in info.remarks)


def test_error_at_close_is_reported(tmp_path, monkeypatch):
    writer = BagWriter(tmp_path / 'run', METADATA)
    core = recorder_on(writer)
    core.receive(TOPIC, payload(0), START_NS, START_NS, 1)

    def refuse():
        raise OSError(errno.EIO, 'Input/output error')

    monkeypatch.setattr(writer, 'close', refuse)
    summary = core.close()
    assert 'Input/output error' in summary.write_error
    assert summary.counts[TOPIC].received == 1 == summary.written and not summary.complete
    assert core.receive(TOPIC, payload(1), START_NS, START_NS, 2) is False


def written_to(core, number):
    """Hand messages over until the recorder has written this many, or fails."""
    deadline, i = time.monotonic() + 20.0, 0
    while core.counts[TOPIC].written < number:
        core.receive(TOPIC, payload(i), START_NS + i, START_NS + i, i + 1)
        time.sleep(0.002)
        i += 1
        assert time.monotonic() < deadline


def noticed(core):
    """Return what the recorder says of itself, at the latest after some seconds."""
    deadline = time.monotonic() + 20.0
    while not core.write_error and time.monotonic() < deadline:
        time.sleep(0.01)
    return core.write_error


def test_a_bag_that_is_removed_while_recording_is_noticed(tmp_path):
    core = recorder_on(BagWriter(tmp_path / 'run', METADATA), flush_every_s=0.02)
    written_to(core, 20)
    shutil.rmtree(tmp_path / 'run')
    assert noticed(core) == (
        f'{tmp_path / "run"}: the file was removed while it was recorded, and all in it is lost')
    summary = core.close()
    assert (summary.written, summary.dropped) == (0, summary.received)
    assert not (tmp_path / 'run').exists()


def test_a_bag_that_is_renamed_while_recording_is_noticed(tmp_path):
    core = recorder_on(BagWriter(tmp_path / 'run', METADATA), flush_every_s=0.02)
    written_to(core, 20)
    (tmp_path / 'run').rename(tmp_path / 'other')
    assert noticed(core) == (
        f'{tmp_path / "run"}: the file was moved while it was recorded, and ends early where it '
        'is now')
    summary = core.close()
    assert summary.written >= 20 == len(read_bag(tmp_path / 'other').topics[TOPIC].payloads[:20])
    assert not (tmp_path / 'run').exists()


def no_handle(_):
    raise OSError(errno.EMFILE, 'Too many open files')


@pytest.mark.parametrize('name, broken', (
    ('handle_to_sync', no_handle), ('loss', property(no_handle))))
def test_a_bag_that_cannot_be_brought_onto_the_disk_is_told(tmp_path, monkeypatch, name, broken):
    """The thread that waits for the disk lives on, and notes why."""
    core = recorder_on(BagWriter(tmp_path / 'run', METADATA), flush_every_s=0.02)
    written_to(core, 20)
    with monkeypatch.context() as patched:
        patched.setattr(BagWriter, name, broken)
        assert 'Too many open files' in noticed(core)
        time.sleep(0.1)
        assert core._syncing.is_alive()
    summary = core.close()
    assert 'Too many open files' in summary.write_error and not summary.complete
    assert len(load_run(tmp_path / 'run').topics['pressure']) == summary.written >= 20


def test_a_bag_that_is_removed_at_the_last_moment_is_lost(tmp_path):
    core = recorder_on(BagWriter(tmp_path / 'run', METADATA), flush_every_s=60.0)
    written_to(core, 20)
    shutil.rmtree(tmp_path / 'run')
    summary = core.close()
    assert 'was removed while it was recorded' in summary.write_error
    assert summary.written == 0 and not summary.complete


def test_room_is_advised_on_a_full_disk_only(tmp_path, monkeypatch):
    advice = 'free some space or record elsewhere'
    FullDiskWriter.room = 0
    core = recorder_on(FullDiskWriter(tmp_path / 'full', METADATA))
    core.receive(TOPIC, payload(0), START_NS, START_NS, 1)
    assert core.close().write_error.endswith(advice)
    writer = BagWriter(tmp_path / 'broken', METADATA)
    core = recorder_on(writer)

    def refuse(*_):
        raise OSError(errno.EIO, 'Input/output error')

    monkeypatch.setattr(writer, 'write', refuse)
    core.receive(TOPIC, payload(0), START_NS, START_NS, 1)
    assert core.close().write_error.endswith('(Input/output error); the bag ends early')


def test_gaps_are_lost_messages(tmp_path):
    core = recorder_on(BagWriter(tmp_path / 'run', METADATA))
    for sequence in (4, 5, 7, 8, 12):
        core.receive(TOPIC, payload(0), START_NS, START_NS, sequence)
    summary = core.close()
    counts = summary.counts[TOPIC]
    assert (counts.lost, counts.missed_at_start) == (4, 3)
    assert not summary.complete and summary.to_dict()['topics'][TOPIC]['lost'] == 4


def test_diagnostics_have_no_sequence_check(tmp_path):
    core = RecorderCore(BagWriter(tmp_path / 'run', METADATA))
    core.add_topic('/diagnostics', RECORDED['diagnostics'].type_name)
    raw = codec.encode('diagnostics', example_messages()['diagnostics'])
    for sequence in (1, 1, 9, 2, 5):
        core.receive('/diagnostics', raw, START_NS, START_NS, sequence)
    summary = core.close()
    assert summary.counts['/diagnostics'].lost is None and summary.complete


def check(sequence):
    result = SequenceCheck()
    for number in sequence:
        result.add(number)
    return result.lost, result.missed_at_start, result.publishers


def test_publishers_are_told_apart_by_continuity():
    assert check([1, 2, 3]) == (0, 0, 1)
    # A second publisher joins; both go on in turn.
    assert check([10, 11, 1, 12, 2, 13, 3]) == (0, 9, 2)
    # The publisher restarts.
    assert check([1, 2, 3, 1, 2, 3, 4]) == (0, 0, 2)
    # One of two loses a message.
    assert check([10, 11, 1, 12, 2, 14, 3, 4, 15]) == (1, 9, 2)


def test_publishers_that_come_late_and_vanish_are_counted_honestly():
    # One vanishes, another comes late: what it sent before it was connected is told apart.
    assert check([1, 2, 3, 4, 3, 4, 5]) == (0, 2, 2)
    # It loses two on the way, and vanishes as well; a third starts from the beginning.
    assert check([1, 2, 3, 4, 3, 4, 7, 8, 1, 2]) == (2, 2, 3)
    # A late one with a high number cannot be told from a gap: the sum of both is right.
    lost, missed, _ = check([1, 2, 3, 50, 51, 4, 5, 52])
    assert lost + missed == 49


@pytest.mark.timed
def test_killed_recorder_leaves_a_readable_beginning(tmp_path):
    writer = BagWriter(tmp_path / 'run', METADATA)
    core = recorder_on(writer)
    for i in range(20_000):
        core.receive(TOPIC, payload(i), START_NS + i, START_NS + i, i + 1)
        if i % 5000 == 4999:
            while core.queued:
                threading.Event().wait(0.01)
    # Well within a second everything is on the disk: a process killed then leaves this file.
    left = tmp_path / 'left.mcap'
    deadline = time.monotonic() + 1.0
    while time.monotonic() < deadline:
        left.write_bytes(writer.file.read_bytes())
        if scan(left.read_bytes()).message_count == 20_000:
            break
        time.sleep(0.05)
    core.close()
    with pytest.raises(InputError, match='ended early'):
        load_run(left)
    run = load_run(left, recover=True)
    assert len(run.topics['pressure']) == 20_000
    assert run.metadata['experiment_name'] == 'sine'


def test_messages_are_handed_over_as_rclpy_takes_them(tmp_path):
    writer = HeldWriter(tmp_path / 'run')
    core = recorder_on(writer, max_queued=5)
    messages = [(payload(i), {'source_timestamp': START_NS + i, 'received_timestamp': START_NS,
                              'publication_sequence_number': i + 1}) for i in range(20)]
    assert core.receive_all(TOPIC, messages) == 5
    writer.go.set()
    summary = core.close()
    counts = summary.counts[TOPIC]
    assert (counts.received, counts.written, counts.dropped, counts.lost) == (20, 5, 15, 0)
    assert read_bag(tmp_path / 'run').topics[TOPIC].payloads == [raw for raw, _ in messages[:5]]


def test_a_full_disk_between_two_files_keeps_the_first(tmp_path, monkeypatch):
    core = recorder_on(BagWriter(tmp_path / 'run', METADATA, max_file_s=0.5))
    for i in range(100):
        core.receive(TOPIC, payload(i), START_NS, START_NS + i * 1_000_000, i + 1)
    while core.counts[TOPIC].written < 100:
        time.sleep(0.01)

    def refuse(self):
        raise OSError(errno.ENOSPC, 'No space left on device')

    monkeypatch.setattr(BagWriter, '_next_file', refuse)
    for i in range(100, 200):
        core.receive(TOPIC, payload(i), START_NS, START_NS + 10**9 + i, i + 1)
    summary = core.close()
    assert 'No space left' in summary.write_error
    assert (summary.received, summary.written, summary.dropped) == (200, 100, 100)
    assert [path.name for path in (tmp_path / 'run').glob('*.mcap')] == ['run_0.mcap']
    assert len(load_run(tmp_path / 'run').topics['pressure']) == 100
    assert bag_info(tmp_path / 'run').dropped == 100


def test_a_disk_too_full_for_the_end_of_a_file_leaves_a_whole_bag(tmp_path, monkeypatch):
    """The next file is there by then: it goes, and the room with it."""
    write_all, refused = disk.write_all, []

    def small_disk(stream, data):
        if data.endswith(MAGIC) and not refused:
            refused.append(stream.name)
            raise OSError(errno.ENOSPC, 'No space left on device')
        write_all(stream, data)

    monkeypatch.setattr(disk, 'write_all', small_disk)
    core = recorder_on(BagWriter(tmp_path / 'run', METADATA, max_file_s=0.5))
    for i in range(100):
        core.receive(TOPIC, payload(i), START_NS, START_NS + i * 10_000_000, i + 1)
    summary = core.close()
    assert refused == [str(tmp_path / 'run' / 'run_0.mcap')]
    assert 'No space left' in summary.write_error and summary.written == 50
    assert sorted(path.name for path in (tmp_path / 'run').iterdir()) == [
        'metadata.yaml', 'run_0.mcap']
    assert check_bag_target(tmp_path / 'run', overwrite=True)
    for counts in independent_readers(tmp_path / 'run').values():
        assert counts == {TOPIC: 50}
    with open(tmp_path / 'run' / 'run_0.mcap', 'rb') as stream:
        assert [type(one) for one in StreamReader(stream).records].count(DataEnd) == 1
    assert bag_info(tmp_path / 'run').dropped == 50


def test_a_disk_too_full_for_the_index_keeps_what_is_indexed(tmp_path, monkeypatch):
    class SmallDisk(io.BytesIO):

        def write(self, data):
            if self.tell() + len(data) > 300:
                raise OSError(errno.ENOSPC, 'No space left on device')
            return super().write(data)

    monkeypatch.setattr('tempfile.TemporaryFile', lambda **_: SmallDisk())
    core = recorder_on(BagWriter(tmp_path / 'run', METADATA), flush_every_s=0.01)
    deadline, i = time.monotonic() + 20.0, 0
    while not core.write_error and time.monotonic() < deadline:
        core.receive(TOPIC, payload(i), START_NS + i, START_NS + i, i + 1)
        time.sleep(0.002)
        i += 1
    summary = core.close()
    assert 'No space left' in summary.write_error
    assert 0 < summary.written < summary.received == summary.written + summary.dropped
    for counts in independent_readers(tmp_path / 'run').values():
        assert counts == {TOPIC: summary.written}
    assert bag_info(tmp_path / 'run').dropped == summary.dropped


def test_where_no_file_without_a_name_can_be_made_the_index_stays_in_memory(
        tmp_path, monkeypatch):
    def refuse(**_):
        raise OSError(errno.EOPNOTSUPP, 'Operation not supported')

    monkeypatch.setattr('tempfile.TemporaryFile', refuse)
    core = recorder_on(BagWriter(tmp_path / 'run', METADATA))
    core.receive(TOPIC, payload(0), START_NS, START_NS, 1)
    assert core.close().complete
    assert bag_info(tmp_path / 'run').complete


def test_an_index_that_cannot_be_closed_spoils_nothing(tmp_path, monkeypatch):
    class NetworkDisk(io.BytesIO):

        def close(self):
            super().close()
            raise OSError(errno.EDQUOT, 'Disk quota exceeded')

    monkeypatch.setattr('tempfile.TemporaryFile', lambda **_: NetworkDisk())
    core = recorder_on(BagWriter(tmp_path / 'run', METADATA))
    core.receive(TOPIC, payload(0), START_NS, START_NS, 1)
    assert core.close().complete
    assert bag_info(tmp_path / 'run').complete


def test_queue_length_is_checked(tmp_path):
    with BagWriter(tmp_path / 'run', {}) as writer:
        with pytest.raises(InputError, match='max_queued'):
            RecorderCore(writer, max_queued=0)

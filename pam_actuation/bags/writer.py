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

"""
Write a rosbag2 directory in the Jazzy MCAP layout.

``run/run_0.mcap`` grows while recording, in compressed chunks with checksums, so that a
killed process leaves a readable beginning; the experiment metadata is among the first
records. With a limit of size or time ``run_1.mcap`` and so on follow, each a complete
file. ``run/metadata.yaml`` appears, complete, at close.
"""

from collections.abc import Mapping
import contextlib
from pathlib import Path
from typing import Any, Self

from pam_actuation.bags import disk, layout
from pam_actuation.bags.data_file import DataFile
from pam_actuation.bags.place import BagPlace
from pam_actuation.topics.definitions import type_hash
from pam_actuation.topics.quality import Quality, USUAL
from pam_actuation.topics.table import BY_NAME, short_name
from pam_sim.annotations import ByteArray, IntArray
from pam_sim.errors import InputError
from pam_sim.files import StrPath

# Every file holds the metadata of the experiment; a smaller limit would be full of it.
SMALLEST_FILE_BYTES = 100_000
SHORTEST_FILE_S = 0.1
EXPERIMENT_RECORD = 'pam_experiment'
ROSBAG2_RECORD = 'rosbag2'


class BagWriter:
    """
    One bag being written.

    Parameters
    ----------
    directory : path
        The bag; its parents are created. The data file carries its name.
    metadata : dict of str to str, or of str to dict
        Content of the ``pam_experiment`` record (``bags/metadata.py``), or several
        records by name. That of the experiment is also kept as custom data in
        metadata.yaml, so that converted bags have it.
    overwrite : bool
        Replace the bag that is there, once this one is closed as a whole. A folder that holds
        anything else is refused.
    max_file_bytes : int
        Go on in the next file from about this size on; 0: never.
    max_file_s : float
        Go on in the next file after this time between first and newest message [s]; 0: never.
    beside : bool
        Write beside ``directory``, so that a killed process leaves nothing there: for what can
        be made again.

    Raises
    ------
    InputError
        The directory exists already, or holds something else than a bag; a limit so small that
        a file could not hold anything.
    OSError
        The file system refuses (no space, no right to write).

    """

    def __init__(self, directory: StrPath, metadata: Mapping[str, Any] | None = None,
                 overwrite: bool = False, max_file_bytes: int = 0,
                 max_file_s: float = 0.0, beside: bool = False) -> None:
        check_limits(max_file_bytes, max_file_s)
        self._place = BagPlace(directory, overwrite, beside)
        self.directory = self._place.directory
        self._records = _records(metadata or {})
        self._limit_bytes = max_file_bytes or float('inf')
        self._limit_ns = round(max_file_s * 1e9) or float('inf')
        self._topics: dict[str, dict[str, Any]] = {}
        self._finished: list[layout.FileFacts] = []
        self._in_former_files: dict[str, int] = {}
        self._closed = self.finished = False
        self._whole = True
        self._current: DataFile | None = None
        try:
            self._current = self._next_file()
        except BaseException:
            self._place.give_up([])
            raise

    @property
    def _open(self) -> DataFile:
        """Return the file that is being written."""
        assert self._current is not None, 'the bag is closed'
        return self._current

    def _next_file(self) -> DataFile:
        """Begin the next file: header, metadata, all topics so far."""
        number = len(self._finished) + (self._current is not None)
        made = DataFile(
            self._place.folder / f'{self.directory.name}_{number}.mcap', self._begin)
        disk.sync_directory(self._place.folder)
        return made

    def _begin(self, file: DataFile) -> None:
        self._write_rosbag2_record(file)
        for name, texts in self._records.items():
            file.mcap.add_metadata(name, texts)
        for name, facts in self._topics.items():
            file.register(name, facts['type'], facts['qos'], facts['hash'])

    def _split(self) -> None:
        # The next file first: where it cannot be made, the present one can still be finished.
        following = self._next_file()
        try:
            self._finish_file()
        except BaseException:
            following.discard()
            raise
        self._current = following
        self._in_former_files = self.counts

    @property
    def counts(self) -> dict[str, int]:
        """Return the messages written so far, by full topic name."""
        return {name: facts['count'] for name, facts in self._topics.items()}

    @property
    def files(self) -> list[Path]:
        """Return the paths of all files of the bag, in order."""
        names = [facts.name for facts in self._finished]
        names += [] if self._current is None else [self._current.path.name]
        return [self._place.folder / name for name in names]

    @property
    def file(self) -> Path:
        """Return the path of the newest file."""
        return self.files[-1]

    def add_topic(self, full_name: str, type_name: str, offered: Quality | None = None) -> None:
        """
        Announce a topic; a second call with the same type changes nothing.

        The bag states the quality of service of its publisher: ``offered``, or without that as
        the table of topics has it. Raises InputError for a name that is not absolute, a type that
        ROS 2 Jazzy does not have, or another type than before.
        """
        if full_name in self._topics:
            if self._topics[full_name]['type'] != type_name:
                raise InputError(
                    f'the topic has the type {self._topics[full_name]["type"]} in this bag '
                    f'and cannot also be {type_name}', full_name)
            return
        if not full_name.startswith('/') or full_name.endswith('/'):
            raise InputError('give the full topic name, such as /muscle/pressure', full_name)
        row = BY_NAME.get(short_name(full_name))
        profile = layout.qos_profile(offered or (row.service if row else USUAL).publisher)
        self._topics[full_name] = {
            'type': type_name, 'qos': (profile,), 'hash': type_hash(type_name), 'count': 0}
        facts = self._topics[full_name]
        self._open.register(full_name, type_name, facts['qos'], facts['hash'])

    def write(self, full_name: str, cdr_bytes: bytes, log_time_ns: int,
              publish_time_ns: int) -> None:
        """
        Append one message: receive time and send time [ns]; KeyError for an unknown topic.

        Raises OSError when the file system refuses; what was written before stays.
        """
        file = self._open
        if file.start_ns is not None and (log_time_ns - file.start_ns >= self._limit_ns
                                          or file.size >= self._limit_bytes):
            self._split()
            file = self._open
        file.write(full_name, cdr_bytes, log_time_ns, publish_time_ns)
        self._topics[full_name]['count'] += 1

    def write_series(self, series: Mapping[str, tuple[IntArray, ByteArray]]) -> None:
        """
        Append many messages at once, each received when it was sent; to the newest file.

        Parameters
        ----------
        series : dict of str -> (numpy.ndarray, numpy.ndarray)
            By full topic name: times [ns], shape (N,), and CDR bytes of equal length, shape
            (N, B), as of ``codec.encode_series``. Messages are ordered by time, at equal times
            as the topics are here.

        Raises
        ------
        KeyError
            Unknown topic.
        OSError
            The file system refuses; what was written before stays.

        """
        self._open.write_series(series)
        for name, (time_ns, _) in series.items():
            self._topics[name]['count'] += time_ns.size

    def add_metadata(self, name: str, values: Mapping[str, object]) -> None:
        """Append a named metadata record of texts."""
        self._open.mcap.add_metadata(name, _texts(values))

    def add_to_experiment(self, texts: Mapping[str, object]) -> None:
        """Add to the ``pam_experiment`` record: it is written anew, readers take the last."""
        self._records[EXPERIMENT_RECORD] = {
            **self._records.get(EXPERIMENT_RECORD, {}), **_texts(texts)}
        self.add_metadata(EXPERIMENT_RECORD, self._records[EXPERIMENT_RECORD])

    def flush(self) -> None:
        """Close the open chunk, so that all messages written survive the end of the process."""
        self._open.mcap.close_chunk()

    def handle_to_sync(self) -> int | None:
        """
        Return a file descriptor for ``disk.sync``, None if nothing was written since the last.

        The caller waits for the disk, in a thread of its own, and closes it; what was flushed
        then survives the loss of power.
        """
        return None if self._current is None else self._current.handle_to_sync()

    @property
    def loss(self) -> str:
        """Return what happened to an open file that is not in its place any more, else ''."""
        return '' if self._current is None else self._current.loss

    def replace_nothing(self) -> None:
        """Leave a former bag where it is: this one, not whole, gets another ``directory``."""
        self._whole = False

    def close(self) -> None:
        """Finish the index and metadata.yaml, put the bag in its place; once."""
        if self._closed:
            return
        try:
            if self._current is not None:
                self._finish_file()
            layout.write_metadata(self._place.folder, self._bag_metadata())
            self.directory = self._place.settle(self._whole)
        except OSError:
            self.abandon()
            raise
        self._closed = self.finished = True

    def _finish_file(self) -> None:
        self._write_rosbag2_record(self._open)
        self._open.finish()
        self._finished.append(self._open.facts)
        self._current = None

    def cut(self) -> None:
        """
        After a write error: take back what is half written and count what is in the bag.

        What can still be written by ``add_metadata`` and ``close`` makes it a whole bag; where
        that fails, or after ``abandon``, the file has no index but is readable.
        """
        if self._closed or self._current is None:
            return
        in_file = self._current.cut()
        all_lost = self._current.removed and not self._place.folder.exists()
        before = {} if all_lost else self._in_former_files
        for name, facts in self._topics.items():
            facts['count'] = before.get(name, 0) + in_file.get(name, 0)

    def abandon(self) -> None:
        """Close the file without an index, after a write error; what is in it stays readable."""
        if not self._closed:
            self._release()
            with contextlib.suppress(OSError):
                self.directory = self._place.settle(whole=False)

    def _release(self) -> None:
        if self._current is not None:
            self._current.abandon()
        self._closed = True

    def discard(self) -> None:
        """Give a bag up that is not ``finished``: remove what was written, and nothing else."""
        if self.finished:
            return
        files = self.files
        self._release()
        self._place.give_up([*files, self._place.folder / layout.METADATA_FILE])

    def __enter__(self) -> Self:
        """Return the writer itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the bag, whatever happened: what was written stays readable."""
        self.close()

    def _bag_metadata(self, begun: DataFile | None = None) -> dict[str, Any]:
        topics = [
            layout.TopicFacts(name, facts['type'], facts['qos'], facts['hash'], facts['count'])
            for name, facts in self._topics.items()]
        files = list(self._finished)
        if self._current is not None:
            files.append(self._current.facts)
        if begun is not None:
            files.append(begun.facts)
        return layout.bag_metadata(files, topics, self._records.get(EXPERIMENT_RECORD))

    def _write_rosbag2_record(self, file: DataFile) -> None:
        # Written at open and at close, as rosbag2 does; readers take the last one.
        metadata = self._bag_metadata(file if file is not self._current else None)
        file.mcap.add_metadata(
            ROSBAG2_RECORD, {'serialized_metadata': layout.to_yaml(metadata)})


def check_limits(max_file_bytes: int, max_file_s: float) -> None:
    """Raise InputError for limits of a file that are neither 0 nor large enough."""
    if max_file_bytes != 0 and max_file_bytes < SMALLEST_FILE_BYTES:
        raise InputError(
            f'{max_file_bytes} bytes are too few for a file, give 0 (no limit) or at least '
            f'{SMALLEST_FILE_BYTES}', 'largest file size')
    if max_file_s != 0.0 and not SHORTEST_FILE_S <= max_file_s <= 1e9:
        raise InputError(
            f'{max_file_s:g} s is not allowed, give 0 (no limit) or {SHORTEST_FILE_S} to 1e9',
            'longest file duration')


def _texts(values: Mapping[Any, object]) -> dict[str, str]:
    return {str(key): str(value) for key, value in values.items()}


def _records(metadata: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Return record name to texts; texts without a record's name are the experiment's."""
    records = {
        name: _texts(values) for name, values in metadata.items() if isinstance(values, dict)}
    loose = {key: value for key, value in metadata.items() if key not in records}
    if loose:
        records[EXPERIMENT_RECORD] = {**records.get(EXPERIMENT_RECORD, {}), **_texts(loose)}
    return records

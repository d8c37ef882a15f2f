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
The recorder without ROS: a bounded queue, one writer thread, an honest count.

A node hands over every serialized message together with its time stamps and
the sequence number that the publisher gave it. Handing over never blocks: when
the disk cannot follow, the newest messages are dropped and counted.
"""

from collections import deque
from collections.abc import Iterable, Mapping
import contextlib
from dataclasses import asdict, dataclass, field, replace
import os
import threading
import time
from typing import Any

from pam_actuation.bags import disk
from pam_actuation.bags.ending import Ending, ERROR
from pam_actuation.bags.losses import missing_messages, PublishedCounts, SentTimes
from pam_actuation.bags.writer import BagWriter
from pam_actuation.topics.quality import Quality
from pam_actuation.topics.table import DIAGNOSTICS
from pam_sim.errors import InputError

# Topic, bytes, receive and send time [ns] of messages that wait for the disk.
Batch = deque[tuple[str, bytes, int, int]]
RECORDING_RECORD = 'pam_recording'
WRITE_EVERY_S = 0.1         # the writer thread takes what has come, in few large portions
BEGIN_NS = 1_000_000_000    # a publisher heard by then was there before the bag
WAKE_AT = 1000              # messages that wake it earlier


@dataclass
class TopicCounts:
    """
    What happened to the messages of one topic.

    ``received`` = ``written`` + ``dropped`` once the recorder is closed.
    ``dropped`` came too fast or after a write error; ``lost`` never arrived, by
    gaps in the publishers' sequence numbers and, once the recorder is closed, by
    what the nodes say they have published; ``missed_at_start`` were
    published before the first one that arrived. The last two are None where the
    middleware gives no numbers or they cannot be told apart by publisher.
    ``sent_before`` of ``missed_at_start`` are of publishers that were heard from the begin
    of the bag on, so they were sent before it.
    """

    received: int = 0
    written: int = 0
    dropped: int = 0
    lost: int | None = None
    missed_at_start: int | None = None
    sent_before: int = 0
    publishers: int = 0


@dataclass
class RecordingSummary:
    """
    What ``RecorderCore.close`` returns.

    ``complete`` is True when every message that was published after the
    recorder was connected is in the bag and the bag was finished.
    """

    path: str
    counts: dict[str, TopicCounts] = field(default_factory=dict)
    write_error: str = ''

    @property
    def received(self) -> int:
        """Return how many messages arrived on all topics."""
        return sum(counts.received for counts in self.counts.values())

    @property
    def written(self) -> int:
        """Return how many messages are in the bag."""
        return sum(counts.written for counts in self.counts.values())

    @property
    def dropped(self) -> int:
        """Return how many messages arrived but are not in the bag."""
        return sum(counts.dropped for counts in self.counts.values())

    @property
    def lost(self) -> int:
        """Return how many messages are known never to have arrived."""
        return sum(counts.lost or 0 for counts in self.counts.values())

    @property
    def complete(self) -> bool:
        """Return whether nothing is missing."""
        return not (self.write_error or self.dropped or self.lost)

    def to_dict(self) -> dict[str, Any]:
        """Return the summary as plain data for JSON."""
        return {
            'path': self.path, 'complete': self.complete, 'write_error': self.write_error,
            'received': self.received, 'written': self.written, 'dropped': self.dropped,
            'lost': self.lost,
            'topics': {name: asdict(counts) for name, counts in self.counts.items()}}


class SequenceCheck:
    """
    Finds gaps in sequence numbers that count from 1 per publisher.

    Several publishers of one topic are separated by continuity. A number continues the publisher
    that expects it. One lower than every expected number begins a new publisher. Any other is the
    smallest possible gap.
    """

    def __init__(self) -> None:
        self.lost = 0
        self.missed_at_start = 0
        self.publishers = 0
        self._expected: list[int] = []

    def add(self, sequence: int) -> None:
        """Take the sequence number of the next message of the topic."""
        expected = self._expected
        # The publisher heard last is tried first.
        for i in range(len(expected) - 1, -1, -1):
            if expected[i] == sequence:
                expected.append(expected.pop(i) + 1)
                return
        below = [number for number in expected if number < sequence]
        if below:
            nearest = max(below)
            self.lost += sequence - nearest
            expected.remove(nearest)
        else:
            self.publishers += 1
            self.missed_at_start += max(sequence - 1, 0)
        expected.append(sequence + 1)


class RecorderCore:
    """
    Takes messages from subscription callbacks and writes them in its own thread.

    Parameters
    ----------
    writer : BagWriter
        The open bag; the recorder closes it.
    max_queued : int
        Messages that may wait for the disk (default 20 000: about ten seconds of a rig at 200 Hz).
    flush_every_s : float
        How often what was written is brought onto the disk: with the time in the queue,
        what the loss of power or of the process may cost.

    """

    def __init__(self, writer: BagWriter, max_queued: int = 20_000,
                 flush_every_s: float = 0.4) -> None:
        if max_queued < 1:
            raise InputError(f'{max_queued} is below 1 message', 'max_queued')
        self._writer = writer
        self._max_queued = max_queued
        self._flush_every_s = flush_every_s
        self._queue: Batch = deque()
        self._wake = threading.Condition()       # guards the queue and the counts
        self._disk = threading.Lock()            # guards the writer; never taken inside _wake
        self._counts: dict[str, TopicCounts] = {}
        self._checks: dict[str, SequenceCheck] = {}
        self._published = PublishedCounts()
        self._sent: dict[str, SentTimes] = {}
        self._closing = False
        self._begin_ns = 0
        self._summary: RecordingSummary | None = None
        self.write_error = ''
        self._thread = threading.Thread(target=self._run, name='bag_writer', daemon=True)
        self._thread.start()
        self._ended = threading.Event()
        self._syncing = threading.Thread(target=self._sync, name='bag_sync', daemon=True)
        self._syncing.start()

    def add_topic(self, full_name: str, type_name: str, offered: Quality | None = None) -> None:
        """
        Announce a topic before its messages; ``offered`` is as of ``BagWriter.add_topic``.

        Sequence numbers are watched for gaps, but on ``/diagnostics``, where many nodes publish.
        """
        with self._disk:
            self._writer.add_topic(full_name, type_name, offered)
        with self._wake:
            self._counts.setdefault(full_name, TopicCounts())
            self._sent.setdefault(full_name, SentTimes())
            if full_name != DIAGNOSTICS:
                self._checks.setdefault(full_name, SequenceCheck())

    def receive(self, full_name: str, data: bytes, source_timestamp_ns: int,
                receive_timestamp_ns: int, sequence: int | None = None) -> bool:
        """
        Take one serialized message; returns False if it had to be dropped.

        Parameters
        ----------
        full_name : str
            Announced topic.
        data : bytes
            CDR bytes as they came from the wire.
        source_timestamp_ns, receive_timestamp_ns : int
            Send and receive time [ns]; a send time of 0 (unknown) becomes the receive time.
        sequence : int, optional
            The publisher's sequence number of this message, counted from 1; 0 or
            None where the middleware has none.

        """
        with self._wake:
            counts = self._counts[full_name]
            counts.received += 1
            check = self._checks.get(full_name)
            if check is not None and sequence:
                check.add(sequence)
                counts.lost = check.lost
                counts.missed_at_start = check.missed_at_start
                counts.publishers = check.publishers
                self._begin_ns = self._begin_ns or receive_timestamp_ns
                if receive_timestamp_ns - self._begin_ns <= BEGIN_NS:
                    counts.sent_before = check.missed_at_start
            if self.write_error or self._closing or len(self._queue) >= self._max_queued:
                counts.dropped += 1
                return False
            sent_ns = source_timestamp_ns or receive_timestamp_ns
            self._queue.append((full_name, data, receive_timestamp_ns, sent_ns))
            self._sent[full_name].add(sent_ns, receive_timestamp_ns)
            if full_name == DIAGNOSTICS:
                for name in self._published.hear(data, sent_ns) & self._sent.keys():
                    self._sent[name].trim(self._published.of(name)[1])
            if len(self._queue) == WAKE_AT:
                self._wake.notify()
            return True

    def receive_all(self, full_name: str,
                    messages: Iterable[tuple[bytes, Mapping[str, Any]]]) -> int:
        """
        Take what arrived on one topic, in order.

        Parameters
        ----------
        full_name : str
            Announced topic.
        messages : iterable of (bytes, dict)
            As rclpy takes them: serialized message; ``source_timestamp``,
            ``received_timestamp`` [ns] and ``publication_sequence_number``.

        Returns
        -------
        int
            How many were taken; the others were dropped and counted.

        """
        receive = self.receive
        with self._wake:            # reentrant: one turn of the lock for all of them
            return sum(
                receive(full_name, data, info['source_timestamp'], info['received_timestamp'],
                        info['publication_sequence_number'])
                for data, info in messages)

    @property
    def counts(self) -> dict[str, TopicCounts]:
        """Return a copy of the counts of every topic, by full name."""
        with self._wake:
            return {name: TopicCounts(**asdict(counts)) for name, counts in self._counts.items()}

    @property
    def queued(self) -> int:
        """Return how many messages wait for the disk."""
        return len(self._queue)

    def add_metadata(self, name: str, values: Mapping[str, object]) -> None:
        """Put a named record of texts into the bag."""
        with self._disk:
            self._writer.add_metadata(name, values)

    def close(self, ending: Ending | None = None) -> RecordingSummary:
        """
        Write what is queued, finish the bag and return the RecordingSummary.

        The ``Ending`` of the run goes into the bag; one that stopped early replaces no other.
        """
        if self._summary is not None:
            return self._summary
        with self._wake:
            self._closing = True
            self._wake.notify()
        self._thread.join()
        self._ended.set()
        self._syncing.join()
        try:
            self._look()
            if self.write_error:
                self._count_what_is_kept()
            self._count_what_never_came()
            if ending is not None and ending.texts():
                if self.write_error:
                    ending = replace(ending, ended=ERROR, because=self.write_error)
                self._writer.add_to_experiment(ending.texts())
            self._writer.add_metadata(RECORDING_RECORD, _as_texts(self.counts, self.write_error))
            if self.write_error or ending is not None and ending.early:
                self._writer.replace_nothing()
            self._writer.close()
        except OSError as error:
            self._fail(error)
            self._count_what_is_kept()
            self._writer.abandon()
        self._summary = RecordingSummary(
            str(self._writer.directory), self.counts, self.write_error)
        return self._summary

    def _look(self) -> None:
        """Fail where somebody removed or moved the bag: the system goes on writing."""
        loss = self._writer.loss
        if loss and not self.write_error:
            self.write_error = f'{self._writer.directory}: {loss}'

    def _fail(self, error: Exception) -> None:
        """Note the first error; the caller has the writer for itself."""
        with contextlib.suppress(OSError):
            self._look()
        if not self.write_error:
            reason = getattr(error, 'strerror', None) or error
            advice = ', free some space or record elsewhere' * (
                getattr(error, 'errno', None) in disk.FULL)
            self.write_error = (f'{self._writer.directory}: writing failed ({reason}); '
                                f'the bag ends early{advice}')

    def _count_what_is_kept(self) -> None:
        """Take back what was half written; only what is in the file counts as written."""
        with contextlib.suppress(OSError):
            self._writer.cut()
        kept = self._writer.counts
        with self._wake:
            for name, counts in self._counts.items():
                counts.written = kept.get(name, 0)
                counts.dropped = counts.received - counts.written

    def _count_what_never_came(self) -> None:
        """Hold what arrived against what the nodes say they have published."""
        with self._wake:
            for name, counts in self._counts.items():
                if name == DIAGNOSTICS:     # many nodes publish there: no sequence numbers
                    counts.missed_at_start = self._published.missed_reports()
                published, sent_ns = self._published.of(name)
                by_then = counts.written if name == DIAGNOSTICS else min(
                    counts.written, self._sent[name].up_to(sent_ns))
                counts.lost = missing_messages(
                    counts.lost, published, by_then,
                    counts.dropped + (counts.missed_at_start or 0))

    def _run(self) -> None:
        flushed = time.monotonic()
        while True:
            with self._wake:
                if len(self._queue) < WAKE_AT and not self._closing:
                    self._wake.wait(min(WRITE_EVERY_S, self._flush_every_s))
                batch, self._queue = self._queue, deque()
                finished = self._closing and not batch
            if finished:
                return
            now = time.monotonic()
            flush = now - flushed >= self._flush_every_s
            if flush:
                flushed = now
            self._write(batch, flush)

    def _sync(self) -> None:
        """
        Bring what was written onto the disk, and look whether it is still there.

        A slow disk must not hold up the writing.
        """
        while not self._ended.wait(self._flush_every_s):
            try:
                with self._disk:
                    self._look()
                    handle = self._writer.handle_to_sync()
                if handle is not None:
                    try:
                        disk.sync(handle)
                    finally:
                        os.close(handle)
            # As in ``_write``: no thread may die silently.
            except Exception as error:
                with self._disk:
                    self._fail(error)

    def _write(self, batch: Batch, flush: bool) -> None:
        written: dict[str, int] = {}
        refused: dict[str, int] = {}
        with self._disk:
            try:
                while batch and not self.write_error:
                    name, data, log_time_ns, publish_time_ns = batch[0]
                    self._writer.write(name, data, log_time_ns, publish_time_ns)
                    written[name] = written.get(name, 0) + 1
                    batch.popleft()
                if flush and not self.write_error:
                    self._writer.flush()
            # Whatever went wrong must reach the summary: a thread dies silently.
            except Exception as error:
                self._fail(error)
        for name, *_ in batch:
            refused[name] = refused.get(name, 0) + 1
        with self._wake:
            for name, number in written.items():
                self._counts[name].written += number
            for name, number in refused.items():
                self._counts[name].dropped += number


def _as_texts(counts: Mapping[str, TopicCounts], write_error: str) -> dict[str, str]:
    """Return the counts as flat texts: ``<topic>.received`` and so on."""
    texts = {
        f'{name}.{key}': 'unknown' if value is None else str(value)
        for name, topic in counts.items() for key, value in asdict(topic).items()}
    return {**texts, 'write_error': write_error} if write_error else texts

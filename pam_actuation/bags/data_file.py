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

"""One data file of a bag while it is written: stream, lock, topics and counts."""

from collections.abc import Callable, Mapping, Sequence
import contextlib
import functools
import os
from pathlib import Path
import tempfile
from typing import Any, BinaryIO

from pam_actuation.bags import disk, layout
from pam_actuation.bags.mcap_write import McapWriter, MessageSeries
from pam_actuation.topics.definitions import schema_text
from pam_sim.annotations import ByteArray, IntArray

LIBRARY = 'pam_actuation'


class DataFile:
    """
    One .mcap file being written; a failed start leaves no file.

    Parameters
    ----------
    path : pathlib.Path
        Must not exist.
    begin : callable
        Gets this object and writes what the file begins with.

    Raises
    ------
    OSError
        The file system refuses.

    """

    def __init__(self, path: Path, begin: 'Callable[[DataFile], object]') -> None:
        self.path = path
        self.count = 0
        self.start_ns: int | None = None
        self._synced = 0
        self.end_ns: int | None = None
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._stream = open(path, 'xb', buffering=0)
        self._closing = contextlib.ExitStack()
        self._closing.enter_context(self._stream)
        try:
            # Held while recording, so that nobody repairs a file that is being written.
            disk.lock(self._stream)
            self.mcap = McapWriter(
                functools.partial(disk.write_all, self._stream), library=LIBRARY,
                index=self._open_index(path.parent))
            begin(self)
        except BaseException:
            self.discard()
            raise

    def discard(self) -> None:
        """Close and remove the file."""
        self._closing.close()
        self.path.unlink(missing_ok=True)

    def _open_index(self, folder: Path) -> BinaryIO | None:
        """Return a file without a name, so that a killed process leaves nothing."""
        try:
            index = tempfile.TemporaryFile(dir=folder, buffering=0)
        except OSError:
            return None             # not on this file system: in memory then
        self._closing.callback(_close_quietly, index)
        return index

    def register(self, name: str, type_name: str, qos: Sequence[dict[str, Any]],
                 type_hash: str) -> None:
        """Announce a topic with its definition."""
        if type_name not in self._schemas:
            self._schemas[type_name] = self.mcap.add_schema(
                type_name, 'ros2msg', schema_text(type_name).encode())
        self._channels[name] = self.mcap.add_channel(
            name, self._schemas[type_name], {
                'offered_qos_profiles': layout.to_yaml(list(qos)),
                'topic_type_hash': type_hash,
            })

    def write(self, name: str, data: bytes, log_time_ns: int, publish_time_ns: int) -> None:
        """Append one message; KeyError for a topic that was not announced."""
        self.mcap.add_message(self._channels[name], log_time_ns, data, publish_time_ns)
        self.count += 1
        if self.start_ns is None or self.end_ns is None:
            self.start_ns = self.end_ns = log_time_ns
        elif log_time_ns > self.end_ns:
            self.end_ns = log_time_ns
        elif log_time_ns < self.start_ns:
            self.start_ns = log_time_ns

    def write_series(self, series: Mapping[str, tuple[IntArray, ByteArray]]) -> None:
        """Append messages by topic, see ``BagWriter.write_series``."""
        self.mcap.add_series([MessageSeries(self._channels[name], time_ns, data)
                              for name, (time_ns, data) in series.items()])
        for time_ns, _ in series.values():
            if time_ns.size:
                self.count += time_ns.size
                ends = [int(time_ns.min()), int(time_ns.max())]
                known = [t for t in (self.start_ns, self.end_ns) if t is not None]
                self.start_ns, self.end_ns = min(ends + known), max(ends + known)

    @property
    def size(self) -> int:
        """Return the bytes written, those of the open chunk included."""
        return self.mcap.offset + self.mcap.pending

    @property
    def facts(self) -> layout.FileFacts:
        """Return what metadata.yaml says of the file."""
        return layout.FileFacts(self.path.name, self.start_ns, self.end_ns, self.count)

    def handle_to_sync(self) -> int | None:
        """Return a file descriptor of its own for ``disk.sync``, None if nothing is new."""
        if self.mcap.offset == self._synced:
            return None
        self._synced = self.mcap.offset
        return os.dup(self._stream.fileno())

    @property
    def removed(self) -> bool:
        """Tell whether somebody deleted the file: what is in it goes when it is closed."""
        return not self._stream.closed and os.fstat(self._stream.fileno()).st_nlink == 0

    @property
    def loss(self) -> str:
        """Return what happened to a file that is not in its place any more, else ''."""
        if self.removed:
            return 'the file was removed while it was recorded, and all in it is lost'
        try:
            os.stat(self.path)
        except (FileNotFoundError, NotADirectoryError):
            return 'the file was moved while it was recorded, and ends early where it is now'
        except OSError:
            pass                    # it may be there, and can be written
        return ''

    def finish(self) -> None:
        """Write the index and close."""
        self.mcap.finish()
        disk.sync(self._stream.fileno())
        self._closing.close()

    def cut(self) -> dict[str, int]:
        """Take back what a failed write left behind; return messages in the file by topic."""
        with contextlib.suppress(OSError):
            self._truncate()
            self.mcap.close_chunk()
        self._truncate()
        in_file = {} if self.removed else self.mcap.counts
        self.count = sum(in_file.values())
        self.start_ns, self.end_ns = self.mcap.span_ns
        return {name: in_file.get(channel, 0) for name, channel in self._channels.items()}

    def _truncate(self) -> None:
        if self._stream.closed:
            return
        self._stream.truncate(self.mcap.offset)
        self._stream.seek(self.mcap.offset)

    def abandon(self) -> None:
        """Close without an index."""
        with contextlib.suppress(OSError):
            self._truncate()
        with contextlib.suppress(OSError):
            self._closing.close()


def _close_quietly(stream: BinaryIO) -> None:
    """Close a file of which nothing is needed any more."""
    with contextlib.suppress(OSError):
        stream.close()

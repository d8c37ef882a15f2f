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
Sort the messages of many chunks into their channels, thousands at a time.

Chunks of a recorder are small, so that little is lost with its power; here
they are gathered until sorting them is worth a few array operations.
"""

from collections.abc import Sequence

import numpy as np
from pam_actuation.bags.payloads import alike, joined, Payloads
from pam_actuation.bags.record_walk import MESSAGE_BYTES, MESSAGE_HEAD, RECORD_BYTES, windows
from pam_sim.annotations import ByteArray, IntArray

BATCH_BYTES = 4 * 1024 * 1024
_KEYS = 2**16


class MessageColumns:
    """
    The messages of one channel in file order: their bytes and their times [ns].

    Of a channel that is not ``kept`` only the number of messages is known.
    """

    def __init__(self, kept: bool = True) -> None:
        self._kept = kept
        self.payloads = Payloads()
        self._log: list[IntArray] = []
        self._publish: list[IntArray] = []

    def __len__(self) -> int:
        """Return the number of messages."""
        return len(self.payloads)

    @property
    def log_time_ns(self) -> IntArray:
        """Return the receive times, ndarray of int64."""
        return joined(self._log)

    @property
    def publish_time_ns(self) -> IntArray:
        """Return the send times, ndarray of int64."""
        return joined(self._publish)

    def append(self, data: ByteArray, positions: IntArray) -> None:
        """Append the message records of ``data`` that begin at ``positions``, shape (n,)."""
        if not self._kept:
            self.payloads.skip(len(positions))
            return
        heads = windows(data, MESSAGE_HEAD.itemsize)[positions].view(MESSAGE_HEAD)
        first = len(self.payloads)
        for length, places in alike(heads['length'].astype(np.int64)):
            whole = len(places) == len(heads)
            self.payloads.append_rows(
                _rows(data, positions[places], length), None if whole else first + places)
        self._log.append(heads['log_time_ns'].astype(np.int64))
        self._publish.append(heads['publish_time_ns'].astype(np.int64))

    def append_raw(self, messages: Sequence[bytes], log_time_ns: Sequence[int]) -> None:
        """Append messages of a storage that tells when they were received, not when sent."""
        self.payloads.extend(Payloads(messages))
        self._log.append(np.array(log_time_ns, dtype=np.int64))
        self._publish.append(self._log[-1])


class MessageBatch:
    """Messages on their way from the chunks to their channels."""

    def __init__(self) -> None:
        self._columns: dict[int, MessageColumns] = {}
        self._known = np.zeros(_KEYS, dtype=bool)
        self._clear()

    def _clear(self) -> None:
        self._data: list[ByteArray] = []
        self._positions: list[IntArray] = []
        self._keys: list[IntArray] = []
        self._size = 0

    def add_channel(self, key: int, kept: bool = True) -> MessageColumns:
        """Accept messages of channel number ``key`` from now on; return its MessageColumns."""
        self._columns[key] = MessageColumns(kept)
        self._known[key] = True
        return self._columns[key]

    def add(self, data: ByteArray, positions: IntArray) -> int:
        """
        Take the message records of ``data`` that begin at ``positions``, shape (n,).

        Returns how many were taken: n, or fewer where one has an unknown channel.
        """
        keys = windows(data, 2)[positions + RECORD_BYTES].view('<u2')
        known = self._known[keys]
        taken = len(keys) if known.all() else int(np.argmin(known))
        if taken:
            self._data.append(data)
            self._positions.append(positions[:taken] + self._size)
            self._keys.append(keys[:taken])
            self._size += len(data)
            if self._size >= BATCH_BYTES:
                self.flush()
        return taken

    def flush(self) -> None:
        """Hand everything taken so far to the channels."""
        if not self._data:
            return
        data, positions, keys = joined(self._data), joined(self._positions), joined(self._keys)
        self._clear()
        for key, places in alike(keys):
            self._columns[key].append(data, positions[places])


def _rows(data: ByteArray, positions: IntArray, record_length: int) -> ByteArray:
    """Return payloads of messages with equally long records, shape (n, size) of uint8."""
    size = RECORD_BYTES + record_length - MESSAGE_BYTES
    if not size:
        return np.zeros((len(positions), 0), dtype=np.uint8)
    return windows(data, size)[positions + MESSAGE_BYTES].view(np.uint8).reshape(-1, size)

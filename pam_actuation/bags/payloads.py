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
Many messages of one topic as bytes, kept in tables: one row of bytes per message.

Messages of a topic nearly always have one length. Rows of equal length lie in
one array, so that millions of messages are neither copied nor decoded one by one.
"""

from collections.abc import Iterator, Sequence
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from pam_sim.annotations import ByteArray, IntArray

Number = TypeVar('Number', np.int64, np.uint8)


class Payloads:
    """
    The bytes of N messages in file order.

    Iterating gives ``bytes`` one by one, for the few topics that are read that
    way; ``tables`` gives all of them at once.

    Parameters
    ----------
    messages : list of bytes
        The first messages.

    """

    def __init__(self, messages: Sequence[bytes] = ()) -> None:
        self._parts: list[tuple[int, IntArray | None, ByteArray]] = []
        self._count = 0
        lengths = np.array([len(raw) for raw in messages], dtype=np.int64)
        for size, places in alike(lengths):
            rows = np.frombuffer(b''.join([messages[i] for i in places]), dtype=np.uint8)
            self.append_rows(rows.reshape(len(places), size), places)

    def append_rows(self, rows: ByteArray, indices: IntArray | None = None) -> None:
        """
        Append messages of equal length.

        Parameters
        ----------
        rows : ndarray of uint8, shape (n, length)
            Kept, not copied.
        indices : ndarray of int64, shape (n,), optional
            Their places among all messages; by default behind those that are there.

        """
        self._parts.append((self._count, indices, rows))
        self._count += len(rows)

    def skip(self, count: int) -> None:
        """Count further messages whose bytes are not kept; they read as empty."""
        self._count += count

    def extend(self, other: 'Payloads') -> None:
        """Append all messages of another Payloads."""
        for first, indices, rows in other._parts:
            moved = None if indices is None else indices + self._count
            self._parts.append((first + self._count, moved, rows))
        self._count += len(other)

    def placed(self, places: IntArray) -> 'Payloads':
        """Return the messages in another order: number i of these at ``places[i]``."""
        moved = Payloads()
        moved._parts = [(0, places[indices], rows) for indices, rows in self.tables()]
        moved._count = self._count
        return moved

    def tables(self) -> Iterator[tuple[IntArray, ByteArray]]:
        """
        Iterate over tables of messages of one length: pairs (indices, rows).

        ``indices``, shape (n,), are the places of the messages in file order and
        ``rows``, shape (n, length) of uint8, their bytes. A table holds some
        thousand messages, so that working on it stays within the cache.
        """
        for first, indices, rows in self._parts:
            yield np.arange(first, first + len(rows)) if indices is None else indices, rows

    def __len__(self) -> int:
        """Return the number of messages."""
        return self._count

    def __iter__(self) -> Iterator[bytes]:
        """Return an iterator over the messages as bytes."""
        messages = [b''] * self._count
        for indices, rows in self.tables():
            size, data = rows.shape[1], rows.tobytes()
            for row, index in enumerate(indices.tolist()):
                messages[index] = data[row * size:(row + 1) * size]
        return iter(messages)

    def __getitem__(self, index: Any) -> Any:
        """Return one message as bytes, or a list of them for a slice; copies all of them."""
        return list(self)[index]

    def __eq__(self, other: object) -> bool:
        """Return whether the messages are those of a list or another Payloads."""
        if not isinstance(other, (Payloads, list)):
            return NotImplemented
        return len(self) == len(other) and all(map(bytes.__eq__, self, other))

    __hash__ = None     # type: ignore[assignment]  # that is how Python says `not hashable`


def alike(numbers: IntArray) -> Iterator[tuple[int, IntArray]]:
    """
    Group equal numbers, such as the lengths of messages.

    Yields (number, places): ``places`` are the indices into ``numbers``, shape
    (n,), where it stands, in order.
    """
    order = np.argsort(numbers, kind='stable')
    for places in np.split(order, np.flatnonzero(np.diff(numbers[order])) + 1):
        if len(places):
            yield int(numbers[places[0]]), places


def joined(parts: list[npt.NDArray[Number]]) -> npt.NDArray[Number]:
    """Return the arrays of a list as one; the list is left with that one alone."""
    if len(parts) > 1:
        parts[:] = [np.concatenate(parts)]
    return parts[0] if parts else np.zeros(0, dtype=np.int64)

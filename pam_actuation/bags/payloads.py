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

import numpy as np


class Payloads:
    """
    The bytes of N messages in file order.

    Iterating gives ``bytes`` one by one, for the few topics that are read that
    way; ``tables`` gives all of them at once.
    """

    def __init__(self, messages=()):
        self._parts = {}
        self._count = 0
        for raw in messages:
            self.append(raw)

    def append(self, raw):
        """Append one message."""
        self.append_rows(np.frombuffer(raw, dtype=np.uint8).reshape(1, len(raw)))

    def append_rows(self, rows, indices=None):
        """
        Append messages of equal length.

        Parameters
        ----------
        rows : ndarray of uint8, shape (n, length)
            Kept, not copied.
        indices : ndarray of int64, shape (n,), optional
            Their places among all messages; by default behind those that are there.

        """
        if indices is None:
            indices = np.arange(self._count, self._count + len(rows))
        self._parts.setdefault(rows.shape[1], []).append((indices, rows))
        self._count += len(rows)

    def extend(self, other):
        """Append all messages of another Payloads."""
        first = self._count
        for length, parts in other._parts.items():
            for indices, rows in parts:
                self._parts.setdefault(length, []).append((indices + first, rows))
        self._count += len(other)

    def tables(self):
        """
        Return one pair (indices, rows) per length of message.

        ``indices``, shape (n,), are the places of the messages in file order and
        ``rows``, shape (n, length) of uint8, their bytes.
        """
        for length, parts in self._parts.items():
            if len(parts) > 1:
                indices, rows = zip(*parts)
                self._parts[length] = [(np.concatenate(indices), np.concatenate(rows))]
        return [parts[0] for parts in self._parts.values()]

    def __len__(self):
        """Return the number of messages."""
        return self._count

    def __iter__(self):
        """Return an iterator over the messages as bytes."""
        messages = [b''] * self._count
        for indices, rows in self.tables():
            size, data = rows.shape[1], rows.tobytes()
            for row, index in enumerate(indices.tolist()):
                messages[index] = data[row * size:(row + 1) * size]
        return iter(messages)

    def __eq__(self, other):
        """Return whether the messages are those of a list or another Payloads."""
        return len(self) == len(other) and all(map(bytes.__eq__, self, other))

    __hash__ = None

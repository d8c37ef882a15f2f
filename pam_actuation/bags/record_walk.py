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
Find the messages among MCAP records, one after the other.

``walk_messages`` is plain Python, and at once there. ``record_walk_compiled`` has the same for
large files, where the compiler is worth its start.
"""

import struct
from typing import Any

import numpy as np
from pam_sim.annotations import ByteArray, IntArray

RECORD_BYTES = 9                       # opcode and length in front of every record
MESSAGE_BYTES = RECORD_BYTES + 22      # and channel, sequence and two times of a message
MESSAGE_OPCODE = 5
# What stands in front of a message's own bytes.
MESSAGE_HEAD = np.dtype([
    ('opcode', 'u1'), ('length', '<u8'), ('channel', '<u2'), ('sequence', '<u4'),
    ('log_time_ns', '<u8'), ('publish_time_ns', '<u8')])
_RECORD = struct.Struct('<BQ')


def walk_messages(data: ByteArray, begin: int, positions: IntArray) -> tuple[int, int]:
    """
    Walk over the message records that follow each other from ``begin`` on.

    Parameters
    ----------
    data : ndarray of uint8, shape (N,)
        Records; any number of them.
    begin : int
        Where the first one begins.
    positions : ndarray of int64, shape (M,)
        Filled with where each message record begins.

    Returns
    -------
    count : int
        Messages found.
    position : int
        Where walking ended: at another record, at a message that does not fit
        into ``data``, at the end, or where ``positions`` is full.

    """
    records, size, room = data.data, len(data), len(positions)
    position = begin
    found: list[int] = []
    while len(found) < room and position + MESSAGE_BYTES <= size:
        opcode, length = _RECORD.unpack_from(records, position)
        if (opcode != MESSAGE_OPCODE or length < MESSAGE_BYTES - RECORD_BYTES
                or length > size - position - RECORD_BYTES):
            break
        found.append(position)
        position += RECORD_BYTES + length
    positions[:len(found)] = found
    return len(found), position


def windows(data: ByteArray, size: int) -> 'np.ndarray[Any, np.dtype[np.void]]':
    """
    Return every run of ``size`` bytes of ``data`` as one item of bytes, without a copy.

    Item ``i`` begins at byte ``i``; indexing with an array of positions gathers.
    """
    count = max(len(data) - size + 1, 0)
    return np.ndarray(count, np.dtype((np.void, size)), data, strides=(1,))

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

"""The walk of ``record_walk`` as one compiled loop, for large files."""

from typing import Any

import numpy as np
from pam_actuation.bags.record_walk import MESSAGE_BYTES, MESSAGE_OPCODE, RECORD_BYTES
from pam_sim.annotations import ByteArray, IntArray
from pam_sim.compiled import entry_point


@entry_point
def walk_many_messages(data: ByteArray, begin: int, positions: IntArray) -> tuple[int, int]:
    """Walk as ``record_walk.walk_messages`` does, with the same arguments and results."""
    position, count = begin, 0
    while (count < len(positions) and position + MESSAGE_BYTES <= len(data)
           and data[position] == MESSAGE_OPCODE):
        length: Any = np.int64(0)
        for i in range(8):
            length |= np.int64(data[position + 1 + i]) << np.int64(8 * i)
        # A length with its highest bit set has become negative.
        if length < MESSAGE_BYTES - RECORD_BYTES or length > len(data) - position - RECORD_BYTES:
            break
        positions[count] = position
        count += 1
        position += RECORD_BYTES + length
    return count, position

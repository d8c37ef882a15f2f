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
Read an MCAP file from front to back, quickly, and also when its end is missing.

The index at the end is not needed: every record is walked over, chunks are
unpacked and checked, and the messages come out as tables of bytes per channel.
Memory is bounded by what the messages take. Format: https://mcap.dev/spec.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
import io
import os
import struct
from typing import BinaryIO
import zlib

import lz4.frame
import numpy as np
from pam_actuation.bags.message_batch import MessageBatch, MessageColumns
from pam_actuation.bags.record_walk import walk_messages
from pam_sim.annotations import ByteArray, IntArray
import zstandard

# Whether to keep the messages of a channel, by topic, message type and encoding.
Wanted = Callable[[str, str, str], bool]
MAGIC = b'\x89MCAP0\r\n'
# No writer makes chunks near this size; a chunk that claims more is damaged.
MAX_CHUNK_BYTES = 2**30
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 1, 2, 3, 4, 5, 6
_METADATA, _DATA_END = 12, 15
_READ_BYTES = 1024 * 1024
_POSITIONS = 2**16
# To start the compiler takes half a second, as long as a million messages take without it.
_FEW_MESSAGES = 500_000
_RECORD = struct.Struct('<BQ')
_CHUNK_HEAD = struct.Struct('<QQQI')
_U16 = struct.Struct('<H')
_U32 = struct.Struct('<I')
_U64 = struct.Struct('<Q')


class Damaged(Exception):
    """The file cannot be read beyond ``offset`` [bytes]."""

    def __init__(self, problem: str, offset: int) -> None:
        self.problem = problem
        self.offset = offset
        super().__init__(f'{problem} at byte {offset}')


@dataclass
class Channel:
    """One channel of the file; ``messages`` are its MessageColumns in file order."""

    topic: str
    type_name: str
    message_encoding: str
    schema_encoding: str
    schema: str
    metadata: dict[str, str]
    messages: MessageColumns


@dataclass
class McapContent:
    """What one file holds; ``damage`` is None or the Damaged that ended reading early."""

    profile: str = ''
    library: str = ''
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    finished: bool = False
    damage: Damaged | None = None

    @property
    def message_count(self) -> int:
        """Return the number of messages that were read."""
        return sum(len(channel.messages) for channel in self.channels.values())


def scan(stream: BinaryIO | bytes | bytearray | memoryview,
         wanted: Wanted | None = None) -> McapContent:
    """
    Return the McapContent of a file.

    Never raises for a damaged or truncated file: what precedes the damage is
    returned with ``damage`` set. ``finished`` tells whether the end was written.

    Parameters
    ----------
    stream : binary file or bytes
        Open for reading, seekable; or the bytes of the file themselves.
    wanted : callable, optional
        Called with topic, message type and encoding of every channel: whether to keep its
        messages, or to count them only.

    """
    if isinstance(stream, (bytes, bytearray, memoryview)):
        stream = io.BytesIO(stream)
    content = McapContent()
    begin = _read(stream, 0, len(MAGIC))
    if begin != MAGIC:
        content.damage = Damaged(
            'the file ends inside its first bytes' if MAGIC.startswith(begin)
            else 'not an MCAP file', 0)
        return content
    scanner = _Scanner(content, stream, wanted)
    try:
        scanner.walk()
    except Damaged as damage:
        content.damage = damage
    scanner.batch.flush()
    return content


def _read(stream: BinaryIO, position: int, size: int) -> bytes:
    stream.seek(position)
    return stream.read(size)


class _Scanner:

    # Messages walked over without the compiler, in all files of this process.
    walked = 0

    def __init__(self, content: McapContent, stream: BinaryIO, wanted: Wanted | None) -> None:
        self._positions = np.empty(_POSITIONS, dtype=np.int64)
        self._unpack_zstd = zstandard.ZstdDecompressor().decompress
        self.content = content
        self.stream = stream
        self.wanted = wanted
        self.size = stream.seek(0, os.SEEK_END)
        self.batch = MessageBatch()
        self.schemas = {0: ('', '', '')}
        self.where = 0

    def walk(self) -> None:
        """Walk over the records of the file's data section."""
        position = len(MAGIC)
        while position < self.size:
            self.where = position
            head = _read(self.stream, position, _RECORD.size)
            if len(head) < _RECORD.size:
                raise Damaged('the file ends inside a record', position)
            opcode, length = _RECORD.unpack(head)
            end = position + _RECORD.size + length
            if end > self.size:
                raise Damaged('the file ends inside a record', position)
            if opcode in (_DATA_END, _FOOTER):
                self._check_end(position)
                return
            if opcode == _MESSAGE:
                position = self._loose_messages(position, length)
                continue
            if opcode in (_CHUNK, _SCHEMA, _CHANNEL, _METADATA, _HEADER):
                self._understood(opcode, self.stream.read(length))
            position = end
        raise Damaged('the end mark is missing', position)

    def _check_end(self, position: int) -> None:
        self.content.finished = (
            self.size >= position + len(MAGIC)
            and _read(self.stream, self.size - len(MAGIC), len(MAGIC)) == MAGIC)
        if not self.content.finished:
            raise Damaged('the end mark is missing', position)

    def _understood(self, opcode: int, data: bytes) -> None:
        try:
            self._record(opcode, data)
        except (struct.error, UnicodeDecodeError, IndexError) as error:
            raise Damaged(f'a record makes no sense ({error})', self.where) from None

    def _record(self, opcode: int, data: bytes) -> None:
        if opcode == _CHUNK:
            self._chunk_records(self._unpacked(data))
        elif opcode == _SCHEMA:
            self._schema(data)
        elif opcode == _CHANNEL:
            self._channel(data)
        elif opcode == _METADATA:
            name, begin = _text(data, 0)
            self.content.metadata.append((name, _texts(data, begin)[0]))
        else:
            self.content.profile, begin = _text(data, 0)
            self.content.library = _text(data, begin)[0]

    def _unpacked(self, data: bytes) -> bytes | memoryview:
        _, _, size, crc = _CHUNK_HEAD.unpack_from(data)
        compression, begin = _text(data, _CHUNK_HEAD.size)
        length = _U64.unpack_from(data, begin)[0]
        begin += _U64.size
        if begin + length > len(data):
            raise Damaged('a chunk is longer than its record', self.where)
        if size > MAX_CHUNK_BYTES:
            raise Damaged(f'a chunk claims {size} bytes', self.where)
        packed = memoryview(data)[begin:begin + length]
        try:
            records = self._decompressed(compression, packed, size)
        except (zstandard.ZstdError, RuntimeError, MemoryError) as error:
            raise Damaged(f'a chunk cannot be unpacked ({error})', self.where) from None
        if len(records) != size or (crc and zlib.crc32(records) != crc):
            raise Damaged('a chunk fails its checksum', self.where)
        return records

    def _decompressed(self, compression: str, packed: memoryview, size: int) -> bytes | memoryview:
        if compression == 'zstd':
            if zstandard.frame_content_size(packed) > size:
                raise Damaged('a chunk fails its checksum', self.where)
            return self._unpack_zstd(packed, max_output_size=size)
        if compression == 'lz4':
            # One byte more than announced shows a chunk that is too long.
            return lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1)
        if compression == '':
            return packed
        raise Damaged(f'unknown compression {compression!r}', self.where)

    def _chunk_records(self, data: bytes | memoryview) -> None:
        view = np.frombuffer(data, dtype=np.uint8)
        position, size = 0, len(data)
        while position < size:
            position = self._messages(view, position)
            if position + _RECORD.size > size:
                break
            opcode, length = _RECORD.unpack_from(data, position)
            begin, end = position + _RECORD.size, position + _RECORD.size + length
            if end > size or opcode == _MESSAGE:
                raise Damaged('a record is longer than its chunk', self.where)
            if opcode in (_SCHEMA, _CHANNEL):
                self._record(opcode, bytes(data[begin:end]))
            position = end

    def _messages(self, view: ByteArray, position: int) -> int:
        """Take the messages that follow each other; return where anything else begins."""
        while True:
            count, end = self._walk(view, position, self._positions)
            if not count:
                return position
            records = view[position:end]
            if self.batch.add(records, self._positions[:count] - position) < count:
                raise Damaged('a message of an unknown channel', self.where)
            position = int(end)

    def _walk(self, view: ByteArray, begin: int, positions: IntArray) -> tuple[int, int]:
        """Return ``walk_messages`` of the arguments; with the compiler once they are many."""
        if _Scanner.walked >= _FEW_MESSAGES:
            from pam_actuation.bags.record_walk_compiled import walk_many_messages
            return walk_many_messages(view, begin, positions)
        count, end = walk_messages(view, begin, positions)
        _Scanner.walked += count
        return count, end

    def _loose_messages(self, position: int, length: int) -> int:
        """Take messages outside of chunks, a block of the file at a time."""
        block = _read(self.stream, position, max(_READ_BYTES, _RECORD.size + length))
        taken = self._messages(np.frombuffer(block, dtype=np.uint8), 0)
        if not taken:
            raise Damaged('a message is shorter than its head', position)
        return position + taken

    def _schema(self, data: bytes) -> None:
        key = _U16.unpack_from(data)[0]
        name, begin = _text(data, 2)
        encoding, begin = _text(data, begin)
        self.schemas[key] = (name, encoding, _text(data, begin)[0])

    def _channel(self, data: bytes) -> None:
        key, schema = _U16.unpack_from(data)[0], _U16.unpack_from(data, 2)[0]
        topic, begin = _text(data, 4)
        encoding, begin = _text(data, begin)
        if key in self.content.channels:
            return
        if schema not in self.schemas:
            raise Damaged(f'the topic {topic} has no message definition', self.where)
        name, schema_encoding, text = self.schemas[schema]
        metadata = _texts(data, begin)[0]
        self.content.channels[key] = Channel(
            topic, name, encoding, schema_encoding, text, metadata,
            self.batch.add_channel(
                key, self.wanted is None or self.wanted(topic, name, encoding)))


def _text(data: bytes, begin: int) -> tuple[str, int]:
    """Return (text, position behind it) of a length-prefixed string."""
    begin, end = begin + 4, begin + 4 + _U32.unpack_from(data, begin)[0]
    if end > len(data):
        raise IndexError('a text is longer than its record')
    return data[begin:end].decode(), end


def _texts(data: bytes, begin: int) -> tuple[dict[str, str], int]:
    """Return (dict, position behind it) of a length-prefixed map of strings."""
    begin, end = begin + 4, begin + 4 + _U32.unpack_from(data, begin)[0]
    if end > len(data):
        raise IndexError('a map is longer than its record')
    texts = {}
    while begin < end:
        key, begin = _text(data, begin)
        texts[key], begin = _text(data, begin)
    return texts, end

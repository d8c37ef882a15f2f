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
unpacked and checked, and the messages come out as bytes per topic. Format:
https://mcap.dev/spec.
"""

from dataclasses import dataclass, field
import struct
import zlib

import lz4.frame
import zstandard

MAGIC = b'\x89MCAP0\r\n'
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 1, 2, 3, 4, 5, 6
_METADATA, _DATA_END = 12, 15
_RECORD = struct.Struct('<BQ')
_MESSAGE_HEAD = struct.Struct('<HIQQ')
_RECORD_AND_MESSAGE = struct.Struct('<BQHIQQ')
_CHUNK_HEAD = struct.Struct('<QQQI')
_U16 = struct.Struct('<H')
_U32 = struct.Struct('<I')
_U64 = struct.Struct('<Q')


class Damaged(Exception):
    """The file cannot be read beyond ``offset`` [bytes]."""

    def __init__(self, problem, offset):
        self.problem = problem
        self.offset = offset
        super().__init__(f'{problem} at byte {offset}')


@dataclass
class Channel:
    """One channel of the file and its messages in file order."""

    topic: str
    type_name: str
    message_encoding: str
    schema_encoding: str
    schema: str
    metadata: dict
    payloads: list = field(default_factory=list)
    log_time_ns: list = field(default_factory=list)
    publish_time_ns: list = field(default_factory=list)


@dataclass
class McapContent:
    """What one file holds; ``damage`` is None or the Damaged that ended reading early."""

    profile: str = ''
    library: str = ''
    channels: dict = field(default_factory=dict)
    metadata: list = field(default_factory=list)
    finished: bool = False
    damage: Damaged = None

    @property
    def message_count(self):
        """Return the number of messages that were read."""
        return sum(len(channel.payloads) for channel in self.channels.values())


def scan(data):
    """
    Return the McapContent of a file's bytes.

    Never raises for a damaged or truncated file: what precedes the damage is
    returned with ``damage`` set. ``finished`` tells whether the end was written.
    """
    content = McapContent()
    if not data.startswith(MAGIC):
        begun = MAGIC.startswith(data)
        content.damage = Damaged(
            'the file ends inside its first bytes' if begun else 'not an MCAP file', 0)
        return content
    scanner = _Scanner(content)
    try:
        scanner.walk(data)
    except Damaged as damage:
        content.damage = damage
    return content


class _Scanner:

    def __init__(self, content):
        self.content = content
        self.schemas = {0: ('', '', '')}
        self.where = 0

    def walk(self, data):
        """Walk over the records of the file's data section."""
        position, size = len(MAGIC), len(data)
        while position < size:
            self.where = position
            if position + _RECORD.size > size:
                raise Damaged('the file ends inside a record', position)
            opcode, length = _RECORD.unpack_from(data, position)
            begin, end = position + _RECORD.size, position + _RECORD.size + length
            if end > size:
                raise Damaged('the file ends inside a record', position)
            if opcode in (_DATA_END, _FOOTER):
                self.content.finished = data.endswith(MAGIC) and size > len(MAGIC)
                if not self.content.finished:
                    raise Damaged('the end mark is missing', position)
                return
            try:
                self._record(opcode, data, begin, end)
            except (struct.error, UnicodeDecodeError, IndexError) as error:
                raise Damaged(f'a record makes no sense ({error})', position) from None
            position = end
        raise Damaged('the end mark is missing', position)

    def _record(self, opcode, data, begin, end):
        if opcode == _CHUNK:
            self._chunk_records(self._unpacked(data, begin, end))
        elif opcode == _MESSAGE:
            self._message(data, begin, end)
        elif opcode == _SCHEMA:
            self._schema(data, begin)
        elif opcode == _CHANNEL:
            self._channel(data, begin)
        elif opcode == _METADATA:
            name, begin = _text(data, begin)
            self.content.metadata.append((name, _texts(data, begin)[0]))
        elif opcode == _HEADER:
            self.content.profile, begin = _text(data, begin)
            self.content.library = _text(data, begin)[0]

    def _unpacked(self, data, begin, end):
        _, _, size, crc = _CHUNK_HEAD.unpack_from(data, begin)
        compression, begin = _text(data, begin + _CHUNK_HEAD.size)
        length = _U64.unpack_from(data, begin)[0]
        begin += 8
        if begin + length > end:
            raise Damaged('a chunk is longer than its record', self.where)
        packed = data[begin:begin + length]
        try:
            if compression == 'zstd':
                records = zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
            elif compression == 'lz4':
                records = lz4.frame.decompress(packed)
            elif compression == '':
                records = packed
            else:
                raise Damaged(f'unknown compression {compression!r}', self.where)
        except (zstandard.ZstdError, RuntimeError, MemoryError) as error:
            raise Damaged(f'a chunk cannot be unpacked ({error})', self.where) from None
        if len(records) != size or (crc and zlib.crc32(records) != crc):
            raise Damaged('a chunk fails its checksum', self.where)
        return records

    def _chunk_records(self, data):
        position, size = 0, len(data)
        channels = self.content.channels
        head, whole = _RECORD_AND_MESSAGE, _RECORD_AND_MESSAGE.size
        while position < size:
            opcode = data[position]
            if opcode == _MESSAGE:
                _, length, key, _, log_ns, publish_ns = head.unpack_from(data, position)
                begin, position = position + whole, position + _RECORD.size + length
                channel = channels.get(key)
                if channel is None or position > size:
                    raise Damaged('a message of an unknown channel', self.where)
                channel.payloads.append(data[begin:position])
                channel.log_time_ns.append(log_ns)
                channel.publish_time_ns.append(publish_ns)
            else:
                opcode, length = _RECORD.unpack_from(data, position)
                begin, position = position + _RECORD.size, position + _RECORD.size + length
                if opcode in (_SCHEMA, _CHANNEL):
                    self._record(opcode, data, begin, position)

    def _message(self, data, begin, end):
        key, _, log_ns, publish_ns = _MESSAGE_HEAD.unpack_from(data, begin)
        channel = self.content.channels.get(key)
        if channel is None:
            raise Damaged('a message of an unknown channel', self.where)
        channel.payloads.append(data[begin + _MESSAGE_HEAD.size:end])
        channel.log_time_ns.append(log_ns)
        channel.publish_time_ns.append(publish_ns)

    def _schema(self, data, begin):
        key = _U16.unpack_from(data, begin)[0]
        name, begin = _text(data, begin + 2)
        encoding, begin = _text(data, begin)
        self.schemas[key] = (name, encoding, _text(data, begin)[0])

    def _channel(self, data, begin):
        key, schema = _U16.unpack_from(data, begin)[0], _U16.unpack_from(data, begin + 2)[0]
        topic, begin = _text(data, begin + 4)
        encoding, begin = _text(data, begin)
        if key in self.content.channels:
            return
        if schema not in self.schemas:
            raise Damaged(f'the topic {topic} has no message definition', self.where)
        name, schema_encoding, text = self.schemas[schema]
        self.content.channels[key] = Channel(
            topic, name, encoding, schema_encoding, text, _texts(data, begin)[0])


def _text(data, begin):
    """Return (text, position behind it) of a length-prefixed string."""
    begin, end = begin + 4, begin + 4 + _U32.unpack_from(data, begin)[0]
    if end > len(data):
        raise IndexError('a text is longer than its record')
    return data[begin:end].decode(), end


def _texts(data, begin):
    """Return (dict, position behind it) of a length-prefixed map of strings."""
    begin, end = begin + 4, begin + 4 + _U32.unpack_from(data, begin)[0]
    if end > len(data):
        raise IndexError('a map is longer than its record')
    texts = {}
    while begin < end:
        key, begin = _text(data, begin)
        texts[key], begin = _text(data, begin)
    return texts, end

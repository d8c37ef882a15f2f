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

"""Walk over a damaged MCAP file and yield every record that is whole."""

from collections.abc import Iterator
import mmap
import struct
import zlib

import lz4.frame
from mcap.opcode import Opcode
from pam_actuation.bags.mcap_write import CHUNK_HEAD, MAGIC, RECORD
import zstandard

_TEXT = struct.Struct('<I')
_LENGTH = struct.Struct('<Q')
_FOOTER = struct.Struct('<QQI')
_MESSAGE_HEAD = struct.Struct('<HIQQ')
# No recorder makes chunks near this size; a damaged length must not fill the memory.
LARGEST_CHUNK_BYTES = 2**30
_BLOCK_BYTES = 2**20          # looked at in one piece
# Opcode, content, and the unpacked records of a chunk.
Found = tuple[int, bytes, bytes | None]
_TAKEN = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.METADATA, Opcode.ATTACHMENT)
# Opcodes from here on are those of applications; no MCAP reader knows what they hold.
PRIVATE_OPCODE = 0x80


class Walk:
    """
    Iterate over (opcode, content, unpacked records of a chunk or None).

    Attributes
    ----------
    bytes : int
        Bytes that could not be read.
    inside : bool
        Whether some of them are more than a last record that was not written to its end.
    finished : bool
        Whether the end of the data was marked.

    """

    def __init__(self, data: bytes | mmap.mmap) -> None:
        self._data = data
        self._channels: set[int] = set()
        self._schemas = {0}
        self._summary_taken = False
        self.bytes = 0
        self.inside = False
        self.finished = False

    def __iter__(self) -> Iterator[Found]:
        """Yield the whole records in file order."""
        data, size = self._data, len(self._data)
        position = len(MAGIC) if size >= len(MAGIC) else size
        while position < size:
            if position + RECORD.size > size:
                self.bytes += size - position
                return
            opcode, length = RECORD.unpack_from(data, position)
            begin, end = position + RECORD.size, position + RECORD.size + length
            if opcode in (Opcode.DATA_END, Opcode.FOOTER):
                self.finished = data[size - len(MAGIC):size] == MAGIC
                return
            if end > size or not (1 <= opcode <= 15 or opcode >= PRIVATE_OPCODE):
                self._lost_from(position)
                return
            if opcode == Opcode.CHUNK:
                yield from self._chunk(data[begin:end], end == size)
            elif opcode in _TAKEN or opcode >= PRIVATE_OPCODE:
                yield from self._single(opcode, data[begin:end])
            position = end

    def _lost_from(self, position: int) -> None:
        """
        Count the rest: damage, or only the end that was not written.

        An unknown opcode means damage unless only zeros follow it. So does a record that is too
        long in a file that has its end mark.
        """
        size = len(self._data)
        self.bytes += size - position
        torn = self._data[size - len(MAGIC):size] != MAGIC and RECORD.unpack_from(
            self._data, position)[0] in (
                Opcode.CHUNK, Opcode.MESSAGE_INDEX, Opcode.METADATA, Opcode.HEADER)
        self.inside = self.inside or (not torn and any(
            self._data[begin:begin + _BLOCK_BYTES].strip(b'\0')
            for begin in range(position, size, _BLOCK_BYTES)))

    def _chunk(self, content: bytes, is_last: bool) -> Iterator[Found]:
        records = unpack(content)
        if records is None or not self._known(records):
            self.bytes += len(content)
            self.inside = self.inside or not is_last
            yield from self._defined_at_end()
            return
        yield Opcode.CHUNK, content, records

    def _defined_at_end(self) -> Iterator[Found]:
        """Yield, once, the definitions that the summary has and that are not known so far."""
        if not self._summary_taken:
            self._summary_taken = True
            for opcode, content in summary_definitions(self._data):
                known = self._schemas if opcode == Opcode.SCHEMA else self._channels
                if _number_of(content) not in known and _fits(
                        opcode, content, 0, self._channels, self._schemas):
                    yield opcode, content, None

    def _known(self, records: bytes) -> bool:
        """Tell whether all records of a chunk fit together with what came before."""
        channels, schemas = set(self._channels), set(self._schemas)
        position, size = 0, len(records)
        try:
            while position < size:
                opcode, length = RECORD.unpack_from(records, position)
                begin, position = position + RECORD.size, position + RECORD.size + length
                if position > size or not _fits(opcode, records, begin, channels, schemas):
                    return False
        except struct.error:
            return False
        self._channels, self._schemas = channels, schemas
        return True

    def _single(self, opcode: int, content: bytes) -> Iterator[Found]:
        try:
            if _fits(opcode, content, 0, self._channels, self._schemas):
                yield opcode, content, None
                return
        except struct.error:
            pass
        self.lose(content)

    def lose(self, content: bytes) -> None:
        """Count a record inside the file that cannot be taken over."""
        self.bytes += len(content)
        self.inside = True


def _fits(opcode: int, data: bytes, begin: int, channels: set[int], schemas: set[int]) -> bool:
    """Tell whether a record's numbers are known; remember those it announces."""
    if opcode == Opcode.MESSAGE:
        return _MESSAGE_HEAD.unpack_from(data, begin)[0] in channels
    if opcode == Opcode.SCHEMA:
        schemas.add(_number_of(data, begin))
    elif opcode == Opcode.CHANNEL:
        channels.add(_number_of(data, begin))
        return _number_of(data, begin + 2) in schemas
    return True


def _number_of(data: bytes, begin: int = 0) -> int:
    return int.from_bytes(data[begin:begin + 2], 'little')


def summary_definitions(data: bytes | mmap.mmap) -> list[tuple[int, bytes]]:
    """
    Return (opcode, content) of the schemas, then of the channels, that the end of a file repeats.

    Empty for a file whose end is missing, whose summary has none, or fails its checksum.
    """
    footer = len(data) - len(MAGIC) - _FOOTER.size - RECORD.size
    if footer < len(MAGIC) or data[len(data) - len(MAGIC):] != MAGIC or (
            RECORD.unpack_from(data, footer) != (Opcode.FOOTER, _FOOTER.size)):
        return []
    start, _, crc = _FOOTER.unpack_from(data, footer + RECORD.size)
    if not len(MAGIC) <= start <= footer:
        return []
    # The checksum is of all but itself, the last number of the footer.
    summary = data[start:footer + RECORD.size + _FOOTER.size - _TEXT.size]
    if crc and zlib.crc32(summary) != crc:
        return []
    found, position, size = [], 0, footer - start
    while position + RECORD.size <= size:
        opcode, length = RECORD.unpack_from(summary, position)
        begin, position = position + RECORD.size, position + RECORD.size + length
        if position > size:
            break
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            found.append((opcode, summary[begin:position]))
    return sorted(found, key=lambda one: one[0])


def unpack(content: bytes) -> bytes | None:
    """Return the records of a chunk; None if it is not whole."""
    try:
        _, _, size, crc = CHUNK_HEAD.unpack_from(content)
        begin = CHUNK_HEAD.size + _TEXT.size
        compression = content[begin:begin + _TEXT.unpack_from(content, CHUNK_HEAD.size)[0]]
        begin += len(compression)
        length = _LENGTH.unpack_from(content, begin)[0]
        packed = content[begin + _LENGTH.size:]
        if length != len(packed) or size > LARGEST_CHUNK_BYTES:
            return None
        if compression == b'zstd':
            records: bytes | None = zstandard.ZstdDecompressor().decompress(
                packed, max_output_size=size)
        elif compression == b'lz4':
            records = lz4.frame.decompress(packed)
        else:
            records = packed if compression == b'' else None
    except (struct.error, zstandard.ZstdError, RuntimeError, MemoryError):
        return None
    if records is None or len(records) != size or (crc and zlib.crc32(records) != crc):
        return None
    return records


def message(content: bytes) -> tuple[int, int, bytes, int, int]:
    """Return channel, log time [ns], data, publish time [ns] and sequence of a message."""
    channel, sequence, log_time_ns, publish_time_ns = _MESSAGE_HEAD.unpack_from(content)
    return channel, log_time_ns, content[_MESSAGE_HEAD.size:], publish_time_ns, sequence


def header(data: bytes | mmap.mmap) -> tuple[str, str]:
    """Return (profile, library) of a file's first record, ('', '') if it cannot be read."""
    try:
        opcode, _ = RECORD.unpack_from(data, len(MAGIC))
        if opcode != Opcode.HEADER:
            return '', ''
        texts, position = [], len(MAGIC) + RECORD.size
        for _ in range(2):
            length = _TEXT.unpack_from(data, position)[0]
            text = data[position + _TEXT.size:position + _TEXT.size + length]
            if len(text) < length:
                return '', ''
            texts.append(text.decode())
            position += _TEXT.size + length
        profile, library = texts
        return profile, library
    except (struct.error, UnicodeDecodeError):
        return '', ''

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
Write MCAP so that every moment leaves a readable file: chunks closed on demand.

Records come from the ``mcap`` package. Its own writer closes a chunk only by size, packs every
message field by field and cannot copy chunks of another file. A recorder must end a chunk by the
clock and needs a few microseconds per message. Recovery copies chunks as they are. Format:
https://mcap.dev/spec.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
import io
import struct
from typing import Any, BinaryIO, NamedTuple
import zlib

from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment, AttachmentIndex, Channel, ChunkIndex, DataEnd, Footer, Header, Metadata,
    MetadataIndex, Schema, Statistics, SummaryOffset)
import numpy as np
from pam_actuation.bags import disk
from pam_sim.annotations import ByteArray, IntArray
import zstandard

MAGIC = b'\x89MCAP0\r\n'
CHUNK_BYTES = 128 * 1024           # of unpacked records: what one damaged place may cost
RECORD = struct.Struct('<BQ')
MESSAGE = struct.Struct('<BQHIQQ')
MESSAGE_OVERHEAD = MESSAGE.size - RECORD.size
_MESSAGE_FIELDS = np.dtype([
    ('opcode', 'u1'), ('length', '<u8'), ('channel', '<u2'), ('sequence', '<u4'),
    ('log_time_ns', '<u8'), ('publish_time_ns', '<u8')])
CHUNK_HEAD = struct.Struct('<QQQI')
_TEXT_LENGTH = struct.Struct('<I')
_DATA_LENGTH = struct.Struct('<Q')
_INDEX_HEAD = struct.Struct('<BQHI')
_CONTENT_CRC = struct.Struct('<BQQQ')


class MessageSeries(NamedTuple):
    """
    Messages of equal length of one channel: times [ns], shape (N,), and bytes, shape (N, B).

    They were received when they were sent.
    """

    channel: int
    time_ns: IntArray
    data: ByteArray

    def records(self) -> ByteArray:
        """Return the records of the messages, one a row."""
        count, size = self.data.shape
        heads = np.zeros(count, _MESSAGE_FIELDS)
        heads['opcode'], heads['length'] = Opcode.MESSAGE, MESSAGE_OVERHEAD + size
        heads['channel'] = self.channel
        heads['log_time_ns'] = heads['publish_time_ns'] = self.time_ns
        return np.hstack([heads.view(np.uint8).reshape(count, MESSAGE.size), self.data])


class McapWriter:
    """
    One file being written.

    A chunk of ``CHUNK_BYTES`` is closed; ``close_chunk`` closes it earlier.

    Parameters
    ----------
    write : callable
        Takes bytes and writes all of them, or raises OSError.
    profile, library : str
        Content of the header.
    index : binary file, optional
        Empty, seekable: keeps the index of the chunks (about 200 bytes each) until ``finish``,
        so that hours of recording need no memory. In memory by default.

    Attributes
    ----------
    offset : int
        Bytes written so far.
    pending : int
        Bytes of records in the open chunk.

    """

    def __init__(self, write: Callable[[bytes], object], profile: str = 'ros2', library: str = '',
                 index: BinaryIO | None = None) -> None:
        self._write_all = write
        self._compressor = zstandard.ZstdCompressor()
        self.offset = 0
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._counts: dict[int, int] = {}
        self._chunk_index: BinaryIO = io.BytesIO() if index is None else index
        self._chunk_index_bytes = self._chunk_count = 0
        self._metadata: list[MetadataIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._start_ns: int | None = None
        self._end_ns: int | None = None
        self._begin_chunk()
        self._write(MAGIC + _bytes(Header(profile=profile, library=library)))

    def _write(self, data: bytes) -> None:
        self._write_all(data)
        self.offset += len(data)

    def _begin_chunk(self) -> None:
        self._parts: list[bytes] = []
        self.pending = 0
        self._index: dict[int, list[int]] = {}

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Announce a message definition (bytes); returns its number."""
        schema = Schema(
            id=len(self._schemas) + 1, data=data, encoding=encoding, name=name)
        self._schemas[schema.id] = schema
        self._append(_bytes(schema))
        return schema.id

    def add_channel(self, topic: str, schema: int, metadata: dict[str, str]) -> int:
        """Announce a topic with the number of its definition; returns its number."""
        channel = Channel(
            id=len(self._channels) + 1, topic=topic, message_encoding='cdr',
            schema_id=schema, metadata=metadata)
        self._channels[channel.id] = channel
        self._append(_bytes(channel))
        return channel.id

    def _append(self, record: bytes) -> None:
        self._parts.append(record)
        self.pending += len(record)

    def add_message(self, channel: int, log_time_ns: int, data: bytes, publish_time_ns: int,
                    sequence: int = 0) -> None:
        """Append one message to the open chunk."""
        size = len(data)
        self._parts += (
            MESSAGE.pack(5, MESSAGE_OVERHEAD + size, channel, sequence, log_time_ns,
                         publish_time_ns), data)
        index = self._index.get(channel)
        if index is None:
            index = self._index[channel] = []
        index += (log_time_ns, self.pending)
        self.pending += MESSAGE.size + size
        if self.pending >= CHUNK_BYTES:
            self.close_chunk()

    def add_series(self, series: Sequence[MessageSeries]) -> None:
        """
        Append many messages in the order of their times, and of the series where these are equal.

        The file is the same as after ``add_message`` for each of them. This works on arrays.
        """
        if not series:
            return
        records = [one.records() for one in series]
        which = np.repeat(np.arange(len(series)), [len(one) for one in records])
        row = np.concatenate([np.arange(len(one)) for one in records])
        time_ns = np.concatenate([one.time_ns for one in series])
        order = np.lexsort((which, time_ns))
        which, row, time_ns = which[order], row[order], time_ns[order]
        ends = np.cumsum(np.array([one.shape[1] for one in records])[which])
        first, done = 0, 0
        while first < which.size:
            full = done + CHUNK_BYTES - self.pending
            last = min(int(np.searchsorted(ends, full)) + 1, which.size)
            size = int(ends[last - 1]) - done
            part, times = np.empty(size, np.uint8), time_ns[first:last]
            for place in dict.fromkeys(which[first:last].tolist()):
                own, record = which[first:last] == place, records[place]
                begin = ends[first:last][own] - record.shape[1] - done
                part[begin[:, np.newaxis] + np.arange(record.shape[1])] = record[
                    row[first:last][own]]
                self._index.setdefault(series[place].channel, []).extend(np.column_stack(
                    [times[own], begin + self.pending]).ravel().tolist())
            self._append(part.tobytes())
            if self.pending >= CHUNK_BYTES:
                self.close_chunk()
            first, done = last, done + size

    def add_metadata(self, name: str, texts: dict[str, str]) -> None:
        """Append a named record of texts, after the chunk before it."""
        self.close_chunk()
        record = _bytes(Metadata(name=name, metadata=texts))
        self._metadata.append(MetadataIndex(offset=self.offset, length=len(record), name=name))
        self._write(record)

    def close_chunk(self) -> None:
        """Write the open chunk, with checksum and message index, in one piece."""
        if not self._parts:
            return
        records = b''.join(self._parts)
        index = self._index
        self._begin_chunk()
        times = [time for entries in index.values() for time in entries[::2]]
        packed = self._compressor.compress(records)
        compression = b'zstd'
        content = b''.join((
            CHUNK_HEAD.pack(
                min(times, default=0), max(times, default=0), len(records),
                zlib.crc32(records)),
            _TEXT_LENGTH.pack(len(compression)), compression,
            _DATA_LENGTH.pack(len(packed)), packed))
        self._write_chunk(content, index)

    def copy_chunk(self, content: bytes, records: bytes) -> None:
        """
        Append a chunk of another file as it is.

        Parameters
        ----------
        content : bytes
            The chunk record without opcode and length.
        records : bytes
            The same, unpacked; its schemas and channels keep their numbers.

        """
        self.close_chunk()
        index: dict[int, list[int]] = {}
        position = 0
        while position < len(records):
            opcode, length = RECORD.unpack_from(records, position)
            begin = position + RECORD.size
            if opcode == Opcode.MESSAGE:
                _, _, channel, _, log_time_ns, _ = MESSAGE.unpack_from(records, position)
                index.setdefault(channel, []).extend((log_time_ns, position))
            else:
                self.note(opcode, records[begin:begin + length])
            position = begin + length
        self._write_chunk(content, index)

    def note(self, opcode: int, content: bytes) -> bool:
        """Remember a schema or channel of a copied part; return whether it can be read."""
        stream = ReadDataStream(io.BytesIO(content))
        try:
            if opcode == Opcode.SCHEMA:
                schema = Schema.read(stream)
                self._schemas.setdefault(schema.id, schema)
            elif opcode == Opcode.CHANNEL:
                channel = Channel.read(stream)
                self._channels.setdefault(channel.id, channel)
        except (McapError, ValueError, struct.error):
            return False
        return True

    def copy_record(self, opcode: int, content: bytes) -> bool:
        """Append a schema or channel of another file; return False for one that is damaged."""
        readable = self.note(opcode, content)
        if readable:
            self._append(RECORD.pack(opcode, len(content)) + content)
        return readable

    def copy_attachment(self, content: bytes) -> bool:
        """Append an attachment of another file; return False for one that is damaged."""
        stream = ReadDataStream(io.BytesIO(content))
        try:
            attachment = Attachment.read(stream)
        except (McapError, ValueError, OverflowError, struct.error):
            return False
        crc = int.from_bytes(content[-4:], 'little')
        if stream.count != len(content) or crc and zlib.crc32(content[:-4]) != crc:
            return False
        offset = self.copy_private(Opcode.ATTACHMENT, content)
        self._attachments.append(AttachmentIndex(
            offset=offset, length=self.offset - offset, log_time=attachment.log_time,
            create_time=attachment.create_time, data_size=len(attachment.data),
            name=attachment.name, media_type=attachment.media_type))
        return True

    def copy_private(self, opcode: int, content: bytes) -> int:
        """Append a record of another file that only its writer knows; return its offset."""
        self.close_chunk()
        offset = self.offset
        self._write(RECORD.pack(opcode, len(content)) + content)
        return offset

    def _write_chunk(self, content: bytes, index: Mapping[int, list[int]]) -> None:
        chunk = RECORD.pack(Opcode.CHUNK, len(content)) + content
        start_ns, end_ns, size, _ = CHUNK_HEAD.unpack_from(content)
        compression, packed = _compression(content)
        parts, offsets, position = [chunk], {}, self.offset + len(chunk)
        for channel, entries in index.items():
            pairs = np.array(entries, dtype='<u8').tobytes()
            record = _INDEX_HEAD.pack(
                Opcode.MESSAGE_INDEX, 6 + len(pairs), channel, len(pairs)) + pairs
            parts.append(record)
            offsets[channel] = position
            position += len(record)
        summary = ChunkIndex(
            chunk_length=len(chunk), chunk_start_offset=self.offset, compression=compression,
            compressed_size=packed, message_end_time=end_ns, message_start_time=start_ns,
            message_index_length=position - self.offset - len(chunk),
            message_index_offsets=offsets, uncompressed_size=size)
        # The index first, at its place: if either write fails, none of the two counts.
        entry = _bytes(summary)
        self._chunk_index.seek(self._chunk_index_bytes)
        disk.write_all(self._chunk_index, entry)
        self._write(b''.join(parts))
        self._chunk_index_bytes += len(entry)
        self._chunk_count += 1
        for channel, entries in index.items():
            self._counts[channel] = self._counts.get(channel, 0) + len(entries) // 2
        if index:
            self._start_ns = start_ns if self._start_ns is None else min(
                self._start_ns, start_ns)
            self._end_ns = end_ns if self._end_ns is None else max(self._end_ns, end_ns)

    @property
    def schemas(self) -> dict[int, Schema]:
        """Return the schemas by number."""
        return self._schemas

    @property
    def channels(self) -> dict[int, Channel]:
        """Return the channels by number."""
        return self._channels

    @property
    def counts(self) -> dict[int, int]:
        """Return the number of messages in closed chunks, by channel number."""
        return dict(self._counts)

    @property
    def span_ns(self) -> tuple[int | None, int | None]:
        """Return the first and last log time [ns] of closed chunks, (None, None) if none."""
        return self._start_ns, self._end_ns

    def finish(self) -> None:
        """Close the last chunk; write summary, footer and end mark, in one piece."""
        self.close_chunk()
        end = _bytes(DataEnd(data_section_crc=0))
        start = self.offset + len(end)
        summary, offsets = b'', b''
        for opcode, group in (
                (Opcode.SCHEMA, _all_bytes(self._schemas.values())),
                (Opcode.CHANNEL, _all_bytes(self._channels.values())),
                (Opcode.STATISTICS, _bytes(self._statistics())),
                (Opcode.CHUNK_INDEX, self._all_chunks()),
                (Opcode.ATTACHMENT_INDEX, _all_bytes(self._attachments)),
                (Opcode.METADATA_INDEX, _all_bytes(self._metadata))):
            if group:
                offsets += _bytes(SummaryOffset(
                    group_opcode=opcode, group_start=start + len(summary),
                    group_length=len(group)))
                summary += group
        offset_start = start + len(summary)
        body = summary + offsets
        crc = zlib.crc32(_CONTENT_CRC.pack(Opcode.FOOTER, 20, start, offset_start),
                         zlib.crc32(body))
        footer = Footer(
            summary_start=start, summary_offset_start=offset_start, summary_crc=crc)
        self._write(end + body + _bytes(footer) + MAGIC)

    def _all_chunks(self) -> bytes:
        self._chunk_index.seek(0)
        return self._chunk_index.read(self._chunk_index_bytes)

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self._attachments), channel_count=len(self._channels),
            channel_message_counts=dict(self._counts), chunk_count=self._chunk_count,
            message_count=sum(self._counts.values()), metadata_count=len(self._metadata),
            message_start_time=self._start_ns or 0, message_end_time=self._end_ns or 0,
            schema_count=len(self._schemas))


def _bytes(record: Any) -> bytes:
    """Return a record of the ``mcap`` package as bytes."""
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()     # type: ignore[no-untyped-call]  # mcap annotates all but this
    return data


def _all_bytes(records: Iterable[Any]) -> bytes:
    return b''.join(map(_bytes, records))


def _compression(content: bytes) -> tuple[str, int]:
    """Return (name, packed size) of a chunk record."""
    begin = CHUNK_HEAD.size
    length = _TEXT_LENGTH.unpack_from(content, begin)[0]
    begin += _TEXT_LENGTH.size
    name = content[begin:begin + length].decode()
    return name, _DATA_LENGTH.unpack_from(content, begin + length)[0]

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
Write long bags fast: what our recorder would write, made from arrays.

A lone .mcap: small chunks as a recorder writes them, zstd, checksums, message
indexes and a summary; the values are noisy sines. An hour takes seconds to write.
"""

import struct
import zlib

from mcap.data_stream import RecordBuilder
from mcap.records import (
    Channel, Chunk, ChunkIndex, DataEnd, Footer, Header, Schema, Statistics)
import numpy as np
from pam_actuation import messages
from pam_actuation.bags import layout
from pam_actuation.bags.mcap_scan import MAGIC
from pam_actuation.bags.record_walk import MESSAGE_BYTES, MESSAGE_HEAD, RECORD_BYTES
from pam_actuation.topics import codec, definitions
from pam_actuation.topics.quality import USUAL
from pam_actuation.topics.table import RECORDED, short_name
import zstandard

CHUNK_BYTES = 128 * 1024
START_NS = 1_790_000_000_000_000_000
LATE_NS = 400_000                      # from stamp to receipt
# Topic: a message as template; SI value at rest and amplitude of what changes in it.
TOPICS = {
    'pressure': (messages.Pressure(0, 1.5), 3e5, 1e5),
    'contraction': (messages.Contraction(0, 1.5, 2.5), 0.03, 0.02),
    'force': (messages.Force(0, 1.5), 50.0, 5.0),
    'valve_signal': (messages.ValveSignal(0, ('ppr_voltage',), (1.5,)), 3.0, 1.0),
    'pressure_command': (messages.Pressure(0, 1.5), 3e5, 1e5),
}
_INDEX_HEAD = struct.Struct('<BQHI')   # a message index: opcode, length, channel, bytes
_MARK = np.array(1.5).tobytes()        # the number of the templates that is replaced


def write_long_bag(file, topics, seconds, hertz=1000, seed=1, namespace='/muscle'):
    """Write ``topics``, each with ``hertz`` messages a second, to ``file``; return its path."""
    with open(file, 'xb') as stream:
        _LongFile(stream, [(f'{namespace}/{short}', *TOPICS[short]) for short in topics]).write(
            int(seconds * hertz), round(1e9 / hertz), np.random.default_rng(seed))
    return file


class _LongFile:
    """One .mcap being written: rounds of one message per topic, many rounds a chunk."""

    def __init__(self, stream, topics):
        self.stream, self.topics = stream, topics
        self.templates = [codec.encode(name, template) for name, template, _, _ in topics]
        sizes = [MESSAGE_BYTES + len(template) for template in self.templates]
        self.offsets = np.concatenate([[0], np.cumsum(sizes)]).tolist()
        self.rounds = max(CHUNK_BYTES // self.offsets[-1], 1)
        self.indexes = []

    def write(self, count, step_ns, rng):
        """Write ``count`` rounds."""
        pack = zstandard.ZstdCompressor(level=1).compress
        self.stream.write(MAGIC + _bytes_of(Header('ros2', 'benchmark')))
        described = self._described()
        self.stream.write(b''.join(described))
        for first in range(0, count, self.rounds):
            ticks = np.arange(first, min(first + self.rounds, count))
            self._chunk(self._records(ticks, START_NS + ticks * step_ns, rng), pack)
        self.stream.write(_bytes_of(DataEnd(0)))
        summary = self.stream.tell()
        statistics = Statistics(
            0, len(self.topics), {i + 1: count for i in range(len(self.topics))},
            len(self.indexes), count * len(self.topics),
            START_NS + (count - 1) * step_ns + LATE_NS, START_NS + LATE_NS, 0, len(self.topics))
        for record in (*described, *map(_bytes_of, (statistics, *self.indexes))):
            self.stream.write(record)
        self.stream.write(_bytes_of(Footer(summary, 0, 0)) + MAGIC)

    def _described(self):
        schemas, channels = [], []
        for i, (name, *_) in enumerate(self.topics, 1):
            type_name = RECORDED[short_name(name)].type_name
            schemas.append(_bytes_of(Schema(
                i, definitions.schema_text(type_name).encode(), 'ros2msg', type_name)))
            channels.append(_bytes_of(Channel(i, name, 'cdr', {
                'offered_qos_profiles': layout.to_yaml([layout.qos_profile(USUAL.publisher)]),
                'topic_type_hash': definitions.type_hash(type_name)}, i)))
        return schemas + channels

    def _records(self, ticks, stamp_ns, rng):
        rows = np.zeros((len(ticks), self.offsets[-1]), dtype=np.uint8)
        for i, (_, _, rest, amplitude) in enumerate(self.topics):
            begin, template = self.offsets[i], self.templates[i]
            head = np.ndarray(len(rows), MESSAGE_HEAD, rows, begin, rows.strides[:1])
            head['opcode'], head['channel'], head['sequence'] = 5, i + 1, ticks
            head['length'] = MESSAGE_BYTES - RECORD_BYTES + len(template)
            head['log_time_ns'], head['publish_time_ns'] = stamp_ns + LATE_NS, stamp_ns
            begin += MESSAGE_BYTES
            rows[:, begin:begin + len(template)] = np.frombuffer(template, dtype=np.uint8)
            stamp = np.ndarray((len(rows), 2), '<u4', rows, begin + 4, (rows.strides[0], 4))
            stamp[:] = np.stack(np.divmod(stamp_ns, 1_000_000_000), axis=1)
            value = np.ndarray(
                len(rows), '<f8', rows, begin + template.index(_MARK), rows.strides[:1])
            value[:] = rest + amplitude * (
                np.sin(ticks * 3e-3) + 1e-3 * rng.standard_normal(len(rows)))
        return rows

    def _chunk(self, rows, pack):
        data = rows.tobytes()
        packed = pack(data)
        index = np.empty((len(rows), 2), dtype='<u8')
        index[:, 0] = np.ndarray(len(rows), '<u8', rows, 15, rows.strides[:1])
        first_ns, last_ns = int(index[0, 0]), int(index[-1, 0])
        begin = self.stream.tell()
        self.stream.write(_bytes_of(Chunk(
            'zstd', packed, last_ns, first_ns, zlib.crc32(data), len(data))))
        length = self.stream.tell() - begin
        places = {}
        for i in range(len(self.topics)):
            places[i + 1] = self.stream.tell()
            index[:, 1] = np.arange(self.offsets[i], len(data), self.offsets[-1])
            self.stream.write(_INDEX_HEAD.pack(7, 6 + index.nbytes, i + 1, index.nbytes))
            self.stream.write(index.tobytes())
        self.indexes.append(ChunkIndex(
            length, begin, 'zstd', len(packed), last_ns,
            self.stream.tell() - begin - length, places, first_ns, len(data)))


def _bytes_of(record):
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()

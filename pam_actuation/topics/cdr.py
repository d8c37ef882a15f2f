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
Fast CDR for the few fixed message layouts of the rig, without any ROS.

CDR here is the little-endian plain encoding of ROS 2 middlewares. Four bytes of encapsulation come
first, then the fields in order. Each is aligned to its own size, counted from the end of the
encapsulation. A string is a length (final NUL included), the bytes and the NUL. A sequence is a
count and its items.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import functools
import struct
from typing import NamedTuple

from pam_sim.units import NS_PER_S

ENCAPSULATION = b'\x00\x01\x00\x00'
START = len(ENCAPSULATION)           # where the stamp begins
_STAMP = struct.Struct('<iI')
_COUNT = struct.Struct('<I')
_DOUBLE = struct.Struct('<d')
# Message types of a header and float64 numbers, with the names of these in order.
STAMPED_NUMBERS = {
    'sensor_msgs/msg/FluidPressure': ('fluid_pressure', 'variance'),
    'sensor_msgs/msg/Temperature': ('temperature', 'variance'),
    'geometry_msgs/msg/WrenchStamped': (
        'wrench.force.x', 'wrench.force.y', 'wrench.force.z',
        'wrench.torque.x', 'wrench.torque.y', 'wrench.torque.z')}
# The sequences of a sensor_msgs/JointState, in order.
JOINT_FIELDS = ('position', 'velocity', 'effort')


class CdrError(ValueError):
    """The bytes are not the message they are said to be."""


@dataclass(frozen=True, slots=True)
class Layout:
    """
    Where the numbers of one message are.

    ``columns`` maps a value's name to the byte offset of its float64, or None
    where the message leaves it out. ``fixed`` lists the (begin, end) byte
    ranges that decide this layout: messages of equal length with equal bytes
    there share it. The stamp is always at bytes 4 to 12.
    """

    columns: Mapping[str, int | None]
    fixed: tuple[tuple[int, int], ...]


class Point(NamedTuple):
    """One point of a trajectory_msgs/JointTrajectory; what it leaves out is empty."""

    time_from_start_ns: int
    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    efforts: tuple[float, ...]


class JointNumbers(NamedTuple):
    """
    Where the numbers of a sensor_msgs/JointState are.

    ``places`` maps each of its sequences to (byte offset of the first number, how many).
    """

    names: tuple[str, ...]
    places: dict[str, tuple[int, int]]
    fixed: tuple[tuple[int, int], ...]


def split_stamp(stamp_ns: int) -> tuple[int, int]:
    """Return (seconds, nanoseconds) of an integer time [ns], as messages carry it."""
    return divmod(int(stamp_ns), NS_PER_S)


def stamp_of(raw: bytes) -> int:
    """Return the ``header.stamp`` [ns] of a stamped message in little-endian CDR."""
    if len(raw) < START + _STAMP.size:
        raise CdrError(f'{len(raw)} bytes are too short for a stamped message')
    seconds, nanoseconds = _STAMP.unpack_from(raw, START)
    return int(seconds * NS_PER_S + nanoseconds)


def number_at(raw: bytes, offset: int) -> float:
    """Return the float64 at a byte offset of a little-endian message."""
    return float(_DOUBLE.unpack_from(raw, offset)[0])


def _aligned(offset: int, size: int) -> int:
    return offset + -(offset - START) % size


class _Walker:
    """Walks over one message and notes which bytes decide its layout."""

    def __init__(self, raw: bytes) -> None:
        if raw[:2] != ENCAPSULATION[:2]:
            raise CdrError('not plain little-endian CDR')
        self.raw = raw
        self.offset = START + _STAMP.size
        self.fixed = [(0, 2)]

    def _take(self, size: int) -> int:
        begin, self.offset = self.offset, self.offset + size
        if self.offset > len(self.raw):
            raise CdrError(f'{len(self.raw)} bytes end inside the message')
        return begin

    def count(self) -> int:
        self.offset = _aligned(self.offset, 4)
        begin = self._take(4)
        self.fixed.append((begin, begin + 4))
        number: int = _COUNT.unpack_from(self.raw, begin)[0]
        return number

    def string(self) -> str:
        length = self.count()
        begin = self._take(length)
        self.fixed.append((begin, begin + length))
        return _text(self.raw[begin:begin + length])

    def limited_count(self) -> int:
        """Return a count of items of at least one byte each."""
        number = self.count()
        if number > len(self.raw) - self.offset:
            raise CdrError(f'{number} items announced in {len(self.raw)} bytes')
        return number

    def strings(self) -> tuple[str, ...]:
        return tuple(self.string() for _ in range(self.limited_count()))

    def doubles(self, number: int) -> int:
        """Return the offset of the first of ``number`` float64."""
        if number == 0:
            return self.offset
        self.offset = _aligned(self.offset, 8)
        return self._take(8 * number)

    def double_sequence(self) -> tuple[int, int]:
        """Return (offset of the first, number) of a float64 sequence."""
        number = self.count()
        return self.doubles(number), number


def stamped_numbers(raw: bytes, number: int) -> tuple[int, tuple[tuple[int, int], ...]]:
    """
    Return where the numbers of a message of a header and ``number`` float64 are.

    Returns (byte offset of the first one, the ``fixed`` of a Layout).
    """
    walker = _Walker(raw)
    walker.string()
    return walker.doubles(number), tuple(walker.fixed)


def joint_numbers(raw: bytes) -> JointNumbers:
    """Return where the numbers of a sensor_msgs/JointState are."""
    walker = _Walker(raw)
    walker.string()
    names = walker.strings()
    places = {field: walker.double_sequence() for field in JOINT_FIELDS}
    return JointNumbers(names, places, tuple(walker.fixed))


def joint_trajectory(raw: bytes) -> tuple[tuple[str, ...], list[Point]]:
    """Return (joint names, points) of a trajectory_msgs/JointTrajectory."""
    walker = _Walker(raw)
    walker.string()
    names, count = walker.strings(), walker.limited_count()
    offset, points = walker.offset, []
    for _ in range(count):
        positions, offset = _numbers(raw, offset)
        velocities, offset = _numbers(raw, offset)
        _, offset = _numbers(raw, offset)           # accelerations
        efforts, offset = _numbers(raw, offset)
        offset += -(offset - START) % 4
        seconds, nanoseconds = _STAMP.unpack_from(raw, offset)
        offset += 8
        points.append(Point(seconds * NS_PER_S + nanoseconds, positions, velocities, efforts))
    return names, points


def _numbers(raw: bytes, offset: int) -> tuple[tuple[float, ...], int]:
    """Return the numbers of a float64 sequence and the offset behind them."""
    offset += -(offset - START) % 4
    number, = _COUNT.unpack_from(raw, offset)
    offset += 4
    if not number:
        return (), offset
    offset += -(offset - START) % 8
    if number == 1:
        return _DOUBLE.unpack_from(raw, offset), offset + 8
    return struct.unpack_from(f'<{number}d', raw, offset), offset + 8 * number


class DiagnosticStatus(NamedTuple):
    """One status of a diagnostic_msgs/DiagnosticArray."""

    level: int
    name: str
    message: str
    hardware_id: str
    values: tuple[tuple[str, str], ...]


def diagnostic_array(raw: bytes) -> list[DiagnosticStatus]:
    """Return the statuses of a diagnostic_msgs/DiagnosticArray."""
    walker = _Walker(raw)
    walker.string()
    count = walker.limited_count()
    offset, statuses = walker.offset, []
    for _ in range(count):
        level = raw[offset]
        name, offset = _string(raw, offset + 1)
        message, offset = _string(raw, offset)
        hardware_id, offset = _string(raw, offset)
        offset += -(offset - START) % 4
        number, = _COUNT.unpack_from(raw, offset)
        offset += 4
        values = []
        if number > len(raw) - offset:
            raise CdrError(f'{number} values announced in {len(raw)} bytes')
        for _ in range(number):
            key, offset = _string(raw, offset)
            value, offset = _string(raw, offset)
            values.append((key, value))
        statuses.append(DiagnosticStatus(level, name, message, hardware_id, tuple(values)))
    return statuses


def _string(raw: bytes, offset: int) -> tuple[str, int]:
    """Return a text and the offset behind it."""
    offset += -(offset - START) % 4
    length, = _COUNT.unpack_from(raw, offset)
    offset += 4
    if offset + length > len(raw):
        raise CdrError(f'{len(raw)} bytes end inside the message')
    return _text(raw[offset:offset + length]), offset + length


def _text(raw: bytes) -> str:
    try:
        return raw.rstrip(b'\x00').decode()
    except UnicodeDecodeError:          # as rclpy does with bytes that are no UTF-8
        return raw.rstrip(b'\x00').decode(errors='replace')


def _string_bytes(text: str) -> bytes:
    data = text.encode() + b'\x00'
    return _COUNT.pack(len(data)) + data


def _pad(size_so_far: int, size: int) -> bytes:
    return b'\x00' * (-size_so_far % size)


class _Builder:
    """Puts fields behind each other, each aligned to its own size."""

    def __init__(self, stamp_ns: int, frame_id: str) -> None:
        self._parts = [_STAMP.pack(*split_stamp(stamp_ns))]
        self.size = _STAMP.size
        self.string(frame_id)

    def add(self, data: bytes, size: int = 1) -> None:
        padding = _pad(self.size, size)
        self._parts += (padding, data)
        self.size += len(padding) + len(data)

    def count(self, number: int) -> None:
        self.add(_COUNT.pack(number), 4)

    def string(self, text: str) -> None:
        self.add(_string_bytes(text), 4)

    def byte(self, value: int) -> None:
        self.add(bytes((value,)))

    def finished(self) -> bytes:
        return b''.join((ENCAPSULATION, *self._parts))


def trajectory_bytes(stamp_ns: int, names: Sequence[str], points: Sequence[Point],
                     frame_id: str = '') -> bytes:
    """Return the CDR bytes of a trajectory_msgs/JointTrajectory."""
    builder = _Builder(stamp_ns, frame_id)
    builder.count(len(names))
    for name in names:
        builder.string(name)
    builder.count(len(points))
    for after_ns, positions, velocities, efforts in points:
        packer = _point_packer(
            builder.size % 8, len(positions), len(velocities), len(efforts))
        builder.add(packer.pack(
            len(positions), *positions, len(velocities), *velocities, 0, len(efforts), *efforts,
            *split_stamp(after_ns)))
    return builder.finished()


@functools.lru_cache(maxsize=512)
def _point_packer(begin: int, positions: int, velocities: int, efforts: int) -> struct.Struct:
    """Return the Struct of a point with sequences of these lengths that begins at an offset."""
    form, size = '<', begin
    for length in (positions, velocities, 0, efforts):
        padding = -size % 4
        form += f'{padding}xI'
        size += padding + 4
        if length:
            padding = -size % 8
            form += f'{padding}x{length}d'
            size += padding + 8 * length
    return struct.Struct(f'{form}{-size % 4}xiI')


def diagnostic_bytes(stamp_ns: int, statuses: Sequence[DiagnosticStatus],
                     frame_id: str = '') -> bytes:
    """Return the CDR bytes of a diagnostic_msgs/DiagnosticArray."""
    builder = _Builder(stamp_ns, frame_id)
    builder.count(len(statuses))
    for status in statuses:
        builder.byte(status.level)
        for text in (status.name, status.message, status.hardware_id):
            builder.string(text)
        builder.count(len(status.values))
        for key, value in status.values:
            builder.string(key)
            builder.string(value)
    return builder.finished()


@functools.lru_cache(maxsize=512)
def stamped_packer(frame_id: str, numbers: int) -> tuple[struct.Struct, bytes]:
    """
    Return (Struct, constant) of a header followed by ``numbers`` float64.

    The Struct packs ``ENCAPSULATION``, seconds, nanoseconds, the constant and the numbers.
    """
    constant = _string_bytes(frame_id)
    constant += _pad(_STAMP.size + len(constant), 8)
    return struct.Struct(f'<4siI{len(constant)}s{numbers}d'), constant


@functools.lru_cache(maxsize=512)
def joint_packer(frame_id: str, names: tuple[str, ...],
                 lengths: tuple[int, int, int]) -> tuple[struct.Struct, tuple[bytes, ...]]:
    """
    Return (Struct, constants) of a sensor_msgs/JointState with sequences of these lengths.

    The Struct packs ``ENCAPSULATION``, seconds, nanoseconds and, of each of ``JOINT_FIELDS``,
    the constant in front and the numbers.
    """
    constant = _string_bytes(frame_id)
    constant += _pad(len(constant), 4) + _COUNT.pack(len(names))
    for name in names:
        constant += _pad(len(constant), 4) + _string_bytes(name)
    size = _STAMP.size
    form, parts = '<4siI', []
    for length in lengths:
        constant += _pad(size + len(constant), 4) + _COUNT.pack(length)
        if length:
            constant += _pad(size + len(constant), 8)
        form += f'{len(constant)}s{length}d'
        parts.append(constant)
        size += len(constant) + 8 * length
        constant = b''
    return struct.Struct(form), tuple(parts)

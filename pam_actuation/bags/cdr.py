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

CDR here is the little-endian plain encoding that ROS 2 middlewares send: four
bytes of encapsulation, then the fields in order, each aligned to its own size
counted from the end of the encapsulation; a string is a length (final NUL
included), the bytes and the NUL; a sequence is a count and its items.
"""

from dataclasses import dataclass
import functools
import math
import struct

ENCAPSULATION = b'\x00\x01\x00\x00'
NS_PER_S = 1_000_000_000
_START = len(ENCAPSULATION)
_STAMP = struct.Struct('<iI')
_COUNT = struct.Struct('<I')
_DOUBLE = struct.Struct('<d')


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

    columns: dict
    fixed: tuple


def split_stamp(stamp_ns):
    """Return (seconds, nanoseconds) of an integer time [ns], as messages carry it."""
    return divmod(int(stamp_ns), NS_PER_S)


def stamp_of(raw):
    """Return the ``header.stamp`` [ns] of a stamped message in little-endian CDR."""
    if len(raw) < _START + _STAMP.size:
        raise CdrError(f'{len(raw)} bytes are too short for a stamped message')
    seconds, nanoseconds = _STAMP.unpack_from(raw, _START)
    return seconds * NS_PER_S + nanoseconds


def _aligned(offset, size):
    return offset + -(offset - _START) % size


class _Walker:
    """Walks over one message and notes which bytes decide its layout."""

    def __init__(self, raw):
        if raw[:2] != ENCAPSULATION[:2]:
            raise CdrError('not plain little-endian CDR')
        self.raw = raw
        self.offset = _START + _STAMP.size
        self.fixed = [(0, 2)]

    def _take(self, size):
        begin, self.offset = self.offset, self.offset + size
        if self.offset > len(self.raw):
            raise CdrError(f'{len(self.raw)} bytes end inside the message')
        return begin

    def count(self):
        self.offset = _aligned(self.offset, 4)
        begin = self._take(4)
        self.fixed.append((begin, begin + 4))
        return _COUNT.unpack_from(self.raw, begin)[0]

    def string(self):
        length = self.count()
        begin = self._take(length)
        self.fixed.append((begin, begin + length))
        try:
            return bytes(self.raw[begin:begin + length]).rstrip(b'\x00').decode()
        except UnicodeDecodeError as error:
            raise CdrError(f'a text is not UTF-8 ({error})') from None

    def limited_count(self):
        """Return a count of items of at least one byte each."""
        number = self.count()
        if number > len(self.raw) - self.offset:
            raise CdrError(f'{number} items announced in {len(self.raw)} bytes')
        return number

    def strings(self):
        return tuple(self.string() for _ in range(self.limited_count()))

    def byte(self):
        return self.raw[self._take(1)]

    def duration_ns(self):
        self.offset = _aligned(self.offset, 4)
        seconds, nanoseconds = _STAMP.unpack_from(self.raw, self._take(8))
        return seconds * NS_PER_S + nanoseconds

    def doubles(self, number):
        """Return the offset of the first of ``number`` float64."""
        if number == 0:
            return self.offset
        self.offset = _aligned(self.offset, 8)
        return self._take(8 * number)

    def double_sequence(self):
        """Return (offset of the first, number) of a float64 sequence."""
        number = self.count()
        return self.doubles(number), number


def fluid_pressure_layout(raw):
    """Return the Layout of a sensor_msgs/FluidPressure: fluid_pressure, variance."""
    walker = _Walker(raw)
    walker.string()
    begin = walker.doubles(2)
    return Layout({'fluid_pressure': begin, 'variance': begin + 8}, tuple(walker.fixed))


def wrench_layout(raw):
    """Return the Layout of a geometry_msgs/WrenchStamped: force_x … torque_z."""
    walker = _Walker(raw)
    walker.string()
    begin = walker.doubles(6)
    names = ('force_x', 'force_y', 'force_z', 'torque_x', 'torque_y', 'torque_z')
    return Layout({name: begin + 8 * i for i, name in enumerate(names)}, tuple(walker.fixed))


def joint_state_layout(raw):
    """
    Return (names, Layout) of a sensor_msgs/JointState.

    The columns are named ``('position', i)``, ``('velocity', i)`` and
    ``('effort', i)``; an entry that the message leaves out has no column.
    """
    walker = _Walker(raw)
    walker.string()
    names = walker.strings()
    columns = {}
    for field in ('position', 'velocity', 'effort'):
        begin, number = walker.double_sequence()
        columns.update(((field, i), begin + 8 * i) for i in range(number))
    return names, Layout(columns, tuple(walker.fixed))


def joint_trajectory(raw):
    """
    Return (times, positions, velocities, efforts) of a trajectory_msgs/JointTrajectory.

    Tuples of equal length: ``time_from_start`` [ns], first position and first
    velocity (NaN if left out) of every point that has a position. Where no point has one:
    the first effort of every point that has an effort, positions and velocities empty.
    """
    walker = _Walker(raw)
    walker.string()
    walker.strings()
    points, efforts = [], []
    for _ in range(walker.limited_count()):
        (position, number), (velocity, velocities) = (
            walker.double_sequence(), walker.double_sequence())
        walker.double_sequence()
        effort, has_effort = walker.double_sequence()
        after_ns = walker.duration_ns()
        if number:
            points.append((
                after_ns, _DOUBLE.unpack_from(raw, position)[0],
                _DOUBLE.unpack_from(raw, velocity)[0] if velocities else math.nan))
        elif has_effort:
            efforts.append((after_ns, _DOUBLE.unpack_from(raw, effort)[0]))
    if points:
        return (*zip(*points), ())
    times, values = zip(*efforts) if efforts else ((), ())
    return times, (), (), values


def diagnostic_array(raw):
    """
    Return the statuses of a diagnostic_msgs/DiagnosticArray.

    One tuple each: level, name, message, hardware_id, ((key, value), …).
    """
    walker = _Walker(raw)
    walker.string()
    statuses = []
    for _ in range(walker.limited_count()):
        level = walker.byte()
        name, message, hardware_id = walker.string(), walker.string(), walker.string()
        values = tuple(
            (walker.string(), walker.string()) for _ in range(walker.limited_count()))
        statuses.append((level, name, message, hardware_id, values))
    return statuses


def _string_bytes(text):
    data = text.encode() + b'\x00'
    return _COUNT.pack(len(data)) + data


def _pad(size_so_far, size):
    return b'\x00' * (-size_so_far % size)


@functools.lru_cache(maxsize=512)
def _header_packer(frame_id, doubles):
    """Return (Struct, constant bytes) of: stamp, frame_id, ``doubles`` float64."""
    constant = _string_bytes(frame_id)
    constant += _pad(_STAMP.size + len(constant), 8)
    return struct.Struct(f'<4siI{len(constant)}s{doubles}d'), constant


def stamped_doubles(stamp_ns, values, frame_id=''):
    """Return the CDR bytes of a header followed by the float64 ``values``."""
    packer, constant = _header_packer(frame_id, len(values))
    return packer.pack(ENCAPSULATION, *split_stamp(stamp_ns), constant, *values)


@functools.lru_cache(maxsize=512)
def _joint_state_packer(frame_id, names, lengths):
    """Return (Struct, the three constant parts in front of the three sequences)."""
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


def joint_state(stamp_ns, names, position=(), velocity=(), effort=(), frame_id=''):
    """Return the CDR bytes of a sensor_msgs/JointState."""
    packer, parts = _joint_state_packer(
        frame_id, tuple(names), (len(position), len(velocity), len(effort)))
    return packer.pack(
        ENCAPSULATION, *split_stamp(stamp_ns), parts[0], *position, parts[1], *velocity,
        parts[2], *effort)

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
How the plain message of a topic lies in a ROS message: one class per kind of content.

Each knows its ROS type, makes bytes of plain messages and reads them back. Contents of single
numbers (``Numeric``) also say where these stand, so that many messages are read as arrays.
A number that a message leaves out is NaN.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
import itertools
import math
from operator import attrgetter
from typing import Any, NamedTuple

from pam_actuation import messages
from pam_actuation.topics import cdr

JOINT_STATE = 'sensor_msgs/msg/JointState'
JOINT_TRAJECTORY = 'trajectory_msgs/msg/JointTrajectory'
DIAGNOSTIC_ARRAY = 'diagnostic_msgs/msg/DiagnosticArray'

Encode = Callable[[Any], bytes]
Make = Callable[[int, Sequence[float]], Any]        # of a stamp and the numbers in order


class Places(NamedTuple):
    """
    Where the numbers of one message are.

    ``offsets`` are the bytes at which they begin, None where a number is left out. There may be
    more of them than ``names``. ``fixed``: as of ``cdr.Layout``.
    """

    names: tuple[str, ...]
    offsets: tuple[int | None, ...]
    fixed: tuple[tuple[int, int], ...]


class Content(ABC):
    """What a topic carries."""

    type_name: str                  # of the ROS message, such as sensor_msgs/msg/JointState
    message: type                   # the plain class that is sent

    @abstractmethod
    def encoder(self, name: str = 'muscle', frame_id: str = '') -> Encode:
        """
        Return the function that makes CDR bytes of plain messages.

        Parameters
        ----------
        name : str
            Of the muscle or joint, the only entry of ``name`` where the content has no names.
        frame_id : str
            ``header.frame_id``: where the sensor sits.

        """

    @abstractmethod
    def decode(self, raw: bytes) -> Any:
        """Return the plain message in little-endian CDR; ValueError for other bytes."""


class Numeric(Content):
    """What consists of a stamp and numbers that have names."""

    @property
    @abstractmethod
    def always(self) -> tuple[str, ...]:
        """Return the columns that arrays of many messages always have."""

    @abstractmethod
    def places(self, raw: bytes) -> Places:
        """Return where the numbers of a message are; CdrError."""

    @abstractmethod
    def maker(self, names: tuple[str, ...]) -> Make:
        """Return the function that makes plain messages of a stamp and the named numbers."""

    def layout(self, raw: bytes) -> cdr.Layout:
        """Return where the values of the arrays are; CdrError."""
        places = self.places(raw)
        return cdr.Layout(dict(zip(places.names, places.offsets)), places.fixed)

    def decode(self, raw: bytes) -> Any:
        """Return the plain message in little-endian CDR; ValueError for other bytes."""
        stamp_ns, places = cdr.stamp_of(raw), self.places(raw)
        return self.maker(places.names)(stamp_ns, [
            math.nan if offset is None else cdr.number_at(raw, offset)
            for offset in places.offsets])


@dataclass(frozen=True)
class Value:
    """One number: ``name`` in plain messages and arrays, ``field`` of the ROS message."""

    name: str
    field: str


@dataclass(frozen=True)
class Numbers(Numeric):
    """
    A fixed set of numbers.

    Parameters
    ----------
    type_name : str
        A type of ``cdr.STAMPED_NUMBERS``, or JointState; there a value is the first number of
        its field.
    message : type
        Plain class: ``stamp_ns`` and the values by name.
    values : tuple of Value
        In the order of the fields. Of a JointState all but the first are left out where NaN.
    instead : tuple of Value
        What a JointState carries instead where the first value is left out.

    """

    type_name: str
    message: type
    values: tuple[Value, ...]
    instead: tuple[Value, ...] = ()

    @cached_property
    def always(self) -> tuple[str, ...]:
        """Return the columns that arrays of many messages always have."""
        return tuple(value.name for value in self.values)

    @cached_property
    def _stamped(self) -> tuple[int, tuple[int, ...]]:
        """Return how many numbers follow the header, and which of them the values are."""
        names = cdr.STAMPED_NUMBERS.get(self.type_name, ())
        return len(names), tuple(names.index(value.field) for value in self.values if names)

    @cached_property
    def _attributes(self) -> tuple[str, ...]:
        """Return the attributes of the plain message behind its stamp."""
        return tuple(field.name for field in fields(self.message))[1:]

    def places(self, raw: bytes) -> Places:
        """Return where the numbers of a message are; CdrError."""
        number, which = self._stamped
        if number:
            begin, fixed = cdr.stamped_numbers(raw, number)
            return Places(self.always, tuple([begin + 8 * i for i in which]), fixed)
        _, places, fixed = cdr.joint_numbers(raw)
        values = self.values
        if self.instead and not places[values[0].field][1]:
            values = self.instead
        return Places(
            tuple(value.name for value in values),
            tuple(begin if number else None
                  for begin, number in (places[value.field] for value in values)), fixed)

    def maker(self, names: tuple[str, ...]) -> Make:
        """Return the function that makes plain messages of a stamp and the named numbers."""
        message = self.message
        if names == self._attributes[:len(names)]:
            return lambda stamp_ns, values: message(stamp_ns, *values)
        return lambda stamp_ns, values: message(stamp_ns, **dict(zip(names, values)))

    def encoder(self, name: str = 'muscle', frame_id: str = '') -> Encode:
        """Return the function that makes CDR bytes of plain messages."""
        if self.type_name in cdr.STAMPED_NUMBERS:
            return self._stamped_encoder(frame_id)
        usual = _joint_encoder(self.values, name, frame_id)
        if not self.instead:
            return usual
        other, first = _joint_encoder(self.instead, name, frame_id), self.instead[0].name
        return lambda message: (
            other if math.isfinite(getattr(message, first)) else usual)(message)

    def _stamped_encoder(self, frame_id: str) -> Encode:
        names = cdr.STAMPED_NUMBERS[self.type_name]
        packer, constant = cdr.stamped_packer(frame_id, len(names))
        pack, split = packer.pack, cdr.split_stamp
        if self.values[0].field == names[0] and len(self.values) == 1:
            get, others = attrgetter(self.values[0].name), (0.0,) * (len(names) - 1)
            return lambda message: pack(
                cdr.ENCAPSULATION, *split(message.stamp_ns), constant, get(message), *others)
        by_field = {value.field: value.name for value in self.values}

        def encode(message: Any) -> bytes:
            return pack(cdr.ENCAPSULATION, *split(message.stamp_ns), constant, *(
                getattr(message, by_field[name]) if name in by_field else 0.0 for name in names))

        return encode


def _joint_encoder(values: tuple[Value, ...], name: str, frame_id: str) -> Encode:
    """Return the encoder of a JointState with one entry and one number a value."""
    places = tuple(cdr.JOINT_FIELDS.index(value.field) for value in values)
    get = [attrgetter(value.name) for value in values]
    first_get, first_place, others = get[0], places[0], tuple(zip(get[1:], places[1:]))
    split = cdr.split_stamp
    packers = {lengths: cdr.joint_packer(frame_id, (name,), lengths)
               for lengths in itertools.product((0, 1), (0, 1), (0, 1))}

    def encode(message: Any) -> bytes:
        numbers: list[tuple[float, ...]] = [(), (), ()]
        numbers[first_place] = first_get(message),
        for of_message, place in others:
            value = of_message(message)
            if value == value:          # not NaN
                numbers[place] = value,
        position, velocity, effort = numbers
        packer, (one, two, three) = packers[len(position), len(velocity), len(effort)]
        return packer.pack(cdr.ENCAPSULATION, *split(message.stamp_ns), one, *position, two,
                           *velocity, three, *effort)

    return encode


@dataclass(frozen=True)
class NamedNumbers(Numeric):
    """
    A JointState whose entries are found by name.

    Parameters
    ----------
    message : type
        Plain class: ``stamp_ns``, ``names`` and the numbers.
    numbers : str
        Attribute of the numbers.
    field : str
        Field of the JointState that holds them.

    """

    message: type
    numbers: str
    field: str
    type_name: str = JOINT_STATE
    always: tuple[str, ...] = ()

    def places(self, raw: bytes) -> Places:
        """Return where the numbers of a message are; CdrError."""
        names, places, fixed = cdr.joint_numbers(raw)
        begin, number = places[self.field]
        missing = (None,) * (len(names) - number)
        return Places(names, (*range(begin, begin + 8 * number, 8), *missing), fixed)

    def maker(self, names: tuple[str, ...]) -> Make:
        """Return the function that makes plain messages of a stamp and the named numbers."""
        message = self.message
        return lambda stamp_ns, values: message(stamp_ns, names, tuple(values))

    def encoder(self, name: str = 'muscle', frame_id: str = '') -> Encode:
        """Return the function that makes CDR bytes of plain messages."""
        get, split = attrgetter('stamp_ns', 'names', self.numbers), cdr.split_stamp
        place = cdr.JOINT_FIELDS.index(self.field)
        former: tuple[Any, ...] = None, -1

        def encode(message: Any) -> bytes:
            nonlocal former
            stamp_ns, names, numbers = get(message)
            if former[0] != names or former[1] != len(numbers):
                lengths = [0, 0, 0]
                lengths[place] = len(numbers)
                packer, parts = cdr.joint_packer(frame_id, tuple(names), tuple(lengths))
                former = (names, len(numbers), packer.pack, parts[:place + 1], parts[place + 1:])
            _, _, pack, before, behind = former
            return pack(cdr.ENCAPSULATION, *split(stamp_ns), *before, *numbers, *behind)

        return encode


@dataclass(frozen=True)
class Trajectory(Content):
    """
    A JointTrajectory of one muscle or joint: per point a position with its rate, or an effort.

    Parameters
    ----------
    message : type
        Plain class: ``stamp_ns``, ``time_from_start_ns`` and these attributes.
    positions, velocities, efforts : str
        Its attributes; without ``efforts`` there are none.

    """

    message: type
    positions: str
    velocities: str
    efforts: str = ''
    type_name: str = JOINT_TRAJECTORY

    def encoder(self, name: str = 'muscle', frame_id: str = '') -> Encode:
        """Return the function that makes CDR bytes of plain messages."""
        def encode(message: Any) -> bytes:
            positions = getattr(message, self.positions)
            velocities = getattr(message, self.velocities)
            efforts = getattr(message, self.efforts) if self.efforts else ()
            return cdr.trajectory_bytes(message.stamp_ns, (name,), [
                cdr.Point(after_ns, positions[i:i + 1], velocities[i:i + 1], efforts[i:i + 1])
                for i, after_ns in enumerate(message.time_from_start_ns)], frame_id)

        return encode

    def decode(self, raw: bytes) -> Any:
        """Return the plain message: positions and rates, or efforts where no point has any."""
        _, points = cdr.joint_trajectory(raw)
        stamp_ns = cdr.stamp_of(raw)
        times, positions, velocities, efforts = zip(*points) if points else ((),) * 4
        if self.efforts and not any(positions):
            return self.message(stamp_ns, times, **{self.efforts: _firsts(efforts)})
        return self.message(stamp_ns, times, **{
            self.positions: _firsts(positions), self.velocities: _firsts(velocities)})


class AnyJoints(Trajectory):
    """A JointTrajectory that is sent for one joint and received for any, by name."""

    def decode(self, raw: bytes) -> messages.NamedTrajectory:
        """Return the points as they came."""
        names, points = cdr.joint_trajectory(raw)
        return messages.NamedTrajectory(cdr.stamp_of(raw), names, tuple(
            (point.time_from_start_ns, point.positions, point.velocities) for point in points))


@dataclass(frozen=True)
class Statuses(Content):
    """A DiagnosticArray: one Status or several."""

    message: type = messages.Status
    type_name: str = DIAGNOSTIC_ARRAY

    def encoder(self, name: str = 'muscle', frame_id: str = '') -> Encode:
        """Return the function that makes CDR bytes of plain messages."""
        def encode(message: messages.Status | Sequence[messages.Status]) -> bytes:
            statuses = (message,) if isinstance(message, messages.Status) else tuple(message)
            stamp_ns = statuses[0].stamp_ns if statuses else 0
            return cdr.diagnostic_bytes(stamp_ns, [
                cdr.DiagnosticStatus(
                    int(status.level), status.name, status.message, status.hardware_id,
                    tuple((str(key), str(value)) for key, value in status.values))
                for status in statuses], frame_id)

        return encode

    def decode(self, raw: bytes) -> tuple[messages.Status, ...]:
        """Return a tuple of Status."""
        stamp_ns = cdr.stamp_of(raw)
        return tuple(
            messages.Status(stamp_ns, one.level, one.name, one.message, one.values,
                            one.hardware_id)
            for one in cdr.diagnostic_array(raw))


@dataclass(frozen=True)
class Text(Content):
    """A DiagnosticArray of one status: its message is the text, its name the sender."""

    message: type = messages.Marker
    type_name: str = DIAGNOSTIC_ARRAY

    def encoder(self, name: str = 'muscle', frame_id: str = '') -> Encode:
        """Return the function that makes CDR bytes of plain messages."""
        def encode(message: messages.Marker) -> bytes:
            return cdr.diagnostic_bytes(message.stamp_ns, [
                cdr.DiagnosticStatus(0, message.source, message.text, '', ())], frame_id)

        return encode

    def decode(self, raw: bytes) -> messages.Marker:
        """Return the plain message; several texts are joined."""
        found = cdr.diagnostic_array(raw)
        return messages.Marker(
            cdr.stamp_of(raw), '; '.join(one.message for one in found),
            found[0].name if found else '')


def _firsts(sequences: Sequence[Sequence[float]]) -> tuple[float, ...]:
    """Return the first number of each, NaN where there is none: a missing value is not 0."""
    return tuple([numbers[0] if numbers else math.nan for numbers in sequences])

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
Plain messages to CDR bytes and back, per topic, without ROS: the one way for nodes and bags.

Reading minds neither the content of alignment bytes nor bytes behind the message, which ROS 2
leaves unset. Any ``name`` and ``frame_id`` is accepted. To convert a message between Python and
C costs rclpy several times what the middleware needs to send it, so nodes send and take bytes.
"""

from collections.abc import Iterable, Sequence
import functools
import math
import struct
from typing import Any

import numpy as np
from pam_actuation.topics import cdr
from pam_actuation.topics.contents import Encode, JOINT_STATE, Make, Numbers, Numeric
from pam_actuation.topics.definitions import little_endian
from pam_actuation.topics.table import topic_of
from pam_sim.annotations import ByteArray, FloatArray, IntArray
from pam_sim.errors import InputError
from pam_sim.units import NS_PER_S

# What bytes raise that are not the message they are said to be.
UNREADABLE = (struct.error, ValueError, IndexError)


@functools.lru_cache(maxsize=1024)
def _encoder(topic: str) -> Encode:
    return topic_of(topic).content.encoder()


@functools.lru_cache(maxsize=1024)
def _reader(topic: str) -> 'Reader':
    return Reader(topic)


def encode(topic: str, message: Any) -> bytes:
    """
    Return the CDR bytes of one plain message.

    Parameters
    ----------
    topic : str
        Short or full topic name.
    message : object
        The plain message of that topic (``pam_actuation.messages``); for
        ``diagnostics`` a Status or a sequence of Status.

    Raises
    ------
    InputError
        Unknown topic.

    """
    return _encoder(topic)(message)


def encode_series(topic: str, stamp_ns: IntArray, values: FloatArray) -> ByteArray:
    """
    Return the CDR bytes of many messages that carry one number each.

    Parameters
    ----------
    topic : str
        Short or full name of a topic of numbers.
    stamp_ns : numpy.ndarray of int, shape (N,)
        Header stamps [ns].
    values : numpy.ndarray, shape (N,)
        The first number of each message; others are left out.

    Returns
    -------
    numpy.ndarray of uint8, shape (N, B)
        A row is what ``encode`` returns.

    """
    content = topic_of(topic).numeric
    assert content is not None, topic
    sample = encode(topic, content.maker(content.always[:1])(0, [0.0]))
    begin, = [place for place in content.places(sample).offsets[:1] if place is not None]
    found = np.tile(np.frombuffer(sample, np.uint8), (len(values), 1))
    stamps = np.column_stack(np.divmod(np.asarray(stamp_ns, np.int64), NS_PER_S))
    found[:, cdr.START:cdr.START + 8] = stamps.astype('<u4').view(np.uint8)
    found[:, begin:begin + 8] = np.asarray(values, '<f8').reshape(-1, 1).view(np.uint8)
    return found


def decode(topic: str, raw: bytes) -> Any:
    """
    Return the plain message in CDR bytes; a tuple of Status for ``diagnostics``.

    Missing numbers come back as NaN. Raises InputError for an unknown topic or
    bytes that are not the topic's message.
    """
    reader = _reader(topic)
    try:
        return reader.read(raw)
    except UNREADABLE as error:
        raise InputError(
            f'{len(raw)} bytes are not a {reader.type_name}: {error}', topic) from None


class Writer:
    """
    Turn the plain messages of one topic into what a publisher sends.

    Parameters
    ----------
    topic : str
        Short or full topic name.
    muscle : str
        Name of the muscle or joint, the only entry of ``name`` where it is measured or wanted.
    frame_id : str
        ``header.frame_id``: where the sensor sits.

    Attributes
    ----------
    fill : callable
        Returns the CDR bytes of a plain message.

    """

    def __init__(self, topic: str, muscle: str = 'muscle', frame_id: str = '') -> None:
        self.fill: Encode = topic_of(topic).content.encoder(muscle, frame_id)


class Reader:
    """
    Turn what arrives on one topic, as bytes, into its plain messages.

    A topic keeps its layout from message to message, only stamp and numbers change. So the
    places of the numbers are kept for as long as the bytes that decide them stay the same.

    Parameters
    ----------
    topic : str
        Short or full topic name.

    Attributes
    ----------
    names : tuple of str
        The entries of a JointState of which the first alone counts, as last seen.

    """

    def __init__(self, topic: str) -> None:
        row = topic_of(topic)
        self._content, self._numeric = row.content, row.numeric
        self.type_name = row.type_name
        self.names: tuple[str, ...] = ()
        self._first_counts = isinstance(row.content, Numbers) and row.type_name == JOINT_STATE
        self._layout: _Layout | None = None

    def __call__(self, raw: bytes) -> Any:
        """Return the plain message of CDR bytes, None for bytes that are no such message."""
        try:
            return self.read(raw)
        except UNREADABLE:
            return None

    def read(self, raw: bytes) -> Any:
        """Return the plain message of CDR bytes; one of ``UNREADABLE`` for others."""
        layout = self._layout
        if layout is not None and len(raw) == layout.length:
            for begin, end, content in layout.fixed:
                if raw[begin:end] != content:
                    break
            else:
                return layout.message(raw)
        if self._numeric is None or raw[:2] != cdr.ENCAPSULATION[:2]:
            return self._content.decode(little_endian(raw, self.type_name))
        layout = self._layout = _learned(self._numeric, raw)
        if self._first_counts:
            self.names = cdr.joint_numbers(raw).names
        return self._content.decode(raw) if layout is None else layout.message(raw)


class _Layout:
    """Where the numbers of messages of one length are, if the bytes ``fixed`` are the same."""

    def __init__(self, raw: bytes, fixed: Iterable[tuple[int, int]], numbers: struct.Struct,
                 make: Make) -> None:
        self.length = len(raw)
        self.fixed = [(begin, end, raw[begin:end]) for begin, end in _joined(fixed)]
        self._unpack_from, self._make = numbers.unpack_from, make

    def message(self, raw: bytes) -> Any:
        """Return the plain message in bytes of this layout."""
        seconds, nanoseconds, *values = self._unpack_from(raw, cdr.START)
        return self._make(seconds * NS_PER_S + nanoseconds, values)


def _learned(content: Numeric, raw: bytes) -> _Layout | None:
    """Return the layout of a message, None where the numbers do not stand in order; CdrError."""
    places = content.places(raw)
    numbers = _struct_of(offset for offset in places.offsets if offset is not None)
    if numbers is None:
        return None
    make = content.maker(places.names)
    if None in places.offsets:
        make = _filling(make, places.offsets)
    return _Layout(raw, places.fixed, numbers, make)


def _filling(make: Make, offsets: Iterable[int | None]) -> Make:
    """Return what makes a message of the numbers that are there; NaN stands for the others."""
    places, number = [], 0
    for offset in offsets:
        places.append(-1 if offset is None else number)
        number += offset is not None

    def filled(stamp_ns: int, values: Sequence[float]) -> Any:
        with_nan = *values, math.nan
        return make(stamp_ns, [with_nan[place] for place in places])

    return filled


def _struct_of(offsets: Iterable[int]) -> struct.Struct | None:
    """Return the Struct of stamp and float64 numbers, None where they are not in order."""
    form, end = '<iI', cdr.START + 8
    for offset in offsets:
        if offset < end:
            return None
        form += f'{offset - end}xd'
        end = offset + 8
    return struct.Struct(form)


def _joined(ranges: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return ranges of bytes with those that touch joined, so that fewer are compared."""
    joined: list[tuple[int, int]] = []
    for begin, end in ranges:
        if joined and joined[-1][1] == begin:
            joined[-1] = (joined[-1][0], end)
        else:
            joined.append((begin, end))
    return joined

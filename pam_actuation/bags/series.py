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
Many messages of one topic to one table of numbers.

Messages of a topic nearly always share one layout (same names, same lengths).
The layout is worked out once and all messages that have the same bytes in the
deciding places are read together as columns of one array.
"""

from collections.abc import Collection, Iterator, Sequence
from typing import Any

import numpy as np
from pam_actuation.bags.payloads import Payloads
from pam_actuation.topics import cdr
from pam_actuation.topics.codec import UNREADABLE
from pam_actuation.topics.contents import Numeric
from pam_actuation.topics.definitions import little_endian
from pam_actuation.topics.table import topic_of
from pam_sim.annotations import BoolArray, ByteArray, FloatArray, IntArray
from pam_sim.units import NS_PER_S

Messages = Payloads | Sequence[bytes]
# Layouts of equal length that are looked for together; what is left is read one by one.
_MAX_LAYOUTS = 8


def table(
        short: str, messages: Messages,
        only: Collection[str] | None = None) -> tuple[IntArray, dict[str, FloatArray], BoolArray]:
    """
    Return (stamps, values, bad) of the messages of one topic.

    Parameters
    ----------
    short : str
        Short name of a topic that carries numbers.
    messages : Payloads or list of bytes
        CDR bytes, N messages.
    only : collection of str, optional
        Names of the values wanted, of topics with named entries; by default all.

    Returns
    -------
    stamp_ns : ndarray of int64, shape (N,)
        ``header.stamp``; 0 where the message is bad.
    values : dict of str to ndarray of float64, shape (N,)
        SI values, NaN where a message does not carry one.
    bad : ndarray of bool, shape (N,)
        Messages that are not of the topic's type.

    """
    payloads = _payloads(messages)
    content = topic_of(short).numeric
    assert content is not None
    count = len(payloads)
    stamp_ns = np.zeros(count, dtype=np.int64)
    bad = np.zeros(count, dtype=bool)
    values: dict[str, FloatArray] = {name: np.full(count, np.nan) for name in content.always}
    for indices, rows in payloads.tables():
        for _ in range(_MAX_LAYOUTS):
            if len(indices):
                indices, rows = _read_alike(content, indices, rows, stamp_ns, values, bad, only)
        for i in range(len(indices)):
            _read_alike(
                content, indices[i:i + 1], rows[i:i + 1], stamp_ns, values, bad, only)
    return stamp_ns, values, bad


def layouts(short: str, messages: Messages) -> Iterator[bytes]:
    """
    Yield a message of each layout, in little-endian CDR.

    They are looked for as in ``table``, up to eight among messages of equal length.

    Parameters
    ----------
    short : str
        Short name of a topic that carries numbers.
    messages : Payloads or list of bytes
        CDR bytes.

    """
    content = topic_of(short).numeric
    assert content is not None
    for _, rows in _payloads(messages).tables():
        for _ in range(_MAX_LAYOUTS):
            if not len(rows):
                break
            first = rows[0].tobytes()
            try:
                raw = little_endian(first, content.type_name)
                fixed = content.layout(raw).fixed
            except UNREADABLE:
                rows = rows[1:]
                continue
            yield raw
            # Re-encoded from big-endian: its bytes compare with no other's.
            rows = rows[~_alike(rows, fixed)] if raw is first else rows[1:]


def stamps(messages: Messages) -> IntArray:
    """
    Return ``header.stamp`` [ns] of N messages of any stamped type, shape (N,).

    Raises CdrError where one is too short or not little-endian.
    """
    payloads = _payloads(messages)
    stamp_ns = np.zeros(len(payloads), dtype=np.int64)
    for indices, rows in payloads.tables():
        cdr.stamp_of(rows[0].tobytes())
        if (_column(rows, 0, '<u2') != int.from_bytes(cdr.ENCAPSULATION[:2], 'little')).any():
            raise cdr.CdrError('not plain little-endian CDR')
        stamp_ns[indices] = _stamp_column(rows)
    return stamp_ns


def _payloads(messages: Messages) -> Payloads:
    return messages if isinstance(messages, Payloads) else Payloads(messages)


def _read_alike(content: Numeric, indices: IntArray, rows: ByteArray, stamp_ns: IntArray,
                values: dict[str, FloatArray], bad: BoolArray,
                only: Collection[str] | None) -> tuple[IntArray, ByteArray]:
    """Read the messages that have the layout of the first one; return the others."""
    first = rows[0].tobytes()
    try:
        raw = little_endian(first, content.type_name)
        layout = content.layout(raw)
    except UNREADABLE:
        bad[indices[0]] = True
        return indices[1:], rows[1:]
    if only is not None:
        wanted = {name: at for name, at in layout.columns.items() if name in only}
        layout = cdr.Layout(wanted, layout.fixed)
    if raw is not first:
        # Re-encoded from big-endian: its bytes compare with no other's.
        swapped = np.frombuffer(raw, dtype=np.uint8).reshape(1, -1)
        _fill(layout, indices[:1], swapped, stamp_ns, values)
        return indices[1:], rows[1:]
    alike = _alike(rows, layout.fixed)
    if alike.all():
        _fill(layout, indices, rows, stamp_ns, values)
        return indices[:0], rows[:0]
    _fill(layout, indices[alike], rows[alike], stamp_ns, values)
    return indices[~alike], rows[~alike]


def _fill(layout: cdr.Layout, indices: IntArray, rows: ByteArray, stamp_ns: IntArray,
          values: dict[str, FloatArray]) -> None:
    """Copy the numbers of messages of one layout to their places."""
    stamp_ns[indices] = _stamp_column(rows)
    for name, offset in layout.columns.items():
        if name not in values:
            values[name] = np.full(len(stamp_ns), np.nan)
        if offset is not None:
            values[name][indices] = _column(rows, offset, '<f8')


def _alike(rows: ByteArray, fixed: Sequence[tuple[int, int]]) -> BoolArray:
    """Return which rows have the bytes of the first one in the ranges ``fixed``, shape (n,)."""
    alike = np.ones(len(rows), dtype=bool)
    for begin, end in fixed:
        while begin < end:
            # As many bytes at once as a number has, powers of two.
            size = min(8, 1 << (end - begin).bit_length() - 1)
            part = _column(rows, begin, f'<u{size}')
            alike &= part == part[0]
            begin += size
    return alike


def _stamp_column(rows: ByteArray) -> IntArray:
    return _column(rows, 4, '<i4').astype(np.int64) * NS_PER_S + _column(rows, 8, '<u4')


def _column(rows: ByteArray, offset: int, kind: str) -> Any:
    """Return the numbers at one offset of every row as a view, shape (n,)."""
    return np.ndarray(len(rows), kind, rows, offset, strides=rows.strides[:1])

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

import numpy as np
from pam_actuation.bags import cdr, codecs
from rosbags.serde import SerdeError

# Value columns that a series always has, NaN where no message carries them.
VALUES = {
    'pressure': ('pressure_pa',),
    'pressure_command': ('pressure_pa',),
    'supply_pressure': ('pressure_pa',),
    'force': ('force_n',),
    'external_force': ('force_n',),
    'contraction': ('contraction_m', 'velocity_m_per_s'),
    'reference': ('contraction_m', 'velocity_m_per_s'),
    'valve_command': (),
    'valve_signal': (),
    'controller_state': (),
}


def table(short, payloads):
    """
    Return (stamps, values, bad) of the messages of one topic.

    Parameters
    ----------
    short : str
        Short topic name, a key of VALUES.
    payloads : list of bytes
        CDR bytes, N messages.

    Returns
    -------
    stamp_ns : ndarray of int64, shape (N,)
        ``header.stamp``; 0 where the message is bad.
    values : dict of str to ndarray of float64, shape (N,)
        SI values, NaN where a message does not carry one.
    bad : ndarray of bool, shape (N,)
        Messages that are not of the topic's type.

    """
    count = len(payloads)
    stamp_ns = np.zeros(count, dtype=np.int64)
    bad = np.zeros(count, dtype=bool)
    values = {name: np.full(count, np.nan) for name in VALUES[short]}
    groups = {}
    for index, raw in enumerate(payloads):
        groups.setdefault(len(raw), []).append(index)
    for indices in groups.values():
        left = np.array(indices)
        while len(left):
            left = _read_alike(short, payloads, left, stamp_ns, values, bad)
    return stamp_ns, values, bad


def _read_alike(short, payloads, indices, stamp_ns, values, bad):
    """Read the messages that have the layout of the first one; return the others' indices."""
    first = indices[0]
    try:
        raw = codecs.little_endian(short, payloads[first])
        layout = codecs.value_layout(short, raw)
    except (cdr.CdrError, SerdeError):
        bad[first] = True
        return indices[1:]
    if raw is payloads[first]:
        rows = np.frombuffer(b''.join([payloads[i] for i in indices]), dtype=np.uint8)
        rows = rows.reshape(len(indices), len(raw))
        alike = np.ones(len(indices), dtype=bool)
        for begin, end in layout.fixed:
            alike &= (rows[:, begin:end] == rows[0, begin:end]).all(axis=1)
    else:
        # Re-encoded from big-endian: its bytes compare with no other's.
        rows = np.frombuffer(raw, dtype=np.uint8).reshape(1, -1)
        alike = np.arange(len(indices)) == 0
    chosen = indices[alike]
    rows = rows[alike[:len(rows)]]
    seconds = _column(rows, 4, '<i4').astype(np.int64)
    stamp_ns[chosen] = seconds * cdr.NS_PER_S + _column(rows, 8, '<u4')
    for name, offset in layout.columns.items():
        column = values.setdefault(name, np.full(len(stamp_ns), np.nan))
        if offset is not None:
            column[chosen] = _column(rows, offset, '<f8')
    return indices[~alike]


def _column(rows, offset, kind):
    size = np.dtype(kind).itemsize
    return np.ascontiguousarray(rows[:, offset:offset + size]).view(kind)[:, 0]

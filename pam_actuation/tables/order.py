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

"""Rows in order of their times, each with a time of its own; several recordings in one table."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pam_actuation.tables.table import Table
from pam_sim.annotations import IntArray
from pam_sim.errors import InputError
from pam_sim.units import often

LATE_S = 1.0                # messages overtake one another by less; a recording begins anew
MOST_CHANGES = 4            # from part to part in order of time, for each step back
MOST_PARTS = 10             # that are told one by one


@dataclass(frozen=True)
class Clock:
    """
    The times of the rows of a table.

    Parameters
    ----------
    stamp_ns : ndarray of int64, shape (rows,)
        Growing strictly.
    rows : ndarray of int64, shape (rows,)
        Rows of the table that they belong to.
    told : str
        Where the time came from, for the preview.
    remarks : tuple of str
        What was mended, and gaps.
    jump : str
        A sentence on a clock that was set within the recording, '' without.
    jump_at_s : float
        In the middle of that jump, after the first row.

    """

    stamp_ns: IntArray
    rows: IntArray
    told: str
    remarks: tuple[str, ...] = ()
    jump: str = ''
    jump_at_s: float = 0.0


class Times(NamedTuple):
    """The stamps of all rows as they were read; ``step_ns`` is the resolution, 0 if unknown."""

    stamp_ns: IntArray
    told: str
    step_ns: int = 0
    remark: str = ''


def in_order(table: Table, read: Times, sort: bool = False, part: int = 0) -> Clock:
    """
    Return the clock with its rows in order, each with a time of its own.

    Parameters
    ----------
    table : Table
        The table.
    read : Times
        Its times as they were read.
    sort, part
        As ``clock_of`` has them.

    Raises
    ------
    InputError
        Times that run back or repeat; several recordings; a part that is not there.

    """
    stamps, told, step_ns, remark = read
    rows, remarks = np.arange(len(stamps), dtype=np.int64), [remark] if remark else []
    begins = np.flatnonzero(np.diff(stamps) < -1e9 * LATE_S) + 1
    if part:
        begin, end = _part(table, np.concatenate([[0], begins, [len(stamps)]]), part)
        stamps, rows = stamps[begin:end], rows[begin:end]
        told += f', part {part} of {len(begins) + 1}'
        begins = begins[:0]
    back = np.flatnonzero(np.diff(stamps) < 0)
    if len(back):
        late_s = 1e-9 * float(np.max(np.maximum.accumulate(stamps) - stamps))
        overtaken = bool(table.topic) and late_s < LATE_S
        if not (sort or overtaken):
            row = int(back[0]) + 1
            parts = f'Take one of them with {_options(len(begins) + 1)}' if (
                0 < len(begins) < MOST_PARTS) else 'Split it here'
            raise InputError(
                f'the time runs back by {(stamps[row - 1] - stamps[row]) * 1e-9:g} s '
                f'({often(len(back))} in all); two recordings in one file? {parts}, or add '
                '--sort to put the rows in order', table.place(int(rows[row])))
        order = np.argsort(stamps, kind='stable')
        stamps, rows = stamps[order], rows[order]
        if overtaken:
            told += f', put in order ({len(back)} arrived late, by up to {1e3 * late_s:.3g} ms)'
        else:
            remarks.append(f'the rows were put in order of time ({len(back)} steps back)')
    repeated = np.flatnonzero(np.diff(stamps) == 0) + 1
    same = [row for row in repeated if _equal_rows(table, int(rows[row - 1]), int(rows[row]))]
    _refuse_mixed(table, np.delete(rows, same), begins, len(back))
    if not len(repeated):
        return Clock(stamps, rows, told, tuple(remarks))
    if len(same) == len(repeated):
        kept = np.ones(len(stamps), dtype=bool)
        kept[same] = False
        remarks.append(f'rows that stand twice, taken once: {len(same)}')
        return Clock(stamps[kept], rows[kept], told, tuple(remarks))
    if step_ns and _is_coarse(stamps, step_ns):
        remarks.append(
            f'rows that repeat a time: {len(repeated)}. Times are written to {1e-6 * step_ns:g} '
            'ms; rows of one time were spread over that')
        return Clock(_spread(stamps, step_ns), rows, told, tuple(remarks))
    raise InputError(
        f'the row has the time of the row before, with other values ({len(repeated)} such rows); '
        'two recordings in one file, or a time that is too coarse? Then give --rate HZ',
        table.place(int(rows[repeated[0]])))


def _part(table: Table, ends: IntArray, part: int) -> tuple[int, int]:
    """Return the rows of a part, first and beyond the last; InputError where it is not there."""
    if part >= len(ends):
        raise InputError(
            f'{table.source} has {len(ends) - 1} part{"s" * (len(ends) > 2)}: a part begins '
            f'where the time runs back by more than {LATE_S:g} s', f'--part {part}')
    return int(ends[part - 1]), int(ends[part])


def _refuse_mixed(table: Table, rows: IntArray, begins: IntArray, steps_back: int) -> None:
    """Raise InputError where rows of several recordings would stand between one another."""
    if not len(begins):
        return
    parts = np.searchsorted(begins, rows, side='right')
    if np.count_nonzero(np.diff(parts)) > MOST_CHANGES * (steps_back + 1):
        raise InputError(
            f'{len(begins) + 1} recordings in one file: the time begins anew here, and the rows '
            'of one would be put between those of another. Take one of them with '
            f'{_options(len(begins) + 1)}, without --sort', table.place(int(begins[0])))


def _options(parts: int) -> str:
    return ' or '.join(f'--part {part + 1}' for part in range(parts))


def _is_coarse(stamps: IntArray, step_ns: int) -> bool:
    """Return whether times repeat because they are written to ``step_ns``."""
    times = np.unique(stamps)
    steps = np.diff(times)
    if not len(steps) or float(np.median(steps)) > 3.0 * step_ns:
        return False
    # A stamp that was not renewed is followed by a longer step; a rounded one is not.
    repeated = np.flatnonzero(np.diff(stamps) == 0)
    after = np.searchsorted(times, stamps[repeated])
    return float(np.median(steps[np.minimum(after, len(steps) - 1)])) < 1.9 * float(
        np.median(steps))


def _equal_rows(table: Table, one: int, other: int) -> bool:
    return all(column.iloc[one] == column.iloc[other] or (
        column.iloc[one] != column.iloc[one] and column.iloc[other] != column.iloc[other])
        for column in table.columns.values())


def _spread(stamps: IntArray, step_ns: int) -> IntArray:
    """Return stamps with those that are equal at equal distances within one step."""
    _, first, count = np.unique(stamps, return_index=True, return_counts=True)
    number = np.arange(len(stamps)) - np.repeat(first, count)
    return stamps + number * step_ns // np.repeat(count, count)

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

"""The time of every row, in nanoseconds: from a column, a rate, or the file itself."""

from collections.abc import Collection
from dataclasses import replace
import re
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.messages import START_NS
from pam_actuation.tables.dates import Dates, dates_of, days_as_ns
from pam_actuation.tables.day_and_time import (
    dates_of_pair, holds_dates, holds_times_of_day, is_called_time, leaf_of, pair_of)
from pam_actuation.tables.durations import durations_of
from pam_actuation.tables.mapping import TableMapping, TimeMap
from pam_actuation.tables.order import Clock, in_order, Times
from pam_actuation.tables.table import Table
from pam_actuation.tables.units import DATE, FACTORS, is_output, TIME, unit_of_text
from pam_actuation.tables.words import unit_in, words_of
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

SLOWEST_HZ, FASTEST_HZ = 0.1, 50_000.0
SLOW_HZ = 10.0                              # below: another unit may be meant
UNLIKELY_HZ = 1.0                           # below: the user has to say the unit
FEWEST_RISING = 20                          # rows that tell a time from values that rise
EPOCH_S = 9e8                               # seconds that can only count from 1970
GAP_S, GAP_STEPS = 0.05, 5.0                # longer than both: rows are missing
CLOCK_ROWS, CLOCK_SHARE = 3.0, 0.02         # further apart: two clocks, and not one that drifts
GOES_ON = 0.9                               # share of the rows in which a clock goes on
JUMP_S = 10.0                               # longer than this and the rest: the clock was set


def time_column(table: Table, mapping: TableMapping) -> TimeMap | None:
    """
    Return the column of the time: the one named, else the one whose name says so.

    Where no column has a name, it is the first one, if that rises from row to row.
    """
    if mapping.time is not None or mapping.rate_hz is not None or table.stamp_ns is not None:
        return mapping.time
    found = [name for name in table.columns if is_called_time(table, name)]
    exact = [name for name in found if name.endswith('stamp_ns')]
    found = sorted(found, key=lambda name: _rank(table, name))
    if not found and _rises_without_name(table, mapping):
        found = [next(iter(table.columns))]
    return TimeMap((exact or found)[0]) if found else None


def own_time(table: Table, tables: Collection[Table], mapping: TableMapping) -> TableMapping:
    """Return the mapping for one of several tables: without a time that another of them holds."""
    wanted = '' if mapping.time is None else mapping.time.column
    is_elsewhere = bool(wanted) and table.name_of(wanted) is None and any(
        other.name_of(wanted) is not None for other in tables)
    return replace(mapping, time=None) if is_elsewhere else mapping


def _rank(table: Table, name: str) -> int:
    """Return how far behind others of its kind a column of the time stands."""
    if is_output(table.units.get(name, '') or unit_in(table.title_of(name)), TIME):
        return 3                                            # such as `t_ticks`
    values = table.columns[name]
    if holds_dates(values):
        return 2
    # Behind seconds, which are finer; before numbers whose unit is not stated.
    is_coarse = _is_text_date(values) and values.nunique() < len(values)
    return int((holds_times_of_day(values) or is_coarse) and any(
        _unit_of_name(table, other) for other in table.columns if is_called_time(table, other)))


def _rises_without_name(table: Table, mapping: TableMapping) -> bool:
    """Return whether no column has a name, and the first one, not a signal, always rises."""
    if len(table) < FEWEST_RISING or any(
            name != f'#{place + 1}' for place, name in enumerate(table.columns)):
        return False
    first = next(iter(table.columns))
    if any(table.name_of(one.column) == first for one in mapping.signals.values()):
        return False
    if _is_text_date(table.columns[first]):
        return True
    try:
        return bool((np.diff(table.numbers(first)) > 0.0).all())
    except InputError:
        return False


def clock_of(table: Table, mapping: TableMapping, sort: bool = False, part: int = 0) -> Clock:
    """
    Return the times of the rows; time 0 is ``START_NS`` where they do not count from 1970.

    Parameters
    ----------
    table : Table
        The table.
    mapping : TableMapping
        What the user said of its time.
    sort : bool
        Put the rows in order of time.
    part : int
        Which recording is meant, from 1, where the time begins anew within the table; 0: there
        is but one.

    Raises
    ------
    InputError
        No time; times that are missing, run back or repeat; a rate that no unit explains.

    """
    if mapping.rate_hz is not None:
        if part:
            raise InputError('a part is found by a column of the time, and --rate goes without; '
                             'give one of them', f'--part {part}')
        rows = np.arange(len(table), dtype=np.int64)
        numbers = rows if table.numbered is None else table.numbered
        stamps = START_NS + np.round(numbers * (1e9 / mapping.rate_hz)).astype(np.int64)
        return Clock(stamps, rows, f'{mapping.rate_hz:g} rows a second', _hidden(table, mapping))
    column = time_column(table, mapping)
    if column is None:
        if table.stamp_ns is None:
            raise InputError(_no_time(table), table.source)
        read = Times(table.stamp_ns, f'times of the messages on {table.topic}')
    else:
        read = _from_column(table, column)
    clock = _with_gaps(table, in_order(table, read, sort, part))
    other = '' if column is None else _other_clock(
        table, table.require(column.column), read.stamp_ns, clock.rows)
    if other and column is not None and mapping.time is None:
        raise InputError(f'{other}, or say which of them is the time of every signal, with '
                         f'--map time="{column.column}"', table.source)
    return replace(clock, remarks=(*clock.remarks, other)) if other else clock


def _other_clock(table: Table, name: str, stamp_ns: IntArray, rows: IntArray) -> str:
    """
    Return a sentence on a second time in the rows, as of another logger; '' without one.

    Parameters
    ----------
    table : Table
        The table.
    name : str
        The column that is the time.
    stamp_ns : ndarray of int64
        The times in it, of all rows.
    rows : ndarray of int64
        The rows that count.

    """
    pair = pair_of(table, name) or ()
    for other in table.columns:
        if other == name or other in pair:
            continue
        values, of_part = table.columns[other], _is_time_of_part(table, other)
        if not (is_called_time(table, other) or of_part):
            continue
        # Without a unit it may count the rows.
        if not (_unit_of_name(table, other) or values.dtype.kind == 'M' or _is_text_date(values)
                or of_part and values.dtype.kind == 'f'
                or leaf_of(table.title_of(other)) == leaf_of(table.title_of(name))):
            continue
        both = rows[values.notna().to_numpy()[rows]]
        try:
            stamps = _from_column(replace(
                table, columns={other: values.iloc[both]}, lines=None, numbered=None),
                TimeMap(other)).stamp_ns
        except InputError:
            continue
        steps, own_steps = np.diff(stamps), np.diff(stamp_ns[both])
        if not steps.any() or not own_steps.any() or min(steps.min(), own_steps.min()) < 0:
            continue                                # it stands still, or begins anew
        if of_part and float((steps > 0).mean()) < GOES_ON:
            continue                                # of events, such as `time of last pulse`
        # A coarse clock, one that drifts and one that is read late go with the rows all the same.
        usual_ns = max(float(np.median(one[one > 0])) for one in (steps, own_steps))
        long_ns, own_ns = int(steps.sum()), int(own_steps.sum())
        apart_ns = float(np.abs(np.cumsum(steps) - np.cumsum(own_steps)).max())
        if apart_ns > max(CLOCK_ROWS * usual_ns, CLOCK_SHARE * max(long_ns, own_ns)):
            return (f'columns "{name}" and "{other}" are both called a time, and go on by '
                    f'{1e-9 * own_ns:.6g} s and {1e-9 * long_ns:.6g} s over the same '
                    f'{len(both)} rows: two clocks? Give the columns of each logger their own '
                    'file')
    return ''


def _is_time_of_part(table: Table, column: str) -> bool:
    """Return whether a name speaks of a time and of more, as `Time - Force` of one sensor."""
    words = words_of(table.title_of(column)).split()
    return 'time' in words and not is_called_time(table, column)


def _no_time(table: Table) -> str:
    """Return the sentence that no column is the time, with those that may be it."""
    found = [name for name in table.columns if _is_time_of_part(table, name)]
    if len(found) < 2:
        return (f'no column is the time; add --map time="{(found or ["COLUMN"])[0]}:s", or '
                '--rate HZ for rows at equal distances')
    names = ' and '.join(f'"{name}"' for name in found)
    return (f'columns {names} could each be the time: give the columns of each logger their own '
            f'file, or say which of them is the time of every signal, with --map '
            f'time="{found[0]}:s"')


def _hidden(table: Table, mapping: TableMapping) -> tuple[str, ...]:
    """Return a remark on a time that runs back where the rows are taken at equal distances."""
    column = time_column(table, replace(mapping, rate_hz=None))
    try:
        stamps = None if column is None else _from_column(table, column).stamp_ns
    except InputError:          # no time that could be read
        return ()
    row = int(np.argmin(np.diff(stamps))) + 1 if stamps is not None and len(stamps) > 1 else 0
    if column is None or stamps is None or not row or stamps[row] >= stamps[row - 1]:
        return ()
    return (f'the time in column "{column.column}" runs back by '
            f'{(stamps[row - 1] - stamps[row]) * 1e-9:g} s at {_line(table.place(row))}, and '
            '--rate takes the rows as one recording without a pause; are they two?',)


def _line(place: str) -> str:
    """Return where in its file a place is, as ``line 7``; a place without a line as it is."""
    return place.partition(':')[2] and f'line {place.rpartition(":")[2]}' or place


def _from_column(table: Table, column: TimeMap) -> Times:
    """Return the times in a column."""
    import pandas as pd
    name = table.require(column.column, column.where)
    values = table.columns[name]
    is_date = pd.api.types.is_datetime64_any_dtype(values)
    if column.unit in ('', DATE) and (pair := pair_of(table, name)) is not None:
        return _paired(table, *pair)
    if column.unit in ('', DATE) and holds_dates(values):
        raise InputError(
            f'column "{name}" holds dates without a time of day, and no column is known to hold '
            'that; add --map time="COLUMN:s", or --rate HZ for rows at equal distances',
            table.source)
    if column.unit == '' and (durations := durations_of(table, name)) is not None:
        return _times_of(table, f'column "{name}", {durations.told}', durations)
    if is_date or column.unit in ('', DATE) and _is_text_date(values):
        return _dates(table, name)
    unit = column.unit or _unit_of_name(table, name)
    if pd.api.types.is_integer_dtype(values) and unit == 'ns':
        stamps = values.to_numpy(dtype=np.int64)
        start = 0 if len(stamps) and abs(int(stamps[0])) > EPOCH_S * 1e9 else START_NS
        return Times(start + stamps, f'column "{name}" in ns')
    numbers = table.numbers(name)
    missing = np.flatnonzero(~np.isfinite(numbers))
    if len(missing):
        others = [one for one in table.columns if one != name and is_called_time(table, one)]
        fix = (f'column "{others[0]}" is called a time too: if they are of two loggers, give the '
               'columns of each their own file') if others else (
               'delete the rows, or give --rate HZ')
        raise InputError(f'column "{name}" has no time here ({len(missing)} such rows); {fix}',
                         table.place(int(missing[0])))
    days = days_as_ns(numbers) if unit in ('', DATE) else None
    if days is not None:
        return Times(days, f'column "{name}" in days', _resolution_ns(days))
    if unit == DATE:
        raise InputError(f'column "{name}" holds numbers that are no days of a spreadsheet or of '
                         f'MATLAB; add --map time="{name}:s" (or ms, us, ns)', table.source)
    unit = unit or _unit_by_rate(table, name, numbers)
    factor = FACTORS[TIME][unit]
    start = 0 if len(numbers) and numbers[0] * factor > EPOCH_S else START_NS
    # Whole numbers of the unit first: their product with a power of ten is exact.
    stamps = start + np.round(numbers * (factor * 1e9)).astype(np.int64)
    return Times(stamps, f'column "{name}" in {unit}', _resolution_ns(stamps - start),
                 _rate_remark(table, name, unit, stamps, bool(column.unit)))


def _is_text_date(values: 'pd.Series') -> bool:
    """Return whether a column holds texts, and the first one is a date or a time of day."""
    import pandas as pd
    if pd.api.types.is_numeric_dtype(values) or pd.api.types.is_datetime64_any_dtype(values):
        return False
    first = next((str(one) for one in values if isinstance(one, str)), '')
    return bool(re.search(r'\d[-/:.]\d', first)) and not re.fullmatch(r'[+-]?[\d.]+', first)


def _dates(table: Table, name: str) -> Times:
    """Return the times in a column of texts, or of dates as other files hold them."""
    import pandas as pd
    values = table.columns[name]
    if pd.api.types.is_datetime64_any_dtype(values):
        dates = pd.to_datetime(values, errors='coerce', utc=True)
        wrong = np.flatnonzero(dates.isna().to_numpy())
        found = int(wrong[0]) if len(wrong) else Dates(
            dates.dt.as_unit('ns').astype('int64').to_numpy(), 'dates')
    else:
        found = dates_of(values)
    if isinstance(found, int):
        raise InputError(
            f'column "{name}" holds {str(values.iloc[found])!r}, which is no date and time as in '
            '2026-11-25T09:30:00.125', table.place(found))
    return _times_of(table, f'column "{name}", {found.told}', found)


def _paired(table: Table, date: str, time: str) -> Times:
    """Return the times whose date is in one column and whose time of day in another."""
    found = dates_of_pair(table, date, time)
    if isinstance(found, int):
        texts = ' '.join(str(table.columns[name].iloc[found]) for name in (date, time))
        raise InputError(f'columns "{date}" and "{time}" hold {texts!r}, which is no date and '
                         'time as in 2026-11-25 09:30:00.125', table.place(found))
    return _times_of(table, f'columns "{date}" and "{time}", {found.told}', found)


def _times_of(table: Table, told: str, found: Dates) -> Times:
    """Return dates as times; InputError where they are so far apart as in no recording."""
    stamp_ns = found.stamp_ns
    step_s = 1e-9 * float(np.median(np.diff(stamp_ns))) if len(stamp_ns) > 1 else 0.0
    if step_s * SLOWEST_HZ > 1.0:
        raise InputError(
            f'{told}, means a row every {step_s:.6g} s, allowed are rows every '
            f'{1.0 / SLOWEST_HZ:g} s and more often; is this the time? If not, add --map '
            'time="COLUMN:s", or --rate HZ for rows at equal distances', table.source)
    return Times(stamp_ns + (START_NS if found.is_of_day else 0), told, _resolution_ns(stamp_ns),
                 found.remark)


def _unit_of_name(table: Table, name: str) -> str:
    """Return the unit that the row of units or the name of the column says, '' without one."""
    title = table.title_of(name)
    # A name may be the unit, as `millis` of an Arduino is.
    for text in (table.units.get(name, ''), unit_in(title), words_of(title)):
        unit = unit_of_text(text, TIME) if text else None
        if unit is not None:
            return unit.name
    return ''


def _unit_by_rate(table: Table, name: str, numbers: FloatArray) -> str:
    """Return the one unit in which the rows come at a rate that recorders have."""
    said = unit_in(table.title_of(name)) or table.units.get(name, '')
    if said and not any(unit_of_text(said, one) for one in FACTORS):
        raise InputError(f'column "{name}" has the unit {said!r}, which is none of a time; add '
                         f'--map time="{name}:s" (or ms, us, ns)', table.source)
    steps = np.diff(numbers)
    step = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    # A row or two a second are a slow loop in s, and as likely a fast recording in ms.
    fitting = [unit for unit in ('s', 'ms', 'us', 'ns') if step and (
        0.5 if unit == 's' else 20.0) <= 1.0 / (step * FACTORS[TIME][unit]) <= 5000.0]
    if len(fitting) != 1:
        raise InputError(
            f'column "{name}" does not say its unit, and steps of {step:g} fit '
            f'{" and ".join(fitting) or "none"}; add --map time="{name}:s" (or ms, us, ns)',
            table.source)
    return fitting[0]


def _rate_remark(table: Table, name: str, unit: str, stamps: IntArray, is_stated: bool) -> str:
    """Return a sentence on a rate that few recorders have, '' without; InputError beyond."""
    steps = np.diff(stamps)
    steps = steps[steps > 0]
    if not len(steps):
        return ''
    rate_hz = 1e9 / float(np.median(steps))
    if SLOW_HZ <= rate_hz <= FASTEST_HZ:
        return ''
    other = next((one for one in ('s', 'ms', 'us', 'ns') if one != unit and
                  20.0 <= rate_hz * FACTORS[TIME][unit] / FACTORS[TIME][one] <= 5000.0), '')
    hint = f'; in {other} they would be plausible: --map time="{name}:{other}"' if other else ''
    said = f'column "{name}" in {unit} means {rate_hz:.4g} rows a second'
    if SLOWEST_HZ <= rate_hz <= FASTEST_HZ and (
            rate_hz >= UNLIKELY_HZ or is_stated or not other):
        return said + hint
    if SLOWEST_HZ <= rate_hz <= FASTEST_HZ:
        raise InputError(f'{said}{hint}. If {unit} is right, write --map time="{name}:{unit}"',
                         table.source)
    raise InputError(f'{said}, allowed are {SLOWEST_HZ:g} to {FASTEST_HZ:g}'
                     f'{hint or "; is this the time?"}', table.source)


def _resolution_ns(times_ns: IntArray) -> int:
    """Return the step of which all times are whole numbers, 0 where the times have none."""
    for step_ns in (10**9, 10**8, 10**7, 10**6, 10**5, 10**4, 1000):
        if not (times_ns % step_ns).any():
            return step_ns
    return 0


def _with_gaps(table: Table, clock: Clock) -> Clock:
    """Return the clock with a remark on gaps, or a sentence on a jump."""
    steps = np.diff(clock.stamp_ns)
    if len(steps) < 10:
        return clock
    gaps = np.flatnonzero(steps > max(1e9 * GAP_S, GAP_STEPS * float(np.median(steps))))
    if not len(gaps):
        return clock
    longest = int(gaps[np.argmax(steps[gaps])])
    long_s, rest_s = 1e-9 * float(steps[longest]), 1e-9 * float(steps.sum() - steps[longest])
    place = table.place(int(clock.rows[longest + 1]))
    if long_s > max(JUMP_S, rest_s):
        after_s = 1e-9 * (clock.stamp_ns[longest:longest + 2] - clock.stamp_ns[0])
        at_s = float(f'{float(after_s.mean()):.4g}')
        return replace(clock, jump_at_s=at_s, jump=(
            f'{place}: the time jumps on by {long_s:g} s, more than all the rest lasts '
            f'({rest_s:.4g} s); two recordings, or was the clock set? Take one side with '
            f'--to {at_s:g} or --from {at_s:g}, or correct the times'))
    return replace(clock, remarks=(
        *clock.remarks, f'gaps in the time: {len(gaps)}, the longest {long_s:.4g} s before '
        f'{_line(place)}'))

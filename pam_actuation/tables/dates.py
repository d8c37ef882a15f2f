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
"""Dates and times of day as people and spreadsheets write them, in nanoseconds from 1970."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    import pandas as pd

DAY_NS = 86_400 * 10**9
# Day 0 of spreadsheets (30 December 1899) and of MATLAB (year 0), counted from 1970, and which
# numbers of days can be one of them: 1954 to 2119.
_SPREADSHEET, _SPREADSHEET_DAYS = -25_569, (20_000.0, 80_000.0)
_MATLAB, _MATLAB_DAYS = -719_529, (714_000.0, 774_000.0)
_LEAST_STEP_DAYS, _MOST_STEP_DAYS = 1.0 / (86_400 * 50_000.0), 2.0 / 86_400
_ORDERS = {'ymd': 'year, month, day', 'dmy': 'day, month, year', 'mdy': 'month, day, year'}
_LATE_HOUR_NS = DAY_NS // 2         # back by more than this: midnight passed
_HOUR_NS = 3600 * 10**9             # minutes and seconds begin anew
_LATE_MINUTE_NS = 58 * 60 * 10**9
# A date in any order, a time of day of two or three parts, and a half of the day.
PATTERN = (
    r'^\s*(?:(?P<first>\d{1,4})(?P<mark>[-/.])(?P<second>\d{1,2})[-/.](?P<third>\d{1,4})[T\s,]+)?'
    r'(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second_of>\d{2}))?'
    r'(?:(?:[.,]|(?<=:\d\d:\d\d):(?=\d{3}))(?P<part>\d{1,9})\d*)?'
    r'\s*(?P<half>[AaPp]\.?[Mm]\.?)?\s*$')


@dataclass(frozen=True)
class Dates:
    """
    Times that texts hold.

    Parameters
    ----------
    stamp_ns : ndarray of int64, shape (rows,)
        From 1970; of a time of day alone, from the midnight before the first row.
    told : str
        How they were read, in words.
    is_of_day : bool
        Whether they hold no date.
    remark : str
        What could be read in two ways, '' without.

    """

    stamp_ns: IntArray
    told: str
    is_of_day: bool = False
    remark: str = ''


def dates_of(values: 'pd.Series', dated: bool = False) -> Dates | int:
    """
    Return the times in a column of texts, or the first row that holds none.

    ISO 8601; ``3.4.2026 9:30:00,125``, ``4/3/2026 9:30:00.125 AM`` and others; a time of day
    alone; minutes and seconds such as ``01:23.456``. With ``dated`` their dates stand elsewhere.
    """
    import pandas as pd
    iso = pd.to_datetime(values, errors='coerce', utc=True, format='ISO8601')
    if not iso.isna().any():
        return Dates(iso.dt.as_unit('ns').astype('int64').to_numpy(), 'dates')
    found = values.astype(str).str.extract(PATTERN)
    wrong = np.flatnonzero(found['hour'].isna().to_numpy())
    if len(wrong):
        return int(wrong[0])
    minutes, remark = _are_minutes(found, dated)
    day_ns, is_wrong = _of_day(found, minutes)
    if is_wrong.any():
        return int(np.flatnonzero(is_wrong)[0])
    has_date = found['first'].notna().to_numpy()
    if not has_date.any():
        late_ns, whole_ns = (_LATE_MINUTE_NS, _HOUR_NS) if minutes else (_LATE_HOUR_NS, DAY_NS)
        back = np.diff(day_ns, prepend=day_ns[:1]) < -late_ns
        return Dates(day_ns + whole_ns * np.cumsum(back),
                     'minutes and seconds' if minutes else 'times of day', True, remark)
    if not has_date.all():
        return int(np.flatnonzero(~has_date)[0])
    return _dated(found, day_ns)


def _are_minutes(found: 'pd.DataFrame', dated: bool) -> tuple[bool, str]:
    """
    Return whether texts of two parts are minutes and seconds, with a remark if only rows say so.

    Hours and minutes have no fraction, and no recording has its rows a minute apart.
    """
    of_day = dated or found[['first', 'half']].notna().any(axis=None)
    if found['second_of'].notna().any() or of_day and not found['part'].notna().all():
        return False, ''
    if found['part'].notna().any():
        return True, ''
    hours, minutes = (found[name].astype('int64').to_numpy() for name in ('hour', 'minute'))
    steps = np.diff(60 * hours + minutes)
    if not len(steps) or float(np.median(steps)) < 1.0:
        return bool((hours > 23).any()), ''
    return True, (f'times such as {hours[1]:02d}:{minutes[1]:02d} were read as minutes and '
                  'seconds; as hours and minutes the rows would be a minute apart')


def _of_day(found: 'pd.DataFrame', minutes: bool) -> tuple[IntArray, BoolArray]:
    """
    Return the time of day [ns] of every row, and which rows hold none.

    ``minutes``: the two parts are minutes and seconds.
    """
    numbers = {name: found[name].fillna('0').astype('int64').to_numpy()
               for name in ('hour', 'minute', 'second_of')}
    part_ns = found['part'].fillna('').str.pad(9, 'right', '0').astype('int64').to_numpy()
    hour, minute, second = numbers.values()
    if minutes:
        hour, minute, second = np.zeros_like(hour), hour, minute
    half = found['half'].str.lower().str[0]
    is_wrong = (minute > 59) | (second > 59) | (hour > 23) | (
        half.notna().to_numpy() & ((hour > 12) | (hour < 1)))
    hour = np.where(half.notna(), hour % 12 + np.where(half == 'p', 12, 0), hour)
    return ((hour * 60 + minute) * 60 + second) * 10**9 + part_ns, is_wrong


def _dated(found: 'pd.DataFrame', day_ns: IntArray) -> Dates | int:
    """Return the times of rows with a date, or the first row whose date no calendar has."""
    import pandas as pd
    parts = found[['first', 'second', 'third']]
    if parts['first'].str.len().eq(4).all():
        orders = ['ymd']
    else:
        orders = ['dmy'] if found['mark'].eq('.').all() else ['dmy', 'mdy']
    read: dict[str, IntArray] = {}
    wrong = 0
    for order in orders:
        days = {letter: parts.iloc[:, place] for place, letter in enumerate(order)}
        year = days['y'].astype('int64')
        dates = pd.to_datetime(pd.DataFrame({
            'year': year.where(year > 99, year + 2000), 'month': days['m'], 'day': days['d']}),
            errors='coerce')
        if dates.isna().any():
            wrong = int(np.flatnonzero(dates.isna().to_numpy())[0])
        else:
            read[order] = dates.dt.as_unit('ns').astype('int64').to_numpy() + day_ns
    if not read:
        return wrong
    # Over midnight only the right order goes on by a day.
    lengths_ns = {order: int(np.ptp(stamps)) for order, stamps in read.items()}
    order = min(lengths_ns, key=lambda one: lengths_ns[one])
    begins = {int(stamps[0]) for stamps in read.values()}
    if len(begins) > 1 and len({*lengths_ns.values()}) == 1:
        first = found['mark'].iloc[0].join(parts.iloc[0].tolist())
        return Dates(day_ns, 'times of day', True,
                     f'the date {first} can be read in two ways, so it was left out')
    return Dates(read[order], f'dates, {_ORDERS[order]}')


def days_as_ns(days: FloatArray) -> IntArray | None:
    """
    Return the days of a spreadsheet or of MATLAB in nanoseconds from 1970.

    None where the numbers are neither, or not 0.5 to 50 000 a second. A spreadsheet holds a
    time to 0.6 µs.
    """
    steps = np.diff(days)
    usual = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    if not _LEAST_STEP_DAYS <= usual <= _MOST_STEP_DAYS:
        return None
    for origin, (low, high) in ((_SPREADSHEET, _SPREADSHEET_DAYS), (_MATLAB, _MATLAB_DAYS)):
        if low <= float(days.min()) and float(days.max()) <= high:
            whole = np.floor(days)
            part_ns = np.round((days - whole) * (DAY_NS / 1000)) * 1000
            return (whole.astype(np.int64) + origin) * DAY_NS + part_ns.astype(np.int64)
    return None

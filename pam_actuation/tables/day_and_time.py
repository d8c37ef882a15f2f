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

"""A date in one column and the time of day in another: together they are the time."""

from dataclasses import replace
import re
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.tables.dates import Dates, dates_of, PATTERN
from pam_actuation.tables.formats.labview import X_VALUE
from pam_actuation.tables.signals import is_time
from pam_actuation.tables.table import Table
from pam_actuation.tables.words import words_of

if TYPE_CHECKING:
    import pandas as pd

# A spreadsheet has dates at midnight.
_DATE = re.compile(r'\s*(\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4})([T ]00:00(:00(\.0+)?)?)?\s*')
_MOST_DAYS = 1000


def is_called_time(table: Table, column: str) -> bool:
    """Return whether the name of a column says that it is a time or a date."""
    title = table.title_of(column)
    if _says_time(title, table.columns[column]):
        return True
    # `fast.t` of a file with groups, which has no lines.
    return table.lines is None and not table.topic and '.' in title and _says_time(
        leaf_of(title), table.columns[column])


def leaf_of(title: str) -> str:
    """Return the last part of the name of a column in a group: ``t`` of ``fast.t``."""
    return title.rpartition('.')[2]


def _says_time(title: str, values: 'pd.Series') -> bool:
    words = words_of(title)
    # Of several languages, and anything in others.
    dated = ' '.join('date' if word in ('data', 'dato') else word for word in words.split())
    return title == X_VALUE or is_time(words) or is_time(dated) and (
        'time' in words or holds_dates(values))


def holds_dates(values: 'pd.Series') -> bool:
    """Return whether a column holds dates without a time of day, and nothing else."""
    import pandas as pd
    if pd.api.types.is_datetime64_any_dtype(values):
        return bool(len(values) and (values.dt.normalize() == values).all())
    if pd.api.types.is_numeric_dtype(values) or not len(values) or not _DATE.fullmatch(
            str(values.iloc[0])):
        return False
    days = values.unique()
    return len(days) <= _MOST_DAYS and all(_DATE.fullmatch(str(one)) for one in days)


def holds_times_of_day(values: 'pd.Series') -> bool:
    """Return whether a column begins with a time of day without a date."""
    found = re.match(PATTERN, str(values.iloc[0])) if len(values) else None
    return found is not None and found['first'] is None


def pair_of(table: Table, column: str) -> tuple[str, str] | None:
    """
    Return the columns of the date and of the time of day, one of which is given.

    None where the other one is missing, or there are several.
    """
    given = table.columns[column]
    if not (holds_dates(given) or holds_times_of_day(given)):
        return None
    wanted = holds_times_of_day if holds_dates(given) else holds_dates
    found = [name for name, values in table.columns.items()
             if name != column and is_called_time(table, name) and wanted(values)]
    if len(found) != 1:
        return None
    return (column, found[0]) if wanted is holds_times_of_day else (found[0], column)


def dates_of_pair(table: Table, date: str, time: str) -> Dates | int:
    """Return the times of two columns, or the first row that holds none."""
    days, times = table.columns[date], table.columns[time].astype(str)
    texts = days.astype(str).str.extract(_DATE, expand=True)[0]
    if texts.isna().any():
        return int(np.flatnonzero(texts.isna().to_numpy())[0])
    found = dates_of(texts + ' ' + times)
    if isinstance(found, int) or texts.nunique() > 1:
        return found
    # One date on all rows is that of the start: after midnight the times go on.
    of_day = dates_of(times, dated=True)
    if isinstance(of_day, int):
        return of_day
    begin_ns = found.stamp_ns[0] - of_day.stamp_ns[0]
    return replace(found, stamp_ns=begin_ns + of_day.stamp_ns)

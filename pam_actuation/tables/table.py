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

"""A table that another program wrote: named columns, and the line where its rows begin."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
import re
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.tables.thousands import are_marked, marks_of, SENTENCE
from pam_actuation.tables.units import FACTORS, unit_of_text
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.errors import did_you_mean, InputError

if TYPE_CHECKING:
    import pandas as pd

MOST_ROWS = 5_000_000
_WITH_UNIT = re.compile(r'[+-]?\d[\d.,]*(?:[eE][+-]?\d+)?\s*([^\s\d.,].*)')


@dataclass
class Table:
    """
    Columns of equal length.

    Parameters
    ----------
    source : str
        The file, for messages.
    columns : dict of str to pandas.Series
        In the order of the file; a column without a name is called ``#1``, ``#2``, …
    units : dict of str to str
        What a row of units says, by column.
    lines : ndarray of int64, optional
        Line of every row in a text file; without it rows are counted.
    stamp_ns : ndarray of int64, optional
        Time of every row, where the file itself gives one, as a bag does.
    remarks : list of str
        What was odd about the file.
    numbered : ndarray of int64, optional
        Number of every row in the file from 0, where rows between were left out.
    called : dict of str to str
        What the file calls a column whose name stands twice; its own is its number. Also what a
        column is called within the struct that holds all columns of a file.
    decimal : str
        Decimal sign of numbers that are held as texts.
    topic : str
        Of a bag, whose rows are messages; '' for other files.
    by_type : set of str
        Columns whose unit the type of the message states.
    aliases : dict of str to str
        Other names of columns.

    """

    source: str
    columns: 'dict[str, pd.Series]'
    units: dict[str, str] = field(default_factory=dict)
    lines: IntArray | None = None
    stamp_ns: IntArray | None = None
    remarks: list[str] = field(default_factory=list)
    numbered: IntArray | None = None
    called: dict[str, str] = field(default_factory=dict)
    decimal: str = '.'
    topic: str = ''
    by_type: set[str] = field(default_factory=set)
    aliases: dict[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(next(iter(self.columns.values()))) if self.columns else 0

    def name_of(self, wanted: str) -> str | None:
        """Return the column that ``wanted`` means: a name, or a number such as ``#3``."""
        wanted = self.aliases.get(wanted, wanted)
        if wanted in self.columns:
            return wanted
        if re.fullmatch(r'#\d+', wanted):
            place = int(wanted[1:]) - 1
            return list(self.columns)[place] if 0 <= place < len(self.columns) else None
        plain = wanted.strip().lower()
        alike = [name for name in self.columns if name.strip().lower() == plain]
        return alike[0] if len(alike) == 1 else None

    def require(self, wanted: str, where: str = '') -> str:
        """Return the column that ``wanted`` means; InputError names those there are."""
        name = self.name_of(wanted)
        if name is None:
            raise InputError(no_column(wanted, self.columns), where or self.source)
        return name

    def title_of(self, column: str) -> str:
        """Return what stands above a column in the file, also where it stands there twice."""
        return column.startswith('#') and self.called.get(column, '') or column

    def place(self, row: int) -> str:
        """Return where a row stands, for people: file and line, or file and row or message."""
        if self.lines is not None:
            return f'{self.source}:{self.lines[row]}'
        number = 1 + (row if self.numbered is None else int(self.numbered[row]))
        if self.topic:
            return f'{self.source}, {self.topic}, message {number}'
        return f'{self.source}, row {number}'

    def begins_with_text(self, name: str) -> bool:
        """Return whether the first value of a column is no number."""
        first = self.columns[name].iloc[0] if len(self) else ''
        return isinstance(first, str) and bool(first.strip()) and (
            _number(first.replace(self.decimal, '.')) is None and not are_marked(first))

    def numbers(self, name: str, missing: Collection[str] = ()) -> FloatArray:
        """
        Return a column as float64, shape (rows,); NaN where it is empty or says ``missing``.

        Raises
        ------
        InputError
            A value that is no number.

        """
        import pandas as pd
        column = self.columns[name]
        if not pd.api.types.is_numeric_dtype(column) or pd.api.types.is_bool_dtype(column):
            texts = column.astype(object)
            empty = column.isna() | texts.map(
                lambda one: isinstance(one, str) and one.strip() in {'', *missing})
            values = pd.to_numeric(
                self._pointed(texts.where(~empty, None)), errors='coerce')
            wrong = np.flatnonzero(values.isna().to_numpy() & ~empty.to_numpy())
            if len(wrong):
                text = str(texts.iloc[wrong[0]])
                raise InputError(
                    f'column "{name}" holds {_short(text)}, which is no number; '
                    f'{_number_fix(text, self.decimal, name)}', self.place(int(wrong[0])))
            column = values
        numbers = column.to_numpy(dtype=np.float64, na_value=np.nan)
        lacking = [value for value in map(_number, missing) if value is not None]
        return np.where(np.isin(numbers, lacking), np.nan, numbers) if lacking else numbers

    def _pointed(self, values: 'pd.Series') -> 'pd.Series':
        """Return texts with a decimal point, and without marks between thousands."""
        marks = marks_of((one for one in values.array if isinstance(one, str)), self.decimal)
        return values.map(lambda one: one if not isinstance(one, str) else marks.plain(one)
                          if marks else one.replace(self.decimal, '.'))


def no_column_in(tables: Iterable[Table], wanted: str) -> str:
    """Return the sentence that no table has a column, with the names of those there are."""
    return no_column(wanted, list(dict.fromkeys(
        column for table in tables for column in table.columns)))


def no_column(wanted: str, columns: Collection[str]) -> str:
    """Return the sentence that a column is not there, with the names of those that are."""
    shown = ', '.join(f'"{name}"' for name in list(columns)[:20])
    more = f' and {len(columns) - 20} more' if len(columns) > 20 else ''
    hint = did_you_mean(wanted, columns, quote='"')
    return f'there is no column "{wanted}"{hint}; columns are {shown}{more}, or #1 for the first'


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _short(text: str) -> str:
    return repr(text if len(text) <= 30 else f'{text[:30]}…')


def _number_fix(text: str, decimal: str, name: str) -> str:
    if text.strip() == name:
        return 'a second table begins here: split the file'
    if are_marked(text):
        return SENTENCE
    if decimal == '.' and re.fullmatch(r'\s*[+-]?[\d.]*,\d+\s*', text):
        return 'the file mixes decimal points and commas: write one of them everywhere'
    with_unit = _WITH_UNIT.fullmatch(text.strip())
    if with_unit and any(unit_of_text(with_unit[1], quantity) for quantity in FACTORS):
        return (f'the cells hold their unit: write the numbers alone, and {with_unit[1]} in the '
                'name of the column')
    return f'if it stands for a missing value, add --missing {_short(text.strip())}'

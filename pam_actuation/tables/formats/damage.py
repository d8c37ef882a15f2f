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

"""What can be damaged within a text file: zero bytes, open quotes, rows that lack fields."""

from collections.abc import Iterator
import re
from typing import NamedTuple, TextIO, TYPE_CHECKING

import numpy as np
from pam_actuation.tables.formats.layout_of_text import COMMENTS, split, TextLayout
from pam_actuation.tables.thousands import POINTS, SENTENCE
from pam_sim.annotations import BoolArray, IntArray
from pam_sim.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

LONGEST_FIELD = 1000             # characters of a field that is looked at as a whole
NOT_CLOSED = ('a quotation mark is not closed here, so the rows below would be lost; delete it, '
              'or close the quotes in the same line')
MOST_SHORT = 0.01                # share of rows that lack fields and may be left out
FEW_SHORT = 3                    # so many may be left out of any file


class WatchedText:
    """
    A text file that is refused where zero bytes come, for reading with pandas.

    Parameters
    ----------
    stream : TextIO
        Opened with ``newline=''``.
    path : str
        For messages.
    layout : TextLayout
        Of the file; with decimal commas, points between thousands are refused too.

    Attributes
    ----------
    line : int
        Line that was reached, counted from 1.
    last : str
        The last character that was read.

    """

    def __init__(self, stream: TextIO, path: str, layout: TextLayout) -> None:
        self._stream, self._path, self._layout = stream, path, layout
        self.line, self.last = 1, ''
        self._field = ''                # the last field of the text before, which may go on
        separator = '' if layout.separator == r'\s+' else re.escape(layout.separator)
        self._between = re.compile(rf'[{separator}\s"]')
        self._marked = re.compile(
            rf'(?<![^{separator}\s"]){POINTS}(?![^{separator}\s"])')

    def read(self, size: int = -1) -> str:
        """Return the next characters; InputError where there are zero bytes."""
        text = self._stream.read(size)
        zero = text.find('\0')
        if zero >= 0:
            raise InputError(
                'holds zero bytes, as after a power cut; delete the damaged lines',
                f'{self._path}:{self.line + _ends(text[:zero])}')
        if self._layout.decimal == ',':
            self._refuse_thousands(text)
        if text:
            self.line, self.last = self.line + _ends(text), text[-1]
        return text

    def _refuse_thousands(self, text: str) -> None:
        """Raise InputError at 41.200 beside decimal commas: pandas would read 41.2."""
        whole, self._field = self._field + text, ''
        if text:                                    # the file goes on
            more = len(whole) - LONGEST_FIELD
            ends = [one.end() for one in self._between.finditer(whole, max(0, more))]
            end = ends[-1] if ends else len(whole) if more > 0 else 0
            whole, self._field = whole[:end], whole[end:]
        if '.' not in whole:
            return
        for found in self._marked.finditer(whole):
            line = self.line + _ends(whole[:found.start()])
            if line >= self._layout.first_line:
                raise InputError(
                    f'{found[0]!r} stands beside numbers with decimal commas: {SENTENCE}',
                    f'{self._path}:{line}')

    def __iter__(self) -> Iterator[str]:
        """Return the lines that are left."""
        return iter(self._stream)


def _ends(text: str) -> int:
    return max(text.count('\n'), text.count('\r'))


class WholeRows(NamedTuple):
    """Rows that are kept, of those the number of each from 0, and what was left out."""

    kept: BoolArray
    numbered: IntArray | None
    remarks: list[str]


def check_quotes(frame: 'pd.DataFrame', lines: IntArray, path: str) -> None:
    """Raise InputError where a field runs over several lines, since rows are lost in it."""
    import pandas as pd
    first = len(frame)
    for place in frame.columns:
        if pd.api.types.is_numeric_dtype(frame[place]):
            continue
        broken = np.flatnonzero([isinstance(one, str) and ('\n' in one or '\r' in one)
                                 for one in frame[place].array])
        first = min(first, *broken[:1]) if len(broken) else first
    if first < len(frame):
        raise InputError(NOT_CLOSED, f'{path}:{lines[first]}')


def whole_rows(frame: 'pd.DataFrame', lines: IntArray, layout: TextLayout, stream: TextIO,
               path: str) -> WholeRows:
    """
    Return which rows have all their fields.

    Empty lines, and comments that stand between the rows, are no rows. A row that lacks fields
    is left out, since nobody knows which field is missing.

    Parameters
    ----------
    frame : pandas.DataFrame
        As read; fields that a row lacks are missing values.
    lines : ndarray of int64
        Line of every row.
    layout : TextLayout
        Of the file.
    stream : TextIO
        The file from its beginning, opened with ``newline=''``.
    path : str
        For messages.

    Raises
    ------
    InputError
        More rows lack fields than an accident leaves.

    """
    is_row = ~frame.isna().all(axis=1).to_numpy()
    last = frame.columns[-1 - layout.optional]
    doubtful = np.flatnonzero(frame[last].isna().to_numpy() & is_row)
    if not len(doubtful):
        return WholeRows(is_row, None, [])
    count, comments, short = len(layout.names) - layout.optional, [], []
    rows = dict(zip(lines[doubtful].tolist(), doubtful.tolist()))
    for number, line in enumerate(stream, 1):
        row = rows.get(number)
        if row is not None:
            if line.lstrip().startswith(COMMENTS):
                comments.append(row)
            elif len(split(line, layout.separator)) < count:
                short.append(row)
    is_row[comments] = False
    if len(short) > max(FEW_SHORT, MOST_SHORT * int(is_row.sum())):
        raise InputError(
            f'the row has fewer fields than the {count} columns, and so have {len(short)} in all; '
            'was the layout changed within the file? Split it there, or write empty fields',
            f'{path}:{lines[short[0]]}')
    numbered = np.cumsum(is_row) - 1
    kept = is_row.copy()
    kept[short] = False
    remarks = []
    if comments:
        remarks.append(f'comments between the rows: {len(comments)} lines, not read')
    if short:
        remarks.append(f'rows that lack fields: {len(short)}, the first in line '
                       f'{lines[short[0]]}; they were left out')
    return WholeRows(kept, numbered[kept], remarks)

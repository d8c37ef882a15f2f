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
"""Workbooks of Excel and LibreOffice (``.xlsx``), read and written with openpyxl."""

from collections.abc import Callable, Collection
from datetime import date, datetime, time
from functools import partial
import io
import math
import re
from typing import Any, TYPE_CHECKING
import zipfile

from pam_actuation.tables.formats import delimited, needs
from pam_actuation.tables.table import Table
from pam_sim.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

_PERCENT = re.compile(r'%|\b(pct|percent|prozent)\b|_pct\b', re.IGNORECASE)


def read(path: str, every: int, wanted: Collection[str] | None,
         progress: Callable[[float], object]) -> list[Table]:
    """
    Return the table of each sheet that holds rows of numbers.

    A sheet is read as the text it would be saved as, so names, units and settings above the rows
    are found as in a CSV file. See ``formats.read_tables``.
    """
    sheets = sheets_of(path)
    tables: list[Table] = []
    problems: dict[int, InputError] = {}        # by length of the sheet
    for number, (title, text) in enumerate(sheets.items()):
        try:
            tables += delimited.tables_of_text(
                f'{path}, sheet {title}', partial(io.BytesIO, text), len(text), every,
                lambda _: None)
            progress((number + 1) / len(sheets))
        except InputError as error:
            problems[len(text)] = error
    if not tables and problems:
        raise problems[max(problems)]
    return tables


def sheets_of(path: str) -> dict[str, bytes]:
    """
    Return each sheet of a workbook as text with tabs between its cells, by title.

    Raises
    ------
    InputError
        It is no workbook that can be read, or openpyxl is missing.

    """
    openpyxl = needs('openpyxl', 'openpyxl', 'an Excel file')
    try:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        sheets = {sheet.title: _as_text(sheet) for sheet in book.worksheets}
        book.close()
    except (zipfile.BadZipFile, KeyError, ValueError, OSError, TypeError,
            openpyxl.utils.exceptions.InvalidFileException) as error:
        raise InputError(f'is no readable Excel file: {error}', path) from None
    return sheets


def _as_text(sheet: Any) -> bytes:
    """Return a sheet with tabs between its cells, a line for each row, without empty edges."""
    rows: list[list[str]] = []
    in_percent: set[int] = set()        # columns above whose numbers stands a text with %
    for cells in sheet.iter_rows():
        row = []
        for place, cell in enumerate(cells):
            value = cell.value
            if isinstance(value, str) and _PERCENT.search(value):
                in_percent.add(place)
            elif place in in_percent and isinstance(value, float | int) and '%' in (
                    cell.number_format or ''):
                value = float(f'{100.0 * value:.15g}')          # a sheet that shows 50 % has 0.5
            row.append(_cell(value))
        rows.append(row)
    used = [place for row in rows for place, text in enumerate(row) if text]
    if not used:
        return b''
    first, last = min(used), max(used)
    while rows and not any(rows[-1]):
        rows.pop()
    short = [''] * last                 # a row may end with its last cell that is not empty
    return ''.join('\t'.join((row + short)[first:last + 1]) + '\n' for row in rows).encode()


def _cell(value: Any) -> str:
    """Return the text of a cell; numbers to their last bit, dates as ISO 8601."""
    if value is None or isinstance(value, bool):
        return '' if value is None else str(int(value))
    if isinstance(value, (datetime, date, time)):
        return value.isoformat()
    if isinstance(value, (int, float)):
        return repr(value)
    return ' '.join(str(value).replace('"', "'").split())


def write(frame: 'pd.DataFrame', path: str) -> None:
    """Write a data frame as the one sheet of a workbook, numbers to their last bit."""
    openpyxl = needs('openpyxl', 'openpyxl', 'an Excel file')
    most = 1_048_575                # rows of a sheet below the names
    if len(frame) > most:
        raise InputError(f'has {len(frame)} rows; a sheet holds {most}. Export fewer with '
                         '--rate, or another kind of file', path)
    book = openpyxl.Workbook(write_only=True)
    sheet = book.create_sheet('Sheet1')
    number = partial(_number, openpyxl.cell.WriteOnlyCell, sheet)
    sheet.append([str(name) for name in frame.columns])
    # Whole numbers beyond 2^53 would lose digits in a spreadsheet: stamps go as texts.
    columns = [map(number if frame[name].dtype.kind == 'f' else str, frame[name].tolist())
               for name in frame.columns]
    for row in zip(*columns):
        sheet.append(row)
    book.save(path)


def _number(cell_of: Callable[[Any, str], Any], sheet: Any, value: float) -> Any:
    """Return a cell that holds all digits of a number; openpyxl writes 16 of a float."""
    if not math.isfinite(value):
        return None
    cell = cell_of(sheet, repr(value))
    cell.data_type = 'n'
    return cell

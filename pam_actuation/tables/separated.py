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

"""Rows of a table of points, whatever separator and decimal sign its program writes."""

import csv
from pathlib import Path
import re

from pam_actuation.tables.formats.layout_of_text import encoding_of, layout_of, split
from pam_actuation.tables.thousands import POINTS, SENTENCE
from pam_sim.errors import InputError
from pam_sim.files import refuse_pipe, StrPath
from pam_sim.muscle.lookup_table import lines_and_source

EXCEL = '.xlsx'
ENDINGS = ('.csv', '.tsv', '.txt', EXCEL)          # of tables of points


def rows_of_text(path: StrPath) -> tuple[list[list[str]], str]:
    """
    Return (rows, text of the ``#`` lines), as ``read_commented_csv`` does, of any separator.

    Encoding, separator and decimal sign are found as ``pam import`` finds them. Numbers have
    decimal points in the result. Of an Excel file the one sheet that is not empty is read.

    Raises
    ------
    InputError
        The file cannot be read as text, has several sheets, or a number such as 1.016 stands
        beside decimal commas.

    """
    refuse_pipe(path)
    if str(path).lower().endswith(EXCEL):
        raw = _only_sheet(str(path))
    else:
        try:
            raw = Path(path).read_bytes()
        except OSError as error:
            raise InputError(f'cannot be read as a table: {error}', str(path)) from None
    text = raw.decode(encoding_of(raw, str(path)), errors='replace').removeprefix('\ufeff')
    lines, source = lines_and_source(text.splitlines())
    try:
        layout = layout_of('\n'.join([*lines, '']).encode(), str(path))
    except InputError:
        # With what is wrong in the cells, whoever reads them can say more.
        return list(csv.reader(lines)), source
    if (layout.separator, layout.decimal) in ((',', '.'), (',', ',')) or layout.first_line < 2:
        rows = list(csv.reader(lines))
    else:
        rows = [split(line, layout.separator) for line in lines[layout.first_line - 2:]]
    if layout.decimal == ',':
        for number, row in enumerate(rows[1:], 1):
            wrong = next((cell for cell in row if re.fullmatch(POINTS, cell.strip())), None)
            if wrong is not None:
                raise InputError(f'data row {number}: {wrong.strip()!r} stands beside numbers '
                                 f'with decimal commas: {SENTENCE}', str(path))
        rows[1:] = [[cell.replace(',', '.') for cell in row] for row in rows[1:]]
    return rows, source


def _only_sheet(path: str) -> bytes:
    """Return the sheet of a workbook that is not empty, as text with tabs."""
    from pam_actuation.tables.formats.workbook import sheets_of
    held = {title: text for title, text in sheets_of(path).items() if text}
    if len(held) != 1:
        names = ', '.join(f'"{title}"' for title in held)
        raise InputError(f'has {len(held)} sheets that hold cells'
                         + (f', {names}: save that of the table as CSV' if held else ''), path)
    return next(iter(held.values()))

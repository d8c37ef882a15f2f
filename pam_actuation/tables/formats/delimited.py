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

"""Text files with separators: CSV and its relatives."""

import bz2
from collections.abc import Callable, Collection, Iterator
import contextlib
import gzip
import io
import lzma
import os
import re
from typing import Any, TYPE_CHECKING
import zlib

import numpy as np
from pam_actuation.tables.formats.damage import (
    check_quotes, NOT_CLOSED, WatchedText, whole_rows)
from pam_actuation.tables.formats.labview import header_rows, X_VALUE
from pam_actuation.tables.formats.layout_of_text import layout_of, SAMPLE_BYTES, TextLayout
from pam_actuation.tables.formats.serial_log import serial_log
from pam_actuation.tables.table import MOST_ROWS, Table
from pam_sim.annotations import IntArray
from pam_sim.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

Opened = Callable[[], Any]
_OPEN: dict[str, Callable[..., Any]] = {'.gz': gzip.open, '.bz2': bz2.open, '.xz': lzma.open}
_CHUNK_ROWS = 250_000
_FIELD, _FLUID = 'field.', 'field.fluid_pressure'
_PACKED_FACTOR = 6                       # how much longer a packed text may be


def read(path: str, every: int, wanted: Collection[str] | None,
         progress: Callable[[float], object]) -> list[Table]:
    """Return the table of a text file; see ``formats.read_tables``."""
    ending = os.path.splitext(path)[1].lower()
    size = os.path.getsize(path) * (_PACKED_FACTOR if ending in _OPEN else 1)
    return tables_of_text(path, lambda: _OPEN.get(ending, open)(path, 'rb'), size, every, progress,
                          is_packed=ending in _OPEN)


def tables_of_text(path: str, opened: Opened, size: float, every: int,
                   progress: Callable[[float], object], is_packed: bool = False) -> list[Table]:
    """
    Return the table of a text.

    Parameters
    ----------
    path : str
        Where it is, for messages.
    opened : callable
        Returns the text as a stream of bytes, from its beginning.
    size : float
        Its length in bytes, of a packed one about.
    every, progress
        As ``formats.read_tables``.
    is_packed : bool
        Whether the length is an estimate.

    Raises
    ------
    InputError
        As ``formats.read_tables``.

    """
    head = _head(path, opened)
    log = serial_log(head, path)
    if log is None:
        layout = layout_of(head, path)
    else:
        opened = log.opened(opened)
        layout = log.named(layout_of(_head(path, opened), path))
    rows = size / layout.line_bytes / every
    if rows > MOST_ROWS and not is_packed:
        raise InputError(
            f'has about {rows * every / 1e6:.0f} million rows, more than {MOST_ROWS // 10**6} '
            f'million; keep one of several, with --every {int(rows * every / MOST_ROWS) + 1}',
            path)
    frame, read, last = _frame(path, opened, layout, every, rows, progress)
    lines = layout.first_line + np.arange(len(frame), dtype=np.int64) * every
    check_quotes(frame, lines, path)
    if layout.is_lvm and (further := header_rows(frame[0])).any():
        if layout.step_s:
            raise InputError('a further segment begins here, and the rows hold no times; split '
                             'the file', f'{path}:{lines[int(np.argmax(further))]}')
        frame, lines = frame[~further], lines[~further]
    remarks = [layout.remark] if layout.remark else []
    if last not in '\r\n' and len(frame) > 1 and lines[-1] == layout.first_line + read - 1:
        frame, lines = frame.iloc[:-1], lines[:-1]
        remarks.append('the last line has no end, so it may be incomplete: it was left out')
    with opened() as raw:
        found = whole_rows(frame, lines, layout, io.TextIOWrapper(
            raw, layout.encoding, newline=''), path)
    frame, lines = frame[found.kept], lines[found.kept]
    columns = {name: frame[place] for place, name in enumerate(layout.names)}
    for name in layout.names[len(layout.names) - layout.optional:]:
        if columns[name].isna().all():
            del columns[name]
    units = dict(zip(layout.names, layout.units))
    if layout.step_s:
        numbers = np.arange(len(frame)) if found.numbered is None else found.numbered
        columns = {X_VALUE: _times(layout, every * numbers), **{
            name: values for name, values in columns.items() if name != X_VALUE}}
        units[X_VALUE] = 's'
    table = Table(path, columns, units, lines,
                  remarks=[*remarks, *found.remarks], numbered=found.numbered,
                  called=layout.called, decimal=layout.decimal)
    _name_fields(table)
    return [table]


def _name_fields(table: Table) -> None:
    """Call the columns of ``rostopic echo -p`` by the fields of the message."""
    of_message = list(table.columns)[1:]
    if not of_message or not all(name.startswith(_FIELD) for name in of_message):
        return
    table.called.update({name: name.removeprefix(_FIELD) for name in of_message})
    if {_FLUID, f'{_FIELD}variance'} <= set(of_message):         # sensor_msgs/FluidPressure
        table.units[_FLUID] = 'Pa'
        table.by_type.add(_FLUID)


def _times(layout: TextLayout, numbers: IntArray) -> 'pd.Series':
    """Return the times of rows that hold none, from their numbers [s]."""
    import pandas as pd
    return pd.Series(layout.first_s + layout.step_s * numbers)


def _head(path: str, opened: Opened) -> bytes:
    """Return the begin of the file, unpacked."""
    try:
        with opened() as stream:
            head: bytes = stream.read(SAMPLE_BYTES)
    except (EOFError, lzma.LZMAError, OSError, zlib.error) as error:
        raise InputError(f'cannot be unpacked: {error}', path) from None
    if not head.strip():
        raise InputError('is empty', path)
    return head


def _frame(path: str, opened: Opened, layout: TextLayout, every: int, expected_rows: float,
           progress: Callable[[float], object]) -> 'tuple[pd.DataFrame, int, str]':
    """Return one row of ``every``, how many were read, and the last character of the file."""
    import pandas as pd
    pieces: list[pd.DataFrame] = []
    done = 0
    with opened() as raw:
        text = WatchedText(io.TextIOWrapper(raw, layout.encoding, newline=''), path, layout)
        with _in_sentences(path, layout, text):
            reader = pd.read_csv(
                text, sep=layout.separator, decimal=layout.decimal,
                header=None, names=list(range(len(layout.names))), index_col=False,
                skiprows=layout.first_line - 1, skipinitialspace=True, low_memory=False,
                **_exact_numbers(pd.__version__),
                skip_blank_lines=False, chunksize=_CHUNK_ROWS, on_bad_lines='error')
            for piece in reader:
                # A copy: a slice alone would keep the rows between in memory.
                pieces.append(piece.iloc[-done % every::every].copy() if every > 1 else piece)
                done += len(piece)
                progress(min(done / max(expected_rows * every, 1.0), 1.0))
                if sum(map(len, pieces)) > MOST_ROWS:
                    raise InputError(
                        f'has more than {MOST_ROWS // 10**6} million rows; keep one of several, '
                        'with --every 10', path)
    return pd.concat(pieces, ignore_index=True), done, text.last


@contextlib.contextmanager
def _in_sentences(path: str, layout: TextLayout, text: WatchedText) -> Iterator[None]:
    """Turn what a text is refused with into one sentence, with the place in the file."""
    import pandas as pd
    try:
        yield
    except pd.errors.ParserError as error:
        raise _row_error(str(error), path, layout.first_line, len(layout.names)) from None
    except pd.errors.EmptyDataError:
        raise InputError('holds no rows of numbers', path) from None
    except UnicodeError as error:
        raise InputError(
            f'is no text in {layout.encoding} throughout: {error}; save it as UTF-8',
            f'{path}, after line {text.line}') from None
    except (EOFError, lzma.LZMAError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f'cannot be unpacked: {error}', f'{path}, after line {text.line}'
                         ) from None


def _exact_numbers(version: str) -> dict[str, Any]:
    """Return what makes pandas read a number to its last bit; new versions always do."""
    major, minor, *_ = (int(one) for one in re.findall(r'\d+', version))
    return {} if (major, minor) >= (3, 1) else {'float_precision': 'round_trip'}


def _row_error(text: str, path: str, first_line: int, count: int) -> InputError:
    """Return the error of a row with too many fields, with its line in the file."""
    found = re.search(r'in line (\d+), saw (\d+)', text)
    opened = re.search(r'EOF inside string starting at row (\d+)', text)
    if opened:
        raise InputError(NOT_CLOSED, f'{path}:{int(opened[1]) + first_line}')
    if not found:
        return InputError(f'cannot be read as a table: {text}', path)
    return InputError(
        f'the row has {found[2]} fields, those above have {count}; is it damaged, or does '
        f'another table begin here?', f'{path}:{int(found[1])}')


def write(frame: 'pd.DataFrame', path: str) -> None:
    """Write a data frame as CSV, or with tabs for ``.tsv``; every number to its last bit."""
    frame.to_csv(path, index=False, sep='\t' if path.lower().endswith('.tsv') else ',')

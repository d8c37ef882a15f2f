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

"""The header of a LabVIEW Measurement file (``.lvm``), which says how its rows are laid out."""

from collections.abc import Sequence
from typing import NamedTuple, TYPE_CHECKING

import numpy as np
from pam_actuation.tables.words import unit_in
from pam_sim.annotations import BoolArray

if TYPE_CHECKING:
    import pandas as pd

_BEGIN, _SEGMENT, _END = 'LabVIEW Measurement', 'Channels', '***End_of_Header***'
X_VALUE, _COMMENT = 'X_Value', 'Comment'


class LvmHeader(NamedTuple):
    """
    What the header of a LabVIEW Measurement file says.

    Parameters
    ----------
    separator, decimal : str
        Of fields, and of numbers.
    begin : int
        How many lines stand above the rows.
    names, units : tuple of str
        Of the columns; a unit is '' where the file states none.
    optional : int
        How many of the last columns a row may lack: 1 with a column of comments.
    first_s, step_s : float
        Time of the first row and between rows, where the rows hold no time; else the step is 0.

    """

    separator: str
    decimal: str
    begin: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    optional: int
    first_s: float
    step_s: float


def lvm_header(lines: Sequence[str]) -> LvmHeader | None:
    """
    Return what the header of a LabVIEW Measurement file says, None for another file.

    Parameters
    ----------
    lines : sequence of str
        The beginning of the file.

    """
    if not lines or not lines[0].strip().startswith(_BEGIN):
        return None
    said = next((line for line in lines if line.startswith('Separator')), '')
    separator = ',' if 'Comma' in said else '\t'
    rows = [[one.strip() for one in line.split(separator)] for line in lines]
    ends = [number for number, row in enumerate(rows) if row[0] == _END]
    at = next((number for number in range(ends[0], len(rows)) if rows[number][0] == X_VALUE),
              0) if ends else 0
    if not at or at + 1 >= len(rows):
        return None
    keys = {row[0]: row[1:] for row in rows[:at] if row[0]}
    decimal = (keys.get('Decimal_Separator') or ['.'])[0] or '.'
    names = _without_empty(rows[at])
    optional = int(names[-1] == _COMMENT)
    row = rows[at + 1]
    no_time = (keys.get('X_Columns') or [''])[0] == 'No'
    if no_time and row[0]:                          # the rows begin with the first channel
        names = names[1:]
    count = len(names) - optional
    step_s = _first_number(keys, 'Delta_X', decimal) if no_time else 0.0
    return LvmHeader(separator, decimal, at + 1, tuple(names), _units(names, keys, count),
                     optional, _first_number(keys, 'X0', decimal), step_s)


def header_rows(first: 'pd.Series') -> BoolArray:
    """
    Return which rows are of a further header, as each segment of a file may have one.

    Parameters
    ----------
    first : pandas.Series
        The first column.

    """
    if first.dtype.kind in 'biuf':
        return np.zeros(len(first), dtype=bool)
    texts = first.astype(str).str.strip()
    begun, done = (texts == _SEGMENT).cumsum(), (texts == X_VALUE).cumsum()
    inside: BoolArray = ((begun > done) | (texts == X_VALUE)).to_numpy(dtype=bool)
    return inside


def _without_empty(fields: list[str]) -> list[str]:
    """Return fields without empty ones at the end."""
    return fields[:next((len(fields) - place for place, one in enumerate(reversed(fields))
                         if one), 0)]


def _units(names: list[str], keys: dict[str, list[str]], count: int) -> tuple[str, ...]:
    """
    Return the unit of each column, '' where there is none or the name states one.

    Those of the channels stand in the header in their order.
    """
    channels = iter(keys.get('Y_Unit_Label', []))
    is_time = (keys.get('X_Dimension') or ['Time'])[0] in ('', 'Time')
    said = [('s' if is_time else '') if name == X_VALUE else next(channels, '')
            for name in names[:count]]
    return tuple('' if unit_in(name) else unit for name, unit in zip(names, [*said, '']))


def _first_number(keys: dict[str, list[str]], key: str, decimal: str) -> float:
    """Return the number of the first channel, 0 where there is none."""
    try:
        return float(keys[key][0].replace(decimal, '.'))
    except (KeyError, IndexError, ValueError):
        return 0.0

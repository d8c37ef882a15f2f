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

"""Arrays of a MAT or HDF5 file to tables: those of one length belong together."""

from collections.abc import Iterable, Mapping
import os
import re
from typing import Any, NamedTuple

import numpy as np
from pam_actuation.tables.table import Table

SHORTEST = 2                    # rows: shorter arrays are settings
MOST = 64                       # columns of one array, and signals of one list
_PORT = re.compile(r'(?<=.)/(Out|In)\d+$')         # of a block of Simulink


class Title(NamedTuple):
    """
    What a file says of the signal that an array holds.

    Parameters
    ----------
    name : str
        As it is written, such as ``Model Root/Pressure``.
    unit : str
        '' where none is stated.

    """

    name: str
    unit: str = ''


def tables_of(source: str, arrays: Iterable[tuple[str, Any]], every: int,
              titles: Mapping[str, Title] | None = None) -> list[Table]:
    """
    Return one table for each length of the arrays, the longest first.

    A two-dimensional array becomes one column for each index of its shorter side, named
    ``data[0]``, ``data[1]``, …; one with named fields becomes ``data.pressure``, and so on. Where
    one struct or group holds all columns, each is called without it.

    Parameters
    ----------
    source : str
        The file, for messages.
    arrays : iterable of (str, array)
        Name and values.
    every : int
        One row of so many is kept.
    titles : dict of str to Title, optional
        By the name of an array, what its column is called instead.

    """
    import pandas as pd
    by_length: dict[int, dict[str, Any]] = {}
    for name, column in columns_of(arrays):
        if len(column) >= SHORTEST:
            by_length.setdefault(len(column), {})[name] = pd.Series(column[::every])
    of_all = _struct_of([name for columns in by_length.values() for name in columns])
    tables = [Table(source, columns, called={
        name: name.removeprefix(of_all) for name in columns} if of_all else {})
        for _, columns in sorted(by_length.items(), reverse=True)]
    return [_titled(table, titles) for table in tables] if titles else tables


def _titled(table: Table, titles: Mapping[str, Title]) -> Table:
    """Return a table whose columns are called as the file says; the other names stay valid."""
    names: dict[str, str] = {}
    for name in table.columns:
        array, bracket, index = name.partition('[')
        title = titles.get(name, titles.get(array))
        if title is not None:
            own = title.name.replace('"', '').strip()
            new = own if name in titles else f'{own}{bracket}{index}'
            names[name] = new
            table.aliases[name] = new
            table.called[name] = _PORT.sub('', new)
            if title.unit:
                table.units[name] = title.unit
    for field in ('columns', 'called', 'units'):
        setattr(table, field, {names.get(name, name): value
                               for name, value in getattr(table, field).items()})
    return table


def _struct_of(names: list[str]) -> str:
    """Return the struct that holds all columns, such as ``data.``; '' where there is none."""
    common = os.path.commonprefix([name.split('.')[:-1] for name in names])
    return ''.join(f'{one}.' for one in common)


def columns_of(arrays: Iterable[tuple[str, Any]]) -> Iterable[tuple[str, Any]]:
    """Return the name and values, shape (rows,), of every column of numbers."""
    for name, array in arrays:
        values = np.squeeze(np.asarray(array))
        if values.dtype.names is not None and values.ndim == 1:
            yield from columns_of((f'{name}.{part}', values[part]) for part in values.dtype.names)
        elif values.dtype.kind in 'bifu' and values.ndim == 1:
            yield name, _native(values)
        elif values.dtype.kind in 'bifu' and values.ndim == 2 and min(values.shape) <= MOST:
            rows = values if values.shape[0] >= values.shape[1] else values.T
            for place in range(rows.shape[1]):
                yield f'{name}[{place}]', _native(rows[:, place])


def _native(values: Any) -> Any:
    """Return values in the byte order of this machine, which pandas needs."""
    return values.astype(values.dtype.newbyteorder('='), copy=False)

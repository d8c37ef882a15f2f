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

from collections.abc import Iterable
import os
from typing import Any

import numpy as np
from pam_actuation.tables.table import Table

SHORTEST = 2                    # rows: shorter arrays are settings


def tables_of(source: str, arrays: Iterable[tuple[str, Any]], every: int) -> list[Table]:
    """
    Return one table for each length of the arrays, the longest first.

    A two-dimensional array becomes one column for each index of its shorter side, named
    ``data[0]``, ``data[1]``, …; one with named fields becomes ``data.pressure``, and so on. Where
    one struct or group holds all columns, each is called without it.
    """
    import pandas as pd
    by_length: dict[int, dict[str, Any]] = {}
    for name, column in _columns(arrays):
        if len(column) >= SHORTEST:
            by_length.setdefault(len(column), {})[name] = pd.Series(column[::every])
    of_all = _struct_of([name for columns in by_length.values() for name in columns])
    return [Table(source, columns, called={
        name: name.removeprefix(of_all) for name in columns} if of_all else {})
        for _, columns in sorted(by_length.items(), reverse=True)]


def _struct_of(names: list[str]) -> str:
    """Return the struct that holds all columns, such as ``data.``; '' where there is none."""
    common = os.path.commonprefix([name.split('.')[:-1] for name in names])
    return ''.join(f'{one}.' for one in common)


def _columns(arrays: Iterable[tuple[str, Any]]) -> Iterable[tuple[str, Any]]:
    """Return the name and values, shape (rows,), of every column of numbers."""
    for name, array in arrays:
        values = np.squeeze(np.asarray(array))
        if values.dtype.names is not None and values.ndim == 1:
            yield from _columns((f'{name}.{part}', values[part]) for part in values.dtype.names)
        elif values.dtype.kind in 'bifu' and values.ndim == 1:
            yield name, _native(values)
        elif values.dtype.kind in 'bifu' and values.ndim == 2 and min(values.shape) <= 64:
            rows = values if values.shape[0] >= values.shape[1] else values.T
            for place in range(rows.shape[1]):
                yield f'{name}[{place}]', _native(rows[:, place])


def _native(values: Any) -> Any:
    """Return values in the byte order of this machine, which pandas needs."""
    return values.astype(values.dtype.newbyteorder('='), copy=False)

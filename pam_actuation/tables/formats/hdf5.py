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

"""HDF5 files, among them MAT files of version 7.3, read and written with h5py."""

from collections.abc import Callable, Collection
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.tables.formats import needs
from pam_actuation.tables.formats.arrays import tables_of
from pam_actuation.tables.formats.structs import OBJECTS, Struct, Walk
from pam_actuation.tables.table import Table
from pam_sim.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

_DEEPEST = 8
# Attributes that MATLAB writes.
_CLASS, _OBJECT, _EMPTY = 'MATLAB_class', 'MATLAB_object_decode', 'MATLAB_empty'


def read(path: str, every: int, wanted: Collection[str] | None,
         progress: Callable[[float], object]) -> list[Table]:
    """Return the tables of an HDF5 file; see ``formats.read_tables``."""
    h5py = needs('h5py', 'h5py', 'an HDF5 file, or a MAT file of version 7.3,')
    arrays: list[tuple[str, Any]] = []
    content: dict[str, Any] = {}

    def keep(name: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset) and not name.startswith('#refs#') and _is_numeric(node):
            arrays.append((name.replace('/', '.'), node[()]))

    try:
        with h5py.File(path, 'r') as file:
            objects = [OBJECTS] if any(_OBJECT in node.attrs for node in file.values()) else []
            if any(_CLASS in node.attrs for node in file.values()):
                content = _content_of(file, file, h5py, 0)
            else:
                file.visititems(keep)
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        raise InputError(f'is no readable HDF5 file: {error}', path) from None
    walk = Walk(content)
    tables = walk.tables(path, every) if content else tables_of(path, arrays, every)
    if objects and not tables:
        raise InputError(f'has no array; {OBJECTS}', path)
    for table in tables:
        table.remarks += objects + walk.remarks
    return tables


def _is_numeric(node: Any) -> bool:
    return node.ndim in (1, 2) and (node.dtype.names is not None or node.dtype.kind in 'bifu')


def _content_of(group: Any, file: Any, h5py: Any, depth: int) -> dict[str, Any]:
    """Return what a group that MATLAB wrote holds, by name, as ``scipy.io.loadmat`` gives it."""
    found = {name: _value_of(node, file, h5py, depth) for name, node in group.items()
             if not name.startswith('#')}
    return {name: value for name, value in found.items() if value is not None}


def _value_of(node: Any, file: Any, h5py: Any, depth: int) -> Any:
    """Return an array, a text, a struct or a list of what MATLAB wrote; None for anything else."""
    if depth > _DEEPEST or _OBJECT in node.attrs or _EMPTY in node.attrs:
        return None
    if isinstance(node, h5py.Group):
        columns = list(node.values())
        # Of a list of structs, each field refers to the values of all.
        if columns and all(isinstance(one, h5py.Dataset) and one.dtype == h5py.ref_dtype
                           and _CLASS not in one.attrs for one in columns):
            fields = {name: _elements(one, file, h5py, depth) for name, one in node.items()}
            return _listed([Struct(dict(zip(fields, row))) for row in zip(*fields.values())])
        return Struct(_content_of(node, file, h5py, depth + 1))
    if node.dtype == h5py.ref_dtype:
        return _listed(_elements(node, file, h5py, depth))
    if node.attrs.get(_CLASS) == b'char':
        return ''.join(map(chr, node[()].ravel())) if node.dtype.kind in 'iu' else None
    return node[()] if _is_numeric(node) else None


def _elements(node: Any, file: Any, h5py: Any, depth: int) -> list[Any]:
    """Return what the references of a data set refer to, in the order of MATLAB."""
    return [_value_of(file[one], file, h5py, depth + 1) for one in node[()].ravel()]


def _listed(values: list[Any]) -> Any:
    """Return values as an array of objects."""
    found = np.empty(len(values), dtype=object)
    for place, value in enumerate(values):
        found[place] = value
    return found


def write(frame: 'pd.DataFrame', path: str) -> None:
    """Write a data frame as an HDF5 file, one data set a column."""
    h5py = needs('h5py', 'h5py', 'an HDF5 file')
    with h5py.File(path, 'w') as file:
        for name in frame.columns:
            file.create_dataset(str(name), data=frame[name].to_numpy(), track_times=False)

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

from pam_actuation.tables.formats import needs
from pam_actuation.tables.formats.arrays import tables_of
from pam_actuation.tables.table import Table
from pam_sim.errors import InputError

if TYPE_CHECKING:
    import pandas as pd


def read(path: str, every: int, wanted: Collection[str] | None,
         progress: Callable[[float], object]) -> list[Table]:
    """Return the tables of an HDF5 file; see ``formats.read_tables``."""
    h5py = needs('h5py', 'h5py', 'an HDF5 file, or a MAT file of version 7.3,')
    arrays: list[tuple[str, Any]] = []

    def keep(name: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset) and not name.startswith('#refs#') and node.ndim in (
                1, 2) and (node.dtype.names is not None or node.dtype.kind in 'bifu'):
            arrays.append((name.replace('/', '.'), node[()]))

    try:
        with h5py.File(path, 'r') as file:
            file.visititems(keep)
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        raise InputError(f'is no readable HDF5 file: {error}', path) from None
    return tables_of(path, arrays, every)


def write(frame: 'pd.DataFrame', path: str) -> None:
    """Write a data frame as an HDF5 file, one data set a column."""
    h5py = needs('h5py', 'h5py', 'an HDF5 file')
    with h5py.File(path, 'w') as file:
        for name in frame.columns:
            file.create_dataset(str(name), data=frame[name].to_numpy(), track_times=False)

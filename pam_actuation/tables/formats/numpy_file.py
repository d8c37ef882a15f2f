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
"""NumPy files: ``.npz`` with an array for each column, ``.npy`` with one array."""

from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING
import zipfile

import numpy as np
from pam_actuation.tables.formats.arrays import tables_of
from pam_actuation.tables.table import Table
from pam_sim.errors import InputError

if TYPE_CHECKING:
    import pandas as pd


def read(path: str, every: int, wanted: Collection[str] | None,
         progress: Callable[[float], object]) -> list[Table]:
    """Return the tables of a NumPy file; see ``formats.read_tables``."""
    try:
        content = np.load(path, allow_pickle=False)
        if not isinstance(content, np.ndarray):
            arrays = [(name, content[name]) for name in content.files]
        elif content.dtype.names is not None:
            arrays = [(name, content[name]) for name in content.dtype.names]
        else:
            arrays = [(Path(path).stem, content)]
    except (ValueError, EOFError, OSError, zipfile.BadZipFile) as error:
        raise InputError(f'is no readable NumPy file: {error}', path) from None
    return tables_of(path, arrays, every)


def write(frame: 'pd.DataFrame', path: str) -> None:
    """Write a data frame, one array a column; as one array with named fields for ``.npy``."""
    if path.lower().endswith('.npy'):
        np.save(path, frame.to_records(index=False).view(np.ndarray), allow_pickle=False)
    else:
        np.savez(path, **{str(name): frame[name].to_numpy() for name in frame.columns})

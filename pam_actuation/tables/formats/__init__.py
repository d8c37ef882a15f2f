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

"""Kinds of files that hold tables, one module each: found by the ending of a file's name."""

from collections.abc import Callable, Collection
import importlib
import os
from pathlib import Path
import shlex
from typing import Any

import numpy as np
from pam_actuation.bags.layout import METADATA_FILE
from pam_actuation.tables.table import Table
from pam_sim.errors import InputError
from pam_sim.files import refuse_pipe, shown, StrPath

# Ending to the module that reads and writes it.
ENDINGS = {
    '.csv': 'delimited', '.tsv': 'delimited', '.txt': 'delimited', '.dat': 'delimited',
    '.asc': 'delimited', '.log': 'delimited', '.lvm': 'delimited', '.mot': 'delimited',
    '.sto': 'delimited', '.parquet': 'parquet', '.pq': 'parquet',
    '.mat': 'mat', '.h5': 'hdf5', '.hdf5': 'hdf5', '.hdf': 'hdf5', '.npz': 'numpy_file',
    '.npy': 'numpy_file', '.xlsx': 'workbook', '.tdms': 'tdms', '.mcap': 'bag', '.db3': 'bag',
    '.bag': 'bag'}
COMPRESSED = ('.gz', '.bz2', '.xz')
MOST_NAMED = 3               # files of a folder, in a message


def read_tables(path: StrPath, every: int = 1, wanted: Collection[str] | None = None,
                progress: Callable[[float], object] | None = None) -> list[Table]:
    """
    Return the tables of a file.

    Parameters
    ----------
    path : path
        A file, or the folder of a bag.
    every : int
        Keep one row of so many; the others are not held in memory.
    wanted : collection of str, optional
        Columns that will be asked for; of a bag only their topics are read.
    progress : callable, optional
        Called with the share that is read, 0 to 1.

    Returns
    -------
    list of Table
        One for a text file; one for each topic of a bag, and for each length of the arrays of
        a MAT or HDF5 file.

    Raises
    ------
    InputError
        No such file, one of another kind, or one that cannot be read.

    """
    place = Path(path)
    if not place.exists():
        raise InputError('there is no such file', shown(path))
    refuse_pipe(path)
    if place.is_dir() and not (place / METADATA_FILE).exists():
        raise InputError(f'is a folder without the {METADATA_FILE} of a bag; {_inside(place)}',
                         shown(path))
    module = importlib.import_module(f'{__name__}.{kind_of(place)}')
    try:
        tables: list[Table] = module.read(str(path), every, wanted, progress or (lambda _: None))
    except (OSError, MemoryError) as error:
        raise InputError(f'cannot be read: {error}', shown(path)) from None
    if not any(len(table) for table in tables):
        raise InputError('holds no rows of numbers', shown(path))
    if every > 1:
        for table in tables:
            table.numbered = every * (
                np.arange(len(table)) if table.numbered is None else table.numbered)
    return tables


def _inside(folder: Path) -> str:
    """Return what to name in place of a folder that is no bag."""
    files = [shlex.quote(str(folder / name)) for name in sorted(os.listdir(folder))
             if not (folder / name).is_dir() and _ending(folder / name) in ENDINGS]
    more = f', and {len(files) - MOST_NAMED} more' if len(files) > MOST_NAMED else ''
    return f'name one recording in it: {", ".join(files[:MOST_NAMED])}{more}' if files else (
        'no file in it is a table or a recording')


def _ending(place: Path) -> str:
    """Return the ending of a name in small letters, without that of a compressed file."""
    endings = [ending.lower() for ending in place.suffixes]
    if endings and endings[-1] in COMPRESSED:
        endings.pop()
    return endings[-1] if endings else ''


def kind_of(place: Path) -> str:
    """Return the module of a file by its name; InputError where no module fits."""
    if place.is_dir():
        return 'bag'
    kind = ENDINGS.get(_ending(place))
    if kind is None:
        raise InputError(
            f'the ending {os.path.splitext(place.name)[1]!r} is unknown; allowed: '
            f'{", ".join(ENDINGS)}, or the folder of a bag', shown(place))
    return kind


def needs(module: str, package: str, what: str) -> Any:
    """Return an optional library; InputError with the command that installs it."""
    try:
        return importlib.import_module(module)
    except ImportError:
        raise InputError(f'{what} needs {package}; run: pip install {package}') from None

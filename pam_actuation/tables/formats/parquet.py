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

"""Parquet files, read and written with pyarrow."""

from collections.abc import Callable, Collection
from typing import TYPE_CHECKING

from pam_actuation.tables.formats import needs
from pam_actuation.tables.table import Table
from pam_sim.errors import InputError

if TYPE_CHECKING:
    import pandas as pd


def read(path: str, every: int, wanted: Collection[str] | None,
         progress: Callable[[float], object]) -> list[Table]:
    """Return the table of a Parquet file; see ``formats.read_tables``."""
    import pandas as pd
    arrow = needs('pyarrow', 'pyarrow', 'a Parquet file')
    try:
        frame = pd.read_parquet(path, engine='pyarrow')
    except (arrow.ArrowInvalid, arrow.ArrowNotImplementedError, OSError) as error:
        raise InputError(f'is no readable Parquet file: {error}', path) from None
    if frame.index.name is not None or isinstance(frame.index, pd.DatetimeIndex):
        frame = frame.rename_axis(index=frame.index.name or 'time').reset_index()
    frame = frame.iloc[::every].reset_index(drop=True)
    return [Table(path, {str(name): frame[name] for name in frame.columns})]


def write(frame: 'pd.DataFrame', path: str) -> None:
    """Write a data frame as Parquet."""
    needs('pyarrow', 'pyarrow', 'a Parquet file')
    frame.to_parquet(path, engine='pyarrow', index=False)

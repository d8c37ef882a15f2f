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

"""MAT files of MATLAB and GNU Octave, up to version 7; 7.3 is HDF5."""

from collections.abc import Callable, Collection
import re
from typing import TYPE_CHECKING
import warnings

from pam_actuation.tables.formats import hdf5
from pam_actuation.tables.formats.structs import OBJECTS, Walk
from pam_actuation.tables.table import Table
from pam_sim.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

_TWICE = re.compile('Duplicate variable name "(.*?)"')       # what SciPy warns of


def read(path: str, every: int, wanted: Collection[str] | None,
         progress: Callable[[float], object]) -> list[Table]:
    """Return the tables of a MAT file; see ``formats.read_tables``."""
    from scipy.io import loadmat, matlab
    try:
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter('always', matlab.MatReadWarning)
            content = loadmat(path, squeeze_me=True, struct_as_record=False)
    except NotImplementedError:
        return hdf5.read(path, every, wanted, progress)
    except (matlab.MatReadError, ValueError, TypeError, IndexError, OSError, KeyError) as error:
        raise InputError(f'is no readable MAT file: {error}', path) from None
    walk = Walk({name: value for name, value in content.items() if not name.startswith('__')})
    found = walk.tables(path, every)
    objects = {name for name, value in content.items() if isinstance(value, matlab.MatlabOpaque)}
    if objects and not found:
        raise InputError(f'has no array; {OBJECTS}', path)
    twice = {name for one in told for name in _TWICE.findall(str(one.message))} - objects
    remarks = ([OBJECTS] if objects else []) + walk.remarks
    remarks += [f'`{name}` stands more than once in it; the last one was taken'
                for name in sorted(twice)]
    for table in found:
        table.remarks += remarks
    return found


def write(frame: 'pd.DataFrame', path: str) -> None:
    """Write a data frame as a MAT file, one array a column; dot and slash become ``_``."""
    from scipy.io import savemat
    with open(path, 'wb') as stream:
        savemat(stream, {re.sub('[./]', '_', str(name)): frame[name].to_numpy()
                         for name in frame.columns}, long_field_names=True, oned_as='column')

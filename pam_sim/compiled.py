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

"""
How the small numerical functions of the package are compiled.

numpy error model: a division by zero gives inf as in NumPy instead of a check
on every division. No fastmath: compiled and interpreted results stay equal.

Machine code is stored for entry points alone. numba keeps it beside the file of
the function and looks at the age of that file only, so an entry point built from
the functions of other files takes their ``source_key`` as a constant: a changed
source, another number, compiled anew.
"""

import hashlib
import inspect
from pathlib import Path
import types

from numba import njit
import numpy as np

compiled = njit(error_model='numpy', nogil=True, _nrt=False)
inlined = njit(error_model='numpy', nogil=True, _nrt=False, forceinline=True)


def interpreted(function):
    """Return the Python function behind a compiled one: for a single call, not worth compiling."""
    return getattr(function, 'py_func', function)


def sources(*parts):
    """
    Return what compiled code is built from.

    Parameters
    ----------
    parts : compiled functions, or modules for all the compiled functions in them

    Returns
    -------
    files : list of pathlib.Path
        Every file with a function reached from ``parts``, in order.
    constants : list of str
        ``name = value`` of the numbers and records these functions take from elsewhere, in
        order.

    """
    files, constants, seen = set(), set(), set()
    waiting = list(parts)
    while waiting:
        part = waiting.pop()
        if id(part) in seen:
            continue
        seen.add(id(part))
        if isinstance(part, types.ModuleType):
            files.add(Path(part.__file__))
            waiting += filter(_is_compiled, vars(part).values())
            continue
        found = inspect.getclosurevars(part.py_func)
        files.add(Path(inspect.getsourcefile(part.py_func)))
        for name, value in {**found.globals, **found.nonlocals}.items():
            if _is_compiled(value):
                waiting.append(value)
            elif isinstance(value, (bool, int, float, str, np.dtype)):
                constants.add(f'{name} = {value!r}')
            elif isinstance(value, types.ModuleType) and value.__name__.startswith('pam_'):
                files.add(Path(value.__file__))
                used = (getattr(value, name, None) for name in part.py_func.__code__.co_names)
                waiting += filter(_is_compiled, used)
    return sorted(files), sorted(constants)


def source_key(*parts):
    """Return a number made of all that ``sources`` finds, for code stored on disk."""
    files, constants = sources(*parts)
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for file in files:
        digest.update(file.name.encode() + file.read_bytes())
    digest.update('\n'.join(constants).encode())
    return int(digest.hexdigest()[:12], 16)


def _is_compiled(value):
    return hasattr(value, 'py_func')

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

numba is imported with the first use of a compiled function. A program that simulates nothing
starts without it.

Machine code is stored for entry points only. numba keeps it beside the file of the function and
checks the age of that file only. An entry point built from functions of other files therefore
takes their ``source_key`` as a constant. A changed source changes the key, and numba compiles
again.
"""

from collections.abc import Callable
import functools
import hashlib
import inspect
from pathlib import Path
import types
from typing import Any, Generic, ParamSpec, Protocol, TypeGuard, TypeVar

import numpy as np

P = ParamSpec('P')
R = TypeVar('R')
R_co = TypeVar('R_co', covariant=True)
# Their texts belong to the key: they say what becomes of a function.
_MAKERS = ('compiled.py', 'machine_code.py', 'record_parts.py')


class Compiled(Protocol[P, R_co]):
    """A compiled function: called like the Python function it is made from, ``py_func``."""

    @property
    def py_func(self) -> Callable[P, R_co]:
        """Return the function in Python."""

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R_co:
        """Call the machine code."""

    def __hash__(self) -> int:
        """Return the number of a key: a cache may keep something for a function."""


class Compiler(Protocol):
    """A decorator that compiles and leaves the signature as it is."""

    def __call__(self, function: Callable[P, R], /) -> Compiled[P, R]:
        """Compile a function."""


class _Deferred(Generic[P, R]):
    """A function that numba gets to see when it is first used."""

    def __init__(self, function: Callable[P, R], way: str, options: dict[str, bool]) -> None:
        functools.update_wrapper(self, function)
        self.py_func, self._way, self._options = function, way, options

    @functools.cached_property
    def dispatcher(self) -> Any:
        """Return the function as numba has it; the Python function with the compiler off."""
        from pam_sim import machine_code
        return getattr(machine_code, self._way)(self.py_func, **self._options)

    @property
    def _numba_type_(self) -> Any:
        """Return what numba looks for in the globals of a function it compiles."""
        return self.dispatcher._numba_type_

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Call the machine code."""
        try:
            result: R = self.dispatcher(*args, **kwargs)
        except Exception as error:
            told = _told(error)
            if told is None:
                raise
            raise told from None
        return result

    def __reduce__(self) -> Any:
        """Return the name by which another process finds the function, or all that it needs."""
        name = self.py_func.__qualname__
        return self.dispatcher.__reduce__() if '<locals>' in name else name


_explainers: list[Callable[[], Exception | None]] = []


def explain_with(explain: Callable[[], Exception | None]) -> None:
    """Ask ``explain`` for a better error where a function cannot be compiled."""
    _explainers.append(explain)


def _told(error: Exception) -> Exception | None:
    """Return a better error for one that came up while numba compiled, None without one."""
    seen, frame = {type(error).__module__}, error.__traceback__
    while frame is not None:
        seen.add(str(frame.tb_frame.f_globals.get('__name__')))
        frame = frame.tb_next
    # Its own errors come without the way there, others with it.
    if not seen & {'numba.core.errors', 'numba.core.compiler'}:
        return None
    return next(filter(None, (explain() for explain in _explainers)), None)


class _Compiler:
    """A decorator for one way of compiling."""

    def __init__(self, way: str, **options: bool) -> None:
        self._way, self._options = way, options

    def __call__(self, function: Callable[P, R], /) -> Compiled[P, R]:
        """Compile a function."""
        return _Deferred(function, self._way, self._options)


# Functions for other compiled functions; Python may call them as well.
compiled: Compiler = _Compiler('linked')
inlined: Compiler = _Compiler('linked', forceinline=True)
# What few rigs need stays a call, not optimised itself, so that the code of the others is small.
called: Compiler = _Compiler('linked', _dbg_optnone=True)
# Functions that Python calls, their machine code stored on disk; the second one may make arrays.
entry_point: Compiler = _Compiler('kept', _nrt=False)
allocating_entry_point: Compiler = _Compiler('kept')


def direct(function: Callable[P, R]) -> Callable[P, R]:
    """
    Return what is called a quarter of a microsecond faster: without the look at errors.

    For a function that was compiled before, for the same types of arguments.
    """
    machine_code: Callable[P, R] = getattr(function, 'dispatcher', function)
    return machine_code


def interpreted(function: Callable[P, R]) -> Callable[P, R]:
    """Return the Python function behind a compiled one: for a single call, not worth compiling."""
    python: Callable[P, R] = getattr(function, 'py_func', function)
    return python


def named_arguments(function: Callable[..., Any]) -> tuple[str, ...]:
    """Return the names of the arguments of a compiled function."""
    code = interpreted(function).__code__
    return code.co_varnames[:code.co_argcount]


def sources(*parts: Callable[..., Any] | types.ModuleType) -> tuple[list[Path], list[str]]:
    """
    Return what compiled code is built from.

    Parameters
    ----------
    *parts : function or module
        Compiled functions, or modules for all the compiled functions in them.

    Returns
    -------
    files : list of pathlib.Path
        Every file with a function reached from ``parts``, in order.
    constants : list of str
        ``name = value`` of the numbers and records these functions take from elsewhere, in
        order.

    """
    files: set[Path] = set()
    constants: set[str] = set()
    seen: set[int] = set()
    waiting = list(parts)
    while waiting:
        part = waiting.pop()
        if id(part) in seen:
            continue
        seen.add(id(part))
        if isinstance(part, types.ModuleType):
            files.add(_file_of(part))
            waiting += filter(is_compiled, vars(part).values())
            continue
        function: Any = getattr(part, 'py_func', part)       # itself where nothing is compiled
        found = inspect.getclosurevars(function)
        files.add(_file_of(function))
        for name, value in {**found.globals, **found.nonlocals}.items():
            if is_compiled(value):
                waiting.append(value)
            elif isinstance(value, np.dtype):
                constants.add(f'{name} = {_text(value)}')
            elif isinstance(value, (bool, int, float, str)):
                constants.add(f'{name} = {value!r}')
            elif inspect.isfunction(value) and value.__module__.startswith('pam_'):
                files.add(_file_of(value))      # compiled in a way of its own, as records.part
            elif isinstance(value, types.ModuleType) and value.__name__.startswith('pam_'):
                files.add(_file_of(value))
                used = (getattr(value, name, None) for name in function.__code__.co_names)
                waiting += filter(is_compiled, used)
    return sorted(files), sorted(constants)


def source_key(*parts: Callable[..., Any] | types.ModuleType) -> int:
    """Return a number made of all that ``sources`` finds, for code stored on disk."""
    files, constants = sources(*parts)
    digest = hashlib.sha256()
    for maker in _MAKERS:
        digest.update(Path(__file__).with_name(maker).read_bytes())
    for file in files:
        digest.update(file.name.encode() + file.read_bytes())
    digest.update('\n'.join(constants).encode())
    return int(digest.hexdigest()[:12], 16)


@functools.cache
def _text(dtype: np.dtype[Any]) -> str:
    """Return the text of a record: some are large, and many functions use them."""
    return repr(dtype)


def _file_of(part: types.ModuleType | Callable[..., Any]) -> Path:
    file = inspect.getsourcefile(part)
    if file is None:
        raise TypeError(f'{part} has no source')
    return Path(file)


def is_compiled(value: object) -> TypeGuard[Compiled[..., Any]]:
    """Return whether a value is a function made by one of the decorators above."""
    return hasattr(value, 'py_func') and not isinstance(value, type)

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
from typing import Any, ParamSpec, Protocol, TypeGuard, TypeVar

from numba import njit
from numba.core.registry import CPUDispatcher
import numpy as np
from pam_sim import compile_notice, machine_code
from pam_sim.machine_code import LINKED, stored

P = ParamSpec('P')
R = TypeVar('R')
R_co = TypeVar('R_co', covariant=True)


compile_notice.listen()


class Compiled(Protocol[P, R_co]):
    """A compiled function: called like the Python function it is made from, ``py_func``."""

    @property
    def py_func(self) -> Callable[P, R_co]:
        """Return the function in Python."""

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R_co:
        """Call the machine code."""


class Compiler(Protocol):
    """A decorator that compiles and leaves the signature as it is."""

    def __call__(self, function: Callable[P, R], /) -> Compiled[P, R]:
        """Compile a function."""


class _Within(CPUDispatcher):     # type: ignore[misc]  # numba has no annotations
    """
    A function for other compiled functions, without the code through which Python calls one.

    That code is a third of all that is compiled. The first call from Python makes it.
    """

    def __call__(self, *args: object, **kwargs: object) -> object:
        given = inspect.signature(self.py_func).bind(*args, **kwargs)
        given.apply_defaults()
        return self._called_from_python(*given.args)

    @functools.cached_property
    def _called_from_python(self) -> Callable[..., object]:
        within = self
        return _python_calls(lambda *args: within(*args))


class _Inner:
    """A compiler of functions for other compiled functions; Python may call them as well."""

    def __init__(self, **options: bool) -> None:
        self._compile = njit(error_model='numpy', nogil=True, _nrt=False,
                             no_cpython_wrapper=True, no_cfunc_wrapper=True, **LINKED, **options)

    def __call__(self, function: Callable[P, R], /) -> Compiled[P, R]:
        """Compile a function."""
        made = self._compile(function)
        if isinstance(made, CPUDispatcher):     # the function itself with the compiler off
            made.__class__ = _Within
        return made


class _EntryPoint:
    """A compiler of functions that Python calls, their machine code stored on disk."""

    def __init__(self, **options: bool) -> None:
        self._compile = njit(error_model='numpy', nogil=True, no_cfunc_wrapper=True, **options)

    def __call__(self, function: Callable[P, R], /) -> Compiled[P, R]:
        """Compile a function."""
        made: Compiled[P, R] = stored(self._compile(function))
        return made


_python_calls = njit(error_model='numpy', nogil=True, _nrt=False, no_cfunc_wrapper=True)
compiled: Compiler = _Inner()
inlined: Compiler = _Inner(forceinline=True)
# The second one may make arrays.
entry_point: Compiler = _EntryPoint(_nrt=False)
allocating_entry_point: Compiler = _EntryPoint()


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
    parts : compiled functions, or modules for all the compiled functions in them

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
            waiting += filter(_is_compiled, vars(part).values())
            continue
        function: Any = getattr(part, 'py_func', part)       # itself where nothing is compiled
        found = inspect.getclosurevars(function)
        files.add(_file_of(function))
        for name, value in {**found.globals, **found.nonlocals}.items():
            if _is_compiled(value):
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
                waiting += filter(_is_compiled, used)
    return sorted(files), sorted(constants)


def source_key(*parts: Callable[..., Any] | types.ModuleType) -> int:
    """Return a number made of all that ``sources`` finds, for code stored on disk."""
    files, constants = sources(*parts)
    digest = hashlib.sha256(Path(__file__).read_bytes() + Path(machine_code.__file__).read_bytes())
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


def _is_compiled(value: object) -> TypeGuard[Compiled[..., Any]]:
    return hasattr(value, 'py_func') and not isinstance(value, type)

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
What numba does for the functions of this package, imported with the first one that is used.

Two things that numba does for every function serve functions that Python calls, and are most of
the time of small ones:

- It optimises each function, and translates it to machine code. A function that only other
  compiled functions call is linked into them and optimised there once more. ``LinkedCompiler``
  leaves it as it is.
- Before it loads stored code it reads all it needs to compile, SciPy's linear algebra included.
  ``StoredCode`` loads without that. numba still reads it before it compiles.

Both use parts of numba that may change. With a version that nobody tried, numba does all of it.
"""

from collections.abc import Callable
import functools
import inspect
import re
from typing import Any

import numba
from numba import njit
from numba.core import caching, codegen, compiler
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.registry import cpu_target, CPUDispatcher
from numba.core.runtime import rtsys
from pam_sim import compile_notice, record_parts  # noqa: F401  # numba learns what a part is

# From this version of numba to before that one. Tried were 0.58.1, 0.61.2, 0.64.0 and 0.68.1.
TRIED = ((0, 58), (0, 69))


def tried(version: str) -> bool:
    """Return whether this version of numba is one of those tried."""
    numbers = re.match(r'(\d+)\.(\d+)', version)
    return numbers is not None and TRIED[0] <= tuple(map(int, numbers.groups())) < TRIED[1]


class _Nowhere:
    """A code generator whose functions are at no address, so that none has an environment."""

    def __init__(self, generator: Any) -> None:
        self._generator = generator

    def __getattr__(self, name: str) -> Any:
        return getattr(self._generator, name)

    def set_env(self, name: str, environment: object) -> None:
        """Leave the environment, which serves Python objects; linked functions have none."""


class LinkedLibrary(codegen.JITCodeLibrary):    # type: ignore[misc]  # numba has no annotations
    """The code of a function that is linked into others, neither optimised nor translated."""

    @property
    def codegen(self) -> Any:
        """Return the code generator."""
        return _Nowhere(self._codegen)

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0, as numba does for a function without machine code."""
        self._ensure_finalized()
        return 0

    def _optimize_final_module(self) -> None:
        """Leave this to the function it is linked into."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


@register_pass(mutates_CFG=False, analysis_only=True)
class _LinkedOnly(FunctionPass):        # type: ignore[misc]  # numba has no annotations
    """Give the function a library of the kind above before numba gives it one."""

    _name = 'linked_only'

    def __init__(self) -> None:
        FunctionPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """Set the library; return whether the function was changed: no."""
        if state.library is None:
            state.library = LinkedLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        return False


class LinkedCompiler(compiler.CompilerBase):    # type: ignore[misc]  # numba has no annotations
    """The compiler of numba, for functions that only other compiled functions call."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes of numba and the one above."""
        passes = compiler.DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_LinkedOnly, passes.passes[0][0])
        passes.finalize()
        return [passes]


class StoredCode(caching.FunctionCache):        # type: ignore[misc]  # numba has no annotations
    """The code stored of a function, which loads without what is needed to compile."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code stored for a signature, or None."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


def stored(dispatcher: Any) -> Any:
    """Return a function whose machine code is kept on disk beside its file, and loaded from it."""
    if isinstance(dispatcher, CPUDispatcher):       # the function itself with the compiler off
        if tried(numba.__version__):
            dispatcher._cache = StoredCode(dispatcher.py_func)
        else:
            dispatcher.enable_caching()
    return dispatcher


class _Within(CPUDispatcher):     # type: ignore[misc]  # numba has no annotations
    """
    A function for other compiled functions, without the code through which Python calls one.

    That code is a third of all that is compiled. The first call from Python makes it.
    """

    def __call__(self, *args: object, **kwargs: object) -> object:
        # Loops call some at each tick: to bind the arguments takes ten times as long as the call.
        if kwargs or len(args) != self.py_func.__code__.co_argcount:
            given = inspect.signature(self.py_func).bind(*args, **kwargs)
            given.apply_defaults()
            args = given.args
        return self._called_from_python(*args)

    @functools.cached_property
    def _called_from_python(self) -> Callable[..., object]:
        within = self
        return entered(lambda *args: within(*args))


_OPTIONS: dict[str, Any] = {'error_model': 'numpy', 'nogil': True, 'no_cfunc_wrapper': True}
_LINKED = {'pipeline_class': LinkedCompiler} if tried(numba.__version__) else {}


def linked(function: Callable[..., Any], **options: bool) -> Any:
    """Compile a function for other compiled functions; Python may call it as well."""
    made = njit(_nrt=False, no_cpython_wrapper=True, **_LINKED, **_OPTIONS, **options)(function)
    if isinstance(made, CPUDispatcher):     # the function itself with the compiler off
        made.__class__ = _Within
    return made


def entered(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls, for this process."""
    return njit(_nrt=False, **_OPTIONS)(function)


def kept(function: Callable[..., Any], **options: bool) -> Any:
    """Compile a function that Python calls, its machine code stored on disk."""
    return stored(njit(**_OPTIONS, **options)(function))


def ready() -> None:
    """Prepare what loading of stored code needs, for processes that are copied."""
    rtsys.initialize(cpu_target.target_context)


compile_notice.listen()

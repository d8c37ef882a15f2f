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
Finding things that are registered by standing in a folder: effects, laws, loads, primitives.

A folder of this package and the folders an environment variable names are searched;
a module is a plug-in by being there.
"""

import builtins
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
import dis
import importlib
import importlib.util
from itertools import pairwise
import keyword
import os
from pathlib import Path
import sys
import traceback
from types import ModuleType
from typing import Any, TypeVar

import numpy as np
from pam_sim.compiled import Compiled, interpreted, is_compiled, named_arguments
from pam_sim.declared import shown
from pam_sim.errors import did_you_mean, InputError

T = TypeVar('T')
_PACKAGE = Path(__file__).parent


def plugin_files(own_folder: Path, variable: str, not_plugins: tuple[str, ...] = ()) -> list[Path]:
    """
    Return the source files of all plug-ins, sorted by name; of one name our own first.

    Parameters
    ----------
    own_folder : Path
        Folder inside this package.
    variable : str
        Environment variable with further folders, separated as in PATH.
    not_plugins : tuple of str
        Modules of the own folder that are something else.

    Raises
    ------
    InputError
        The variable names something that is not a folder.

    """
    folders = [Path(own_folder)]
    for folder in filter(None, os.environ.get(variable, '').split(os.pathsep)):
        if not Path(folder).is_dir():
            raise InputError('is not a folder', f'{variable}: {folder}')
        folders.append(Path(folder))
    files = [path for folder in folders for path in folder.glob('*.py')
             if not path.stem.startswith('_')
             and not (folder == folders[0] and path.stem in not_plugins)]
    return sorted(files, key=lambda path: (path.stem, path.parent != folders[0], str(path)))


def plugin_module(path: Path, own_folder: Path, package: str, prefix: str) -> ModuleType:
    """
    Return the imported module of a plug-in file, of the package or from elsewhere.

    Raises
    ------
    InputError
        A file from elsewhere is not Python, fails, or declares what is not allowed.

    """
    if path.parent == Path(own_folder):
        return importlib.import_module(f'{package}.{path.stem}')
    name = f'{prefix}_{path.stem}'
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError('is no Python file', str(path))
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        with told_with_place(path, 'cannot be loaded'):
            spec.loader.exec_module(module)
    except InputError:
        del sys.modules[name]
        raise
    return module


@contextmanager
def told_with_place(path: str | Path, problem: str) -> Iterator[None]:
    """
    Tell what code of a plug-in raises in one sentence with file and line.

    Parameters
    ----------
    path : str or Path
        The file of the plug-in.
    problem : str
        What failed, such as ``cannot be loaded``.

    Raises
    ------
    InputError
        For any error.

    """
    try:
        yield
    except Exception as error:      # whatever the code of somebody else raises
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__)
                 if frame.filename == os.path.abspath(path)]
        place = ':'.join(map(str, [path, *lines[-1:]]))
        if isinstance(error, InputError):
            raise InputError(error.problem, error.where or place) from error
        if isinstance(error, SyntaxError):
            raise InputError(f'is not valid Python: {error.msg}',
                             f'{error.filename}:{error.lineno}') from error
        raise InputError(f'{problem}: {type(error).__name__}: {error}', place) from error


def file_of_user(function: Callable[..., Any]) -> Path | None:
    """Return the file of a function, None of one of this package or without a file."""
    code = getattr(interpreted(function), '__code__', None)
    if code is None or Path(code.co_filename).is_relative_to(_PACKAGE):
        return None
    return Path(code.co_filename)


def raise_with_file(file: Path | None, problem: str, error: Exception) -> None:
    """
    Raise an error in one sentence with file and line.

    Parameters
    ----------
    file : Path or None
        Of a plug-in of the user; None of a part of this package, whose errors stay as they are.
    problem : str
        What failed.
    error : Exception
        What the function of the plug-in raised.

    Raises
    ------
    InputError
        Where there is a file.

    """
    if file is not None:
        with told_with_place(file, problem):
            raise error


def check_name(what: str, name: str, path: Path, taken: Mapping[str, Path]) -> None:
    """
    Refuse a plug-in whose name is not that of its file, or is taken.

    Parameters
    ----------
    what : str
        Noun used in messages.
    name : str
        What the file defines.
    path : Path
        The file.
    taken : mapping
        Names that are defined already: name -> file.

    Raises
    ------
    InputError
        The sentence names both files.

    """
    if name != path.stem:
        raise InputError(f'defines the {what} `{name}`, which must be defined in a file of its '
                         f'name; rename one of them', str(path))
    if not name.isidentifier() or keyword.iskeyword(name):
        raise InputError(f'the {what} `{name}` is no name of Python; take letters, digits and '
                         '`_`, such as `my_name`', str(path))
    if name in taken:
        raise InputError(f'the name `{name}` is taken by {taken[name]}; give the {what} and its '
                         'file another name', str(path))


def check_stated(holder: object, kinds: Mapping[str, tuple[type, str]], path: Path) -> None:
    """
    Refuse a module or class that states something else than what is needed.

    Parameters
    ----------
    holder : module or class
        With the names.
    kinds : mapping
        Name to its type and how it is written.
    path : Path
        The file.

    Raises
    ------
    InputError
        The sentence says what stands there.

    """
    for name, (kind, form) in kinds.items():
        value = getattr(holder, name)
        if not isinstance(value, kind):
            raise InputError(f'states {name} = {shown(value)}; write {form}', str(path))


def check_function(what: str, function: Callable[..., Any], returns: tuple[str, ...],
                   records: Mapping[str, np.dtype[Any]], path: str | Path) -> None:
    """
    Refuse a compiled function with a mistake that can be seen without the compiler.

    Parameters
    ----------
    what : str
        What it is, for the message.
    function : callable
        One that is compiled.
    returns : tuple of str
        What it returns; empty where that is nothing.
    records : mapping
        Record of each argument that is one.
    path : Path
        The file.

    Raises
    ------
    InputError
        It uses a name that nothing defines, reads a number that a record has not, or returns
        nothing on some way through it.

    """
    python = interpreted(function)
    known = {*python.__globals__, *vars(builtins)}
    steps = list(dis.get_instructions(python))
    for before, one in pairwise([steps[0], *steps]):
        name, problem = one.argval, ''
        if one.opname == 'LOAD_GLOBAL' and name not in known:
            problem = (f'cannot be compiled: NameError: name `{name}` is not defined; import it, '
                       'or define it above')
        elif (one.opname in ('LOAD_ATTR', 'STORE_ATTR') and before.opname == 'LOAD_FAST'
              and before.argval in records):
            names = records[before.argval].names or ()
            if name not in names:
                problem = (f'cannot be compiled: there is no number `{name}`'
                           f'{did_you_mean(name, names)}; allowed: {", ".join(names)}')
        elif returns and _gives_nothing(before, one):
            problem = (f'returns nothing; write `return {", ".join(returns)}` on every way '
                       'through it')
        if problem:
            raise InputError(f'{what} {problem}', f'{path}:{_line(one, python)}')


def _gives_nothing(before: dis.Instruction, one: dis.Instruction) -> bool:
    """Return whether a function ends here with None, as Python 3.12 says it or 3.11."""
    given = one if one.opname == 'RETURN_CONST' else before
    return (one.opname in ('RETURN_CONST', 'RETURN_VALUE') and given.argval is None
            and given.opname in ('RETURN_CONST', 'LOAD_CONST'))


def _line(one: dis.Instruction, function: Callable[..., Any]) -> int:
    """Return the line of an instruction; that of the function where it has none."""
    found = one.positions.lineno if one.positions else None
    return found or function.__code__.co_firstlineno


def formula(module: ModuleType, name: str, arguments: tuple[str, ...],
            path: Path, packed: np.dtype[Any],
            returns: str = 'force_n') -> Compiled[..., Any] | None:
    """
    Return a compiled function of a plug-in, None where it has none of this name.

    Parameters
    ----------
    module : module
        Of the plug-in.
    name : str
        Of the function.
    arguments : tuple of str
        Names of its arguments, in the order in which a simulation gives them.
    path : Path
        The file.
    packed : numpy.dtype
        Record of the argument ``par``.
    returns : str
        What it returns, for messages.

    Raises
    ------
    InputError
        It is not compiled, or has other arguments, or these in another order, or what
        ``check_function`` refuses.

    """
    function = getattr(module, name, None)
    if function is None:
        return None
    form = (f'write `def {name}({", ".join(arguments)})` with `@compiled` above it, and read the '
            'numbers by name, `par.length_m`')
    if not is_compiled(function):
        raise InputError(f'`{name}` is not compiled; {form}', str(path))
    given = named_arguments(function)
    if given != arguments:
        raise InputError(f'`{name}` takes ({", ".join(given)}); {form}', str(path))
    check_function(f'`{name}`', function, (returns,), {'par': packed}, path)
    return function


def pick(known: Mapping[str, T], name: str, what: str, where: str = '', variable: str = '') -> T:
    """
    Return ``known[name]``.

    Parameters
    ----------
    known : mapping
        What there is, by name.
    name : str
        What is wanted.
    what : str
        Noun used in the message.
    where : str
        Place of the name.
    variable : str
        Environment variable whose folders are searched for plug-ins of this kind, if there is one.

    Raises
    ------
    InputError
        Unknown name; the message lists the names there are.

    """
    if name not in known:
        own = f'; if it is your own, set {variable} to its folder' if variable else ''
        raise InputError(
            f'unknown {what} `{name}`{did_you_mean(name, known)}; allowed: '
            f'{", ".join(sorted(known))}{own}', where)
    return known[name]

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

from collections.abc import Mapping
import importlib
import importlib.util
import keyword
import os
from pathlib import Path
import sys
import traceback
from types import ModuleType
from typing import Any, TypeVar

from pam_sim.compiled import Compiled, is_compiled, named_arguments
from pam_sim.errors import did_you_mean, InputError

T = TypeVar('T')


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
        spec.loader.exec_module(module)
    except Exception as error:      # whatever the code of somebody else raises
        del sys.modules[name]
        if isinstance(error, InputError):
            raise InputError(error.problem, error.where or path) from error
        if isinstance(error, SyntaxError):
            raise InputError(f'is not valid Python: {error.msg}',
                             f'{error.filename}:{error.lineno}') from error
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__)
                 if frame.filename == os.path.abspath(path)]
        raise InputError(f'cannot be loaded: {type(error).__name__}: {error}',
                         ':'.join(map(str, [path, *lines[-1:]]))) from error
    return module


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


def formula(module: ModuleType, name: str, arguments: tuple[str, ...],
            path: Path) -> Compiled[..., Any] | None:
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

    Raises
    ------
    InputError
        It is not compiled, or has other arguments, or these in another order.

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
    return function


def pick(known: Mapping[str, T], name: str, what: str, where: str = '') -> T:
    """
    Return ``known[name]``.

    Raises
    ------
    InputError
        Unknown name; the message lists the names there are.

    """
    if name not in known:
        raise InputError(
            f'unknown {what} `{name}`{did_you_mean(name, known)}; allowed: '
            f'{", ".join(sorted(known))}', where)
    return known[name]

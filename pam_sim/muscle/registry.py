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

"""Find the muscle laws: every module of ``laws``, and of ``PAM_MUSCLE_LAWS_PATH``."""

import difflib
from functools import lru_cache
import importlib
import importlib.util
import os
from pathlib import Path
import sys

from pam_sim.errors import InputError
from pam_sim.muscle.law import MuscleLaw

_OWN_FOLDER = Path(__file__).parent / 'laws'


def law_files():
    """Return the source files of all laws, sorted by name."""
    folders = [_OWN_FOLDER]
    for folder in filter(None, os.environ.get('PAM_MUSCLE_LAWS_PATH', '').split(os.pathsep)):
        if not Path(folder).is_dir():
            raise InputError('is not a folder', f'PAM_MUSCLE_LAWS_PATH: {folder}')
        folders.append(Path(folder))
    files = [path for folder in folders for path in folder.glob('*.py')
             if not path.stem.startswith('_')]
    return sorted(files, key=lambda path: (path.stem, str(path)))


def _module_of(path):
    if path.parent == _OWN_FOLDER:
        return importlib.import_module(f'pam_sim.muscle.laws.{path.stem}')
    name = f'pam_muscle_law_{path.stem}'
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@lru_cache(maxsize=None)
def laws():
    """
    Return all laws: name -> subclass of MuscleLaw, sorted by name.

    Raises
    ------
    InputError
        A file without ``LAW``, or a name defined twice.

    """
    found = {}
    for path in law_files():
        law = getattr(_module_of(path), 'LAW', None)
        if not (isinstance(law, type) and issubclass(law, MuscleLaw)):
            raise InputError('defines no LAW, a subclass of MuscleLaw', str(path))
        if law.NAME in found or law.NAME != path.stem:
            raise InputError(
                f'law `{law.NAME}` must be defined once, in a file of its name', str(path))
        found[law.NAME] = law
    return found


def get_law(name, where=''):
    """
    Return a law's class by name.

    Raises
    ------
    InputError
        Unknown name; the message lists the names there are.

    """
    known = laws()
    if name not in known:
        near = difflib.get_close_matches(str(name), known, n=1)
        hint = f' (did you mean `{near[0]}`?)' if near else ''
        raise InputError(
            f'unknown muscle law `{name}`{hint}; allowed: {", ".join(known)}', where)
    return known[name]


def make_law(name, values=None, muscle=None, where=''):
    """
    Return a law by name, with a named parameter set and values that differ from it.

    Raises
    ------
    InputError
        Unknown law, set or parameter, or a value out of bounds.

    """
    return get_law(name, where)(values, muscle, where)

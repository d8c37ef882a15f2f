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

"""Find the effects: every module of this folder, and of ``PAM_EFFECTS_PATH``."""

import difflib
from functools import lru_cache
import importlib
import importlib.util
import os
from pathlib import Path
import sys

from pam_sim.effects.effect import Effect
from pam_sim.errors import InputError
from pam_sim.rollout.hooks import HOOKS

_OWN_FOLDER = Path(__file__).parent
_NOT_EFFECTS = ('__init__', 'effect', 'registry')


def effect_files():
    """Return the source files of all effects, sorted by effect name."""
    files = [path for path in _OWN_FOLDER.glob('*.py') if path.stem not in _NOT_EFFECTS]
    for folder in filter(None, os.environ.get('PAM_EFFECTS_PATH', '').split(os.pathsep)):
        if not Path(folder).is_dir():
            raise InputError('is not a folder', f'PAM_EFFECTS_PATH: {folder}')
        files += [path for path in Path(folder).glob('*.py') if not path.stem.startswith('_')]
    return sorted(files, key=lambda path: (path.stem, str(path)))


def _module_of(path):
    if path.parent == _OWN_FOLDER:
        return importlib.import_module(f'pam_sim.effects.{path.stem}')
    name = f'pam_effect_{path.stem}'
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@lru_cache(maxsize=None)
def effects():
    """
    Return all effects in kernel order: name -> Effect with its hooks.

    Raises
    ------
    InputError
        A file without ``EFFECT``, or a name defined twice.

    """
    found = {}
    for path in effect_files():
        module = _module_of(path)
        effect = getattr(module, 'EFFECT', None)
        if not isinstance(effect, Effect):
            raise InputError('defines no EFFECT = Effect(...)', str(path))
        if effect.name in found or effect.name != path.stem:
            raise InputError(
                f'effect `{effect.name}` must be defined once, in a file of its name', str(path))
        effect.hooks.update(
            {hook: getattr(module, hook) for hook in HOOKS if hasattr(module, hook)})
        found[effect.name] = effect
    return dict(sorted(found.items(), key=lambda item: (item[1].order, item[0])))


def get_effect(name, where=''):
    """
    Return an effect by name.

    Raises
    ------
    InputError
        Unknown name; the message lists the names there are.

    """
    known = effects()
    if name not in known:
        near = difflib.get_close_matches(str(name), known, n=1)
        hint = f' (did you mean `{near[0]}`?)' if near else ''
        raise InputError(
            f'unknown effect `{name}`{hint}; allowed: {", ".join(sorted(known))}', where)
    return known[name]

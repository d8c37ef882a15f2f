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
Modules that this package writes for itself, in a folder where a person can read them.

A generated module holds functions made from what is found on this machine: the effects and
force laws of the package and of the user's folders. It is named after the hash of its text.
Machine code is not stored with it: entry points of ordinary modules call its functions and
take their ``source_key``, which follows them into the files they are made from.
``PAM_CACHE_DIR`` moves the folder.
"""

import hashlib
import importlib.util
import os
from pathlib import Path
import sys
import tempfile
from types import ModuleType


def cache_folder() -> Path:
    """Return the folder for generated modules, created; a temporary one if none can be had."""
    chosen = os.environ.get('PAM_CACHE_DIR')
    if not chosen:
        base = os.environ.get('XDG_CACHE_HOME') or os.path.join(os.path.expanduser('~'), '.cache')
        chosen = os.path.join(base, 'pam_actuation')
    for folder in (Path(chosen), Path(tempfile.gettempdir()) / f'pam_actuation_{os.getuid()}'):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                return folder
        except OSError:
            continue
    return Path(tempfile.mkdtemp(prefix='pam_actuation_'))


def generated_module(name: str, source: str) -> ModuleType:
    """
    Import a text as a module, written to the cache folder unless it stands there.

    Parameters
    ----------
    name : str
        Module name, which must begin with ``pam_``, without the hash.
    source : str
        Python source.

    """
    full = f'{name}_{hashlib.sha256(source.encode()).hexdigest()[:12]}'
    if full in sys.modules:
        return sys.modules[full]
    path = cache_folder() / f'{full}.py'
    try:
        same = path.read_text(encoding='utf-8') == source
    except (OSError, UnicodeDecodeError):
        same = False
    if not same:
        # Several processes may be here at once: each writes its own file, the last rename wins.
        handle, temporary = tempfile.mkstemp(dir=path.parent, suffix='.tmp')
        with os.fdopen(handle, 'w', encoding='utf-8') as file:
            file.write(source)
        os.replace(temporary, path)
    spec = importlib.util.spec_from_file_location(full, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[full] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[full]
        raise
    return module

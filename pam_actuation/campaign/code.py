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

"""A digest of the code that results of a campaign come from, here or at a worker."""

from functools import lru_cache
import hashlib
from importlib.metadata import version
from pathlib import Path

from pam_sim.plugins import plugin_files

# Talk to people and to rigs; nothing that works on a recording imports them.
LEFT_OUT = ('cli', 'hardware', 'investigate', 'nodes', 'rigging', 'view')
KINDS = ('.py', '.yaml', '.csv', '.json')       # code, presets, tables, schemas
OWN = ('PAM_EFFECTS_PATH', 'PAM_MUSCLE_LAWS_PATH', 'PAM_LOADS_PATH', 'PAM_PRIMITIVES_PATH')
LIBRARIES = ('numpy', 'scipy', 'numba', 'plotly')


@lru_cache(maxsize=None)
def code_digest() -> str:
    """
    Return a digest of all that results come from, apart from recording, model file and settings.

    That is the source and data files of both packages, what a user added
    (``OWN``), and the versions of libraries. It does not depend on where they are installed.

    Raises
    ------
    InputError
        A variable of ``OWN`` names what is no folder.

    """
    import pam_actuation
    import pam_sim
    folders = [Path(one.__path__[0]) for one in (pam_actuation, pam_sim)]
    here = Path(__file__).parent
    own = [path for variable in OWN for path in plugin_files(here, variable)
           if path.parent != here]
    return digest_of(folders, own, [f'{name} {version(name)}' for name in LIBRARIES])


def digest_of(folders: list[Path], files: list[Path], words: list[str]) -> str:
    """
    Return a digest of what packages and further files hold, and of words.

    Parameters
    ----------
    folders : list of pathlib.Path
        Of packages. What lies in a folder of ``LEFT_OUT`` right below one does not count.
    files : list of pathlib.Path
        Files by themselves; their names count, not where they are.
    words : list of str
        What else counts.

    """
    digest = hashlib.sha256('\0'.join(words).encode())
    found = [(f'{folder.name}/{path.relative_to(folder).as_posix()}', path)
             for folder in folders for path in folder.rglob('*')
             if path.suffix in KINDS and path.relative_to(folder).parts[0] not in LEFT_OUT]
    for name, path in sorted([*found, *((path.name, path) for path in files)]):
        digest.update(b'\0' + name.encode() + b'\0' + path.read_bytes())
    return digest.hexdigest()

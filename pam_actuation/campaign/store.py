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
What a campaign keeps: one folder for each case, there whole or not at all.

A case is known by a key of all that its result depends on: the bytes of the recording, the model,
the settings, the version. A run that was killed goes on where it stopped.
"""

from collections.abc import Iterable, Iterator
import contextlib
import fcntl
import hashlib
import json
import os
from pathlib import Path
import shutil
import tempfile
from typing import Any

from pam_actuation import __version__
from pam_actuation.campaign.cases import Case
from pam_actuation.campaign.work import Settings
from pam_sim.errors import InputError
from pam_sim.files import check_folder, make_folder, StrPath

CASES, RESULT, TIMES, LOCK = 'cases', 'case.json', 'times.csv', '.lock'
UNFINISHED = '.unfinished-'
_BLOCK = 1 << 20


class Store:
    """
    The folder of a campaign.

    Parameters
    ----------
    folder : path
        Made if needed.

    Raises
    ------
    InputError
        It cannot be written.

    """

    def __init__(self, folder: StrPath) -> None:
        self.folder = Path(os.path.abspath(check_folder(folder)))
        self.cases = self.folder / CASES

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """
        Keep other campaigns out, and remove what a killed run left half done.

        Raises
        ------
        InputError
            Another campaign works in this folder.

        """
        make_folder(self.cases)
        with only_one(self.folder, 'campaign', (self.cases,)):
            yield

    def result(self, key: str) -> dict[str, Any] | None:
        """Return what is kept of a case, None where nothing is."""
        try:
            found: dict[str, Any] = json.loads(
                (self.cases / key / RESULT).read_text(encoding='utf-8'))
            return found
        except (OSError, ValueError):
            return None

    def told_time(self, key: str, wall_s: float, processor_s: float) -> None:
        """Note how long a case took; results do not depend on it."""
        with open(self.folder / TIMES, 'a', encoding='utf-8') as stream:
            stream.write(f'{key},{wall_s:.3f},{processor_s:.3f}\n')


@contextlib.contextmanager
def only_one(folder: Path, what: str, below: Iterable[Path] = ()) -> Iterator[None]:
    """
    Keep other processes out of a folder, and remove what a killed one left half done.

    Parameters
    ----------
    folder : pathlib.Path
        It is there.
    what : str
        What works in it, for the message.
    below : iterable of pathlib.Path
        Further folders that may hold something half done.

    Raises
    ------
    InputError
        Another process works in it.

    """
    with open(folder / LOCK, 'w', encoding='utf-8') as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(f'another {what} works in this folder', str(folder)) from None
        for one in (*below, folder):
            for left in one.glob(f'{UNFINISHED}*'):
                if left.is_dir():
                    shutil.rmtree(left, ignore_errors=True)
                else:
                    left.unlink(missing_ok=True)
        yield


@contextlib.contextmanager
def kept_folder(cases: Path, key: str) -> Iterator[Path]:
    """Give a folder that becomes ``key`` in the folder ``cases`` when the block ends well."""
    folder = Path(tempfile.mkdtemp(prefix=UNFINISHED, dir=cases))
    try:
        yield folder
        os.chmod(folder, 0o755)
        for path in folder.rglob('*'):
            if path.is_file():
                with open(path, 'rb') as stream:
                    os.fsync(stream.fileno())
        # Where another worker was faster, the folder is there already and holds the same.
        with contextlib.suppress(OSError):
            os.rename(folder, cases / key)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def key_of(case: Case, settings: Settings, model_text: str) -> str:
    """
    Return the key of all that the result of a case depends on.

    Parameters
    ----------
    case : Case
        Its path may be missing: that is a result as well.
    settings : Settings
        What is asked of it.
    model_text : str
        The model as YAML, '' without one.

    """
    digest = hashlib.sha256()
    options = {name: value for name, value in vars(settings).items() if name != 'model'}
    for part in (__version__, model_text, json.dumps(options, sort_keys=True),
                 case.namespace or ''):
        digest.update(part.encode() + b'\0')
    path = Path(case.path)
    files = sorted(one for one in path.rglob('*') if one.is_file()) if path.is_dir() else [path]
    for file in files:
        digest.update(str(file.relative_to(path)).encode() + b'\0')
        try:
            with open(file, 'rb') as stream:
                while block := stream.read(_BLOCK):
                    digest.update(block)
        except OSError as error:
            digest.update(str(error.errno).encode())
    return digest.hexdigest()[:20]

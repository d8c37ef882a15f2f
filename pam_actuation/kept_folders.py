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
Folders of results that go on after a kill: one process at a time, each part whole or not at all.

Campaigns and investigations keep what they find in such folders, and know a recording by a
digest of its files.
"""

from collections.abc import Callable, Iterable, Iterator
import contextlib
import fcntl
import os
from pathlib import Path
import shutil
import tempfile
from typing import Any

from pam_sim.errors import InputError
from pam_sim.files import cannot_write, StrPath, UNFINISHED

LOCK = '.lock'
_BLOCK = 1 << 20


@contextlib.contextmanager
def only_one(folder: Path, what: str, below: Iterable[Path] = ()) -> Iterator[None]:
    """
    Keep other processes out of a folder; remove what killed ones left half done, and at the end.

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
        folders = (*below, folder)
        _remove_unfinished(folders)
        try:
            yield
        finally:
            _remove_unfinished(folders)     # of workers that were lost or stopped meanwhile


def _remove_unfinished(folders: Iterable[Path]) -> None:
    """Remove what was begun and not ended; whoever still works on it cannot keep it."""
    for left in [left for one in folders for left in one.glob(f'{UNFINISHED}*')]:
        if left.is_dir():
            # Renamed first: a folder is there for its worker as a whole or not at all.
            with contextlib.suppress(OSError):
                left = left.rename(left.with_name(f'{left.name}-removed'))
            shutil.rmtree(left, ignore_errors=True)
        else:
            left.unlink(missing_ok=True)


@contextlib.contextmanager
def kept_folder(parent: Path, name: str) -> Iterator[Path]:
    """
    Give a folder that becomes ``name`` in the folder ``parent`` when the block ends well.

    Raises
    ------
    InputError
        The system refuses to rename it, or it was removed meanwhile (``only_one``).

    """
    folder = Path(tempfile.mkdtemp(prefix=UNFINISHED, dir=parent))
    opened = os.open(folder, os.O_RDONLY)       # keeps its number from being given again
    try:
        yield folder
        # Where it was removed, a writer of files may have made it anew without the first ones.
        if not folder.exists() or not os.path.samestat(os.fstat(opened), os.stat(folder)):
            raise InputError('was removed while it was filled, by another run', str(folder))
        os.chmod(folder, 0o755)
        for path in folder.rglob('*'):
            if path.is_file():
                with open(path, 'rb') as stream:
                    os.fsync(stream.fileno())
        # Where another worker was faster, the folder is there already and holds the same.
        try:
            os.rename(folder, parent / name)
        except OSError as error:
            if not (parent / name).is_dir():
                raise cannot_write(parent / name, error) from None
    finally:
        os.close(opened)
        shutil.rmtree(folder, ignore_errors=True)


def add_files(digest: Any, path: StrPath, unreadable: Callable[[Path, OSError], bytes]) -> None:
    """
    Add the names and bytes of a recording to a digest.

    Parameters
    ----------
    digest : object
        Of ``hashlib``.
    path : path
        A file, or a folder with all below it.
    unreadable : callable
        Takes a file that cannot be read and the error. It returns what stands for the rest of
        the file, or raises.

    """
    top = Path(path)
    files = sorted(one for one in top.rglob('*') if one.is_file()) if top.is_dir() else [top]
    for file in files:
        digest.update(str(file.relative_to(top)).encode() + b'\0')
        try:
            with open(file, 'rb') as stream:
                while block := stream.read(_BLOCK):
                    digest.update(block)
        except OSError as error:
            digest.update(unreadable(file, error))

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
Where a bag is written, and which bag it may take the place of.

A recording under a new name grows in its own folder, so that a killed recorder leaves it there.
A bag that replaces another grows in a folder beside it; the two change places only when
the new one is whole. What is not part of the former bag is never deleted: a folder that
holds anything else is refused.

What can be made again, as by an import, always grows beside, so that a kill leaves nothing under
the name. The next bag of this name removes what was left.
"""

from collections.abc import Iterable
import contextlib
import fcntl
import os
from pathlib import Path
import re
import stat

from pam_actuation.bags import disk, layout
from pam_sim.errors import InputError
from pam_sim.files import make_folder, reason, shown, StrPath, try_to_write
from pam_sim.files import UNFINISHED as BEGUN

# Added to the name of a bag while it is written beside the one it replaces, when it ended
# early and may not, and to the name of the former bag while they change places.
UNFINISHED, STOPPED, FORMER = '_unfinished', '_stopped', '_former'
LONGEST_NAME_BYTES = 230      # files and folders of a bag add something to its name


def check_bag_target(directory: StrPath, overwrite: bool = False) -> Path:
    """
    Look whether a bag can be written to a folder, before the run that fills it.

    Parameters
    ----------
    directory : path
        The folder of the bag.
    overwrite : bool
        Whether the bag that is there may be replaced.

    Returns
    -------
    pathlib.Path
        The folder, absolute.

    Raises
    ------
    InputError
        A file or link of this name, the present folder, one above it, the home folder or the
        root of a disk; a folder that is not empty and must not be replaced, or holds anything
        but one bag; no right or room to write there.

    """
    directory = _absolute(directory)
    _bag_in(directory, overwrite)
    try_to_write(directory / 'any' if directory.is_dir() and not overwrite else directory)
    return directory


def bags_called(directory: StrPath) -> dict[Path, int]:
    """
    Return each folder that may hold the bag of a name, finished or not, with its inode.

    A bag that replaced another is told from it by the inode. Empty folders do not count.

    Parameters
    ----------
    directory : path
        The folder of the bag, absolute.

    """
    directory = Path(directory)
    name = re.compile(re.escape(directory.name) + rf'(({STOPPED}|{UNFINISHED})\d*)?')
    found = {}
    with contextlib.suppress(OSError):
        for path in sorted(directory.parent.iterdir()):
            if name.fullmatch(path.name) and path.is_dir() and any(path.iterdir()):
                found[path] = path.stat().st_ino
    return found


class BagPlace:
    """
    The folder a bag is written into until it is settled or given up.

    Parameters
    ----------
    directory, overwrite
        As ``check_bag_target``, which is asked first.
    beside : bool
        Write beside the folder also where there is none yet.

    Attributes
    ----------
    directory : pathlib.Path
        Where the bag shall be in the end; after ``settle`` where it is.
    folder : pathlib.Path
        Where it is written.

    """

    def __init__(self, directory: StrPath, overwrite: bool = False, beside: bool = False) -> None:
        directory = check_bag_target(directory, overwrite)
        self.directory = self.folder = directory
        self._former = _bag_in(directory, overwrite)
        self._lock: int | None = None
        if beside:
            _remove_left(directory)
            self.folder = _free(directory, f'{BEGUN}{directory.name}')
        elif self._former:
            self.folder = _free(directory, f'{directory.name}{UNFINISHED}')
        self._made = [path for path in (self.folder, *self.folder.parents) if not path.exists()]
        make_folder(self.folder)
        if beside:
            self._lock = os.open(self.folder, os.O_RDONLY)
            _take(self._lock)

    def settle(self, whole: bool = True) -> Path:
        """
        Put a closed bag in its place; return its folder.

        One that is not whole replaces nothing: it gets a name of its own beside the former.
        """
        if not self._former:
            if self.folder != self.directory:
                os.rename(self.folder, self.directory)
                self._moved()
            return self.directory
        if not whole:
            self.directory = _free(self.directory, f'{self.directory.name}{STOPPED}')
            os.rename(self.folder, self.directory)
            self._moved()
            return self.directory
        aside = _free(self.directory, f'{self.directory.name}{FORMER}')
        os.rename(self.directory, aside)
        try:
            os.rename(self.folder, self.directory)
        except BaseException:
            os.rename(aside, self.directory)
            raise
        former, self._former = self._former, []     # the new bag is in its place
        self._moved()
        # What else was put into the old folder meanwhile stays there.
        for name in former:
            with contextlib.suppress(OSError):
                (aside / name).unlink()
        with contextlib.suppress(OSError):
            aside.rmdir()
        return self.directory

    def _moved(self) -> None:
        self.folder, self._made = self.directory, [self.directory]
        self._unlock()
        disk.sync_directory(self.directory.parent)

    def give_up(self, files: Iterable[Path]) -> None:
        """Remove the given files of a bag that came to nothing, and the folders made for it."""
        for path in files:
            with contextlib.suppress(OSError):
                path.unlink()
        for folder in self._made:
            with contextlib.suppress(OSError):
                folder.rmdir()
        self._unlock()

    def _unlock(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
        self._lock = None


def _absolute(directory: StrPath) -> Path:
    """Return the folder with the links on the way resolved; its own name may be no link."""
    text = os.fspath(directory)
    if not text.strip() or '\0' in text:
        raise InputError(f'{text!r} is no name of a folder; give one for the bag', 'output')
    if text.startswith('~'):
        raise InputError('~ is not replaced by the home folder here; write that out', shown(text))
    try:
        if stat.S_ISLNK(os.lstat(text.rstrip(os.sep) or os.sep).st_mode):
            raise InputError('is a symbolic link; give the name of a new folder', shown(text))
    except (FileNotFoundError, NotADirectoryError):
        pass
    except OSError as error:
        raise InputError(f'cannot be written: {reason(error)}', shown(text)) from None
    path = Path(text).resolve()
    if len(os.fsencode(path.name)) > LONGEST_NAME_BYTES:
        raise InputError('the name is too long for a bag; give a shorter one', shown(text))
    try:
        path.name.encode()
    except UnicodeEncodeError:          # its files could not stand in metadata.yaml
        raise InputError('the name of a bag has bytes that are no UTF-8; give another one',
                         shown(text)) from None
    here = Path.cwd()
    if path == here or path in here.parents:
        raise InputError(
            'is the present folder or one above it; give the name of a new folder', shown(text))
    if path == Path(os.path.expanduser('~')) or path == Path(path.anchor) or path.is_mount():
        raise InputError('is no folder for one bag; give the name of a new folder', shown(text))
    return path


def _bag_in(directory: Path, overwrite: bool) -> list[str]:
    """Return the names of the files of the bag that may be replaced, [] for a free folder."""
    if not directory.is_dir():
        if directory.exists():
            raise InputError(
                'a file has this name; give the name of a new directory', shown(directory))
        return []
    try:
        present = sorted(os.listdir(directory))
    except OSError as error:
        raise InputError(f'cannot be read: {reason(error)}', shown(directory)) from None
    if not present:
        return []
    if not overwrite:
        raise InputError(
            'the directory exists and is not empty; give another name or ask to overwrite '
            '(--overwrite, of a node overwrite:=true)', shown(directory))
    ours = _files_of_bag(directory)
    other = [name for name in present if name not in ours]
    if other:
        raise InputError(
            f'the directory holds {other[0]!r}, which is no part of a bag, and is not '
            'overwritten; give another name', shown(directory))
    return [name for name in ours if name in present]


def _files_of_bag(directory: Path) -> list[str]:
    """Return the names of metadata.yaml and of the files it lists; InputError without a bag."""
    listed = None
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        if _is_regular(directory / layout.METADATA_FILE):
            facts = layout.read_metadata(directory)
            if facts['storage_identifier'] == layout.STORAGE_IDENTIFIER:
                listed = facts['relative_file_paths']
    if not isinstance(listed, list) or not listed:
        raise InputError(
            f'the directory holds no bag with a {layout.METADATA_FILE} and is not overwritten; '
            'give another name', shown(directory))
    return [layout.METADATA_FILE] + [
        name for name in listed if isinstance(name, str) and name.endswith('.mcap')
        and os.path.basename(name) == name and _is_regular(directory / name)]


def _is_regular(path: Path) -> bool:
    try:
        return stat.S_ISREG(os.lstat(path).st_mode)
    except OSError:
        return False


def _take(folder: int) -> bool:
    """Return whether an open folder is locked for this process now; no other holds it then."""
    try:
        fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _remove_left(directory: Path) -> None:
    """Remove what killed processes left of a bag that was written beside this folder."""
    part = re.compile(re.escape(directory.name) + r'_\d+\.mcap')
    name = re.compile(re.escape(f'{BEGUN}{directory.name}') + r'\d*')
    parent = directory.parent
    for folder in [parent / one for one in os.listdir(parent) if name.fullmatch(one)] if (
            parent.is_dir()) else ():
        with contextlib.suppress(OSError):
            files = sorted(folder.iterdir())
            opened = os.open(folder, os.O_RDONLY)
            try:
                # An empty one may just begin.
                if files and _take(opened) and all(_is_regular(one) and (
                        one.name == layout.METADATA_FILE or part.fullmatch(one.name))
                        for one in files):
                    for one in files:
                        one.unlink()
                    folder.rmdir()
            finally:
                os.close(opened)


def _free(directory: Path, name: str) -> Path:
    """Return a path beside ``directory`` that nothing has yet: ``name``, else with a number."""
    path, number = directory.with_name(name), 1
    while os.path.lexists(path):
        number += 1
        path = directory.with_name(f'{name}{number}')
    return path

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
Files that are written whole or not at all, and only where nothing is lost.

Every writer of the two packages ends here. A target is looked at before the work
starts (``check_file``, ``check_folder``) and written through temporary files beside it
(``whole_file``, ``whole_files``, ``write_text``, ``write_json``). Only regular files are
replaced: never a device, a pipe, a folder or what a symbolic link points to.
"""

from collections.abc import Iterable, Iterator
import contextlib
import json
import os
from pathlib import Path
import shutil
import stat
import tempfile
from typing import Any

from pam_sim.errors import InputError

StrPath = str | os.PathLike[str]

UNFINISHED = '.unfinished-'   # temporary files and folders begin with it
LONGEST_NAME = 100            # of an experiment or muscle: the file system takes 255 bytes in all
LONGEST_PART_BYTES = 255      # that file systems take between two slashes
_TRIED_BYTES = _LOOKED_AT = 4096
_SHOWN = 120
_KINDS = ((stat.S_ISLNK, 'a symbolic link'), (stat.S_ISDIR, 'a folder'),
          (stat.S_ISBLK, 'a device'), (stat.S_ISCHR, 'a device'), (stat.S_ISFIFO, 'a pipe'),
          (stat.S_ISSOCK, 'a socket'))


def check_file(
        path: StrPath, overwrite: bool = True, parents: bool = True, ours: str = '') -> Path:
    """
    Look whether a file can be written, before the work whose result it shall hold.

    Parameters
    ----------
    path : path
        The file.
    overwrite : bool
        Whether a regular file that is there already may be replaced.
    parents : bool
        Whether folders on the way to it that are missing are made when it is written.
    ours : str
        Words at the beginning of a file that was made here, may be replaced in any case and
        be made again.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    InputError
        An empty or impossible name, a folder, a link, a device, a file that must stay, or no
        right or room to write there.

    """
    target = _checked_path(path, 'file')
    mode = _mode(target)
    if mode is not None and not stat.S_ISREG(mode):
        raise InputError(
            f'cannot be written: it is {_kind(mode)}; give the name of a new or regular file',
            shown(target))
    if mode is None and os.fspath(path).endswith(os.sep):
        raise InputError(
            'cannot be written: this is the name of a folder; give that of a file', shown(path))
    if mode is not None and not (overwrite or holds(target, ours)):
        raise InputError(
            'exists already; give another name, or allow to replace it (--overwrite)',
            shown(target))
    if mode is not None and not os.access(target, os.W_OK):
        raise InputError('cannot be replaced: it is write-protected', shown(target))
    if not parents and not target.absolute().parent.is_dir():
        raise InputError(
            f'cannot be written: the folder {shown(target.parent)} does not exist',
            shown(target))
    try_to_write(target)
    return target


def check_folder(
        path: StrPath, names: Iterable[str] = (), overwrite: bool = True, ours: str = '') -> Path:
    """
    Look whether results can be written into a folder, before the work that makes them.

    Parameters
    ----------
    path : path
        The folder; it may be missing.
    names : iterable of str
        Files that will be written into it.
    overwrite : bool
        Whether regular files of these names may be replaced. Others are never touched.
    ours
        As for ``check_file``.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    InputError
        As ``check_file``; a file has the name of the folder.

    """
    folder = _checked_path(path, 'folder')
    if not folder.is_dir():
        if _mode(folder) is not None:
            raise InputError('is a file; give a folder for the results', shown(folder))
        try_to_write(folder)
        return folder
    for name in names:
        check_file(folder / name, overwrite, ours=ours)
    try_to_write(folder / 'any')
    return folder


def refuse_pipe(path: StrPath) -> None:
    """Raise InputError for a pipe or socket with a name, which would be waited for for ever."""
    mode = None
    with contextlib.suppress(OSError, ValueError):
        mode = os.stat(path).st_mode
    # The shell names its own pipes /dev/fd/…; somebody writes into those.
    if mode is not None and (stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode)) \
            and not os.fspath(path).startswith(('/dev/', '/proc/')):
        raise InputError(f'cannot be read: it is {_kind(mode)}; give a file', shown(path))


def holds(path: StrPath, words: str) -> bool:
    """Return whether a file has these words near its beginning; line ends count as spaces."""
    if not words or not os.path.isfile(path):
        return False
    try:
        with open(path, encoding='utf-8') as stream:
            return words in ' '.join(stream.read(_LOOKED_AT).split())
    except (OSError, ValueError):
        return False


def make_folder(path: StrPath) -> Path:
    """Make a folder and those above it; InputError where that cannot be."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f'the folder cannot be made: {reason(error)}', shown(path)) from None
    return Path(path)


@contextlib.contextmanager
def whole_file(path: StrPath, suffix: str = '', parents: bool = True) -> Iterator[str]:
    """
    Give the name of a temporary file that becomes ``path`` when the block ends well.

    Parameters
    ----------
    path : path
        The file to write.
    suffix : str
        Ending of the temporary name, for libraries that look at it.
    parents : bool
        Whether folders on the way that are missing are made.

    Raises
    ------
    InputError
        As ``check_file``, and whatever the file system refuses while the block writes.

    """
    path = check_file(path, parents=parents)
    make_folder(path.parent)
    temporary = None
    try:
        # Not made from the name: a long one would not leave room for more.
        handle, temporary = tempfile.mkstemp(
            prefix=UNFINISHED, suffix=suffix, dir=path.parent)
        os.close(handle)
        yield temporary
        with open(temporary, 'rb') as stream:
            os.fsync(stream.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
        temporary = None
    except OSError as error:
        raise cannot_write(path, error) from None
    finally:
        if temporary is not None:
            with contextlib.suppress(OSError):
                os.unlink(temporary)


@contextlib.contextmanager
def whole_files(folder: StrPath, among: Iterable[str] = ()) -> Iterator[Path]:
    """
    Give a folder whose files all go into ``folder`` when the block ends well, else none.

    Parameters
    ----------
    folder : path
        Made if needed.
    among : iterable of str
        All names that such results may have. Files of these names that are not written now are
        of an earlier result, and are removed.

    Raises
    ------
    InputError
        As ``check_folder``, and whatever the file system refuses while the block writes.

    """
    folder = check_folder(folder)
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    make_folder(folder)
    written, temporary = False, None
    try:
        temporary = Path(tempfile.mkdtemp(prefix=UNFINISHED, dir=folder))
        yield temporary
        names = sorted(path.name for path in temporary.iterdir())
        for name in names:
            check_file(folder / name)
        for name in names:
            os.replace(temporary / name, folder / name)
        written = True
        for name in {*among}.difference(names):
            if stat.S_ISREG(_mode(folder / name) or 0):
                os.unlink(folder / name)
    except OSError as error:
        raise cannot_write(folder, error) from None
    finally:
        if temporary is not None:
            shutil.rmtree(temporary, ignore_errors=True)
        for path in () if written else made:
            with contextlib.suppress(OSError):
                path.rmdir()


def write_text(path: StrPath, content: str, parents: bool = True) -> Path:
    """Write a text file, whole or not at all; return its path. InputError as ``whole_file``."""
    with whole_file(path, parents=parents) as temporary:
        with open(temporary, 'w', encoding='utf-8') as stream:
            stream.write(content)
    return Path(path)


def write_json(path: StrPath, data: Any) -> Path:
    """
    Write plain data as an indented JSON file, whole or not at all; return its path.

    Raises
    ------
    InputError
        As ``whole_file``.
    ValueError
        A number is infinite or not a number; JSON has none of these.

    """
    return write_text(path, json.dumps(data, indent=2, allow_nan=False) + '\n')


def try_to_write(path: StrPath) -> None:
    """
    Write a little beside ``path``, or into the nearest folder there is, and remove it again.

    Raises
    ------
    InputError
        The system refuses, or what should be a folder is none.

    """
    folder = Path(os.path.abspath(path)).parent
    while not folder.is_dir():
        if _mode(folder) is not None:
            raise InputError(
                f'cannot be written: {shown(folder)} is no folder', shown(path))
        folder = folder.parent
    name = None
    try:
        handle, name = tempfile.mkstemp(prefix=UNFINISHED, dir=folder)
        if os.write(handle, bytes(_TRIED_BYTES)) < _TRIED_BYTES:
            raise OSError(0, 'no space left on the device')
    except OSError as error:
        raise cannot_write(path, error) from None
    finally:
        if name is not None:
            os.close(handle)
            os.unlink(name)


def cannot_write(path: StrPath, error: OSError) -> InputError:
    """Return the InputError for an OSError that came while writing ``path``."""
    return InputError(f'cannot be written: {reason(error)}', shown(path))


def reason(error: OSError) -> str:
    """Return why the operating system refused, in words."""
    return error.strerror or str(error)


def shown(path: StrPath) -> str:
    """Return a path as text for a message, bytes that are none escaped, cut where it is long."""
    text = os.fspath(path).encode(errors='backslashreplace').decode()
    return text if len(text) <= _SHOWN else f'{text[:_SHOWN // 2]}…{text[-_SHOWN // 3:]}'


def check_name(name: str, what: str, where: str) -> str:
    """
    Return a name that is also used for files, such as that of an experiment.

    Raises
    ------
    InputError
        It could lead out of the folder it is used in, or is no name of a file.

    """
    if not name.strip():
        raise InputError(f'{what} is empty; give a name', where)
    if len(name) > LONGEST_NAME:
        raise InputError(
            f'{what} has {len(name)} characters; allowed are {LONGEST_NAME}', where)
    if name[0] in '.-~' or not name.isprintable() or '/' in name or '\\' in name:
        raise InputError(
            f'{what} is {name!r}; files are named after it, so it begins with a letter, a digit '
            'or _, and has no / \\ or control characters', where)
    return name


def _checked_path(path: StrPath, what: str) -> Path:
    """Return a Path of which the system can at least say whether it is there."""
    text = os.fspath(path)
    if not text.strip():
        raise InputError(f'"{text}" is no name of a {what}', 'output')
    if text.startswith('~'):
        raise InputError(
            'cannot be written: ~ is not replaced by the home folder here; write that out',
            shown(text))
    if '\0' in text:
        raise InputError(f'has a character that no {what} can have', repr(shown(text)))
    if any(len(os.fsencode(part)) > LONGEST_PART_BYTES for part in Path(text).parts):
        raise InputError('cannot be written: the name is too long', shown(text))
    try:
        os.lstat(text)
    except (FileNotFoundError, NotADirectoryError):
        pass
    except OSError as error:
        raise cannot_write(text, error) from None
    return Path(text)


def _mode(path: StrPath) -> int | None:
    """Return the file mode of what has this name, links not followed; None without any."""
    try:
        return os.lstat(path).st_mode
    except OSError:
        return None


def _kind(mode: int) -> str:
    return next((words for matches, words in _KINDS if matches(mode)), 'no regular file')

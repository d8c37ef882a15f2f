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

"""What a recorder asks of the operating system: whole writes, a lock, data on the disk."""

import errno
import os
from typing import BinaryIO

from pam_sim.files import StrPath

try:
    import fcntl
except ImportError:             # not on Windows: there only offline bags are written
    fcntl = None    # type: ignore[assignment]  # a module that Windows lacks

FULL = (errno.ENOSPC, errno.EDQUOT)         # where more room helps


def write_all(stream: BinaryIO, data: bytes) -> None:
    """Write all bytes to an unbuffered stream; OSError when the file system refuses."""
    view = memoryview(data)
    while len(view):
        view = view[stream.write(view):]


def lock(stream: BinaryIO) -> bool:
    """
    Mark an open file as being written, until it is closed or its process ends.

    Returns False if another process, or another stream of this one, has marked it.
    """
    if fcntl is None:
        return True
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True             # a file system without locks
    return True


def sync(handle: int) -> None:
    """Wait until what was written to a file descriptor is on the disk."""
    getattr(os, 'fdatasync', os.fsync)(handle)


def sync_directory(directory: StrPath) -> None:
    """Bring the names in a directory onto the disk, where the system can."""
    if os.name != 'posix':
        return
    handle = os.open(directory, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)

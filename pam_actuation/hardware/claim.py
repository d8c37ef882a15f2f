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

"""The exclusive use of a device: two drivers that write in turn would undo each other's vents."""

import fcntl
import os
from pathlib import Path
import weakref

from pam_actuation.hardware.sysfs import DeviceError

LOCKS = Path('/proc/locks')


class Claim:
    """
    A lock of the system on a file or folder of a device; it ends with the process at the latest.

    It only counts among those who ask for it, as all drivers of this package do. A file that
    cannot be opened or locked is not claimed: what is wrong with it, the first write tells.

    Parameters
    ----------
    path : str or Path
        File, folder or device node that stands for the device, such as ``/dev/ttyACM0``.

    Raises
    ------
    DeviceError
        Another one has it; the text says who.

    """

    def __init__(self, path: Path | str) -> None:
        try:
            file = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY)
        except OSError:
            self.release = _nothing
            return
        self.release = weakref.finalize(self, os.close, file)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = _holder(os.fstat(file).st_ino)
            self.release()
            raise DeviceError(f'is driven by {holder} already', path) from None
        except OSError:
            self.release()


def _nothing() -> None:
    """Release what is not held."""


def _holder(inode: int) -> str:
    """Return the process that holds the lock on a file, as far as Linux tells."""
    try:
        lines = [line.split() for line in LOCKS.read_text().splitlines()]
        pid = next(int(words[4]) for words in lines
                   if words[1] == 'FLOCK' and words[5].rpartition(':')[2] == str(inode))
        if pid == os.getpid():
            return 'another driver in this process'
        words = Path(f'/proc/{pid}/cmdline').read_text(errors='replace').split('\0')
        return f'process {pid} ({" ".join(words).strip()[:80]})'
    except (OSError, StopIteration, ValueError, IndexError):
        return 'another process'

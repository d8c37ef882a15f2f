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

"""The priority of processes beside live nodes, which go first."""

from contextlib import suppress
import os
from pathlib import Path
import time

NICENESS = 10               # of 19: a tenth of the time where another process wants the core
_SHARE = Path('/proc/self/autogroup')


def give_way() -> None:
    """Give this process, in a session of its own, a low priority from now on."""
    with suppress(PermissionError):     # it has one already
        os.setsid()
    os.nice(max(NICENESS - os.nice(0), 0))
    keep_niceness()


def keep_niceness() -> None:
    """
    Give the session that this process began the niceness of the process.

    Linux may share the cores between sessions first (autogroup), and only then between the
    processes of each. A new session has the usual share, however nice its processes are.
    """
    niceness = os.nice(0)
    if niceness > 0:
        with suppress(OSError):         # a system that does not share in this way
            try:
                _SHARE.write_text(str(niceness))
            except BlockingIOError:     # all processes of users together may do so once in 0.1 s
                time.sleep(0.11)
                _SHARE.write_text(str(niceness))

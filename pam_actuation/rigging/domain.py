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

"""A ROS domain of one's own, so that two sessions on a machine do not mix."""

import fcntl
import glob
import os
import socket
import tempfile
from typing import TextIO

from pam_sim.errors import InputError

LOWEST, HIGHEST = 1, 100       # higher ones collide with the ports Linux hands out itself
PORT_BASE, PORTS_PER_DOMAIN, FIRST_PARTICIPANT = 7400, 250, 10
HIGHEST_OF_ROS = 232
PORTS_EACH, PARTICIPANTS = 2, 20        # the first ones may have left


class DomainLock:
    """
    Hold a ROS domain id: no other session on this machine that takes a free one gets the same.

    ``domains_in_use`` finds it for as long as it is held.

    Parameters
    ----------
    domain_id : int, optional
        Use this one, whoever else does; default: a free one.

    Raises
    ------
    InputError
        No free domain, or an id outside 0 to 232.

    """

    def __init__(self, domain_id: int | None = None) -> None:
        self._file: TextIO | None = None
        if domain_id is not None:
            if not 0 <= domain_id <= HIGHEST_OF_ROS:
                raise InputError(
                    f'{domain_id} is not allowed, give 0 to {HIGHEST_OF_ROS}', 'domain id')
            self.domain_id = domain_id
            self._file = _locked(domain_id)
            return
        span = HIGHEST - LOWEST + 1
        for k in range(span):
            candidate = LOWEST + (os.getpid() + k) % span
            if self._take(candidate):
                self.domain_id = candidate
                return
        raise InputError(f'all ROS domains from {LOWEST} to {HIGHEST} are in use', 'domain id')

    def _take(self, candidate: int) -> bool:
        handle = _locked(candidate)
        if handle is None:
            return False
        if not is_silent(candidate):
            handle.close()
            return False
        self._file = handle
        return True

    @property
    def is_held(self) -> bool:
        """Tell whether no other session on this machine holds the domain."""
        return self._file is not None

    def release(self) -> None:
        """Give the domain back."""
        if self._file is not None:
            self._file.close()
            self._file = None


def own_domain() -> int:
    """
    Return the ROS domain of this environment, 0 where ``ROS_DOMAIN_ID`` is empty or not set.

    Raises
    ------
    InputError
        It is no domain.

    """
    text = os.environ.get('ROS_DOMAIN_ID') or '0'
    if not text.isdecimal() or int(text) > HIGHEST_OF_ROS:
        raise InputError(
            f'{text!r} is not allowed, it must be 0 to {HIGHEST_OF_ROS}', 'ROS_DOMAIN_ID')
    return int(text)


def _locked(domain_id: int) -> TextIO | None:
    """Return the locked file of a domain, None if another session or user has it."""
    try:
        handle = open(_path(domain_id), 'a')
    except OSError:
        return None         # the lock of another user
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        handle.close()
        return None
    return handle


def _path(domain_id: object) -> str:
    return os.path.join(tempfile.gettempdir(), f'pam_actuation_domain_{domain_id}.lock')


def domains_in_use() -> list[int]:
    """Return the ROS domains in which sessions on this machine run, sorted."""
    before, after = _path('*').split('*')
    found = []
    for path in glob.glob(f'{glob.escape(before)}*{after}'):
        number = path.removeprefix(before).removesuffix(after)
        try:
            with open(path) as handle:
                fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            if number.isdigit():
                found.append(int(number))
        except OSError:
            pass            # gone meanwhile, or not ours to look at
    return sorted(found)


def is_silent(domain_id: int) -> bool:
    """Tell whether the ports that participants of a domain listen on first are free."""
    first = PORT_BASE + PORTS_PER_DOMAIN * domain_id + FIRST_PARTICIPANT
    for port in range(first, first + PORTS_EACH * PARTICIPANTS, PORTS_EACH):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(('', port))
            except OSError:
                return False
    return True

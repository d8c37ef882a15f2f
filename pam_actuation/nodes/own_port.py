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
Whether the shared-memory ports of this process are still those that others write to.

Fast DDS, below ROS 2, moves messages on one machine through shared-memory ports, files in
``/dev/shm``. A new process takes the lowest number that is free, after a kill that of the dead
one. Others, who do not know of that death yet, remove and create the port of the dead one with
every message, and may remove the one that the new process has just opened: it then listens at a
port without a name, and whoever opens the port by its name is never heard.

The ports of a process are those of which it holds the lock (``..._el``); Linux tells which
file is mapped (``/proc/self/maps``) and which one has that name now.
"""

import os
import re

UNKNOWN, SOUND, REMOVED = 'unknown', 'sound', 'removed'
PORT = re.compile(r'fast(?:rtps|dds)_port\d+')
LOCK = re.compile(rf'({PORT.pattern})_el')
DELETED = ' (deleted)'


def locked_ports(targets):
    """Return the names of the ports whose locks are among the targets of open descriptors."""
    found = set()
    for target in targets:
        match = LOCK.fullmatch(os.path.basename(target).removesuffix(DELETED))
        if match:
            found.add(match[1])
    return found


def mapped_ports(maps):
    """
    Return which shared-memory ports are mapped.

    Parameters
    ----------
    maps : bytes
        As in ``/proc/PID/maps``.

    Returns
    -------
    dict
        Name of the port to a set of (inode, whether its file was deleted).

    """
    found = {}
    for line in maps.splitlines():
        if b'/fast' not in line:
            continue
        fields = line.decode(errors='replace').split(None, 5)
        name = os.path.basename(fields[5].removesuffix(DELETED))
        if PORT.fullmatch(name):
            found.setdefault(name, set()).add((int(fields[4]), fields[5].endswith(DELETED)))
    return found


class OwnPorts:
    """
    The ports of one process; ``look`` now and then.

    A look costs some microseconds as long as all is well, a few milliseconds the first times.

    Parameters
    ----------
    process, directory : str
        Where the system tells of the process, and where the ports are.

    Attributes
    ----------
    removed : set of str
        Ports that were removed, by the last look.

    """

    def __init__(self, process='/proc/self', directory='/dev/shm'):
        self._process = process
        self._directory = directory
        self._locked = set()
        self._inodes = {}
        self._suspected = set()
        self.removed = set()

    def look(self):
        """
        Return ``sound``, ``removed`` or, without such ports or on another system, ``unknown``.

        Two looks in a row must find the same: a lock may be open for a moment to be tried,
        and a port on its way to be created anew is missing for a moment.
        """
        try:
            if self._suspected or not self._inodes or not all(
                    self._in_place(name) for name in self._inodes):
                self._look_closely()
        except (OSError, ValueError, IndexError):
            self._inodes, self._suspected, self.removed = {}, set(), set()
        if self.removed:
            return REMOVED
        return SOUND if self._inodes else UNKNOWN

    def _in_place(self, name):
        """Tell whether the file of a port is the one that was mapped."""
        try:
            inode = os.stat(os.path.join(self._directory, name)).st_ino
        except FileNotFoundError:
            inode = None
        return inode == self._inodes[name]

    def _look_closely(self):
        before, self._locked = self._locked, self._ports_locked()
        with open(f'{self._process}/maps', 'rb') as stream:
            mapped = mapped_ports(stream.read())
        suspected = set()
        known = self._inodes
        self._inodes = {}
        for name in before & self._locked:
            mappings = mapped.get(name, set())
            inodes = {inode for inode, _ in mappings} or {known.get(name)} - {None}
            if not inodes:
                continue
            self._inodes[name] = min(inodes)
            if len(inodes) > 1 or any(deleted for _, deleted in mappings) or (
                    not self._in_place(name)):
                suspected.add(name)
        self.removed = suspected & self._suspected
        self._suspected = suspected

    def _ports_locked(self):
        directory = f'{self._process}/fd'
        targets = []
        for descriptor in os.listdir(directory):
            try:
                targets.append(os.readlink(os.path.join(directory, descriptor)))
            except OSError:
                pass            # closed meanwhile
        return locked_ports(targets)

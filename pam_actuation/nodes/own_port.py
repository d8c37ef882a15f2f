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
Make sure that a node started after a kill has a shared-memory port that others can find.

Fast DDS, below ROS 2, moves messages on one machine through shared-memory ports, files in
``/dev/shm`` whose names follow from the number of the participant in its domain. A new process
takes the lowest number that is free, after a kill that of the dead one. Others, who do not know
of that death for 20 s, remove and create the port of the dead one with every message once they
have found it broken; one just doing so may remove the port that the new process has opened.
The new one then listens at a port without a name, and who opens it by its name is never heard.

So a node that takes a number left behind is on probation at first: if its port is removed, it is
created once more, before it has done anything. The second time it takes the same number, for a
sound port of that name ends what the others do in vain; from the third on it keeps off it.
"""

import contextlib
import math
import os
import re
import socket
import time

DIRECTORY = '/dev/shm'
PORT = re.compile(r'fastrtps_port\d+')
LOCK = re.compile(rf'({PORT.pattern})_el')
PROBATION_S = 1.2           # ports were removed 0.3 to 0.64 s after the start
LOOK_S, LOOKS = 0.01, 4     # a port on its way to be created anew is missing for a moment
MOST = 8
LOOK_AGAIN_S = 2.0


def port_files(directory=DIRECTORY):
    """Return the names of all shared-memory ports of this machine, whoever is behind them."""
    try:
        return set(filter(PORT.fullmatch, os.listdir(directory)))
    except OSError:
        return set()        # no such folder, so no such ports


class OwnPorts:
    """
    The shared-memory ports on which this process listens.

    Parameters
    ----------
    process, directory : str
        Where the system tells of the process, and where the ports are.

    """

    def __init__(self, process='/proc/self', directory=DIRECTORY):
        self._process = process
        self._directory = directory

    def names(self):
        """Return their names: those of which the process has the lock (``..._el``) open."""
        found = set()
        folder = os.path.join(self._process, 'fd')
        for descriptor in os.listdir(folder):
            try:
                target = os.readlink(os.path.join(folder, descriptor))
            except OSError:
                continue            # closed meanwhile
            match = LOCK.fullmatch(os.path.basename(target.removesuffix(' (deleted)')))
            if match:
                found.add(match[1])
        return found

    def inode(self, name):
        """Return the inode of the file that has the name of a port now, None if there is none."""
        try:
            return os.stat(os.path.join(self._directory, name)).st_ino
        except OSError:
            return None

    def removed(self):
        """Return the names of those that others do not find any more, or find another one."""
        names = self.names()
        mapped = {}
        with open(os.path.join(self._process, 'maps'), 'rb') as stream:
            for line in stream:
                if b'/fastrtps_port' in line:
                    fields = line.decode(errors='replace').split(None, 5)
                    name = os.path.basename(fields[5].strip().removesuffix(' (deleted)'))
                    mapped.setdefault(name, set()).add(int(fields[4]))
        return {name for name in names
                if name in mapped and self.inode(name) not in mapped[name]}


class PortWatch:
    """
    Whether others still find the ports of this process; cheap enough to ask twice a second.

    Parameters
    ----------
    ports : OwnPorts, optional
        Default: those of this process.
    now_s : callable, optional
        Steady time [s].

    """

    def __init__(self, ports=None, now_s=time.monotonic):
        self._ports = ports or OwnPorts()
        self._now_s = now_s
        self._inodes = self._present()
        self._looked_s = -math.inf
        self._suspected = set()
        self._removed = set()

    def _present(self):
        try:
            names = self._ports.names()
        except OSError:
            return {}               # not Linux
        return {name: self._ports.inode(name) for name in names}

    def removed(self):
        """Return the names of ports found removed twice, ``LOOK_AGAIN_S`` apart or more."""
        if all(self._ports.inode(name) == inode for name, inode in self._inodes.items()):
            self._suspected = self._removed = set()
        elif self._now_s() - self._looked_s >= LOOK_AGAIN_S:
            self._looked_s = self._now_s()
            try:
                found = self._ports.removed()
            except OSError:
                found = set()
            self._removed = found & self._suspected
            self._suspected = found
            if not found:
                self._inodes = self._present()      # the middleware has renewed it itself
        return self._removed


def stays_removed(ports, sleep=time.sleep):
    """Return the names of ports that are found removed in ``LOOKS`` looks, one after another."""
    names = ports.removed()
    for _ in range(LOOKS - 1):
        if not names:
            break
        sleep(LOOK_S)
        names &= ports.removed()
    return names


def ports_in_use():
    """Return the names of all ports found in ``LOOKS`` looks; one look if there is none."""
    names = port_files()
    for _ in range(LOOKS - 1):
        if not names:
            break
        time.sleep(LOOK_S)
        names |= port_files()
    return names


@contextlib.contextmanager
def numbers_kept_off(names):
    """Keep participants created inside off the numbers of some ports."""
    with contextlib.ExitStack() as held:
        for name in names:
            holder = held.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            with contextlib.suppress(OSError, OverflowError):
                # Whoever gets this UDP port gets the shared-memory port one above.
                holder.bind(('0.0.0.0', int(re.search(r'\d+', name)[0]) - 1))
        yield


def create(new, end):
    """
    Create a node whose ports others can find.

    Parameters
    ----------
    new : callable
        Creates and returns the node, with its participant.
    end : callable
        Gets a node and a sentence on why it has to go; ends it and its participant.

    Returns
    -------
    object
        The node.

    """
    ports, before = OwnPorts(), ports_in_use()
    removed, kept_off = set(), set()
    for attempt in range(MOST):
        with numbers_kept_off(kept_off):
            node = new()
        kept_off |= removed
        try:
            on_probation = removed or ports.names() & before
            removed = _removed_soon(ports) if on_probation else set()
        except OSError:
            break                   # not Linux
        if not removed or attempt == MOST - 1:
            break
        end(node, f'other processes removed its shared-memory port ({", ".join(sorted(removed))}),'
                  f' as they may after a kill: created once more ({attempt + 1})')
    return node


def _removed_soon(ports):
    """Return the names of ports that are removed within ``PROBATION_S``."""
    end_s = time.monotonic() + PROBATION_S
    while time.monotonic() < end_s:
        removed = stays_removed(ports)
        if removed:
            return removed
        time.sleep(LOOK_S)
    return set()

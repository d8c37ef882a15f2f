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
Start a node anew, as the same process, when it can no longer be heard by everybody.

A node looks at its own shared-memory ports (``own_port``), often in its first seconds, when
others may still write to a killed process of the same number. Was a port removed, the node
leaves as on every way out, safely and in order, and the process replaces itself by the same
program: same process id, so that whoever started it sees one process that never ended. Where
that would undo what somebody has asked of the node, it only tells.

The first new start takes the same number again: a sound port of that name ends what the others
do for the dead one. A writer that still has a nameless port of that number, though, removes the
new one with its next message. So a node that finds its port removed again keeps off its number.
"""

import contextlib
import os
import re
import socket
import sys
import time

from pam_actuation.nodes.own_port import OwnPorts, REMOVED

COUNTER = 'PAM_STARTED_ANEW'    # environment variable: how often in a row
KEEP_OFF = 'PAM_KEEP_OFF_UDP_PORTS'     # environment variable: of the numbers kept off
FIRST_UDP_PORT = 7410
MOST = 5
EARLY_S = 5.0                   # look often for so long
EARLY_PERIOD_S = 0.25
PERIOD_S = 0.5
LASTS_S = 0.75                  # Fast DDS itself renews a port it finds marked as broken
ANEW_WITHIN_S = 15.0            # later the node only tells


def times():
    """Return how often this process has started itself anew."""
    try:
        return int(os.environ.get(COUNTER, '0'))
    except ValueError:
        return MOST


def udp_ports(names):
    """
    Return the UDP ports that decide on the numbers of some shared-memory ports.

    A participant listens on UDP port 2 n and, through shared memory as well, on 2 n + 1; the
    private ports of the node list (7000 and up) have no such number.
    """
    numbers = [int(re.search(r'\d+', name)[0]) for name in names]
    return [number - 1 for number in numbers if number > FIRST_UDP_PORT]


@contextlib.contextmanager
def numbers_kept_off():
    """Hold the UDP ports of numbers that did no good while a participant is created inside."""
    with contextlib.ExitStack() as held:
        for port in os.environ.get(KEEP_OFF, '').split():
            holder = held.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            with contextlib.suppress(OSError, ValueError, OverflowError):
                holder.bind(('0.0.0.0', int(port)))
        yield


class PortWatch:
    """
    Look at the ports of the process of a node; decide what to do when one was removed.

    Parameters
    ----------
    node : ManagedNode
        Is asked ``may_start_anew()``, and gets ``starts_anew`` and ``diagnostics.remark``.
    alone : bool
        Whether the process is this node and nothing else.
    ports : OwnPorts, optional
        Default: those of this process.
    now_s : callable, optional
        Steady time [s].

    Attributes
    ----------
    reason : str
        Why the node is to start anew, '' if it is not.
    removed : list of str
        The ports it lost then.

    """

    def __init__(self, node, alone, ports=None, now_s=time.monotonic):
        self._node = node
        self._alone = alone
        self._ports = ports or OwnPorts()
        self._now_s = now_s
        self._begin_s = self._next_s = now_s()
        self.reason = ''
        self.removed = []
        self._removed_s = None
        self._ports.look()

    @property
    def period_s(self):
        """Return the time between two looks [s]."""
        return EARLY_PERIOD_S if self._now_s() - self._begin_s < EARLY_S else PERIOD_S

    def look(self):
        """Look if it is time to; return whether the node is to start anew."""
        now_s = self._now_s()
        if now_s < self._next_s:
            return False
        self._next_s = now_s + self.period_s - 0.01     # whoever asks sleeps that long
        node = self._node
        if self._ports.look() != REMOVED:
            node.diagnostics.remark = ''
            self._removed_s = None
            return False
        self._removed_s = now_s if self._removed_s is None else self._removed_s
        if now_s - self._removed_s < LASTS_S:
            return False
        what = (f'other processes removed its shared-memory port '
                f'({", ".join(sorted(self._ports.removed))})')
        if (self._alone and now_s - self._begin_s < ANEW_WITHIN_S and times() < MOST
                and node.may_start_anew()):
            self.reason = f'{what}: it starts itself anew ({times() + 1} of at most {MOST})'
            self.removed = sorted(self._ports.removed)
            node.starts_anew = node.stopping = True
            return True
        if not node.diagnostics.remark:
            node.get_logger().error(f'{what}: new senders are not heard, start this node anew')
        node.diagnostics.remark = f'{what} and new senders are not heard: start this node anew'
        return False


def replace_process(removed, still_wanted):
    """
    Replace this process by the same program; return only if that is not wanted any more.

    Parameters
    ----------
    removed : list of str
        Shared-memory ports it lost.
    still_wanted : callable
        Asked last: False if a signal came meanwhile.

    """
    environment = {**os.environ, COUNTER: str(times() + 1)}
    if times():
        ports = [*os.environ.get(KEEP_OFF, '').split(), *map(str, udp_ports(removed))]
        environment[KEEP_OFF] = ' '.join(ports)
    if os.sched_getscheduler(0) != os.SCHED_OTHER:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))     # not for loading modules
    for descriptor in os.listdir('/proc/self/fd'):
        if int(descriptor) > 2:
            try:
                os.set_inheritable(int(descriptor), False)      # the middleware leaves some open
            except OSError:
                pass
    sys.stdout.flush()
    sys.stderr.flush()
    if still_wanted():
        os.execve(sys.executable, sys.orig_argv, environment)

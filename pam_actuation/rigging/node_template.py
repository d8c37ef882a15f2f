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
Nodes as forks of one process that has imported everything: they start at once.

``template_for`` gives the template of an environment, one for each process of the user. Where a
command knows early that nodes will be needed, ``prepare_template`` starts it beforehand. On other
systems than Linux there is none, and each node is started by itself.
"""

import atexit
from collections.abc import Callable, Iterable, Mapping, Sequence
import contextlib
from functools import partial
import json
import math
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from typing import Any

from pam_actuation.rigging.processes import begin_session, node_environment

# Differ from node to node, or from test to test: all share one template.
OF_A_SESSION = ('ROS_DOMAIN_ID', 'ROS_LOG_DIR', 'PYTEST_CURRENT_TEST')
# Imported by a template that is started before the rig is known.
OF_A_RUN = ('experiment_recorder', 'plant_simulator', 'valve_watchdog', 'valve_driver',
            'sofc_controller', 'reference_generator')
PREPARE_TIMEOUT_S = 60.0        # for its imports, on a busy machine
END_TIMEOUT_S = 5.0
TELL_AFTER_S = 3.0
COMPILES = 'compiling for the first run on this machine, up to two minutes'
ROOM_FOR_WORDS = 4000           # for the command lines of its nodes, see ``name_process``
READ_BYTES = 1 << 16


class NodeTemplate:
    """
    The process that nodes are forked from.

    Parameters
    ----------
    names : iterable of str
        Nodes it imports beforehand; others it imports when asked for.
    environment : mapping of str
        Variables it is started with.

    """

    def __init__(self, names: Iterable[str], environment: Mapping[str, str]) -> None:
        self._channel, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, '-m', 'pam_actuation.nodes.template', str(theirs.fileno()),
                 *dict.fromkeys(names), ' ' * ROOM_FOR_WORDS],
                env=dict(environment), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL, start_new_session=True, pass_fds=(theirs.fileno(),),
                preexec_fn=partial(begin_session, os.getpid()))
        self._unread = b''
        self._ready = self._spoiled = False
        self._asked = self._compiles = False
        self._not_compiled = ''
        self._ended: dict[int, int] = {}
        self._lock = threading.RLock()
        self._owner = os.getpid()
        atexit.register(self.close)

    @property
    def usable(self) -> bool:
        """Tell whether it runs, as a child of this process."""
        return (self._owner == os.getpid() and not self._spoiled
                and self._process.poll() is None)

    def wait_until_ready(self) -> None:
        """Wait for its imports; Ctrl-C ends the waiting."""
        deadline_s = time.monotonic() + PREPARE_TIMEOUT_S
        while not self._ready and self.usable and time.monotonic() < deadline_s:
            with self._lock:
                self._read(0.1)

    def compile_ahead(self, files: Sequence[str]) -> None:
        """
        Ask it to compile what a run needs; it does so before it forks the next node.

        Parameters
        ----------
        files : sequence of str
            Arguments of ``compile_ahead.compile_ahead``.

        """
        with self._lock, contextlib.suppress(OSError):      # it has ended: nodes compile
            self._channel.sendall(json.dumps({'compile': list(files)}).encode() + b'\n')
            self._asked, self._compiles = True, False

    def wait_until_compiled(self, tell: Callable[[str], object] = lambda text: None,
                            after_s: float = TELL_AFTER_S) -> str:
        """
        Wait for what was asked for; Ctrl-C ends the waiting.

        Parameters
        ----------
        tell : callable
            Gets a sentence, once, if it takes long because it is not read from the cache.
        after_s : float
            How long [s].

        Returns
        -------
        str
            Why it cannot be compiled, '' if it is done.

        """
        tell_at_s = time.monotonic() + after_s
        while self._asked and self.usable:
            with self._lock:
                self._read(0.1)
            if self._asked and self._compiles and time.monotonic() > tell_at_s:
                tell_at_s = math.inf
                tell(COMPILES)
        return self._not_compiled

    def start(self, words: list[str], environment: Mapping[str, str],
              log_file: str | os.PathLike[str]) -> 'ForkedNode | None':
        """
        Fork a node.

        Parameters
        ----------
        words : list of str
            Name of the node and its arguments.
        environment : mapping of str
            All its variables.
        log_file : path
            What it prints goes there.

        Returns
        -------
        ForkedNode or None
            None: the template has ended or does not answer, and the node must start by itself.

        """
        request = {'words': words, 'environment': dict(environment), 'folder': os.getcwd(),
                   'log_file': os.fspath(log_file)}
        with self._lock:
            try:
                self._channel.sendall(json.dumps(request).encode() + b'\n')
            except OSError:
                return None
            deadline_s = time.monotonic() + PREPARE_TIMEOUT_S
            while self.usable and time.monotonic() < deadline_s:
                for answer in self._read(0.1):
                    if 'pid' in answer:
                        return ForkedNode(self, answer['pid'])
                    if 'error' in answer:
                        return None
        self.close()        # a node that it forks later would be nobody's
        return None

    def exit_code(self, pid: int, wait_s: float = 0.0) -> int | None:
        """Return the exit code of a node, negative for a signal, None while it runs."""
        with self._lock:
            if pid not in self._ended and not self._spoiled:
                self._read(wait_s)
            return self._ended.get(pid)

    def _read(self, wait_s: float) -> list[dict[str, Any]]:
        """Take note of nodes that ended; return the answers to requests."""
        if not select.select([self._channel], [], [], wait_s)[0]:
            return []
        spoiled, self._spoiled = self._spoiled, True     # if a signal comes half way
        try:
            data = self._channel.recv(READ_BYTES)
        except ConnectionResetError:
            data = b''          # it ended with a request unread
        *lines, self._unread = (self._unread + data).split(b'\n')
        answers = [json.loads(line) for line in lines]
        self._ended.update(
            (answer['ended'], answer['exit_code']) for answer in answers if 'ended' in answer)
        self._ready = self._ready or any('ready' in answer for answer in answers)
        for answer in answers:
            self._compiles = self._compiles or 'compiles' in answer
            if 'compiled' in answer:
                self._asked, self._not_compiled = False, answer['compiled']
        self._spoiled = spoiled or not data
        return answers

    def close(self) -> None:
        """End the template, and nodes that still run with it."""
        if self._owner != os.getpid():
            return
        self._spoiled = True
        self._channel.close()
        self._process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(END_TIMEOUT_S)
            return
        self._process.kill()
        self._process.wait()


class ForkedNode:
    """
    One node, with what is needed of ``subprocess.Popen``.

    Parameters
    ----------
    template : NodeTemplate
        Its parent.
    pid : int
        Its process id.

    """

    def __init__(self, template: NodeTemplate, pid: int) -> None:
        self.pid = pid
        self._template = template
        self._code: int | None = None
        # Stays that of this process when the number is given to another one.
        self._handle: int | None = None
        with contextlib.suppress(OSError, AttributeError):
            self._handle = os.pidfd_open(pid)

    def poll(self) -> int | None:
        """Return the exit code, None while the process runs."""
        return self._look(0.0)

    def wait(self, timeout: float) -> int:
        """Wait for the end; ``subprocess.TimeoutExpired`` if it does not come in time."""
        deadline_s = time.monotonic() + timeout
        while (code := self._look(min(max(deadline_s - time.monotonic(), 0.0), 0.1))) is None:
            if time.monotonic() >= deadline_s:
                raise subprocess.TimeoutExpired(f'process {self.pid}', timeout)
        return code

    def send_signal(self, number: int) -> None:
        """Send a signal; to a process that has ended, nothing."""
        with contextlib.suppress(ProcessLookupError):
            if self._handle is not None:
                signal.pidfd_send_signal(self._handle, number)
            else:
                os.kill(self.pid, number)

    def _look(self, wait_s: float) -> int | None:
        if self._code is None:
            self._code = self._template.exit_code(self.pid, wait_s)
            if self._code is None and not self._template.usable and self._gone(wait_s):
                self._code = -signal.SIGTERM       # what it got when its parent ended
            if self._code is not None and self._handle is not None:
                os.close(self._handle)
                self._handle = None
        return self._code

    def _gone(self, wait_s: float) -> bool:
        """Tell whether the process has ended, whose parent is gone."""
        if self._handle is None:
            return not os.path.exists(f'/proc/{self.pid}')
        return bool(select.select([self._handle], [], [], wait_s)[0])


# One for each environment.
_templates: dict[tuple[tuple[str, str], ...], NodeTemplate] = {}


def template_for(names: Iterable[str], environment: Mapping[str, str]) -> NodeTemplate | None:
    """
    Return the template of an environment, started now if there is none; None where none can be.

    Parameters
    ----------
    names : iterable of str
        Nodes a new one imports beforehand.
    environment : mapping of str
        Variables of the nodes, from ``processes.node_environment``.

    """
    if sys.platform != 'linux':
        return None
    common = {name: value for name, value in environment.items() if name not in OF_A_SESSION}
    key = tuple(sorted(common.items()))
    template = _templates.get(key)
    if template is None or not template.usable:
        template = _templates[key] = NodeTemplate(names, common)
    return template


def prepare_template() -> None:
    """Start the template of this process's environment: it imports while the caller loads."""
    template_for(OF_A_RUN, node_environment(0, ''))

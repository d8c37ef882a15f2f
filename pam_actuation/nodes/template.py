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
A process that has imported what nodes import, and becomes a node as often as it is asked.

Five nodes that start each by itself import the same compiler and the same ROS five times. Here
this is done once; every node is a fork of it, with memory of its own from there on. Nothing of
ROS is begun before a fork, and no thread runs.

Started by ``rigging.node_template`` with the number of a socket and names of nodes. It reads one
request a line, as JSON, and answers with the process id, later with how the process ended. It
also compiles ahead what the nodes of a run need. When its parent ends, it ends as well, and the
nodes with it, as those they had been started by.
"""

import atexit
from collections.abc import Sequence
import contextlib
import gc
import importlib
import inspect
import json
import os
import select
import signal
import socket
import sys
from typing import Any

from pam_actuation.nodes import executables
from pam_actuation.rigging.compile_ahead import compile_ahead
from pam_actuation.rigging.processes import begin_session, name_process
from pam_sim.compile_notice import told_of_compilation

# What nodes import only once they know their parameters.
LATER = ('pam_actuation.bags.recorder', 'pam_actuation.control.config',
         'pam_actuation.control.loop', 'pam_actuation.drivers.for_rig',
         'pam_actuation.experiments', 'pam_sim.joint.model_file', 'pam_sim.plant',
         'pam_sim.rollout.packing', 'rosidl_generator_py', 'scipy.linalg')
# Packages of the messages and services of every node.
MESSAGES = ('builtin_interfaces', 'diagnostic_msgs', 'geometry_msgs', 'lifecycle_msgs',
            'rcl_interfaces', 'sensor_msgs', 'service_msgs', 'std_msgs', 'std_srvs',
            'trajectory_msgs', 'type_description_interfaces')
TYPE_SUPPORT = '_s__rosidl_typesupport_c'        # compiled, of a package of messages
READ_BYTES = 1 << 16


class Children:
    """
    The nodes that were forked, and the socket to the process that asked for them.

    Parameters
    ----------
    channel : socket.socket
        Requests come in, answers go out, one a line.

    """

    def __init__(self, channel: socket.socket) -> None:
        self._channel = channel
        self._unread = b''
        self._read_end, self._write_end = socket.socketpair()
        for end in (self._read_end, self._write_end):
            end.setblocking(False)
        signal.signal(signal.SIGCHLD, lambda number, frame: None)
        signal.set_wakeup_fd(self._write_end.fileno(), warn_on_full_buffer=False)

    def serve(self) -> list[str] | None:
        """
        Fork until the socket is closed.

        Returns
        -------
        list of str or None
            In a fork, the name of its node and its arguments; None at the end.

        """
        self._tell({'ready': os.getpid()})
        while True:
            ready, _, _ = select.select([self._channel, self._read_end], [], [])
            if self._read_end in ready:
                self._read_end.recv(READ_BYTES)
                self._tell_ended()
            if self._channel in ready:
                data = self._channel.recv(READ_BYTES)
                if not data:
                    return None
                *lines, self._unread = (self._unread + data).split(b'\n')
                for line in lines:
                    words = self._answer(json.loads(line))
                    if words is not None:
                        return words

    def _answer(self, request: dict[str, Any]) -> list[str] | None:
        """Do what is asked for; return as ``_fork``."""
        if 'compile' not in request:
            return self._fork(request)
        try:
            with told_of_compilation(lambda: self._tell({'compiles': True})):
                compile_ahead(*request['compile'])
        except Exception as error:      # the nodes will say so, each of its part
            self._tell({'compiled': str(error)})
        else:
            self._tell({'compiled': ''})
        gc.freeze()
        return None

    def _fork(self, request: dict[str, Any]) -> list[str] | None:
        """Return the words of the node in the fork, None in this process."""
        own = os.getpid()
        begun, begins = os.pipe()
        try:
            pid = os.fork()
        except OSError as error:
            os.close(begun)
            os.close(begins)
            self._tell({'error': str(error)})
            return None
        if pid:
            os.close(begins)
            os.read(begun, 1)       # until it has its name, or has ended
            os.close(begun)
            self._tell({'pid': pid})
            return None
        os.close(begun)
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        for end in (self._channel, self._read_end, self._write_end):
            end.close()
        os.setsid()
        gc.enable()
        begin_session(own)
        _become(request)
        os.close(begins)
        words: list[str] = request['words']
        return words

    def _tell_ended(self) -> None:
        """Tell of every node that ended since."""
        while True:
            try:
                pid, status = os.waitpid(-1, os.WNOHANG)
            except ChildProcessError:
                return
            if not pid:
                return
            self._tell({'ended': pid, 'exit_code': os.waitstatus_to_exitcode(status)})

    def _tell(self, answer: dict[str, Any]) -> None:
        """Send one line; a parent that is gone hears nothing more."""
        try:
            self._channel.sendall(json.dumps(answer).encode() + b'\n')
        except OSError:
            pass


def _become(request: dict[str, Any]) -> None:
    """Take over environment, folder, output and name of a node."""
    os.environ.clear()
    os.environ.update(request['environment'])
    os.chdir(request['folder'])
    sys.stdout.flush()
    sys.stderr.flush()
    log = os.open(request['log_file'], os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
    os.dup2(log, 1)
    os.dup2(log, 2)
    os.close(log)
    name_process(*request['words'])


def prepare(names: Sequence[str]) -> None:
    """
    Import what these nodes need, and let the compiler get ready; what is missing is not.

    Nothing of it is garbage: a collection would only take time, and in a node copy what is shared.
    """
    gc.disable()
    for module in (*LATER, *(f'pam_actuation.nodes.{name}' for name in names),
                   *(f'{package}.msg' for package in MESSAGES),
                   *(f'{package}.{package}{TYPE_SUPPORT}' for package in MESSAGES)):
        with contextlib.suppress(ImportError):      # the node says so itself
            importlib.import_module(module)
    from pam_sim import machine_code
    machine_code.ready()
    # The first line that a node logs would look up the files of all modules.
    inspect.getframeinfo(sys._getframe())
    gc.freeze()


def become_nodes() -> int:
    """Serve; return the exit code, in a fork that of its node."""
    number, *names = ' '.join(sys.argv[1:]).split()
    channel = socket.socket(fileno=int(number))
    prepare(names)
    words = Children(channel).serve()
    if words is None:
        return 0
    name, *arguments = words
    module = sys.modules.get(f'pam_actuation.nodes.{name}')
    sys.argv[:] = [getattr(module, '__file__', None) or name, *arguments]
    code = executables.start(name)
    # The node has left the graph. What is left to take down is memory shared with others.
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == '__main__':
    sys.exit(become_nodes())

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
The one main function of all nodes: start, spin, and leave safely on every way out.

rclpy's own signal handlers end the context first, after which nothing can be sent.
Here signals only ask the loop to end; the safe signal and the last diagnostics go
out before the context closes. Exit codes: 0 done, 1 the node failed, 2 bad input.
"""

import atexit
from collections.abc import Sequence
import os
import re
import signal
import socket
import sys
import threading
import traceback
from typing import Any

from pam_actuation import interrupts
from pam_actuation.interrupts import leave_within
from pam_actuation.nodes import arguments
from pam_actuation.nodes.diagnostics import WARN
from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.node_log import with_own_terminal
from pam_actuation.rigging.processes import end_with_parent, LAUNCHED_BY
from pam_actuation.ros_log import name_log_folder
from pam_actuation.transport import prepare_middleware
from pam_sim.errors import InputError
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

SIGNALS: dict[int, str] = {number: number.name for number in interrupts.ENDING}
SAFE_STOP_S = 1.0           # for a device that may hang as the main thread does
SERVICE_WAIT_S = 0.5        # longest sleep of the thread that answers services
SERVICE_END_S = 3.0         # for a service that is still being answered at the end
LONGEST_START_S = 60.0      # compiling at the first start cannot be interrupted


class _Stopper(threading.Thread):
    """
    Learn of a signal in a thread of its own and ask the main thread to end.

    Python runs a handler only between two steps of the main thread, which may hang inside the
    middleware. The wake-up file informs this thread at once, whichever thread the system
    interrupted. If the main thread does not end its work within the node's ``STUCK_AFTER_S``, this
    thread makes the output safe itself and ends the process. It also ends the process of a device
    that does not answer.
    """

    def __init__(self) -> None:
        super().__init__(daemon=True, name='signals')
        self._read_end, write_end = socket.socketpair()
        write_end.setblocking(False)
        self._write_end = write_end
        for number in SIGNALS:
            signal.signal(number, _noted)
        signal.set_wakeup_fd(write_end.fileno(), warn_on_full_buffer=False)
        self.node: Any = None
        self.reason = ''
        self.safe = threading.Event()

    def run(self) -> None:
        """Handle the first signal."""
        number = self._read_end.recv(1)[0]
        while number not in SIGNALS:
            number = self._read_end.recv(1)[0]
        self.reason = f'stopped by {SIGNALS[number]}'
        self.node.stopping = True
        limit_s = self.node.STUCK_AFTER_S if self.node.loops else LONGEST_START_S
        if not self.safe.wait(limit_s):
            stopping = threading.Thread(
                target=self.node.safe_stop, args=[f'{self.reason}, the loop did not answer'],
                daemon=True, name='safe stop')
            stopping.start()
            stopping.join(SAFE_STOP_S)
            if stopping.is_alive():
                os.write(2, f'{self.node.NAME}: {self.reason}, but the device does not answer: '
                         'NOT MADE SAFE\n'.encode())
            os._exit(1)


def _noted(number: int, frame: object) -> None:
    """Stand in for the default action of a signal; the thread above does the work."""


def run(node_class: type[ManagedNode], args: Sequence[str] | None = None) -> int:
    """
    Run one node as a process.

    Parameters
    ----------
    node_class : type
        Class made from ``ManagedNode``, built without arguments.
    args : list of str, optional
        Command line; default ``sys.argv``.

    Returns
    -------
    int
        Exit code.

    """
    answered = arguments.answer(node_class.NAME, sys.argv[1:]) if args is None else None
    if answered is not None:
        return answered
    stopper, code = _Stopper(), interrupts.EXIT_FAILED
    try:
        code = _run(node_class, args, stopper)
        return code
    finally:
        atexit.register(leave_within, code)     # what comes after may hang as well
        # What comes now, as by an impatient user, must not change the exit code any more.
        interrupts.ignore(SIGNALS)


def _run(node_class: type[ManagedNode], args: Sequence[str] | None, stopper: '_Stopper') -> int:
    try:
        if args is None:
            args = [sys.argv[0], *arguments.in_order(sys.argv[1:])]
        args, node_class.log_on_console = with_own_terminal(args)
        prepare_middleware()
        name_log_folder()
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
        node = node_class()
        if '--params-file' in args:
            from pam_actuation.nodes.hardware_check import check_given_files
            check_given_files(args, node.NAME, node.get_fully_qualified_name())
    except InputError as error:
        return _refuse(node_class, error)
    except Exception as error:
        if type(error).__name__ in ('UnknownROSArgsError', 'RCLInvalidROSArgsError'):
            return _refuse(node_class, f'these ROS arguments are not known: {error}')
        unread = re.search("Couldn't parse ([^:]*): '(.*?)'", str(error))
        if unread:
            return _refuse(node_class, f'ROS cannot read the {unread[1]} {unread[2]}')
        cut_off = re.search("Couldn't parse trailing (-\\S+) flag", str(error))
        if cut_off:
            return _refuse(node_class, f'nothing follows {cut_off[1]}, which needs a value')
        raise
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    ended = threading.Event()
    serving = threading.Thread(
        target=_serve, args=(node, executor, ended), daemon=True, name='services')
    stopper.node = node
    stopper.start()
    if node.value('end_with_parent'):
        launch_pid = os.environ.get(LAUNCHED_BY, '')
        end_with_parent(os.getppid(), int(launch_pid) if launch_pid.isdigit() else 0)
    serving.start()
    node.loops.served = True
    try:
        if node.value('autostart'):
            _bring_up(node)
        while not node.stopping and node.exit_code is None:
            node.loops.run_once()
    finally:
        why = stopper.reason or 'ended'
        node.finish(why)
        stopper.safe.set()
        code = node.exit_code or node.result_code
        limit = leave_within(code)
        ended.set()
        executor.wake()
        serving.join(timeout=SERVICE_END_S)
        signal.set_wakeup_fd(-1)
        node.console.close()
        if serving.is_alive():
            # Everything is safe and sent; what is left is memory the system takes back. To
            # destroy the services of a node while another thread waits on them would crash.
            sys.stderr.flush()
            os._exit(code)
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown()
        limit.cancel()
    return code


def _serve(node: ManagedNode, executor: SingleThreadedExecutor, ended: threading.Event) -> None:
    """
    Answer services and parameter requests until ``ended`` is set.

    Not ``executor.spin``: its shutdown takes away what wakes it, and a thread that was just
    about to wait would then still be waiting when the node is destroyed.
    """
    while not ended.is_set():
        try:
            executor.spin_once(timeout_sec=SERVICE_WAIT_S)
        except ExternalShutdownException:
            return
        except Exception:
            # One request that fails must not take the others away, as the emergency stop.
            node.get_logger().error(f'a service failed:\n{traceback.format_exc()}')
            ended.wait(SERVICE_WAIT_S)


def _bring_up(node: ManagedNode) -> None:
    """Configure and activate; a mistake of the user ends the process with exit code 2."""
    steps: tuple[Any, ...] = node.trigger_configure, node.trigger_activate
    for trigger in steps:
        trigger()
        if node.stopping:
            return
        if node.input_error is not None:
            node.exit_code = 2
            return
        if node.diagnostics.level > WARN or node.exit_code is not None:
            node.exit_code = node.exit_code or 1
            return


def _refuse(node_class: type[ManagedNode], sentence: object) -> int:
    """Print one sentence on what was wrong with the command line; return exit code 2."""
    print(f'{node_class.NAME}: {sentence}', file=sys.stderr)
    rclpy.try_shutdown()
    return 2

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

"""The session's own ROS node: lifecycle requests out, diagnostics in."""

from collections.abc import Callable, Iterable, Sequence
import os
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from pam_actuation.topics.codec import Reader
from pam_actuation.topics.quality import USUAL
from pam_actuation.transport import prepare_middleware, RANGE
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

NAME = 'rig_session'         # of the node, and of its enclave
TRANSITIONS = {
    'configure': Transition.TRANSITION_CONFIGURE,
    'activate': Transition.TRANSITION_ACTIVATE,
    'deactivate': Transition.TRANSITION_DEACTIVATE,
}


def local_context(domain_id: int, arguments: Sequence[str] = ()) -> rclpy.Context:
    """Return an open rclpy context in a ROS domain, looking at this machine only."""
    context = rclpy.Context()
    before = os.environ.get(RANGE)
    os.environ[RANGE] = 'LOCALHOST'
    try:
        _open(context, domain_id, arguments)
    finally:
        if before is None:
            del os.environ[RANGE]
        else:
            os.environ[RANGE] = before
    return context


def context_by_environment(domain_id: int, arguments: Sequence[str] = ()) -> rclpy.Context:
    """Return an open context that looks as far as the nodes of this environment do."""
    context = rclpy.Context()
    _open(context, domain_id, arguments)
    return context


def _open(context: rclpy.Context, domain_id: int, arguments: Sequence[str]) -> None:
    prepare_middleware()
    rclpy.init(context=context, domain_id=domain_id, args=list(arguments),
               signal_handler_options=SignalHandlerOptions.NO)


class RigClient:
    """
    Steer managed nodes and listen to their health.

    Parameters
    ----------
    domain_id : int
        ROS domain; only this machine is looked at.
    name : str
        Of the node, and of its enclave.

    Attributes
    ----------
    statuses : dict
        Full node name to (level, message, values) of its last diagnostic status.
    changes : list of (float, str, int, str)
        Steady time [s], full node name, level, message of every change.

    """

    def __init__(self, domain_id: int, name: str = NAME) -> None:
        context = self.open_context(domain_id, ['--ros-args', '--enclave', f'/{name}'])
        self.node = Node(name, context=context, use_global_arguments=False, enable_rosout=False,
                         start_parameter_services=False)
        self.executor = SingleThreadedExecutor(context=self.node.context)
        self.executor.add_node(self.node)
        self._clients: dict[str, Any] = {}
        self.statuses: dict[str, tuple[int, str, dict[str, str]]] = {}
        self.changes: list[tuple[float, str, int, str]] = []
        self._read = Reader('diagnostics')
        # A bare depth is a reliable, volatile subscription to rclpy, as of all topics of the rig.
        self.node.create_subscription(
            DiagnosticArray, '/diagnostics', self._on_diagnostics, USUAL.consumer.depth, raw=True)

    def open_context(self, domain_id: int, arguments: Sequence[str]) -> rclpy.Context:
        """Return an open context for the node."""
        return local_context(domain_id, arguments)

    def _on_diagnostics(self, raw: bytes) -> None:
        for status in self._read(raw) or ():
            known = self.statuses.get(status.name)
            if known is None or known[:2] != (status.level, status.message):
                self.changes.append(
                    (time.monotonic(), status.name, status.level, status.message))
            self.statuses[status.name] = (status.level, status.message, dict(status.values))

    def spin(self, duration_s: float) -> None:
        """Handle messages for a while."""
        deadline = time.monotonic() + duration_s
        while True:
            left_s = deadline - time.monotonic()
            if left_s <= 0.0:
                return
            self.executor.spin_once(timeout_sec=left_s)

    def change_states(self, full_names: Iterable[str], transition: str, timeout_s: float,
                      alive: Callable[[str], bool] = lambda name: True) -> list[str]:
        """
        Ask nodes for a transition at the same time and wait for the answers.

        Parameters
        ----------
        full_names : iterable of str
            Full names of the nodes.
        transition : str
            A key of ``TRANSITIONS``.
        timeout_s : float
            Longest wait [s].
        alive : callable
            Tells of a full name whether it is worth waiting for.

        Returns
        -------
        list of str
            Full names of the nodes that did not make it.

        """
        deadline = time.monotonic() + timeout_s
        waiting: dict[str, Any] = dict.fromkeys(full_names)      # future of each request
        refused: list[str] = []
        while waiting and time.monotonic() < deadline:
            for name, future in list(waiting.items()):
                if future is None:
                    waiting[name] = self._request(name, transition)
                elif future.done():
                    del waiting[name]
                    if not future.result().success:
                        refused.append(name)
                    continue
                if not alive(name):
                    del waiting[name]
                    refused.append(name)
            if waiting:
                self.executor.spin_once(timeout_sec=0.02)
        return refused + list(waiting)

    def _request(self, full_name: str, transition: str) -> Any:
        """Return the future of a request, None while the node offers no service yet."""
        client = self._clients.get(full_name)
        if client is None:
            client = self._clients[full_name] = self.node.create_client(
                ChangeState, f'{full_name}/change_state')
        if not client.service_is_ready():
            return None
        request = ChangeState.Request()
        request.transition.id = TRANSITIONS[transition]
        return client.call_async(request)

    def published(self) -> dict[str, int]:
        """Return full topic name to messages published, by the last status of every node."""
        counts: dict[str, int] = {}
        for _, _, values in self.statuses.values():
            for key, value in values.items():
                if key.startswith('published.'):
                    topic = key.removeprefix('published.')
                    counts[topic] = counts.get(topic, 0) + int(value)
        return counts

    def close(self) -> None:
        """Leave the graph."""
        self.executor.shutdown(timeout_sec=1.0)
        self.node.destroy_node()
        rclpy.try_shutdown(context=self.node.context)

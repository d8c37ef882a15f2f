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

from collections import deque
from collections.abc import Callable, Collection, Iterable, Sequence
from functools import partial
import os
import re
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from pam_actuation.interrupts import closing
from pam_actuation.messages import is_fault, LEVEL_ERROR, LEVEL_STALE
from pam_actuation.ros_log import name_log_folder
from pam_actuation.topics.codec import Reader
from pam_actuation.topics.quality import USUAL
from pam_actuation.topics.table import DIAGNOSTICS
from pam_actuation.transport import prepare_middleware, RANGE
from pam_sim.errors import InputError
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
SERVICES = {'change_state': ChangeState, 'get_state': GetState}
LEADS_TO = {'configure': State.PRIMARY_STATE_INACTIVE, 'activate': State.PRIMARY_STATE_ACTIVE,
            'deactivate': State.PRIMARY_STATE_INACTIVE}
# After that the node is asked for its state. An answer is sent once, and is lost where the node
# does not yet know of its receiver, as on a busy machine.
LATE_ANSWER_S = 3.0
# Of each node, and of all; a status may flap for days.
MOST_CHANGES, MOST_FAULTS = 100, 1000

Change = tuple[float, str, int, str]


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
    name_log_folder()
    try:
        rclpy.init(context=context, domain_id=domain_id, args=list(arguments),
                   signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        refused = re.search("log directory '(.*?)'", str(error))
        if refused is None:
            raise
        raise InputError('ROS cannot write its log files there; name another folder in '
                         'ROS_LOG_DIR or ROS_HOME', refused[1]) from None


class _Asked:
    """
    A node that is asked for a transition, and for its state where the answer is late.

    Parameters
    ----------
    client : callable
        Returns the client of a service of the node by its name.
    transition : str
        A key of ``TRANSITIONS``.

    """

    def __init__(self, client: Callable[[str], Any], transition: str) -> None:
        self._client, self._transition = client, transition
        self._changes: list[Any] = []       # futures of the requests
        self._state: Any = None             # future of the state
        self._late_at_s = 0.0

    def answer(self) -> bool | None:
        """Go on; return whether the node made it, None while that is not known."""
        if any(change.done() and change.result().success for change in self._changes):
            return True
        refused = bool(self._changes) and self._changes[-1].done()
        if refused and len(self._changes) == 1:
            return False
        if not self._changes:
            self._request()
        elif self._state is not None and self._state.done():
            if self._state.result().current_state.id == LEADS_TO[self._transition]:
                return True
            if refused:
                return False
            # Request or answer is lost, or it is not its turn yet; a second one is then refused.
            self._state = None
            self._request()
        elif (refused and self._state is None) or time.monotonic() > self._late_at_s:
            self._state = self._called('get_state', GetState.Request())
        return None

    def _request(self) -> None:
        change = self._called('change_state', ChangeState.Request(
            transition=Transition(id=TRANSITIONS[self._transition])))
        self._changes += [] if change is None else [change]

    def _called(self, service: str, request: Any) -> Any:
        """Return the future of a request, None while the node offers no service yet."""
        client = self._client(service)
        if not client.service_is_ready():
            return None
        self._late_at_s = time.monotonic() + LATE_ANSWER_S
        return client.call_async(request)


class RigClient:
    """
    Steer managed nodes and listen to their health.

    Parameters
    ----------
    domain_id : int
        ROS domain; only this machine is looked at.
    name : str
        Of the node, and of its enclave.
    namespaces : collection of str
        Only nodes in these are listened to; none given: to all.

    Attributes
    ----------
    statuses : dict
        Full node name to (level, message, values) of its last diagnostic status.
    heard_s : dict
        Full node name to the steady time of its last status [s].
    faults : dict
        ``NODE: MESSAGE`` of the first ``MOST_FAULTS`` faults to the steady time when it was
        first heard [s].

    """

    def __init__(self, domain_id: int, name: str = NAME,
                 namespaces: Collection[str] = ()) -> None:
        context = self.open_context(domain_id, ['--ros-args', '--enclave', f'/{name}'])
        self.node = Node(name, context=context, use_global_arguments=False, enable_rosout=False,
                         start_parameter_services=False)
        self.executor = SingleThreadedExecutor(context=self.node.context)
        self.executor.add_node(self.node)
        self._clients: dict[str, Any] = {}
        self.statuses: dict[str, tuple[int, str, dict[str, str]]] = {}
        self.heard_s: dict[str, float] = {}
        self.faults: dict[str, float] = {}
        self._changes: dict[str, deque[Change]] = {}
        self._namespaces = namespaces
        self._read = Reader('diagnostics')
        # A bare depth is a reliable, volatile subscription to rclpy, as of all topics of the rig.
        self.node.create_subscription(
            DiagnosticArray, DIAGNOSTICS, self._on_diagnostics, USUAL.consumer.depth, raw=True)

    def open_context(self, domain_id: int, arguments: Sequence[str]) -> rclpy.Context:
        """Return an open context for the node."""
        return local_context(domain_id, arguments)

    def concerns(self, full_name: str) -> bool:
        """Tell whether a node is listened to."""
        return not self._namespaces or full_name.rpartition('/')[0] in self._namespaces

    def nodes(self) -> list[str]:
        """Return the full names of all nodes known by now, without this one, sorted."""
        own = self.node.get_fully_qualified_name()
        names = {f'{namespace.rstrip("/")}/{name}'
                 for name, namespace in self.node.get_node_names_and_namespaces()}
        return sorted(name for name in names - {own} if self.concerns(name))

    def _on_diagnostics(self, raw: bytes) -> None:
        for status in self._read(raw) or ():
            name, message = status.name, status.message
            # Other programs send any byte, and what is no level of ROS is no good news.
            level = status.level if status.level <= LEVEL_STALE else LEVEL_ERROR
            if not self.concerns(name):
                continue
            now_s, known = time.monotonic(), self.statuses.get(name)
            self.heard_s[name] = now_s
            if known is None or known[:2] != (level, message):
                self._changes.setdefault(name, deque(maxlen=MOST_CHANGES)).append(
                    (now_s, name, level, message))
                if is_fault(level, message) and len(self.faults) < MOST_FAULTS:
                    self.faults.setdefault(f'{name}: {message}', now_s)
            self.statuses[name] = (level, message, dict(status.values))

    def changes_since(self, time_s: float) -> list[Change]:
        """
        Return what changed in the statuses after a steady time [s], in order.

        Steady time [s], full node name, level and message. The newest ``MOST_CHANGES`` of each
        node are known.
        """
        return sorted(one for kept in self._changes.values() for one in kept if one[0] > time_s)

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
        waiting = {name: _Asked(partial(self._client, name), transition) for name in full_names}
        refused: list[str] = []
        while waiting and time.monotonic() < deadline:
            for name, asked in list(waiting.items()):
                done = asked.answer()
                if done is None and not alive(name):
                    done = False
                if done is not None:
                    del waiting[name]
                if done is False:
                    refused.append(name)
            if waiting:
                self.executor.spin_once(timeout_sec=0.02)
        return refused + list(waiting)

    def _client(self, full_name: str, service: str) -> Any:
        """Return the client of a service of a node, always the same."""
        key = f'{full_name}/{service}'
        if key not in self._clients:
            self._clients[key] = self.node.create_client(SERVICES[service], key)
        return self._clients[key]

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
        """Leave the graph; ``pam`` does so once its result is told."""
        closing.close(self._leave)

    def _leave(self) -> None:
        self.executor.shutdown(timeout_sec=1.0)
        self.node.destroy_node()
        rclpy.try_shutdown(context=self.node.context)

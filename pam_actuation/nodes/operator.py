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
A node for whoever operates running rigs: it finds their nodes and calls their services.

It is no executable. The verbs ``pam status``, ``pam estop``, ``pam reset`` and ``pam param``
join the graph with it for a moment. An emergency stop waits for nothing: each driver is called as
soon as its service is there, while the search for others goes on.
"""

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
import time
from typing import Any

from pam_actuation.rigging.client import context_by_environment, local_context, RigClient
import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger

NAME = 'operator'           # of the node, and of its enclave in the access policies
# Nothing new for so long: all there is was found. Participants announce themselves every 3 s;
# on this machine, nodes of this package do every 0.5 s.
QUIET_S = 3.5
ANSWER_S = 5.0              # how long a node may take to answer, also on a busy machine
STEP_S = 0.01
TRIGGER = 'std_srvs/srv/Trigger'


@dataclass
class Answer:
    """What a node answered to a call; ``done`` is None as long as it has not."""

    node: str
    domain_id: int
    done: bool | None = None
    message: str = ''


def is_below(full_name: str, namespace: str) -> bool:
    """Tell whether a full name lies in or below a namespace; of '' all full names do."""
    return full_name.startswith(f'{namespace}/')


def serving(node: Node, namespace: str, service: str, type_name: str = TRIGGER) -> list[str]:
    """
    Return the full names of the nodes known to offer a service, sorted.

    Parameters
    ----------
    node : rclpy.node.Node
        What it knows of the graph counts.
    namespace : str
        Only nodes in or below it; '' for all.
    service : str
        Name of the service below that of its node.
    type_name : str
        Type of the service.

    """
    ending = f'/{service}'
    return sorted(
        name.removesuffix(ending) for name, types in node.get_service_names_and_types()
        if name.endswith(ending) and type_name in types and is_below(name, namespace))


class Operator(RigClient):
    """
    Look for the nodes of rigs in one ROS domain.

    Parameters
    ----------
    domain_id : int
        ROS domain.
    namespace : str
        Only nodes in or below it count; '' for all.
    local : bool
        Look at this machine only; else as far as the nodes of this environment do.

    """

    def __init__(self, domain_id: int, namespace: str = '', local: bool = True) -> None:
        self.domain_id = domain_id
        self.namespace = namespace
        self._local = local
        super().__init__(domain_id, NAME)

    def open_context(self, domain_id: int, arguments: Sequence[str]) -> rclpy.Context:
        """Return an open context for the node."""
        opened = local_context if self._local else context_by_environment
        return opened(domain_id, arguments)

    def serving(self, service: str, type_name: str = TRIGGER) -> list[str]:
        """Return the full names of the nodes known to offer a service ``~/service``, sorted."""
        return serving(self.node, self.namespace, service, type_name)

    def concerns(self, full_name: str) -> bool:
        """Tell whether a name lies in or below the namespace."""
        return is_below(full_name, self.namespace)

    def call(self, node: str, service: str, service_type: Any, request: Any,
             timeout_s: float = ANSWER_S) -> Any:
        """Call ``~/service`` of a node; return its response, None if none came in time."""
        client = self.node.create_client(service_type, f'{node}/{service}')
        try:
            deadline = time.monotonic() + timeout_s
            while not client.service_is_ready():
                if time.monotonic() > deadline:
                    return None
                self.executor.spin_once(timeout_sec=STEP_S)
            future = client.call_async(request)
            while not future.done() and time.monotonic() < deadline:
                self.executor.spin_once(timeout_sec=STEP_S)
            return future.result() if future.done() else None
        finally:
            self.node.destroy_client(client)


def watch(operators: Iterable[Operator], found: Callable[[], Hashable], wait_s: float,
          quiet_s: float | None = None) -> None:
    """
    Listen until nothing new is found.

    Parameters
    ----------
    operators : iterable of Operator
        One for each ROS domain.
    found : callable
        Returns what was found by now; empty or false: nothing.
    wait_s : float
        How long to wait for something to be found [s].
    quiet_s : float, optional
        Return as soon as what was found stayed the same for so long [s]; default: ``QUIET_S``.

    """
    operators, quiet_s = list(operators), QUIET_S if quiet_s is None else quiet_s
    changed_s = begin_s = time.monotonic()
    last: Hashable = None
    while True:
        for operator in operators:
            operator.executor.spin_once(timeout_sec=STEP_S / len(operators))
        now_s, present = time.monotonic(), found()
        if present != last:
            last, changed_s = present, now_s
        limit_s = quiet_s if present else wait_s
        if now_s - (changed_s if present else begin_s) >= limit_s:
            return


def trigger_all(operators: Iterable[Operator], service: str, wait_s: float,
                tell: Callable[[Answer], object] = lambda answer: None,
                quiet_s: float | None = None) -> list[Answer]:
    """
    Call a service ``~/service`` (Trigger) of every node that offers it, each at once when found.

    Parameters
    ----------
    operators : iterable of Operator
        One for each ROS domain.
    service : str
        Name of the service below that of its node.
    wait_s : float
        How long to look for the first one [s].
    tell : callable
        Is given each answer when it comes.
    quiet_s : float, optional
        As of ``watch``.

    Returns
    -------
    list of Answer
        One for each node found. One that did not answer within ``ANSWER_S`` is not done.

    """
    operators = list(operators)
    calls: dict[tuple[int, str], _Call] = {}

    def found() -> Hashable:
        for operator in operators:
            for name in operator.serving(service):
                key = operator.domain_id, name
                if key not in calls:
                    calls[key] = _Call(operator, name, service)
        for one in calls.values():
            if one.proceed():
                tell(one.answer)
        return frozenset((key, one.over) for key, one in calls.items())

    watch(operators, found, wait_s, quiet_s)
    while not all(one.over for one in calls.values()):
        watch(operators, found, 0.0)
    return [one.answer for _, one in sorted(calls.items())]


class _Call:
    """One call of a Trigger service, from the discovery of its node to the answer."""

    def __init__(self, operator: Operator, node: str, service: str) -> None:
        self.answer = Answer(node, operator.domain_id)
        self._client = operator.node.create_client(Trigger, f'{node}/{service}')
        self._future: Any = None
        self._deadline_s = time.monotonic() + ANSWER_S
        self.over = False

    def proceed(self) -> bool:
        """Send the request once that is possible; return whether the call ended just now."""
        if self.over:
            return False
        if self._future is None and self._client.service_is_ready():
            self._future = self._client.call_async(Trigger.Request())
        if self._future is not None and self._future.done():
            response = self._future.result()
            self.answer.done, self.answer.message = response.success, response.message
            self.over = True
        elif time.monotonic() > self._deadline_s:
            self.answer.message = f'no answer within {ANSWER_S:g} s'
            self.over = True
        return self.over

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

"""Who sends what a node hears: writers by their GIDs, nodes by the graph."""

from collections.abc import Sequence
import time
from typing import Any, TYPE_CHECKING

from pam_actuation.drivers.senders import DriverSenders, is_safe, Senders, told, two_send
from pam_actuation.nodes.endpoints import full_name, PolledSubscription, Taken
from pam_actuation.nodes.writers import gid_of
from pam_actuation.topics.codec import Reader
from rclpy.node import Node

if TYPE_CHECKING:
    from pam_actuation.nodes.managed import ManagedNode

UNKNOWN = '_NODE_NAME_UNKNOWN_'         # as the graph has it before it hears of the node
ASK_EVERY_NS = 20_000_000
WATCHDOG = 'valve_watchdog'
ANSWER_PERIOD_S = 0.001     # as soon as a second sender of valve_signal is answered
IDLE_PERIOD_S = 0.05


class WriterNames:
    """
    The nodes behind writers, by the graph.

    Parameters
    ----------
    node : rclpy.node.Node
        That asks.

    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._names: dict[bytes, str] = {}
        self._asked_ns: dict[str, int] = {}

    def __call__(self, topic: str, writer: Any) -> str:
        """
        Return the full name of the node of a writer, '' while the graph does not tell.

        ``topic`` is the full name of the topic. A name is remembered: a node that has ended
        leaves the graph. For one that is not known the graph is asked every 20 ms at most.
        """
        if not self._names.get(writer):
            now_ns = time.monotonic_ns()
            if now_ns - self._asked_ns.get(topic, -ASK_EVERY_NS) >= ASK_EVERY_NS:
                self._asked_ns[topic] = now_ns
                self._names.update(self.on_graph(topic))
        return self._names.get(writer, '')

    def on_graph(self, topic: str) -> dict[bytes, str]:
        """Return GID to full node name of the publishers of a topic, '' where it has none yet."""
        return {bytes(end.endpoint_gid): '' if end.node_name == UNKNOWN else full_name(
            end.node_namespace, end.node_name)
            for end in self._node.get_publishers_info_by_topic(topic)}


class DriverEar:
    """
    Hears for a driver who else speaks on its topics.

    Parameters
    ----------
    node : ManagedNode
        The driver, with its publisher of ``valve_signal``.
    watchdog : str
        Full name of its watchdog.

    """

    def __init__(self, node: 'ManagedNode', watchdog: str) -> None:
        names = WriterNames(node)
        self._node = node
        self._seen: dict[str, frozenset[bytes]] = {}        # publishers at the last look
        self.vented = False         # whether another node sent the safe signal at the last look
        self._on_graph = names.on_graph
        self._signals = node.add_subscription('valve_signal', plain=False, writers=True)
        self._read = Reader('valve_signal')
        self._name_of = names
        own = gid_of(dict(node.topics_sent())['valve_signal'].rclpy_publisher)
        self._senders = DriverSenders(
            own, watchdog,
            lambda topic, writer: names(node.resolve_topic_name(topic), writer),
            node.get_fully_qualified_name())

    def begin(self) -> None:
        """Forget what was said on ``valve_signal`` before the driver was active."""
        self._signals.take()

    def took(self, topic: str, taken: Sequence[Taken]) -> None:
        """Note who sent messages that were taken on a followed topic."""
        now_ns = self._node.now_ns() if taken else 0
        for _, info in taken:
            self._senders.topics[topic].heard(info['writer'], now_ns)

    def listen(self) -> bool:
        """Take what was said on ``valve_signal``; return whether another one opens the valve."""
        opens, taken = False, self._signals.take()
        self.vented = False
        now_ns = self._node.now_ns()
        for raw, info in taken:
            writer, signals = info['writer'], self._senders.signals
            if writer == signals.own:
                continue
            message = self._read(raw)
            safe = message is not None and is_safe(message)
            name = self._name_of(self._signals.topic, writer)
            opens |= signals.heard(writer, name, safe, now_ns) and not safe
            self.vented |= safe and writer is not None
        return opens

    def fault(self, now_ns: int) -> tuple[str, str] | None:
        """Return (key in ``FAULTS``, sentence) of a second sender, None where there is none."""
        return self._senders.fault(now_ns)

    def commander(self, now_ns: int) -> str:
        """Return the name of the only writer of commands heard lately, '' for none or several."""
        return self._senders.commander(now_ns)

    def publishers(self, topic: str, full_topic: str) -> tuple[int, str]:
        """
        Return how many publishers of a topic send or may yet, and their names as words.

        One that was heard before another one has ended or is the cause of a fault; the graph
        keeps what was killed for up to 20 s. One that was not there at the last look may be about
        to take over from such a one: beside others it counts from the next look on.
        """
        heard, found = self._senders.topics[topic], self._on_graph(full_topic)
        there = {writer: name for writer, name in found.items() if not heard.replaced(writer)}
        before, self._seen[topic] = self._seen.get(topic, frozenset()), frozenset(found)
        stayed = [name for writer, name in there.items() if writer in before]
        names = stayed or list(there.values())
        return len(names), told(names)


class TopicEar:
    """
    Notices that two nodes send what is to come from one, such as a measurement or a reference.

    Parameters
    ----------
    node : ManagedNode
        That listens.
    subscription : PolledSubscription
        With ``writers``.

    """

    def __init__(self, node: 'ManagedNode', subscription: PolledSubscription) -> None:
        self._node, self._topic = node, subscription.topic
        self._senders = Senders()
        self._name_of = WriterNames(node)

    def took(self, taken: Sequence[Taken], now_ns: int) -> str:
        """Note who sent messages that were taken; return the sentence on two, '' for one."""
        for _, info in taken:
            self._senders.heard(info['writer'], now_ns)
        rivals = self._senders.rivals(now_ns)
        return rivals and two_send(
            self._topic, [self._name_of(self._topic, one) for one in rivals]) or ''

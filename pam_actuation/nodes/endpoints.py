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
Publishers that count what they sent and subscriptions that are read when needed.

A control loop needs the newest inputs once per tick, not a callback per message:
``PolledSubscription`` keeps the executor asleep between ticks and takes what has
arrived when the loop asks, each with the time it was received.
"""

from collections.abc import Callable, Iterable
from copy import copy
from functools import partial
import time
from typing import Any

from pam_actuation.nodes import qos
from pam_actuation.nodes.mismatches import Mismatches
from pam_actuation.nodes.writers import WriterTake
from rclpy.callback_groups import CallbackGroup
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import qos_policy_name_from_kind
from rclpy.qos import QoSProfile

WaitSet = rclpy_implementation.WaitSet
Taken = tuple[Any, dict[str, Any]]           # a message, and what is known of its way
TELL_AFTER_S, TELL_EVERY_S = 2.0, 5.0       # of a wait


class CountedPublisher:
    """
    Publish on one topic and count.

    Parameters
    ----------
    node : rclpy.node.Node
    message_type : type
    topic : str
        Relative or absolute name; ``topic`` holds the resolved full name.
    profile : rclpy.qos.QoSProfile, optional

    """

    def __init__(self, node: Node, message_type: Any, topic: str,
                 profile: QoSProfile | None = None) -> None:
        self._publisher = node.create_publisher(
            message_type, topic, copy(profile or qos.PUBLISHER),      # overrides change it
            event_callbacks=PublisherEventCallbacks(incompatible_qos=self._unreached),
            qos_overriding_options=qos.overridable())
        self._node = node
        self.topic = self._publisher.topic_name
        self.count = 0

    def _unreached(self, event: Any) -> None:
        """Tell of a subscription that this publisher does not reach; the one of rclpy waits."""
        policy = qos_policy_name_from_kind(event.last_policy_kind)
        self._node.get_logger().warning(
            f'a subscription of {self.topic} asks for another quality of service ({policy}), and '
            'receives nothing')

    def publish(self, message: Any) -> None:
        """Send a ROS message (or serialized bytes) and count it."""
        self._publisher.publish(message)
        self.count += 1

    @property
    def rclpy_publisher(self) -> Any:
        """Return the publisher of rclpy."""
        return self._publisher

    def matched_with(self, subscriber: str) -> bool:
        """
        Tell whether messages sent from now on reach the named node and all others known.

        Parameters
        ----------
        subscriber : str
            Full name of a node, such as ``/muscle/experiment_recorder``.

        """
        endpoints = self._node.get_subscriptions_info_by_topic(self.topic)
        names = [full_name(end.node_namespace, end.node_name) for end in endpoints]
        return subscriber in names and self._publisher.get_subscription_count() >= len(names)

    def wait_for_all_acked(self, timeout_s: float) -> bool:
        """Wait until every subscriber has confirmed what was sent; return whether all did."""
        return self._publisher.wait_for_all_acked(Duration(seconds=timeout_s))

    def destroy(self) -> None:
        """Remove the publisher from its node."""
        self._node.destroy_publisher(self._publisher)


class _NeverExecuted(CallbackGroup):
    """A group whose members the executor neither waits for nor runs."""

    def can_execute(self, entity: Any) -> bool:
        return False

    def beginning_execution(self, entity: Any) -> bool:
        return False

    def ending_execution(self, entity: Any) -> None:
        pass


class PolledSubscription:
    """
    Subscribe without a callback; ``take`` returns what has arrived since the last call.

    Parameters
    ----------
    node : rclpy.node.Node
    message_type : type
    topic : str
    profile : rclpy.qos.QoSProfile, optional
    raw : bool
        Take serialized bytes instead of message objects.
    read : callable, optional
        Turns what was taken into what ``take`` returns, such as a ``Reader``; what it
        turns into None is dropped.
    writers : bool
        Tell of each message who wrote it; only with ``raw``.

    """

    def __init__(self, node: Node, message_type: Any, topic: str,
                 profile: QoSProfile | None = None, raw: bool = False,
                 read: Callable[[bytes], Any] | None = None, writers: bool = False) -> None:
        self._node = node
        self._subscription = node.create_subscription(
            message_type, topic, _unused, copy(profile or qos.CONSUMER),
            callback_group=_NeverExecuted(), raw=raw,
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
            qos_overriding_options=qos.overridable())
        self.mismatches = Mismatches(node, self._subscription)
        self._take: Callable[[], Any] = partial(
            self._subscription.handle.take_message, message_type, raw)
        if writers:
            self._take = WriterTake(self._subscription.handle, message_type)
        self._read = read
        self._waiting: list[Taken] = []
        self._wait_set: Any = None
        self.topic = self._subscription.topic_name
        self.received = 0
        self.lost = 0               # by the sequence numbers of a single publisher
        self._sequence: int | None = None
        self.newest: Any = None     # the message taken or collected last

    def resume(self) -> None:
        """Count losses from the next message on: nobody took those of a pause."""
        self._sequence = None

    def take(self, limit: int = 2000) -> list[Taken]:
        """
        Return a list of (message, info) in order of arrival, at most ``limit``.

        ``info`` is rclpy's dictionary with ``source_timestamp``, ``received_timestamp`` [ns]
        and ``publication_sequence_number``, with ``writers`` also ``writer``, a GID.
        """
        self.collect(limit)
        taken, self._waiting = self._waiting, []
        return taken

    def take_before(self, time_ns: int) -> list[Taken]:
        """Return the plain messages stamped before a time, as ``take``; keep the others."""
        taken = self.take()
        self._waiting = [item for item in taken if item[0].stamp_ns >= time_ns]
        return [item for item in taken if item[0].stamp_ns < time_ns]

    def collect(self, limit: int = 2000) -> None:
        """Fetch what has arrived, up to ``limit`` waiting messages, and keep it for ``take``."""
        waiting = self._waiting
        handle = self._subscription.handle
        with handle:
            while len(waiting) < limit:
                item = self._take()
                if item is None:
                    return
                self._count_lost(item[1]['publication_sequence_number'])
                if self._read is not None:
                    item = self._read(item[0]), item[1]
                if item[0] is None:         # dropped, as the middleware does with message objects
                    continue
                waiting.append(item)
                self.newest = item[0]
                self.received += 1

    def _count_lost(self, sequence: int) -> None:
        last, self._sequence = self._sequence, sequence
        if last is not None and sequence > last + 1 and self.publishers == 1:
            self.lost += sequence - last - 1

    def wait(self, timeout_s: float) -> None:
        """Wait until a message arrives, at most ``timeout_s``; the processor is free meanwhile."""
        handle = self._subscription.handle
        with handle:
            if self._wait_set is None:
                self._wait_set = WaitSet(1, 0, 0, 0, 0, 0, self._node.context.handle)
            self._wait_set.clear_entities()
            self._wait_set.add_subscription(handle)
            self._wait_set.wait(round(timeout_s * 1e9))

    def remarks(self) -> list[str]:
        """Return a sentence on each way in which others do not send what is to be read here."""
        found, names = self.mismatches.sentences(), getattr(self._read, 'names', ())
        if len(names) > 1:
            found.append(f'{self.topic} has {len(names)} entries ({", ".join(names)}), and the '
                         'first one counts here; give each a topic of its own')
        return found

    @property
    def publishers(self) -> int:
        """Return the number of publishers this subscription is matched with."""
        return self._subscription.get_publisher_count()

    def destroy(self) -> None:
        """Remove the subscription from its node."""
        self._node.destroy_subscription(self._subscription)


def _unused(message: object) -> None:
    """Stand in for the callback a subscription must have."""


def full_name(namespace: str, name: str) -> str:
    """Return the full name of a node or topic in a namespace."""
    return f'{namespace.rstrip("/")}/{name}'


def wait_until_matched(publishers: Iterable[CountedPublisher], subscriber: str, timeout_s: float,
                       stopping: Callable[[], object],
                       tell: Callable[[str], object] = lambda text: None) -> list[str]:
    """
    Wait until every publisher reaches the named subscriber, so that no message is lost.

    Parameters
    ----------
    publishers : iterable of CountedPublisher
        Publishers of one node.
    subscriber : str
        Full name of a node.
    timeout_s : float
        Longest wait [s].
    stopping : callable
        Ends the wait when it returns True.
    tell : callable
        Is told for whom a long wait is, from time to time.

    Returns
    -------
    list of str
        Topics that were not matched in time; empty when all are.

    """
    begin = time.monotonic()
    deadline, tell_at = begin + timeout_s, begin + TELL_AFTER_S
    open_ones = list(publishers)
    while open_ones and not stopping() and time.monotonic() < deadline:
        open_ones = [one for one in open_ones if not one.matched_with(subscriber)]
        if open_ones and time.monotonic() > tell_at:
            tell_at += TELL_EVERY_S
            tell(f'waiting for {subscriber} to receive '
                 f'{", ".join(one.topic for one in open_ones)}, '
                 f'for {deadline - time.monotonic():.0f} s more at most')
        if open_ones:
            time.sleep(0.01)
    return [one.topic for one in open_ones]

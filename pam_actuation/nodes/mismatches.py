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
Publishers that a subscription cannot receive: another quality of service, or another type.

A best-effort publisher never matches a reliable subscription, and DDS says so to nobody who does
not ask. The middleware counts such publishers. That count is read with the diagnostics; only when
it has grown are the publishers looked up on the graph, by name.

A publisher of another type never matches either, and nobody counts it. The graph is asked for it
where a subscription has no publisher, as with a pressure that is sent as a Float64.
"""

import time
from typing import Any

from pam_actuation.nodes.ros_messages import type_of
from rclpy.event_handler import QoSSubscriptionEventType, UnsupportedEventTypeError
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import qos_check_compatible, QoSCompatibility, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

PATIENCE_S = 2.0        # the graph is behind the event, and names of nodes are even later
NAMELESS = '_NODE_NAME_UNKNOWN_'
INCOMPATIBLE = QoSSubscriptionEventType.RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS


class Mismatches:
    """
    The publishers of a topic that cannot reach one subscription.

    Parameters
    ----------
    node : rclpy.node.Node
        Node that subscribes.
    subscription : rclpy.subscription.Subscription
        Its subscription, whose quality of service can be set by parameters.

    """

    def __init__(self, node: Node, subscription: Any) -> None:
        self._node = node
        self._subscription = subscription
        self._topic = subscription.topic_name
        self._profile = subscription.qos_profile
        self._counted = 0
        self._since_s: float | None = None      # the last event, while it may concern anybody
        self._type = type_of(subscription.msg_type)
        self._other_type_s: float | None = None     # since when there is one of another type

    def sentences(self) -> list[str]:
        """Return one sentence for each such publisher there is now, with the line to write."""
        return [*self._of_other_quality(), *self._of_other_types()]

    def _of_other_types(self) -> list[str]:
        """Return a sentence for each publisher of another type, where none is received."""
        alone = not self._subscription.get_publisher_count()
        others = [end for end in self._node.get_publishers_info_by_topic(self._topic)
                  if end.topic_type != self._type] if (
                      alone and self._node.count_publishers(self._topic)) else []
        if not others:
            self._other_type_s = None
            return []
        now_s = time.monotonic()
        self._other_type_s = self._other_type_s or now_s
        if now_s - self._other_type_s < PATIENCE_S:
            others = [end for end in others if end.node_name != NAMELESS]
        sentences = [f'{_who(end)} sends {self._topic} as {end.topic_type}, which is not '
                     f'received here; send it as {self._type}' for end in others]
        return list(dict.fromkeys(sentences))

    def _of_other_quality(self) -> list[str]:
        """Return a sentence for each publisher of a quality that does not match."""
        now_s = time.monotonic()
        if self._has_new():
            self._since_s = now_s
        if self._since_s is None:
            return []
        found = [(end, reason)
                 for end in self._node.get_publishers_info_by_topic(self._topic)
                 for level, reason in [qos_check_compatible(end.qos_profile, self._profile)]
                 if level == QoSCompatibility.ERROR]
        if now_s - self._since_s < PATIENCE_S:
            found = [one for one in found if one[0].node_name != NAMELESS]
        elif not found:
            self._since_s = None
        return [self._sentence(*one) for one in found]

    def _has_new(self) -> bool:
        """
        Tell whether the middleware has counted another such publisher since the last call.

        The middleware counts in the subscription. An event lasts for one call only: as long as
        it exists, the participant of a destroyed node stays on the graph.
        """
        handle = self._subscription.handle
        try:
            with handle:
                event = rclpy_implementation.EventHandle(handle, INCOMPATIBLE)
                with event:
                    status = event.take_event()
        except UnsupportedEventTypeError:       # by another middleware: nothing is told
            return False
        before, self._counted = self._counted, status.total_count if status else self._counted
        return self._counted > before

    def _sentence(self, end: TopicEndpointInfo, reason: str) -> str:
        who = _who(end)
        if (end.qos_profile.reliability != ReliabilityPolicy.BEST_EFFORT
                or self._profile.reliability != ReliabilityPolicy.RELIABLE):
            return f'{who} cannot be received on {self._topic}: {reason.strip(" ;")}'
        return (f'{who} sends {self._topic} best effort, which is not received here; let it '
                f'publish reliable, or start this node with -p qos_overrides.{self._topic}.'
                'subscription.reliability:=best_effort')


def _who(end: TopicEndpointInfo) -> str:
    """Return the full name of the node of a publisher, in words where it has none."""
    return 'a program without a node name' if end.node_name == NAMELESS else (
        f'{end.node_namespace.rstrip("/")}/{end.node_name}')

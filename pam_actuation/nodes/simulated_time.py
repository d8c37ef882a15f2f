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
Simulated time of a node: followed from ``/clock``, or, in the plant, made.

Both are times a ``LoopSet`` runs on. ``FollowedTime`` goes on when a clock message
arrives, ``PlantTime`` when the rate asked for allows it. In lockstep both wait in
addition until what they need of the tick has arrived (``lockstep``).
"""

import time
from typing import Any

from pam_actuation.messages import START_NS
from pam_actuation.nodes import qos
from pam_actuation.nodes.endpoints import CountedPublisher
from pam_actuation.nodes.endpoints import full_name
from pam_actuation.nodes.endpoints import PolledSubscription
from pam_actuation.nodes.lockstep import TickInputs
from pam_actuation.nodes.ros_messages import set_stamp
from rclpy.clock import ClockType
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.qos import ReliabilityPolicy
from rclpy.time import Time
from rosgraph_msgs.msg import Clock

CLOCK_TOPIC = '/clock'
LONGEST_WAIT_S = 0.1                        # how soon a waiting node notices that it is to end
FALLEN_BEHIND_S = 0.1                       # later than this, the rate counts from now on anew
STANDS_STILL_S = 2.0                        # without a message: told in the diagnostics


def leave_clock_to_node(node: Node) -> None:
    """
    End rclpy's own subscription of the clock.

    It would run in the executor's thread, at a higher cost per message than a tick.
    """
    node._time_source.detach_node()


def set_node_clock(node: Node, now_ns: int) -> None:
    """Let the clock of a node, which stamps its log, show a simulated time [ns]."""
    clock: Any = node.get_clock()           # that of a node can be set
    clock.set_ros_time_override(Time(nanoseconds=now_ns, clock_type=ClockType.ROS_TIME))


class FollowedTime:
    """
    The time the plant publishes.

    Parameters
    ----------
    node : ManagedNode
        Node whose loops run on it.
    inputs : pam_actuation.nodes.lockstep.TickInputs
        What a tick needs before it may begin; none without lockstep.

    """

    def __init__(self, node: Node, inputs: TickInputs) -> None:
        self._node = node
        self._inputs = inputs
        self._subscription: PolledSubscription | None = None
        self._now_ns = 0
        self._pending_ns: int | None = None
        self._heard_s = time.monotonic()    # when the last message came, or it began to listen

    def begin(self) -> None:
        """Subscribe to the clock: the plant then knows that this node is ready."""
        self.end()
        self._pending_ns = None
        self._heard_s = time.monotonic()
        self._inputs.begin()
        self._subscription = PolledSubscription(
            self._node, Clock, CLOCK_TOPIC, qos.CONSUMER if self._inputs else qos.CLOCK)

    def end(self) -> None:
        """Leave the clock."""
        if self._subscription is not None:
            self._subscription.destroy()
            self._subscription = None

    close = end

    def now_ns(self) -> int:
        """Return the simulated time [ns], 0 before the first clock message."""
        return self._now_ns

    def remarks(self) -> list[str]:
        """Return a sentence where the time stands still, and with it the loops of the node."""
        silent_s = time.monotonic() - self._heard_s
        if self._pending_ns is not None or silent_s < STANDS_STILL_S:
            return []
        since = f'for {silent_s:.0f} s' if self._now_ns else 'since it became active'
        return [f'use_sim_time is set and nothing came on {CLOCK_TOPIC} {since}, so this node '
                'stands still']

    def wait_until(self, wake_ns: int) -> None:
        """Wait for the next clock message, and in lockstep for the inputs of its tick."""
        subscription = self._subscription
        if subscription is None:
            return
        try:
            if self._pending_ns is None:
                self._pending_ns = self._next(subscription)
            if self._pending_ns is not None and self._inputs.arrived(self._pending_ns):
                self._now_ns, self._pending_ns = self._pending_ns, None
                set_node_clock(self._node, self._now_ns)
        except InvalidHandle:
            return              # left the clock while waiting

    def _next(self, subscription: PolledSubscription) -> int | None:
        """Return the next time to go to [ns]; None if no message came for a while."""
        # In lockstep every message is a tick; else only the newest one counts.
        limit = 1 if self._inputs else 2000
        taken = subscription.take(limit)
        if not taken:
            subscription.wait(LONGEST_WAIT_S)
            taken = subscription.take(limit)
        if not taken:
            return None
        self._heard_s = time.monotonic()
        clock = taken[-1][0].clock
        return clock.sec * 1_000_000_000 + clock.nanosec


class PlantTime:
    """
    The time of the simulated rig, in steps of the plant's period; the plant publishes it.

    ``paused`` stops it, ``step`` lets it go on by one period. ``achieved_rate`` tells
    how many simulated seconds pass per second.

    Parameters
    ----------
    node : ManagedNode
        The plant.
    inputs : pam_actuation.nodes.lockstep.TickInputs
        What must have arrived before the time goes on; none without lockstep.
    period_s : float
        Step [s].
    rate : float
        Simulated seconds per second; 0: as fast as the inputs arrive.
    followers : tuple of str
        Full names of nodes that must receive the clock before it starts.

    """

    def __init__(self, node: Node, inputs: TickInputs, period_s: float, rate: float,
                 followers: tuple[str, ...] = ()) -> None:
        self._node = node
        self._inputs = inputs
        self._period_ns = round(period_s * 1e9)
        self._rate = rate
        self._followers = followers
        self._missing: tuple[str, ...] = ()
        self._publisher = CountedPublisher(node, Clock, CLOCK_TOPIC)
        self._message = Clock()
        self._now_ns = START_NS
        self._steps_left = 0
        self.paused = False
        self._begin_ns = START_NS
        self._anchor: tuple[int, int] | None = None
        self._rate_anchor: tuple[int, int] | None = None

    def begin(self) -> None:
        """Go on from the present, once all are there who take part."""
        self._anchor = self._rate_anchor = None
        self._missing = self._followers
        self._begin_ns = self._now_ns
        self._inputs.begin()

    def end(self) -> None:
        """Do nothing: the time stands still without loops."""

    def close(self) -> None:
        """Take the clock back."""
        self._publisher.destroy()

    @property
    def waits_for(self) -> tuple[str, ...]:
        """Return the full names of the nodes that do not receive the clock yet."""
        return self._missing

    def now_ns(self) -> int:
        """Return the simulated time [ns]."""
        return self._now_ns

    def remarks(self) -> list[str]:
        """Return no sentence: this time is made here; ``clock.rate`` tells how it goes."""
        return []

    def publish(self) -> None:
        """Tell everybody the time."""
        set_stamp(self._message.clock, self._now_ns)
        self._publisher.publish(self._message)

    def _follows(self, name: str) -> bool:
        """Tell whether a node subscribed by its own ``FollowedTime`` and not by rclpy's."""
        ends = self._node.get_subscriptions_info_by_topic(CLOCK_TOPIC)
        return self._publisher.matched_with(name) and any(
            end.qos_profile.reliability == ReliabilityPolicy.RELIABLE
            and full_name(end.node_namespace, end.node_name) == name for end in ends)

    def step(self) -> None:
        """Go on by one period although paused."""
        self._steps_left += 1

    def wait_until(self, wake_ns: int) -> None:
        """Go on by one period when that is due."""
        if self.paused and not self._steps_left:
            self._anchor = self._rate_anchor = None
            time.sleep(0.005)
            return
        if self._missing:
            self._missing = tuple(name for name in self._missing if not self._follows(name))
            time.sleep(0.02 if self._missing else 0.0)
            return
        # Before the first tick nobody has been asked for anything.
        first = self._now_ns == self._begin_ns
        try:
            if not (first or self._inputs.arrived(self._now_ns)) or not self._due():
                return
        except InvalidHandle:
            return              # cleaned up while waiting
        self._steps_left -= self._steps_left > 0
        self._now_ns += self._period_ns
        set_node_clock(self._node, self._now_ns)

    def _due(self) -> bool:
        """Wait until the rate allows the next period, at most 0.1 s; return whether it does."""
        steady_ns = time.monotonic_ns()
        if self._rate_anchor is None:
            self._rate_anchor = (steady_ns, self._now_ns)
        if self._rate == 0.0 or self.paused:
            return True
        if self._anchor is None:
            self._anchor = (steady_ns, self._now_ns)
        begin_ns, begin_simulated_ns = self._anchor
        simulated_ns = self._now_ns + self._period_ns - begin_simulated_ns
        left_s = (begin_ns + simulated_ns / self._rate - steady_ns) * 1e-9
        if left_s < -FALLEN_BEHIND_S:
            self._anchor = None
        if left_s > 0.0:
            time.sleep(min(left_s, LONGEST_WAIT_S))
        return left_s <= LONGEST_WAIT_S

    @property
    def achieved_rate(self) -> float:
        """Return simulated seconds per second since the start or the last pause."""
        if self._rate_anchor is None:
            return 0.0
        begin_ns, begin_simulated_ns = self._rate_anchor
        return (self._now_ns - begin_simulated_ns) / max(time.monotonic_ns() - begin_ns, 1)

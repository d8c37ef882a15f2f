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
Lockstep: all nodes of a rig go through the same ticks, none ahead of what it needs.

Each node ticks once per message on ``/clock``, and only when what the tick needs has arrived. The
plant sends measurements and clock. The controller waits for both and for the reference of the tick
before. The driver waits for the command, and the plant for the valve signal. So every node uses
the same inputs in the same tick in every run, however long messages take. A node that stays silent
is left out after a while, so that time goes on and its loss has the consequences it has in life.
"""

from collections.abc import Callable, Iterable, Sequence
import time
from typing import Protocol, TYPE_CHECKING

from pam_actuation.nodes.endpoints import CountedPublisher, full_name, PolledSubscription
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_actuation.nodes.managed import ManagedNode

PLANT, DRIVER, REFERENCE = 'plant_simulator', 'valve_driver', 'reference_generator'
CONTROLLERS = ('sofc_controller', 'pid_controller')
PARTICIPANTS = (PLANT, DRIVER, REFERENCE, *CONTROLLERS)
LEFT_OUT_AFTER_S = 2.0
PLANT_PATIENCE_S = 2.5 * LEFT_OUT_AFTER_S   # the driver may have waited for others before it
LONGEST_WAIT_S = 0.1
TURN_S = 0.0005

# Who needs a topic; the measurements go to whoever follows the clock.
NEEDED_BY = {
    'reference': CONTROLLERS, 'reference_trajectory': CONTROLLERS,
    'followed_pressure': CONTROLLERS,
    'pressure_command': (DRIVER,), 'valve_command': (DRIVER,),
    'valve_signal': (PLANT,), 'external_force': (PLANT,)}


def participants_of(names: Iterable[str]) -> tuple[str, ...]:
    """
    Return the participants a parameter lists, () for none.

    Raises
    ------
    InputError
        A name is not that of a node that can take part.

    """
    names = tuple(name for name in names if name)
    for name in names:
        if name not in PARTICIPANTS:
            raise InputError(f'{name!r} cannot take part, allowed are {", ".join(PARTICIPANTS)}',
                             'parameter lockstep')
    return names


def connections(node: 'ManagedNode',
                participants: Sequence[str]) -> list[tuple[CountedPublisher, str]]:
    """
    Return (publisher, full name of a node that must receive it) for what a node sends.

    Parameters
    ----------
    node : ManagedNode
        A configured node.
    participants : tuple of str
        All nodes that take part.

    """
    own = node.get_namespace()
    return [(publisher, full_name(own, name)) for topic, publisher in node.topics_sent()
            for name in NEEDED_BY.get(topic, ()) if name in participants]


class TickInput(Protocol):
    """What a tick needs: a message on one of some subscriptions."""

    @property
    def subscriptions(self) -> tuple[PolledSubscription, ...]:
        """Return where it may come."""

    def arrived(self, tick_ns: int) -> bool:
        """Return whether the message of a tick is there."""

    def follows(self, before_ns: int) -> bool:
        """Return whether the newest message is of a certain tick or later."""


class EachTick:
    """A topic that has one message per clock message, whatever its stamps."""

    def __init__(self, subscription: PolledSubscription) -> None:
        self.subscriptions = (subscription,)
        self._before = subscription.received
        self._ticks = 0
        self._tick_ns: int | None = None

    def arrived(self, tick_ns: int) -> bool:
        """Return whether the message of a tick is there."""
        if tick_ns != self._tick_ns:
            self._tick_ns = tick_ns
            self._ticks += 1
        return self.subscriptions[0].received - self._before >= self._ticks

    def follows(self, before_ns: int) -> bool:
        """Return False: a count that was lost once stays lost."""
        return False


class Stamped:
    """A message with the stamp of the tick, on any one of some topics."""

    def __init__(self, *subscriptions: PolledSubscription) -> None:
        self.subscriptions = subscriptions

    def arrived(self, tick_ns: int) -> bool:
        """Return whether the message of a tick is there."""
        return self.follows(tick_ns)

    def follows(self, before_ns: int) -> bool:
        """Return whether the newest message is of a certain tick or later."""
        return any(one.newest is not None and one.newest.stamp_ns >= before_ns
                   for one in self.subscriptions)


class OneTickOld(Stamped):
    """
    A topic that is used one tick after it was sent, so that its sender is not waited for.

    The receiver takes what is stamped before the tick (``take_before``): what was sent in the
    tick itself may have arrived already, or not.

    Parameters
    ----------
    subscription : PolledSubscription
        Of that topic.
    period_ns : int
        Time between two messages, the first in the first tick; 0: one per tick.

    """

    def __init__(self, subscription: PolledSubscription, period_ns: int = 0) -> None:
        super().__init__(subscription)
        self._period_ns = period_ns
        self._first_ns: int | None = None
        self._last_ns: int | None = None
        self._tick_ns: int | None = None

    def arrived(self, tick_ns: int) -> bool:
        """Return whether the last message due before the tick is there."""
        if tick_ns != self._tick_ns:
            self._last_ns, self._tick_ns = self._tick_ns, tick_ns
            self._first_ns = self._first_ns or tick_ns
        if self._last_ns is None or self._first_ns is None:
            return True
        due_ns = self._last_ns
        if self._period_ns:
            due_ns -= (due_ns - self._first_ns) % self._period_ns
        return self.follows(due_ns)


class StampedIfSent(Stamped):
    """A topic that not every experiment has: asked for where somebody publishes it."""

    def arrived(self, tick_ns: int) -> bool:
        """Return whether the message of a tick is there, or nobody sends any."""
        return not self.subscriptions[0].publishers or super().arrived(tick_ns)


class TickInputs:
    """
    What a node waits for before a tick; false if that is nothing, without lockstep.

    Parameters
    ----------
    make : callable
        Returns the list of inputs, such as ``EachTick`` and ``Stamped``; called at every start.
    active : bool
        Whether the node takes part in a lockstep.
    report : callable
        Gets one sentence when a sender is left out or is back.
    patience_s : float
        A sender silent for longer than this is left out [s].

    """

    def __init__(self, make: Callable[[], Sequence[TickInput]], active: bool,
                 report: Callable[[str], object], patience_s: float = LEFT_OUT_AFTER_S) -> None:
        self._make = make
        self._active = active
        self._report = report
        self._patience_s = patience_s
        self._inputs: Sequence[TickInput] = []
        self._left_out: dict[TickInput, int] = {}       # to the tick it was missing in
        self._since_s: float | None = None
        self._before_ns: int | None = None

    def __bool__(self) -> bool:
        """Tell whether this is a lockstep."""
        return self._active

    def begin(self) -> None:
        """Begin to count."""
        self._inputs = self._make() if self._active else []
        self._left_out = {}
        self._since_s = None
        self._before_ns = None

    def arrived(self, tick_ns: int) -> bool:
        """Wait for what a tick needs, at most 0.1 s; return whether all of it is there."""
        deadline_s = None
        for one in self._inputs:
            while not self._there(one, tick_ns):
                now_s = time.monotonic()
                deadline_s = deadline_s or now_s + LONGEST_WAIT_S
                if now_s >= deadline_s:
                    return self._give_up(one, tick_ns, now_s)
                self._wait(one, deadline_s - now_s)
        self._since_s = None
        self._before_ns = tick_ns
        return True

    def _there(self, one: TickInput, tick_ns: int) -> bool:
        for subscription in one.subscriptions:
            subscription.collect()
        if one in self._left_out:
            if not one.follows(max(self._left_out[one], self._before_ns or 0)):
                return True
            del self._left_out[one]
            self._report(f'{_names(one)} takes part in the lockstep again')
        return one.arrived(tick_ns)

    @staticmethod
    def _wait(one: TickInput, longest_s: float) -> None:
        # Of several topics any may come: looked at in turn.
        several = len(one.subscriptions) > 1
        for subscription in one.subscriptions:
            subscription.wait(TURN_S if several else longest_s)

    def _give_up(self, one: TickInput, tick_ns: int, now_s: float) -> bool:
        """Return False, for the next call to wait on; note a sender that is silent for long."""
        self._since_s = self._since_s or now_s
        if now_s - self._since_s > self._patience_s:
            self._since_s = None
            self._left_out[one] = tick_ns
            self._report(f'{_names(one)} is silent and left out of the lockstep')
        return False


def _names(one: TickInput) -> str:
    return ' or '.join(subscription.topic for subscription in one.subscriptions)

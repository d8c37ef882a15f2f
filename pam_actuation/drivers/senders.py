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
Who sends on a topic: one writer, one after another, or several at once.

The arriving messages show it, each with the GID of its writer. The graph does not: it still lists
a killed node for up to 20 s. No clock and no ROS; a writer is anything that can be a key of a
dictionary, None where it is not known, which is not judged.
"""

from collections.abc import Callable, Hashable

from pam_actuation.messages import SAFE_EFFORTS, VALVE_NAMES, valve_of, ValveSignal
from pam_sim.units import NS_PER_S

CLEAR_S = 1.0           # without a second sender, until the fault ends
UNNAMED_S = 0.2         # how long the graph may take to tell the name of a new node
_REMEMBERED_NS = 60 * NS_PER_S       # longer than a dead node stays on the graph
_MOST_UNNAMED = 32


def told(names: list[str]) -> str:
    """Return names as words: ``/a and /b``, ``two nodes named /a``; '' has none."""
    words = []
    for name in sorted(set(names)):
        count = names.count(name)
        if not name:
            words.append('a program without a node name')
        elif count > 1:
            words.append(f'{"two" if count == 2 else count} nodes named {name}')
        else:
            words.append(name)
    return ' and '.join(words)


def is_safe(message: ValveSignal) -> bool:
    """Tell whether a ``ValveSignal`` is the one that vents the valve it names."""
    valve = valve_of(message.names)
    efforts = dict(zip(message.names, message.efforts))
    return valve != '' and SAFE_EFFORTS[valve] == tuple(
        efforts.get(name) for name in VALVE_NAMES[valve])


class Senders:
    """
    The writers of one topic.

    A new writer in place of a former one is a restart. A writer that is heard again after
    another one shows that both send.
    """

    def __init__(self) -> None:
        self._forget()

    def _forget(self) -> None:
        # writer to the time of its newest message
        self._heard_ns: dict[Hashable, int] = {}
        # writer to the time when it was heard in turn with another
        self._rival_ns: dict[Hashable, int] = {}
        self._last: Hashable = None

    def heard(self, writer: Hashable, now_ns: int) -> None:
        """Note a message that was taken at a time."""
        if writer is None:
            return
        if self._last is not None and now_ns < self._heard_ns[self._last]:
            self._forget()          # the clock was set back
        if writer != self._last:
            if self._recent(self._heard_ns.get(writer), now_ns):
                self._rival_ns[writer] = self._rival_ns[self._last] = now_ns
            self._heard_ns = {one: time_ns for one, time_ns in self._heard_ns.items()
                              if now_ns - time_ns <= _REMEMBERED_NS}
            self._rival_ns = {one: time_ns for one, time_ns in self._rival_ns.items()
                              if one in self._heard_ns}
            self._last = writer
        self._heard_ns[writer] = now_ns

    def _recent(self, time_ns: int | None, now_ns: int) -> bool:
        return time_ns is not None and 0 <= now_ns - time_ns <= CLEAR_S * NS_PER_S

    def replaced(self, writer: Hashable) -> bool:
        """Tell whether a writer has been heard before another one, and not since."""
        return writer in self._heard_ns and writer != self._last

    def active(self, now_ns: int) -> tuple[Hashable, ...]:
        """Return the writers that were heard lately."""
        return tuple(one for one, time_ns in self._heard_ns.items()
                     if self._recent(time_ns, now_ns))

    def rivals(self, now_ns: int) -> tuple[Hashable, ...]:
        """Return the writers that send at the same time, () for a single one."""
        return tuple(one for one, time_ns in self._rival_ns.items()
                     if self._recent(time_ns, now_ns))


class SignalSenders:
    """
    Tell a second sender of ``valve_signal`` from the driver itself and from its watchdog.

    Parameters
    ----------
    own
        The driver's own writer.
    watchdog : str
        Full name of the watchdog, whose safe signals do not count.

    """

    def __init__(self, own: Hashable, watchdog: str) -> None:
        self.own, self._watchdog = own, watchdog
        self._senders = Senders()
        self._first_ns: dict[Hashable, int] = {}          # of writers without a name

    def heard(self, writer: Hashable, name: str, safe: bool, now_ns: int) -> bool:
        """
        Note a message; return whether it is a second sender's.

        ``name`` is the full name of its node, '' while the graph does not tell; ``safe``:
        it is the signal that vents.
        """
        if writer is None or self.own is None or writer == self.own:
            return False
        if safe and name == self._watchdog:
            return False
        if safe and not name:
            if len(self._first_ns) >= _MOST_UNNAMED:
                self._first_ns.clear()
            first_ns = self._first_ns.setdefault(writer, now_ns)
            if 0 <= now_ns - first_ns < UNNAMED_S * NS_PER_S:
                return False
        self._senders.heard(writer, now_ns)
        return True

    def foreign(self, now_ns: int) -> tuple[Hashable, ...]:
        """Return the writers beside driver and watchdog that were heard lately."""
        return self._senders.active(now_ns)


class DriverSenders:
    """
    Everybody a driver hears, and what is wrong about it.

    Parameters
    ----------
    own, watchdog
        As of ``SignalSenders``.
    name_of : callable
        Returns the full name of the node of a writer on a topic, '' if it is not known.
    own_name : str
        Full name of the driver.

    """

    FOLLOWED = {'pressure_command': 'two_publishers', 'valve_command': 'two_publishers',
                'pressure': 'two_sensors'}

    def __init__(self, own: Hashable, watchdog: str, name_of: Callable[[str, Hashable], str],
                 own_name: str) -> None:
        self.signals = SignalSenders(own, watchdog)
        self.topics = {topic: Senders() for topic in self.FOLLOWED}
        self._name_of, self._own_name = name_of, own_name

    def fault(self, now_ns: int) -> tuple[str, str] | None:
        """Return (key in ``FAULTS``, sentence), None while each topic has one sender."""
        foreign = self.signals.foreign(now_ns)
        if foreign:
            names = [self._name_of('valve_signal', one) for one in foreign]
            who = told(names)
            if names == [self._own_name]:
                who = f'another node named {self._own_name}'
            return 'second_driver', (
                f'valve_signal is sent by {who} as well as by this driver, stop one of them')
        for topic, key in self.FOLLOWED.items():
            rivals = self.topics[topic].rivals(now_ns)
            if rivals:
                return key, two_send(topic, [self._name_of(topic, one) for one in rivals])
        return None

    def commander(self, now_ns: int) -> str:
        """Return the name of the only writer of commands heard lately, '' for none or several."""
        heard = [(topic, one) for topic in ('pressure_command', 'valve_command')
                 for one in self.topics[topic].active(now_ns)]
        return told([self._name_of(*heard[0])]) if len(heard) == 1 else ''


def two_send(topic: str, names: list[str]) -> str:
    """Return the sentence on several nodes that send on one topic."""
    count = 'two' if len(names) == 2 else str(len(names))
    return f'{count} publishers send {topic}: {told(names)}, stop one of them'

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
The messages of a bag in the order in which a node met them.

A node acts on what has arrived, which is not the order of the header stamps: a message is stamped
when it is measured and arrives later. A bag keeps the time at which the recorder received each
message. For a simulated bag this is exactly when the loops got it. For a live bag it is the
receive time of another process, near that of the node but not equal.
"""

from collections.abc import Callable, Collection, Iterable, Iterator
import os
from typing import Any

import numpy as np
from pam_actuation.bags import series
from pam_actuation.bags.load import topics_of
from pam_actuation.bags.load_joint import is_read_of_joint, topics_of_joint
from pam_actuation.bags.metadata import names_of
from pam_actuation.bags.rig_topics import is_read
from pam_actuation.bags.source import read_bag, TopicData
from pam_actuation.loops.bus import Bus
from pam_actuation.messages import Message
from pam_actuation.topics.codec import decode
from pam_actuation.topics.table import BY_NAME, OF_A_RUN, short_name
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.errors import InputError
from pam_sim.joint.parameters import SIDES
from pam_sim.run import Run

# At equal times: measure, want, decide, act. The simulation runs its loops in this order too.
ORDER = tuple(OF_A_RUN)
# Of a joint as well; the angle comes first, it tells of a sample.
ORDER_OF_JOINT = ('joint_state', 'pressure', 'contraction', 'force', 'supply_pressure',
                  'external_torque', 'joint_reference', 'joint_trajectory', 'joint_effort',
                  'co_contraction', 'controller_state', 'pressure_command', 'valve_signal',
                  'followed_pressure')
# Stamped by a tick that used what had arrived before the stamp.
TICKED = ('controller_state', 'pressure_command', 'valve_signal')
CLOCKS_AGREE_NS = 500_000_000
# Of many internals of a tick only these matter to anything that is replayed in this order.
ONLY = {'controller_state': ('learning',)}
_BLOCK = 8192             # messages made at a time


class RecordedTopic:
    """
    The messages of one topic in the order of their arrival.

    They are read as arrays; a plain message is made when its turn comes, so that an
    hour takes no more memory than its numbers. Messages that are not of the topic's type are
    left out; the remarks of the loaded run count them.
    """

    def __init__(self, short: str, topic: TopicData, by_stamp: bool,
                 path: str | os.PathLike[str], only: Collection[str] | None = None) -> None:
        self.short = short
        self._messages: list[Message] | None = None
        numeric = BY_NAME[short].numeric
        if numeric is None:
            decoded = [_decoded(short, raw) for raw in topic.payloads]
            self._messages = [one for one in decoded if one is not None]
            self._columns: dict[str, FloatArray] = {}
            stamp_ns = np.array([one.stamp_ns for one in self._messages], dtype=np.int64)
            good = np.array([one is not None for one in decoded], dtype=bool)
        else:
            stamp_ns, columns, bad = series.table(short, topic.payloads, only)
            self._make = numeric.maker(tuple(columns))
            good = ~bad
            stamp_ns = stamp_ns[good]
            self._columns = {name: column[good] for name, column in columns.items()}
        received_ns = np.asarray(topic.log_time_ns, dtype=np.int64)[good]
        if BY_NAME[short].stamped:
            _check_clocks(stamp_ns, received_ns, topic, path)
        time_ns = stamp_ns if by_stamp else received_ns
        self._order = np.argsort(time_ns, kind='stable')
        self.time_ns = time_ns[self._order]
        self._stamp_ns = stamp_ns

    def __len__(self) -> int:
        """Return the number of messages."""
        return len(self.time_ns)

    def times(self) -> Iterator[int]:
        """Return an iterator over the times of arrival [ns]."""
        for begin in range(0, len(self), _BLOCK):
            yield from self.time_ns[begin:begin + _BLOCK].tolist()

    def __iter__(self) -> Iterator[Message]:
        """Return an iterator over the plain messages."""
        for begin in range(0, len(self), _BLOCK):
            places = self._order[begin:begin + _BLOCK]
            if self._messages is not None:
                yield from (self._messages[i] for i in places.tolist())
                continue
            columns = [column[places].tolist() for column in self._columns.values()]
            for stamp_ns, *values in zip(self._stamp_ns[places].tolist(), *columns):
                yield self._make(stamp_ns, values)

    def play(self, bus: Bus, tick: Callable[[Any, int], object]) -> None:
        """Have a bus call ``tick(message, now_ns)`` when a message arrived."""
        messages = iter(self)
        bus.add(lambda now_ns: tick(next(messages), now_ns), self.times())


def recorded_topics(run: Run, topics: Iterable[str],
                    ticks: Iterable[str] = TICKED) -> dict[str, RecordedTopic]:
    """
    Return some topics of a run's bag as they arrived, by short name in the order ``ORDER``.

    Parameters
    ----------
    run : pam_sim.run.Run
        A loaded bag; the bag is read again, because a run keeps no receive times.
    topics : iterable of str
        Short names; topics that are not in the bag are left out.
    ticks : iterable of str
        Topics whose messages mark a tick: they are placed at their header stamp, all others
        at their receive time.

    Raises
    ------
    InputError
        The bag cannot be read, or header stamps and receive times come from different clocks.

    """
    topics, ticks = set(topics), set(ticks)
    bag = read_bag(run.path, recover=True, names=names_of(run.metadata),
                   wanted=lambda name, *kind: (
                       name.rsplit('/', 1)[-1] in topics and is_read(name, *kind)))
    found = {}
    for short, topic in topics_of(bag, run.namespace).items():
        if short in topics:
            found[short] = RecordedTopic(
                short, topic, short in ticks, run.path, ONLY.get(short))
        bag.topics.pop(topic.name)            # its bytes are not needed any more
    return {short: found[short] for short in ORDER if short in found}


def recorded_topics_of_joint(run: Run) -> dict[str, RecordedTopic]:
    """
    Return the topics of a joint's bag as they arrived, by name relative to the joint.

    Commands and signals of each muscle are beside each other: the flexor comes first, as in a
    simulation. Errors are those of ``recorded_topics``.
    """
    bag = read_bag(run.path, recover=True, names=names_of(run.metadata),
                   wanted=lambda name, *kind: (
                       short_name(name) in ORDER_OF_JOINT
                       and is_read_of_joint(run.namespace, name, *kind)))
    found = topics_of_joint(bag, run.namespace)
    ordered = sorted(
        (name for name in found if short_name(name) in ORDER_OF_JOINT),
        key=lambda name: (ORDER_OF_JOINT.index(short_name(name)), SIDES.index(
            name.rpartition('/')[0]) if '/' in name else 0))
    return {name: RecordedTopic(short_name(name), found[name], short_name(name) in TICKED,
                                run.path) for name in ordered}


def _decoded(short: str, raw: bytes) -> Message | None:
    """Return a plain message, None where the bytes are none of this topic."""
    try:
        return decode(short, raw)
    except InputError:
        return None


def _check_clocks(stamp_ns: IntArray, received_ns: IntArray, topic: TopicData,
                  path: str | os.PathLike[str]) -> None:
    """Raise InputError where header stamps are of another clock than the receive times."""
    if not len(stamp_ns):
        return
    late_ns = np.median(received_ns - stamp_ns)
    if abs(late_ns) > CLOCKS_AGREE_NS:
        unset, count = int((stamp_ns == 0).sum()), len(stamp_ns)
        problem = (f'{unset} of {count} messages have no header stamp' if 2 * unset > count else
                   f'header stamps and receive times are {1e-9 * abs(late_ns):.1f} s apart')
        raise InputError(
            f'{topic.name}: {problem}; what had arrived when a node acted cannot be told',
            str(path))

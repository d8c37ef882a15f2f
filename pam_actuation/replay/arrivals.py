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

A node acts on what has arrived, which is not the order of the header stamps: a message is
stamped when it is measured and arrives later. A bag keeps the time at which the recorder
received each message. For a simulated bag this is exactly when the loops got it; for a live
one it is another process's receive time, near that of the node but not the same.
"""

from typing import NamedTuple

import numpy as np
from pam_actuation.bags import codecs
from pam_actuation.bags.load import topics_of
from pam_actuation.bags.source import read_bag
from pam_sim.errors import InputError

# At equal times: measure, want, decide, act; the order in which the simulation runs its loops.
ORDER = (
    'pressure', 'contraction', 'force', 'supply_pressure', 'external_force', 'reference',
    'reference_trajectory', 'controller_state', 'pressure_command', 'valve_command',
    'valve_signal')
# Stamped by a tick that used what had arrived before the stamp.
TICKED = ('controller_state', 'pressure_command', 'valve_signal')
CLOCKS_AGREE_NS = 500_000_000


class Arrival(NamedTuple):
    """One message: when it arrived [ns], the short name of its topic, the plain message."""

    time_ns: int
    topic: str
    message: object


def arrivals(run, topics, ticks=TICKED):
    """
    Return the messages of some topics of a run's bag in the order of their arrival.

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
        The bag cannot be read, a message is not of its topic's type, or header stamps and
        receive times come from different clocks.

    """
    bag = read_bag(run.path, recover=True)
    found = []
    for short, topic in topics_of(bag, run.namespace).items():
        if short not in topics:
            continue
        messages = [codecs.decode(short, raw) for raw in topic.payloads]
        _check_clocks(messages, topic, run.path)
        for message, received_ns in zip(messages, topic.log_time_ns):
            time_ns = message.stamp_ns if short in ticks else int(received_ns)
            found.append(Arrival(time_ns, short, message))
    rank = {name: place for place, name in enumerate(ORDER)}
    found.sort(key=lambda one: (one.time_ns, rank[one.topic]))
    return found


def _check_clocks(messages, topic, path):
    """Raise InputError where header stamps are of another clock than the receive times."""
    if not messages:
        return
    late_ns = np.median(np.array(topic.log_time_ns, dtype=np.int64)
                        - np.array([m.stamp_ns for m in messages], dtype=np.int64))
    if abs(late_ns) > CLOCKS_AGREE_NS:
        raise InputError(
            f'{topic.name}: header stamps and receive times are {1e-9 * abs(late_ns):.1f} s '
            'apart; what had arrived when a node acted cannot be told', str(path))

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
How many messages are missing, counted in one way by the recorder and by ``pam info``.

Every node says in /diagnostics how many messages it has published, as
``published.<full topic>``. What a node had published by its last report must be in the
bag from before that report; so a node that died early is checked too. A logger of one's own may
begin long after the nodes: then the first report of a node in the bag is what counts are from.
"""

from array import array
from collections.abc import Collection, Mapping

from pam_actuation.topics.codec import decode
from pam_actuation.topics.table import DIAGNOSTICS
from pam_sim.errors import InputError

PUBLISHED = 'published.'
COUNT_DIGITS = 18
# A node reports once in a second at least: one heard by then was there before the bag.
REPORTED_WITHIN_NS = 1_500_000_000
_MOST_KEPT = 10_000           # send times of a topic no node reports on


def count_of(text: str) -> int | None:
    """Return the number a text is, None where it is no number of messages."""
    return int(text) if text.isdecimal() and len(text) <= COUNT_DIGITS else None


def missing_messages(unheard: int | None, published: int | None, held_by_then: int,
                     accounted_for: int) -> int | None:
    """
    Return how many messages never arrived, None where it cannot be known.

    Parameters
    ----------
    unheard : int or None
        By gaps in the publishers' sequence numbers.
    published : int or None
        What the nodes say they have published.
    held_by_then : int
        Messages that were sent up to that report and are there.
    accounted_for : int
        Those known to be dropped or sent before the recorder was connected.

    """
    if published is None:
        return unheard
    return max(unheard or 0, published - held_by_then - accounted_for)


class PublishedCounts:
    """
    What the nodes last reported, by full topic.

    Reports of several nodes on one topic add up; the latest report's time counts.

    Parameters
    ----------
    begins_ns : mapping of str to int, optional
        Send time [ns] of the first message of each topic in a bag, by full name, for
        ``first_of``.
    begin_ns : int, optional
        When the bag itself begins [ns].

    """

    def __init__(self, begins_ns: Mapping[str, int] | None = None,
                 begin_ns: int | None = None) -> None:
        self._begins_ns = begins_ns or {}
        self._begin_ns = begin_ns
        # As _last, of the first report since the topic begins.
        self._baseline: dict[str, dict[str, tuple[int, int]]] = {}
        # Topic -> status name -> (number, send time).
        self._last: dict[str, dict[str, tuple[int, int]]] = {}
        # Status name -> (number, send time) of its first report on /diagnostics.
        self._first: dict[str, tuple[int, int]] = {}

    def hear(self, payload: bytes, sent_ns: int) -> set[str]:
        """
        Take one serialized message of /diagnostics and its send time [ns].

        Returns the topics it reports on.
        """
        topics: set[str] = set()
        try:
            statuses = decode('diagnostics', payload)
        except InputError:
            return topics
        for status in statuses:
            for key, text in status.values:
                number = count_of(text)
                if key.startswith(PUBLISHED) and number is not None:
                    topics.add(topic := key[len(PUBLISHED):])
                    self._last.setdefault(topic, {})[status.name] = (number, sent_ns)
                    if sent_ns >= self._begins_ns.get(topic, sent_ns + 1):
                        self._baseline.setdefault(topic, {}).setdefault(
                            status.name, (number, sent_ns))
                    if topic == DIAGNOSTICS:
                        self._first.setdefault(status.name, (number, sent_ns))
        return topics

    def missed_reports(self, namespaces: Collection[str] = (),
                       late: bool = False) -> int | None:
        """
        Return how many reports on /diagnostics came before the first one of their node.

        Of the nodes in these namespaces; none given: of all. With ``late`` only of those that
        were not there when the bag began. A report counts itself. None where nobody counts them.
        """
        since_ns = None if self._begin_ns is None or not late else (
            self._begin_ns + REPORTED_WITHIN_NS)
        if not self._first:
            return None
        return sum(max(number - 1, 0) for name, (number, sent_ns) in self._first.items()
                   if (not namespaces or name.rpartition('/')[0] in namespaces)
                   and (since_ns is None or sent_ns > since_ns))

    def of(self, topic: str) -> tuple[int | None, int]:
        """Return (published, send time of the last report), (None, 0) where nobody reports."""
        last = self._last.get(topic)
        if not last:
            return None, 0
        return sum(number for number, _ in last.values()), max(sent for _, sent in last.values())

    def first_of(self, topic: str) -> tuple[int, int] | None:
        """
        Return (published, send time) of the first report since a topic begins in the bag.

        Numbers of several nodes add up; the earliest of their times counts. None where nobody
        reported since.
        """
        baseline = self._baseline.get(topic)
        if not baseline:
            return None
        # Of a node that ended before, nothing is published since.
        numbers = {**self._last[topic], **baseline}
        return (sum(number for number, _ in numbers.values()),
                min(sent for _, sent in baseline.values()))


class SentTimes:
    """Counts, while recording, the messages sent up to a report that comes after them."""

    def __init__(self) -> None:
        self._before = 0
        self._later: array[int] = array('q')
        self._differ = self._reported = False

    def add(self, sent_ns: int, received_ns: int) -> None:
        """Take the send and receive time [ns] of one message."""
        self._differ = self._differ or sent_ns != received_ns
        self._later.append(sent_ns)
        if len(self._later) > _MOST_KEPT and not self._reported:
            self._keep(self._later[_MOST_KEPT // 2:])

    def trim(self, reported_ns: int) -> None:
        """Keep no times that a report at this time [ns] has settled."""
        self._reported = True
        self._keep(array('q', (sent for sent in self._later if sent > reported_ns)))

    def _keep(self, later: 'array[int]') -> None:
        self._before += len(self._later) - len(later)
        self._later = later

    def up_to(self, reported_ns: int) -> int:
        """Return how many were sent up to a report; all where send times are not known."""
        if not self._differ:
            return self._before + len(self._later)
        return self._before + sum(sent <= reported_ns for sent in self._later)

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

"""Everything that the page shows: signals by namespace, the state of every node, rates."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import threading
from time import monotonic
from typing import Any, Final

import numpy as np
from pam_actuation.messages import LEVEL_STALE, Marker, Status
from pam_actuation.namespaces import lies_in
from pam_actuation.view.history import History
from pam_actuation.view.plots import DERIVED, Difference, DIFFERENCES, KEPT, Signal, SIGNALS
from pam_sim.annotations import FloatArray, IntArray

SPAN_NS: Final = 60_000_000_000         # of what is kept of a live rig
RATE_NS: Final = 1_000_000_000          # over which a rate is counted
MOST_MARKERS: Final = 100               # of a live rig
SILENT_AFTER_S: Final = 2.0             # nodes speak twice a second
Key = tuple[str, str]                   # namespace and short name of a topic


@dataclass(frozen=True)
class Line:
    """One signal in one namespace."""

    namespace: str
    signal: Signal


class Store:
    """
    Signals and states, filled by one thread and read by another under ``lock``.

    Parameters
    ----------
    span_ns : int, optional
        Time kept of each topic [ns]; None keeps everything, as of a bag.

    Attributes
    ----------
    histories : dict of (namespace, topic) to History
        Topics by short name, and what is derived of them as ``plots.DERIVED``.
    lost : dict of (namespace, topic) to int
        Messages that were sent and did not arrive here.
    markers : list of (namespace, Marker)
        In order of arrival.

    """

    def __init__(self, span_ns: int | None = SPAN_NS) -> None:
        self.lock = threading.RLock()
        self.histories: dict[Key, History] = {}
        self.lost: dict[Key, int] = {}
        self._span_ns = span_ns
        self.markers: list[tuple[str, Marker]] = []
        self._statuses: dict[str, list[Status]] = {}
        self._differences: dict[tuple[str, str], int] = {}      # rows that are dealt with
        self._drawn: dict[Key, set[str]] = {}                   # values that were ever finite
        self._heard_s: dict[Key | str, float] = {}              # topics and nodes, steady clock

    def add(self, namespace: str, topic: str, times_ns: IntArray,
            values: Mapping[str, FloatArray], lost: int | None = None) -> None:
        """
        Take messages of one topic.

        Parameters
        ----------
        namespace : str
            Such as ``/muscle``.
        topic : str
            Short name; one of ``plots.KEPT``.
        times_ns : ndarray of int64, shape (N,)
            Stamps in order of arrival [ns].
        values : dict of str to ndarray, shape (N,)
            SI values by name; those that are not drawn are left out.
        lost : int, optional
            Messages of this topic lost so far; None where nobody counts.

        """
        names = KEPT[topic]
        rows = np.full((len(names), len(times_ns)), np.nan)
        for row, name in zip(rows, names):
            if name in values:
                row[:] = values[name]
        with self.lock:
            self._heard_s[namespace, topic] = monotonic()
            if lost is not None:
                self.lost[namespace, topic] = lost
            self._append((namespace, topic), names, times_ns, rows)
            for difference in DIFFERENCES:
                if topic in (difference.wanted[0], difference.measured[0]):
                    self._derive(namespace, difference)

    def _append(self, key: Key, names: tuple[str, ...], times_ns: IntArray,
                rows: FloatArray) -> None:
        history = self.histories.get(key)
        if history is None:
            history = self.histories[key] = History(names, self._span_ns)
        history.append(times_ns, rows)
        drawn = self._drawn.setdefault(key, set())
        if len(drawn) < len(names):
            drawn.update(name for name, row in zip(names, rows) if np.isfinite(row).any())

    def _derive(self, namespace: str, difference: Difference) -> None:
        """Calculate an error at each measurement for which the reference is known."""
        wanted = self.histories.get((namespace, difference.wanted[0]))
        measured = self.histories.get((namespace, difference.measured[0]))
        if not wanted or not measured:
            return
        place = namespace, difference.value
        begin = measured.first_new(self._differences.get(place, 0))
        times_ns = measured.times_ns
        # A later reference may still be on its way: it holds from its stamp on.
        stop = int(np.searchsorted(times_ns, wanted.times_ns[-1], side='right'))
        if stop <= begin:
            return
        self._differences[place] = measured.end - len(measured) + stop
        held = np.searchsorted(wanted.times_ns, times_ns[begin:stop], side='right') - 1
        error = (wanted.values(difference.wanted[1])[np.maximum(held, 0)]
                 - measured.values(difference.measured[1])[begin:stop])
        error[held < 0] = np.nan
        if np.isfinite(error).any():
            self._append((namespace, f'{DERIVED}.{difference.value}'), (difference.value,),
                         times_ns[begin:stop], error[np.newaxis])

    def add_statuses(self, statuses: Iterable[Status]) -> None:
        """Take what nodes say of themselves; of a live rig only the newest is kept."""
        with self.lock:
            for status in statuses:
                known = self._statuses.setdefault(status.name, [])
                if self._span_ns is not None:
                    known.clear()
                known.append(status)
                self._heard_s[status.name] = monotonic()

    def add_markers(self, namespace: str, markers: Iterable[Marker]) -> None:
        """Take markers of a rig, each once, however often it comes; of a live rig the recent."""
        with self.lock:
            for marker in markers:
                if (namespace, marker) not in self.markers:
                    self.markers.append((namespace, marker))
            if self._span_ns is not None:
                del self.markers[:-MOST_MARKERS]

    def now_ns(self) -> int | None:
        """
        Return the time of the newest messages [ns], None before the first.

        It is the median over the topics that still come, so that one wrong stamp moves nothing.
        """
        with self.lock:
            newest = [one.newest_ns for one in self.histories.values()]
        known = sorted(time for time in newest if time is not None)
        if not known:
            return None
        middle = known[len(known) // 2]
        recent = [time for time in known if abs(time - middle) < RATE_NS]
        return recent[len(recent) // 2]

    def span_ns(self) -> tuple[int, int]:
        """Return the first and the last stamp [ns] of all signals, (0, 0) where there is none."""
        with self.lock:
            times = [one.times_ns for one in self.histories.values() if len(one)]
            if not times:
                return 0, 0
            return int(min(one[0] for one in times)), int(max(one[-1] for one in times))

    def namespaces(self) -> list[str]:
        """Return the namespaces with signals, sorted; a joint comes before its muscles."""
        with self.lock:
            return sorted({namespace for namespace, _ in self.histories})

    def lines(self, view: str) -> list[Line]:
        """Return all signals with values in a namespace and in those below it, in order."""
        with self.lock:
            chosen = [one for one in self.namespaces()
                      if lies_in(one, view)]
            return [Line(namespace, signal) for namespace in chosen for signal in SIGNALS
                    if signal.value in self._drawn.get(_key(namespace, signal), ())]

    def history(self, line: Line) -> History:
        """Return the rows of the topic that a line is drawn from."""
        return self.histories[_key(line.namespace, line.signal)]

    def state(self, now_ns: int | None) -> dict[str, Any]:
        """
        Return what is true at a time, for the page.

        A live rig is silent by the steady clock: no stamp tells that no message comes.

        Parameters
        ----------
        now_ns : int, optional
            Time [ns].

        Returns
        -------
        dict
            ``nodes``: name, level, message and values of each node; ``topics``: name, rate [Hz],
            lost (None: not counted) and late messages of each topic; ``markers``: namespace,
            time [s] and text of each.

        """
        with self.lock:
            topics = [{
                'name': f'{namespace}/{topic}', 'rate_hz': self._rate((namespace, topic), now_ns),
                'lost': self.lost.get((namespace, topic)), 'late': history.late}
                for (namespace, topic), history in sorted(self.histories.items())
                if not topic.startswith(DERIVED)]
            found = [_at(statuses, now_ns if self._span_ns is None else None)
                     for _, statuses in sorted(self._statuses.items())]
            nodes = [_node(status, self._age_s(status.name, status.stamp_ns, now_ns))
                     for status in found if status is not None]
            markers = [{'namespace': namespace, 'time_s': one.stamp_ns * 1e-9, 'text': one.text}
                       for namespace, one in self.markers]
        return {'nodes': nodes, 'topics': topics, 'markers': markers}

    def _age_s(self, key: Key | str, stamp_ns: int, now_ns: int | None) -> float:
        """Return for how long a topic or a node, whose last stamp is known, said nothing [s]."""
        if self._span_ns is not None:
            return monotonic() - self._heard_s[key]
        return 0.0 if now_ns is None else (now_ns - stamp_ns) * 1e-9

    def _rate(self, key: Key, now_ns: int | None) -> float:
        history = self.histories[key]
        if now_ns is None or not len(history) or (
                self._age_s(key, now_ns, now_ns) > RATE_NS * 1e-9):
            return 0.0
        begin, end = np.searchsorted(
            history.times_ns, [now_ns - RATE_NS, now_ns], side='right')
        return round(float(end - begin) / (RATE_NS * 1e-9), 1)


def _key(namespace: str, signal: Signal) -> Key:
    topic = signal.topic
    return namespace, f'{DERIVED}.{signal.value}' if topic == DERIVED else topic


def _at(statuses: list[Status], now_ns: int | None) -> Status | None:
    """Return the last status at a time, None before the first."""
    if now_ns is None:
        return statuses[-1]
    return next((one for one in reversed(statuses) if one.stamp_ns <= now_ns), None)


def _node(status: Status, age_s: float) -> dict[str, Any]:
    level, message = status.level, status.message
    if age_s > SILENT_AFTER_S:
        level = LEVEL_STALE
        message = f'silent for {age_s:.0f} s; last: {message}'
    return {'name': status.name, 'level': level, 'message': message,
            'values': dict(status.values)}

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
What is odd in the messages of a recording, as sentences, and who is told of it.

``Oddities`` gathers the sentences while a bag is loaded. ``recording_remarks`` returns those
that belong beside every answer that rests on recordings.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from pam_actuation.bags.ending import ending_of
from pam_actuation.topics.table import BY_NAME, short_name
from pam_sim.annotations import BoolArray, FloatArray, IntArray
from pam_sim.run import Run
from pam_sim.silence import silences
from pam_sim.units import often

# Messages of two senders, or of two threads, overtake each other by less.
USUAL_BACK_S = 0.1
# A stray stamp is off by more than this and by so many periods of its topic.
STRAY_S, STRAY_PERIODS = 1.0, 10
# The largest share of a topic that is stray; more is the work of a clock. One always may be.
STRAY_SHARE = 0.01
# Nodes stop one after the other: a topic may end before the others by so much, or by such a share.
USUAL_END_S, USUAL_END_SHARE = 5.0, 0.25
_MOST_SILENT = 3                # times in a sentence
_ALIKE_S = 0.5                  # between the ends of times in which all topics are silent


@dataclass
class Oddities:
    """
    Sentences on anything odd.

    Parameters
    ----------
    remarks : list of str
        What the reader of an answer should know.
    left_out : list of str
        Those of the remarks that tell of lost messages.
    notes : list of str
        What is harmless.
    heard : dict of str to ndarray of int64
        Times at which a topic told something, by its full name. They are receive times, as a
        clock that is set makes no silence.

    """

    remarks: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    heard: dict[str, IntArray] = field(default_factory=dict)

    def leave_out(self, sentence: str) -> None:
        """Take a sentence on messages that are left out."""
        self.remarks.append(sentence)
        self.left_out.append(sentence)

    def without_stray(self, name: str, stamp_ns: IntArray, log_time_ns: IntArray) -> BoolArray:
        """Return which messages of a topic to keep, and tell of stamps that are stray."""
        found = np.flatnonzero(stray(stamp_ns, log_time_ns))
        keep = np.ones(len(stamp_ns), dtype=bool)
        if found.size:
            keep[found] = False
            first = int(found[0])
            by_s = 1e-9 * float(stamp_ns[first] - np.median(stamp_ns[max(first - 2, 0):first + 3]))
            self.leave_out(
                f'{name}: {found.size} messages have a stamp far from those around them (stamp '
                f'{1e-9 * float(stamp_ns[first]):.3f} s, {abs(by_s):.1f} s '
                f'{"ahead" if by_s > 0.0 else "behind"}), left out.')
        return keep

    def goes_back(self, name: str, stamp_ns: IntArray) -> bool:
        """Tell of the stamps of a topic, in the order of recording, that go back, if some do."""
        steps_ns = np.diff(stamp_ns)
        backward = int((steps_ns < 0).sum())
        if backward:
            most_s = -1e-9 * float(steps_ns.min())
            told = (f'{name}: the stamp goes back {often(backward)}, by up to {most_s:.3g} s; '
                    'sorted by stamp')
            if most_s > USUAL_BACK_S:
                self.remarks.append(f'{told}, which mixes what was recorded before and after.')
            else:
                self.notes.append(f'{told}.')
        return backward > 0

    def tell_ahead(self, name: str, stamp_ns: IntArray, log_time_ns: IntArray) -> None:
        """Tell of the stamps of a topic that go ahead while hardly any time passes."""
        if _receipts_tell(stamp_ns, log_time_ns):
            more_ns = np.diff(stamp_ns) - np.diff(log_time_ns)
            ahead_ns = more_ns[np.minimum(more_ns, np.diff(stamp_ns)) > _far_ns(stamp_ns)]
            if ahead_ns.size:
                self.remarks.append(
                    f'{name}: the stamp goes ahead {often(ahead_ns.size)}, by up to '
                    f'{1e-9 * float(ahead_ns.max()):.3g} s more than passed between the '
                    'receipts, as where a clock is set.')

    def tell_repeated(self, name: str, stamp_ns: IntArray) -> None:
        """Tell of the stamps of a topic, in their order, that repeat."""
        same = int((np.diff(stamp_ns) == 0).sum())
        if same:
            self.notes.append(f'{name}: {same} messages repeat the stamp before, kept.')

    def tell_silent(self) -> None:
        """Tell of topics that are silent for long, once all are heard."""
        for sentence in silent_remarks(self.heard):
            self.leave_out(sentence)


def heard_ns(received_ns: IntArray, values: Mapping[str, FloatArray]) -> IntArray:
    """Return the receive times of the messages of which something can be used."""
    usable = np.zeros(len(received_ns), dtype=bool)
    for column in values.values():
        usable |= np.isfinite(column)
    return received_ns[usable]


def silent_remarks(heard: Mapping[str, IntArray]) -> list[str]:
    """
    Return a sentence on each topic that is silent for a long part, or ends long before the others.

    A topic that rarely comes, such as a reference, is not judged. A time in which all are silent
    is told once.

    Parameters
    ----------
    heard : dict of str to ndarray of int64
        Full names of the topics of a muscle or joint, to times as of ``heard_ns``.

    """
    steady = {name: time_ns for name, time_ns in heard.items()
              if len(time_ns) and BY_NAME[short_name(name)].steady}
    start_ns = min((int(one.min()) for one in heard.values() if len(one)), default=0)
    end_ns = max((int(one.max()) for one in steady.values()), default=0)
    usual_end_s = min(USUAL_END_S, USUAL_END_SHARE * 1e-9 * (end_ns - start_ns))
    found = {name: [(begin, end) for begin, end in silences(time_ns, end_ns)
                    if begin < int(time_ns.max()) or 1e-9 * (end - begin) > usual_end_s]
             for name, time_ns in steady.items()}

    def none_goes_on(span: tuple[int, int]) -> bool:
        return len(found) > 1 and all(any(
            max(abs(span[0] - begin), abs(span[1] - end)) < _ALIKE_S * 1e9
            for begin, end in own) for own in found.values())

    def told(spans: list[tuple[int, int]]) -> str:
        more = f' and {often(len(spans) - _MOST_SILENT)} more' * (len(spans) > _MOST_SILENT)
        return 'no value that can be used ' + ', '.join(
            f'from {1e-9 * (begin - start_ns):.3f} s to {1e-9 * (end - start_ns):.3f} s'
            for begin, end in spans[:_MOST_SILENT]) + more

    common = [span for span in next(iter(found.values()), []) if none_goes_on(span)]
    alone = {name: [span for span in own if not none_goes_on(span)]
             for name, own in found.items()}
    return [*([f'all topics: {told(common)}.'] if common else []),
            *(f'{name}: {told(own)}, while others go on.' for name, own in alone.items() if own)]


def run_remarks(run: Run) -> list[str]:
    """Return what to know of a recording: remarks of loading, and how far it came if not far."""
    ending = ending_of(run.metadata)
    return [*getattr(run, 'remarks', ()), *[ending.sentence] * ending.early]


def recording_remarks(runs: Iterable[Run]) -> list[str]:
    """Return what to know of the recordings behind an answer, each sentence with its path."""
    return [f'{run.path}: {remark}' for run in runs for remark in run_remarks(run)]


def stray(stamp_ns: IntArray, log_time_ns: IntArray) -> BoolArray:
    """
    Return which few stamps of a topic are far from those around them.

    The receive times must tell that the message came in its turn.

    Parameters
    ----------
    stamp_ns, log_time_ns : array of int
        Stamps and receive times, in the order of recording.

    """
    none = np.zeros(len(stamp_ns), dtype=bool)
    if len(stamp_ns) < 5 or not (np.diff(stamp_ns) < 0).any() and not _ends_jump(stamp_ns):
        return none
    if not _receipts_tell(stamp_ns, log_time_ns):
        return none
    far_ns = _far_ns(stamp_ns)
    found: BoolArray = (_off_ns(stamp_ns) > far_ns) & (_off_ns(log_time_ns - stamp_ns) > far_ns)
    return found if found.sum() <= max(1, STRAY_SHARE * len(found)) else none


def _period_ns(stamp_ns: IntArray) -> float:
    return float(np.median(np.abs(np.diff(stamp_ns))))


def _far_ns(stamp_ns: IntArray) -> float:
    """Return how far a stamp is from those around it that is none of a steady topic."""
    return max(1e9 * STRAY_S, STRAY_PERIODS * _period_ns(stamp_ns))


def _receipts_tell(stamp_ns: IntArray, log_time_ns: IntArray) -> bool:
    """Return whether a message is received about when it is stamped."""
    if len(stamp_ns) < 5:
        return False
    delay_ns = log_time_ns - stamp_ns
    return 2.0 * float(np.median(np.abs(np.diff(delay_ns)))) <= _period_ns(stamp_ns)


def _off_ns(times_ns: IntArray) -> IntArray:
    """Return how far each is from the median of itself and two neighbours on either side."""
    padded = np.pad(times_ns, 2, mode='reflect')
    around = np.lib.stride_tricks.sliding_window_view(padded, 5)
    return np.abs(times_ns - np.sort(around, axis=1)[:, 2])


def _ends_jump(stamp_ns: IntArray) -> bool:
    """Return whether the first or last stamp is far from its neighbour."""
    first_ns, last_ns = np.diff(stamp_ns)[[0, -1]]
    return bool(max(first_ns, last_ns) > 1e9 * STRAY_S)

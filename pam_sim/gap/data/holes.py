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
Recordings with holes: each stretch between two holes counts as a recording of its own.

The measured pressure drives muscle and load, and a given contraction a muscle whose length is
given. Nobody knows what they did during a hole, nor where the muscle is after it.
"""

from collections.abc import Sequence
import copy
from itertools import accumulate

import numpy as np
from pam_sim.annotations import IntArray
from pam_sim.run import is_held, Run, Series

# A hole is longer than this, and than so many periods of a slow log: within less, a straight line
# between readings does less harm than a new start.
HOLE_S, HOLE_PERIODS = 0.25, 5.0
NONE_LEFT = ('the recording has {holes}, so that no stretch of {least_s:g} s is left; repair the '
             'logger, or record again')
COUNT = '{path}: {holes}; the stretches without a hole count as {count} recordings'
SHORT = ', without those of less than {least_s:g} s'


def stretches(run: Run, least_s: float, driven: bool = False) -> tuple[list[Run], str]:
    """
    Return (stretches, sentence): the parts of a run between holes, the longest first.

    Without a hole it is the run as given, and the sentence is empty. Where none is long enough
    the list is empty, and the sentence says what to do.

    Parameters
    ----------
    run : pam_sim.run.Run
        The recording.
    least_s : float
        Shorter stretches are left out [s].
    driven : bool
        Whether the contraction is given, as in an isometric rig or a joint.

    """
    found, told = _holes_of(run, driven)
    every = sorted((begin, end) for one in found.values() for begin, end in one)
    if not every:
        return [run], ''
    # A hole may lie within that of another topic: what is between them is no stretch.
    begins = accumulate((run.start_ns, *(end for _, end in every)), max)
    ends = [*(begin for begin, _ in every), run.end_ns]
    parts = [(begin, end) for begin, end in zip(begins, ends) if end > begin]
    kept = [(begin, end) for begin, end in parts if end - begin >= least_s * 1e9]
    if not kept:
        return [], NONE_LEFT.format(holes=told, least_s=least_s)
    kept.sort(key=lambda ends: ends[0] - ends[1])
    text = COUNT.format(path=run.path or 'recording', holes=told, count=len(kept))
    if len(kept) < len(parts):
        text += SHORT.format(least_s=least_s)
    return [between(run, *one) for one in kept], text


def split_at_holes(runs: Sequence[Run], certify: Run | None, least_s: float,
                   driven: bool = False
                   ) -> tuple[list[Run], int, Run | None, list[str], list[str]]:
    """
    Return (runs, first, certify, remarks, refusals): stretches stand for runs with holes.

    ``first`` of these are of the first run. Of the recording for the validation the longest
    stretch is kept.

    Parameters
    ----------
    runs : sequence of Run
        Recordings to search.
    certify : Run, optional
        Recording for the validation.
    least_s, driven : float, bool
        As of ``stretches``.

    """
    remarks: list[str] = []
    refusals: list[str] = []
    found: list[list[Run]] = []
    for run in [*runs, *([certify] if certify is not None else [])]:
        parts, text = stretches(run, least_s, driven)
        found.append(parts)
        if text:
            (remarks if parts else refusals).append(text)
    last = found.pop() if certify is not None else []
    kept = [one for parts in found for one in parts]
    return kept, len(found[0]), last[0] if last else None, remarks, refusals


def holes_of(run: Run, driven: bool = False) -> str:
    """Return which holes a run has in what drives a model, '' for none; as of ``stretches``."""
    return _holes_of(run, driven)[1]


def _holes_of(run: Run, driven: bool) -> tuple[dict[str, IntArray], str]:
    """Return (holes by topic, how many there are in words)."""
    topics = [topic for topic in ('pressure', 'contraction')[:1 + driven] if topic in run]
    found = {topic: holes_in(run.topics[topic].stamp_ns) for topic in topics}
    return found, ' and '.join(_sentence(topic, own, run.start_ns)
                               for topic, own in found.items() if len(own))


def holes_in(stamp_ns: IntArray) -> IntArray:
    """Return the first and last stamp [ns] of each hole, shape (N, 2)."""
    stamps: IntArray = np.unique(stamp_ns)
    periods = np.diff(stamps)
    if not periods.size:
        return np.zeros((0, 2), dtype=np.int64)
    least_ns = max(HOLE_S * 1e9, HOLE_PERIODS * float(np.median(periods)))
    place = np.flatnonzero(periods > least_ns)
    return np.column_stack([stamps[place], stamps[place + 1]])


def between(run: Run, begin_ns: int, end_ns: int) -> Run:
    """Return the part of a run between two stamps [ns]; what holds, holds at its begin too."""
    topics = {}
    for name, series in run.topics.items():
        inside = (series.stamp_ns >= begin_ns) & (series.stamp_ns <= end_ns)
        if is_held(name, series):
            before = np.flatnonzero(series.stamp_ns < begin_ns)
            inside[before[-1:]] = True
        # Of what holds, the last value from before counts from the begin on.
        values = {key: value[inside] for key, value in series.values.items()}
        topics[name] = Series(np.maximum(series.stamp_ns[inside], begin_ns), values,
                              series.unit, series.start_ns, series.held)
    start_s, stop_s = ((stamp - run.start_ns) * 1e-9 for stamp in (begin_ns, end_ns))
    found = copy.copy(run)
    found.topics = topics
    found.path = f'{run.path or "recording"}, {start_s:.1f} to {stop_s:.1f} s'
    return found


def _sentence(topic: str, holes: IntArray, start_ns: int) -> str:
    """Return how many holes a topic has, and where the longest is."""
    longest = holes[np.argmax(holes[:, 1] - holes[:, 0])]
    length_s, at_s = (longest[1] - longest[0]) * 1e-9, (longest[0] - start_ns) * 1e-9
    if len(holes) == 1:
        return f'no {topic} for {length_s:.1f} s from {at_s:.1f} s on'
    return f'{len(holes)} holes in the {topic}, the longest of {length_s:.1f} s at {at_s:.1f} s'

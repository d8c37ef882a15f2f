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
Which samples are fitted, which rank the rivals, and which are kept for the validation.

Time blocks in turn; a part is never chosen sample by sample, for neighbours share
their error. With a run of its own for the validation, all blocks of the others serve the
search.

A recording of few moves, such as one step up and one down, would leave a part without any. There
the blocks are short stretches of every edge. The free run covers all of it; the parts judge the
same edges at other moments. That is interpolation: it shows that the form of an edge is met, not
that another edge would be.
"""

from dataclasses import dataclass, replace

import numpy as np
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.recording import Recording, START_S

FIT, SELECT, CERTIFY, UNUSED = range(4)
BLOCK_S = 2.0                # length of a time block, shorter in a short recording
SHORT_BLOCK_S = 0.05, 0.1    # least and most where the moves are few: some samples; a moment
SAMPLES_OF_A_BLOCK = 4       # at least, of the slowest signal
BLOCKS_OF_AN_EDGE = 4        # of the quickest; each part sees some of it
TEST_BLOCK_S = 0.5           # of the paired tests between rivals
OWN_PROOF = (FIT, SELECT, FIT, SELECT, CERTIFY)
OTHER_PROOF = (FIT, SELECT)
SETTLE_S = 0.3               # the inner states of the start are not known
GRID_S = 0.05                # numerics: of the path on which moves are sought
LEAST_MOVE = 0.05            # numerics: of the range; what moves less to and fro rests


@dataclass(frozen=True)
class Split:
    """
    How the samples of a recording are dealt out.

    Parameters
    ----------
    block_s : float
        Length of a time block.
    pattern : tuple of int
        Parts of the blocks in turn.
    test_block_s : float
        Length of a block of the paired tests between rivals.
    settle_s, pressure_settle_s : float
        What is unused at the start, of other signals and of the pressure.
    is_short : bool
        Whether the blocks are stretches of an edge, because the moves are few.

    """

    block_s: float
    pattern: tuple[int, ...]
    test_block_s: float = TEST_BLOCK_S
    settle_s: float = SETTLE_S
    pressure_settle_s: float = SETTLE_S
    is_short: bool = False

    def part_of(self, time_s: FloatArray, signal: str = '') -> IntArray:
        """
        Return the part of every sample.

        Parameters
        ----------
        time_s : numpy.ndarray, shape (N,)
            Seconds since the start of the recording.
        signal : str
            Of which signal.

        Returns
        -------
        numpy.ndarray of int, shape (N,)
            ``FIT``, ``SELECT``, ``CERTIFY``, or ``UNUSED`` while the start settles.

        """
        time_s = np.asarray(time_s)
        part = np.array(self.pattern)[(time_s // self.block_s).astype(int) % len(self.pattern)]
        return np.where(time_s < self.unused_s(signal), UNUSED, part)

    def unused_s(self, signal: str) -> float:
        """Return for how long after the start a signal is unused [s]."""
        return self.pressure_settle_s if signal == 'pressure' else self.settle_s


def long_split(duration_s: float, holds_certify: bool = True) -> Split:
    """
    Return the Split of a recording that moves in all of its blocks.

    Parameters
    ----------
    duration_s : float
        Length of the recording.
    holds_certify : bool
        Whether this recording also holds the certify part.

    """
    return Split(min(BLOCK_S, duration_s / (2 * len(OWN_PROOF))),
                 OWN_PROOF if holds_certify else OTHER_PROOF)


def split_of(recording: Recording, holds_certify: bool = True, criteria: Criteria = CRITERIA
             ) -> Split:
    """
    Return the Split of a recording: blocks of seconds, or of stretches where moves are few.

    Parameters
    ----------
    recording : Recording
        Its pressure tells the moves.
    holds_certify : bool
        As of ``long_split``.
    criteria : Criteria
        Decision thresholds.

    """
    split = replace(long_split(float(recording.grid_s[-1]), holds_certify),
                    pressure_settle_s=settling_s(recording, 'pressure'))
    if not has_few_moves(recording, split, criteria):
        return split
    block_s = float(np.clip(_quickest_edge_s(recording) / BLOCKS_OF_AN_EDGE, *SHORT_BLOCK_S))
    period_s = max(float(np.median(np.diff(t))) for t in recording.time_s.values())
    block_s = max(block_s, SAMPLES_OF_A_BLOCK * period_s)
    if block_s >= split.block_s:         # a slow log
        return split
    # A rig at rest has no inner state that is not known.
    settle_s = 0.0 if _starts_at_rest(recording) else SETTLE_S
    return Split(block_s, split.pattern, block_s, settle_s,
                 min(settle_s, split.pressure_settle_s), True)


def settling_s(recording: Recording, signal: str) -> float:
    """
    Return for how long after the start a signal of a long recording is not compared [s].

    So long the inner states are not known. A valve has none of these where the rig rests at first,
    or where an empty muscle is filled. If the pressure moves soon, it is compared from the start
    there. Of a slow log nobody knows what the valve was told before the first message.

    Parameters
    ----------
    recording : Recording
        What was recorded.
    signal : str
        Which of its signals.

    """
    if signal != 'pressure' or recording.unseen_s > 0.0:
        return SETTLE_S
    time_s, mean = _path(recording)
    early = mean[time_s < SETTLE_S]
    if early.size == 0 or np.ptp(early) < LEAST_MOVE * float(np.ptp(mean)):
        return SETTLE_S
    filled = recording.starts_empty and not recording.moves_at_start('contraction')
    return 0.0 if filled or _starts_at_rest(recording) else SETTLE_S


def has_few_moves(recording: Recording, split: Split, criteria: Criteria = CRITERIA) -> bool:
    """
    Return whether a part lacks moves of the pressure, up or down, that the recording has.

    That is, it holds less than ``close_share`` of what its time would make of them.
    """
    time_s, mean = _path(recording)
    part = split.part_of(time_s, 'pressure')[1:]
    steps = np.diff(_without_rest(mean, LEAST_MOVE * float(np.ptp(mean))))
    for moved in (np.maximum(steps, 0.0), np.maximum(-steps, 0.0)):
        for one in set(split.pattern):
            fair = split.pattern.count(one) / len(split.pattern) * float(moved.sum())
            if float(moved[part == one].sum()) < criteria.close_share * fair:
                return True
    return False


def _path(recording: Recording) -> tuple[FloatArray, FloatArray]:
    """Return (instants [s], means of the pressure [Pa]) over short spans."""
    time_s, value = recording.time_s['pressure'], recording.measured['pressure']
    place = (time_s // GRID_S).astype(int)
    count = np.bincount(place)
    there = count > 0
    return ((np.flatnonzero(there) + 0.5) * GRID_S,
            np.bincount(place, value)[there] / count[there])


def _quickest_edge_s(recording: Recording) -> float:
    """Return how long the pressure would take for its range at its highest rate."""
    time_s, mean = _path(recording)
    return float(np.ptp(mean) / max(np.max(np.abs(np.gradient(mean, time_s))), 1e-9))


def _without_rest(values: FloatArray, width: float) -> FloatArray:
    """Return a path that follows a signal within ``width``, so that noise moves nothing."""
    found, at = np.empty(values.size), float(values[0])
    for i, value in enumerate(values):
        at = min(max(at, value - width), value + width)
        found[i] = at
    return found


def _starts_at_rest(recording: Recording) -> bool:
    """Return whether no signal moves during the first moments."""
    return not any(recording.moves_at_start(s) for s in recording.measured
                   if np.sum(recording.time_s[s] <= START_S) > 0)

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
Jumps of a valve signal at instants that a slow log does not show.

A slow log tells what the valve signal was at the instants of its messages. A jump between two of
them may have come at any time. The pressure after it is then off by as much as the jump moved it
meanwhile, the same way in all samples until the response is over. Such errors are noise with a
memory. Here they get the weight that this noise leaves them: errors are multiplied by the inverse
Cholesky factor of their covariance, which leaves them white. How the response begins depends on
the dead time and the lag of the model that is tried, and with it the covariance.

A signal that changes evenly jumps nowhere; that all of it is late is the latency of the recording.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.gap.data.jumps import jump_shares
from pam_sim.gap.data.recording import GRID_S

WINDOW_S = 0.5               # after a jump, when the response of a valve is over
INSTANTS = 8                 # at which a jump is tried, evenly over the time it was not seen
LEAST_FLOORS = 0.1           # of a jump's response, below which it is left out
STEP_S = 0.005               # between dead times and lags for which the covariance is found
LEAD_STEPS = 10              # of the grid by which a message is moved
KEPT = 32                    # covariances, and factors of them
Simulated = Callable[[FloatArray | None], FloatArray]


class UnseenJumps:
    """
    What unseen instants of jumps do to the errors of one recording, in its noise floor.

    Parameters
    ----------
    stamps_s : numpy.ndarray, shape (M,)
        Instants of the messages of the valve signal [s], rising.
    signal : numpy.ndarray, shape (M,)
        Their values.
    earliest_s, latest_s : float
        Between which instants a jump acts, after its message and without a dead time [s].
    time_s : numpy.ndarray, shape (N,)
        Instants of the samples [s], rising.
    simulated : callable
        Returns the response in noise floors on the grid, with the messages moved by so much [s],
        or where they are.

    """

    def __init__(self, stamps_s: FloatArray, signal: FloatArray, earliest_s: float,
                 latest_s: float, time_s: FloatArray, simulated: Simulated) -> None:
        self._time_s = time_s
        self._late_s = np.linspace(earliest_s, latest_s, INSTANTS)
        found = _responses(stamps_s, jump_shares(signal), simulated)
        self._stamps_s = [stamp_s for stamp_s, _ in found]
        self._responses = np.array([response for _, response in found]).reshape(
            len(found), int(WINDOW_S / GRID_S))
        self._window = int(np.ceil((WINDOW_S + latest_s - earliest_s) / np.median(
            np.diff(time_s)))) + 2
        self._covariance = lru_cache(maxsize=KEPT)(self._covariance_at)
        self._factor = lru_cache(maxsize=KEPT)(self._factor_at)

    def whitened(self, errors: FloatArray, delay_s: float = 0.0, lag_s: float = 0.0
                 ) -> FloatArray:
        """
        Return errors in floors, shape (N,), less what those before foretell of them.

        ``delay_s`` and ``lag_s`` are those of the model that left them, beyond the given one's.
        """
        from scipy.linalg.lapack import dtbtrs       # slow to import
        found, _ = dtbtrs(self._factor(delay_s, lag_s), errors[:, np.newaxis], uplo=b'L')
        return found[:, 0]

    def _factor_at(self, delay_s: float, lag_s: float) -> FloatArray:
        """Return the Cholesky factor of the covariance, lower diagonals in rows."""
        from scipy.linalg import cholesky_banded       # slow to import
        delay, lag = delay_s / STEP_S, lag_s / STEP_S
        covariance: FloatArray = np.zeros((self._window, self._time_s.size))
        covariance[0] = 1.0
        # Between the steps it changes evenly, so that a fit finds its way.
        for i in (int(delay), int(delay) + 1):
            for j in (int(lag), int(lag) + 1):
                share = max(1.0 - abs(delay - i), 0.0) * max(1.0 - abs(lag - j), 0.0)
                if share > 0.0:
                    covariance += share * self._covariance(i, j)
        return cholesky_banded(covariance, lower=True)

    def _covariance_at(self, delay_steps: int, lag_steps: int) -> FloatArray:
        """Return what jumps add to the covariance, lower diagonals in rows."""
        found = np.zeros((self._window, self._time_s.size))
        for stamp_s, response in zip(self._stamps_s, lagged(
                self._responses, lag_steps * STEP_S)):
            acts_s = stamp_s + delay_steps * STEP_S + self._late_s
            first, last = np.searchsorted(self._time_s, (acts_s[0], acts_s[-1] + WINDOW_S))
            last = min(last, first + self._window)
            after = (self._time_s[first:last] - acts_s[:, np.newaxis]) / GRID_S
            g = np.interp(after, np.arange(response.size), response, left=0.0)
            g -= g.mean(axis=0)
            square = g.T @ g / INSTANTS
            for k in range(last - first):
                found[k, first:last - k] += np.diagonal(square, -k)
        return found


def lagged(responses: FloatArray, lag_s: float) -> FloatArray:
    """Return responses on the grid, one in each row, behind a further lag."""
    from scipy.signal import lfilter       # slow to import
    keep = np.exp(-GRID_S / lag_s) if lag_s > 0.0 else 0.0
    return lfilter([1.0 - keep], [1.0, -keep], responses, axis=1) if keep else responses


def _responses(stamps_s: FloatArray, share: FloatArray, simulated: Simulated
               ) -> list[tuple[float, FloatArray]]:
    """
    Return (stamp, response to the jump of a message on the grid) of all that are felt.

    Messages far from one another are moved in one simulation. Moved by a time, a message changes
    the response by that of a jump less that of the same jump later.
    """
    base = simulated(None)
    found: list[tuple[float, FloatArray]] = []
    lead, count = LEAD_STEPS, int(WINDOW_S / GRID_S)
    for members in _groups(stamps_s, share):
        moved = np.zeros(stamps_s.size)
        moved[members] = -lead * GRID_S
        change = simulated(moved) - base
        for j in members:
            first = int(round(stamps_s[j] / GRID_S)) - lead
            piece = share[j] * change[max(first, 0):first + count]
            response = np.zeros(count)
            for k in range(0, piece.size, lead):
                earlier = response[k - lead:k] if k else np.zeros(lead)
                part = piece[k:k + lead]
                response[k:k + part.size] = earlier[:part.size] + part
            response[piece.size:] = response[max(piece.size - 1, 0)]
            if first >= 0 and float(np.max(np.abs(response))) > LEAST_FLOORS:
                found.append((float(stamps_s[j]), response))
    return found


def _groups(stamps_s: FloatArray, share: FloatArray) -> list[IntArray]:
    """Return messages that jump, in groups in which each is far from the next."""
    groups: list[list[int]] = []
    apart_s = WINDOW_S + 2.0 * LEAD_STEPS * GRID_S
    for j in np.flatnonzero(share > 0.0):
        for group in groups:
            if stamps_s[j] - stamps_s[group[-1]] >= apart_s:
                group.append(int(j))
                break
        else:
            groups.append([int(j)])
    return [np.array(group) for group in groups]

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

"""Where a signal that comes at a steady rate is silent for long."""

import numpy as np
from pam_sim.annotations import IntArray
from pam_sim.units import NS_PER_S

LEAST_SILENT_S, LEAST_PERIODS = 1.0, 20         # both, of a long silence
STEADY_SHARE, STEADY_FACTOR = 0.9, 2.5          # so many periods are near the usual one
FEWEST_MESSAGES = 20


def most_held_ns(stamp_ns: IntArray) -> float:
    """
    Return how long after a message a signal is silent [ns]; infinite for one without a rate.

    Parameters
    ----------
    stamp_ns : ndarray of int64
        Stamps of the messages, in any order.

    """
    steps = np.diff(np.sort(stamp_ns)).astype(float)
    if len(stamp_ns) < FEWEST_MESSAGES:
        return np.inf
    usual_ns = float(np.median(steps))
    if not np.mean(steps <= STEADY_FACTOR * usual_ns) >= STEADY_SHARE:
        return np.inf
    return max(LEAST_SILENT_S * NS_PER_S, LEAST_PERIODS * usual_ns)


def silences(stamp_ns: IntArray, end_ns: int) -> list[tuple[int, int]]:
    """
    Return the begin and end of each long time without messages, [ns].

    A signal that comes now and then, such as a command that is sent when it changes, is never
    silent.

    Parameters
    ----------
    stamp_ns : ndarray of int64
        Stamps of the messages.
    end_ns : int
        End of the recording; a signal may end long before.

    """
    if not len(stamp_ns):
        return []
    stamps = np.sort(stamp_ns)
    ends = np.append(stamps, max(end_ns, int(stamps[-1])))
    long = np.diff(ends) > most_held_ns(stamps)
    return [(int(ends[k]), int(ends[k + 1])) for k in np.flatnonzero(long)]

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
How quickly recordings move: at one speed only, or at several.

A *stroke* is a move of the pressure between two reversals, of at least a fifth of its range.
"""

from collections.abc import Iterable

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.data.recording import Recording

STEP_S = 0.02                # numerics: of the path on which strokes are sought
LEAST_STROKE = 0.2           # numerics: of the range; smaller reversals belong to a stroke
FIRST, LAST = 0.1, 0.9       # numerics: parts of a stroke between which its speed is taken


def moves_at_one_speed(recordings: Iterable[Recording], criteria: Criteria) -> bool:
    """
    Return whether all strokes of recordings are about equally quick, without a rest.

    A rest after a stroke is a second speed: what creeps goes on there.
    """
    speeds = [speed for r in recordings
              for speed in strokes(r.time_s['pressure'], r.measured['pressure'])]
    return not speeds or max(speeds) < criteria.second_speed * min(speeds)


def strokes(time_s: FloatArray, values: FloatArray) -> list[float]:
    """
    Return the speed of every stroke [1/s times the unit]; 0.0 for a rest after one.

    A rest is a stay that lasts longer than two such strokes.

    Parameters
    ----------
    time_s, values : numpy.ndarray, shape (N,)
        A signal.

    """
    grid = np.arange(time_s[0], time_s[-1], STEP_S)
    y = np.interp(grid, time_s, values)
    ends = reversals(y, LEAST_STROKE * float(np.ptp(y)))
    found, spans = [], []
    for start, end in zip(ends, ends[1:]):
        way = np.abs(y[start:end + 1] - y[start])
        first, last = (start + int(np.argmax(way >= part * way[-1])) for part in (FIRST, LAST))
        spans.append((first, max(last, first + 1)))
        found.append(float((LAST - FIRST) * way[-1] / ((spans[-1][1] - first) * STEP_S)))
    for (first, last), (following, _) in zip(spans, [*spans[1:], (y.size, 0)]):
        if following - last > 2.0 * (last - first) / (LAST - FIRST):
            found.append(0.0)
    return found


def reversals(values: FloatArray, least: float) -> list[int]:
    """Return the places at which a signal turns back by ``least``, its first and last extreme."""
    low = high = 0
    rising: bool | None = None
    found: list[int] = []
    for place, value in enumerate(values):
        high = place if value > values[high] else high
        low = place if value < values[low] else low
        if rising is not True and value - values[low] >= least > 0.0:
            found.append(low)
            rising, high = True, place
        elif rising is not False and values[high] - value >= least > 0.0:
            found.append(high)
            rising, low = False, place
    return found if rising is None else [*found, high if rising else low]

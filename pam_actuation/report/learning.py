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


"""What a recording tells of learning: roll-backs, and where it made the tracking worse."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.report import signals
from pam_actuation.report.errors import by_part, Cycles, Signal
from pam_sim.annotations import FloatArray

if TYPE_CHECKING:
    from pam_sim.run import Run

WORSE = 1.5                  # times the best window
WINDOW = 3                   # cycles, fewer where there are fewer than twice as many
FEWEST = 4                   # cycles that tell
# How much worse it must be, by unit: more than noise of a sensor.
LEAST = {'mm': 0.05, 'N': 0.5, '°': 0.05}


def times_rolled_back(run: 'Run') -> int | None:
    """Return how often the controller took rules back that learning had spoiled, or None."""
    count = signals.series(run, 'controller_state', 'times_rolled_back')
    if count is None:
        return None
    return int(np.sum(np.maximum(np.diff(count[1]), 0.0)))      # a reset counts from 0 again


def learned_worse(run: 'Run', cycles: FloatArray, parts: Sequence[Cycles],
                  unit: str) -> tuple[str, ...]:
    """
    Return a sentence on each part of a run in which learning made the tracking worse.

    The last cycles are held against the best ones before. Nothing is said of a part at whose end
    the rules were frozen, or of a run with a disturbance.

    Parameters
    ----------
    run : pam_sim.run.Run
        The recording.
    cycles : ndarray
        RMSE of each cycle, those of the parts one after the other.
    parts : sequence of (start_s, period_s, count)
        The repeating parts.
    unit : {'mm', 'N', '°'}
        Of ``cycles``.

    """
    learning = signals.series(run, 'controller_state', 'learning')
    pushed = signals.series(run, 'external_force')
    if learning is None or pushed is not None and pushed[1].any():
        return ()
    return tuple(said for part, (hz, of_part) in zip(parts, by_part(cycles, parts))
                 if _learns_at_the_end(learning, part)
                 and (said := _sentence(of_part, f' of {hz}' if hz else '', unit)))


def _learns_at_the_end(learning: Signal, part: Cycles) -> bool:
    """Return whether the rules could change for most of the last cycle of a part."""
    # What follows the part tells nothing: without a reference no controller learns.
    (time_s, learns), (start_s, period_s, count) = learning, part
    left_s = start_s + count * period_s - time_s
    last = learns[(left_s > 0.0) & (left_s <= period_s)]
    return bool(last.size) and float(last.mean()) > 0.5


def _sentence(cycles: FloatArray, of_part: str, unit: str) -> str:
    """Return the sentence on the cycles of one part, '' where the last ones are no worse."""
    if len(cycles) < FEWEST or not np.isfinite(cycles).all():
        return ''
    count = min(WINDOW, len(cycles) // 2)
    windows = np.sqrt(np.convolve(cycles**2, np.full(count, 1.0 / count), 'valid'))
    best, last = int(np.argmin(windows)), float(windows[-1])
    if last <= WORSE * windows[best] or last - windows[best] <= LEAST[unit]:
        return ''
    return (f'the controller learned itself worse: {last:.2f} {unit} in the last {count} cycles'
            f'{of_part}, {windows[best]:.2f} {unit} in cycles {best + 1} to {best + count}; if '
            'rig and load stayed the same, tune it for this rig (pam tune --model RIG), or '
            'give its file a smaller learning_rate')

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

"""Where in its experiment a recording begins: a recorder may have been started late."""

from typing import TYPE_CHECKING

import numpy as np
from pam_sim.annotations import FloatArray

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment

EVERY_S = 0.01          # of the course that is searched; the reference is sent so often
FITS = 0.01             # of the range of the experiment, by which a reference may be off
MOST_FIT = 0.97         # of the messages: at a jump, a few are on its other side
_FEWEST, _MOST, _LONGEST_S = 20, 300, 900.0


def begun_s(experiment: 'Experiment', time_s: FloatArray, reference: FloatArray) -> float:
    """
    Return how much of an experiment was over at the first message of its reference [s].

    0 where the reference fits from its start on, or fits nowhere: then it is not that of the
    experiment. Of equal places, as in a sine, the first one counts.

    Parameters
    ----------
    experiment : Experiment
        What was asked for.
    time_s, reference : numpy.ndarray, shape (N,)
        Messages of the reference, the first one at 0 s, in the unit of the experiment.

    """
    lowest, highest = experiment.chain.extremes()
    if len(time_s) < _FEWEST or experiment.duration_s > _LONGEST_S or not highest > lowest:
        return 0.0
    chosen = np.unique(np.linspace(0, len(time_s) - 1, _MOST).astype(int))
    at_s, seen, allowed = time_s[chosen], reference[chosen], FITS * (highest - lowest)
    asked = np.array([experiment.at(t)[0] for t in at_s.tolist()])
    if np.mean(np.abs(seen - asked) <= allowed) >= MOST_FIT:
        return 0.0
    count = round(experiment.duration_s / EVERY_S) + 1
    course = np.array([experiment.at(EVERY_S * k)[0] for k in range(count)])
    steps = np.rint(at_s / EVERY_S).astype(int)
    off = np.array([np.mean(np.abs(seen - course[np.minimum(k + steps, count - 1)]))
                    for k in range(count)])
    # What lies within a tick of each other is one place.
    best = int(np.flatnonzero(off <= off.min() + 1e-9 * (highest - lowest))[0])
    there = np.abs(seen - course[np.minimum(best + steps, count - 1)])
    return EVERY_S * best if np.mean(there <= 2.0 * allowed + _moved(course)) >= MOST_FIT else 0.0


def _moved(course: FloatArray) -> float:
    """Return how far a course moves in half a tick, jumps left out."""
    return 0.5 * float(np.quantile(np.abs(np.diff(course)), 0.9))

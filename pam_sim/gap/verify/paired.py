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

"""Whether the certify data tell two fits apart, whatever stamps, start and numbers may do."""

from collections.abc import Mapping
import math

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.verify.notice import stamp_sd_s
from pam_sim.gap.verify.spread import SMALL_STEP
from pam_sim.gap.verify.validation import Validation


class PairedProof:
    """
    The best name of a set against others, on the certify data.

    Parameters
    ----------
    validation : Validation
        Has the recording.
    estimator : Estimator
        That the names were fitted to.
    best : Fit
        The fit of the best name.
    run : dict of str -> numpy.ndarray
        Its free run.
    whole : bool
        As of the Validation.

    """

    def __init__(self, validation: Validation, estimator: Estimator, best: Fit,
                 run: Mapping[str, FloatArray], whole: bool) -> None:
        self._validation, self._criteria, self._run = validation, estimator.criteria, run
        # Both runs have the same stamps, and these tell by how much they scatter.
        self._drift = validation.drift_with(stamp_sd_s(validation.recording))
        self._covariances, at = estimator.spread(best)
        self._changes = []
        for j, step in enumerate(SMALL_STEP * np.sqrt(np.diag(self._covariances[0]))):
            moved = validation.run(at(j, step), whole)
            validation.simulations += 1
            self._changes.append({s: (moved[s] - run[s]) / step for s in run})

    def contradicts(self, run: Mapping[str, FloatArray], behind_t: float) -> bool:
        """
        Return whether a run is not that of the true model, by searched and certify data together.

        Parameters
        ----------
        run : dict of str -> numpy.ndarray
            Free run of another name.
        behind_t : float
            By how many deviations the searched data leave it behind the best one.

        """
        criteria, (rise, apart) = self._criteria, self._validation.fall(run, self._run)
        # Where the best one is true the rise is 1; where the other one is, -1.
        if rise <= 0.0 or apart <= criteria.found_again_sd:
            return False
        against = (rise + 1.0) / max(self.doubt(run), 1e-12)
        # Both tell it by themselves: two normal deviations (Stouffer 1949).
        return (against > criteria.hint_sd
                and (against + behind_t) / math.sqrt(2.0) > criteria.certain_sd)

    def doubt(self, run: Mapping[str, FloatArray]) -> float:
        """Return the standard deviation of the rise by stamps, the start and the numbers."""
        _, apart = self._validation.fall(run, self._run)
        if apart <= 0.0:
            return 0.0
        by_number = np.array([
            self._validation.product(change, run, self._run) for change in self._changes])
        variance = max(float(by_number @ c @ by_number) for c in self._covariances)
        return math.hypot(self._validation.doubt(run, self._run, self._drift),
                          math.sqrt(max(variance, 0.0)) / apart ** 2)

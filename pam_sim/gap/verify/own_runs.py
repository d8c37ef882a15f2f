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
Each subsystem on its own measured inputs, on data that neither fit nor ranking has seen.

In a run of the whole chain, an error of the valve reaches the muscle. Here the valve gets the
measured contraction, and muscle and load the measured pressure. What a subsystem misses is then
its own.
"""

from collections.abc import Mapping
import math

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.gap.data.signals import UNIT
from pam_sim.gap.data.split import CERTIFY, settling_s
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.result import SignalGap
from pam_sim.gap.subsystems.known import SKEW_MAX_S
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.gap.verify.spread import spread_of_runs
from pam_sim.gap.verify.validation import Validation
from pam_sim.rig import Rig


class OwnRuns:
    """
    Runs of the subsystems on the certify data, each on its own measured inputs.

    Parameters
    ----------
    validation : Validation
        With the recording, the calibrated and the final model.

    Attributes
    ----------
    validation : Validation
        As given.
    gaps : dict of str -> dict of str -> SignalGap
        By subsystem (``valve``, ``muscle``: muscle and load) and signal.

    """

    def __init__(self, validation: Validation) -> None:
        self.validation = validation
        self._whole, self._estimator = validation.whole, validation.estimator
        self._settle_s = {s: settling_s(validation.recording, s)
                          for s in validation.recording.signals}
        self._problems = subsystem_problems(
            self._estimator.rig, [validation.recording], 0, validation.seed,
            self._estimator.criteria) if self._whole else self._estimator.problems
        before, refit, after = (
            self._given(), self._errors(validation.base), self._errors(validation.final))
        self._refit, self._after = refit, after
        self.gaps = {p.subsystem: {s: SignalGap(
            UNIT[s], p.floor[s], *(_rms(errors[p.subsystem, s]) for errors in (
                before, refit, after))) for s in p.signals} for p in self._problems}

    @property
    def simulations(self) -> int:
        """Return how many simulations were asked for here."""
        return sum(p.asked for p in self._problems) if self._whole else 0

    def spread(self) -> dict[tuple[str, str], float]:
        """Return the rms by which the final model may be off by its numbers alone."""
        return spread_of_runs(
            self._estimator.spread(self.validation.final), self._errors, self._after)

    def searched(self, subsystem: str, signal: str) -> float:
        """Return the rms [SI] that the final model leaves of a signal in the searched data."""
        p = next(p for p in self._estimator.problems if p.subsystem == subsystem)
        if signal not in p.signals:
            return 0.0
        chosen = np.isin(p.part, self._estimator.use) & (p.signal == p.signals.index(signal))
        return _rms(self.validation.final.errors[subsystem][chosen]) * p.floor[signal]

    def residual(self, subsystem: str, signal: str) -> tuple[FloatArray, FloatArray]:
        """Return (instants [s], errors of the calibrated model, SI) on the certify data."""
        p = next(p for p in self._problems if p.subsystem == subsystem)
        return p.time_s[self.chosen(p, signal)], self._refit[subsystem, signal]

    def fall(self, subsystem: str, worse: Fit, better: Fit) -> tuple[float, float, float]:
        """
        Return by how much the squared errors of a subsystem fall from one fit to another.

        In what the two are apart, squared, as of ``Validation.fall``; how far they are apart
        (rms, in floors); and the standard deviation of the fall by noise.
        """
        place = next(i for i, p in enumerate(self._problems) if p.subsystem == subsystem)
        first, last = (p.errors(rig, known)[np.logical_or.reduce(
            [self.chosen(p, s) for s in p.signals])] for p, rig, known in (
            self.at(found)[place] for found in (worse, better)))
        apart = _rms(first - last)
        if apart <= 0.0:
            return 1.0, 0.0, 0.0
        fell = float(np.mean(first ** 2 - last ** 2)) / apart ** 2
        return fell, apart, 2.0 / (apart * math.sqrt(first.size))

    def _given(self) -> dict[tuple[str, str], FloatArray]:
        """Return the errors of the given model, by subsystem and signal."""
        found = {}
        for p in self._problems:
            found.update(self._cut(p, p.errors(self._estimator.rig, np.zeros(len(p.known)))))
        return found

    def _errors(self, found: Fit) -> dict[tuple[str, str], FloatArray]:
        """Return the errors of a fit, by subsystem and signal."""
        parts = {}
        for p, rig, known in self.at(found):
            parts.update(self._cut(p, p.errors(rig, known)))
        return parts

    def at(self, found: Fit) -> list[tuple[SubsystemProblem, Rig, FloatArray]]:
        """Return (problem of the certify data, rig, its normalised known numbers) of a fit."""
        rig = self._estimator.with_effects(found.settings())
        z = {k.name: float(z) for p in self._estimator.problems
             for k, z in zip(p.known, found.known_z[p.subsystem])}
        if self._whole:          # a closed volume keeps the error of its start: another one here
            z['start_error'] = 0.0
        return [(p, rig, np.array([z.get(k.name, 0.0) for k in p.known])) for p in self._problems]

    def chosen(self, p: SubsystemProblem, signal: str) -> BoolArray:
        """Return which samples are those of a signal on the certify data."""
        part = (p.run == 0) & (p.time_s > self._settle_s[signal] if self._whole
                               else p.part == CERTIFY)
        return part & (p.signal == p.signals.index(signal)) & p.recordings[0].tells(
            signal, p.time_s)

    def _cut(self, p: SubsystemProblem, errors: FloatArray
             ) -> dict[tuple[str, str], FloatArray]:
        """Return the errors on the certify data in SI units, by subsystem and signal."""
        found = {}
        for s in p.signals:
            chosen = self.chosen(p, s)
            error = errors[chosen] * p.floor[s]
            if self._whole and p.subsystem != 'valve':
                error = _aligned(error, p.time_s[chosen], p.measured[chosen])
            found[p.subsystem, s] = error
        return found


def _aligned(error: FloatArray, time_s: FloatArray, measured: FloatArray) -> FloatArray:
    """Return an error less what a skew of this recording explains, as in the Validation."""
    slope = np.gradient(measured + error, time_s)
    square = float(np.sum(slope ** 2))
    late_s = float(np.sum(slope * error)) / square if square > 0.0 else 0.0
    return error - min(max(late_s, -SKEW_MAX_S), SKEW_MAX_S) * slope


def _rms(errors: FloatArray) -> float:
    return float(np.sqrt(np.mean(errors ** 2)))


def largest(gaps: Mapping[str, SignalGap]) -> str:
    """Return the signal whose gap after calibration stands out most from its noise floor."""
    return max(gaps, key=lambda s: max(gaps[s].rmse_refit, gaps[s].rmse_after) / max(
        gaps[s].noise_floor, 1e-12))

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
The validation: whole-chain free runs on data that neither fit nor ranking has seen.

The given model, the same with its numbers calibrated, and the final one run on the
recorded valve signal alone, or, where nobody recorded it, on the measured pressure.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
import math

import numpy as np
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.gap.data.noise import (
    autocorrelation_time, Noise, noise_of, sensor_floor, STAMP_SD_S)
from pam_sim.gap.data.recording import Recording, START_S
from pam_sim.gap.data.signals import UNIT
from pam_sim.gap.data.split import CERTIFY, settling_s, split_of
from pam_sim.gap.data.supply import DRIFT_SD
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.result import SignalGap, Trace
from pam_sim.gap.subsystems.known import SKEW_MAX_S
from pam_sim.gap.subsystems.simulation import free_run
from pam_sim.gap.verify.materiality import moved
from pam_sim.gap.verify.model import free_run_of, late_by, numbers_of

INPUT_DRAWS = 8
RARE_DRAWS = 40              # one in so many is rarer than what probably differs (`likely_sd`)
MEDIAN_SD = 1.25             # of a median of normal values over that of their mean


def start_error_sd(recording: Recording) -> float:
    """Return the standard deviation [Pa] of the pressure that a free run starts from."""
    time_s = recording.time_s['pressure']
    noise = noise_of(time_s, recording.measured['pressure'])
    white = MEDIAN_SD * noise.white_sd / np.sqrt(max(np.sum(time_s <= START_S), 1))
    return float(np.hypot(white, noise.slow_sd * min(1.0, np.sqrt(
        2.0 * noise.memory_s / START_S))))


def share_left(gaps: Iterable[SignalGap], floor_error: float) -> float:
    """
    Return the share of squared gaps after calibration that the final model leaves, at most 1.

    In floors squared; signals within the error of the floor do not count.
    """
    before = after = 0.0
    for s in gaps:
        if max(s.rmse_refit, s.rmse_after) > floor_error * s.noise_floor:
            before += max(s.rmse_refit ** 2 / s.noise_floor ** 2 - 1.0, 0.0)
            after += max(s.rmse_after ** 2 / s.noise_floor ** 2 - 1.0, 0.0)
    return min(after / before, 1.0) if before > 0.0 else 0.0


class Validation:
    """
    Free runs of a model before and after on one recording.

    Parameters
    ----------
    recording : Recording
        The recording the validation is made on.
    whole : bool
        All of it is the certify part; otherwise its certify blocks.
    estimator : Estimator
        With the given model.
    base, final : Fit
        Numbers calibrated alone, and the final model.
    seed : int
        Of the draws that carry stamp errors of the valve signal, and the error of the pressure
        that a run of its own starts from, into the floor; or the noise of a pressure that is
        given.

    Attributes
    ----------
    recording, whole, estimator, base, final, seed
        As given.

    """

    def __init__(self, recording: Recording, whole: bool, estimator: Estimator, base: Fit,
                 final: Fit, seed: int = 0) -> None:
        self.recording, self.whole, self.estimator = recording, whole, estimator
        self.base, self.final, self.seed = base, final, seed
        split = split_of(recording, criteria=estimator.criteria)
        self.part = {s: recording.tells(s, recording.time_s[s]) & (
            recording.time_s[s] > settling_s(recording, s) if whole else
            split.part_of(recording.time_s[s], s) == CERTIFY) for s in recording.signals}
        self.before = free_run(estimator.rig, recording)
        self.refit, self.after = self.run(base), self.run(final)
        self.simulations = 3
        seen = {s: noise_of(recording.time_s[s], recording.measured[s]) for s in recording.signals}
        # It is the same sensor, and a recording without rest hides its slow noise.
        self._slow = {s: 0.0 if seen[s].slow_sd > 0.0 else self._slow_elsewhere(s) for s in seen}
        self.noise = {s: float(np.hypot(seen[s].sd, self._slow[s])) for s in seen}
        self._random = np.random.default_rng(seed)
        self.drift = self._drift(INPUT_DRAWS)
        # A valve that adds up its errors drifts: one run may be off by far more than the mean.
        self.floor, self.highest_floor = self._floors(self.drift)

    def of(self, final: Fit, base: Fit | None = None, estimator: Estimator | None = None
           ) -> 'Validation':
        """Return that of another final model, and of another calibrated one, if one is given."""
        return Validation(self.recording, self.whole, estimator or self.estimator,
                          base or self.base, final, self.seed)

    def run(self, found: Fit, stamp_shift_s: FloatArray | None = None,
            start_error_pa: float = 0.0, pressure_noise_pa: float | FloatArray = 0.0
            ) -> dict[str, FloatArray]:
        """Return the free run of a fit at the stamps, by signal."""
        _, measurement = numbers_of(self.estimator, found)
        start = start_error_pa if self.whole else measurement.get('start_error', 0.0)
        run = free_run_of(self.estimator, found, self.recording, start, stamp_shift_s,
                          pressure_noise_pa)
        return self._aligned(run, late_by(measurement)) if self.whole else run

    def _aligned(self, run: Mapping[str, FloatArray], late_s: Mapping[str, float]
                 ) -> dict[str, FloatArray]:
        """
        Return a run with the skew that this recording, which was not fitted, has itself.

        It is no part of the model. In a fast motion, a fraction of a millisecond moves a signal by
        more than an effect does. The bounds are those of the fit.
        """
        aligned = dict(run)
        for s, late in late_s.items():
            if s not in run:
                continue
            chosen = self.part[s]
            slope = np.gradient(run[s], self.recording.time_s[s])
            wrong = run[s][chosen] - self.recording.measured[s][chosen]
            square = float(np.sum(slope[chosen] ** 2))
            shift_s = float(np.sum(slope[chosen] * wrong)) / square if square > 0.0 else 0.0
            most_s = SKEW_MAX_S * (2.0 if s == 'force' else 1.0)
            shift_s = min(max(late + shift_s, -most_s), most_s) - late
            aligned[s] = run[s] - shift_s * slope
        return aligned

    def signals(self) -> dict[str, SignalGap]:
        """Return the SignalGap of every signal."""
        return {s: SignalGap(UNIT[s], self.floor[s], self._rms(self.before, s),
                             self._rms(self.refit, s), self._rms(self.after, s))
                for s in self.recording.signals}

    def traces(self) -> dict[str, Trace]:
        """Return the Trace of every signal."""
        r = self.recording
        return {s: Trace(r.stamp_ns[s], r.measured[s], self.before[s], self.refit[s],
                         self.after[s]) for s in r.signals}

    def inputs(self) -> dict[str, tuple[IntArray, FloatArray]]:
        """Return stamps [ns] and values of the measured signals that drive the model."""
        r = self.recording
        return {s: (stamp_ns, r.measured[s]) for s, stamp_ns in r.stamp_ns.items()
                if s not in r.signals}

    def floor_with(self, stamp_sd_s: float) -> dict[str, float]:
        """Return the noise floors where the stamps scatter by so much [s], by signal."""
        less = 1.0 - min(stamp_sd_s / STAMP_SD_S, 1.0) ** 2
        return {s: math.sqrt(max(self.floor[s] ** 2 - less * float(np.mean(
            [np.mean(d[s] ** 2) for d in self.drift])), 0.0)) for s in self.floor}

    def moved(self, found: Fit) -> dict[str, float]:
        """Return by signal how far the final model moves it from a fit's, in sensor noise."""
        return moved(self.recording, self.after, self.run(found), self.part)

    def fall(self, worse: Mapping[str, FloatArray], better: Mapping[str, FloatArray]
             ) -> tuple[float, float]:
        """
        Return by how much the squared errors fall from one free run to another.

        In what the two are apart, squared; all signals in deviations of their sensors. 1 for a
        true effect, -1 for one that is not there, whatever the noise: the errors of the true
        model have nothing in common with either. And how far the two are apart (rms).
        """
        fell = apart = 0.0
        for s in self.recording.signals:
            chosen, variance = self.part[s], max(self.noise[s], 1e-12) ** 2
            first, last = (r[s][chosen] - self.recording.measured[s][chosen]
                           for r in (worse, better))
            fell += float(np.mean(first ** 2 - last ** 2)) / variance
            apart += float(np.mean((first - last) ** 2)) / variance
        return (fell / apart, math.sqrt(apart)) if apart > 0.0 else (1.0, 0.0)

    def doubt(self, worse: Mapping[str, FloatArray], better: Mapping[str, FloatArray]) -> float:
        """Return the standard deviation of ``fall`` by stamps and the start of this recording."""
        _, apart = self.fall(worse, better)
        by_draw = np.zeros(len(self.drift))
        for s in self.recording.signals:
            chosen, variance = self.part[s], max(self.noise[s], 1e-12) ** 2
            between = (worse[s] - better[s])[chosen]
            by_draw += [2.0 * float(np.mean(d[s][chosen] * between)) / variance
                        for d in self.drift]
        return float(np.sqrt(np.mean(by_draw ** 2))) / apart ** 2 if apart > 0.0 else 0.0

    def finds_again(self) -> bool:
        """
        Return whether the errors fall with the final model as they do for true effects.

        And by more than they may where none is there, a fall of -1, by stamps and the start.
        """
        criteria, (fell, _) = self.estimator.criteria, self.fall(self.refit, self.after)
        return fell > criteria.greater_part and (
            fell + 1.0 > criteria.certain_sd * self.doubt(self.refit, self.after))

    def worse(self) -> list[str]:
        """
        Return the signals of which the final model leaves more than the calibrated one.

        Beyond the error of the floor, by one deviation of the sensor, and by more than noise,
        stamps and the start of this recording may raise the squared errors. Where both models
        leave a gap, one is now the better, now the other: the mean rise has a doubt by that too.
        """
        found, criteria = [], self.estimator.criteria
        for s, gap in self.signals().items():
            chosen, measured = self.part[s], self.recording.measured[s]
            refit, after = ((r[s] - measured)[chosen] for r in (self.refit, self.after))
            change, between = after ** 2 - refit ** 2, after - refit
            by_place = float(np.std(change)) * math.sqrt(
                autocorrelation_time(change) / change.size)
            by_draw = [2.0 * float(np.mean(d[s][chosen] * between)) for d in self.drift]
            doubt = math.hypot(float(np.sqrt(np.mean(np.square(by_draw)))), 2.0 * self.noise[
                s] * float(np.sqrt(np.mean(between ** 2))) / math.sqrt(between.size))
            rise = gap.rmse_after ** 2 - gap.rmse_refit ** 2
            if (gap.rmse_after > criteria.floor_error * self.highest_floor[s]
                    and rise > max(criteria.certain_sd * doubt, criteria.hint_sd * by_place,
                                   (criteria.hint_sd * self.noise[s]) ** 2)):
                found.append(s)
        return found

    @cached_property
    def rare_floor(self) -> dict[str, float]:
        """The noise floors with the furthest drift of ``RARE_DRAWS``, by signal."""
        return self._floors([*self.drift, *self._drift(RARE_DRAWS - INPUT_DRAWS)])[1]

    def left(self) -> float:
        """Return what the final model leaves beyond the floor (rms), as of ``fall``."""
        return math.sqrt(sum(
            max(self._rms(self.after, s) ** 2 - self.floor[s] ** 2, 0.0) / max(
                self.noise[s], 1e-12) ** 2 for s in self.recording.signals))

    def unexplained(self) -> float:
        """
        Return the share of the squared gap left after calibration that is still there.

        Of signals that show one: where both are within the error of the floor, nothing is said.
        """
        return share_left(self.signals().values(), self.estimator.criteria.floor_error)

    def _rms(self, simulated: Mapping[str, FloatArray], signal: str) -> float:
        error = (simulated[signal] - self.recording.measured[signal])[self.part[signal]]
        return float(np.sqrt(np.mean(error ** 2)))

    def _drift(self, draws: int) -> list[dict[str, FloatArray]]:
        """Return by signal, for further draws, how far errors of the input move the final run."""
        random, r = self._random, self.recording
        found: list[dict[str, FloatArray]] = []
        start_sd = start_error_sd(r)
        noise = self._pressure_noise() if r.pressure_given else None
        for _ in range(draws):
            if noise is not None:
                drift_pa = DRIFT_SD * noise.sd * random.standard_normal()
                moved = self.run(self.final, pressure_noise_pa=drift_pa + noise.draw(
                    r.time_s['pressure'], random))
            else:
                shift = r.stamp_sd_s(STAMP_SD_S) * random.standard_normal(r.messages)
                moved = self.run(self.final, shift, start_sd * random.standard_normal())
            self.simulations += 1
            found.append({s: moved[s] - self.after[s] for s in r.signals})
        return found

    def _pressure_noise(self) -> Noise:
        """Return the noise of the pressure, its slow part from where the sensor shows one."""
        own, *others = (noise_of(o.time_s['pressure'], o.measured['pressure']) for o in (
            self.recording, *self.estimator.problems[0].recordings))
        slow = max(others, key=lambda noise: noise.slow_sd)
        return own if own.slow_sd > 0.0 else replace(
            own, slow_sd=slow.slow_sd, memory_s=slow.memory_s)

    def _floors(self, drift: Sequence[Mapping[str, FloatArray]]) -> list[dict[str, float]]:
        r = self.recording
        squares = {s: [float(np.mean(d[s] ** 2)) for d in drift] for s in r.signals}
        return [{s: sensor_floor(r.time_s[s], r.measured[s], s,
                                 float(np.sqrt(of(squares[s]) + self._slow[s] ** 2)))
                 for s in r.signals} for of in (np.mean, np.max)]

    def _slow_elsewhere(self, signal: str) -> float:
        """Return the slow noise that the fitted recordings show at rest, 0.0 if none does."""
        recordings = self.estimator.problems[0].recordings
        return max((noise_of(o.time_s[signal], o.measured[signal]).slow_sd
                    for o in recordings if signal in o.signals), default=0.0)

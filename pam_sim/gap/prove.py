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
The proof: whole-chain free runs on data that neither fit nor choice has seen.

The given model, the same with its numbers calibrated, and the final one run on the
recorded valve signal alone.
"""

from dataclasses import replace
import math

import numpy as np
from pam_sim.gap.cuts import SKEW_MAX_S
from pam_sim.gap.free_run import free_run, START_S
from pam_sim.gap.hypothesis import Hypothesis
from pam_sim.gap.noise import noise_of, sensor_floor, STAMP_SD_S
from pam_sim.gap.parts import CERTIFY, part_of, SETTLE_S
from pam_sim.gap.result import SignalGap, Trace, UNIT

INPUT_DRAWS = 8
FLOOR_ERROR = 1.2            # how far a noise floor may be too low
VISIBLE = 0.3                # standard deviations of a sensor; less cannot be told from none
FOUND_AGAIN = 0.1            # where the certify data tell it from none all the same
MEDIAN_SD = 1.25             # of a median of normal values over that of their mean


def numbers_of(problem, found):
    """Return (numbers of the rig, numbers of the measurement) of a fit, name -> value."""
    rig, measurement = {}, {}
    for cut in problem.cuts:
        for known, z in zip(cut.known, found.known_z[cut.subsystem]):
            (rig if known.of_rig else measurement)[known.name] = known.value + known.sd * float(z)
    return rig, measurement


def model_of(problem, found):
    """Return the rig of a fit: numbers calibrated, effects added."""
    numbers, _ = numbers_of(problem, found)
    return problem.with_effects(found.settings()).with_(parameters=numbers)


def held_without(found, kept=()):
    """Return a fit less its effects but those of the names ``kept``; all numbers as they are."""
    h = found.hypothesis
    places = [i for i, c in enumerate(h.effects) if c.name in kept]
    return replace(found, hypothesis=Hypothesis(tuple(h.effects[i] for i in places), h.freed),
                   theta=np.concatenate([np.zeros(0), *(found.theta_of(i) for i in places)]))


def is_material(own, refitted, materiality, found_again=False):
    """
    Return whether effects are worth a name.

    That is, whether they move a signal by more than ``materiality`` where the numbers of the
    model do what they can to replace them; or while these stay, and still by ``VISIBLE`` where
    they do not, or by ``FOUND_AGAIN`` if the certify data confirm it. Numbers that were bent by
    one motion are wrong in another, though the effect itself may do nothing there.

    Parameters
    ----------
    own, refitted : dict of str -> float
        How far each signal moves, in standard deviations of its sensor.
    materiality : float
        Of a sensor, in its standard deviations.
    found_again : bool
        Whether the errors of the certify data fall as those of a true effect do.

    """
    left = max(refitted.values(), default=0.0)
    return left > materiality or (
        max(own.values(), default=0.0) > materiality
        and left > min(materiality, FOUND_AGAIN if found_again else VISIBLE))


def late_by(measurement):
    """Return by how much [s] contraction and force are stamped later than pressure."""
    skew = measurement.get('pressure_skew', 0.0)
    return {'contraction': skew, 'force': skew + measurement.get('force_skew', 0.0)}


def free_run_of(problem, found, recording, start_error_pa=0.0, stamp_shift_s=None):
    """Return the whole-chain free run of a fit at the stamps of a recording, by signal."""
    _, measurement = numbers_of(problem, found)
    return free_run(model_of(problem, found), recording, measurement['latency'],
                    stamp_shift_s, start_error_pa, late_by(measurement))


def moved(recording, first, second, chosen=None):
    """Return by signal how far two runs are apart (rms), in standard deviations of its sensor."""
    found = {}
    for s in recording.signals:
        noise = noise_of(recording.time_s[s], recording.measured[s]).sd
        apart = first[s] - second[s]
        apart = apart[recording.time_s[s] > SETTLE_S] if chosen is None else apart[chosen[s]]
        found[s] = float(np.sqrt(np.mean(apart ** 2)) / max(noise, 1e-12))
    return found


def start_error_sd(recording):
    """Return the standard deviation [Pa] of the pressure that a free run starts from."""
    time_s = recording.time_s['pressure']
    noise = noise_of(time_s, recording.measured['pressure'])
    white = MEDIAN_SD * noise.white_sd / np.sqrt(max(np.sum(time_s <= START_S), 1))
    return float(np.hypot(white, noise.slow_sd * min(1.0, np.sqrt(
        2.0 * noise.memory_s / START_S))))


class Proof:
    """
    Free runs of a model before and after on one recording.

    Parameters
    ----------
    recording : Recording
        The recording the proof is made on.
    whole : bool
        All of it is the certify part; otherwise its certify blocks.
    problem : Problem
        With the given model.
    base, final : Found
        Numbers calibrated alone, and the final model.
    seed : int
        Of the draws that carry stamp errors of the valve signal, and the error of the pressure
        that a run of its own starts from, into the floor.

    """

    def __init__(self, recording, whole, problem, base, final, seed=0):
        self.recording, self.problem = recording, problem
        self.part = {s: recording.time_s[s] > SETTLE_S if whole else
                     part_of(recording.time_s[s], recording.grid_s[-1]) == CERTIFY
                     for s in recording.signals}
        self.before = free_run(problem.rig, recording)
        self.refit, self.after = self.run(base, whole), self.run(final, whole)
        self.simulations = 3
        seen = {s: noise_of(recording.time_s[s], recording.measured[s]) for s in recording.signals}
        # It is the same sensor, and a recording without rest hides its slow noise.
        self._slow = {s: 0.0 if seen[s].slow_sd > 0.0 else self._slow_elsewhere(s) for s in seen}
        self.noise = {s: float(np.hypot(seen[s].sd, self._slow[s])) for s in seen}
        self.drift = self._drift(final, whole, seed)
        # A valve that adds up its errors drifts: one run may be off by far more than the mean.
        self.floor, self.highest_floor = self._floors()

    def run(self, found, whole, stamp_shift_s=None, start_error_pa=0.0):
        """Return the free run of a fit at the stamps, by signal."""
        _, measurement = numbers_of(self.problem, found)
        start = start_error_pa if whole else measurement.get('start_error', 0.0)
        run = free_run_of(self.problem, found, self.recording, start, stamp_shift_s)
        return self._aligned(run, late_by(measurement)) if whole else run

    def _aligned(self, run, late_s):
        """
        Return a run with the skew that this recording, which was not fitted, has itself.

        It is no part of the model, and in a fast motion a fraction of a millisecond is more than
        what an effect moves; the bounds are those of the fit.
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

    def signals(self):
        """Return the SignalGap of every signal."""
        return {s: SignalGap(UNIT[s], self.floor[s], self._rms(self.before, s),
                             self._rms(self.refit, s), self._rms(self.after, s))
                for s in self.recording.signals}

    def traces(self):
        """Return the Trace of every signal."""
        r = self.recording
        return {s: Trace(r.stamp_ns[s], r.measured[s], self.before[s], self.refit[s],
                         self.after[s]) for s in r.signals}

    def moved(self, found, whole):
        """Return by signal how far the final model moves it from a fit's, in sensor noise."""
        return moved(self.recording, self.after, self.run(found, whole), self.part)

    def fall(self, worse, better):
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

    def doubt(self, worse, better):
        """Return the standard deviation of ``fall`` by stamps and the start of this recording."""
        _, apart = self.fall(worse, better)
        by_draw = np.zeros(len(self.drift))
        for s in self.recording.signals:
            chosen, variance = self.part[s], max(self.noise[s], 1e-12) ** 2
            between = (worse[s] - better[s])[chosen]
            by_draw += [2.0 * float(np.mean(d[s][chosen] * between)) / variance
                        for d in self.drift]
        return float(np.sqrt(np.mean(by_draw ** 2))) / apart ** 2 if apart > 0.0 else 0.0

    def left(self):
        """Return what the final model leaves beyond the floor (rms), as of ``fall``."""
        return math.sqrt(sum(
            max(self._rms(self.after, s) ** 2 - self.floor[s] ** 2, 0.0) / max(
                self.noise[s], 1e-12) ** 2 for s in self.recording.signals))

    def unexplained(self):
        """
        Return the share of the squared gap left after calibration that is still there.

        Of signals that show one: where both are within the error of the floor, nothing is said.
        """
        before = after = 0.0
        for s in self.signals().values():
            if max(s.rmse_refit, s.rmse_after) > FLOOR_ERROR * s.noise_floor:
                before += max(s.rmse_refit ** 2 / s.noise_floor ** 2 - 1.0, 0.0)
                after += max(s.rmse_after ** 2 / s.noise_floor ** 2 - 1.0, 0.0)
        return min(after / before, 1.0) if before > 0.0 else 0.0

    def _rms(self, simulated, signal):
        error = (simulated[signal] - self.recording.measured[signal])[self.part[signal]]
        return float(np.sqrt(np.mean(error ** 2)))

    def _drift(self, final, whole, seed):
        """Return by signal, for some draws, how far stamps and the start move the final run."""
        random, r = np.random.default_rng(seed), self.recording
        found, start_sd = [], start_error_sd(r)
        for _ in range(INPUT_DRAWS):
            shift = STAMP_SD_S * random.standard_normal(r.messages)
            moved = self.run(final, whole, shift, start_sd * random.standard_normal())
            self.simulations += 1
            found.append({s: moved[s] - self.after[s] for s in r.signals})
        return found

    def _floors(self):
        r = self.recording
        squares = {s: [float(np.mean(d[s] ** 2)) for d in self.drift] for s in r.signals}
        return [{s: sensor_floor(r.time_s[s], r.measured[s], s,
                                 float(np.sqrt(of(squares[s]) + self._slow[s] ** 2)))
                 for s in r.signals} for of in (np.mean, np.max)]

    def _slow_elsewhere(self, signal):
        """Return the slow noise that the fitted recordings show at rest, 0.0 if none does."""
        return max((noise_of(o.time_s[signal], o.measured[signal]).slow_sd
                    for o in self.problem.cuts[0].recordings if signal in o.signals), default=0.0)

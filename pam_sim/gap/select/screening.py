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
Which effects are worth a fit: sensitivity signatures against what the baseline leaves.

One simulation per formulation and start. The part that parameters can explain within their priors
is removed from its change of the errors. The rest is the signature of the effect. Its projection
on the remaining errors gives amplitude and promise in closed form.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.errors import InputError
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.subsystems.effects import acts_on
from pam_sim.gap.subsystems.parallel import parallel_map
from pam_sim.gap.subsystems.problem import SubsystemProblem

AMPLITUDE_RANGE = (0.05, 30.0)      # of the screening size, for the start of a fit
_NEAR_NONE = 1e-9                    # numerics: room of a number on which the data say nothing
_NEAR_END = 0.01                    # numerics: of a number to the end, in deviations

# Parameters that were tried, and what they change by subsystem.
Changes = Sequence[tuple[Mapping[str, float], Mapping[str, FloatArray]]]


@dataclass(frozen=True)
class Screened:
    """
    A candidate with its best start and the share of the squared errors it promises.

    ``seen`` is the rms of its signature in noise floors, of the signal that shows it most,
    for ``size``, the parameters that were tried first. ``flat`` is the same with all errors at
    full weight: a misfit that lasts has little weight left, and what explains it promises
    nothing.
    ``refused`` is why it could not be simulated from any start, empty where it could.
    """

    candidate: Candidate
    start: tuple[float, ...]
    promise: dict[str, float]
    seen: float = 0.0
    size: Mapping[str, float] = field(default_factory=dict)
    flat: 'Screened | None' = None
    refused: str = ''


class ErrorSpace:
    """Errors of the fitted part, weighted, with what the known numbers can do taken out."""

    def __init__(self, estimator: Estimator, problem: SubsystemProblem, near: Fit) -> None:
        self.problem, self.mask = problem, np.isin(problem.part, estimator.use)
        self.weight = 1.0 / np.sqrt(near.temper[problem.subsystem][problem.signal[self.mask]])
        slopes = estimator.slopes[problem.subsystem][self.mask] * self.weight[:, np.newaxis]
        # What a number cannot do any more is left to an effect.
        slopes = slopes * ~_stopped(estimator, problem, near)
        # The priors as further rows: numbers may move only as far as they are uncertain.
        self.basis, _ = np.linalg.qr(np.vstack([slopes, np.eye(slopes.shape[1])]))
        self.left = self.free_of_known(near.errors[problem.subsystem],
                                       near.known_z[problem.subsystem])

    def free_of_known(self, errors: FloatArray, known_z: FloatArray | None = None) -> FloatArray:
        """Return weighted errors orthogonal to the known numbers."""
        tail = np.zeros(self.basis.shape[1]) if known_z is None else known_z
        y = np.concatenate([errors[self.mask] * self.weight, tail])
        return y - self.basis @ (self.basis.T @ y)

    def promise_of_numbers(self) -> FloatArray:
        """Return the share of ``left`` that each number of load or valve explains if free."""
        first = self.weight.size
        # Without its prior, a number has the error of that row for nothing.
        room = 1.0 - np.sum(self.basis[first:] ** 2, axis=1)
        gain = self.left[first:] ** 2 / np.maximum(room, _NEAR_NONE)
        of_rig = np.array([k.of_rig for k in self.problem.known], bool)
        return gain * of_rig / float(self.left @ self.left)

    def rms(self, change: FloatArray) -> float:
        """Return the rms of a weighted change in floors, of the signal where it is largest."""
        plain = change[:self.weight.size] / self.weight
        signal = self.problem.signal[self.mask]
        return max(float(np.sqrt(np.mean(plain[signal == s] ** 2)))
                   for s in range(len(self.problem.signals)))


def _stopped(estimator: Estimator, problem: SubsystemProblem, near: Fit) -> BoolArray:
    """Return which of the known numbers stopped where a number would be wrong, not inexact."""
    z = near.known_z[problem.subsystem]
    ends = np.array([estimator.box if k.of_rig and k.name not in near.hypothesis.numbers
                     else np.inf for k in problem.known])
    return np.abs(z) >= ends - _NEAR_END


def screen(estimator: Estimator, near: Fit, found: Iterable[Candidate]) -> list[Screened]:
    """
    Return the candidates with start and promise.

    Parameters
    ----------
    estimator : Estimator
        Cuts and slopes.
    near : Fit
        Where the search stands; its effects stay in.
    found : list of Candidate
        What is tried.

    Returns
    -------
    list of Screened
        In the order given; ``promise`` by subsystem, 0 where a candidate does not act.

    """
    spaces, flat = spaces_of(estimator, near), flat_spaces_of(estimator, near)
    return parallel_map(lambda c: _screened(estimator, near, c, spaces, flat), found)


def spaces_of(estimator: Estimator, near: Fit) -> dict[str, ErrorSpace]:
    """Return by subsystem the fitted errors with what the known numbers can do taken out."""
    return {problem.subsystem: ErrorSpace(estimator, problem, near)
            for problem in estimator.problems}


def flat_spaces_of(estimator: Estimator, near: Fit) -> dict[str, ErrorSpace]:
    """Return the same as ``spaces_of`` with all errors at full weight."""
    return spaces_of(estimator, replace(near, temper={
        s: np.ones_like(temper) for s, temper in near.temper.items()}))


def free_signature(estimator: Estimator, near: Fit, candidate: Candidate,
                   values: Mapping[str, float], problem: SubsystemProblem, space: ErrorSpace
                   ) -> FloatArray:
    """Return what an effect does to the weighted errors that known numbers cannot do."""
    return space.free_of_known(_change(estimator, near, candidate, values, problem))


def _change(estimator: Estimator, near: Fit, candidate: Candidate, values: Mapping[str, float],
            problem: SubsystemProblem) -> FloatArray:
    rig = estimator.with_effects([*near.settings(), candidate.setting(values)])
    return problem.errors(rig, near.known_z[problem.subsystem]) - near.errors[problem.subsystem]


def _screened(estimator: Estimator, near: Fit, candidate: Candidate,
              spaces: Mapping[str, ErrorSpace], flat: Mapping[str, ErrorSpace]) -> Screened:
    """Return a Screened; each start is simulated once for both weights."""
    changes: list[tuple[Mapping[str, float], dict[str, FloatArray]]] = []
    refusals: list[str] = []
    for values in candidate.starts():
        changes.append((values, {}))
        for problem in estimator.problems:
            if acts_on(candidate.effect, problem.subsystem):
                try:
                    changes[-1][1][problem.subsystem] = _change(
                        estimator, near, candidate, values, problem)
                except InputError as error:
                    refusals.append(error.problem)
    none_ran = not any(by_subsystem for _, by_subsystem in changes)
    return replace(_best_start(candidate, changes, spaces),
                   flat=_best_start(candidate, changes, flat),
                   refused=refusals[0] if refusals and none_ran else '')


def _best_start(candidate: Candidate, changes: Changes, spaces: Mapping[str, ErrorSpace]
                ) -> Screened:
    best = Screened(candidate, candidate.typical_start(), {})
    first, seen = changes[0][0], 0.0
    for values, by_subsystem in changes:
        promise, factors = {}, []
        for subsystem, change in by_subsystem.items():
            space = spaces[subsystem]
            change = space.free_of_known(change)
            size = float(change @ change)
            if size <= 0.0:
                continue
            if values is first:
                seen = max(seen, space.rms(change))
            factor = -float(change @ space.left) / size
            if candidate.amplitudes:
                low = min((f.lower / values[f.name] for f in candidate.amplitudes
                           if values[f.name]), default=0.0)
                high = AMPLITUDE_RANGE[1]
                factor = float(np.clip(factor, max(low, -high), high))
            else:
                factor = float(np.clip(factor, 0.0, 1.0))
            left = space.left + factor * change
            promise[subsystem] = 1.0 - float(left @ left) / float(space.left @ space.left)
            factors.append(factor)
        if sum(promise.values()) > sum(best.promise.values()):
            factor = factors[int(np.argmax(list(promise.values())))]
            if 0.0 <= factor < AMPLITUDE_RANGE[0]:
                factor = AMPLITUDE_RANGE[0]
            start = tuple(f.coordinate(values[f.name] * (1.0 if f.shape else factor))
                          for f in candidate.free)
            best = Screened(candidate, start, promise)
    return replace(best, seen=seen, size=first)

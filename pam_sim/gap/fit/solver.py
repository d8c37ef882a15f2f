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
One least-squares problem: what an effect adds and the numbers of its subsystems.

Bounded, with a Gaussian prior on every known number and a wide one on every shape; weights
are lowered by misfit and memory until they agree with the errors.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import numpy as np
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.errors import InputError
from pam_sim.gap.data.noise import autocorrelation_time
from pam_sim.gap.fit.candidate import Setting
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.fit.trust_region import minimised
from pam_sim.gap.subsystems.effects import shows
from pam_sim.gap.subsystems.parallel import parallel_map
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.rig import Rig

FREE_BOX = 60.0
HELD_BOX = 1e-3
SHAPE_SD = 2.0               # of the logarithm of a shape; where data say nothing, it is typical
FREE_SD = 30.0               # factor on the deviation of the prior of a free number
EFFECT_STEP = 0.01           # of a parameter of an effect, relative
ROUNDS = 4
SETTLED = 0.3                # relative change of the weights that ends the rounds
EVALUATIONS = 12
FTOL, XTOL = 1e-3, 1e-2      # slopes of known numbers are from elsewhere; polishing does the rest
SCORE_BLOCKS = 4             # test blocks whose scores are summed
KEPT = 4                     # errors at the last points; the best one may be asked for again
REFUSED = 1e3                # error of a model that cannot be simulated, in floors


# Whether a fit with these errors by subsystem is worth more rounds.
IsWorth = Callable[[Mapping[str, FloatArray]], bool]

_Moved = tuple[float, dict[str, FloatArray]]     # step of a parameter, change of the errors


def always(errors: Mapping[str, FloatArray]) -> bool:
    """Return that a fit is worth more rounds, whatever its errors."""
    return True


class SolverSettings(Protocol):
    """What a least-squares problem is given by an estimator."""

    slopes: dict[str, FloatArray]
    use: tuple[int, ...]
    box: float

    def with_effects(self, effects: Sequence[Setting]) -> Rig:
        """Return the given model with entries of a model file added."""


class Solver:
    """
    One least-squares problem; x holds the effects' parameters, then each subsystem's numbers.

    Parameters
    ----------
    estimator : Estimator
        With the slopes for known numbers, the parts that are fitted and the box of numbers.
    hypothesis : Hypothesis
    problems : list of SubsystemProblem
        That are fitted.
    temper : dict of str -> numpy.ndarray
        By how much the weight of each signal is lowered at first, by subsystem.
    hold : bool
        Whether latency and skew of the measurement stay at their prior.
    steady : int
        How many of the first parameters have been fitted before. Their slopes are taken where a
        run begins, and kept in it: one simulation each instead of one an iteration.

    """

    def __init__(self, estimator: SolverSettings, hypothesis: Hypothesis,
                 problems: Sequence[SubsystemProblem], temper: dict[str, FloatArray],
                 hold: bool = False, steady: int = 0) -> None:
        self.estimator, self.hypothesis = estimator, hypothesis
        self.problems, self.temper, self.steady = problems, temper, steady
        self.free = [f for c in hypothesis.effects for f in c.free]
        self.owner = [c.effect for c in hypothesis.effects for _ in c.free]
        self.masks = {c.subsystem: np.isin(c.part, estimator.use) for c in problems}
        low = [f.coordinate(f.lower) for f in self.free]
        high = [f.coordinate(f.upper) for f in self.free]
        prior = [SHAPE_SD if f.shape else np.inf for f in self.free]
        for problem in problems:
            lowest, highest = problem.bounds()
            for k, at_least, at_most in zip(problem.known, lowest, highest):
                free = k.name in hypothesis.numbers
                box = FREE_BOX if free or not k.of_rig else estimator.box
                if hold and k.unit == 's' and not k.of_rig:
                    box = HELD_BOX
                low.append(max(at_least, -box))
                high.append(min(at_most, box))
                prior.append(FREE_SD if free else 1.0)
        self.bounds = (np.array(low, float), np.array(high, float))
        self.prior: FloatArray = np.array(prior)
        self._weight: dict[str, FloatArray] = {}
        self._known: FloatArray | None = None
        self._errors: dict[bytes, dict[str, FloatArray]] = {}
        self._moved: tuple[bytes, list[_Moved]] = (b'', [])
        self._kept: list[_Moved] = []

    def join(self, theta: FloatArray, known_z: Mapping[str, FloatArray]) -> FloatArray:
        """Return what ``split`` takes apart."""
        return np.concatenate([theta] + [known_z[problem.subsystem] for problem in self.problems])

    def split(self, x: FloatArray) -> tuple[FloatArray, list[tuple[str, FloatArray]]]:
        """Return (parameters of the effects, [(subsystem, known numbers)])."""
        first, found = len(self.free), []
        for problem in self.problems:
            found.append((problem.subsystem, x[first:first + len(problem.known)]))
            first += len(problem.known)
        return x[:len(self.free)], found

    def errors(self, x: FloatArray) -> dict[str, FloatArray]:
        """Return the errors of every touched subsystem, by subsystem."""
        key = x.tobytes()
        if key not in self._errors:
            while len(self._errors) >= KEPT:
                del self._errors[next(iter(self._errors))]
            self._errors[key] = self._simulated(x)
        return self._errors[key]

    def _simulated(self, x: FloatArray, effect: str | None = None) -> dict[str, FloatArray]:
        """Return the errors of the subsystems, or of those alone in which an effect shows."""
        theta, known = self.split(x)
        rig = self.estimator.with_effects(Fit(
            self.hypothesis, theta, {}, {}, {}).settings())
        asked = [(problem, s, z) for problem, (s, z) in zip(self.problems, known)
                 if effect is None or shows(effect, problem)]
        return {s: found for (_, s, _), found in zip(asked, parallel_map(
            lambda one: simulated_errors(one[0], rig, one[2]), asked))}

    def residuals(self, x: FloatArray) -> FloatArray:
        """Return weighted errors, then the priors."""
        errors = self.errors(x)
        return np.concatenate([self._weighted(c, errors[c.subsystem]) for c in self.problems]
                              + [x / self.prior])

    def slopes(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of ``residuals``."""
        columns = self._known_columns().copy()
        rows = columns.shape[0] - self.prior.size
        for j, (step, change) in enumerate(self._moved_from(x)):
            # An effect of one subsystem leaves the other one as it is.
            columns[:rows, j] = np.concatenate([
                self._weighted(c, change[c.subsystem]) if c.subsystem in change
                else np.zeros(int(self.masks[c.subsystem].sum())) for c in self.problems]) / step
        return columns

    def _known_columns(self) -> FloatArray:
        """Return ``slopes`` without those of the effects, the same until the weights change."""
        if self._known is None:
            masked = [self._weighted(c, self.estimator.slopes[c.subsystem]) for c in self.problems]
            row, column = 0, len(self.free)
            rows = sum(len(slope) for slope in masked)
            self._known = np.zeros((rows + self.prior.size, self.prior.size))
            self._known[rows:] = np.diag(1.0 / self.prior)
            for slope in masked:
                end = column + slope.shape[1]
                self._known[row:row + len(slope), column:end] = slope
                row, column = row + len(slope), end
        return self._known

    def _moved_from(self, x: FloatArray) -> list[_Moved]:
        """Return (step, change of the errors by it) for each parameter of the effects."""
        key = x.tobytes()
        if self._moved[0] != key:       # other weights ask again at the same point
            places = range(len(self._kept), len(self.free))
            base = self.errors(x)
            self._moved = (key, self._kept + parallel_map(
                lambda j: self._moved_at(x, j, base), places))
        self._kept = self._moved[1][:self.steady]
        return self._moved[1]

    def _moved_at(self, x: FloatArray, j: int, base: Mapping[str, FloatArray]) -> _Moved:
        step = EFFECT_STEP * max(abs(x[j]), 0.3)
        if x[j] + step > self.bounds[1][j]:
            step = -step
        moved = np.array(x)
        moved[j] += step
        return step, {s: errors - base[s]
                      for s, errors in self._simulated(moved, self.owner[j]).items()}

    def blocks(self) -> IntArray:
        """Return the number of the block of every weighted error, rising."""
        found, first = [np.zeros(0, int)], 0
        for problem in self.problems:
            found.append(first + problem.block[self.masks[problem.subsystem]] // SCORE_BLOCKS)
            first = int(found[-1].max()) + 1
        return np.concatenate(found)

    def run(self, x: FloatArray) -> FloatArray:
        """Return the solution from a start."""
        low, high = self.bounds
        if not x.size:
            return x
        margin = 1e-6 * (high - low)
        start = np.clip(x, low + margin, high - margin)
        self._kept = []
        return minimised(
            self.residuals, self.slopes, start, low, high, FTOL, XTOL, EVALUATIONS)

    def settle(self, x: FloatArray, rounds: int = ROUNDS, is_worth: IsWorth = always
               ) -> tuple[FloatArray, dict[str, FloatArray]]:
        """
        Return (solution, errors by subsystem) once weights and errors agree.

        ``is_worth`` is given the errors after every round. It ends the rounds where it says no.
        """
        for _ in range(rounds):
            x = self.run(x)
            errors = dict(self.errors(x))
            if self.retemper(errors) or not is_worth(errors):
                break
        return x, errors

    def retemper(self, errors: Mapping[str, FloatArray]) -> bool:
        """Set the weights after the errors; return whether they had settled."""
        settled = True
        self._weight, self._known = {}, None
        for problem in self.problems:
            fresh = tempering(problem, errors[problem.subsystem], self.estimator.use)
            old = self.temper[problem.subsystem]
            settled = settled and bool(np.all(np.abs(fresh / old - 1.0) < SETTLED))
            self.temper[problem.subsystem] = fresh
        return settled

    def _weighted(self, problem: SubsystemProblem, errors: FloatArray) -> FloatArray:
        s, mask = problem.subsystem, self.masks[problem.subsystem]
        if s not in self._weight:
            self._weight[s] = 1.0 / np.sqrt(self.temper[s][problem.signal[mask]])
        weight = self._weight[s]
        return errors[mask] * (weight if errors.ndim == 1 else weight[:, np.newaxis])


def tempering(problem: SubsystemProblem, errors: FloatArray, use: tuple[int, ...]) -> FloatArray:
    """Return by signal by how much its weight must fall: misfit times memory."""
    found = []
    for s in range(len(problem.signals)):
        chosen = errors[np.isin(problem.part, use) & (problem.signal == s)]
        found.append(max(float(np.mean(chosen ** 2)), 1.0) * autocorrelation_time(chosen))
    return np.array(found)


def simulated_errors(problem: SubsystemProblem, rig: Rig, known_z: FloatArray) -> FloatArray:
    """Return the errors of a subsystem; far off where the numbers cannot be simulated."""
    try:
        return problem.errors(rig, known_z)
    except InputError:
        return np.full(problem.part.size, REFUSED)


def is_refused(errors: FloatArray) -> bool:
    """Tell whether errors are those of numbers that cannot be simulated."""
    return bool(np.all(errors == REFUSED))

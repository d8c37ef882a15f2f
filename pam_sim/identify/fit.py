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
Fit the unknown numbers to recordings.

The fit begins at the best of many starts spread over the ranges: a mass that is wrong by a factor
of ten leaves no slope to follow. Weights are the noise floors, lowered by misfit and memory of
what is left. An incomplete model then does not seem to know its numbers better than it does.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
import math

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.errors import InputError
from pam_sim.gap.data.noise import autocorrelation_time
from pam_sim.gap.data.split import FIT, SELECT
from pam_sim.gap.fit.solver import is_refused, REFUSED, simulated_errors, tempering
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.identify.numbers import Number, with_values
from pam_sim.rig import Rig

STARTS = 64                  # of the first look, each simulated once
FOLLOWED = 3                 # of them fitted
BETTER = 0.01                # of the sum of logarithms of misfits
ROUNDS = 4                   # of weights and errors
SETTLED = 0.2                # relative change of the weights that ends the rounds
STEP = 1e-6                  # of a slope, in coordinates: a bend would look like information
STEP_OF_KNOWN = 1e-4         # the same, of numbers with a prior
BEGINS = 0.2                 # the same, of an effect that begins to act at some size
EVALUATIONS = 30
# Of an unknown number from one end of its range to the other, in deviations: what the data leave
# open ends near the value that the rig file has.
TIE_BREAKER = 0.3
FOLLOWED_STEPS = 6           # of a profile, with the slopes of the solution
NOWHERE = 1e-9               # information of a number that nothing depends on
GAIN, TIGHT = 0.02, 1e-9     # of the cost, which ends them; least room of a number
# What a wrong formulation leaves of a signal acts alike through the whole record: it counts as
# so many independent errors, however long the record is.
FORMS = 12
RANKED, REFINED = 0.2, 0.7   # share of the work that is done by then


@dataclass
class Weighted:
    """
    The errors of all subsystems as one least-squares problem.

    Parameters
    ----------
    rig : pam_sim.Rig
    problems : list of SubsystemProblem
    numbers : list of Number
        Unknown ones first.
    temper : list of numpy.ndarray
        By how much the weight of each signal is lowered, by subsystem.
    incomplete : frozenset of str
        Subsystems in which the model misses an effect: what is left there beyond noise weighs
        less.

    """

    rig: Rig
    problems: Sequence[SubsystemProblem]
    numbers: Sequence[Number]
    temper: list[FloatArray] = field(default_factory=list)
    incomplete: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        """Start from full weights."""
        self.temper = self.temper or [np.ones(len(p.signals)) for p in self.problems]
        ends = np.array([n.bounds() for n in self.numbers])
        self.low, self.high = ends[:, 0], ends[:, 1]
        self.prior = np.array([
            TIE_BREAKER / (high - low) if n.unknown else 1.0
            for n, (low, high) in zip(self.numbers, ends)])
        self.own = [p.sensor_squares for p in self.problems]

    def values(self, x: FloatArray) -> dict[str, float]:
        """Return the values of the numbers by name."""
        return {n.name: n.value(float(c)) for n, c in zip(self.numbers, x)}

    def errors(self, x: FloatArray, problem: SubsystemProblem) -> FloatArray:
        """Return the errors of one subsystem in floors."""
        values = self.values(x)
        try:
            rig = with_values(self.rig, self.numbers, values)
        except InputError:          # each is within its range, but not all of them go together
            return np.where(used(problem), REFUSED, 0.0)
        z = np.array([(values.get(k.name, k.value) - k.value) / k.sd for k in problem.known])
        return np.where(used(problem), simulated_errors(problem, rig, z), 0.0)

    def _scaled(self, errors: FloatArray, place: int) -> FloatArray:
        return errors / np.sqrt(self.temper[place][self.problems[place].signal])

    def residuals(self, x: FloatArray) -> FloatArray:
        """Return the weighted errors, then the priors."""
        return np.concatenate([
            self._scaled(self.errors(x, p), k) for k, p in enumerate(self.problems)]
            + [self.prior * x])

    def slopes(self, x: FloatArray, places: Iterable[int] | None = None) -> FloatArray:
        """
        Return the derivatives of ``residuals``, each from the subsystems a number acts in.

        Of the numbers at ``places`` alone, or of all.
        """
        base = [self.errors(x, p) for p in self.problems]
        rows = []
        for j in range(len(self.numbers)) if places is None else places:
            number = self.numbers[j]
            step = STEP if number.unknown else STEP_OF_KNOWN
            own = self._slope(x, j, base, step)
            if number.effect and not number.unknown and not any(np.any(one) for one in own):
                own = self._slope(x, j, base, BEGINS)
            rows.append(np.concatenate([*own, (np.arange(x.size) == j) * self.prior]))
        return np.array(rows).T

    def _slope(self, x: FloatArray, j: int, base: Sequence[FloatArray], step: float
               ) -> list[FloatArray]:
        """Return how the weighted errors of each subsystem change with number ``j``."""
        step = step if x[j] + step <= self.high[j] else -step
        moved = np.array(x)
        moved[j] += step
        return [self._scaled(self._changes(x, moved, base[k], p), k) / step
                if self.numbers[j].acts_in(p) else np.zeros(base[k].size)
                for k, p in enumerate(self.problems)]

    def _changes(self, x: FloatArray, moved: FloatArray, base: FloatArray,
                 problem: SubsystemProblem) -> FloatArray:
        """Return how errors change with a small step; away from a model that is refused."""
        found = self.errors(moved, problem)
        if not is_refused(found[used(problem)]):
            return found - base
        found = self.errors(2.0 * x - moved, problem)
        return np.zeros(base.size) if is_refused(found[used(problem)]) else base - found

    def solve(self, x: FloatArray, held: BoolArray | None = None,
              evaluations: int = EVALUATIONS) -> tuple[FloatArray, float]:
        """
        Return (solution, cost) from a start; numbers in the mask ``held`` stay.

        The cost is the sum of the squared residuals.
        """
        from scipy.optimize import least_squares       # slow to import

        free = np.ones(x.size, bool) if held is None else ~held
        if not free.any():
            return x, float(np.sum(self.residuals(x) ** 2))
        x = np.array(x, float)

        def whole(part: FloatArray) -> FloatArray:
            full = np.array(x)
            full[free] = part
            return full

        margin = 1e-9 * (self.high - self.low)
        start = np.clip(x, self.low + margin, self.high - margin)[free]
        found = least_squares(
            lambda part: self.residuals(whole(part)), start,
            lambda part: self.slopes(whole(part), np.flatnonzero(free)),
            (self.low[free], self.high[free]), x_scale='jac', ftol=1e-6, xtol=1e-6,
            max_nfev=evaluations)
        return whole(found.x), 2.0 * float(found.cost)

    def follow(self, x: FloatArray, held: BoolArray, slopes: FloatArray
               ) -> tuple[FloatArray, float]:
        """
        Return (solution, cost) near a solution whose slopes are known; ``held`` numbers stay.

        Each iteration costs one simulation: the slopes are those given.
        """
        from scipy.optimize import lsq_linear       # slow to import

        free = np.flatnonzero(~held)
        best, residuals = x, self.residuals(x)
        cost = float(residuals @ residuals)
        for _ in range(FOLLOWED_STEPS):
            step = lsq_linear(slopes[:, free], -residuals, (
                np.minimum(self.low[free] - best[free], -TIGHT),
                np.maximum(self.high[free] - best[free], TIGHT))).x
            moved = np.array(best)
            moved[free] = np.clip(best[free] + step, self.low[free], self.high[free])
            fresh = self.residuals(moved)
            if float(fresh @ fresh) >= cost:
                break
            gained, cost = cost - float(fresh @ fresh), float(fresh @ fresh)
            best, residuals = moved, fresh
            if gained < GAIN:
                break
        return best, cost

    def retemper(self, x: FloatArray) -> bool:
        """Set the weights after the errors; return whether they had settled."""
        fresh = [self._tempering(p, self.errors(x, p), own)
                 for p, own in zip(self.problems, self.own)]
        settled = all(bool(np.all(np.abs(new / old - 1.0) < SETTLED))
                      for new, old in zip(fresh, self.temper))
        self.temper = fresh
        return settled

    def _tempering(self, problem: SubsystemProblem, errors: FloatArray, own: FloatArray
                   ) -> FloatArray:
        found = tempering(problem, errors, (FIT, SELECT))
        for s in range(len(problem.signals)):
            chosen = errors[(problem.signal == s) & used(problem)]
            square = float(np.mean(chosen ** 2))
            if problem.subsystem in self.incomplete:
                found[s] = max(found[s], (square - 1.0) * chosen.size / FORMS)
            elif square < 1.0:      # the floor is too careful; an effect may hide below it
                found[s] *= max(square, own[s])
        return found

    def mean_squares(self, x: FloatArray) -> list[tuple[SubsystemProblem, str, float]]:
        """Return (subsystem, signal, mean squared error in floors) of every signal."""
        found = []
        for p in self.problems:
            errors = self.errors(x, p)
            for s, name in enumerate(p.signals):
                chosen = errors[(p.signal == s) & used(p)]
                found.append((p, name, float(np.mean(chosen ** 2))))
        return found

    def memories(self, x: FloatArray) -> list[float]:
        """Return how many samples the errors of every signal stay alike, at least 1."""
        found = []
        for p in self.problems:
            errors = self.errors(x, p)
            found += [autocorrelation_time(errors[(p.signal == s) & used(p)])
                      for s in range(len(p.signals))]
        return found

    def misfit(self, x: FloatArray) -> float:
        """Return a measure that compares far starts: sum of the logarithms of the misfits."""
        return sum(math.log(square) for _, _, square in self.mean_squares(x))


def used(problem: SubsystemProblem) -> BoolArray:
    """Return which samples count: those of the certify part and of no part do not."""
    return problem.in_parts((FIT, SELECT))


def fit(weighted: Weighted, seed: int = 0,
        progress: Callable[[float], object] = lambda done: None) -> FloatArray:
    """
    Return the best coordinates of the numbers; the weights settle on the way.

    Parameters
    ----------
    weighted : Weighted
        Its weights are changed.
    seed : int
        Of the spread of the starts.
    progress : callable
        Told the share that is done, 0 to 1.

    """
    # Coefficients of the force law begin at those of its set, once the other numbers are found.
    late = np.array([n.of_law for n in weighted.numbers], bool)
    unknown = [j for j, n in enumerate(weighted.numbers) if n.unknown and not n.of_law]
    starts = [np.zeros(len(weighted.numbers))]
    if unknown:
        from scipy.stats import qmc       # slow to import

        spread = qmc.Sobol(len(unknown), seed=seed).random(STARTS)
        for row in spread:
            x = np.zeros(len(weighted.numbers))
            x[unknown] = weighted.low[unknown] + row * (
                weighted.high[unknown] - weighted.low[unknown])
            starts.append(x)
    # Where other values fit no better, those of the rig file stay.
    ranked = [starts[0], *sorted(starts[1:], key=weighted.misfit)]
    ranked = ranked[:FOLLOWED + 1]
    progress(RANKED)
    best: FloatArray = ranked[0]
    least = np.inf
    start: FloatArray
    for k, start in enumerate(ranked):
        for half, evaluations in enumerate((EVALUATIONS // 2, EVALUATIONS), 1):
            # From full weight: a poor start would lower the weight that could lead away from it.
            weighted.temper = [np.ones(len(p.signals)) for p in weighted.problems]
            start, _ = weighted.solve(start, late, evaluations)
            progress(RANKED + (REFINED - RANKED) * (k + 0.5 * half) / len(ranked))
        misfit = weighted.misfit(start)
        if misfit < least - BETTER:
            best, least = start, misfit
    if late.any():
        weighted.temper = [np.ones(len(p.signals)) for p in weighted.problems]
        best, _ = weighted.solve(best)
    for _ in range(ROUNDS):
        if weighted.retemper(best):
            break
        best, _ = weighted.solve(best)
    return best

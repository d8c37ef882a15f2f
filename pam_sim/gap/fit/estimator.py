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
Fit a hypothesis: the model with some effects added and some numbers set free.

Bounded least squares of the subsystems' errors with a Gaussian prior on every known number. It
stays within ``max_prior_sd`` deviations unless the hypothesis frees it. A subsystem that it does
not touch keeps its baseline. The errors of an incomplete model are neither white nor at the floor.
Misfit and memory lower their weight. Otherwise the parameters would adapt and hide the missing
effect.

Slopes with respect to the known numbers are taken once for all rivals of a step: they
change little, and each iteration costs only the parameters of the effects.
"""

from collections.abc import Callable, Mapping, Sequence
import copy
from dataclasses import replace
from itertools import compress
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import FloatArray
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.split import FIT, SELECT
from pam_sim.gap.fit.candidate import Setting
from pam_sim.gap.fit.distance import distance_to_none
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis, Precision, within_reach
from pam_sim.gap.fit.profile import profile_ends
from pam_sim.gap.fit.solver import (
    always, is_refused, IsWorth, ROUNDS, simulated_errors, Solver)
from pam_sim.gap.subsystems.effects import shows
from pam_sim.gap.subsystems.parallel import parallel_map
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.rig import Rig

BASE_PASSES = 2              # of the baseline, the second with slopes where the first ended
FAR_START = 1.5              # prior deviations; numbers farther off in the baseline start at 0
POLISHES = 4
WORTH_POLISHING = 0.8        # of the cost before; a fit that falls below goes on
CROSSED_ROUNDS = 2           # they begin at a solution
UNTOUCHED = 1e-6             # inverse variance of a normalised number that nothing depends on


class Estimator:
    """
    The subsystems of a rig, ready for hypotheses.

    Parameters
    ----------
    rig : pam_sim.Rig
        The given model.
    problems : list of SubsystemProblem
    criteria : Criteria
        Decision thresholds.

    """

    def __init__(self, rig: Rig, problems: list[SubsystemProblem],
                 criteria: Criteria = CRITERIA) -> None:
        self.rig, self.problems = rig, problems
        self.use: tuple[int, ...] = (FIT,)          # parts that are fitted
        self.criteria, self.box = criteria, criteria.max_prior_sd
        self.slopes: dict[str, FloatArray] = {}
        self.take_slopes([], {c.subsystem: np.zeros(len(c.known)) for c in problems})
        self.base = self.fit_base()

    def take_slopes(self, effects: Sequence[Setting], known_z: Mapping[str, FloatArray],
                    problems: Sequence[SubsystemProblem] | None = None) -> None:
        """Take the slopes of subsystems, all by default, for their known numbers at a point."""
        rig = self.with_effects(effects)
        for problem in self.problems if problems is None else problems:
            self.slopes[problem.subsystem] = _slopes(problem, rig, known_z[problem.subsystem])

    def _own(self, **changed: object) -> Self:
        """Return a copy whose slopes and settings are its own; the subsystems are the same."""
        own = copy.copy(self)
        own.slopes = dict(self.slopes)
        for name, value in changed.items():
            setattr(own, name, value)
        return own

    def using(self, *parts: int) -> Self:
        """Return a copy that fits other parts of the data; the subsystems are the same."""
        return self._own(use=parts)

    def _slopes_at(self, found: Fit) -> None:
        """Take the slopes at a fit, of the subsystems that fitting it again looks at."""
        self.take_slopes(found.settings(), found.known_z, self._touched(found.hypothesis))

    def _touched(self, hypothesis: Hypothesis) -> list[SubsystemProblem]:
        return [problem for problem in self.problems if hypothesis.touches(problem)]

    @property
    def simulations(self) -> int:
        """Return how many simulations were asked for so far."""
        return sum(problem.asked for problem in self.problems)

    def with_effects(self, effects: Sequence[Setting]) -> Rig:
        """Return the given model with entries of a model file added."""
        return self.rig.with_(effects=[*self.rig.effects, *effects])

    def fit(self, hypothesis: Hypothesis, theta: ArrayLike = (), near: Fit | None = None,
            hold: bool = False, whole: bool = True, rounds: int = ROUNDS, steady: int = 0,
            is_worth: IsWorth = always) -> Fit:
        """
        Fit a hypothesis.

        Parameters
        ----------
        hypothesis : Hypothesis
            What the model has beyond the given one.
        theta : array_like
            Start of the normalised parameters of its effects.
        near : Fit, optional
            Where known numbers, weights and untouched subsystems start; the baseline by default.
        hold : bool
            Whether latency and skew of the measurement stay at their prior.
        whole : bool
            False to leave the subsystems as ``near`` has them in which nothing else shows.
        rounds : int
            At most so many times weights are set after the errors.
        steady : int
            How many of the first effects are as ``near`` has them, see ``Solver``.
        is_worth : callable, optional
            Ends the fit after a round with these errors where it returns False.

        Returns
        -------
        Fit

        """
        near = near or self.base
        touched = self._touched(hypothesis)
        fitted = touched if whole else within_reach(hypothesis, near.hypothesis, touched)
        theta = np.array(theta, dtype=float)
        moves = [any(shows(c.effect, problem) for problem in fitted) for c in hypothesis.effects]
        part = Hypothesis(tuple(compress(hypothesis.effects, moves)), hypothesis.numbers)
        free = np.array([m for c, m in zip(hypothesis.effects, moves) for _ in c.free], bool)
        # From full weight: a low one is its own reason, for it keeps the misfit that made it.
        search = Solver(self, part, fitted, {
            c.subsystem: np.ones(len(c.signals)) for c in fitted}, hold,
            sum(len(c.free) for c in compress(hypothesis.effects[:steady], moves)))
        # Numbers of the baseline are bent by what is missing; a better model starts unbent.
        x, errors = search.settle(search.join(theta[free], {
            s: np.where((near is self.base) & (np.abs(z) > FAR_START), 0.0, z)
            for s, z in near.known_z.items()}), rounds, is_worth)
        theta[free], numbers = search.split(x)
        known_z, temper = dict(numbers), search.temper
        for problem in self.problems:
            if problem not in fitted:       # untouched ones are as without any effect
                s, kept = problem.subsystem, near if problem in touched else self.base
                known_z[s], errors[s], temper[s] = kept.known_z[s], kept.errors[s], kept.temper[s]
        return Fit(hypothesis, theta, known_z, errors, temper)

    def polish(self, found: Fit) -> Fit:
        """Return a fit that went on with slopes taken where it stands, as long as that helps."""
        own = self._own()
        for _ in range(POLISHES):
            own._slopes_at(found)
            again = own.fit(found.hypothesis, found.theta, found)
            before, after = self.cost(found), self.cost(again)
            found = again if after < before else found
            if after > WORTH_POLISHING * before:
                break
        return found

    def cross_fit(self, found: Fit) -> Fit:
        """Return the same hypothesis fitted to the part of the data that judges, from there."""
        own = self._own(use=(SELECT,))
        if not found.hypothesis.names:
            return own.fit_base()
        return own.fit(found.hypothesis, found.theta, found, rounds=CROSSED_ROUNDS)

    def within_box(self, found: Fit, box: float) -> Fit:
        """Return the best fit of the same hypothesis with numbers within ``box`` deviations."""
        own = self._own(box=box)
        return own.polish(own.fit(found.hypothesis, found.theta, found))

    def base_within(self, box: float) -> Fit:
        """Return the baseline with all numbers of the rig within ``box`` deviations."""
        return self._own(box=box).fit_base()

    def cost(self, found: Fit) -> float:
        """Return the mean squared error over the fitted parts, all subsystems."""
        return sum(float(np.mean(found.errors[c.subsystem][np.isin(c.part, self.use)] ** 2))
                   for c in self.problems)

    def precision(self, found: Fit) -> Precision:
        """Return the Precision of a fit, with slopes taken at the solution."""
        own = self._own()
        own._slopes_at(found)
        likelihood, blocks = own._covariances(found, self.problems)
        held = own.fit(found.hypothesis, found.theta, found, hold=True)
        search = Solver(own, found.hypothesis, self.problems, dict(found.temper))
        return Precision(
            likelihood, blocks, search.join(held.theta, held.known_z),
            profile_ends(search, search.join(found.theta, found.known_z),
                         [range(len(found.theta))[found.hypothesis.rows(place)]
                          for place in range(len(found.hypothesis.effects))],
                         (likelihood, blocks)))

    def certainty(self, found: Fit, place: int) -> float:
        """
        Return by how many standard deviations the size of an effect differs from none.

        Its shapes are held: a size that is known only together with a shape is none the less
        there. The numbers that could stand in for it stay within their ranges: a latency is no
        longer than the longest. An effect with shape parameters only, as a reservoir, has no value
        that means zero. Its certainty is that of its best-known shape, relative to the value.
        """
        own = self._own()
        own._slopes_at(found)
        effect, first = found.hypothesis.effects[place], found.hypothesis.rows(place).start
        held = [first + j for j, f in enumerate(effect.free) if f.shape]
        size = [first + j for j, f in enumerate(effect.free) if not f.shape]
        touched = self._touched(found.hypothesis)
        if not size:
            return min(1.0 / np.sqrt(np.diag(c)[held].min())
                       for c in own._covariances(found, touched))
        covariances = own._covariances(found, touched, held)
        search = Solver(own, found.hypothesis, touched, dict(found.temper))
        x = search.join(found.theta, found.known_z)
        low, high = (np.delete(end, held) for end in search.bounds)
        none = np.isin(np.delete(np.arange(x.size), held), size)
        return min(distance_to_none(np.delete(np.delete(c, held, 0), held, 1),
                                    np.delete(x, held), none, low, high) for c in covariances)

    def spread(self, found: Fit) -> tuple[Sequence[FloatArray], Callable[[int, float], Fit]]:
        """
        Return how uncertain a fit is: its parameters, then the known numbers of every subsystem.

        Returns
        -------
        covariances : sequence of numpy.ndarray, shape (K, K)
            By likelihood and by blocks, as of ``Precision``.
        at : callable
            ``at(j, step)``: the fit with number ``j`` moved by ``step``, not fitted again.

        """
        own = self._own()
        own.take_slopes(found.settings(), found.known_z)
        covariances = own._covariances(found, self.problems)
        search = Solver(self, found.hypothesis, self.problems, dict(found.temper))
        x = search.join(found.theta, found.known_z)

        def at(j: int, step: float) -> Fit:
            theta, known_z = search.split(x + step * (np.arange(x.size) == j))
            return replace(found, theta=theta, known_z=dict(known_z))

        return covariances, at

    def _covariances(self, found: Fit, problems: Sequence[SubsystemProblem],
                     held: Sequence[int] = ()) -> tuple[FloatArray, FloatArray]:
        """
        Return the covariance by likelihood, and that by blocks.

        Of the fit's parameters and the numbers of ``problems``; places ``held`` do not move.
        """
        search = Solver(self, found.hypothesis, problems, dict(found.temper))
        x = search.join(found.theta, found.known_z)
        slope, residuals, blocks = search.slopes(x), search.residuals(x), search.blocks()
        slope[:, list(held)] = 0.0
        # What the data do not touch is unknown, not certain.
        whole = np.linalg.inv(slope.T @ slope + UNTOUCHED * np.eye(x.size))
        scores = np.zeros((blocks.max(initial=0) + 1, x.size))
        np.add.at(scores, blocks, slope[:blocks.size] * residuals[:blocks.size, np.newaxis])
        priors = slope[blocks.size:]
        between = scores.T @ scores + priors.T @ priors
        return whole, whole @ between @ whole

    def fit_base(self) -> Fit:
        """Return the baseline: known numbers fitted to the parts that are used now."""
        known: dict[str, FloatArray] = {c.subsystem: np.zeros(len(c.known)) for c in self.problems}
        temper: dict[str, FloatArray] = {
            c.subsystem: np.ones(len(c.signals)) for c in self.problems}
        for _ in range(BASE_PASSES):
            search = Solver(self, Hypothesis(), self.problems, dict(temper))
            x, errors = search.settle(search.join(np.zeros(0), known))
            known, temper = dict(search.split(x)[1]), search.temper
            self.take_slopes([], known)
        return Fit(Hypothesis(), np.zeros(0), known, errors, temper)


def _slopes(problem: SubsystemProblem, rig: Rig, known_z: FloatArray) -> FloatArray:
    """Return the slopes of the errors of a subsystem for its known numbers at a point."""
    base = simulated_errors(problem, rig, known_z)

    def slope(j: int) -> FloatArray:
        for step in (problem.known[j].step, -problem.known[j].step):
            moved = known_z + step * (np.arange(known_z.size) == j)
            errors = simulated_errors(problem, rig, moved)
            if not is_refused(errors):
                return (errors - base) / step
        return np.zeros(base.size)

    return np.column_stack(parallel_map(slope, range(known_z.size)))

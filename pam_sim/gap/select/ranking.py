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
Which rival wins: the best in a subsystem, those the data cannot tell from it, a common cause.

A rival must leave no other subsystem worse. Where two explain as much, the one that needs
implausible numbers of the model is dropped, and the simpler one stands for the one it is a
limit of.
"""

from collections.abc import Callable, Sequence
from typing import Protocol

from pam_sim.gap.criteria import Criteria
from pam_sim.gap.data.split import FIT, SELECT
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select.candidates import is_limit, same_as
from pam_sim.gap.select.comparison import gap, preference, share
from pam_sim.gap.select.order import in_order, uncertain_numbers
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.subsystems.parallel import parallel_map
from pam_sim.gap.subsystems.problem import SubsystemProblem

Test = Callable[[Rival], bool]


class Fitter(Protocol):
    """What a ranking asks of an estimator."""

    problems: list[SubsystemProblem]
    criteria: Criteria

    def polish(self, found: Fit) -> Fit:
        """Return a fit that went on."""

    def cross_fit(self, found: Fit) -> Fit:
        """Return the same hypothesis fitted to the part of the data that judges."""


class Ranking:
    """
    Rank fitted rivals.

    Parameters
    ----------
    estimator : Fitter
    base : Fit
        The baseline, whose gap the shares are taken of.
    seen_gap : float
        Gap, in floors squared, from which on a subsystem needs an explanation.

    """

    def __init__(self, estimator: Fitter, base: Fit, seen_gap: float) -> None:
        self.estimator, self.base, self.seen_gap = estimator, base, seen_gap
        self.criteria = estimator.criteria

    def shares(self, found: Fit) -> dict[str, float]:
        """Return by subsystem the share of the gap that a fit explains."""
        return {p.subsystem: share(p, self.base.errors[p.subsystem], found.errors[p.subsystem])
                for p in self.estimator.problems}

    def _admissible(self, rivals: Sequence[Rival], current: Fit, problem: SubsystemProblem
                    ) -> list[Rival]:
        """Return the rivals that act in a subsystem and leave no other worse in which they do."""
        return [r for r in rivals if _acts(r, current, problem) and not any(
            self._leaves_worse(r, current, other) for other in self.estimator.problems
            if other is not problem and _acts(r, current, other))]

    def _leaves_worse(self, rival: Rival, current: Fit, problem: SubsystemProblem) -> bool:
        s = problem.subsystem
        before = gap(problem, current.errors[s])
        return gap(problem, rival.found.errors[s]) - before > max(
            self.seen_gap, self.criteria.close_share * max(before, 0.0))

    def tied(self, rivals: Sequence[Rival], current: Fit, problem: SubsystemProblem
             ) -> list[Rival]:
        """Return the rivals in a subsystem that the data cannot tell from the best, best first."""
        s, criteria = problem.subsystem, self.criteria
        ranked = sorted(self._admissible(rivals, current, problem), key=lambda r: -r.share[s])
        top = max((r.share[s] for r in ranked), default=0.0)
        # The worse the best explains, the further a fit may be from where it will end.
        near = top - max(criteria.close_share, criteria.greater_part * (1.0 - top))
        before = share(problem, self.base.errors[s], current.errors[s])
        least = before + least_gain(before, criteria)
        # The others will not win.
        near = max(near, 1.0 - (1.0 - least) / criteria.greater_part)
        self._polish([r for r in ranked if r.share[s] > near and gap(
            problem, r.found.errors[s]) > self.seen_gap])
        self._polish(self._likelier(ranked, s))
        ranked, is_tied, is_same = self._judged(ranked, current, problem, before)
        # One within the noise counts as behind only where it would not come nearer.
        if self._polish([r for r in ranked if r.share[s] > near and not is_tied(r)]):
            ranked, is_tied, is_same = self._judged(ranked, current, problem, before)
        if not ranked:
            return []
        top = ranked[0].share[s]
        tied = [r for r in ranked if is_tied(r)]
        if len(tied) > 1 and top >= least:
            self._cross_validate(tied, current, problem)
            tied = self._elsewhere([r for r in tied if is_tied(r)], current, problem)
        cost = min(self._prior_cost(r.found) for r in tied)
        tied = [r for r in tied if self._prior_cost(r.found) < cost + criteria.certain_sd ** 2]
        names = {r.name for r in tied}
        # A simpler one stands for the other only where it was tested and explains as much.
        close = top - criteria.close_share * max(top - before, 0.0)
        as_good = {r.name for r in tied if is_same(r) or (
                   r.t[s] < criteria.likely_sd and r.share[s] > close)}
        tied = [r for r in tied
                if not any(is_limit(simple, r.name) for simple in as_good)
                and same_as(r.name) not in names]
        return in_order(tied, ranked, s, uncertain_numbers(self.estimator.problems, criteria),
                        criteria.close_share * max(top - before, 0.0))

    def _likelier(self, ranked: Sequence[Rival], subsystem: str) -> list[Rival]:
        """
        Return the rivals with numbers that are likelier for certain than those of the best.

        The numbers of the best may do what is missing.
        """
        criteria = self.criteria
        best = max(ranked, key=lambda r: r.share[subsystem], default=None)
        if best is None:
            return []
        cost = self._prior_cost(best.found) - criteria.certain_sd ** 2
        return [r for r in ranked if self._prior_cost(r.found) < cost
                and r.share[subsystem] > criteria.greater_part * best.share[subsystem]]

    def _polish(self, rivals: Sequence[Rival]) -> bool:
        """Let those go on that have not yet; return whether there were any."""
        rough = [r for r in rivals if not r.polished]
        for r, found in zip(rough, parallel_map(
                self.estimator.polish, [r.found for r in rough])):
            r.found, r.polished, r.cross_fit, r.share = found, True, None, self.shares(found)
        return bool(rough)

    def _judged(self, rivals: Sequence[Rival], current: Fit, problem: SubsystemProblem,
                before: float) -> tuple[list[Rival], Test, Test]:
        """Return (rivals, best first; whether one is tied with the best; whether it is alike)."""
        s, criteria = problem.subsystem, self.criteria
        ranked = without_limits(rivals, current, s, criteria)
        for r in ranked:
            r.t[s] = preference(problem, current.errors[s], ranked[0].found.errors[s],
                                r.found.errors[s])
        top = ranked[0].share[s] if ranked else 0.0
        alike = top - criteria.same_form_share * max(top - before, 0.0)

        def is_same(r: Rival) -> bool:
            return r.share[s] >= alike and not (
                r.is_exact and ranked[0].is_exact and self._is_behind(r, ranked[0], s))

        def is_tied(r: Rival) -> bool:
            return is_same(r) or (r.share[s] > criteria.greater_part * top and not r.t[s] >= (
                criteria.ahead_t if r.share[s] > top - criteria.close_share
                else criteria.behind_t))

        return ranked, is_tied, is_same

    def _is_behind(self, rival: Rival, first: Rival, subsystem: str) -> bool:
        """Return whether data and priors together leave a rival behind."""
        t = rival.t[subsystem]
        cost = self._prior_cost(first.found) - self._prior_cost(rival.found)
        return t > 0.0 and t ** 2 - cost >= self.criteria.ahead_t ** 2

    def _cross_validate(self, tied: Sequence[Rival], current: Fit, problem: SubsystemProblem
                        ) -> None:
        """Compare those that are tied with the first of them once more, on all of the data."""
        s = problem.subsystem
        fresh = [r for r in tied if r.cross_fit is None]
        for r, found in zip(fresh, parallel_map(
                self.estimator.cross_fit, [r.found for r in fresh])):
            r.cross_fit = found
        first = tied[0]
        for r in tied[1:]:
            r.t[s] = preference(
                problem, current.errors[s], first.found.errors[s], r.found.errors[s],
                other_part=(FIT, first.cross_errors(s), r.cross_errors(s)))

    def _elsewhere(self, tied: list[Rival], current: Fit, problem: SubsystemProblem
                   ) -> list[Rival]:
        """
        Return the rivals that leave no subsystem without a gap clearly worse than others do.

        A bias of a sensor moves the subsystem before it, too; a threshold of the same size does
        not. Where something else is still missing, that could be either's doing.
        """
        for other in self.estimator.problems:
            s = other.subsystem
            if (other is problem or len(tied) < 2 or gap(other, current.errors[s]) > self.seen_gap
                    or not any(_acts(r, current, other) for r in tied)):
                continue
            best = min(tied, key=lambda r: other.chi2(r.found.errors[s], SELECT))
            tied = [r for r in tied if r is best or not preference(
                other, self.base.errors[s], best.found.errors[s], r.found.errors[s], quiet=True,
                other_part=(FIT, best.cross_errors(s), r.cross_errors(s))
            ) >= self.criteria.certain_sd]
        return tied

    def _prior_cost(self, found: Fit) -> float:
        """Return the squared deviations of all numbers that should have stayed where they were."""
        return sum(z ** 2 for problem in self.estimator.problems
                   for z in found.prior_deviations(problem).values())

    def winner(self, rivals: Sequence[Rival], current: Fit, problem: SubsystemProblem,
               fitted: Sequence[Rival]) -> NamedEffect | None:
        """Return what is added for a subsystem, None where no rival explains enough."""
        tied = self.tied(rivals, current, problem)
        s = problem.subsystem
        if not tied:
            return None
        before = share(problem, self.base.errors[s], current.errors[s])
        gained = tied[0].share[s] - before
        if gained < least_gain(before, self.criteria) or not self._is_sure(
                tied[0], current, problem):
            return None
        return NamedEffect(tied[0].name, s, sorted(
            rivals, key=lambda r: -r.share[s]), tuple(r.name for r in tied),
            [r for r in fitted if r.name == tied[0].name])

    def _is_sure(self, rival: Rival, current: Fit, problem: SubsystemProblem) -> bool:
        """Return whether a rival is certainly better than the present fit in a subsystem."""
        s, certain_sd = problem.subsystem, self.criteria.certain_sd
        judged = (problem, current.errors[s], rival.found.errors[s], current.errors[s])
        sure = preference(*judged, quiet=True)
        if not self.criteria.hint_sd <= sure < certain_sd:
            return sure >= certain_sd
        if rival.cross_fit is None:
            rival.cross_fit = self.estimator.cross_fit(rival.found)
        without = self.estimator.cross_fit(current)
        return preference(*judged, quiet=True, other_part=(
            FIT, rival.cross_errors(s), without.errors[s])) >= certain_sd

    def joint_winner(self, rivals: Sequence[Rival], current: Fit,
                     problems: Sequence[SubsystemProblem], fitted: Sequence[Rival]
                     ) -> NamedEffect | None:
        """Return a cause that explains several subsystems as well as the best in each, or None."""
        if len(problems) < 2:
            return None
        first = problems[0].subsystem
        tied = {p.subsystem: self.tied(rivals, current, p) for p in problems}
        for r in tied[first]:
            everywhere = all(
                r in tied[s] or (tied[s] and r.share[s] > (
                    tied[s][0].share[s] - self.criteria.close_share)) for s in tied)
            if everywhere and all(_acts(r, current, p) for p in problems) \
                    and min(r.share[s] for s in tied) > self.criteria.greater_part:
                same = [o.name for o in tied[first] if o in tied[problems[1].subsystem]]
                names = tuple(dict.fromkeys([r.name, *same]))
                return NamedEffect(r.name, first, list(rivals), names,
                                   [o for o in fitted if o.name == r.name])
        return None


def _acts(rival: Rival, current: Fit, problem: SubsystemProblem) -> bool:
    """Return whether what a rival adds to a fit acts in a subsystem."""
    h, known = rival.found.hypothesis, current.hypothesis
    return Hypothesis(tuple(c for c in h.effects if c not in known.effects),
                      tuple(n for n in h.numbers if n not in known.numbers)).touches(problem)


def least_gain(before: float, criteria: Criteria) -> float:
    """Return the least share of the gap a winner adds to what is explained ``before``."""
    return criteria.first_gain if before == 0.0 else criteria.later_gain * (1.0 - before)


def without_limits(rivals: Sequence[Rival], current: Fit, subsystem: str, criteria: Criteria
                   ) -> list[Rival]:
    """
    Return the rivals, best first, less those that have turned into a simpler effect.

    That is, those at the edge of a shape where an effect they contain as a limit explains
    almost as much or is in the present fit ``current``.
    """
    ranked = sorted(rivals, key=lambda r: -r.share[subsystem])
    simple = {r.name for r in ranked if r.share[subsystem] > (
        criteria.named_share * ranked[0].share[subsystem])}
    simple |= set(current.hypothesis.names)
    return [r for r in ranked if not r.at_edge
            or not any(is_limit(name, r.name) for name in simple)]

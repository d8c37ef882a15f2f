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

"""What a search stands on: fits, candidates, and which subsystem has a gap to explain."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from pam_sim.gap.criteria import Criteria
from pam_sim.gap.data.split import FIT, SELECT
from pam_sim.gap.data.supply import supply_stands
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.select.candidates import (
    candidates, left_out, split_refinements, within_reading)
from pam_sim.gap.select.comparison import gap
from pam_sim.gap.select.ranking import Ranking
from pam_sim.gap.select.reservoir import with_compressor
from pam_sim.gap.select.rival import Rival
from pam_sim.gap.select.screening import screen, Screened
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.subsystems.recent import Recent
from pam_sim.gap.subsystems.valve import ValveProblem


@dataclass(frozen=True)
class SearchContext:
    """
    What every stage of a search is given.

    Parameters
    ----------
    estimator : Estimator
    ranking : Ranking
    base : Fit
        The baseline: numbers calibrated, nothing added.
    pool : tuple of Candidate
        What may still be added.
    outputs : tuple of str
        Signals that are compared.
    screened : tuple of Screened
        All candidates at the baseline.
    first_gap : dict of str -> float
        Gap of every subsystem before anything is added.
    seen_gap, least_gap : float
        Gaps, in floors squared: from the first on a subsystem needs an explanation, from the
        second on one is looked for where an effect promises it.
    out_of_time : callable
        Returns whether the search should come to an end.
    matters : callable
        ``matters(with, without)``: whether two fits differ by enough for a name, in a free
        run; asked of every effect once there are several.
    left_out : tuple of str
        A sentence for every name asked for that is not tried, for a formulation that cannot be
        simulated, and for a compressor that is alone.

    """

    estimator: Estimator
    ranking: Ranking
    base: Fit
    pool: tuple[Candidate, ...]
    outputs: tuple[str, ...]
    screened: tuple[Screened, ...]
    first_gap: dict[str, float]
    seen_gap: float
    least_gap: float
    out_of_time: Callable[[], bool]
    matters: Callable[[Fit, Fit], bool]
    left_out: tuple[str, ...] = ()
    _screened: Recent[list[Screened]] = field(
        default_factory=lambda: Recent(1), repr=False, compare=False)

    @property
    def criteria(self) -> Criteria:
        """Return the decision thresholds."""
        return self.estimator.criteria

    @property
    def problems(self) -> list[SubsystemProblem]:
        """Return the subsystem problems."""
        return self.estimator.problems

    def problem_of(self, subsystem: str) -> SubsystemProblem:
        """Return the problem of a subsystem."""
        return next(p for p in self.problems if p.subsystem == subsystem)

    def is_open(self, problem: SubsystemProblem, current: Fit) -> bool:
        """Return whether a fit leaves something to explain in a subsystem."""
        first = self.first_gap[problem.subsystem]
        left = gap(problem, current.errors[problem.subsystem])
        if not current.hypothesis.touches(problem):
            return first > self.least_gap
        return left > max(self.seen_gap, self.criteria.done_share * first)

    def screened_at(self, current: Fit, found: Sequence[Candidate]) -> Sequence[Screened]:
        """Return candidates as screened at a fit; those of the last one are kept."""
        if current is self.base:
            return self.screened
        return self._screened.get((id(current), tuple(found)), lambda: screen(
            self.estimator, current, found), current)

    def explained(self, current: Fit) -> dict[str, float]:
        """Return the share of the gap that a fit explains, by subsystem with a gap."""
        return {s: explained for s, explained in self.ranking.shares(current).items()
                if self.first_gap[s] > self.least_gap}

    def bookmark(self) -> Callable[[], None]:
        """Return what puts the levels of noise and the slopes back to what they are now."""
        levels, slopes = [p.level for p in self.problems], dict(self.estimator.slopes)

        def back() -> None:
            self.estimator.slopes = slopes
            for problem, level in zip(self.problems, levels):
                problem.level = level
        return back

    def set_levels(self, rivals: Sequence[Rival], problems: Iterable[SubsystemProblem]) -> None:
        """Lower the level of noise to what the best rival reaches."""
        for problem in problems:
            s = problem.subsystem
            problem.level = min([problem.level] + [
                problem.chi2(r.found.errors[s], SELECT) for r in rivals])
        for r in rivals:
            r.share = self.ranking.shares(r.found)


def context_of(estimator: Estimator, seen_gap: float, least_gap: float,
               only: Sequence[str] | None = None,
               out_of_time: Callable[[], bool] = lambda: False,
               matters: Callable[[Fit, Fit], bool] = lambda found, without: True
               ) -> SearchContext:
    """
    Return the context of a search, with all candidates screened at the baseline.

    Parameters
    ----------
    estimator, seen_gap, least_gap, out_of_time, matters
        As of :class:`SearchContext`.
    only : sequence of str, optional
        Names to try; all by default.

    """
    outputs: tuple[str, ...] = sum((problem.signals for problem in estimator.problems), ())
    recordings = estimator.problems[0].recordings
    stands = supply_stands(recordings, estimator.criteria)
    pool = within_reading(
        candidates(estimator.rig, outputs, only, stands), recordings, estimator.criteria)
    base = estimator.base
    pool, compressor = with_compressor(pool, estimator)
    screened = screen(estimator, base, split_refinements(pool)[0])
    first_gap = {p.subsystem: first_gap_of(p, base, screened, seen_gap)
                 for p in estimator.problems}
    return SearchContext(
        estimator, Ranking(estimator, base, seen_gap), base, tuple(pool), outputs,
        tuple(screened), first_gap, seen_gap, least_gap, out_of_time, matters,
        (*left_out(only, pool, estimator.rig, outputs, stands), *(
            f'`{s.candidate.effect}` is not tried: {s.refused}.'
            for s in screened if s.refused), *(
            [compressor] if compressor and first_gap['valve'] > seen_gap else [])))


def first_gap_of(problem: SubsystemProblem, base: Fit, screened: Iterable[Screened],
                 seen_gap: float) -> float:
    """
    Return the gap of a subsystem before anything is added.

    Both the fitted and the judging part must show it. One that is below the floor
    can still be seen, if an effect promises to explain a part of the errors. Where stretches of
    the same edges are dealt out, errors of the measured pressure are the same in all parts. A gap
    of muscle and load no larger than the floor may be theirs, and is none.
    """
    found = _seen_gap_of(problem, base, screened, seen_gap)
    if (problem.is_dealt_short and problem.subsystem != ValveProblem.subsystem
            and found <= problem.criteria.hint_sd ** 2):
        return 0.0
    return found


def _seen_gap_of(problem: SubsystemProblem, base: Fit, screened: Iterable[Screened],
                 seen_gap: float) -> float:
    s = problem.subsystem
    seen = min(gap(problem, base.errors[s], part) for part in (FIT, SELECT))
    if seen > seen_gap:
        return seen
    # What drifts slowly has no weight against its own memory, whatever explains it.
    promise = max((p.promise.get(s, 0.0) for q in screened for p in (q, q.flat) if p),
                  default=0.0)
    return promise * problem.chi2(base.errors[s], FIT)

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

"""The rivals of a round: which candidates are fitted, and from where."""

from collections.abc import Collection, Iterable, Mapping, Sequence

from pam_sim.gap.criteria import Criteria
from pam_sim.gap.data.split import SELECT
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.fit.solver import IsWorth
from pam_sim.gap.select.candidates import is_limit, split_refinements
from pam_sim.gap.select.comparison import gap
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.order import numbers_of_rig
from pam_sim.gap.select.racing import may_win
from pam_sim.gap.select.ranking import least_gain
from pam_sim.gap.select.rival import Rival
from pam_sim.gap.select.screening import Screened
from pam_sim.gap.subsystems.effects import acts_on
from pam_sim.gap.subsystems.parallel import parallel_map
from pam_sim.gap.subsystems.problem import SubsystemProblem

# Effort: how many names are fitted in each subsystem, and how many of those that promise most
# with all errors at full weight.
MIN_FITTED, MAX_FITTED, FITTED_AT_FULL_WEIGHT = 4, 7, 3


def rivals_of(context: SearchContext, current: Fit, problems: Sequence[SubsystemProblem],
              pool: Iterable[Candidate] | None = None) -> tuple[list[Rival], list[Rival]]:
    """
    Return the best fit of every name with one effect or free number more; set levels.

    Parameters
    ----------
    context : SearchContext
        What the search works with.
    current : Fit
        Where the search stands.
    problems : sequence of SubsystemProblem
        Where something is left to explain.
    pool : iterable of Candidate, optional
        What is tried; that of the context by default.

    Returns
    -------
    best, fitted : list of Rival
        One for each name, and all that were fitted.

    """
    criteria, names = context.criteria, set(current.hypothesis.names)
    pool = context.pool if pool is None else pool
    plain, refinements = split_refinements([c for c in pool if c.name not in names])
    screened = context.screened_at(current, plain)
    chosen = _promising(screened, problems, criteria)
    chosen += [s for s in containing(screened, names) if s not in chosen]
    rivals = _fits(context, current, chosen)
    rivals += _free_numbers(context, current, problems)
    contending = names_that_contend(context, rivals, current, problems)
    shares = context.ranking.shares(current)
    before = {p.subsystem: shares[p.subsystem] for p in problems}
    fitted = [s.candidate for s in chosen]
    near = [s for s in screened if s.candidate.name in contending]
    rivals += _fits(context, current, [s for s in near if s.candidate not in fitted])
    rivals += _fits(context, current, other_starts(rivals, near, problems, criteria))
    rivals += _fits(context, current, refined(
        rivals, refinements, before, len(current.hypothesis.effects), criteria))
    context.set_levels(rivals, problems)
    return best_of_each_name(context, rivals), rivals


def _free_numbers(context: SearchContext, current: Fit,
                  problems: Sequence[SubsystemProblem]) -> list[Rival]:
    """Return a fit for every number that is far from its prior, without that prior."""
    return _with_free(context, current, [
        name for problem in problems for name, z in current.prior_deviations(problem).items()
        if abs(z) > context.criteria.hint_sd])


def numbers_before_sensors(context: SearchContext, current: Fit,
                           problems: Sequence[SubsystemProblem], tried: Collection[str]
                           ) -> list[Rival]:
    """
    Return a fit for every number of load and valve that was not tried, without its prior.

    This comes before an error of a sensor is named. Where the misfit is large, the weight of the
    errors is low. A number that is far off then still stays near its prior.
    """
    names = [k.name for k in numbers_of_rig(problems)
             if k.name not in tried and k.name not in current.hypothesis.numbers]
    found = _with_free(context, current, names)
    for r in found:
        r.found, r.polished = context.estimator.polish(r.found), True
        r.share = context.ranking.shares(r.found)
    return found


def _with_free(context: SearchContext, current: Fit, names: Sequence[str]) -> list[Rival]:
    """Return a fit for every name of a number, with it free."""
    h = current.hypothesis
    # All rounds: the first one moves a number that is far off by a part of the way only.
    return parallel_map(lambda name: _rival(context, context.estimator.fit(
        Hypothesis(h.effects, (*h.numbers, name)), current.theta, current, whole=False), name),
        names)


def other_starts(rivals: Sequence[Rival], contending: Iterable[Screened],
                 problems: Iterable[SubsystemProblem], criteria: Criteria) -> list[Screened]:
    """
    Return what contends, from its typical size, where all leave a clear part of a gap.

    A fit from the best linear guess may have stopped in a valley beside its best.
    """
    poor = [p.subsystem for p in problems if all(
        r.share[p.subsystem] < criteria.named_share
        and gap(p, r.found.errors[p.subsystem]) > criteria.clear_rest for r in rivals)]
    return [Screened(q.candidate, q.candidate.typical_start(), {}) for q in contending
            if any(acts_on(q.candidate.effect, s) for s in poor)]


def refined(rivals: Sequence[Rival], refinements: Iterable[Candidate],
            before: Mapping[str, float], place: int, criteria: Criteria) -> list[Screened]:
    """
    Return the refinements of what explains a subsystem nearly and best, from where that ended.

    ``before`` is the share of the gap of every subsystem that was explained without, ``place``
    that of the added effect in the hypotheses of the rivals.
    """
    chosen: list[Rival] = []
    for s, had in before.items():
        # What turns into another effect there is no rival of what that one's forms explain.
        least = max([criteria.named_share, had + criteria.greater_part * (1.0 - had)] + [
            1.0 - criteria.refinable_rest * (1.0 - r.share[s]) for r in rivals if not r.at_edge])
        chosen += [r for r in rivals if r.share[s] >= least and r not in chosen]
    found = []
    for c in refinements:
        plain = max((r for r in chosen if r.name == c.name), default=None,
                    key=lambda r: sum(r.share.values()))
        if plain is not None:
            values = plain.found.values()[place]
            found.append(Screened(c, tuple(
                f.coordinate(values.get(f.name, f.typical)) for f in c.free), {}))
    return found


def names_that_contend(context: SearchContext, rivals: Sequence[Rival], current: Fit,
                       problems: Sequence[SubsystemProblem]) -> set[str]:
    """
    Return the names that contend for a subsystem, at the level of noise that rivals reach.

    At a higher one a gap near the noise has no share to contend for.
    """
    levels = [problem.level for problem in problems]
    context.set_levels(rivals, problems)
    before = context.ranking.shares(current)
    found: set[str] = set().union(*(_contending(
        rivals, p.subsystem, before[p.subsystem], context.criteria) for p in problems))
    # What is refined is judged at the level from before: the best of it is not perfect.
    for problem, level in zip(problems, levels):
        problem.level = level
    for r in rivals:
        r.share = context.ranking.shares(r.found)
    return found


def _contending(rivals: Sequence[Rival], s: str, before: float, criteria: Criteria) -> set[str]:
    """Return the names of which a formulation is near enough to the best, and to winning."""
    top = max([before + least_gain(before, criteria)] + [r.share[s] for r in rivals])
    least = top - criteria.contending_share * (1.0 - before)
    return {r.name for r in rivals if r.share[s] > max(least, 0.0)}


def _promising(screened: Sequence[Screened], problems: Iterable[SubsystemProblem],
               criteria: Criteria) -> list[Screened]:
    """Return the best formulation of every name that promises something."""
    chosen: list[Screened] = []
    for problem in problems:
        ranked = _ranked(screened, problem.subsystem)
        top = ranked[0].promise[problem.subsystem] if ranked else 0.0
        chosen += [s for place, s in enumerate(ranked[:MAX_FITTED]) if place < MIN_FITTED
                   or s.promise[problem.subsystem] > criteria.promising_share * top]
        chosen += _ranked([s.flat for s in screened if s.flat], problem.subsystem)[
            :FITTED_AT_FULL_WEIGHT]
    candidates = [s.candidate for s in chosen]
    return [s for i, s in enumerate(chosen) if s.candidate not in candidates[:i]]


def containing(screened: Iterable[Screened], names: Collection[str]) -> list[Screened]:
    """
    Return the best formulation of every name that has a limit among given names.

    Such an effect, which gave way to its limit, may be there beside it; its signature may
    not tell, for much of it is that of the limit.
    """
    ranked = sorted(screened, key=lambda s: -sum(s.promise.values()))
    return _first_of_each([s for s in ranked if any(
        is_limit(name, s.candidate.name) for name in names)])


def _ranked(screened: Iterable[Screened], subsystem: str) -> list[Screened]:
    """Return the best formulation of every name, the most promising first."""
    ranked = sorted(screened, key=lambda s: -s.promise.get(subsystem, 0.0))
    return _first_of_each([s for s in ranked if s.promise.get(subsystem, 0.0) > 0.0])


def _fits(context: SearchContext, current: Fit, screened: Iterable[Screened]) -> list[Rival]:
    """Return the rivals of screened candidates; the simulations hold no lock."""
    is_worth = may_win(context, current)
    return [r for r in parallel_map(lambda s: _fit(context, current, s, is_worth), screened)
            if r is not None]


def _fit(context: SearchContext, current: Fit, screened: Screened, is_worth: IsWorth
         ) -> Rival | None:
    if context.out_of_time():
        return None
    hypothesis = Hypothesis((*current.hypothesis.effects, screened.candidate),
                            current.hypothesis.numbers)
    return _rival(context, context.estimator.fit(
        hypothesis, (*current.theta, *screened.start), current, whole=False,
        steady=len(current.hypothesis.effects), is_worth=is_worth), screened.candidate.name)


def _rival(context: SearchContext, found: Fit, name: str) -> Rival:
    return Rival(name, found, context.ranking.shares(found))


def best_of_each_name(context: SearchContext, rivals: Iterable[Rival]) -> list[Rival]:
    """
    Return the formulation of every name that leaves least over all subsystems.

    In floors squared: where the gap of a subsystem is the noise's, so are shares.
    """
    def rest(found: Fit) -> float:
        return sum(p.chi2(found.errors[p.subsystem], SELECT) for p in context.problems)

    best: dict[str, Rival] = {}
    whole = rest(context.base)
    for r in sorted(rivals, key=lambda r: (
            rest(r.found) + context.criteria.close_share * whole * r.at_edge)):
        best.setdefault(r.name, r)
    return list(best.values())


def _first_of_each(ranked: Iterable[Screened]) -> list[Screened]:
    """Return the first Screened of every name, in their order."""
    by_name: dict[str, Screened] = {}
    for s in ranked:
        by_name.setdefault(s.candidate.name, s)
    return list(by_name.values())

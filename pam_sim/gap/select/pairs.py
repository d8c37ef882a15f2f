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
Two effects that only explain a subsystem together.

One effect at a time can lead astray: a third one that is like both at once looks better than
either, and beside it neither is found. Where that search ends without a name, pairs of
signatures are held against what the baseline leaves, and the most promising are fitted. Where it
ends with a name that explains too little, two more of the last rivals are fitted beside it.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
import itertools

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select.candidates import same_as
from pam_sim.gap.select.comparison import share
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.groups import last_of
from pam_sim.gap.select.racing import may_explain_all
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.select.screening import AMPLITUDE_RANGE, flat_spaces_of, free_signature, Screened
from pam_sim.gap.subsystems.effects import acts_on
from pam_sim.gap.subsystems.parallel import parallel_map
from pam_sim.gap.subsystems.problem import SubsystemProblem

FITTED = 4                   # effort: of the most promising pairs
BESIDE = 5                   # effort: of so many rivals, two are fitted beside what is in

# Two candidates, and the start of their normalised parameters.
Pair = tuple[tuple[Candidate, Candidate], tuple[float, ...]]


@dataclass(frozen=True)
class _Tried:
    """A candidate with a start and what that does to the errors, known numbers taken out."""

    candidate: Candidate
    start: tuple[float, ...]
    change: FloatArray

    @property
    def least(self) -> float:
        """Return the least factor on the start."""
        f = self.candidate.amplitudes
        return -AMPLITUDE_RANGE[1] if f and all(a.lower < 0.0 for a in f) else 0.0

    @property
    def most(self) -> float:
        """Return the largest factor on the start; a shape has no size to be scaled."""
        return AMPLITUDE_RANGE[1] if self.candidate.amplitudes else 1.0

    def theta(self, factor: float) -> tuple[float, ...]:
        """Return the normalised parameters with the size scaled."""
        return tuple(t * (1.0 if f.shape else factor)
                     for f, t in zip(self.candidate.free, self.start))


def promising_pairs(estimator: Estimator, base: Fit, screened: Iterable[Screened],
                    problem: SubsystemProblem) -> list[Pair]:
    """
    Return the pairs of effects that promise most in a subsystem, at full weight.

    Parameters
    ----------
    estimator : Estimator
        Cuts and slopes.
    base : Fit
        The baseline.
    screened : list of Screened
        Of the baseline, with their starts.
    problem : SubsystemProblem
        Where there is a gap.

    Returns
    -------
    list of (tuple of Candidate, tuple of float)
        Two candidates of different names, and the start of their normalised parameters. None
        that promises less than ``promised_share`` of the gap.

    """
    space = flat_spaces_of(estimator, base)[problem.subsystem]
    noise = problem.level * space.left.size
    gap = float(space.left @ space.left) - noise
    most = noise + (1.0 - estimator.criteria.promised_share) * gap
    tried = []
    for s in screened:
        if s.flat is None or not acts_on(s.candidate.effect, problem.subsystem):
            continue
        values = {f.name: f.value(t) for f, t in zip(s.candidate.free, s.flat.start)}
        try:
            change = free_signature(estimator, base, s.candidate, values, problem, space)
        except InputError:
            continue
        if change @ change > 0.0:
            tried.append(_Tried(s.candidate, s.flat.start, change))
    best: dict[tuple[str, str], tuple[float, Pair]] = {}
    for one, other in itertools.combinations(tried, 2):
        names = (one.candidate.name, other.candidate.name)
        if names[0] == names[1]:
            continue
        factors, left = _joint(one, other, space.left)
        if factors is not None and left < min(most, best[names][0] if names in best else np.inf):
            best[names] = (left, ((one.candidate, other.candidate),
                                  one.theta(factors[0]) + other.theta(factors[1])))
    return [pair for _, pair in sorted(best.values(), key=lambda p: p[0])[:FITTED]]


def _joint(one: _Tried, other: _Tried, left: FloatArray) -> tuple[FloatArray | None, float]:
    """Return (factors, squared errors left) of two signatures, None where one is not needed."""
    columns = np.column_stack([one.change, other.change])
    try:
        factors = np.linalg.solve(columns.T @ columns, -columns.T @ left)
    except np.linalg.LinAlgError:
        return None, np.inf
    for t, factor in zip((one, other), factors):
        if not t.least < factor <= t.most or abs(factor) < AMPLITUDE_RANGE[0] * bool(
                t.candidate.amplitudes):
            return None, np.inf
    rest = left + columns @ factors
    return factors, float(rest @ rest)


def pair_of(context: SearchContext, problem: SubsystemProblem
            ) -> tuple[Fit, list[NamedEffect]] | None:
    """
    Return the two effects that explain a subsystem together, as (fit, list of NamedEffect).

    None where no pair is better than all others, or where the best ones have no effect in
    common.

    Parameters
    ----------
    context : SearchContext
        With its baseline, candidates as screened, and ranking.
    problem : SubsystemProblem
        Where there is a gap.

    """
    def fitted(pair: Pair) -> Rival | None:
        if context.out_of_time():
            return None
        found = context.estimator.fit(Hypothesis(pair[0]), pair[1], rounds=1)
        return Rival(' + '.join(c.name for c in pair[0]), found, context.ranking.shares(found))

    fits = parallel_map(fitted, promising_pairs(
        context.estimator, context.base, context.screened, problem))
    return _best_pair(context, fits, context.base, problem)


def pair_beside(context: SearchContext, current: Fit, problem: SubsystemProblem,
                rivals: Sequence[Rival]) -> tuple[Fit, list[NamedEffect]] | None:
    """
    Return the two of some rivals that explain together what a fit leaves, as ``pair_of`` does.

    Of two that are missing beside the present effects, neither may explain enough of the rest
    alone. None where the best pair leaves more of that rest than names may.

    Parameters
    ----------
    context : SearchContext
        What the search works with.
    current : Fit
        Where the search stands; its effects stay in.
    problem : SubsystemProblem
        Where a clear rest is left.
    rivals : list of Rival
        Fits with one effect or number more.

    """
    def fitted(pair: tuple[Rival, Rival]) -> Rival | None:
        if context.out_of_time():
            return None
        h, theta = current.hypothesis, list(current.theta)
        effects, numbers = h.effects, h.numbers
        for r in pair:
            if r.name in r.found.hypothesis.numbers:
                numbers = (*numbers, r.name)
            else:
                effects = (*effects, r.found.hypothesis.effects[-1])
                theta += list(r.found.theta_of(len(r.found.hypothesis.effects) - 1))
        found = context.estimator.fit(
            Hypothesis(effects, numbers), theta, current, whole=False, rounds=1)
        return Rival(' + '.join(r.name for r in pair), found, context.ranking.shares(found))

    s, base = problem.subsystem, context.base.errors[problem.subsystem]
    before = share(problem, base, current.errors[s])
    least = before + context.criteria.first_gain * (1.0 - before)
    likely = sorted((r for r in rivals if r.share[s] >= least), key=lambda r: -r.share[s])
    pairs = [(a, b) for a, b in itertools.combinations(likely[:BESIDE], 2)
             if same_as(a.name) != b.name and same_as(b.name) != a.name]
    found = _best_pair(context, parallel_map(fitted, pairs), current, problem)
    if found is None or 1.0 - share(problem, base, found[0].errors[s]) > (
            (1.0 - context.criteria.named_share) * (1.0 - before)):
        return None
    return found


def _best_pair(context: SearchContext, fits: Sequence[Rival | None], current: Fit,
               problem: SubsystemProblem) -> tuple[Fit, list[NamedEffect]] | None:
    """Return (fit, the two it adds) of the best pair, if it has one in common with its equals."""
    is_worth = may_explain_all(context, current)
    found = [r for r in fits if r is not None]
    if len(found) < len(fits) or not any(is_worth(r.found.errors) for r in found):
        return None
    rivals = [r for r in found if not any(
        Rival(name, r.found).at_edge for name in _added(r, current))]
    if not rivals:
        return None
    context.set_levels(rivals, [problem])
    tied = context.ranking.tied(rivals, current, problem)
    common = set.intersection(*(set(_added(r, current)) for r in tied)) if tied else set()
    if not common:
        return None
    named, both = [], _added(tied[0], current)
    for name, other in zip(both, reversed(both)):
        beside = [_alone(r, next(n for n in _added(r, current) if n != other))
                  for r in rivals if other in _added(r, current)]
        names = tuple(n for r in tied for n in _added(r, current) if n != other)
        named.append(NamedEffect(
            name, problem.subsystem, beside, names if other in common else (name,),
            [r for r in beside if r.name == name]))
    return tied[0].found, named


def _added(rival: Rival, current: Fit) -> tuple[str, ...]:
    """Return the names that a rival adds to a fit."""
    known = current.hypothesis.names
    return tuple(n for n in rival.found.hypothesis.names if n not in known)


def _alone(rival: Rival, name: str) -> Rival:
    """Return a rival of two under one of the names; an effect is the last one of its fit."""
    found = rival.found
    places = [p for p, c in enumerate(found.hypothesis.effects) if c.name == name]
    return replace(rival, name=name, found=last_of(found, places[0]) if places else found)

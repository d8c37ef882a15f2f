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
Backward elimination: each effect must be missed when it is left out.

It must also be ranked first beside the others, have a size that differs from none, and explain
its subsystem without implausible numbers.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from pam_sim.gap.data.split import FIT
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.select.candidates import is_limit, same_as
from pam_sim.gap.select.comparison import preference, share
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.plausibility import is_poor, likelier_relative, with_plausible_numbers
from pam_sim.gap.select.refit import fit_without, other_formulations
from pam_sim.gap.select.rerank import ranked_again
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.select.size import with_certain_sizes
from pam_sim.gap.subsystems.problem import SubsystemProblem


@dataclass(frozen=True)
class Selected:
    """
    What a search has selected.

    Parameters
    ----------
    fit : Fit
    named : list of NamedEffect
    explained : dict of str -> float
        Share of the gap that is explained, by subsystem with a gap.
    mistaken : dict of str -> str
        Names that were dropped for an effect that explains more and is none of them.

    """

    fit: Fit
    named: list[NamedEffect]
    explained: dict[str, float]
    mistaken: dict[str, str] = field(default_factory=dict)


def backward_elimination(context: SearchContext, current: Fit, named: list[NamedEffect]
                         ) -> Selected:
    """Return what of the named effects stays: only what is needed, certain and plausible."""
    before = len(current.hypothesis.effects)
    current, named = eliminated(context, current, named)
    current, named = with_certain_sizes(context, *ranked_again(context, current, named))
    if len(current.hypothesis.effects) < before:
        # What went stood for what the form of another effect leaves.
        current = other_formulations(context, current, always=True)
    current = with_plausible_numbers(context, current)
    explained, mistaken = context.explained(current), {}
    poor = {p.subsystem for p in context.problems if is_poor(context, p, current, explained)}
    for w in [w for w in named if w.subsystem not in poor]:
        relative = likelier_relative(context, current, w)
        if relative is not None:
            mistaken[w.name] = relative
            poor.add(w.subsystem)
    for w in [w for w in named if w.subsystem in poor]:
        current = fit_without(context.estimator, current, w.name)
    return Selected(current, [w for w in named if w.subsystem not in poor], explained, mistaken)


def eliminated(context: SearchContext, current: Fit, named: list[NamedEffect]
               ) -> tuple[Fit, list[NamedEffect]]:
    """Drop what is not missed when it is left out, once there are several."""
    # A number and the effect that is another name of it are one; the effect has forms.
    for w in [w for w in named if w.name in {same_as(o.name) for o in named}]:
        current = fit_without(context.estimator, current, w.name)
        named = [o for o in named if o is not w]
    if any(p.is_dealt_short for p in context.problems):
        return _eliminated_by_loss(context, current, named)
    for w in list(named):
        if len(named) < 2:
            break
        if w not in named:
            continue
        without = fit_without(context.estimator, current, w.name)
        if not _is_needed(context, current, without):
            w, without = _simpler(context, current, w, without, named)
            current, named = without, [o for o in named if o is not w]
    return current, named


def _eliminated_by_loss(context: SearchContext, current: Fit, named: list[NamedEffect]
                        ) -> tuple[Fit, list[NamedEffect]]:
    """
    Drop what is not missed, each time the one whose absence costs least.

    Where few blocks judge, the test may miss none of two effects that stand for each other in
    part. In the order of their selection the better one would go.
    """
    while len(named) > 1:
        tried = [(w, fit_without(context.estimator, current, w.name)) for w in named]
        idle = [(w, f) for w, f in tried if not _is_needed(context, current, f)]
        if not idle:
            break
        w, without = min(idle, key=lambda one: _loss(context, current, one[1]))
        w, current = _simpler(context, current, w, without, named)
        named = [o for o in named if o is not w]
    return current, named


def _loss(context: SearchContext, current: Fit, without: Fit) -> float:
    """Return by how much the shares of the gaps fall without an effect, the largest fall."""
    now, then = context.explained(current), context.explained(without)
    return max((now[s] - then[s] for s in now), default=0.0)


def _is_needed(context: SearchContext, current: Fit, without: Fit) -> bool:
    """Return whether some subsystem is explained worse without an effect, and by enough."""
    return (any(is_missed(context, p, current, without) for p in context.problems)
            and context.matters(current, without))


def is_missed(context: SearchContext, problem: SubsystemProblem, current: Fit, without: Fit
              ) -> bool:
    """
    Return whether a subsystem is explained clearly worse without an effect.

    That may be another one than its own: what takes its place there may do harm here.
    """
    s, criteria = problem.subsystem, context.criteria
    if context.first_gap[s] <= context.least_gap:
        return False
    base = context.base.errors[s]
    rest = 1.0 - share(problem, base, without.errors[s])
    gained = rest - (1.0 - share(problem, base, current.errors[s]))
    # By itself in its subsystem it needs no more than one that is alone altogether.
    alone = not without.hypothesis.touches(problem)
    least = criteria.greater_part if alone else criteria.later_gain
    if not (gained > 0.0 and gained >= least * rest):
        return False
    sure = preference(problem, base, current.errors[s], without.errors[s])
    if problem.is_dealt_short and not (
            sure < criteria.hint_sd or sure >= criteria.certain_sd):
        # Few blocks see an edge, or too few for a test. The other part judges as well.
        crossed, bare = (context.estimator.cross_fit(f).errors[s] for f in (current, without))
        sure = preference(problem, base, current.errors[s], without.errors[s],
                          other_part=(FIT, crossed, bare))
    return sure >= criteria.certain_sd


def _simpler(context: SearchContext, current: Fit, w: NamedEffect, without: Fit,
             named: Sequence[NamedEffect]) -> tuple[NamedEffect, Fit]:
    """
    Return (which effect goes, the fit without it) where ``w`` is not missed.

    The other one goes where, without ``w``, it turns into that, its limit, and ``w`` alone
    explains almost as much as both.
    """
    shares, s = context.ranking.shares, w.subsystem
    for other in named:
        if is_limit(w.name, other.name) and Rival(other.name, without).at_edge:
            alone = fit_without(context.estimator, current, other.name)
            if shares(alone)[s] > context.criteria.named_share * shares(current)[s]:
                return other, alone
    return w, without

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
Effects that usually come together, tried at once where one or two of them explain too little.

Several habits of one valve lead a search by single effects astray, as one slow lag looks like
all of them. The file of an effect declares its company, ``Fitting.together``.
"""

from collections.abc import Sequence
import itertools

import numpy as np
from pam_sim.effects.registry import get_effect
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.refit import fit_without
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.subsystems.effects import acts_on
from pam_sim.gap.subsystems.parallel import parallel_map
from pam_sim.gap.subsystems.problem import SubsystemProblem

IN_ITS_PLACE = 3             # effort: so many rivals of each member are fitted beside the others


def groups_in(pool: Sequence[Candidate], subsystem: str) -> list[tuple[Candidate, ...]]:
    """Return the groups all of whose members are in a pool and act in a subsystem."""
    by_effect = {c.effect: c for c in pool if acts_on(c.effect, subsystem)}
    wanted = [(name, *get_effect(name).fitting.together) for name in by_effect
              if get_effect(name).fitting.together]
    return [tuple(by_effect[name] for name in names) for names in wanted
            if all(name in by_effect for name in names)]


def group_of(context: SearchContext, current: Fit, problem: SubsystemProblem
             ) -> tuple[Fit, list[NamedEffect]] | None:
    """
    Return the declared group that explains a subsystem best, as (fit, list of NamedEffect).

    Each member has its rivals beside the others. None where no group is in the pool, where the
    best explains too little for any name, or where the time ran out.

    Parameters
    ----------
    context : SearchContext
        With its candidates as screened.
    current : Fit
        What is named of other subsystems; it stays.
    problem : SubsystemProblem
        Where nothing is named.

    """
    starts = [(group, theta) for group in groups_in(context.pool, problem.subsystem)
              for theta in _starts(group)]
    if not starts or context.out_of_time():
        return None
    estimator = context.estimator
    h = current.hypothesis
    # The best goes on; the others only show where it is.
    fits = parallel_map(lambda s: estimator.fit(
        Hypothesis((*h.effects, *s[0]), h.numbers), (*current.theta, *s[1]), current,
        whole=False, rounds=1), starts)
    found = estimator.polish(min(fits, key=estimator.cost))
    explained = context.ranking.shares(found)[problem.subsystem]
    if explained < context.criteria.greater_part or context.out_of_time():
        return None
    return found, [_named(context, found, place, problem)
                   for place in range(len(h.effects), len(found.hypothesis.effects))]


def _starts(group: tuple[Candidate, ...]) -> list[list[float]]:
    """Return the first and the last start of each member combined, as normalised parameters."""
    each = []
    for c in group:
        ends = (c.starts()[0], c.starts()[-1])
        each.append([[f.coordinate(values[f.name]) for f in c.free]
                     for values in ends[:1 + (ends[0] != ends[1])]])
    return [[x for part in parts for x in part] for parts in itertools.product(*each)]


def _named(context: SearchContext, found: Fit, place: int, problem: SubsystemProblem
           ) -> NamedEffect:
    """Return a member with the fits of what promises most in its place."""
    c, s = found.hypothesis.effects[place], problem.subsystem
    names = {o.name for o in found.hypothesis.effects}
    promising = sorted((q for q in context.screened if q.candidate.name not in names
                        and acts_on(q.candidate.effect, s)),
                       key=lambda q: -q.promise.get(s, 0.0))[:IN_ITS_PLACE]
    rivals = parallel_map(lambda q: _in_its_place(context, found, c.name, q.candidate), promising)
    mine = Rival(c.name, last_of(found, place), context.ranking.shares(found))
    best: dict[str, Rival] = {}
    for r in sorted(rivals, key=lambda r: -r.share[s]):
        best.setdefault(r.name, r)
    return NamedEffect(c.name, s, [mine, *best.values()], (c.name,), [mine])


def _in_its_place(context: SearchContext, found: Fit, name: str, candidate: Candidate) -> Rival:
    alone = Fit(Hypothesis((candidate,)), np.array(candidate.typical_start()), {}, {}, {})
    fit = fit_without(context.estimator, found, name, Rival(candidate.name, alone))
    return Rival(candidate.name, fit, context.ranking.shares(fit))


def last_of(found: Fit, place: int) -> Fit:
    """Return a fit with the effect at a place as its last one."""
    order = [p for p in range(len(found.hypothesis.effects)) if p != place] + [place]
    theta = np.concatenate([found.theta_of(p) for p in order])
    return Fit(Hypothesis(tuple(found.hypothesis.effects[p] for p in order),
                          found.hypothesis.numbers),
               theta, found.known_z, found.errors, found.temper)

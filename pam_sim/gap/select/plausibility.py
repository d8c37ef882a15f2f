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

"""Whether named effects explain enough, without parameters of the model far from their prior."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.data.split import SELECT
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select.candidates import relatives
from pam_sim.gap.select.comparison import gap, preference
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.refit import fit_without
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.subsystems.effects import acts_on
from pam_sim.gap.subsystems.problem import SubsystemProblem


def is_poor(context: SearchContext, problem: SubsystemProblem, current: Fit,
            explained: Mapping[str, float]) -> bool:
    """Return whether a fit explains too little for a name, or by implausible numbers."""
    s, criteria = problem.subsystem, context.criteria
    left = gap(problem, current.errors[s])
    least = criteria.greater_part if left < criteria.near_floor else criteria.named_share
    # What was tried in one formulation alone may be far from the muscle's own.
    forms = [sum(o.name == c.name for o in context.pool) for c in current.hypothesis.effects
             if acts_on(c.effect, s)]
    # And a number that is wrong leaves nothing: its equation is the model's own.
    is_number = any(k.name in current.hypothesis.numbers for k in problem.known)
    if left > criteria.clear_rest and (is_number or max(forms, default=0) > 1):
        least = criteria.named_clearly_share
    return (has_implausible_numbers(problem, current, criteria)
            or explained.get(s, 0.0) < least)


def has_implausible_numbers(problem: SubsystemProblem, current: Fit, criteria: Criteria) -> bool:
    """Return whether a fit takes a parameter of the model far from its prior."""
    return any(abs(z) > criteria.certain_sd
               for z in current.prior_deviations(problem).values())


def with_plausible_numbers(context: SearchContext, current: Fit) -> Fit:
    """
    Return the fit with its numbers near their priors, where it does as well with these.

    A small misfit of the form can pull a number far, and a fit can stop beside its best.
    """
    criteria = context.criteria
    far = [p.subsystem for p in context.problems if current.hypothesis.touches(p)
           and has_implausible_numbers(p, current, criteria)]
    if not far:
        return current
    held = context.estimator.within_box(current, criteria.likely_sd)
    shares = context.ranking.shares(held)
    return held if all(shares[s] > criteria.named_clearly_share for s in far) else current


def likelier_relative(context: SearchContext, current: Fit, w: NamedEffect) -> str | None:
    """
    Return the effect outside of the names that explains a subsystem clearly better than ``w``.

    None where ``w`` leaves no more than a formulation may.
    """
    problem, s = context.problem_of(w.subsystem), w.subsystem
    if not context.is_open(problem, current):
        return None
    criteria = context.criteria
    for c in relatives(context.estimator.rig, context.outputs, w.name):
        if c in current.hypothesis.effects:
            continue
        alone = Fit(Hypothesis((c,)), np.array(c.typical_start()), {}, {}, {})
        found = context.estimator.polish(fit_without(
            context.estimator, current, w.name, Rival(c.name, alone)))
        less = gap(problem, found.errors[s]) < (
            criteria.greater_part * gap(problem, current.errors[s]))
        if less and preference(problem, context.base.errors[s], found.errors[s],
                               current.errors[s]) >= criteria.certain_sd:
            return c.effect
    return None


def with_wrong_numbers(context: SearchContext, current: Fit, named: list[NamedEffect],
                       explained: dict[str, float]
                       ) -> tuple[Fit, list[NamedEffect], dict[str, float]]:
    """
    Return the same with numbers named that hide a gap by themselves.

    A subsystem without a gap has none to explain; where that takes a number far from its
    prior, the number is what is wrong. Unless numbers near their priors move no signal by enough
    for a name: then a small error of a sensor or a stamp may be what moved it.
    """
    limit, near = context.criteria.certain_sd, None
    for problem in context.problems:
        s = problem.subsystem
        if (any(w.subsystem == s for w in named)
                or problem.chi2(context.base.errors[s], SELECT) > 1.0 + context.seen_gap):
            continue
        for place, known in enumerate(problem.known):
            if abs(context.base.prior_deviations(problem).get(known.name, 0.0)) <= limit:
                continue
            h = current.hypothesis
            free = context.estimator.polish(context.estimator.fit(
                Hypothesis(h.effects, (*h.numbers, known.name)), current.theta, current))
            if abs(free.known_z[s][place]) > limit:
                near = near or context.estimator.base_within(context.criteria.likely_sd)
                held = replace(current, known_z={**current.known_z, s: near.known_z[s]})
                if not context.matters(free, held):
                    continue
                rival = Rival(known.name, free, context.ranking.shares(free))
                current, named = free, [*named, NamedEffect(
                    known.name, s, [rival], (known.name,), [rival])]
                explained = {**explained, s: rival.share[s]}
    return current, named, explained

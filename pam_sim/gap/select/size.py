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

"""Whether the size of a named effect differs from none, and is no doing of the measurement."""

from pam_sim.effects.registry import get_effect
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.refit import fit_without
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.subsystems.effects import acts_on
from pam_sim.gap.subsystems.known import LATENCY_PRIOR_S, LATENCY_SD_S


def within_the_chain(found: Fit, place: int, criteria: Criteria) -> bool:
    """
    Return whether an effect is a time so short that any sensor's filter may be its cause.

    A latency stands for the filters that all sensors share; that leaves a part of them. What acts
    in the valve comes before the latency of its signal, and may stand for all of it.
    """
    candidate, values = found.hypothesis.effects[place], found.values()[place]
    longest_s = LATENCY_SD_S + (LATENCY_PRIOR_S if acts_on(candidate.effect, 'valve') else 0.0)
    fitting = get_effect(candidate.effect).fitting
    if fitting.delay:
        return values[fitting.delay] < longest_s
    # A switching valve that opens as late as it closes delays, and swallows the shortest pulses.
    edges = [values[name] for name in fitting.edges if name in values]
    return (bool(edges) and max(edges) < LATENCY_SD_S
            and max(edges) - min(edges) <= criteria.equal_edges * max(edges))


def with_certain_sizes(context: SearchContext, current: Fit, named: list[NamedEffect]
                       ) -> tuple[Fit, list[NamedEffect]]:
    """
    Drop effects whose size does not clearly differ from none, or is the measurement's.

    One of shapes alone, such as the volume of a reservoir, is none at the end of its range.
    A number that was wrong only until something else was found is within its tolerance then.
    """
    for w in list(named):
        z = free_deviations(context, current).get(w.name)
        if z is not None and abs(z) < context.criteria.likely_sd:
            current = fit_without(context.estimator, current, w.name)
            named = [o for o in named if o is not w]
        if (w.name in [c.name for c in current.hypothesis.effects]
                and not _stands(context, w.name, current)):
            plain = _plainer(context, w, current)
            if plain is not None:
                current = plain
                continue
            current = fit_without(context.estimator, current, w.name)
            named = [o for o in named if o is not w]
    return current, named


def free_deviations(context: SearchContext, current: Fit) -> dict[str, float]:
    """Return by name how far the free numbers are from their prior, in its deviations."""
    return {known.name: z for problem in context.problems
            for known, z in zip(problem.known, current.known_z[problem.subsystem])
            if known.name in current.hypothesis.numbers}


def _stands(context: SearchContext, name: str, current: Fit) -> bool:
    """Return whether the size of an effect is certain, and no doing of the measurement."""
    place = [c.name for c in current.hypothesis.effects].index(name)
    of_shapes = all(f.shape for f in current.hypothesis.effects[place].free)
    return not (within_the_chain(current, place, context.criteria)
                or (of_shapes and Rival(name, current).at_edge)
                or context.estimator.certainty(current, place) < context.criteria.certain_size)


def _plainer(context: SearchContext, w: NamedEffect, current: Fit) -> Fit | None:
    """
    Return the fit with a plainer formulation that stands and explains almost as much, or None.

    A further shape that the data hardly show can take the certainty from a size.
    """
    free = next(len(c.free) for c in current.hypothesis.effects if c.name == w.name)
    fewer = [r for r in w.formulations if r.name == w.name
             and len(r.found.hypothesis.effects[-1].free) < free]
    s, shares = w.subsystem, context.ranking.shares
    for r in sorted(fewer, key=lambda r: -r.share[s]):
        found = context.estimator.polish(fit_without(context.estimator, current, w.name, r))
        if (shares(found)[s] > context.criteria.named_share * shares(current)[s]
                and _stands(context, w.name, found)):
            return found
    return None

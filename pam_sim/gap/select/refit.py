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

"""Fits with one effect left out, put in the place of another, or in another formulation."""

from collections.abc import Sequence

from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.subsystems.parallel import parallel_map


def fit_without(estimator: Estimator, current: Fit, name: str, put: Rival | None = None) -> Fit:
    """
    Return the fit without the effect or number of a name.

    ``put`` is a Rival that takes its place: what it adds as the last one.
    """
    h, effects, theta = current.hypothesis, [], []
    for place, c in enumerate(h.effects):
        if c.name != name:
            effects.append(c)
            theta += list(current.theta_of(place))
    numbers = [n for n in h.numbers if n != name]
    if put is not None:
        added = put.found.hypothesis
        if put.name in added.numbers:
            numbers.append(put.name)
        else:
            effects.append(added.effects[-1])
            theta += list(put.found.theta_of(len(added.effects) - 1))
    return estimator.fit(
        Hypothesis(tuple(effects), tuple(numbers)), theta, current, whole=False)


def fit_with(estimator: Estimator, current: Fit, added: Sequence[NamedEffect]) -> Fit:
    """Return the joint fit of what was added on top of the present one."""
    effects, numbers = current.hypothesis.effects, current.hypothesis.numbers
    theta = list(current.theta)
    for named in added:
        found = next(r for r in named.rivals if r.name == named.name).found
        effects += found.hypothesis.effects[len(current.hypothesis.effects):]
        numbers += found.hypothesis.numbers[len(current.hypothesis.numbers):]
        theta += list(found.theta[len(current.theta):])
        if len(added) == 1:
            return found
    return estimator.fit(Hypothesis(effects, numbers), theta, current)


def other_formulations(context: SearchContext, current: Fit, always: bool = False) -> Fit:
    """
    Return the fit with each effect in the formulation that suits the others best.

    Only while something is left to explain, unless ``always``.
    """
    for place in range(len(current.hypothesis.effects)):
        if not always and not any(context.is_open(p, current) for p in context.problems):
            break
        old = current.hypothesis.effects[place]
        others = [c for c in context.pool if c.name == old.name and c != old
                  and len(current.hypothesis.effects) > 1]
        tried = [current, *_in_formulations(context.estimator, current, place, others)]
        current = max(tried, key=lambda f: sum(context.explained(f).values()))
    return current


def within_ranges(context: SearchContext, current: Fit) -> Fit:
    """
    Return the fit with formulations whose numbers are within their ranges, if these do as well.

    A number that changes nothing in these data may end anywhere. The one with the fewest numbers
    is taken.
    """
    for place, (old, values) in enumerate(zip(current.hypothesis.effects, current.values())):
        if old.at_end(values) is None:
            continue
        others = sorted((c for c in context.pool if c.name == old.name and c != old),
                        key=lambda c: len(c.free))
        least = sum(context.explained(current).values()) - context.criteria.done_share
        for tried in _in_formulations(context.estimator, current, place, others):
            found = context.estimator.polish(tried)
            c = found.hypothesis.effects[place]
            if (c.at_end(found.values()[place]) is None
                    and sum(context.explained(found).values()) >= least):
                current = found
                break
    return current


def _in_formulations(estimator: Estimator, current: Fit, place: int,
                     others: Sequence[Candidate]) -> list[Fit]:
    """Return the fits with one effect in other formulations, from their typical sizes."""
    h, rows = current.hypothesis, current.hypothesis.rows(place)
    return parallel_map(lambda c: estimator.fit(
        Hypothesis((*h.effects[:place], c, *h.effects[place + 1:]), h.numbers),
        [*current.theta[:rows.start], *c.typical_start(), *current.theta[rows.stop:]],
        current), others)

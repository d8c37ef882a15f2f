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
Which effects are missing: fit what promises something, rank, keep what holds out.

In each subsystem with a gap, the effect that is best on held-out blocks is added, one at a time.
Then everything is refitted and the rest of the gap is examined again. Where rivals cannot be told
apart they stay together as a set. At the end every effect must be missed when it is left out.
"""

from dataclasses import dataclass, field, replace

from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.select.backward import backward_elimination, Selected
from pam_sim.gap.select.beginnings import begun_otherwise
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.forward import forward_selection
from pam_sim.gap.select.groups import group_of
from pam_sim.gap.select.pairs import pair_of
from pam_sim.gap.select.plausibility import is_poor, with_wrong_numbers
from pam_sim.gap.select.rival import NamedEffect
from pam_sim.gap.select.screening import Screened


@dataclass
class Outcome:
    """
    Result of the search.

    Attributes
    ----------
    base, final : Fit
    named : list of NamedEffect
        In the order in which they were added.
    share : dict of str -> float
        Share of the gap that is explained, by subsystem with a gap.
    complete : bool
        False if the time ran out.
    screened : tuple of Screened
        All candidates at the baseline.
    mistaken : dict of str -> str
        Names that were dropped for an effect that explains more and is none of them.
    first : list of NamedEffect
        What the forward selection added at first, with the rivals of each.

    """

    base: Fit
    final: Fit
    named: list[NamedEffect]
    share: dict[str, float]
    complete: bool = True
    screened: tuple[Screened, ...] = ()
    mistaken: dict[str, str] = field(default_factory=dict)
    first: list[NamedEffect] = field(default_factory=list)


def search(context: SearchContext, only_singly: bool = False) -> Outcome:
    """
    Search for the missing effects and return the Outcome.

    ``only_singly``: effects that explain nothing one by one are not tried together, nor is
    another beginning.
    """
    every = context
    current, added = forward_selection(context, context.base, [])
    first, selected = added, backward_elimination(context, current, added)
    gone = {w.name for w in added} - {w.name for w in selected.named}
    if selected.named and gone and not selected.mistaken:
        # What was dropped may have kept its place from another one.
        context = replace(context, pool=tuple(c for c in context.pool if c.name not in gone))
        again, added = forward_selection(context, selected.fit, selected.named)
        if len(added) > len(selected.named):
            selected = backward_elimination(context, again, added)
    if not only_singly:
        selected = _paired(context, selected)
        # What did not hold alone may hold in its group; long recordings had their chance.
        few = any(p.is_dealt_short for p in context.problems)
        selected = _grouped(every if few else context, selected)
        selected = begun_otherwise(every, selected, first)
    return _outcome(context, selected, first)


def searched_again(context: SearchContext, outcome: Outcome) -> Outcome:
    """
    Return what is found that begins with another effect, where the proof refutes what was.

    The same outcome where no other beginning explains the searched data clearly better.
    """
    before = Selected(outcome.final, outcome.named, outcome.share, outcome.mistaken)
    after = begun_otherwise(context, before, outcome.first, refuted=True)
    return outcome if after is before else _outcome(context, after, outcome.first)


def _outcome(context: SearchContext, selected: Selected, first: list[NamedEffect]) -> Outcome:
    """Return the Outcome of what is selected, with the numbers that hide a gap."""
    fit, named, explained = with_wrong_numbers(
        context, selected.fit, selected.named, selected.explained)
    return Outcome(context.base, fit, named, explained, not context.out_of_time(),
                   context.screened, selected.mistaken, first)


def _paired(context: SearchContext, selected: Selected) -> Selected:
    """
    Return what is left of two effects that explain the largest gap together, if both are.

    Only where one by one named nothing.
    """
    problem = max(
        (p for p in context.problems if context.first_gap[p.subsystem] > context.seen_gap),
        key=lambda p: context.first_gap[p.subsystem], default=None)
    if selected.named or problem is None or selected.mistaken or context.out_of_time():
        return selected
    estimator = context.estimator
    back = context.bookmark()
    pair = pair_of(context, problem)
    if pair is not None:
        found, named = pair
        if not is_poor(context, problem, found, context.explained(found)):
            estimator.take_slopes(found.settings(), found.known_z)
            both = backward_elimination(context, estimator.polish(found), named)
            if len(both.named) == len(named):
                return both
            selected = replace(selected, mistaken=both.mistaken)
    back()
    return selected


def _grouped(context: SearchContext, selected: Selected) -> Selected:
    """
    Return the same with the effects of a group that explains a subsystem, if several stay.

    Only where nothing is named in a subsystem with a gap that is more than the error of the floor.
    """
    least = max(context.seen_gap, context.criteria.near_floor)
    for problem in context.problems:
        s = problem.subsystem
        if (context.first_gap[s] <= least or selected.mistaken
                or any(w.subsystem == s for w in selected.named) or context.out_of_time()):
            continue
        estimator = context.estimator
        back = context.bookmark()
        group = group_of(context, selected.fit, problem)
        if group is not None:
            found, named = group
            context.set_levels(named[0].rivals, [problem])
            if not is_poor(context, problem, found, context.explained(found)):
                estimator.take_slopes(found.settings(), found.known_z)
                several = backward_elimination(context, found, [*selected.named, *named])
                if sum(w.subsystem == s for w in several.named) > 1:
                    selected = several
                    continue
        back()
    return selected

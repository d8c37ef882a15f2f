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
Other beginnings of the forward selection, where the best one leaves something to explain.

The effect that explains most alone need not be one of those that explain all together: a wrong
number and an effect may look like a third effect. The search then begins with another of the first
rivals, as a beam search does.
"""

from collections.abc import Sequence

from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.select.backward import backward_elimination, is_missed, Selected
from pam_sim.gap.select.candidates import split_refinements
from pam_sim.gap.select.comparison import gap
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.forward import forward_selection
from pam_sim.gap.select.refit import fit_without
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.select.screening import flat_spaces_of, spaces_of
from pam_sim.gap.subsystems.problem import SubsystemProblem

BEGINNINGS = 2               # effort: so many other first effects of a subsystem


def begun_otherwise(context: SearchContext, selected: Selected, first: Sequence[NamedEffect],
                    refuted: bool = False) -> Selected:
    """
    Return what a search finds that begins with another effect, if that leaves nothing open.

    Parameters
    ----------
    context : SearchContext
        What the search works with.
    selected : Selected
        What the search has found.
    first : list of NamedEffect
        What its forward selection added, in that order, with the rivals of each.
    refuted : bool
        Whether the proof leaves much of what is named, though the searched data leave little.

    """
    for problem in context.problems:
        best = next((w for w in first if w.subsystem == problem.subsystem), None)
        if best is None or selected.mistaken:
            continue
        s = problem.subsystem
        likely = sorted((r for r in best.rivals if r.name != best.name
                         and r.share.get(s, 0.0) >= context.criteria.first_gain),
                        key=lambda r: -r.share[s])
        for rival in likely[:BEGINNINGS]:
            if context.out_of_time():
                break
            if refuted or _leaves_more(context, problem, selected):
                found = _better(context, problem, selected, best, rival)
                refuted = refuted and found is selected
                selected = found
    return selected


def _leaves_more(context: SearchContext, problem: SubsystemProblem, selected: Selected) -> bool:
    """Tell whether more is left to explain than an error of the noise floor would leave."""
    return context.is_open(problem, selected.fit) and gap(
        problem, selected.fit.errors[problem.subsystem]) > context.criteria.near_floor


def _better(context: SearchContext, problem: SubsystemProblem, selected: Selected,
            best: NamedEffect, rival: Rival) -> Selected:
    """Return what is selected from a beginning with a rival, or what was selected before."""
    s, estimator = problem.subsystem, context.estimator
    back = context.bookmark()
    without = selected.fit
    for w in selected.named:
        if w.subsystem == s:
            without = fit_without(estimator, without, w.name)
    begun = fit_without(estimator, without, best.name, rival)
    estimator.take_slopes(begun.settings(), begun.known_z)
    named = [*(w for w in selected.named if w.subsystem != s),
             NamedEffect(rival.name, s, best.rivals, (rival.name,), [rival])]
    if promise_of_more(context, begun, problem) >= context.criteria.first_gain:
        current, added = forward_selection(context, begun, named)
        # Elimination takes away: it closes nothing.
        if not context.is_open(problem, current):
            found = backward_elimination(context, current, added)
            if (any(w.subsystem == s for w in found.named)
                    and not context.is_open(problem, found.fit)
                    and is_missed(context, problem, found.fit, selected.fit)):
                return found
    back()
    return selected


def promise_of_more(context: SearchContext, begun: Fit, problem: SubsystemProblem
                    ) -> float:
    """Return the most that one effect or free number promises to explain of what is left."""
    s, estimator = problem.subsystem, context.estimator
    plain, _ = split_refinements([
        c for c in context.pool if c.name not in begun.hypothesis.names])
    found = [one.promise.get(s, 0.0) for screened in context.screened_at(begun, plain)
             for one in (screened, screened.flat) if one]
    for spaces in (spaces_of(estimator, begun), flat_spaces_of(estimator, begun)):
        found += list(spaces[s].promise_of_numbers())
    return max(found, default=0.0)

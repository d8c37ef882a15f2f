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

"""The rivals of each named effect, ranked again once the others are in the model."""

from collections.abc import Sequence

from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.refit import fit_without
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.subsystems.effects import acts_on
from pam_sim.gap.subsystems.parallel import parallel_map

RANKED_AGAIN = 4             # effort: so many rivals when further effects are in


def ranked_again(context: SearchContext, current: Fit, named: Sequence[NamedEffect]
                 ) -> tuple[Fit, list[NamedEffect]]:
    """Return (fit, named effects), each the best of its rivals beside the others."""
    found: list[NamedEffect] = []
    for w in named:
        near = _rivals_beside(context, current, w, named)
        if not near:
            found.append(w)
            continue
        rivals = [Rival(w.name, current), *_in_its_place(context, current, w.name, near)]
        for r in rivals:
            r.share = context.ranking.shares(r.found)
        tied = context.ranking.tied(rivals, fit_without(context.estimator, current, w.name),
                                    context.problem_of(w.subsystem))
        if not tied:
            found.append(w)
        else:
            current = tied[0].found
            found.append(NamedEffect(tied[0].name, w.subsystem, rivals,
                                     tuple(r.name for r in tied), w.formulations))
    return current, found


def _rivals_beside(context: SearchContext, current: Fit, w: NamedEffect,
                   named: Sequence[NamedEffect]) -> list[Rival]:
    """Return the rivals of a named effect that are worth a fit beside the others."""
    others = set(current.hypothesis.names) - {w.name}
    rivals = [r for r in w.rivals if r.name != w.name and r.name not in others]
    # What the effect added later replaced may have been ranked before it.
    beside = [r for r in rivals if r.share.get(w.subsystem, 0.0) > 0.0][:RANKED_AGAIN] if any(
        o is not w and o.subsystem == w.subsystem for o in named) else []
    return beside or _across(rivals, w, named, context.criteria.greater_part)


def _in_its_place(context: SearchContext, current: Fit, name: str, rivals: Sequence[Rival]
                  ) -> list[Rival]:
    return parallel_map(lambda r: Rival(
        r.name, fit_without(context.estimator, current, name, r)), rivals)


def _across(rivals: Sequence[Rival], w: NamedEffect, named: Sequence[NamedEffect],
            greater_part: float) -> list[Rival]:
    """
    Return the rivals that had to explain alone what two effects of two subsystems do.

    They act in both and explain the other; beside it they may do as well as this one.
    """
    elsewhere = {o.subsystem for o in named if o.subsystem != w.subsystem}
    return [r for r in rivals if any(
        r.share.get(s, 0.0) > greater_part for s in elsewhere) and any(
            c.name == r.name and acts_on(c.effect, w.subsystem)
            and any(acts_on(c.effect, s) for s in elsewhere)
            for c in r.found.hypothesis.effects)]

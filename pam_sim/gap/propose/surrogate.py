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
A surrogate: known effects that follow the measurement better, though none of them has a name.

A name needs most of a gap to be explained, and no other effect that explains it as well. To
simulate a rig or to tune its controller, less is enough: that the model follows data to which it
was not fitted. So where nothing is named and no term is proposed, effects of valve, muscle and
load are added, as long as the select part prefers it. With them the certify data must be followed
better. Their sizes are those of a fit, and no causes.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pam_sim.effects.registry import get_effect
from pam_sim.gap.data.signals import READABLE
from pam_sim.gap.data.split import FIT, SELECT
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.result import GapResult
from pam_sim.gap.select.comparison import gap, preference
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.ranking import Ranking
from pam_sim.gap.select.rivals import rivals_of
from pam_sim.gap.subsystems.effects import acts_on
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.verify.model import model_of
from pam_sim.gap.verify.validation import share_left, Validation

FILE = 'surrogate_model.yaml'
MAX_ADDED, TRIED = 3, 2      # effort: what is added to a subsystem, and tried for that


@dataclass(frozen=True)
class Surrogate:
    """
    A model without named effects that follows the certify data better than the calibrated one.

    Parameters
    ----------
    names : tuple of str
        Effects and free numbers in it; none of them is found as a cause.
    explained : float
        Share of the squared gap on the certify data that it removes.
    proof : dict of str -> (float, float)
        By signal, the error (rms) on the certify data of the calibrated model and of this one.
    model_yaml : str
        The model.

    """

    names: tuple[str, ...]
    explained: float
    proof: dict[str, tuple[float, float]]
    model_yaml: str

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of gap.json."""
        return {'names': list(self.names), 'file': FILE, 'explained': self.explained,
                'signals': {s: {'rmse_refit': before, 'rmse_surrogate': after}
                            for s, (before, after) in self.proof.items()}}


def in_words(surrogate: Mapping[str, Any]) -> str:
    """Return the entry of gap.json in two sentences."""
    shown = []
    for signal, errors in surrogate['signals'].items():
        factor, unit = READABLE[signal]
        shown.append(f'{signal} {errors["rmse_refit"] * factor:.3g} to '
                     f'{errors["rmse_surrogate"] * factor:.3g} {unit}')
    return (f'A model with {", ".join(surrogate["names"])} follows the proof better: '
            f'{", ".join(shown)} rms. It is a surrogate for simulation and tuning: none of '
            'these is shown to be the cause.')


def add_surrogate(result: GapResult, context: SearchContext, validation: Validation) -> None:
    """
    Set the surrogate of a result, if one is wanted and the certify data confirm it.

    Wanted is one where the verdict is ``unknown`` and no term is proposed.

    Parameters
    ----------
    result : GapResult
        With its verdict and its proposal.
    context : SearchContext
        Of the search.
    validation : Validation
        With the numbers calibrated on all data of the search.

    """
    if result.verdict != 'unknown' or result.proposal is not None:
        return
    both = context.estimator.using(FIT, SELECT)
    base = current = validation.base
    for problem in both.problems:
        # It adds up its errors: what lowers the drift of one motion raises that of another.
        if problem.subsystem == 'valve' and both.rig.valve == 'hsv':
            continue
        found = _selected(context, problem)
        if not found.hypothesis.names or context.out_of_time():
            continue
        added = both.polish(both.fit(
            Hypothesis((*current.hypothesis.effects, *found.hypothesis.effects),
                       (*current.hypothesis.numbers, *found.hypothesis.numbers)),
            np.concatenate([current.theta, found.theta]), current))
        if _is_proved(validation.of(added, current, both), problem):
            current = added
    if current is base:
        return
    proof = validation.of(current, base, both)
    result.surrogate = Surrogate(
        current.hypothesis.names, float(1.0 - proof.unexplained()),
        {s: (g.rmse_refit, g.rmse_after) for s, g in proof.signals().items()},
        model_of(both, current).to_yaml())
    result.remarks.append(in_words(result.surrogate.to_dict()))


def _is_proved(validation: Validation, problem: SubsystemProblem) -> bool:
    """Return whether a part of the gap of a subsystem is gone that matters, and none is worse."""
    criteria = validation.estimator.criteria
    own = {s: g for s, g in validation.signals().items() if s in problem.signals}
    matters = any(g.rmse_refit ** 2 - g.rmse_after ** 2 > (
        criteria.hint_sd * validation.noise[s]) ** 2 for s, g in own.items())
    left = share_left(own.values(), criteria.floor_error)
    return matters and left < 1.0 - criteria.first_gain and not validation.worse()


def _selected(context: SearchContext, problem: SubsystemProblem) -> Fit:
    """Return the baseline with what the select part prefers in one subsystem."""
    learning = context.estimator.using(FIT)
    learning.problems, learning.base = [problem], context.base
    learning.take_slopes([], context.base.known_z)
    others = [p.subsystem for p in context.problems if p is not problem]
    # What acts elsewhere, too, would have to be judged there.
    pool = tuple(c for c in context.pool if get_effect(c.effect).subsystem != 'sensor'
                 and not any(acts_on(c.effect, s) for s in others))
    alone = replace(
        context, estimator=learning, ranking=Ranking(learning, context.base, context.seen_gap),
        pool=pool, screened=tuple(s for s in context.screened if s.candidate in pool))
    current = context.base
    while len(current.hypothesis.names) < MAX_ADDED and alone.is_open(problem, current):
        better = _better(alone, problem, current)
        if better is None:
            break
        current = better
        learning.take_slopes(current.settings(), current.known_z)
    return current


def _better(context: SearchContext, problem: SubsystemProblem, current: Fit) -> Fit | None:
    """Return the fit with the best effect more, None where the select part wants none."""
    rivals, _ = rivals_of(context, current, [problem])
    for rival in sorted(rivals, key=lambda r: -r.share[problem.subsystem])[:TRIED]:
        found = context.estimator.polish(rival.found)
        if _is_preferred(context, problem, current, found):
            return found
    return None


def _is_preferred(context: SearchContext, problem: SubsystemProblem, current: Fit, found: Fit
                  ) -> bool:
    """Return whether the select part prefers a fit, by more than shares that count as equal."""
    s, criteria = problem.subsystem, context.criteria
    before, after = gap(problem, current.errors[s]), gap(problem, found.errors[s])
    least = max(context.seen_gap, criteria.close_share * before)
    return before - after > least and preference(
        problem, context.base.errors[s], found.errors[s], current.errors[s], quiet=True
        ) >= criteria.hint_sd

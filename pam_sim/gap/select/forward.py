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

"""Forward selection: one effect after another, the best on held-out blocks, then the rest."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from pam_sim.effects.registry import effects
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.select.comparison import gap
from pam_sim.gap.select.context import SearchContext
from pam_sim.gap.select.order import is_sensor_error
from pam_sim.gap.select.pairs import pair_beside
from pam_sim.gap.select.plausibility import is_poor
from pam_sim.gap.select.refit import fit_with, other_formulations
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.select.rivals import numbers_before_sensors, rivals_of
from pam_sim.gap.subsystems.effects import acts_on
from pam_sim.gap.subsystems.problem import SubsystemProblem

MAX_EFFECTS = 3              # effort: so many of a subsystem are added one by one


@dataclass(frozen=True)
class Closed:
    """Where a subsystem found no winner: the fit at which it was tried, and the rivals there."""

    at: Fit
    rivals: Sequence[Rival]


def forward_selection(context: SearchContext, current: Fit, named: list[NamedEffect]
                      ) -> tuple[Fit, list[NamedEffect]]:
    """Return (fit, named effects) with more of them, as long as a subsystem is open for one."""
    closed: dict[str, Closed] = {}
    while not context.out_of_time():
        open_problems = [p for p in context.problems
                         if p.subsystem not in closed and context.is_open(p, current)
                         and sum(w.subsystem == p.subsystem for w in named) < MAX_EFFECTS]
        added = _round(context, current, open_problems, closed) if open_problems else []
        if not added and named and closed:
            added = _reopened(context, current, closed)
        if added:
            current = other_formulations(context, fit_with(context.estimator, current, added))
        else:
            current, added = _two_more(context, current, named, closed)
        if not added:
            break
        named = [*named, *added]
        context.estimator.take_slopes(current.settings(), current.known_z)
    return current, named


def _round(context: SearchContext, current: Fit, open_problems: Sequence[SubsystemProblem],
           closed: dict[str, Closed]) -> list[NamedEffect]:
    """Return what is added in the open subsystems; ``closed`` tells where one was not."""
    joint, winners, rivals = _winners(context, current, open_problems)
    if joint is not None:
        return [joint]
    added = [w for w in winners if not mends_a_formulation(context, w, current)]
    won = {w.subsystem for w in added}
    closed.update((p.subsystem, Closed(current, rivals)) for p in open_problems
                  if p.subsystem not in won)
    return [w for i, w in enumerate(added) if w.name not in [o.name for o in added[:i]]]


def _winners(context: SearchContext, current: Fit, problems: Sequence[SubsystemProblem],
             pool: Iterable[Candidate] | None = None
             ) -> tuple[NamedEffect | None, list[NamedEffect], list[Rival]]:
    """
    Return (what explains several subsystems or None, what wins in each of them, the rivals).

    An error of a sensor wins only where the numbers of load and valve were tried as well.
    """
    rivals, fitted = rivals_of(context, current, problems, pool)
    joint, winners = _ranked(context, current, problems, rivals, fitted)
    if any(is_sensor_error(w.name) for w in (joint, *winners) if w):
        more = numbers_before_sensors(context, current, problems, {r.name for r in rivals})
        rivals, fitted = [*rivals, *more], [*fitted, *more]
        context.set_levels(rivals, problems)
        joint, winners = _ranked(context, current, problems, rivals, fitted)
    return joint, winners, rivals


def _ranked(context: SearchContext, current: Fit, problems: Sequence[SubsystemProblem],
            rivals: Sequence[Rival], fitted: Sequence[Rival]
            ) -> tuple[NamedEffect | None, list[NamedEffect]]:
    joint = context.ranking.joint_winner(rivals, current, problems, fitted)
    if joint is not None:
        return joint, []
    winners = [context.ranking.winner(rivals, current, p, fitted) for p in problems]
    return None, [w for w in winners if w is not None]


def mends_a_formulation(context: SearchContext, winner: NamedEffect, current: Fit) -> bool:
    """
    Return whether what wins a small rest is of a family that is in.

    Then it mends the formulation of that one: two kinds of friction make a third.
    """
    s = winner.subsystem
    rest = gap(context.problem_of(s), current.errors[s])
    if rest > context.criteria.formulation_share * context.first_gap[s]:
        return False
    families = {effects()[c.effect].family for c in current.hypothesis.effects
                if acts_on(c.effect, s)}
    return winner.name in effects() and effects()[winner.name].family in families


def _reopened(context: SearchContext, current: Fit, closed: dict[str, Closed]
              ) -> list[NamedEffect]:
    """
    Return what is added in a subsystem that found no winner before others found theirs.

    An effect of a sensor that two of them share explains neither as long as another effect,
    too, acts in one of them; beside that one it may.
    """
    problems = context.problems
    if len(problems) < 2:
        return []
    shared = [c for c in context.pool if all(acts_on(c.effect, p.subsystem) for p in problems)]
    for problem in problems:
        s = problem.subsystem
        if s in closed and closed[s].at is not current and context.is_open(problem, current):
            _, winners, _ = _winners(context, current, [problem], shared)
            if winners:
                del closed[s]
                return winners
    return []


def _two_more(context: SearchContext, current: Fit, named: Sequence[NamedEffect],
              closed: dict[str, Closed]) -> tuple[Fit, list[NamedEffect]]:
    """
    Return (fit, two effects more) of a subsystem whose names explain too little, once.

    The present fit and nothing where there are no such two.
    """
    explained = context.explained(current)
    for problem in context.problems:
        s = problem.subsystem
        mine = sum(w.subsystem == s for w in named)
        if (s in closed and 0 < mine < MAX_EFFECTS and context.is_open(problem, current)
                and is_poor(context, problem, current, explained)):
            rivals = closed.pop(s).rivals
            # A large misfit has little weight: a number that is far off stays near its prior.
            more = numbers_before_sensors(context, current, [problem], {r.name for r in rivals})
            found = pair_beside(context, current, problem, [*rivals, *more])
            if found is not None:
                return found
    return current, []

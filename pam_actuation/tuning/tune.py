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
Offline tuning: settings and initial rules of a controller, over closed-loop rollouts.

The settings are searched in the unit cube of ``space`` (``search``). Then the controller learns
its initial rules (``initial_rules``). Both are judged on runs that were not part of the search.
The same seed gives the same result with any number of ``workers``.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
import math
from pathlib import Path
import time
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.control.controller_text import controller_to_yaml
from pam_actuation.control.made_for import facts_of
from pam_actuation.control.modes.tracked import JOINT, tracked_by
from pam_actuation.tuning.cost import LOST
from pam_actuation.tuning.initial_rules import initial_rules
from pam_actuation.tuning.loop_checks import check_tracking
from pam_actuation.tuning.loops_of_rigs import loops_of
from pam_actuation.tuning.problem import cost_on, costs_of, Problem, rebuild
from pam_actuation.tuning.search import BUDGET_USED, default_members, minimise, SMALLEST
from pam_actuation.tuning.space import Axis, check_axes, default_axes, from_unit, to_unit
from pam_actuation.workers import Workers
from pam_sim.annotations import FloatArray
from pam_sim.declared import check_whole
from pam_sim.errors import InputError
from pam_sim.files import write_text

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment
    from pam_actuation.tuning.problem import Law, Loop
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

WARM = 'pam_actuation.tuning.rollouts', 'pam_actuation.tuning.joint_rollouts'
HELD_OUT_SEED = 7919      # added to the seed for the noise the search never sees
SHOWN_UNIT = {'mm': ' mm', 'deg': '°'}      # of costs, as people read it


@dataclass(frozen=True)
class HeldOutRun:
    """
    Costs of one held-out run.

    ``rig`` counts the rigs, 0 is the model; ``seed`` is that of the sensor noise; ``before``
    and ``after`` are costs of the controllers from before and as written.
    """

    experiment: str
    rig: int
    seed: int
    before: float
    after: float


@dataclass
class TuneResult:
    """
    Outcome of a tuning.

    Attributes
    ----------
    controller : CompiledController or JointController
        With the tuned settings and initial rules, ready to run.
    changed : dict of str -> (float, float)
        Settings before and after.
    history : list of (int, float)
        Rollouts done and best training cost so far.
    cost_before, cost_after : float
        Training cost, in ``unit``, of ``start`` and of ``controller``.
    held_out_before, held_out_after : float
        The same on runs the search did not see.
    improved : bool
        The held-out cost fell; otherwise ``controller`` has the settings from before, and their
        costs count as those after.
    rollouts : int
        Closed-loop runs simulated, the held-out ones included.
    simulated_s : float
        Their length in all.
    seconds : float
        Wall-clock time.
    ended : str
        Why the search ended.
    rules : str
        Which initial rules were chosen, '' for a controller without rules.
    left_out : int
        Pairs of rig and experiment left out because the rig cannot reach it.
    axes : tuple of space.Axis
        What was searched.
    start : object
        The controller from before.
    problem, check : Problem
        The closed loops of the search and of the held-out check.
    unit : str
        Of all costs: 'mm', of a joint 'deg'.
    held_out_found : float
        Held-out cost of what was found, also where that was dropped.
    held_out_runs : list of HeldOutRun
        The held-out costs one by one; their means are those above.
    refused : list of str
        Of every searched point that has no controller: why. It counted as lost.

    """

    controller: 'Law'
    changed: dict[str, tuple[float, float]]
    history: list[tuple[int, float]]
    cost_before: float
    cost_after: float
    held_out_before: float
    held_out_after: float
    improved: bool
    rollouts: int
    simulated_s: float
    seconds: float
    ended: str = ''
    rules: str = ''
    left_out: int = 0
    axes: tuple[Axis, ...] = field(default=(), repr=False)
    start: 'Law | None' = field(default=None, repr=False)
    problem: Problem | None = field(default=None, repr=False)
    check: Problem | None = field(default=None, repr=False)
    unit: str = 'mm'
    held_out_found: float = math.nan
    held_out_runs: list[HeldOutRun] = field(default_factory=list, repr=False)
    refused: list[str] = field(default_factory=list, repr=False)

    def to_yaml(self) -> str:
        """Return the tuned controller as YAML text for ``load_controller``."""
        return controller_to_yaml(self.controller)

    def save(self, path: Path, rules_path: Path | None = None) -> None:
        """
        Write the tuned controller to a file, whole or not at all.

        With ``rules_path`` its rules go into a file of their own, which the first one names;
        both should lie in one folder.

        Raises
        ------
        InputError
            A file cannot be written.

        """
        if rules_path is None or self.controller.rules is None:
            write_text(path, self.to_yaml(), parents=False)
            return
        self.controller.rules.save(rules_path)
        write_text(path, controller_to_yaml(self.controller, rules_file=rules_path),
                   parents=False)

    def to_dict(self) -> dict[str, Any]:
        """Return the outcome as plain data."""
        return {
            'improved': self.improved,
            f'cost_before_{self.unit}': self.cost_before,
            f'cost_after_{self.unit}': self.cost_after,
            f'held_out_before_{self.unit}': self.held_out_before,
            f'held_out_after_{self.unit}': self.held_out_after,
            'held_out_runs': [
                {'experiment': one.experiment, 'rig': one.rig, 'seed': one.seed,
                 f'before_{self.unit}': one.before, f'after_{self.unit}': one.after}
                for one in self.held_out_runs],
            'rollouts': self.rollouts, 'simulated_s': self.simulated_s, 'seconds': self.seconds,
            'ended': self.ended, 'initial_rules': self.rules, 'left_out': self.left_out,
            'without_controller': len(self.refused),
            'changed': {name: {'before': before, 'after': after}
                        for name, (before, after) in self.changed.items()}}

    def text(self) -> str:
        """Return the outcome for people."""
        shown = SHOWN_UNIT[self.unit]
        searched = set() if self.problem is None else {
            loop.experiment.name for loop in self.problem.loops}
        others = [one for one in self.held_out_runs if one.experiment not in searched]
        verdict = f'-> {self.held_out_after:.3f}{shown}, better'
        if sum(one.after - one.before for one in others) > 0.0:
            verdict += ' on what was searched, worse on what was not'
        elif not others:
            verdict += ' on the motions that were searched; no other was tried'
        if not self.improved:
            verdict = (f'before, {self.held_out_found:.3f}{shown} with what was found, '
                       'not better: settings left as they were')
        if not self.improved and self.ended == BUDGET_USED:
            verdict += '; more --rollouts may find better ones'
        lines = [
            f'{self.rollouts} rollouts in {self.seconds:.1f} s '
            f'({self.simulated_s / max(self.seconds, 1e-9):,.0f} times real time), {self.ended}; '
            f'cost on held-out runs {self.held_out_before:.3f}'
            f'{"" if self.improved else shown} {verdict}']
        names = list(dict.fromkeys(one.experiment for one in self.held_out_runs))
        for name in names if len(names) > 1 else ():
            before, after = (np.mean([
                (one.before, one.after) for one in self.held_out_runs
                if one.experiment == name], axis=0))
            also = '' if name in searched else ', not searched'
            lines.append(f'  held-out {name}{also}: {before:.3f} -> {after:.3f}{shown}')
        if self.rules:
            lines.append(f'  initial rules: {self.rules}')
        if self.left_out:
            lines.append(f'  {self.left_out} pairs of rig and experiment left out: beyond what '
                         'the rig can reach')
        if self.refused:
            lines.append(f'  {len(self.refused)} searched points have no controller, such as: '
                         f'{self.refused[0]}')
        lines += [f'  {name}: {before:g} -> {after:g}'
                  for name, (before, after) in self.changed.items()]
        return '\n'.join(lines)


def _as_list(thing: Any) -> list[Any]:
    return list(thing) if isinstance(thing, (list, tuple)) else [thing]


def _check_counts(budget: int, patience: int, population: int | None) -> None:
    """Refuse counts that no search can have."""
    for name, number, lowest in (('budget', budget, 1), ('patience', patience, 0),
                                 ('population', population or SMALLEST, SMALLEST)):
        check_whole(number, lowest, name)


def tune(rig: 'Rig | JointRig | Sequence[Rig | JointRig]', controller: 'Law',
         experiment: 'Experiment | list[Experiment]', budget: int = 400, seed: int = 0,
         jobs: int = 1, progress: Callable[[int], object] | None = None,
         axes: tuple[Axis, ...] | None = None,
         held_out: 'Experiment | list[Experiment] | None' = None,
         population: int | None = None, patience: int = 0, cluster: str | None = None,
         held_out_rigs: 'Sequence[Rig | JointRig] | None' = None,
         learn_rules: bool = True, preview_s: float = math.inf) -> TuneResult:
    """
    Tune settings and initial rules of a controller on a model.

    Parameters
    ----------
    rig : Rig or JointRig, or list of either
        Cost is the mean over all (nominal and randomised ones, for instance). The valve driver
        knows the data sheet of the first one only.
    controller : CompiledController or JointController
        Start of the search; not changed. Its rules are where every rollout starts.
    experiment : Experiment or list of Experiment
        Domain ``contraction``, of a joint ``joint_angle``; cost is the mean over all.
    budget : int
        Largest number of training rollouts of the search.
    seed : int
        Of the search and, apart from the held-out runs, of the sensor noise.
    jobs : int
        Parallel rollouts on this machine; -1 for one a core.
    progress : callable, optional
        Called with the number of rollouts done after every generation.
    axes : tuple of space.Axis, optional
        What to tune; ``space.default_axes`` by default.
    held_out : Experiment or list, optional
        Judges the result, with other noise; the training experiments by default.
    population : int, optional
        Members of a generation; chosen from the budget by default.
    patience : int
        Stop after so many generations without improvement; 0 = never.
    cluster : str, optional
        Address of a Dask or Ray cluster to run on, see ``pam_actuation.workers``.
    held_out_rigs : list of Rig, optional
        Rigs of the held-out runs; by default those of the search.
    learn_rules : bool
        Whether a controller with rules gets new initial ones.
    preview_s : float
        How far ahead the controller is told the reference; without limit by default.

    Returns
    -------
    TuneResult

    Raises
    ------
    InputError
        Budget too small, a count out of range, no rig, no experiment, unknown axis, experiment
        not in what the controller tracks or beyond all rigs, cluster not to be had.

    """
    began = time.perf_counter()
    check_tracking(_as_list(rig), _as_list(experiment) + _as_list(held_out or []), controller)
    axes = tuple(axes) if axes is not None else default_axes(controller)
    check_axes(axes, controller.settings)
    rigs: list[Rig | JointRig] = _as_list(rig)
    experiments: list[Experiment] = _as_list(experiment)
    for name, given in (('rig', rigs), ('experiment', experiments)):
        if not given:
            raise InputError('at least one is needed', name)
    _check_counts(budget, patience, population)
    Workers(jobs, cluster)          # refuses what cannot be, before loops are made
    train, left_out = loops_of(rigs, experiments, seed, controller, rigs[0], preview_s)
    tested = list(held_out_rigs or rigs)
    test, _ = loops_of(tested, _as_list(held_out or experiments),
                       seed + HELD_OUT_SEED, controller, rigs[0], preview_s)
    members = population or default_members(budget // len(train))
    generations = budget // (members * len(train))
    if members < SMALLEST or generations < 2:
        raise InputError(
            f'a budget of {budget} rollouts is too small: '
            f'{2 * len(train) * max(members, SMALLEST)} at least', 'budget')
    before = {axis.name: controller.settings[axis.name] for axis in axes}
    problem, check = Problem(train, controller), Problem(test, controller)
    done = [0]
    history: list[tuple[int, float]] = []
    refused: list[str] = []         # why, of each point without a controller

    with Workers(jobs, cluster, modules=WARM) as workers:
        def of_generation(points: list[FloatArray]) -> list[float]:
            costs = costs_of(workers, problem, [from_unit(axes, p) for p in points])
            done[0] += len(points) * len(train)
            refused.extend(filter(None, (
                problem.refusal(from_unit(axes, point))
                for point, cost in zip(points, costs) if cost == LOST)))
            history.append((done[0], min(costs + [cost for _, cost in history[-1:]])))
            if progress is not None:
                progress(min(done[0], budget))
            return costs

        def held_out_costs(of: Problem) -> list[float]:
            return workers.map(cost_on, of, [({}, i) for i in range(len(test))])

        cost_before = costs_of(workers, problem, [{}])[0]
        costs_before = held_out_costs(check)
        held_before = float(np.mean(costs_before))
        history.append((0, cost_before))
        found = minimise(
            of_generation, to_unit(axes, before), members, generations, seed, patience)
        after, cost_after = from_unit(axes, found.point), found.cost
        if cost_after >= cost_before:       # the start may lie outside the box of the axes
            after, cost_after = {}, cost_before
        tuned, rules, extra = rebuild(controller, after), '', 0
        if learn_rules and controller.rules is not None:
            (rules, table, cost_after), extra = initial_rules(workers, problem, after, rigs[0])
            tuned = rebuild(controller, after, table)
        costs_after = held_out_costs(Problem(test, tuned))
    held_after = held_found = float(np.mean(costs_after))
    improved = held_after < held_before
    if not improved:
        tuned, rules = rebuild(controller, {}), ''
        cost_after, held_after, costs_after = cost_before, held_before, costs_before
    tuned.made_for, tuned.other_rig = facts_of(rigs[0]), ''
    changed = {name: (value, tuned.settings[name]) for name, value in before.items()
               if tuned.settings[name] != value}
    rollouts = done[0] + len(train) + 2 * len(test) + extra
    return TuneResult(
        controller=tuned, changed=changed, history=history, cost_before=cost_before,
        cost_after=cost_after, held_out_before=held_before, held_out_after=held_after,
        improved=improved, rollouts=rollouts, simulated_s=_simulated_s(train, test, rollouts),
        seconds=time.perf_counter() - began, ended=found.reason, rules=rules, left_out=left_out,
        axes=axes, start=controller, problem=problem, check=check,
        unit='deg' if tracked_by(controller) == JOINT else 'mm', held_out_found=held_found,
        held_out_runs=_held_out_runs(
            test, tested, seed + HELD_OUT_SEED, costs_before, costs_after),
        refused=refused)


def _simulated_s(train: 'Sequence[Loop]', test: 'Sequence[Loop]', rollouts: int) -> float:
    """Return how long all rollouts are together [s], each held-out run among them twice."""
    train_s, test_s = (
        sum(loop.experiment.duration_s for loop in loops) for loops in (train, test))
    return (rollouts - 2 * len(test)) * (train_s / len(train)) + 2 * test_s


def _held_out_runs(test: 'Sequence[Loop]', rigs: 'Sequence[Rig | JointRig]', seed: int,
                   before: Sequence[float], after: Sequence[float]) -> list[HeldOutRun]:
    """Return the costs of each held-out run; its rig counts among ``rigs``."""
    numbers = {id(one): k for k, one in enumerate(rigs)}
    return [HeldOutRun(loop.experiment.name, numbers[id(loop.rig)], seed, *costs)
            for loop, *costs in zip(test, before, after)]

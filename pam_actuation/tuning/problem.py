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

"""What a set of controller settings costs on a set of closed loops."""

from collections.abc import Sequence
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.control.compiled_controller import CompiledController
from pam_actuation.control.modes.joint import JointController
from pam_actuation.tuning.cost import LOST
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_actuation.control.sofc.rule_table import RuleBase
    from pam_actuation.tuning.closed_loop import ClosedLoop
    from pam_actuation.tuning.joint_loop import JointLoop
    from pam_actuation.workers import Workers

    Loop = ClosedLoop | JointLoop

Law = CompiledController | JointController


class Problem:
    """
    Closed loops and the controller a search begins with.

    Parameters
    ----------
    loops : list of ClosedLoop or of JointLoop
    controller : CompiledController or JointController
        Every rollout starts from its rules.

    """

    def __init__(self, loops: 'Sequence[Loop]', controller: Law) -> None:
        self.loops = list(loops)
        self.controller = controller

    def costs(self, settings: dict[str, float]) -> FloatArray:
        """
        Return the cost [mm, of a joint degrees] of settings on every loop, shape (loops,).

        Settings without a controller (no solution of the Riccati equation) count as lost.

        Raises
        ------
        InputError
            The controller itself cannot be built again, without other settings.

        """
        costs = np.full(len(self.loops), LOST)
        try:
            controller = rebuild(self.controller, settings)
        except InputError:
            if not settings:
                raise
            return costs
        for i, loop in enumerate(self.loops):
            if i and controller.rules is not None:
                controller = rebuild(self.controller, settings)      # none of what it learned
            costs[i] = loop.cost(controller)
        return costs

    def cost_on(self, settings: dict[str, float], i: int) -> float:
        """Return the entry of ``costs`` for one loop."""
        return float(Problem([self.loops[i]], self.controller).costs(settings)[0])

    def refusal(self, settings: dict[str, float]) -> str:
        """Return why settings have no controller, '' where they have one."""
        try:
            rebuild(self.controller, settings)
        except InputError as error:
            return str(error)
        return ''

    def cost(self, settings: dict[str, float]) -> float:
        """Return the mean cost [mm, of a joint degrees] of settings over the loops."""
        return float(np.mean(self.costs(settings)))


def cost_of(problem: Problem, settings: dict[str, float]) -> float:
    """Return ``problem.cost(settings)``: the function workers are given."""
    return problem.cost(settings)


def cost_on(problem: Problem, task: tuple[dict[str, float], int]) -> float:
    """Return the cost of a task of settings and loop: the smallest one for workers."""
    return problem.cost_on(*task)


def costs_of(workers: 'Workers', problem: Problem,
             points: Sequence[dict[str, float]]) -> list[float]:
    """
    Return the cost of many settings, equal to ``problem.cost`` to the bit.

    Parameters
    ----------
    workers : Workers
        Where the rollouts run. A task is one loop where tasks leave this process, or where
        the settings are too few for all threads; else all loops of one point.
    problem : Problem
        The closed loops and the controller.
    points : list of dict of str -> float
        Settings of every point.

    """
    if not workers.spread and 2 * workers.size <= len(points):
        return workers.map(cost_of, problem, points)
    # Long ones first, so that at the end nobody waits for one of them.
    order = sorted(
        ((k, i) for k in range(len(points)) for i in range(len(problem.loops))),
        key=lambda task: -problem.loops[task[1]].experiment.duration_s)
    costs = np.empty((len(points), len(problem.loops)))
    for task, cost in zip(order, workers.map(
            cost_on, problem, [(points[k], i) for k, i in order])):
        costs[task] = cost
    return [float(np.mean(of_point)) for of_point in costs]


def rebuild(controller: Law, settings: dict[str, float],
            rules: 'RuleBase | None' = None) -> Any:
    """
    Return a fresh controller of the same kind and rig with other settings.

    It starts from ``rules``, by default from those of ``controller`` where the settings leave
    them their meaning.
    """
    return controller.with_settings(settings, rules)

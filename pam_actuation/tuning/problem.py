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

from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.control.lqi import LqiController
from pam_actuation.control.pid import PidController
from pam_actuation.control.sofc.controller import SelfOrganizingFuzzyController
from pam_actuation.control.sofc.settings import SCALING
from pam_actuation.tuning.cost import LOST_MM, tracking_cost_mm
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_actuation.control.compiled_controller import CompiledController
    from pam_actuation.control.sofc.rule_table import RuleBase
    from pam_actuation.tuning.closed_loop import ClosedLoop


class Problem:
    """
    Closed loops and the controller a search begins with.

    Parameters
    ----------
    loops : list of ClosedLoop
    controller : SelfOrganizingFuzzyController, PidController or LqiController
        Every rollout starts from its rules.

    """

    def __init__(self, loops: 'list[ClosedLoop]', controller: 'CompiledController') -> None:
        self.loops = list(loops)
        self.controller = controller

    def costs_mm(self, settings: dict[str, float]) -> FloatArray:
        """
        Return the cost [mm] of settings on every loop, shape (loops,).

        Settings without a controller (no solution of the Riccati equation) count as lost.
        """
        costs = np.full(len(self.loops), LOST_MM)
        try:
            controller = rebuild(self.controller, settings)
        except InputError:
            return costs
        for i, loop in enumerate(self.loops):
            if i and controller.rules is not None:
                controller = rebuild(self.controller, settings)      # none of what it learned
            log = loop.run_raw(controller)
            costs[i] = tracking_cost_mm(loop.reference_m - log['contraction_m'], loop.start_tick)
        return costs

    def cost_mm(self, settings: dict[str, float]) -> float:
        """Return the mean cost [mm] of settings over the loops."""
        return float(np.mean(self.costs_mm(settings)))


def cost_of(problem: Problem, settings: dict[str, float]) -> float:
    """Return ``problem.cost_mm(settings)``: the function workers are given."""
    return problem.cost_mm(settings)


def rebuild(controller: 'CompiledController', settings: dict[str, float],
            rules: 'RuleBase | None' = None) -> 'CompiledController':
    """
    Return a fresh controller of the same kind and rig with other settings.

    It starts from ``rules``, by default from those of ``controller`` where the settings leave
    them their meaning.
    """
    fresh = _rebuilt(controller, {**controller.settings, **settings}, rules)
    fresh.made_for, fresh.other_rig = controller.made_for, controller.other_rig
    return fresh


def _rebuilt(controller: 'CompiledController', merged: dict[str, float],
             rules: 'RuleBase | None') -> 'CompiledController':
    if isinstance(controller, PidController):
        return PidController(controller.static_inverse, merged, controller.rig_name)
    if isinstance(controller, LqiController):
        return LqiController(controller.model, merged, controller.rig_name)
    if rules is None and all(merged[name] == controller.settings[name] for name in SCALING):
        rules = controller.rules
    fresh = SelfOrganizingFuzzyController(
        controller.static_inverse, merged, rules, controller.rig_name)
    fresh.freeze_learning = controller.freeze_learning
    return fresh

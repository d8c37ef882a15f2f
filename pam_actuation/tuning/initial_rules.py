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
The rules a tuned controller begins with: learned on the model, not drawn by hand.

On every rig the controller tracks the experiments one after the other, the last one first, and
keeps what it learns. List slow ones first: they then refine what fast ones taught roughly. Three
tables are then compared: the old one, the one of the nominal rig (of the first within reach if
that is beyond it), and the mean over all rigs. The criterion is the cost of tuned settings that
start from them.
"""

from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.tuning.problem import Problem, rebuild

if TYPE_CHECKING:
    from pam_actuation.control.sofc.rule_table import RuleBase
    from pam_actuation.workers import Workers
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

_PASSES = 3                     # times a rig's experiments are tracked


def initial_rules(workers: 'Workers', problem: Problem, settings: dict[str, float],
                  nominal: 'Rig | JointRig') -> 'tuple[tuple[str, RuleBase, float], int]':
    """
    Return (name, rules, cost) of the best table for a start, and the rollouts it took.

    Parameters
    ----------
    workers : Workers
        Where the rollouts run.
    problem : Problem
        Its controller has rules; its first loops are those of the nominal rig, if it has any.
    settings : dict
        Tuned settings.
    nominal : Rig or JointRig
        Its table is called so.

    """
    rigs = list(dict.fromkeys(id(loop.rig) for loop in problem.loops))
    groups = [[i for i, loop in enumerate(problem.loops) if id(loop.rig) == rig]
              for rig in rigs]
    learned = workers.map(_learn, problem, [(group, settings) for group in groups])
    before = rebuild(problem.controller, settings).rules
    assert before is not None
    first = 'nominal rig' if problem.loops[0].rig is nominal else 'first rig within reach'
    tables = [('as before', before), (f'learned on the {first}', as_initial(learned[0]))]
    if len(learned) > 1:
        tables.append((f'mean of {len(learned)} rigs', as_initial(mean_rules(learned))))
    costs = workers.map(
        _cost_from, problem, [(rules, settings, i) for _, rules in tables
                              for i in range(len(problem.loops))])
    means = np.mean(np.reshape(costs, (len(tables), -1)), axis=1)
    best = int(np.argmin(means))
    count = _PASSES * len(problem.loops) + len(costs)
    name, rules = tables[best]
    return (name, rules, float(means[best])), count


def mean_rules(several: 'list[RuleBase]') -> 'RuleBase':
    """
    Return a rule base whose every rule and number of the model is the mean of several.

    How well the numbers are known covers their scatter. Rules without a model found count not.
    """
    mean = several[0].copy()
    for name in mean.NAMES:
        getattr(mean, name)[...] = np.mean([getattr(one, name) for one in several], axis=0)
    found = [one for one in several if np.any(one.covariance)]
    if found:
        numbers = np.array([one.numbers for one in found])
        mean.numbers[...] = np.mean(numbers, axis=0)
        away = numbers - mean.numbers
        mean.covariance[...] = (
            np.mean([one.covariance for one in found], axis=0) + away.T @ away / len(found))
    return mean


def as_initial(rules: 'RuleBase') -> 'RuleBase':
    """Return a copy whose present rules are its initial ones and which never fired."""
    fresh = rules.copy()
    for name in fresh.NAMES:
        getattr(fresh, f'{name}_initial')[...] = getattr(fresh, name)
        getattr(fresh, f'{name}_fired')[...] = 0.0
    return fresh


def _learn(problem: Problem, task: tuple[list[int], dict[str, float]]) -> 'RuleBase':
    """Return the rules after tracking the experiments of one rig; run by workers."""
    group, settings = task
    controller = rebuild(problem.controller, settings)
    for _ in range(_PASSES):
        for i in reversed(group):
            problem.loops[i].run_raw(controller)
    assert controller.rules is not None
    return controller.rules


def _cost_from(problem: Problem, task: 'tuple[RuleBase, dict[str, float], int]') -> float:
    """Return the cost on one loop of settings that start from given rules."""
    rules, settings, i = task
    controller = rebuild(problem.controller, settings, rules)
    return Problem([problem.loops[i]], controller).cost({})

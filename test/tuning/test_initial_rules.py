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

"""Initial rules: learned on the rigs of the search, the best table chosen, in shape to start."""

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.experiments.experiment import load_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.initial_rules import as_initial, initial_rules, mean_rules
from pam_actuation.tuning.loops_of_rigs import reachable
from pam_actuation.tuning.problem import Problem, rebuild
from pam_actuation.tuning.random_rigs import random_rigs
from pam_actuation.tuning.tune import tune
from pam_actuation.workers import Workers
from pam_sim import load_rig
from pam_sim.errors import InputError
import pytest


@pytest.fixture(scope='module')
def rig():
    return load_rig('dmsp_5_300_realistic')


@pytest.fixture(scope='module')
def problem(rig):
    experiment = load_experiment('tuning_half_hz')
    return Problem(
        [ClosedLoop(one, experiment) for one in (rig, *random_rigs(rig, 1, seed=3))],
        load_controller('sofc_ppr', rig))


def test_a_learned_table_is_chosen_and_starts_fresh(problem, rig):
    before = problem.cost({})
    with Workers() as workers:
        (name, rules, cost), rollouts = initial_rules(workers, problem, {}, rig)
    assert cost < 0.9 * before and name != 'as before'
    assert rollouts == 2 * 3 + 3 * 2
    assert not rules.feedforward_fired.any()
    assert np.array_equal(rules.feedforward_initial, rules.feedforward)
    taught = rebuild(problem.controller, {}, rules)
    assert Problem(problem.loops, taught).cost({}) == cost


@pytest.mark.parametrize('loop, name', [(0, 'nominal rig'), (1, 'first rig within reach')])
def test_a_table_is_called_that_of_the_nominal_rig_where_it_is(problem, rig, loop, name):
    alone = Problem(problem.loops[loop:loop + 1], problem.controller)
    with Workers() as workers:
        (found, _, _), _ = initial_rules(workers, alone, {}, rig)
    assert found == f'learned on the {name}'


def test_other_knots_start_untaught_and_equal_ones_keep_the_rules(problem):
    controller = rebuild(problem.controller, {})
    controller.rules.feedforward[0, 2] = 500.0
    assert rebuild(controller, {'learning_rate': 0.5}).rules.feedforward[0, 2] == 500.0
    assert not rebuild(controller, {'reference_knots': 45.0}).rules.feedforward.any()


def test_mean_and_initial_rules_change_nothing_they_are_given(problem):
    one, two = (rebuild(problem.controller, {}).rules for _ in range(2))
    one.feedforward[1, 4], two.feedforward[1, 4] = 100.0, 300.0
    mean = mean_rules([one, two])
    assert mean.feedforward[1, 4] == 200.0 and one.feedforward[1, 4] == 100.0
    assert as_initial(mean).feedforward_initial[1, 4] == 200.0
    assert mean.feedforward_initial[1, 4] == 0.0


def test_the_mean_of_models_covers_their_scatter(rig):
    """Path rules belong to the numbers beside them: both are means; a rig without counts not."""
    one, two, none = (load_controller('sofc_model_ppr', rig).rules.copy() for _ in range(3))
    for rules, value in ((one, 1e3), (two, 5e3)):
        rules.path[...], rules.numbers[...] = value, value
        rules.covariance[...] = value * np.eye(len(rules.numbers))
    none.covariance[...] = 0.0
    mean = mean_rules([one, two])
    assert np.all(mean.path == 3e3) and np.all(mean.numbers == 3e3)
    assert np.array_equal(mean.covariance, 3e3 * np.eye(len(mean.numbers)) + 2e3 ** 2)
    assert np.array_equal(mean_rules([one, two, none]).numbers, mean.numbers)


def test_what_a_rig_cannot_reach_is_left_out_and_said(rig):
    experiment = load_experiment('tuning_half_hz')
    controller = load_controller('pid', rig)
    weak = rig.with_(parameters={'force_map_gain': 0.7})
    assert reachable(rig, experiment, controller) and not reachable(weak, experiment, controller)
    result = tune([rig, weak], controller, experiment, budget=10)
    assert result.left_out == 1 and 'cannot' not in result.text() and 'left out' in result.text()
    with pytest.raises(InputError, match='no rig can reach'):
        tune(weak, controller, experiment, budget=10)


def test_settings_without_a_controller_count_as_lost(rig, problem):
    lqi = load_controller('lqi', rig)
    assert Problem(problem.loops, lqi).cost({'integral_weight': -1.0}) == 1e3

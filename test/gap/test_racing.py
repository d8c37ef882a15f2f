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

"""Fits and beginnings that cannot win end early; the others go on as if nobody had asked."""

from dataclasses import replace

from gap_runs import nominal, recorded, voltages
import numpy as np
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Hypothesis
from pam_sim.gap.select.beginnings import promise_of_more
from pam_sim.gap.select.context import context_of
from pam_sim.gap.select.racing import may_explain_all, may_win
from pam_sim.gap.select.screening import spaces_of
from pam_sim.gap.subsystems.problems import subsystem_problems
import pytest

CREEP = {'name': 'creep', 'parameters': {
    'stiffness_1_n_per_m': 43.0, 'stiffness_2_n_per_m': 47.0, 'time_constant_1_s': 0.9,
    'time_constant_2_s': 14.0}}


@pytest.fixture(scope='module')
def context():
    run = recorded(nominal().with_(effects=[CREEP]), voltages(9.0))
    return context_of(Estimator(nominal(), subsystem_problems(
        nominal(), [Recording(run, 'ppr')])), 0.05, 0.01, ['creep', 'viscous_damping'])


def fitted(context, name, **options):
    """Return the fit of an effect beside nothing."""
    candidate = next(c for c in context.pool if c.name == name)
    return context.estimator.fit(
        Hypothesis((candidate,)), candidate.typical_start(), **options)


@pytest.mark.parametrize('rule', [may_win, may_explain_all])
def test_a_fit_goes_on_where_it_explains_enough(context, rule):
    is_worth = rule(context, context.base)
    assert is_worth(fitted(context, 'creep').errors)
    assert not is_worth(fitted(context, 'viscous_damping').errors)
    assert not is_worth(context.base.errors)


def test_a_fit_that_goes_on_is_the_same(context):
    plain = fitted(context, 'creep')
    asked = fitted(context, 'creep', is_worth=may_win(context, context.base))
    assert np.array_equal(plain.theta, asked.theta)
    assert all(np.array_equal(plain.errors[s], asked.errors[s]) for s in plain.errors)


def test_one_that_is_not_worth_it_has_one_round(context):
    told = []

    def is_worth(errors):
        told.append(set(errors))
        return False

    before = context.estimator.simulations
    short = fitted(context, 'creep', is_worth=is_worth)
    made = context.estimator.simulations - before
    assert told == [{'muscle'}]
    one_round = fitted(context, 'creep', rounds=1)
    assert np.array_equal(short.theta, one_round.theta)
    assert context.estimator.simulations - before == 2 * made


def test_the_promise_of_a_number_is_that_of_least_squares_without_its_prior(context):
    estimator, base = context.estimator, context.base
    problem = context.problem_of('muscle')
    space = spaces_of(estimator, base)['muscle']
    slopes = estimator.slopes['muscle'][space.mask] * space.weight[:, np.newaxis]
    errors, z = base.errors['muscle'][space.mask] * space.weight, base.known_z['muscle']
    for place, known in enumerate(problem.known):
        prior = np.eye(z.size) * (np.arange(z.size) != place)
        rows, wanted = np.vstack([slopes, prior]), np.concatenate([errors, prior @ z])
        rest = wanted - rows @ np.linalg.lstsq(rows, wanted, rcond=None)[0]
        expected = 1.0 - rest @ rest / (space.left @ space.left) if known.of_rig else 0.0
        assert space.promise_of_numbers()[place] == pytest.approx(expected, abs=1e-9)


def test_what_is_missing_is_promised_and_nothing_where_it_is_not_tried(context):
    problem, elsewhere = context.problem_of('muscle'), replace(context.base)
    assert promise_of_more(context, elsewhere, problem) > 0.8
    without = replace(context, pool=tuple(c for c in context.pool if c.name != 'creep'))
    assert promise_of_more(without, elsewhere, problem) < context.criteria.first_gain

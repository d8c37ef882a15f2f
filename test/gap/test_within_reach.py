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

"""A subsystem in which nothing changes keeps its fit."""

from gap_runs import nominal, recorded, voltages
import numpy as np
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Hypothesis, within_reach
from pam_sim.gap.select.candidates import candidates
from pam_sim.gap.subsystems.problems import subsystem_problems
import pytest

BY_NAME = {c.effect: c for c in candidates(nominal(), ('pressure', 'contraction', 'force'))}


@pytest.fixture(scope='module')
def estimator():
    rig = nominal().with_(effects=[
        {'name': 'tube_lag', 'parameters': {'time_constant_s': 0.015}},
        {'name': 'end_taper', 'parameters': {'k_minus_1': 0.06}}])
    return Estimator(nominal(), subsystem_problems(nominal(), [
        Recording(recorded(rig, voltages(12.0)), 'ppr')]))


@pytest.mark.parametrize('known, names, free, reached', [
    (['tube_lag'], ['tube_lag', 'end_taper'], (), ['muscle']),
    (['tube_lag', 'end_taper'], ['end_taper'], (), ['valve']),
    (['tube_lag'], ['tube_lag', 'pressure_bias'], (), ['valve', 'muscle']),
    (['pressure_bias'], ['pressure_bias', 'end_taper'], (), ['valve', 'muscle']),
    (['contraction_bias'], ['contraction_bias', 'tube_lag'], (), ['valve', 'muscle']),
    (['tube_lag'], ['tube_lag'], ('mass_kg',), ['muscle']),
    (['tube_lag'], ['tube_lag'], (), ['valve', 'muscle'])])
def test_only_what_can_change_is_fitted_again(estimator, known, names, free, reached):
    now, before = (Hypothesis(tuple(BY_NAME[n] for n in of), f)
                   for of, f in ((names, free), (known, ())))
    assert [c.subsystem for c in within_reach(now, before, estimator.problems)] == reached


def test_the_other_cut_stays_as_it_was_and_the_fit_is_the_same(estimator):
    lag, taper = BY_NAME['tube_lag'], BY_NAME['end_taper']
    one = estimator.fit(Hypothesis((lag,)), [1.0])
    made = estimator.simulations
    part = estimator.fit(Hypothesis((lag, taper)), [*one.theta, 0.5], one, whole=False)
    fewer = estimator.simulations - made
    whole = estimator.fit(Hypothesis((lag, taper)), [*one.theta, 0.5], one)
    assert fewer < 0.7 * (estimator.simulations - made - fewer)
    assert np.array_equal(part.errors['valve'], one.errors['valve'])
    assert part.theta[0] == one.theta[0] and part.known_z['valve'] is one.known_z['valve']
    assert part.theta == pytest.approx(whole.theta, rel=0.02)
    assert estimator.cost(part) == pytest.approx(estimator.cost(whole), rel=0.01)


@pytest.mark.parametrize('reservoir_m3, certain', [(None, False), (2e-3, True)])
def test_a_reservoir_that_may_as_well_be_twice_as_large_is_not_certain(reservoir_m3, certain):
    """Of shapes alone no value means none; how well one is known tells."""
    given = nominal().with_(valve='hsv')
    effects = [] if reservoir_m3 is None else [
        {'name': 'supply_droop', 'parameters': {'reservoir_volume_m3': reservoir_m3}}]
    duty = np.repeat(np.random.default_rng(3).uniform(-0.5, 0.5, 30), 500)
    run = recorded(given.with_(effects=effects), np.column_stack(
        [np.clip(duty, 0.0, 1.0), np.clip(-duty, 0.0, 1.0)]))
    droop = next(c for c in candidates(given, ('pressure', 'contraction', 'force'))
                 if c.effect == 'supply_droop')
    estimator = Estimator(given, subsystem_problems(given, [Recording(run, 'hsv')]))
    found = estimator.fit(Hypothesis((droop,)), [droop.free[0].coordinate(0.01)])
    assert (estimator.certainty(found, 0) > CRITERIA.certain_size) == certain

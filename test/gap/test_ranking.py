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

"""Which rivals the data tell apart, and which experiment would."""

from dataclasses import replace
import math
from types import SimpleNamespace

from gap_rivals import Blocks, errors, Tied
from gap_runs import nominal, recorded
import numpy as np
from pam_actuation.experiments import separating
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.split import FIT, SELECT
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select import backward, size
from pam_sim.gap.select.candidates import candidates
from pam_sim.gap.select.comparison import preference
from pam_sim.gap.select.plausibility import with_plausible_numbers
from pam_sim.gap.select.rival import NamedEffect
from pam_sim.gap.select.size import with_certain_sizes, within_the_chain
from pam_sim.gap.subsystems.known import Known
from pam_sim.gap.verify.validation import start_error_sd, Validation
import pytest


@pytest.mark.parametrize('telling, says', [(8, True), (4, False), (3, False)])
def test_blocks_in_which_rivals_say_the_same_do_not_drown_the_others(telling, says):
    problem, rare = Blocks(80), np.arange(80) < telling
    base = errors(problem, 0, np.full(80, 5.0))
    better = errors(problem, 0, np.zeros(80))
    # Where there are few blocks, they must agree the more: in these some say little.
    worse = errors(problem, 0, np.where(rare, np.where(np.arange(80) % 4, 3.0, 0.8), 0.01))
    found = preference(problem, base, better, worse)
    assert (found > CRITERIA.certain_sd) == says
    assert preference(problem, base, worse, better) == pytest.approx(-found, nan_ok=True)
    assert math.isnan(found) == (telling < CRITERIA.min_blocks)


@pytest.mark.parametrize('agree, says', [(1.0, True), (0.5, False)])
def test_many_quiet_blocks_that_agree_count_where_loud_ones_are_few(agree, says):
    problem, place = Blocks(30), np.arange(30)
    before = np.where(place < 6, 3.0, 0.45)
    # Of the loud ones all get better, but half of them hardly; of the quiet ones a share does.
    after = np.where(place < 6, np.where(place % 2, 0.0, 2.8),
                     np.where(place % 10 < 10 * agree, 0.0, 0.65))
    base, better = errors(problem, 0, before), errors(problem, 0, after)
    assert math.isnan(preference(problem, base, better, base))      # three blocks are no test
    assert (preference(problem, base, better, base, quiet=True) > CRITERIA.certain_sd) == says


def test_what_was_fitted_judges_as_well_where_each_part_is_judged_by_a_fit_to_the_other():
    problem = Blocks(40)
    problem.part = np.where(problem.block % 2, SELECT, FIT)
    rng, base = np.random.default_rng(2), errors(problem, 0, np.full(40, 4.0))
    better, worse = (errors(problem, 0, rng.uniform(low, low + 2.0, 40)) for low in (0.0, 0.3))
    once = preference(problem, base, better, worse)
    twice = preference(problem, base, better, worse, other_part=(FIT, better, worse))
    assert 1.0 < once < CRITERIA.certain_sd < twice
    against = preference(problem, base, better, worse, other_part=(FIT, worse, better))
    assert abs(against) < 1.0


@pytest.mark.parametrize('names, off, tied', [
    (('bladder_stiffness', 'parallel_spring'), 0.1, True),
    (('bladder_stiffness', 'parallel_spring'), 1.0, False),
    (('contraction_bias', 'parallel_spring'), 0.1, True),
    (('contraction_bias', 'pressure_gain'), 0.1, False)])      # each has one form
def test_no_rival_goes_for_less_than_a_formulation_may_be_off(names, off, tied):
    case = Tied(Blocks(60), 5.0, dict(zip(names, (0.0, off))))
    left = case.names()
    # Both differ in every block alike, beyond doubt.
    assert case.rivals[1].t['muscle'] > CRITERIA.certain_sd
    assert left == list(names[:1 + tied])


def test_a_rival_that_could_not_be_tested_neither_goes_nor_stands_for_the_best():
    few = np.arange(60) < 3
    case = Tied(Blocks(60), np.where(few, 5.0, 0.0),
                {'creep': np.zeros(60), 'bladder_stiffness': np.where(few, 1.6, 0.0)})
    # A stiffness is a limit of creep, but explains less; three blocks are no test.
    assert case.names() == ['creep', 'bladder_stiffness']
    assert math.isnan(case.rivals[1].t['muscle'])


@pytest.mark.parametrize('size, tied', [(0.25, True), (2.0, False)])
def test_a_rival_that_explains_clearly_less_goes_with_less_doubt_than_another(size, tied):
    rng, some = np.random.default_rng(2), np.arange(60) < 12
    left = [np.sqrt(size * rng.uniform(0.0, 4.0, 60)) * some for _ in range(2)]
    case = Tied(Blocks(60), 5.0 * some, {
        'bladder_stiffness': left[0], 'parallel_spring': np.hypot(left[1], np.sqrt(size) * some)})
    names = case.names()
    assert CRITERIA.behind_t < case.rivals[1].t['muscle'] < CRITERIA.ahead_t
    assert names == ['bladder_stiffness', 'parallel_spring'][:1 + tied]


@pytest.mark.parametrize('real, share', [(1.0, 1.0), (0.0, -1.0)])
def test_the_certify_run_confirms_what_is_real(real, share):
    time_s = np.arange(4000) * 0.005
    effect = 2e-5 * np.sin(time_s)
    noise = 1e-5 * np.random.default_rng(2).standard_normal(time_s.size)
    validation = Validation.__new__(Validation)

    class Given:
        signals, measured = ('contraction',), {'contraction': real * effect + noise}

    validation.recording = Given()
    validation.part = {'contraction': np.ones(time_s.size, dtype=bool)}
    validation.noise, validation.after = {'contraction': 1e-5}, {'contraction': effect}
    validation.refit = {'contraction': np.zeros(time_s.size)}
    assert validation.fall(validation.refit, validation.after)[0] == pytest.approx(share, abs=0.1)


def test_an_experiment_must_decide_in_many_places():
    names = ('valve_dead_time', 'tube_lag')
    by_name = {c.effect: c for c in candidates(nominal(), ('pressure', 'contraction'))}
    rivals = [rival(by_name[n], [1.0]) for n in names]
    truth = nominal().with_(effects=[by_name[names[0]].setting({'delay_s': 0.01})])
    levels = np.random.default_rng(4).uniform(3.2, 5.6, 40)
    many, few = np.repeat(levels, 400), np.repeat((3.2, 5.6, 3.2), (3000, 3000, 2000))
    # One edge leaves the lag off, but decides nothing.
    assert decided(truth, rivals, few) < 1.0 <= decided(truth, rivals, many)


def test_an_experiment_decides_by_what_the_truth_leaves_not_by_a_floor_above_it():
    """Rivals of nearly one form: what both leave of many steps is below a careful floor."""
    names = ('valve_dead_time', 'tube_lag_two_stage')
    by_name = {c.effect: c for c in candidates(nominal(), ('pressure', 'contraction'))}
    rivals = [rival(by_name[n], by_name[n].typical_start()) for n in names]
    truth = nominal().with_(effects=[by_name[names[0]].setting({'delay_s': 0.0087})])
    steps = np.repeat(np.random.default_rng(4).uniform(3.2, 5.6, 24), 700)
    assert decided(truth, rivals, steps) > 0.2


def test_models_that_give_the_same_signals_are_not_fitted(monkeypatch):
    by_name = {c.effect: c for c in candidates(nominal(), ('pressure', 'contraction'))}
    rivals = [rival(by_name[n], by_name[n].typical_start())
              for n in ('coulomb_friction', 'guide_friction')]
    monkeypatch.setattr(separating, 'Estimator', None)
    run = recorded(rivals[0][1], np.repeat((3.2, 5.6, 3.2), 1000),
                   topics=('pressure', 'contraction'))
    sigma, sure = separating.separation(run, nominal(), rivals, False)
    assert sigma < separating.LEAST and sure == 0.0


def rival(candidate, theta):
    setting = candidate.setting({f.name: f.value(t) for f, t in zip(candidate.free, theta)})
    return candidate.name, nominal().with_(effects=[setting]), Hypothesis((candidate,)), theta


def decided(truth, rivals, voltage):
    run = recorded(truth, voltage, topics=('pressure', 'contraction'))
    return separating.separation(run, nominal(), rivals, False)[1]


def test_a_free_run_knows_how_uncertain_its_start_is():
    quiet, loud = (Recording(recorded(nominal(), np.full(3000, 4.0), noise=n), 'ppr')
                   for n in (1.0, 3.0))
    # Ten samples in the first 50 ms, of 300 Pa.
    assert start_error_sd(quiet) == pytest.approx(1.25 * 300.0 / np.sqrt(10.0), rel=0.2)
    assert start_error_sd(loud) == pytest.approx(3.0 * start_error_sd(quiet), rel=0.1)


@pytest.mark.parametrize('alone, goes', [(0.96, 'hysteresis'), (0.7, 'coulomb_friction')])
def test_a_friction_is_not_replaced_by_the_loop_that_has_turned_into_it(
        monkeypatch, alone, goes):
    by_name = {c.effect: c for c in candidates(nominal(), ('contraction', 'force'))}
    loop = by_name['hysteresis_lugre']
    narrow = Fit(Hypothesis((loop,)), np.array([1.0, 0.0, loop.free[2].coordinate(
        loop.free[2].upper)]), {}, {}, {})
    dry = Fit(Hypothesis((by_name['coulomb_friction'],)), np.ones(1), {}, {}, {})
    both = Fit(Hypothesis((*dry.hypothesis.effects, loop)), np.ones(4), {}, {}, {})

    given = SimpleNamespace(criteria=CRITERIA, estimator=None, ranking=SimpleNamespace(
        shares=lambda found: {'muscle': alone if found is dry else 1.0}))
    monkeypatch.setattr(backward, 'fit_without', lambda estimator, current, name: (
        dry if name == 'hysteresis' else narrow))
    named = [NamedEffect(n, 'muscle', [], (n,)) for n in ('coulomb_friction', 'hysteresis')]
    gone, without = backward._simpler(given, both, named[0], narrow, named)
    assert gone.name == goes and without is (dry if goes == 'hysteresis' else narrow)


@pytest.mark.parametrize('z, best', [(3.5, 'parallel_spring'), (1.0, 'force_gain')])
def test_what_needs_no_unlikely_number_is_fitted_to_its_end(z, best):
    """A fit that stopped early is behind one in which a number does what is missing."""
    problem = Blocks(60)
    problem.known = [Known('damping_n_s_per_m', 'N s/m', 25.0, 0.5, 0.0, 100.0)]
    case = Tied(problem, 5.0, {'force_gain': 0.5, 'parallel_spring': 2.0})
    for r, deviation in zip(case.rivals, (z, 0.0)):
        r.found = replace(r.found, known_z={'muscle': np.array([deviation])})
    spring = case.rivals[1].found
    ended = replace(spring, errors={'muscle': errors(problem, 1, np.zeros(60))})
    case.polish = lambda found: ended if found is spring else found
    assert case.names() == [best]


@pytest.mark.parametrize('within, names_stand', [(0.99, True), (0.9, False)])
def test_a_number_that_is_bent_without_need_costs_no_name(within, names_stand):
    problem = Blocks(4)
    problem.known = [Known('damping_n_s_per_m', 'N s/m', 25.0, 0.5, 0.0, 100.0)]
    friction = next(c for c in candidates(nominal(), ('contraction',))
                    if c.effect == 'coulomb_friction')
    bent, held = (Fit(Hypothesis((friction,)), np.ones(1), {'muscle': np.array([z])}, {}, {})
                  for z in (-3.5, -1.0))

    given = SimpleNamespace(
        criteria=CRITERIA, problems=[problem],
        estimator=SimpleNamespace(within_box=lambda found, box: held),
        ranking=SimpleNamespace(shares=lambda found: {'muscle': within}))
    assert with_plausible_numbers(given, bent) is (held if names_stand else bent)
    assert with_plausible_numbers(given, held) is held


@pytest.mark.parametrize('z, stays', [(0.6, False), (-1.9, False), (4.0, True), (-9.0, True)])
def test_a_number_that_came_back_into_its_tolerance_is_not_wrong(monkeypatch, z, stays):
    problem = Blocks(4)
    problem.known = [Known('V_dead', 'm3', 3e-6, 1e-7, 0.0, 1e-4)]
    bias = next(c for c in candidates(nominal(), ('contraction',))
                if c.effect == 'contraction_bias')
    both = Fit(Hypothesis((bias,), ('V_dead',)), np.ones(1), {'muscle': np.array([z])}, {}, {})
    alone = Fit(Hypothesis((bias,)), np.ones(1), {'muscle': np.zeros(1)}, {}, {})

    given = SimpleNamespace(
        criteria=CRITERIA, problems=[problem],
        estimator=SimpleNamespace(certainty=lambda found, place: 99.0))
    monkeypatch.setattr(size, 'fit_without', lambda estimator, current, name: alone)
    named = [NamedEffect(n, 'muscle', [], (n,)) for n in ('V_dead', 'contraction_bias')]
    found, left = with_certain_sizes(given, both, named)
    assert [w.name for w in left] == ['V_dead', 'contraction_bias'][not stays:]
    assert found is (both if stays else alone)


@pytest.mark.parametrize('name, size, is_so', [
    ('pressure_lag', 4e-4, True), ('pressure_lag', 4e-3, False), ('valve_dead_time', 8e-4, True),
    ('creep', None, False), ('contraction_bias', 1e-5, False)])
def test_a_lag_that_any_filter_may_have_is_no_effect(name, size, is_so):
    effect = next(c for c in candidates(nominal(), ('pressure', 'contraction'))
                  if c.effect == name)
    theta = [f.coordinate(size or f.typical) for f in effect.free]
    found = Fit(Hypothesis((effect,)), np.array(theta), {}, {}, {})
    assert within_the_chain(found, 0, CRITERIA) == is_so


def test_of_two_that_have_one_form_a_bent_one_is_not_ahead():
    case = Tied(Blocks(60), 5.0, {'contraction_bias': 0.0, 'pressure_gain': 0.1})
    case.ranking._prior_cost = lambda found: 200.0 * (
        found.hypothesis.names == ('contraction_bias',))
    assert case.names() == ['pressure_gain']

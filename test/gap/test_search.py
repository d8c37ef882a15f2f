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

"""Naming: one effect of every kind, rivals that stay together, abstention."""

import types

from gap_runs import assert_form, nominal, recorded, voltages
import numpy as np
from pam_sim import load_rig
from pam_sim.effects.registry import effects
from pam_sim.gap import find_gap
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.split import SELECT
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.plan.look_alikes import look_alikes
from pam_sim.gap.select.candidates import candidates, split_refinements
from pam_sim.gap.select.comparison import preference, share
from pam_sim.gap.select.context import first_gap_of, SearchContext
from pam_sim.gap.select.forward import mends_a_formulation
from pam_sim.gap.select.ranking import without_limits
from pam_sim.gap.select.rival import Rival
from pam_sim.gap.select.rivals import names_that_contend, other_starts, refined
from pam_sim.gap.select.screening import Screened
from pam_sim.gap.subsystems.problems import subsystem_problems
import pytest


def result_of(name, seconds=11.0, **parameters):
    rig = nominal().with_(effects=[{'name': name, 'parameters': parameters}])
    return find_gap(recorded(rig, voltages(seconds)), nominal())


@pytest.mark.parametrize('formulation, parameters, name, quantity, truth', [
    ('tube_lag', {'time_constant_s': 0.015}, 'tube_lag', 'time_constant_s', 0.015),
    ('hysteresis_lugre', {}, 'hysteresis', 'loop_half_width_at_400kpa_n', None),
    ('end_taper', {'k_minus_1': 0.06}, 'end_taper', 'k_minus_1', 0.06),
    ('pressure_bias', {'bias_pa': 4e3}, 'pressure_bias', 'bias_pa', 4e3)])
def test_an_effect_is_named_with_its_size(formulation, parameters, name, quantity, truth):
    result = result_of(formulation, **parameters)
    assert result.verdict == 'effects'
    assert [e['name'] for e in result.effects] == [name]
    assert result.ambiguity_set == [name]
    said = result.effects[0]['equivalent'][quantity]
    if truth is not None:
        assert said['value'] == pytest.approx(truth, rel=0.1)
        assert said['ci95'][0] <= truth <= said['ci95'][1]
    added = load_rig(result.model_yaml).effects
    assert [effects()[e.name].variant_of or e.name for e in added] == [name]
    assert 'ci95' in added[0].source


def test_a_bias_is_found_beside_an_effect_that_first_took_it_in():
    rig = nominal().with_(effects=[
        {'name': 'threshold_pressure', 'parameters': {'pressure_pa': 9e3}},
        {'name': 'pressure_bias', 'parameters': {'bias_pa': 2.6e3}}])
    result = find_gap(recorded(rig, voltages(14.0)), nominal())
    assert {e['name'] for e in result.effects} == {'threshold_pressure', 'pressure_bias'}
    assert result.ambiguity_set == [e['name'] for e in result.effects]


def test_a_cause_that_no_effect_explains_stays_unknown():
    run = recorded(nominal(), voltages(12.0))
    at = run.topics['contraction'].time_s(run.start_ns)
    # A second body touches now and then; nothing in the model knows when.
    run.topics['contraction'].values['contraction_m'] += 4e-4 * (np.sin(7.3 * at) > 0.8)
    result = find_gap(run, nominal())
    assert result.verdict == 'unknown' and result.effects == []
    assert_form(result)
    assert result.unexplained_fraction == 1.0
    assert load_rig(result.model_yaml).effects == []


@pytest.mark.parametrize('too_large', [1.075, 1.1])
def test_a_number_that_hides_the_gap_from_far_off_is_what_is_wrong(too_large):
    true = nominal().parameters['damping_n_s_per_m'] * too_large
    rig = nominal().with_(parameters={'damping_n_s_per_m': true})
    result = find_gap(recorded(rig, voltages(20.0)), nominal())
    assert result.verdict == 'parameter' and result.effects == []
    (found,) = result.parameters
    assert found.name == 'damping_n_s_per_m' and found.value == pytest.approx(true, rel=0.005)


@pytest.mark.parametrize('promise, flat, first', [(0.1, 0.02, 0.08), (0.001, 0.2, 0.16)])
def test_what_drifts_slowly_opens_a_cut_at_full_weight(promise, flat, first):
    problem = types.SimpleNamespace(subsystem='muscle', level=1.0, is_dealt_short=False,
                                    criteria=CRITERIA, chi2=lambda errors, part: 0.8)
    base = types.SimpleNamespace(errors={'muscle': None})
    screened = [Screened(
        None, (), {'muscle': promise}, flat=Screened(None, (), {'muscle': flat}))]
    assert first_gap_of(problem, base, screened, 0.05) == pytest.approx(first)
    problem.is_dealt_short = True          # what is below the floor may be that of the pressure
    assert first_gap_of(problem, base, screened, 0.05) == 0.0


def test_names_can_be_limited():
    rig = nominal().with_(effects=[
        {'name': 'valve_hysteresis', 'parameters': {'half_width_pa': 3e3}}])
    result = find_gap(recorded(rig, voltages(12.0)), nominal(), effects=[
        'valve_hysteresis', 'thermal'])
    assert [e['name'] for e in result.effects] == ['valve_hysteresis']
    assert {e['name'] for e in result.evidence} <= {'valve_hysteresis', 'T_m', 'K_m'}
    assert ('`thermal` was asked for and is not tried: it acts with valve hsv, the model has '
            'ppr.') in result.text()


def test_a_formulation_never_fits_worse_than_the_one_it_contains():
    rig = nominal().with_(effects=[
        {'name': 'coulomb_friction', 'parameters': {'force_n': 1.0}}])
    recording = Recording(recorded(rig, voltages(12.0)), 'ppr')
    estimator = Estimator(nominal(), subsystem_problems(nominal(), [recording]))
    by_name = {c.effect: c for c in candidates(nominal(), ('pressure', 'contraction', 'force'))}
    coulomb = by_name['coulomb_friction']
    one = estimator.fit(Hypothesis((coulomb,)), [0.5])
    two = estimator.fit(Hypothesis((coulomb, by_name['end_taper'])), [*one.theta, 0.0], one)
    assert estimator.cost(one) < 0.05 * estimator.cost(estimator.base)
    assert estimator.cost(two) < 1.01 * estimator.cost(one)
    problem = estimator.problems[1]
    base = estimator.base.errors['muscle']
    assert share(problem, base, one.errors['muscle']) > 0.95
    assert preference(problem, base, one.errors['muscle'], base, SELECT) > 3.0
    assert preference(problem, base, base, one.errors['muscle'], SELECT) < -3.0
    # The size of what is there is certain, that of what is not may be none.
    assert estimator.certainty(two, 0) > CRITERIA.certain_size > estimator.certainty(two, 1)


@pytest.mark.parametrize('name, kept', [
    ('coulomb_friction', False), ('pressure_friction', False), ('end_taper', True)])
def test_a_loop_that_has_lost_its_width_is_the_simpler_friction(name, kept):
    by_name = {c.effect: c for c in candidates(nominal(), ('pressure', 'contraction', 'force'))}

    def rival(effect, theta, share_of_gap):
        found = Fit(Hypothesis((by_name[effect],)), np.array(theta), {}, {}, {})
        return Rival(by_name[effect].name, found, {'muscle': share_of_gap})

    stiffness = by_name['hysteresis_lugre'].free[2]
    narrow = rival('hysteresis_lugre', [1.0, 0.0, stiffness.coordinate(stiffness.upper)], 0.99)
    wide = rival('hysteresis_lugre', [1.0, 0.0, 0.0], 0.99)
    near = rival(name, [1.0], 0.95)
    bare = Fit(Hypothesis(), np.zeros(0), {}, {}, {})
    assert narrow.at_edge and not wide.at_edge and not near.at_edge
    assert without_limits([near, narrow], bare, 'muscle', CRITERIA) == (
        [narrow] if kept else []) + [near]
    assert without_limits([near, wide], bare, 'muscle', CRITERIA) == [wide, near]
    assert without_limits([narrow], near.found, 'muscle', CRITERIA) == ([narrow] if kept else [])


@pytest.mark.parametrize('winner, rest, mends', [
    ('pressure_friction', 0.01, True),          # friction made of two kinds
    ('pressure_friction', 0.03, False),
    ('end_taper', 0.01, False),                 # another family
    ('mass_kg', 0.01, False)])
def test_a_small_rest_is_no_second_effect_of_the_same_family(winner, rest, mends):
    (friction,) = [c for c in candidates(nominal(), ('contraction',), ['coulomb_friction'])
                   if c.effect == 'coulomb_friction']
    problem = types.SimpleNamespace(level=1.0, chi2=lambda errors, part: 1.0 + 100.0 * rest)
    given = types.SimpleNamespace(
        problem_of=lambda subsystem: problem, first_gap={'muscle': 100.0}, criteria=CRITERIA)
    current = Fit(Hypothesis((friction,)), np.ones(1), {}, {'muscle': None}, {})
    named = types.SimpleNamespace(name=winner, subsystem='muscle')
    assert mends_a_formulation(given, named, current) is mends


@pytest.mark.parametrize('share_of_gap, before, tried', [
    (0.97, 0.0, True), (0.8, 0.0, False), (0.97, 0.96, False)])
def test_what_explains_nearly_all_is_refined_from_where_it_ended(share_of_gap, before, tried):
    by_name = {c.effect: c for c in candidates(nominal(), ('contraction',))}
    plain, bending = by_name['coulomb_friction'], by_name['coulomb_friction_presliding']
    found = Fit(Hypothesis((by_name['end_taper'], plain)), np.array([0.1, 2.5]), {}, {}, {})
    rivals = [Rival('coulomb_friction', found, {'muscle': share_of_gap}),
              Rival('end_taper', found, {'muscle': 0.99})]
    _, refinements = split_refinements([by_name['coulomb_friction'], *(
        c for c in by_name.values() if c.effect.startswith('coulomb_friction_'))])
    found = refined(rivals, refinements, {'muscle': before}, 1, CRITERIA)
    assert [(s.candidate, s.start) for s in found] == (
        [(bending, (2.5, 0.0, 1.0))] if tried else [])


@pytest.mark.parametrize('stiffness_n_per_m, tried', [
    (1e4, True),            # bristles that stiff are dry friction in another form
    (1e3, False)])          # and a loop that wide is an effect of its own
def test_a_limit_keeps_nothing_from_being_refined(stiffness_n_per_m, tried):
    by_name = {c.effect: c for c in candidates(nominal(), ('contraction',))}
    plain, loop = by_name['pressure_friction'], by_name['hysteresis_lugre']
    values = {'force_n': 0.0, 'force_per_pa': 7.4e-7, 'stiffness_n_per_m': stiffness_n_per_m}
    rivals = [
        Rival('pressure_friction', Fit(
            Hypothesis((plain,)), np.array([0.3]), {}, {}, {}), {'muscle': 0.985}),
        Rival('hysteresis', Fit(Hypothesis((loop,)), np.array(
            [f.coordinate(values[f.name]) for f in loop.free]), {}, {}, {}), {'muscle': 0.9988})]
    found = refined(
        rivals, [by_name['pressure_friction_presliding']], {'muscle': 0.0}, 0, CRITERIA)
    assert [s.candidate.effect for s in found] == ['pressure_friction_presliding'] * tried


@pytest.mark.parametrize('best, left, again', [
    (0.74, 26.0, True),
    (0.74, 0.3, False),         # of a gap near the noise nothing much is left
    (0.95, 26.0, False)])
def test_what_contends_is_fitted_from_elsewhere_where_all_leave_much(best, left, again):
    pool = {c.effect: c for c in candidates(nominal(), ('pressure', 'contraction'))}
    delay = pool['valve_dead_time']
    problems = [types.SimpleNamespace(
        subsystem=s, level=1.0, chi2=lambda errors, part: 1.0 + errors)
                for s in ('valve', 'muscle')]
    found = types.SimpleNamespace(errors={'valve': left, 'muscle': left})
    rivals = [Rival('valve_dead_time', found, {'valve': best, 'muscle': 0.0}),
              Rival('creep', found, {'valve': 0.0, 'muscle': 0.97})]
    contending = [Screened(delay, (7.0,), {}), Screened(pool['end_taper'], (3.0,), {})]
    tried = other_starts(rivals, contending, problems, CRITERIA)
    assert [(s.candidate, s.start) for s in tried] == ([(delay, (1.0,))] if again else [])


def test_names_contend_at_the_level_that_rivals_reach_and_are_refined_at_the_one_before():
    """A gap below the floor has names, and the best of two that refine no rest of zero."""
    problem = types.SimpleNamespace(subsystem='valve', level=1.0, chi2=lambda errors, part: errors)
    base, rests = 0.99, {'leakage': 0.95, 'pressure_bias': 0.96, 'tube_lag': 0.985}

    def shares(found):
        whole = base - problem.level
        return {'valve': min((base - found.errors['valve']) / whole, 1.0) if whole > 0.0 else 0.0}

    rivals = [Rival(name, types.SimpleNamespace(errors={'valve': rest}), {'valve': 0.0})
              for name, rest in rests.items()]
    given = types.SimpleNamespace(
        ranking=types.SimpleNamespace(shares=shares), criteria=CRITERIA)
    given.set_levels = types.MethodType(SearchContext.set_levels, given)
    current = types.SimpleNamespace(errors={'valve': base})
    assert names_that_contend(given, rivals, current, [problem]) == {
        'leakage', 'pressure_bias'}
    assert problem.level == 1.0 and [r.share['valve'] for r in rivals] == [0.0, 0.0, 0.0]


def test_two_frictions_over_a_narrow_band_stay_together():
    """Both are tried with their bristles, else the first that is wins by them."""
    rig = nominal().with_(effects=[{'name': 'pressure_friction_presliding', 'parameters': {
        'force_at_400kpa_n': 0.9, 'presliding_m': 1.5e-5, 'static_excess': 0.1}}])
    t = np.arange(20000) * 1e-3
    voltage = 4.0 + 0.15 * np.sin(2.0 * np.pi * 0.7 * t) + 0.1 * np.sin(2.0 * np.pi * 0.23 * t)
    result = find_gap(recorded(rig, voltage), nominal())
    assert set(result.ambiguity_set) >= {'coulomb_friction', 'pressure_friction'}


def test_a_refinement_alone_is_one_to_begin_with():
    pool = candidates(nominal(), ('pressure', 'contraction'))
    first, refinements = split_refinements(pool)
    assert {c.name for c in refinements} == {
        'coulomb_friction', 'pressure_friction', 'guide_friction', 'tube_lag', 'end_taper',
        'vent_bleed'}
    assert not set(first) & set(refinements) and set(first) | set(refinements) == set(pool)
    assert split_refinements(refinements) == (refinements, [])


def test_friction_that_bends_first_is_named_as_friction():
    """And leaves nothing that a second effect would have to explain."""
    rig = nominal().with_(effects=[{'name': 'coulomb_friction_presliding', 'parameters': {
        'force_n': 2.0, 'presliding_m': 2.5e-5}}])
    result = find_gap(recorded(rig, voltages(11.0)), nominal())
    assert result.verdict == 'effects'
    assert [e['name'] for e in result.effects] == ['coulomb_friction']
    assert result.effects[0]['formulation'] == 'coulomb_friction_presliding'
    low, high = result.effects[0]['equivalent']['force_n']['ci95']
    assert low <= 2.0 <= high


def test_an_effect_knows_its_look_alikes_and_its_least_size():
    run = recorded(nominal(), voltages(12.0))
    found = look_alikes(run, nominal(), 'coulomb_friction')
    assert 'pressure_friction' in [name for name, _ in found['alike']]
    assert 0.0 < found['least']['value'] < 0.5 and found['least']['unit'] == 'N'


def test_a_leak_beside_a_lag_of_two_stages_is_named():
    """What a wrong form of the lag leaves would hide it."""
    rig = nominal().with_(effects=[
        {'name': 'tube_lag_two_stage', 'parameters': {
            'time_constant_s': 0.014, 'second_stage_share': 0.35}},
        {'name': 'leakage_slit', 'parameters': {
            'conductance_m3_per_s_pa': 1.2e-11, 'slit_flow_at_400kpa_kg_per_s': 3e-6}}])
    result = find_gap(recorded(rig, voltages(15.0)), nominal())
    assert sorted(e['name'] for e in result.effects) == ['leakage', 'tube_lag']
    lag = next(e for e in result.effects if e['name'] == 'tube_lag')
    assert lag['formulation'] == 'tube_lag_two_stage'
    assert lag['equivalent']['time_constant_s']['value'] == pytest.approx(0.014, rel=0.05)


def test_other_forms_of_a_small_leak_widen_its_interval():
    """Behind a regulator the flow depends on the law; one law alone is too sure of it."""
    rig = nominal().with_(effects=[{'name': 'leakage_slit', 'parameters': {
        'conductance_m3_per_s_pa': 5e-12, 'slit_flow_at_400kpa_kg_per_s': 1.2e-6}}])
    result = find_gap(recorded(rig, voltages(30.0)), nominal())
    assert [e['name'] for e in result.effects] == ['leakage']
    quantity = 'mass_flow_at_400kpa_kg_per_s'
    effect = rig.effect('leakage_slit')
    truth, _ = effects()[effect.name].report(effect.parameters, rig)[quantity]
    found = result.effects[0]['equivalent'][quantity]
    assert found['ci95'][0] < truth < found['ci95'][1]
    assert found['value'] == pytest.approx(truth, rel=0.35)

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

"""What a rival needs to win, and what is spent on those that cannot."""

from dataclasses import replace
from types import SimpleNamespace

from gap_rivals import Blocks, Tied
from gap_runs import NOMINAL, nominal
import numpy as np
from pam_sim import load_rig
from pam_sim.gap import verdict as verdict_module
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.split import FIT, SELECT
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select import backward, rerank, size
from pam_sim.gap.select.backward import eliminated, is_missed
from pam_sim.gap.select.candidates import candidates
from pam_sim.gap.select.comparison import preference
from pam_sim.gap.select.plausibility import is_poor, with_wrong_numbers
from pam_sim.gap.select.rerank import ranked_again
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.select.rivals import best_of_each_name, containing
from pam_sim.gap.select.screening import Screened
from pam_sim.gap.select.size import with_certain_sizes, within_the_chain
from pam_sim.gap.subsystems.known import known_numbers
import pytest

BIAS = next(c for c in candidates(nominal(), ('pressure', 'contraction'))
            if c.effect == 'pressure_bias')


class GoesOn(Tied):
    """Rivals that end elsewhere when their fit goes on; ``went_on`` tells which did."""

    def __init__(self, problem, before, left, ends=None):
        self.went_on, self.ends = [], ends or {}
        super().__init__(problem, before, left)

    def polish(self, found):
        """Return where a fit ends."""
        name = found.hypothesis.effects[0].name
        self.went_on.append(name)
        return self._found(name, self.ends[name]) if name in self.ends else found


@pytest.mark.parametrize('off, goes_on', [(2.2, False), (1.8, True)])
def test_a_fit_that_cannot_explain_enough_of_a_rest_does_not_go_on(off, goes_on):
    case = GoesOn(Blocks(60), 5.0, {'bladder_stiffness': off})
    current = case._found('coulomb_friction', 2.5)
    case.ranking.tied(case.rivals, current, case.problems[0])
    # Of the rest of 6.25 floors squared 70 % must go; a fit that goes on may halve its own.
    assert case.went_on == ['bladder_stiffness'][:goes_on]
    alone = GoesOn(Blocks(60), 5.0, {'bladder_stiffness': off})
    alone.names()
    assert alone.went_on == ['bladder_stiffness']         # as a first effect it may win
    assert alone.rivals[0].polished


@pytest.mark.parametrize('end, tied', [(0.05, True), (1.0, False)])
def test_a_fit_within_the_noise_goes_on_before_it_counts_as_behind(end, tied):
    case = GoesOn(Blocks(60), 5.0, {'bladder_stiffness': 0.0, 'parallel_spring': 1.0},
                  {'parallel_spring': end})
    assert case.names() == ['bladder_stiffness', 'parallel_spring'][:1 + tied]
    assert case.went_on == ['parallel_spring']


@pytest.mark.parametrize('matters', [True, False])
def test_a_number_far_from_its_prior_is_wrong_where_that_moves_a_signal(matters):
    problem = Blocks(60)
    problem.known = [k for k in known_numbers(nominal()) if k.name == 'damping_n_s_per_m']
    base, near, free = (Fit(Hypothesis((), names), np.zeros(0), {'muscle': np.array([z])}, {
        'muscle': np.zeros(problem.block.size)}, {}) for z, names in (
            (3.2, ()), (2.0, ()), (4.6, ('damping_n_s_per_m',))))
    boxes, asked = [], []
    context = SimpleNamespace(
        criteria=CRITERIA, seen_gap=CRITERIA.seen_gap, problems=[problem], base=base,
        estimator=SimpleNamespace(fit=lambda *_: free, polish=lambda found: found,
                                  base_within=lambda box: boxes.append(box) or near),
        ranking=SimpleNamespace(shares=lambda found: {'muscle': 1.0}),
        matters=lambda found, without: asked.append((found, without)) or matters)
    found, named, _ = with_wrong_numbers(context, base, [], {})
    assert [w.name for w in named] == ['damping_n_s_per_m'][:matters]
    assert found is (free if matters else base) and boxes == [CRITERIA.likely_sd]
    # The same model but for its numbers.
    (with_it, without), = asked
    assert with_it is free and without.known_z == near.known_z and not without.hypothesis.names


@pytest.mark.parametrize('elsewhere, sure', [(True, True), (False, False)])
def test_half_sure_is_asked_of_all_of_the_data(elsewhere, sure):
    problem = Blocks(60)
    problem.part = np.where(problem.block % 2, SELECT, FIT)
    rng = np.random.default_rng(4)
    before, after = rng.uniform(1.2, 3.2, 60), rng.uniform(0.8, 3.0, 60)
    case = Tied(problem, before, {'bladder_stiffness': after})
    rival = case.rivals[0]
    alone = preference(problem, case.base.errors['muscle'], rival.found.errors['muscle'],
                       case.base.errors['muscle'], quiet=True)
    assert 1.0 < alone < CRITERIA.certain_sd
    if not elsewhere:                     # fitted to one half it does nothing for the other
        rival.cross_fit = case._found('bladder_stiffness', before)
    assert case.ranking._is_sure(rival, case.base, problem) == sure


def context(case):
    """Return the context of a search with one subsystem."""
    return SimpleNamespace(problems=case.problems, base=case.base, criteria=CRITERIA,
                           pool=candidates(nominal(), ('contraction',)))


@pytest.mark.parametrize('at_edge, best', [(False, 0.1), (True, 0.5)])
def test_of_a_name_the_formulation_that_leaves_least_competes(at_edge, best):
    problem = Blocks(60)
    case = Tied(problem, 5.0, {'bladder_stiffness': 0.5, 'parallel_spring': 0.1})
    problem.level = 2.0                       # both explain all beyond it
    forms = [SimpleNamespace(name='friction', found=r.found, at_edge=edge, off=off)
             for r, edge, off in zip(case.rivals, (False, at_edge), (0.5, 0.1))]
    found = best_of_each_name(context(case), forms)
    assert [r.off for r in found] == [best]


@pytest.mark.parametrize('name, off, explained, poor', [
    ('bladder_stiffness', 3.0, 0.93, False), ('bladder_stiffness', 6.0, 0.93, True),
    ('bladder_stiffness', 6.0, 0.96, False), ('bladder_stiffness', 3.0, 0.89, True),
    ('bladder_stiffness', 0.3, 0.6, False), ('bladder_stiffness', 0.3, 0.4, True),
    ('threshold_pressure', 6.0, 0.93, False), ('threshold_pressure', 6.0, 0.89, True)])
def test_a_clear_rest_costs_a_name_of_several_formulations_earlier(name, off, explained, poor):
    case = Tied(Blocks(60), 20.0, {name: off})
    assert is_poor(
        context(case), case.problems[0], case.rivals[0].found, {'muscle': explained}) == poor


@pytest.mark.parametrize('off, explained, poor', [
    (6.0, 0.93, True), (6.0, 0.96, False), (3.0, 0.93, False)])
def test_a_number_of_the_model_leaves_no_clear_rest(off, explained, poor):
    case = Tied(Blocks(60), 20.0, {'threshold_pressure': off})
    mass = next(k for k in known_numbers(nominal()) if k.name == 'mass_kg')
    case.problems[0].known = [mass]
    found = replace(case.rivals[0].found, hypothesis=Hypothesis((), ('mass_kg',)),
                    known_z={'muscle': np.array([8.0])})
    assert is_poor(context(case), case.problems[0], found, {'muscle': explained}) == poor


@pytest.mark.parametrize('form', ['valve_dead_zone', 'valve_dead_zone_gradual'])
@pytest.mark.parametrize('open_s, close_s, delays', [
    (1.7e-4, 1.69e-4, True), (1.7e-4, 1.2e-4, False), (1.4e-3, 1.4e-3, False)])
def test_a_valve_that_opens_as_late_as_it_closes_only_delays(form, open_s, close_s, delays):
    switching = load_rig(NOMINAL, valve='hsv')
    effect = next(c for c in candidates(switching, ('pressure', 'contraction'))
                  if c.effect == form)
    times = {'open_time_s': open_s, 'close_time_s': close_s}
    theta = [f.coordinate(times.get(f.name, f.typical)) for f in effect.free]
    assert within_the_chain(
        Fit(Hypothesis((effect,)), np.array(theta), {}, {}, {}), 0, CRITERIA) == delays


@pytest.mark.parametrize('off, materiality, highest, rare, spread, verdict', [
    (0.9, 0.3, 1.0, 1.0, 0.0, 'no_gap'), (1.3, 0.3, 1.0, 1.0, 0.0, 'unknown'),
    (1.3, 1.0, 1.0, 1.0, 0.0, 'unknown'), (1.3, 1.5, 1.0, 1.0, 0.0, 'slight'),
    (0.9, 1.5, 1.0, 1.0, 0.0, 'no_gap'),
    (1.3, 1.0, 1.4, 1.4, 0.0, 'no_gap'),        # the drift of a valve may be half of it
    (1.3, 1.0, 1.0, 1.4, 0.0, 'no_gap'),        # which few draws do not show
    (1.3, 1.0, 1.0, 1.0, 0.6, 'no_gap')])       # or the doubt about its numbers
def test_a_gap_without_a_name_must_be_clear(
        monkeypatch, off, materiality, highest, rare, spread, verdict):
    signal = SimpleNamespace(rmse_refit=np.hypot(1.0, off), noise_floor=1.0)
    result = SimpleNamespace(parameters=[], signals={'pressure': signal})
    monkeypatch.setattr(verdict_module, 'is_material', lambda *given: False)
    monkeypatch.setattr(verdict_module, '_noticed', lambda *given: [])
    monkeypatch.setattr(
        verdict_module, 'spread_of_numbers', lambda *given: {'pressure': spread})
    found = SimpleNamespace(hypothesis=Hypothesis(), theta=())
    monkeypatch.setattr(verdict_module, 'held_without', lambda found: found)
    outcome = SimpleNamespace(named=[], share={'valve': 0.0})
    validation = SimpleNamespace(
        noise={'pressure': 1.0}, highest_floor={'pressure': highest},
        rare_floor={'pressure': rare}, unexplained=lambda: 1.0,
        estimator=SimpleNamespace(criteria=CRITERIA, problems=[]), base=found, final=found)
    verdict_module.judge(result, outcome, validation, materiality, None)
    assert result.verdict == ('no_gap' if verdict == 'slight' else verdict)
    assert result.is_slight == (verdict == 'slight')


@pytest.mark.parametrize('verdict, named, names, kept', [
    ('no_gap', ['creep'], ('creep',), 'base'), ('no_gap', [], ('mass_kg',), 'base'),
    ('unknown', ['creep'], ('creep',), 'base'), ('unknown', [], ('mass_kg',), 'final'),
    ('effects', ['creep'], ('creep',), 'final')])
def test_what_is_too_small_for_a_name_is_not_left_in_the_model(
        monkeypatch, verdict, named, names, kept):
    result = SimpleNamespace(verdict=verdict, remarks=[])
    outcome = SimpleNamespace(named=[NamedEffect(n, 'muscle', [], (n,)) for n in named])
    validation = SimpleNamespace(
        kept='final', base='base', final=SimpleNamespace(hypothesis=SimpleNamespace(names=names)),
        of=lambda final: SimpleNamespace(kept=final))
    monkeypatch.setattr(verdict_module, 'OwnRuns', lambda validation: SimpleNamespace(
        validation=validation))
    for one in ('fill', 'judge', 'given_suffices'):
        monkeypatch.setattr(verdict_module, one, lambda *given: False)
    runs = verdict_module.decide(result, outcome, validation, 1.0)
    assert runs.validation.kept == kept
    small = bool(named) and kept == 'base'
    assert result.remarks == ['What creep would explain is too small to matter.'] * small
    assert bool(outcome.named) == (bool(named) and not small)


@pytest.mark.parametrize('tied, named', [
    (['pressure_bias'], ('pressure_bias',)), (['leakage'], ('leakage',)),
    (['leakage', 'pressure_bias'], ('leakage', 'pressure_bias')), ([], ('leakage',))])
def test_beside_another_effect_the_better_of_two_sensor_causes_takes_the_place(
        monkeypatch, tied, named):
    alone = Fit(Hypothesis((BIAS,)), np.ones(1), {}, {}, {})
    # By itself the bias explains what the threshold does; beside that it may be what the leak was.
    bias = Rival('pressure_bias', alone, {'valve': -2.0, 'muscle': 0.99})
    both = [NamedEffect('leakage', 'valve', [bias], ('leakage',)),
            NamedEffect('threshold_pressure', 'muscle', [], ('threshold_pressure',))]

    given = SimpleNamespace(
        criteria=CRITERIA, estimator=None, problem_of=lambda subsystem: None,
        ranking=SimpleNamespace(
            shares=lambda found: {}, tied=lambda rivals, current, problem: [
                next(r for r in rivals if r.name == name) for name in tied]))
    monkeypatch.setattr(
        rerank, 'fit_without', lambda estimator, current, name, put=None: alone)
    found = ranked_again(given, SimpleNamespace(hypothesis=SimpleNamespace(
        names=('leakage', 'threshold_pressure'))), both)[1]
    assert [w.names for w in found] == [named, ('threshold_pressure',)]


@pytest.mark.parametrize('effect, number', [
    ('viscous_damping', 'damping_n_s_per_m'), ('dead_volume', 'V_dead')])
def test_a_number_and_the_effect_that_is_another_name_of_it_are_one(
        monkeypatch, effect, number):
    given = SimpleNamespace(
        problems=[SimpleNamespace(is_dealt_short=False)], estimator=None,
        matters=lambda current, without: True)
    monkeypatch.setattr(backward, 'is_missed', lambda *judged: True)
    monkeypatch.setattr(
        backward, 'fit_without', lambda estimator, current, name: (*current, name))
    named = [NamedEffect(n, 'muscle', [], (n,)) for n in (number, 'creep', effect)]
    assert eliminated(given, (), named) == ((number,), named[1:])
    assert eliminated(given, (), named[:2]) == ((), named[:2])


@pytest.mark.parametrize('short, left', [(True, 'creep'), (False, 'hysteresis')])
def test_of_what_a_short_record_does_not_miss_the_one_that_costs_least_goes(
        monkeypatch, short, left):
    share = {('creep', 'hysteresis'): 0.99, ('creep',): 0.976, ('hysteresis',): 0.938}
    given = SimpleNamespace(
        problems=[SimpleNamespace(is_dealt_short=short)], estimator=None,
        matters=lambda current, without: True, ranking=SimpleNamespace(shares=None),
        explained=lambda fit: {'muscle': share[fit]})
    monkeypatch.setattr(backward, 'is_missed', lambda *judged: False)
    monkeypatch.setattr(backward, 'fit_without', lambda estimator, current, name: tuple(
        n for n in current if n != name))
    named = [NamedEffect(n, 'muscle', [], (n,)) for n in ('creep', 'hysteresis')]
    found, kept = eliminated(given, ('creep', 'hysteresis'), named)
    assert found == (left,) and [w.name for w in kept] == [left]


def test_an_effect_that_gave_way_to_its_limit_is_tried_beside_it():
    def screened(name, *promises):
        return [Screened(c, (), {'muscle': p}) for c, p in zip(
            (c for c in candidates(nominal(), ('contraction',)) if c.name == name), promises)]

    creep, loops = screened('creep', 0.0)[0], screened('hysteresis', 0.1, 0.3, 0.2)
    given = [creep, *loops, *screened('end_taper', 0.9)]
    assert containing(given, {'bladder_stiffness'}) == [creep]
    assert containing(given, {'coulomb_friction', 'parallel_spring'}) == [loops[1]]


@pytest.mark.parametrize('left, beside, missed', [
    (0.67, None, True), (0.67, 'end_taper', False), (0.5, 'end_taper', True), (0.8, None, False)])
def test_what_is_alone_in_its_cut_is_missed_as_a_single_effect_is(left, beside, missed):
    case = Tied(Blocks(60), 1.2, {'bladder_stiffness': 1.2 * left})
    given = SimpleNamespace(
        base=case.base, first_gap={'muscle': 1.44}, least_gap=0.01, criteria=CRITERIA)
    assert is_missed(given, case.problems[0], case.rivals[0].found,
                     case._found(beside, 1.2)) == missed


@pytest.mark.parametrize('names, at_most', [
    (('creep',), 1.2), (('creep', 'end_taper'), 1.4), (('mass_kg',), 1.0)])
def test_how_large_effects_may_be_rests_on_the_least_certain(names, at_most):
    estimator = SimpleNamespace(certainty=lambda final, place: 1.96 / (0.2, 0.4)[place])
    effects = tuple(SimpleNamespace(name=n) for n in ('creep', 'end_taper'))
    final = SimpleNamespace(hypothesis=SimpleNamespace(effects=effects))
    named = [NamedEffect(n, 'muscle', [], (n,)) for n in names]
    assert verdict_module._at_most(estimator, final, named) == pytest.approx(at_most, rel=1e-4)


@pytest.mark.parametrize('certainty, verdict', [(6.0, 'effects'), (60.0, 'no_gap')])
def test_an_effect_is_too_small_for_a_name_only_where_that_is_certain(
        monkeypatch, certainty, verdict):
    result = SimpleNamespace(parameters=[], effects=['creep'], signals={})
    monkeypatch.setattr(verdict_module, 'held_without', lambda found: found)
    monkeypatch.setattr(verdict_module, '_noticed', lambda *given: [])
    creep = SimpleNamespace(name='creep')
    final = SimpleNamespace(hypothesis=SimpleNamespace(effects=(creep,)))
    outcome = SimpleNamespace(share={'muscle': 1.0}, named=[
        NamedEffect('creep', 'muscle', [], ('creep',))])
    validation = SimpleNamespace(
        noise={}, unexplained=lambda: 0.0, finds_again=lambda: True, base=None, final=final,
        moved=lambda *given: {'contraction': 0.8}, estimator=SimpleNamespace(
            certainty=lambda found, place: certainty, criteria=CRITERIA))
    verdict_module.judge(result, outcome, validation, 1.0, None)
    assert result.verdict == verdict


@pytest.mark.parametrize('found, left, verdict', [
    ('effects', 0.29, 'effects'), ('effects', 0.3, 'partial'), ('parameters', 0.31, 'partial'),
    ('parameters', 0.0, 'parameter')])
def test_what_leaves_much_of_the_gap_is_a_part_only(monkeypatch, found, left, verdict):
    result = SimpleNamespace(**{'parameters': [], 'effects': [], 'signals': {}} | {
        found: [SimpleNamespace(prior_deviation=9.0)]})
    monkeypatch.setattr(verdict_module, 'held_without', lambda found: found)
    outcome = SimpleNamespace(share={'muscle': 1.0}, named=[
        NamedEffect('creep', 'muscle', [], ('creep',))])
    final = SimpleNamespace(hypothesis=SimpleNamespace(effects=()))
    validation = SimpleNamespace(
        noise={}, unexplained=lambda: left, finds_again=lambda: True, base=None, final=final,
        moved=lambda *given: {'contraction': 9.0}, estimator=SimpleNamespace(
            certainty=lambda found, place: 60.0, criteria=CRITERIA))
    verdict_module.judge(result, outcome, validation, 1.0, None)
    assert result.verdict == verdict


@pytest.mark.parametrize('plain_share, stays', [(0.95, True), (0.85, False)])
def test_a_name_that_a_further_shape_made_uncertain_stands_in_its_plainer_form(
        monkeypatch, plain_share, stays):
    by_name = {c.effect: c for c in candidates(nominal(), ('contraction',))}

    def rival(form, share):
        candidate = by_name[form]
        return Rival('coulomb_friction', Fit(
            Hypothesis((candidate,)), np.ones(len(candidate.free)), {}, {}, {}), {'muscle': share})

    forms = [rival('coulomb_friction_presliding', 1.0), rival('coulomb_friction', plain_share)]
    none = Fit(Hypothesis(), np.zeros(0), {}, {}, {})
    shares = {id(r.found): r.share for r in forms}

    given = SimpleNamespace(
        problems=[], criteria=CRITERIA, estimator=SimpleNamespace(polish=lambda found: found),
        ranking=SimpleNamespace(shares=lambda found: shares[id(found)]))
    monkeypatch.setattr(size, '_stands', lambda context, name, current: (
        len(current.hypothesis.effects[0].free) == 1))
    monkeypatch.setattr(size, 'fit_without', lambda estimator, current, name, put=None: (
        put.found if put else none))
    named = [NamedEffect('coulomb_friction', 'muscle', forms, ('coulomb_friction',), forms)]
    left = with_certain_sizes(given, forms[0].found, named)
    assert left == ((forms[1].found, named) if stays else (none, []))

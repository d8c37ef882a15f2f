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
from pam_sim.gap import workflow
from pam_sim.gap.candidates import candidates
from pam_sim.gap.choice import Named, Rival
from pam_sim.gap.compare import CERTAIN_T, preference
from pam_sim.gap.cuts import known_numbers
from pam_sim.gap.finish import within_the_chain
from pam_sim.gap.hypothesis import Found, Hypothesis
from pam_sim.gap.parts import FIT, SELECT
from pam_sim.gap.screen import Screened
from pam_sim.gap.search import Search
import pytest

BIAS = next(c for c in candidates(nominal(), ('pressure', 'contraction'))
            if c.effect == 'pressure_bias')


class GoesOn(Tied):
    """Rivals that end elsewhere when their fit goes on; ``went_on`` tells which did."""

    def __init__(self, cut, before, left, ends=None):
        self.went_on, self.ends = [], ends or {}
        super().__init__(cut, before, left)

    def polish(self, found):
        """Return where a fit ends."""
        name = found.hypothesis.effects[0].name
        self.went_on.append(name)
        return self._found(name, self.ends[name]) if name in self.ends else found


@pytest.mark.parametrize('off, goes_on', [(2.2, False), (1.8, True)])
def test_a_fit_that_cannot_explain_enough_of_a_rest_does_not_go_on(off, goes_on):
    case = GoesOn(Blocks(60), 5.0, {'bladder_stiffness': off})
    current = case._found('coulomb_friction', 2.5)
    case.choice.tied(case.rivals, current, case.cuts[0])
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


@pytest.mark.parametrize('elsewhere, sure', [(True, True), (False, False)])
def test_half_sure_is_asked_of_all_of_the_data(elsewhere, sure):
    cut = Blocks(60)
    cut.part = np.where(cut.block % 2, SELECT, FIT)
    rng = np.random.default_rng(4)
    before, after = rng.uniform(1.2, 3.2, 60), rng.uniform(0.8, 3.0, 60)
    case = Tied(cut, before, {'bladder_stiffness': after})
    rival = case.rivals[0]
    alone = preference(cut, case.base.errors['muscle'], rival.found.errors['muscle'],
                       case.base.errors['muscle'], quiet=True)
    assert 1.0 < alone < CERTAIN_T
    if not elsewhere:                     # fitted to one half it does nothing for the other
        rival.crossed = case._found('bladder_stiffness', before)
    assert case.choice._is_sure(rival, case.base, cut) == sure


class Stage(Search):
    """A search with one cut, of which only single stages are asked."""

    def __init__(self, case):
        self.problem, self.base = SimpleNamespace(cuts=case.cuts), case.base
        self.pool = candidates(nominal(), ('contraction',))


@pytest.mark.parametrize('at_edge, best', [(False, 0.1), (True, 0.5)])
def test_of_a_name_the_formulation_that_leaves_least_competes(at_edge, best):
    cut = Blocks(60)
    case = Tied(cut, 5.0, {'bladder_stiffness': 0.5, 'parallel_spring': 0.1})
    cut.level = 2.0                       # both explain all beyond it
    forms = [SimpleNamespace(name='friction', found=r.found, at_edge=edge, off=off)
             for r, edge, off in zip(case.rivals, (False, at_edge), (0.5, 0.1))]
    found = Stage(case)._best_of_name(forms)
    assert [r.off for r in found] == [best]


@pytest.mark.parametrize('name, off, explained, poor', [
    ('bladder_stiffness', 3.0, 0.93, False), ('bladder_stiffness', 6.0, 0.93, True),
    ('bladder_stiffness', 6.0, 0.96, False), ('bladder_stiffness', 3.0, 0.89, True),
    ('bladder_stiffness', 0.3, 0.6, False), ('bladder_stiffness', 0.3, 0.4, True),
    ('threshold_pressure', 6.0, 0.93, False), ('threshold_pressure', 6.0, 0.89, True)])
def test_a_clear_rest_costs_a_name_of_several_formulations_earlier(name, off, explained, poor):
    case = Tied(Blocks(60), 20.0, {name: off})
    assert Stage(case)._is_poor(
        case.cuts[0], case.rivals[0].found, {'muscle': explained}) == poor


@pytest.mark.parametrize('off, explained, poor', [
    (6.0, 0.93, True), (6.0, 0.96, False), (3.0, 0.93, False)])
def test_a_number_of_the_model_leaves_no_clear_rest(off, explained, poor):
    case = Tied(Blocks(60), 20.0, {'threshold_pressure': off})
    mass = next(k for k in known_numbers(nominal()) if k.name == 'mass_kg')
    case.cuts[0].known = [mass]
    found = replace(case.rivals[0].found, hypothesis=Hypothesis((), ('mass_kg',)),
                    known_z={'muscle': np.array([8.0])})
    assert Stage(case)._is_poor(case.cuts[0], found, {'muscle': explained}) == poor


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
        Found(Hypothesis((effect,)), np.array(theta), {}, {}, {}), 0) == delays


@pytest.mark.parametrize('off, materiality, verdict', [
    (0.9, 0.3, 'no_gap'), (2.0, 0.3, 'unknown'), (2.0, 1.0, 'unknown'), (2.0, 1.5, 'no_gap')])
def test_a_gap_without_a_name_must_be_clear(monkeypatch, off, materiality, verdict):
    signal = SimpleNamespace(rmse_refit=np.hypot(1.0, off))
    result = SimpleNamespace(parameters=[], signals={'pressure': signal})
    proof = SimpleNamespace(noise={'pressure': 1.0}, highest_floor={'pressure': 0.8},
                            unexplained=lambda: 1.0)
    monkeypatch.setattr(workflow, 'is_material', lambda *given: False)
    monkeypatch.setattr(workflow, 'spread_of_numbers', lambda *given: {})
    proof.moved = proof.fall = lambda *given: (0.0, 0.0)
    proof.refit = proof.after = None
    found = SimpleNamespace(hypothesis=Hypothesis(), theta=())
    monkeypatch.setattr(workflow, 'held_without', lambda found: found)
    outcome = SimpleNamespace(named=[], share={'valve': 0.0})
    workflow._judge(result, outcome, None, proof, found, found, materiality, True)
    assert result.verdict == verdict


@pytest.mark.parametrize('tied, named', [
    (['pressure_bias'], ('pressure_bias',)), (['leakage'], ('leakage',)),
    (['leakage', 'pressure_bias'], ('leakage', 'pressure_bias')), ([], ('leakage',))])
def test_beside_another_effect_the_better_of_two_sensor_causes_takes_the_place(tied, named):
    alone = Found(Hypothesis((BIAS,)), np.ones(1), {}, {}, {})
    # By itself the bias explains what the threshold does; beside that it may be what the leak was.
    bias = Rival('pressure_bias', alone, {'valve': -2.0, 'muscle': 0.99})
    both = [Named('leakage', 'valve', [bias], ('leakage',)),
            Named('threshold_pressure', 'muscle', [], ('threshold_pressure',))]

    class Given(Search):

        def __init__(self):
            self.choice = SimpleNamespace(
                shares=lambda found: {},
                tied=lambda rivals, current, cut: [
                    next(r for r in rivals if r.name == name) for name in tied])
            self._swapped = lambda current, out, put=None: alone
            self._cut = lambda subsystem: None

    found = Given()._resolve(SimpleNamespace(hypothesis=SimpleNamespace(
        names=('leakage', 'threshold_pressure'))), both)[1]
    assert [w.names for w in found] == [named, ('threshold_pressure',)]


@pytest.mark.parametrize('effect, number', [
    ('viscous_damping', 'damping_n_s_per_m'), ('dead_volume', 'V_dead')])
def test_a_number_and_the_effect_that_is_another_name_of_it_are_one(effect, number):
    given = SimpleNamespace(
        problem=SimpleNamespace(cuts=['muscle']), matters=lambda current, without: True,
        _is_missed=lambda *judged: True, _swapped=lambda current, out: (*current, out))
    named = [Named(n, 'muscle', [], (n,)) for n in (number, 'creep', effect)]
    assert Search._eliminate(given, (), named) == ((number,), named[1:])
    assert Search._eliminate(given, (), named[:2]) == ((), named[:2])


def test_an_effect_that_gave_way_to_its_limit_is_tried_beside_it():
    def screened(name, *promises):
        return [Screened(c, (), {'muscle': p}) for c, p in zip(
            (c for c in candidates(nominal(), ('contraction',)) if c.name == name), promises)]

    creep, loops = screened('creep', 0.0)[0], screened('hysteresis', 0.1, 0.3, 0.2)
    given = [creep, *loops, *screened('end_taper', 0.9)]
    assert Search._wider(given, {'bladder_stiffness'}) == [creep]
    assert Search._wider(given, {'coulomb_friction', 'parallel_spring'}) == [loops[1]]


@pytest.mark.parametrize('left, beside, missed', [
    (0.67, None, True), (0.67, 'end_taper', False), (0.5, 'end_taper', True), (0.8, None, False)])
def test_what_is_alone_in_its_cut_is_missed_as_a_single_effect_is(left, beside, missed):
    case = Tied(Blocks(60), 1.2, {'bladder_stiffness': 1.2 * left})
    given = SimpleNamespace(
        base=case.base, first_gap={'muscle': 1.44}, least_gap=0.01)
    assert Search._is_missed(given, case.cuts[0], case.rivals[0].found,
                             case._found(beside, 1.2)) == missed


@pytest.mark.parametrize('names, at_most', [
    (('creep',), 1.2), (('creep', 'end_taper'), 1.4), (('mass_kg',), 1.0)])
def test_how_large_effects_may_be_rests_on_the_least_certain(names, at_most):
    problem = SimpleNamespace(certainty=lambda final, place: 1.96 / (0.2, 0.4)[place])
    effects = tuple(SimpleNamespace(name=n) for n in ('creep', 'end_taper'))
    final = SimpleNamespace(hypothesis=SimpleNamespace(effects=effects))
    named = [Named(n, 'muscle', [], (n,)) for n in names]
    assert workflow._at_most(problem, final, named) == pytest.approx(at_most, rel=1e-4)


@pytest.mark.parametrize('certainty, verdict', [(6.0, 'effects'), (60.0, 'no_gap')])
def test_an_effect_is_too_small_for_a_name_only_where_that_is_certain(
        monkeypatch, certainty, verdict):
    result = SimpleNamespace(parameters=[], effects=['creep'], signals={})
    proof = SimpleNamespace(noise={}, unexplained=lambda: 0.0, fall=lambda *given: (1.0, 0.8),
                            moved=lambda *given: {'contraction': 0.8}, refit=None, after=None)
    monkeypatch.setattr(workflow, 'held_without', lambda found: found)
    creep = SimpleNamespace(name='creep')
    final = SimpleNamespace(hypothesis=SimpleNamespace(effects=(creep,)))
    outcome = SimpleNamespace(share={'muscle': 1.0}, named=[
        Named('creep', 'muscle', [], ('creep',))])
    problem = SimpleNamespace(certainty=lambda found, place: certainty)
    workflow._judge(result, outcome, problem, proof, None, final, 1.0, True)
    assert result.verdict == verdict


@pytest.mark.parametrize('plain_share, stays', [(0.95, True), (0.85, False)])
def test_a_name_that_a_further_shape_made_uncertain_stands_in_its_plainer_form(
        plain_share, stays):
    by_name = {c.effect: c for c in candidates(nominal(), ('contraction',))}

    def rival(form, share):
        candidate = by_name[form]
        return Rival('coulomb_friction', Found(
            Hypothesis((candidate,)), np.ones(len(candidate.free)), {}, {}, {}), {'muscle': share})

    forms = [rival('coulomb_friction_presliding', 1.0), rival('coulomb_friction', plain_share)]
    none = Found(Hypothesis(), np.zeros(0), {}, {}, {})
    shares = {id(r.found): r.share for r in forms}

    class Last(Search):
        problem = SimpleNamespace(cuts=[], polish=lambda found: found)
        choice = SimpleNamespace(shares=lambda found: shares[id(found)])

        def __init__(self):
            pass

        def _stands(self, name, current):
            return len(current.hypothesis.effects[0].free) == 1

        def _swapped(self, current, out, put=None):
            return put.found if put else none

    named = [Named('coulomb_friction', 'muscle', forms, ('coulomb_friction',), forms)]
    left = Last()._established(forms[0].found, named)
    assert left == ((forms[1].found, named) if stays else (none, []))

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

"""Effects that another one looks like as long as they are tried one by one."""

from dataclasses import replace

from gap_runs import duties, NOMINAL, nominal, recorded, voltages
from pam_sim import load_rig
from pam_sim.gap import find_gap
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.select.context import context_of
from pam_sim.gap.select.pairs import promising_pairs
from pam_sim.gap.select.search import search
from pam_sim.gap.subsystems.problems import subsystem_problems
import pytest

CREEP = {'name': 'creep', 'parameters': {
    'stiffness_1_n_per_m': 43.0, 'stiffness_2_n_per_m': 47.0, 'time_constant_1_s': 0.9,
    'time_constant_2_s': 14.0}}
BIAS = {'name': 'contraction_bias', 'parameters': {'bias_m': -6e-4}}
SMALLER = {'name': 'contraction_bias', 'parameters': {'bias_m': -3.8e-4}}
LOOK_ALIKES = ['creep', 'contraction_bias', 'bladder_stiffness', 'end_taper']


def without_other_beginnings(monkeypatch):
    """Let the search begin with the best effect only."""
    monkeypatch.setattr(
        'pam_sim.gap.select.search.begun_otherwise',
        lambda _, selected, first, **how: selected)


@pytest.fixture(scope='module')
def run():
    return recorded(nominal().with_(effects=[CREEP, BIAS]), voltages(15.0))


def test_the_true_pair_promises_most(run):
    estimator = Estimator(nominal(), subsystem_problems(nominal(), [Recording(run, 'ppr')]))
    screened = context_of(estimator, 0.05, 0.01).screened
    problem = next(c for c in estimator.problems if c.subsystem == 'muscle')
    pairs = promising_pairs(estimator, estimator.base, screened, problem)
    assert {c.name for c in pairs[0][0]} == {'creep', 'contraction_bias'}
    assert all(a.name != b.name for (a, b), _ in pairs)


def test_both_are_named_where_one_by_one_fails(run, monkeypatch):
    both = find_gap(run, nominal(), effects=LOOK_ALIKES, unnamed=())
    assert {e['name'] for e in both.effects} == {'creep', 'contraction_bias'}
    assert both.verdict == 'effects'
    monkeypatch.setattr('pam_sim.gap.select.search.pair_of', lambda search, problem: None)
    without_other_beginnings(monkeypatch)
    alone = find_gap(run, nominal(), effects=LOOK_ALIKES, unnamed=())
    assert {e['name'] for e in alone.effects} != {'creep', 'contraction_bias'}


def test_what_was_dropped_does_not_keep_the_place_of_another(monkeypatch):
    """One by one, a third one is taken for both, then one of them; when it goes, the other."""
    run = recorded(nominal().with_(effects=[CREEP, SMALLER]), voltages(12.0))
    monkeypatch.setattr('pam_sim.gap.select.search.pair_of', lambda search, problem: None)
    found = find_gap(run, nominal(), effects=LOOK_ALIKES)
    assert {e['name'] for e in found.effects} == {'creep', 'contraction_bias'}


def test_a_wrong_number_beside_effects_is_no_further_effect():
    """A smaller orifice with slow valves looks like more air in the tube, to nine tenths."""
    given = load_rig(NOMINAL, valve='hsv')
    true = given.with_(parameters={'C': 1.5e-10}, effects=[
        {'name': 'valve_dead_zone', 'parameters': {'open_time_s': 1.7e-3, 'close_time_s': 2e-3}},
        {'name': 'valve_dead_time', 'parameters': {'delay_s': 0.035}}, CREEP])
    run = recorded(true, duties(9.0, lasts_ms=(60, 200), openings=(0.2, 0.6)))
    tried = ['valve_dead_zone', 'valve_dead_time', 'dead_volume', 'creep']
    found = find_gap(run, given, effects=tried, unnamed=())
    assert {e['name'] for e in found.effects} == {'valve_dead_zone', 'valve_dead_time', 'creep'}
    number, = found.parameters
    assert number.name == 'C' and number.ci95[0] <= 1.5e-10 <= number.ci95[1]
    delay = next(e for e in found.effects if e['name'] == 'valve_dead_time')
    assert delay['parameters']['delay_s']['value'] == pytest.approx(0.035, abs=0.003)


def test_a_dead_time_beside_a_wrong_lag_is_no_lag_of_the_line():
    """A lag of two stages in the line looks like both, to a hundredth."""
    lag_s = 1.2 * nominal().parameters['T_m']
    true = nominal().with_(parameters={'T_m': lag_s}, effects=[
        {'name': 'valve_dead_time', 'parameters': {'delay_s': 0.025}}])
    found = find_gap(recorded(true, voltages(12.0)), nominal(),
                     effects=['valve_dead_time', 'tube_lag'], unnamed=())
    assert [e['name'] for e in found.effects] == ['valve_dead_time']
    number, = found.parameters
    assert number.name == 'T_m' and number.ci95[0] <= lag_s <= number.ci95[1]


def test_names_that_the_proof_refutes_are_looked_for_once_more(monkeypatch):
    """A small fill valve looks like a leak as long as the moves are short."""
    given = load_rig(NOMINAL, valve='hsv')
    truth = given.with_(parameters={'C': 0.8 * given.parameters['C']}, effects=[
        {'name': 'vent_asymmetry', 'parameters': {'ratio_minus_1': -0.2}}])
    searched = recorded(truth, duties(20.0))
    longer = recorded(truth, duties(20.0, seed=8, lasts_ms=(40, 280), openings=(0.1, 1.0)))
    names = ['leakage', 'dead_volume', 'vent_asymmetry']

    def misled(context, only_singly):
        """Find the leak, with all rivals of a whole search."""
        first = search(context, only_singly).first
        less = replace(
            context, pool=tuple(c for c in context.pool if c.name != 'vent_asymmetry'),
            screened=tuple(
                s for s in context.screened if s.candidate.name != 'vent_asymmetry'))
        return replace(search(less, only_singly), first=first)

    monkeypatch.setattr('pam_sim.gap.proof.search', misled)
    found = find_gap(searched, given, longer, names, unnamed=())
    assert [e['name'] for e in found.effects] == ['vent_asymmetry']
    assert [c.name for c in found.parameters] == ['C']
    assert found.verdict == 'effects' and found.unexplained_fraction < 0.01
    monkeypatch.setattr('pam_sim.gap.proof.searched_again', lambda _, outcome: outcome)
    once = find_gap(searched, given, longer, names, unnamed=())
    assert [e['name'] for e in once.effects] == ['leakage'] and once.unexplained_fraction > 0.1
    # A term that explains all shows that the leak stood for something else.
    less = find_gap(searched, given, longer, names[:2], unnamed=('term',))
    assert [e['name'] for e in less.effects] == ['leakage'] and less.proposal.explained > 0.9
    assert any(r.startswith('With this term, leakage shrinks to less') for r in less.remarks)

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

"""The scorer itself: who knows the key scores everything, who does not scores chance."""

import re

import pytest
from scoring_judge import (
    abstains, is_of_family, is_right, read_answer, shrink_percent, wrong_names)
from scoring_mutants import constant, oracle
from scoring_table import scored, table, wilson
from scoring_text import report
import truth_cases
from truth_effects import EFFECTS

FAMILIES = {name: hidden.family for name, hidden in EFFECTS.items()}


@pytest.fixture(scope='module')
def keys():
    found = []
    for case in truth_cases.plan(330, 21):
        key = truth_cases.key_of(case, truth_cases.draw(case))
        key['gap_sigma'] = {'contraction': 0.0 if 'null' in case.kind else 5.0}
        found.append(key)
    return found


def values(rows):
    return {row.measure: row for row in rows}


def test_who_knows_the_key_meets_every_bar(keys):
    cases = [scored(k, oracle(k), oracle(k, True) if k['rivals'] else None) for k in keys]
    rows = table(cases, FAMILIES)
    assert [row.measure for row in rows if row.met is not True] == [
        '95 % intervals that cover the truth']      # all of 100 % is above 98 %
    assert values(rows)['right single name'].value.startswith('100.0 % (150/150')
    text = report(cases, FAMILIES)
    assert '- none' in text
    truths, as_due = re.search(r'Of (\d+) truths, (\d+) had only', text).groups()
    assert truths == as_due and int(truths) > 20


@pytest.mark.parametrize('verdict, name', [
    ('no_gap', ''), ('unknown', ''), ('effects', 'creep'), ('partial', 'creep'),
    ('crashed', '')])
def test_a_constant_answer_scores_chance(keys, verdict, name):
    cases = [scored(k, constant(verdict, name)) for k in keys]
    rows = values(table(cases, FAMILIES))
    right = sum(k['effects'] == [name] for k in keys if k['kind'] == 'single')
    assert rows['right single name'].value.startswith(f'{100 * right / 150:.1f} % ({right}/150')
    assert right <= 8 and not rows['right single name'].met
    assert bool(rows['false alarm per null record'].met) == (verdict == 'no_gap')
    far = rows['out of library, far: abstains or states a remainder']
    assert bool(far.met) == (verdict == 'unknown')
    assert bool(rows['wrong name, all cases'].met) == (verdict not in ('effects', 'partial'))
    assert not rows['two effects, both right'].met


def test_one_wrong_answer_is_found_and_named(keys):
    cases = [scored(k, oracle(k)) for k in keys]
    victim = next(i for i, k in enumerate(keys) if k['effects'] == ['leakage'])
    cases[victim] = scored(keys[victim], constant('effects', 'creep'))
    rows = values(table(cases, FAMILIES))
    assert rows['right single name'].failed == (keys[victim]['name'],)
    assert rows['wrong name, all cases'].failed == (keys[victim]['name'],)
    text = report(cases, FAMILIES, {'rival': cases})
    assert f'- {keys[victim]["name"]} (single' in text and 'named creep' in text
    listed = text.split('| truth | answers |')[1].split('\n\n')[0]
    assert listed.count('\n') == 2 and '| leakage | ' in listed and 'creep 1 |' in listed


def test_other_methods_are_compared_on_the_cases_they_answered(keys):
    cases = [scored(k, oracle(k)) for k in keys]
    rows = re.findall(r'^\| (?:pam gap|rival) (\|.*)$', report(
        cases, FAMILIES, {'rival': cases[:30]}), re.M)
    assert len(rows) == 2 and rows[0] == rows[1] and '(0/30;' in rows[0]


def test_a_number_by_another_name_is_right():
    key = {'effects': ['dead_volume'], 'wrong': {}, 'outside': []}
    assert is_right(read_answer({'verdict': 'parameter', 'parameters': [{'name': 'V_dead'}]}), key)
    key = {'effects': [], 'wrong': {'damping_n_s_per_m': 40.0}, 'outside': []}
    assert is_right(read_answer(constant('effects', 'viscous_damping')), key)
    assert not is_right(read_answer(constant('effects', 'creep')), key)


def test_a_set_has_the_family_that_all_of_it_has():
    def answer(*names, verdict='ambiguous'):
        return read_answer(constant(verdict, names[0]) | {'ambiguity_set': list(names)})
    assert is_of_family(answer('tube_lag', 'valve_dead_time'), 'transport', FAMILIES)
    assert not is_of_family(answer('tube_lag', 'leakage'), 'transport', FAMILIES)
    assert not is_of_family(answer('tube_lag', 'mass_kg'), 'transport', FAMILIES)
    assert is_of_family(answer('tube_lag', verdict='effects'), 'transport', FAMILIES)
    assert not is_of_family(answer('leakage', verdict='effects'), 'transport', FAMILIES)
    assert not is_of_family(read_answer(constant('no_gap')), 'transport', FAMILIES)


def test_both_refits_are_reported_where_they_differ(keys):
    small = [k | {'gap_sigma_tempered': k['gap_sigma']} for k in keys]
    victim = next(i for i, k in enumerate(small) if k['kind'] == 'single')
    small[victim] = small[victim] | {'gap_sigma': {'contraction': 0.9}}
    text = report([scored(k, oracle(k)) for k in small], FAMILIES)
    assert '(149/149' in text and '(150/150' in text.split('tempered')[1]
    assert f'other side of 1 σ with it: {small[victim]["name"]}.' in text
    assert 'tempered' not in report([scored(k, oracle(k)) for k in keys], FAMILIES)


def test_a_stated_remainder_excuses_a_name_only_out_of_library():
    answer = constant('effects', 'viscous_damping') | {'unexplained_fraction': 0.3}
    assert wrong_names(read_answer(answer), {'effects': [], 'wrong': {}, 'outside': ['x']}) == ()
    assert wrong_names(read_answer(answer), {'effects': ['creep'], 'wrong': {}, 'outside': []})


def test_a_kind_that_the_library_holds_since_may_be_named():
    key = {'effects': [], 'wrong': {}, 'outside': ['swinging_regulator']}
    named, wrongly = (read_answer(constant('effects', name)) for name in (
        'regulator_overshoot', 'tube_lag'))
    assert wrong_names(named, key) == () and abstains(named, key)
    assert wrong_names(wrongly, key) and not abstains(wrongly, key)
    assert wrong_names(named, key | {'outside': ['ripple']}) == ('regulator_overshoot',)


def test_shrink_is_that_of_the_signal_that_missed_most():
    signals = {'pressure': {'noise_floor': 1.0, 'rmse_refit': 2.0, 'rmse_after': 2.0},
               'contraction': {'noise_floor': 1.0, 'rmse_refit': 10.0, 'rmse_after': 1.0},
               'force': {'noise_floor': 1.0, 'rmse_refit': 0.9, 'rmse_after': 0.9}}
    assert shrink_percent(read_answer({'signals': signals})) == (100.0, False)
    signals['contraction']['rmse_after'] = 11.0
    assert shrink_percent(read_answer({'signals': signals}))[1]


def test_wilson_interval_is_the_published_one():
    assert wilson(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-3)
    assert wilson(0, 50)[1] == pytest.approx(0.0713, abs=1e-3)
    assert wilson(0, 0) == (0.0, 1.0)

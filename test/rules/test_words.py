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

"""Rules in words: conditions, sizes, order."""

import numpy as np
from pam_actuation.control.sofc.rule_table import Antecedent, RuleTable
from pam_actuation.control.sofc.words import number, ranked, sentence
import pytest
from rule_bases import fresh, taught


def test_the_most_important_rule_comes_first():
    found = ranked(taught())
    assert [one.sentence for one in found] == [
        'near 15 mm, extending: add 6.3 kPa',
        'if error is small positive and change of error is about zero (contracting) then raise '
        'pressure a little (+1.2 kPa)',
        'near 5 mm, contracting: take off 0.25 kPa',
        'near 16 mm, at rest: add 12.0 kPa',
        'if error is small negative and change of error is about zero (extending) then lower '
        'pressure (-5.4 kPa)']
    first = found[0]
    assert (first.table, first.place, first.initial_pa) == ('feedforward', (1, 12), 0.0)
    assert first.importance_pa_s == pytest.approx(6300.0 * 2.0)
    sizes = [one.importance_pa_s for one in found]
    assert sizes == sorted(sizes, reverse=True)


def test_before_any_rule_fired_the_largest_comes_first():
    found = ranked(fresh(feedback_gain_pa=6000.0))
    assert len(found) == 2 * (49 - 7)
    assert 'large negative and change of error is large negative' in found[0].sentence
    assert {one.fired_s for one in found} == {0.0}


@pytest.mark.parametrize('size_kpa, words', [
    (0.0, 'leave pressure as it is (+0.00 kPa)'), (0.049, 'leave pressure as it is (+0.05 kPa)'),
    (-0.051, 'lower pressure a little (-0.05 kPa)'), (1.99, 'raise pressure a little (+2.0 kPa)'),
    (2.0, 'raise pressure (+2.0 kPa)'), (-9.99, 'lower pressure (-10.0 kPa)'),
    (10.0, 'raise pressure much (+10.0 kPa)'), (-120.0, 'lower pressure much (-120.0 kPa)')])
def test_sizes_in_words(size_kpa, words):
    rules = fresh(feedback_gain_pa=2e5)
    rules.feedback[0, 3, 3] = size_kpa / 200.0
    table = rules.tables()[0]
    assert sentence(table, (0, 3, 3)).endswith(f'(contracting) then {words}')


def test_rates_say_their_direction():
    motion = fresh().tables()[-1]
    rates = motion.antecedents[1].knots
    assert sentence(motion, (0, 0)) == 'near 0 mm, extending at 120 mm/s: add nothing'
    assert sentence(motion, (15, len(rates) - 1)) == (
        'near 30 mm, contracting at 120 mm/s: add nothing')


def test_a_table_nobody_knew_is_said_too():
    values = np.array([[-3000.0, 0.0]])
    table = RuleTable(
        'load', (Antecedent('load', 'N', np.array([49.0])),
                 Antecedent('supply', '', np.zeros(2), ('low', 'full'))),
        values, values * 0.0, values * 0.0, 1e5, 1.0, 'Pa')
    assert sentence(table, (0, 0)) == (
        'if supply is low and near 49 N then lower pressure (-3.0 kPa)')


@pytest.mark.parametrize('value, text', [
    (0.0, '0'), (-1e-12, '0'), (14.0, '14'), (13.3333, '13.3'), (-0.6667, '-0.667'),
    (120.0, '120'), (1234.5, '1234'), (0.02, '0.02')])
def test_numbers_of_knots(value, text):
    assert number(value) == text

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

"""Grids, changes, terminal text and page of rules, the same for every table."""

import json
import re

import numpy as np
from pam_actuation.report.rules import page
from pam_actuation.rules.grids import grids
from pam_actuation.rules.source import FoundRules
from pam_actuation.rules.text import as_text
from pam_actuation.rules.view import view_of
from pam_sim.errors import InputError
import pytest
from rule_bases import fresh, taught


def found(rules, **more):
    return FoundRules('mine', 'rule file', rules, **more)


def test_every_rule_of_every_table_is_in_one_grid():
    rules = taught()
    shown = grids(rules)
    assert sum(grid.values.size for grid in shown) == sum(
        table.values.size for table in rules.tables())
    assert {grid.title for grid in shown} == {
        'feedback rules, contracting', 'feedback rules, extending', 'feedforward rules',
        'motion rules'}
    by_title = {grid.title: grid for grid in shown}
    feedback = by_title['feedback rules, contracting']
    assert feedback.values[4, 3] == pytest.approx(1.2)
    assert feedback.fired_s[4, 3] == pytest.approx(5.0)
    assert feedback.change[4, 3] == pytest.approx(1.2 - 1.0)
    assert feedback.rows.labels[4] == 'PS 0.667' and feedback.columns.title.endswith('[mm/s]')
    forward = by_title['feedforward rules']
    assert forward.values.shape == (25, 2) and forward.columns.labels == (
        'contracting', 'extending')
    assert forward.values[12, 1] == pytest.approx(6.3) and forward.rows.labels[12] == '15'
    assert np.sum(~by_title['motion rules'].never) == 1


def test_changes_against_other_rules():
    rules, other = taught(), taught()
    other.feedforward[1, 12] = 5000.0
    view = view_of(found(rules), FoundRules('theirs', 'rule file', other))
    changed = [grid for grid in view.grids if grid.change.any()]
    assert [grid.title for grid in changed] == ['feedforward rules']
    assert changed[0].change[12, 1] == pytest.approx(1.3)
    assert '1 differ from theirs (by up to 1.30 kPa)' in view.summary()
    table = view.to_dict()['tables'][1]
    assert table['change'][1][12] == pytest.approx(1300.0)
    other.scaling['rig'] = 'other/hsv'
    view = view_of(found(rules), FoundRules('theirs', 'rule file', other))
    assert view.remarks == ('mine and theirs differ in rig (straight/ppr and other/hsv).',)


@pytest.mark.parametrize('changed, words', [
    ({'reference_knots': 13.0}, '13 knots of reference there and 25 here'),
    ({'error_universe_m': 3e-3}, 'error of the feedback rules runs from -3 to 3 mm there and '
     'from -2 to 2 mm here')])
def test_rules_over_other_places_are_not_compared(changed, words):
    with pytest.raises(InputError, match=words) as caught:
        view_of(found(taught()), FoundRules('theirs', 'rule file', fresh(**changed)))
    assert caught.value.where == 'theirs'


def text_of(rules, top=3, **more):
    return as_text(found(rules), view_of(found(rules)), top, **more)


def test_text_shows_values_changes_firing_and_words():
    lines = text_of(taught()).splitlines()
    assert 'never fired' in lines[0] and 'differ from the initial rules' in lines[0]
    blocks = '\n'.join(lines).split('\n\n')
    first = blocks[1].splitlines()
    assert first[0].startswith('feedback rules, contracting, kPa: error [mm] downwards')
    names = first[2].split('  ')
    assert [name for name in map(str.strip, names) if name] == [
        'NB -40', 'NM -26.7', 'NS -13.3', 'ZE 0', 'PS 13.3', 'PM 26.7', 'PB 40']
    row = next(line for line in first if line.strip().startswith('PS 0.667'))
    assert row.split()[2:] == ['-2.00·', '-1.00·', '0·', '+1.20', '+2.00·', '+3.00·', '+4.00·']
    assert any(line.endswith('changed by, kPa, against the initial rules') for line in first)
    assert any(line.strip().startswith('PS 0.667') and '5.00' in line for line in first)
    assert len({len(line) for line in first[2:10]}) == 1           # aligned
    forward = next(block for block in blocks if block.startswith('feedforward')).splitlines()
    assert 'all zero in the initial rules' in forward[1]
    assert forward[-1].split() == ['15', '0·', '·', '+6.30', '2.00']
    assert blocks[-1].splitlines()[1].strip().endswith('% near 15 mm, extending: add 6.3 kPa'
                                                       .replace('% ', '%  '))
    assert len(blocks[-1].splitlines()) == 4


def test_few_columns_have_their_changes_beside_them():
    rules = taught()
    rules.feedforward_initial[1, 12] = 5000.0
    block = next(block for block in text_of(rules).split('\n\n') if block.startswith('feedf'))
    lines = block.splitlines()
    assert lines[0].endswith('changes against the initial rules')
    assert lines[2].split() == ['contracting', 'changed', 'by', 'fired,', 's', 'extending',
                                'changed', 'by', 'fired,', 's']
    assert lines[-1].split() == ['15', '0·', '0', '·', '+6.30', '+1.30', '2.00']


def test_text_of_rules_that_never_fired():
    text = text_of(fresh())
    assert 'motion rules: all zero, never fired' in text
    assert 'No rule has fired yet; the 3 largest of 84:' in text
    quiet = fresh()
    quiet.feedback[...] = 0.0
    quiet.feedback_initial[...] = 0.0
    assert text_of(quiet).endswith('No rule acts: all that fired are zero.')


def test_wide_tables_are_broken_into_blocks():
    rules = taught()
    rules.motion[...] = 1e4
    narrow = text_of(rules, width=70)
    assert max(len(line) for block in narrow.split('\n\n')[1:-1]
               for line in block.splitlines() if 'rules' not in line) <= 70
    assert len(narrow.splitlines()) > len(text_of(rules, width=200).splitlines())
    assert '\x1b' not in narrow


def test_colours_change_no_column():
    plain, painted = text_of(taught()), text_of(taught(), colour=True)
    assert '\x1b[38;5;' in painted
    assert re.sub('\x1b\\[[0-9;]*m', '', painted) == plain


def test_page_is_one_file_with_every_grid():
    rules = taught()
    content = page(FoundRules('<b>mine', 'rule file', rules), view_of(found(rules)), 2)
    assert '<b>mine' not in content and '&lt;b&gt;mine' in content
    assert content.count('<svg') == 4 and '<script' not in content and '<?xml' not in content
    assert content.count('near 15 mm, extending: add 6.3 kPa') == 1
    assert not re.search(r'(src|href)\s*=\s*"https?:', content)
    assert 'straight/ppr' in content and 'Motion rules' in content
    assert page(found(fresh()), view_of(found(fresh())), 2).count('All zero, never fired') == 2


def test_json_is_plain_and_complete():
    data = json.loads(json.dumps(view_of(found(taught())).to_dict(), allow_nan=False))
    assert [table['name'] for table in data['tables']] == ['feedback', 'feedforward', 'motion']
    assert data['tables'][0]['values'][0][4][3] == pytest.approx(1200.0)
    assert data['tables'][0]['antecedents'][1]['words'][4] == 'small positive'
    assert data['rules'][0]['sentence'].startswith('near 15 mm')

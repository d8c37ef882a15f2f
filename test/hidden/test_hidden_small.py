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

"""A few hidden cases through `pam gap`; benchmarks/hidden_effects.py asks hundreds."""

from asking import pam_gap
import pytest
from scoring_judge import is_false_alarm, is_right, read_answer, wrong_names
from shorter import shortened
from truth_cases import build, Case

# Recordings of a third of the length that the examination has: each is searched in seconds.
CASES = (
    Case('null', 'null', 'ppr', (77, 1), protocol='steps'),
    Case('parameter', 'parameter', 'ppr', (77, 2), ('K_m',), 'triangle'),
    Case('bladder', 'single', 'ppr', (77, 3), ('bladder_stiffness',), 'steps'),
    Case('dead_zone', 'single', 'ppr', (77, 4), ('valve_dead_zone',), 'multisine'),
    Case('thermal', 'single', 'hsv', (77, 5), ('thermal',), 'triangle'))


@pytest.mark.parametrize('case', CASES, ids=lambda case: case.name)
def test_pam_gap_finds_what_is_hidden(case, tmp_path, monkeypatch):
    monkeypatch.setattr('truth_cases.commands.protocol', shortened)
    key = build(case, tmp_path / 'case', with_gap=False)
    answer = read_answer(pam_gap(tmp_path / 'case', [tmp_path / 'case' / 'fit'], tmp_path / 'out'))
    assert not wrong_names(answer, key)
    if key['kind'] == 'null':
        assert not is_false_alarm(answer), answer.raw['reason']
    else:
        assert is_right(answer, key), (answer.verdict, answer.claimed, answer.raw.get('reason'))

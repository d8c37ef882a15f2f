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

"""A sample of bad calls: exit code 2, one line, nothing written, nothing deleted."""

from bad_call_place import changes, look, prepare
from bad_calls import Call, in_this_process, judge, make, run
from pam_actuation.cli.overview import VERBS
import pytest


def test_bad_calls_are_refused_in_one_line_and_touch_nothing():
    outcome = run(140, seed=1, processes=3)
    assert outcome.bad == []
    assert {*VERBS} <= {*outcome.calls} and sum(outcome.calls.values()) == 143


def test_the_same_number_is_the_same_call():
    assert [make(k, 5) for k in range(50)] == [make(k, 5) for k in range(50)]
    assert [make(k, 5) for k in range(50)] != [make(k, 6) for k in range(50)]


def test_a_call_that_is_right_is_noticed(tmp_path, monkeypatch):
    here = prepare(tmp_path)
    monkeypatch.chdir(here)
    before = look(tmp_path)
    call = Call(('simulate', 'good.yaml', '--out', 'new'), 'nothing')
    assert judge(call, *in_this_process(call.arguments)).startswith('exit code 0')
    assert 'home/work/here/new/new_0.mcap' in changes(before, look(tmp_path))


@pytest.mark.parametrize(('answer', 'words'), [
    ((1, 'Traceback (most recent call last):\n', ''), 'traceback'),
    ((2, 'pam info: x.mcap: no\nsuch file\n', ''), 'not one line'),
    ((2, '', ''), 'not one line'), ((0, '', ''), 'exit code 0'),
    ((2, 'pam info: that did not work\n', ''), 'does not name the place')])
def test_a_bad_answer_is_noticed(answer, words):
    call = Call(('info', 'x.mcap'), 'bag', ('x.mcap',))
    assert words in judge(call, *answer)
    assert judge(call, 2, 'pam info: x.mcap: no such file\n', '') == ''

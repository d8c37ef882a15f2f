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

"""A few of the kills that benchmarks/kill_recorder.py does by the hundred."""

import importlib
from pathlib import Path
import random
import types

import pytest

FOLDER = Path(__file__).resolve().parents[2] / 'benchmarks'


@pytest.fixture
def kills(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module('kill_recorder')


@pytest.mark.timed
@pytest.mark.parametrize('split_bytes', (0, 150_000))
def test_a_killed_process_loses_less_than_a_second_and_alters_nothing(
        tmp_path, kills, split_bytes):
    cases = list(kills.kill_processes(
        tmp_path, 4, random.Random(split_bytes), shortest_s=1.0, longest_s=3.0,
        split_bytes=split_bytes))
    results = [kills.examine(case) for case in cases]
    assert [problem for result in results for problem in result['problems']] == []
    assert sum(result['messages'] for result in results) > 2000
    assert max(result['files'] for result in results) > (1 if split_bytes else 0)


@pytest.mark.ros
def test_a_killed_node_loses_less_than_a_second_and_alters_nothing(tmp_path, kills):
    pytest.importorskip('rclpy')
    case, = kills.kill_nodes(tmp_path, 1, random.Random(2), longest_s=2.0)
    result = kills.examine(case, kills.NODE_RATES_HZ)
    assert result['problems'] == [] and result['messages'] > 100


@pytest.mark.timed
def test_the_check_sees_an_altered_and_a_missing_message(tmp_path, kills, monkeypatch):
    case, = kills.kill_processes(tmp_path, 1, types.SimpleNamespace(uniform=lambda *_: 2.0))
    assert kills.examine(case)['problems'] == []
    numbered = kills.numbered
    monkeypatch.setattr(
        kills, 'numbered', lambda topic, number: numbered(topic, number + (number == 3)))
    problems = kills.examine(case)['problems']
    assert len(problems) == 3 and 'altered' in problems[0]
    monkeypatch.undo()
    case['killed_ns'] += 2 * 10**9
    assert any('s before the kill' in problem for problem in kills.examine(case)['problems'])

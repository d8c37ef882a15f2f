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

"""The rooms of the gap workflow: arrows point one way; thresholds stand in one place."""

import ast
from dataclasses import fields, replace
from pathlib import Path

from gap_runs import nominal, recorded, voltages
from pam_sim.gap import find_gap
from pam_sim.gap.criteria import CRITERIA, Criteria, GROUPS, table
import pytest

FOLDER = Path(__file__).resolve().parents[2] / 'pam_sim' / 'gap'
ROOMS = ('criteria', 'words', 'share', 'data', 'result', 'subsystems', 'fit', 'select', 'verify',
         'proof', 'report', 'plan', 'verdict', 'propose', 'workflow', '__init__')


def room_of(path):
    return path.relative_to(FOLDER).with_suffix('').parts[0]


@pytest.mark.parametrize('path', sorted(FOLDER.rglob('*.py')), ids=lambda path: path.stem)
def test_a_room_knows_only_those_before_it(path):
    mine = ROOMS.index(room_of(path))
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.ImportFrom) and node.module.startswith('pam_sim.gap.'):
            assert ROOMS.index(node.module.split('.')[2]) <= mine, node.module


def test_no_file_is_long():
    lines = {path.name: len(path.read_text(encoding='utf-8').splitlines())
             for path in FOLDER.rglob('*.py')}
    assert max(lines.values()) <= 310, lines


def test_every_criterion_is_told_and_compared_somewhere():
    text = '\n'.join(path.read_text(encoding='utf-8') for path in FOLDER.rglob('*.py')
                     if path.stem != 'criteria')
    assert len(table()) == len(fields(Criteria))
    for criterion in table():
        assert criterion.group in GROUPS
        assert criterion.meaning.endswith('.') and criterion.source.endswith('.')
        assert f'.{criterion.name}' in text, criterion.name


def test_criteria_given_to_the_workflow_decide():
    rig = nominal().with_(effects=[
        {'name': 'valve_hysteresis', 'parameters': {'half_width_pa': 3e3}}])
    run = recorded(rig, voltages(12.0))
    usual = find_gap(run, nominal(), effects=['valve_hysteresis'])
    strict = find_gap(run, nominal(), effects=['valve_hysteresis'],
                      criteria=replace(CRITERIA, certain_sd=1e9))
    assert [e['name'] for e in usual.effects] == ['valve_hysteresis'] and not strict.effects

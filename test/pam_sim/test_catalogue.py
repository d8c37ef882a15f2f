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

"""The catalogue: everything that is registered, each with what a reader needs."""

import json
import math

from pam_sim.catalogue import catalogue, find, KINDS
from pam_sim.effects.registry import effects
from pam_sim.errors import InputError
from pam_sim.joint import joint_preset_names
from pam_sim.load import LOADS
from pam_sim.model_file import preset_names
from pam_sim.muscle.muscle import muscle_names
from pam_sim.muscle.registry import laws
import pytest

ENTRIES = catalogue()


def of_kind(kind):
    return {entry['name']: entry for entry in ENTRIES if entry['kind'] == kind}


def test_everything_registered_is_listed_once():
    assert set(of_kind('effect')) == set(effects())
    assert set(of_kind('law')) == set(laws())
    assert set(of_kind('load')) == {*LOADS, 'antagonistic_joint'}
    assert set(of_kind('muscle')) == set(muscle_names())
    assert set(of_kind('rig')) == {*preset_names(), *joint_preset_names()}
    assert set(of_kind('valve')) == {'ppr', 'hsv'}
    places = [(entry['kind'], entry['name']) for entry in ENTRIES]
    assert len(set(places)) == len(places) and {kind for kind, _ in places} == set(KINDS)


@pytest.mark.parametrize('name', sorted(effects()))
def test_every_effect_says_what_it_is(name):
    effect = effects()[name]
    assert effect.sentence.endswith('.') and effect.source
    assert effect.equation and '\n' not in effect.equation
    assert '=' in effect.equation or '->' in effect.equation
    assert effect.parameters
    for parameter in effect.parameters:
        assert parameter.unit and parameter.description.endswith('.'), parameter.name
        assert math.isfinite(parameter.lower) and math.isfinite(parameter.upper)
        assert parameter.lower < parameter.upper
        assert parameter.lower <= parameter.default <= parameter.upper


@pytest.mark.parametrize('entry', ENTRIES, ids=lambda entry: f'{entry["kind"]}-{entry["name"]}')
def test_entries_are_complete_and_plain_data(entry):
    assert entry['sentence'].endswith('.')
    if entry['kind'] != 'rig':
        assert entry['equation'] and entry['source']
    assert json.loads(json.dumps(entry, allow_nan=False)) == entry


def test_find_names_the_nearest():
    assert [entry['kind'] for entry in find(ENTRIES, 'creep')] == ['effect']
    with pytest.raises(InputError, match='did you mean `creep`'):
        find(ENTRIES, 'creeep')

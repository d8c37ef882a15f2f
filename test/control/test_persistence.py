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

"""Rule files: exact round trip; anything damaged or foreign is refused whole."""

import json

import numpy as np
from pam_actuation.control.sofc.persistence import load_rules, save_rules
from pam_sim.errors import InputError
import pytest
from straight_rig import sofc


@pytest.fixture
def learned():
    controller = sofc()
    random = np.random.default_rng(3)
    controller.rules.feedback += random.uniform(-0.2, 0.2, controller.rules.feedback.shape) * (
        np.abs(controller.rules.feedback) < 0.7)
    controller.rules.feedforward += random.uniform(
        -3e4, 3e4, controller.rules.feedforward.shape)
    return controller


def test_round_trip_is_exact(learned, tmp_path):
    path = tmp_path / 'rules.json'
    learned.rules.save(path)
    other = sofc()
    other.replace_rules(load_rules(path, other.rules))
    assert np.array_equal(other.rules.feedback, learned.rules.feedback)
    assert np.array_equal(other.rules.feedforward, learned.rules.feedforward)
    assert other.rules.digest() == learned.rules.digest()
    assert [p.name for p in tmp_path.iterdir()] == ['rules.json']      # nothing left behind


def test_a_changed_number_is_found(learned, tmp_path):
    path = tmp_path / 'rules.json'
    learned.rules.save(path)
    mapping = json.loads(path.read_text())
    mapping['feedforward'][0][3] += 1.0
    path.write_text(json.dumps(mapping))
    with pytest.raises(InputError, match='damaged'):
        load_rules(path, learned.rules)


@pytest.mark.parametrize('content, words', [
    ('', 'no JSON'), ('{"schema": 1', 'no JSON'), ('{"schema": 99}', 'schema'),
    ('[1, 2]', 'schema'), ('{"schema": 2, "feedback": []}', 'lacks')])
def test_truncated_or_foreign_files_are_refused(content, words, tmp_path):
    path = tmp_path / 'rules.json'
    path.write_text(content)
    with pytest.raises(InputError, match=words) as caught:
        load_rules(path)
    assert caught.value.where == str(path)


def test_rules_of_another_scaling_rig_or_shape_are_refused(learned, tmp_path):
    path = tmp_path / 'rules.json'
    learned.rules.save(path)
    with pytest.raises(InputError, match='feedback_gain_pa'):
        load_rules(path, sofc({'feedback_gain_pa': 1e4}).rules)
    with pytest.raises(InputError, match='shape'):
        load_rules(path, sofc({'reference_knots': 13}).rules)
    other = sofc()
    other.rules.scaling['rig'] = 'another/ppr'
    with pytest.raises(InputError, match='another/ppr'):
        load_rules(path, other.rules)


def test_a_missing_folder_is_the_users_mistake(learned, tmp_path):
    with pytest.raises(InputError, match='cannot be written'):
        save_rules(learned.rules, tmp_path / 'no' / 'rules.json')
    with pytest.raises(InputError, match='cannot read'):
        load_rules(tmp_path / 'rules.json')


def test_reset_returns_to_the_initial_rules(learned):
    learned.reset_rules()
    assert np.array_equal(learned.rules.feedback, sofc().rules.feedback_initial)
    assert learned.rules_replaced == 1

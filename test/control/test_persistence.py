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

from collections import Counter
import json
import os

import numpy as np
from pam_actuation.control.sofc import persistence
from pam_actuation.control.sofc.persistence import load_rules
from pam_actuation.control.sofc.rule_table import RuleBase
from pam_actuation.control.sofc.rule_text import rules_to_mapping, save_rules
from pam_sim.errors import InputError
import pytest
from rule_files import signed, spoiled
from straight_rig import sofc

ALL = [(name, suffix) for name in RuleBase.NAMES for suffix in ('', '_initial', '_fired')]


def teach(rules, seed=3):
    """Fill every array of a rule base with numbers within the bounds."""
    random = np.random.default_rng(seed)
    for table in rules.tables():
        bound = min(table.limit, 3e4)
        table.values[...] = random.uniform(-bound, bound, table.values.shape)
        table.fired[...] = random.uniform(0.0, 900.0, table.fired.shape)
    return rules


def numbers(rules):
    """Return all numbers of a rule base as one vector."""
    return np.concatenate([getattr(rules, name + suffix).ravel() for name, suffix in ALL])


@pytest.fixture
def learned():
    controller = sofc()
    teach(controller.rules)
    return controller


def test_round_trip_is_exact(learned, tmp_path):
    path = tmp_path / 'rules.json'
    learned.rules.save(path)
    other = sofc()
    other.replace_rules(load_rules(path, other.rules))
    assert np.array_equal(numbers(other.rules), numbers(learned.rules))
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
    (b'', 'empty'), (b' \n', 'empty'), (b'{"schema": 1', 'cut off'), (b'hello', 'not JSON'),
    (b'{"schema": }', 'not JSON'), (b'\xff\xfe{}', 'not JSON'), (b'[' * 100_000, 'not JSON'),
    (b'{"schema": 99}', 'of schema ., but of 99'), (b'{"schema": true}', 'True'),
    (b'{}', 'names no schema'), (b'[1, 2]', 'names no schema'), (b'null', 'names no schema'),
    (b'{"schema": %d, "feedback": []}' % persistence.SCHEMA, 'lacks shape, scaling'),
    (b'[' + b'1,' * 2**23 + b'1]', 'larger than')])
def test_truncated_or_foreign_files_are_refused(content, words, tmp_path):
    path = tmp_path / 'rules.json'
    path.write_bytes(content)
    with pytest.raises(InputError, match=words) as caught:
        load_rules(path)
    assert caught.value.where == str(path)


def changed(mapping, path, value):
    """Return a signed copy of a mapping with one entry exchanged."""
    mapping = json.loads(json.dumps(mapping))
    parent = mapping
    for key in path[:-1]:
        parent = parent[key]
    if value is None:
        del parent[path[-1]]
    else:
        parent[path[-1]] = value
    return signed(mapping)


# Each with a checksum that fits: what a program that writes such files could get wrong.
WRONG = {
    'rig': (('scaling', 'rig'), 'other/ppr', r'learned with rig other \(here straight\)$'),
    'valve': (('scaling', 'rig'), 'straight/hsv', r'learned with valve hsv \(here ppr\)$'),
    'no rig': (('scaling', 'rig'), '', r'rig unknown \(here straight\), valve unknown'),
    'mode': (('scaling', 'rig'), 'straight/ppr/force at 1800 N/m',
             r'learned with mode force at 1800 N/m \(here contraction\)$'),
    'odd rig': (('scaling', 'rig'), 'straight', r'with valve unknown \(here ppr\), mode unknown'),
    'rate': (('scaling', 'rate_hz'), 100.0, r'with rate_hz 100 \(here 200\)$'),
    'universe': (('scaling', 'error_universe_m'), 0.003,
                 r'error_universe_m 0.003 \(here 0.002\)$'),
    'gain': (('scaling', 'feedback_gain_pa'), 1e4, r'feedback_gain_pa 10000 \(here 6000\)$'),
    'knots': (('scaling', 'reference_knots'), 13.0, 'its scaling says .2, 13.0'),
    'range of knots': (('scaling', 'reference_upper_m'), 0.02,
                       r'reference_upper_m 0.02 \(here 0.03\)$'),
    'empty range': (('scaling', 'reference_upper_m'), 0.001, 'reference_upper_m 0.001 '),
    'upside down': (('scaling', 'reference_lower_m'), 0.1, 'not larger than reference_lower_m'),
    'scaling missing': (('scaling', 'rate_hz'), None, 'scaling lacks rate_hz'),
    'scaling unknown': (('scaling', 'colour'), 1.0, "unknown entries 'colour'"),
    'scaling too large': (('scaling', 'rate_hz'), 1e9, '`rate_hz` is .*; allowed 20 to 1000 Hz'),
    'scaling beyond floats': (('scaling', 'rate_hz'), 10**400, '`rate_hz` is inf; allowed 20 to'),
    'scaling no number': (('scaling', 'rate_hz'), '200', '`rate_hz` must be a number'),
    'scaling no mapping': (('scaling',), [1], 'scaling is not a mapping'),
    'shape': (('shape', 'feedback'), [2, 7, 8], r'feedback has shape \[2, 7, 7\], the file says'),
    'shape no mapping': (('shape',), 3, 'shape .* the file says None'),
    'row missing': (('feedback', 1, 6), None, 'feedback is not a table of numbers'),
    'one branch': (('feedback', 1), None, r'feedback has shape \[1, 7, 7\]'),
    'not finite': (('feedback', 0, 1, 2), float('nan'), 'feedback holds values .* not finite'),
    'infinite': (('feedforward', 1, 2), float('inf'), 'feedforward holds values .* not finite'),
    'text': (('feedback', 0, 1, 2), '0.5', 'feedback is not a table of numbers'),
    'beyond floats': (('feedforward', 0, 0), 10**400, 'feedforward is not a table of numbers'),
    'out of bounds': (('feedback', 0, 1, 2), -1.25, r'holds 1.25, allowed is \+-1$'),
    'first out of bounds': (('feedforward_initial', 0, 0), 2e5, r'allowed is \+-120000$'),
    'fired': (('feedback_fired', 0, 0, 0), -1.0, 'fired less than never'),
    'entry missing': (('feedback_initial',), None, 'lacks feedback_initial'),
    'entry unknown': (('remark',), 'mine', "unknown entries 'remark'"),
    'schema': (('schema',), persistence.SCHEMA + 1, 'schema'),
}


@pytest.mark.parametrize('case', WRONG)
def test_what_differs_is_named_and_the_old_rules_stay(case, learned, tmp_path):
    path, value, words = WRONG[case]
    file = tmp_path / 'rules.json'
    file.write_text(json.dumps(changed(rules_to_mapping(learned.rules), path, value)))
    before = numbers(learned.rules)
    with pytest.raises(InputError, match=words) as caught:
        learned.replace_rules(load_rules(file, learned.rules), str(file))
    assert '\n' not in str(caught.value) and len(caught.value.problem) < 300
    assert np.array_equal(numbers(learned.rules), before) and learned.rules_replaced == 0


def test_every_difference_is_named_at_once(learned, tmp_path):
    learned.rules.save(tmp_path / 'rules.json')
    other = sofc({'rate_hz': 100.0, 'feedback_gain_pa': 1e4, 'reference_knots': 13})
    other.rules.scaling['rig'] = 'straight/hsv'
    with pytest.raises(InputError) as caught:
        load_rules(tmp_path / 'rules.json', other.rules)
    assert all(word in caught.value.problem for word in (
        'valve ppr (here hsv)', 'rate_hz', 'feedback_gain_pa', 'reference_knots 25 (here 13)'))
    other = learned.rules.copy()
    other.feedback = np.zeros((2, 5, 5))
    with pytest.raises(InputError, match=r'feedback rules of shape \[2, 7, 7\] do not fit'):
        load_rules(tmp_path / 'rules.json', other)


def test_spoiled_files_are_refused_whole_or_are_whole(learned, tmp_path):
    mapping, path = rules_to_mapping(learned.rules), tmp_path / 'rules.json'
    learned.rules.save(path)
    whole, outcomes = numbers(load_rules(path, learned.rules)), Counter()
    for number in range(400):
        path.write_bytes(spoiled(mapping, number))
        controller = sofc()
        before = numbers(controller.rules)
        try:
            controller.replace_rules(load_rules(path, controller.rules), str(path))
            outcomes['taken'] += 1
            # Bytes that say the same, or a file whose every number is one that can be learned.
            found = numbers(controller.rules)
            assert np.array_equal(found, whole) or number % 3, number
            assert np.all(np.isfinite(found)), number
            assert all(np.max(np.abs(values)) <= table.limit
                       for table in controller.rules.tables()
                       for values in (table.values, table.initial)), number
        except InputError as error:
            outcomes['refused'] += 1
            assert error.where == str(path) and '\n' not in str(error), number
            assert len(str(error)) < len(str(path)) + 400, number
            assert np.array_equal(numbers(controller.rules), before), number
    assert outcomes['refused'] > 300


def test_a_mistake_in_writing_is_the_users_and_leaves_nothing(learned, tmp_path):
    with pytest.raises(InputError, match='cannot be written'):
        save_rules(learned.rules, tmp_path / 'no' / 'rules.json')
    with pytest.raises(InputError, match='cannot read'):
        load_rules(tmp_path / 'rules.json')
    (tmp_path / 'folder').mkdir()
    with pytest.raises(InputError, match='cannot be written'):
        save_rules(learned.rules, tmp_path / 'folder')
    with pytest.raises(InputError, match='cannot read'):
        load_rules(tmp_path / 'folder')
    assert [p.name for p in tmp_path.iterdir()] == ['folder']


def test_a_failed_save_keeps_the_old_file(learned, tmp_path, monkeypatch):
    path = tmp_path / 'rules.json'
    learned.rules.save(path)
    old = path.read_bytes()
    learned.rules.feedforward[0, 0] = np.nan
    with pytest.raises(InputError, match='not saved: feedforward .* not finite'):
        learned.rules.save(path)
    learned.rules.feedforward[0, 0] = 1.0
    for failure, raised in ((OSError(28, 'No space left on device'), InputError),
                            (KeyboardInterrupt(), KeyboardInterrupt)):
        with monkeypatch.context() as patch:
            patch.setattr(os, 'fsync', _raising(failure))
            with pytest.raises(raised):
                learned.rules.save(path)
        assert path.read_bytes() == old
        assert [p.name for p in tmp_path.iterdir()] == ['rules.json']
    learned.rules.save(path)
    assert path.read_bytes() != old


def _raising(failure):
    def fails(handle):
        raise failure
    return fails


def test_reset_returns_to_the_initial_rules(learned):
    learned.reset_rules()
    assert np.array_equal(learned.rules.feedback, sofc().rules.feedback_initial)
    assert learned.rules_replaced == 1

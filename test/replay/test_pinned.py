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

"""Process replay of pinned bags: every output field as in the reference, to a tolerance."""

import numpy as np
from process_replay import bag_of, CASES, compare, load_reference, outputs, PINNED
import pytest


@pytest.mark.parametrize('case', CASES)
def test_outputs_are_those_of_the_reference(case):
    assert compare(load_reference(case), outputs(case)) == [], (
        'if this change is wanted: python test/replay/refresh.py')


def test_pinned_files_are_small():
    assert sum(path.stat().st_size for path in PINNED.iterdir()) < 1_000_000
    assert {path.stem for path in PINNED.glob('*.mcap')} == set(CASES)
    assert all(bag_of(case).stat().st_size < 225_000 for case in CASES)


def reference():
    return {'driver/valve_signal.stamp_ns': np.arange(5), 'chain/force.force_n': np.arange(5.0),
            'driver/valve_signal.ppr_voltage': np.array([0.0, 1.0, 2.0, np.nan, 4.0])}


def test_equal_outputs_and_rounding_pass():
    assert compare(reference(), reference()) == []
    now = reference()
    now['driver/valve_signal.ppr_voltage'][2] += 1e-10
    assert compare(reference(), now) == []


def test_a_changed_value_is_named_with_its_message():
    now = reference()
    now['driver/valve_signal.ppr_voltage'][2] += 1e-6
    (sentence,) = compare(reference(), now)
    assert sentence.startswith('driver/valve_signal.ppr_voltage: largest difference 1e-06')
    assert 'message 2' in sentence
    now = reference()
    now['driver/valve_signal.ppr_voltage'][3] = 3.0
    assert 'message 3' in compare(reference(), now)[0]
    now = reference()
    now['driver/valve_signal.stamp_ns'][1] = 7
    assert compare(reference(), now) == ['driver/valve_signal.stamp_ns: 1 stamps differ']


def test_counts_and_fields_are_told_before_any_value():
    now = reference()
    now['chain/force.force_n'] = np.arange(4.0)
    now['driver/valve_signal.ppr_voltage'] += 1.0
    assert compare(reference(), now) == [
        'chain/force: 4 messages, 5 in the reference']
    now['chain/new.force_n'] = now.pop('chain/force.force_n')
    assert compare(reference(), now) == [
        'chain/force.force_n: is no longer there', 'chain/new.force_n: is new']

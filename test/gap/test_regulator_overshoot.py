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

"""A regulator whose own loop overshoots: named with its size, and nothing else is named so."""

from gap_runs import assert_form, nominal, recorded, voltages
from pam_sim.gap import find_gap
import pytest


def answer_to(**effects):
    """Return what `pam gap` answers on the nominal rig with effects, each name=parameters."""
    rig = nominal().with_(effects=[
        {'name': name, 'parameters': values} for name, values in effects.items()])
    result = find_gap(recorded(rig, voltages(10.0, seed=5), seed=5), nominal())
    assert_form(result)
    return result


# Damping ratios of 0.87, a real double pole being 1, and 0.39.
@pytest.mark.parametrize('lag_s', [0.02, 0.1])
def test_it_is_named_with_its_size(lag_s):
    result = answer_to(regulator_overshoot={'inner_lag_s': lag_s})
    assert result.verdict == 'effects'
    assert [e['name'] for e in result.effects] == ['regulator_overshoot']
    low, high = result.effects[0]['equivalent']['inner_lag_s']['ci95']
    assert low <= lag_s <= high
    assert high - low < 0.2 * lag_s


def test_it_is_told_from_a_dead_time_beside_it():
    result = answer_to(
        regulator_overshoot={'inner_lag_s': 0.04}, valve_dead_time={'delay_s': 0.02})
    assert {e['name'] for e in result.effects} == {'regulator_overshoot', 'valve_dead_time'}


def test_a_lag_of_the_line_keeps_its_name():
    """Two real poles are a lag behind the regulator, although a second order holds them too."""
    result = answer_to(tube_lag={'time_constant_s': 0.02})
    assert [e['name'] for e in result.effects] == ['tube_lag']
    assert 'regulator_overshoot' not in result.ambiguity_set

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

"""Effects that come together: found at once where single ones lead astray."""

from gap_runs import assert_form, nominal, recorded, voltages
import numpy as np
from pam_sim.gap import find_gap
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select.candidates import candidates
from pam_sim.gap.select.groups import groups_in, last_of
import pytest

SIGNALS = ('pressure', 'contraction', 'force')
VALVE_NAMES = ('valve_dead_time', 'tube_lag', 'flow_limit', 'vent_asymmetry', 'valve_dead_zone',
               'valve_hysteresis', 'leakage', 'pressure_lag', 'vent_bleed')


def recorded_with(seed, **effects):
    """Return a record of the nominal rig with effects, each name=parameters."""
    rig = nominal().with_(effects=[
        {'name': name, 'parameters': values} for name, values in effects.items()])
    return recorded(rig, voltages(16.0, seed=seed), seed=seed)


def test_three_habits_of_a_regulator_are_named_with_their_sizes():
    truth = {'closing_pressure_pa': 25e3, 'bleed_rate_pa_per_s': 8e3,
             'fill_delay_s': 0.045, 'vent_delay_s': 0.075,
             'fill_rate_at_400kpa_pa_per_s': 9e5, 'vent_rate_at_400kpa_pa_per_s': 6e5}
    run = recorded_with(
        41, vent_bleed={'closing_pressure_pa': 25e3, 'bleed_rate_pa_per_s': 8e3},
        valve_dead_time_by_direction={'delay_s': 0.06, 'vent_later_s': 0.03},
        flow_limit={'fill_rate_at_400kpa_pa_per_s': 9e5, 'vent_rate_at_400kpa_pa_per_s': 6e5})
    result = find_gap(run, nominal(), None, VALVE_NAMES, 600.0)
    assert result.verdict == 'effects'
    assert_form(result)
    assert {e['name'] for e in result.effects} == {'vent_bleed', 'valve_dead_time', 'flow_limit'}
    said = {name: q for e in result.effects for name, q in e['equivalent'].items()}
    for name, value in truth.items():
        assert said[name]['ci95'][0] <= value <= said[name]['ci95'][1], name
        assert said[name]['value'] == pytest.approx(value, rel=0.1), name
    assert result.signals['pressure'].rmse_refit > 20.0 * result.signals['pressure'].rmse_after


@pytest.mark.parametrize('formulation, values, name, truth', [
    ('vent_bleed', {'closing_pressure_pa': 12e3, 'bleed_rate_pa_per_s': 15e3}, 'vent_bleed',
     {'closing_pressure_pa': 12e3, 'bleed_rate_pa_per_s': 15e3}),
    ('valve_dead_time_by_direction', {'delay_s': 0.045, 'vent_later_s': -0.03},
     'valve_dead_time', {'fill_delay_s': 0.060, 'vent_delay_s': 0.030})])
def test_one_habit_of_a_regulator_is_named_alone(formulation, values, name, truth):
    result = find_gap(recorded_with(43, **{formulation: values}), nominal(), None, VALVE_NAMES,
                      600.0)
    assert result.verdict == 'effects' and [e['name'] for e in result.effects] == [name]
    assert result.effects[0]['formulation'] == formulation
    for quantity, value in truth.items():
        said = result.effects[0]['equivalent'][quantity]
        assert said['ci95'][0] <= value <= said['ci95'][1], quantity


def test_a_group_is_tried_only_where_all_its_members_may_be():
    pool = candidates(nominal(), SIGNALS)
    assert groups_in(pool, 'muscle') == []
    found = groups_in(pool, 'valve')
    assert ('vent_bleed', 'valve_dead_time_by_direction', 'flow_limit') in [
        tuple(c.effect for c in group) for group in found]
    assert groups_in([c for c in pool if c.effect != 'flow_limit'], 'valve') == []
    assert groups_in(candidates(nominal().with_(valve='hsv'), SIGNALS), 'valve') == []


def test_the_member_of_a_fit_that_is_judged_stands_last():
    by_effect = {c.effect: c for c in candidates(nominal(), SIGNALS)}
    order = ('valve_dead_time', 'flow_limit', 'vent_asymmetry')
    found = Fit(Hypothesis(tuple(by_effect[name] for name in order)),
                np.array([1.0, 2.0, 3.0, 4.0]), {}, {}, {})
    moved = last_of(found, 1)
    assert [c.effect for c in moved.hypothesis.effects] == [
        'valve_dead_time', 'vent_asymmetry', 'flow_limit']
    assert moved.theta.tolist() == [1.0, 4.0, 2.0, 3.0]

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

"""Random rigs: within their ranges, reproducible, the first ones whatever the count."""

import numpy as np
from pam_actuation.tuning.random_rigs import (
    DEAD_TIME_S, FORCE_MAP_FACTOR, FRICTION_FACTOR, MASS_KG, random_rigs, SUPPLY_FACTOR,
    VALVE_FACTOR)
from pam_sim import load_rig
from pam_sim.effects.setting import forms_of
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
from pam_sim.units import P_ATM_PA
import pytest


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_every_number_stays_in_its_range_and_fills_it(valve):
    nominal = load_rig('dmsp_5_300_realistic', valve=valve)
    rigs = random_rigs(nominal, 200, seed=1)
    speed = 'T_m' if valve == 'ppr' else 'C'
    drawn = {
        MASS_KG: [rig.parameters['mass_kg'] for rig in rigs],
        VALVE_FACTOR: [rig.parameters[speed] / nominal.parameters[speed] for rig in rigs],
        FORCE_MAP_FACTOR: [rig.parameters['force_map_gain'] for rig in rigs],
        DEAD_TIME_S: [rig.effect('valve_dead_time').parameters['delay_s'] for rig in rigs],
        FRICTION_FACTOR: [rig.effect('hysteresis').parameters['force_n'] / 0.5 for rig in rigs]}
    if valve == 'hsv':
        nominal_gauge = nominal.parameters['supply_pa'] - P_ATM_PA
        drawn[SUPPLY_FACTOR] = [
            (rig.parameters['supply_pa'] - P_ATM_PA) / nominal_gauge for rig in rigs]
    for (lower, upper), values in drawn.items():
        assert min(values) >= lower and max(values) <= upper
        assert np.ptp(values) > 0.9 * (upper - lower)
    assert np.median(drawn[FRICTION_FACTOR]) == pytest.approx(1.0, abs=0.15)
    assert all(rig.name == nominal.name and rig.valve == valve for rig in rigs)
    assert all(rig.effect('hysteresis').parameters['width_scale'] == 1.0 for rig in rigs)
    assert rigs[0].effect('creep') == nominal.effect('creep')
    assert rigs[0].sensors == nominal.sensors


def test_same_seed_same_rigs_and_the_first_ones_do_not_depend_on_the_count():
    nominal = load_rig('dmsp_5_300_realistic')
    few, many = random_rigs(nominal, 3, seed=5), random_rigs(nominal, 9, seed=5)
    assert [rig.to_yaml() for rig in few] == [rig.to_yaml() for rig in many[:3]]
    assert few[0].to_yaml() != random_rigs(nominal, 1, seed=6)[0].to_yaml()
    assert nominal.to_yaml() == load_rig('dmsp_5_300_realistic').to_yaml()


@pytest.mark.parametrize('wrong, says', [
    (('mine', 2), "rig: is 'mine'; give what"), ((None, -1), 'count: is -1; a whole number'),
    ((None, 2.5), 'count: is 2.5'), ((None, 2, -1), 'seed: is -1; a whole number')])
def test_what_cannot_be_drawn_is_refused(wrong, says):
    rig, *numbers = wrong
    with pytest.raises(InputError, match=says):
        random_rigs(rig or load_rig('dmsp_5_300_realistic'), *numbers)


def test_a_rig_without_dead_time_or_friction_gets_the_first_and_no_friction():
    rig = random_rigs(load_rig('dmsp_5_300_hanging_mass'), 1)[0]
    assert [setting.name for setting in rig.effects] == ['valve_dead_time']


def test_load_and_dead_time_are_drawn_about_those_of_the_rig():
    rig = load_rig('dmsp_20_300_hanging_mass', valve='hsv').with_(
        parameters={'mass_kg': 24.0},
        effects=[{'name': 'valve_dead_time', 'parameters': {'delay_s': 0.012}}])
    rigs = random_rigs(rig, 200, seed=1)
    kg = [one.parameters['mass_kg'] for one in rigs]
    delays_s = [one.effect('valve_dead_time').parameters['delay_s'] for one in rigs]
    assert min(kg) >= 0.8 * 24.0 and max(kg) <= 1.1 * 24.0
    assert min(delays_s) >= 0.008 and max(delays_s) <= 0.018
    assert np.ptp(kg) > 0.9 * 0.3 * 24.0 and np.ptp(delays_s) > 0.9 * 0.010


def test_a_dead_time_in_another_formulation_is_drawn_in_this_one():
    nominal = load_rig('dmsp_5_300_hanging_mass').with_(effects=['valve_dead_time_by_direction'])
    drawn = random_rigs(nominal, 1)[0]
    delay, = forms_of(drawn.effects, 'valve_dead_time')
    assert delay.name == 'valve_dead_time_by_direction'
    nominal_s, drawn_s = nominal.effects[0].parameters, delay.parameters
    assert drawn_s['vent_later_s'] / nominal_s['vent_later_s'] == pytest.approx(
        drawn_s['delay_s'] / nominal_s['delay_s']) != 1.0


@pytest.mark.parametrize('valve, at_end', [
    ('ppr', {'mass_kg': 500.0}), ('ppr', {'T_m': 2.0}), ('ppr', {'T_m': 0.001}),
    ('hsv', {'C': 1e-8}), ('hsv', {'C': 1e-12}), ('hsv', {'supply_pa': 1.5e5}),
    ('ppr', {'force_map_gain': 5.0}), ('ppr', {'force_map_gain': 0.2})])
def test_a_number_at_the_end_of_its_range_stays_in_it(valve, at_end):
    rig = load_rig('dmsp_40_300_hanging_mass', valve=valve).with_(
        parameters=at_end,
        effects=[{'name': 'valve_dead_time', 'parameters': {'delay_s': 0.5}}])
    (name, value), = at_end.items()
    drawn = random_rigs(rig, 20, seed=1)
    assert value in [one.parameters[name] for one in drawn]
    assert all(one.effect('valve_dead_time').parameters['delay_s'] <= 0.5 for one in drawn)


def test_a_limb_at_the_end_of_its_range_stays_in_it():
    joint = load_joint('joint_dmsp_5_300_realistic').with_(
        parameters={'limb_mass_kg': 100.0, 'inertia_kg_m2': 100.0})
    for one in random_rigs(joint, 20, seed=1):
        assert one.parameters['limb_mass_kg'] <= 100.0 and one.parameters['inertia_kg_m2'] <= 100.0

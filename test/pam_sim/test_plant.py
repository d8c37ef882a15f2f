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

"""The live plant equals the rollout; sensors add what they should."""

import numpy as np
from pam_sim import load_joint, load_rig
from pam_sim.errors import InputError
from pam_sim.sensors import SensorChain
import pytest


@pytest.mark.parametrize('name', ['dmsp_5_300_hanging_mass', 'dmsp_5_300_realistic'])
@pytest.mark.parametrize('valve, fidelity', [
    ('ppr', 'averaged'), ('hsv', 'averaged'), ('hsv', 'switching')])
def test_plant_steps_are_those_of_simulate_to_the_bit(name, valve, fidelity):
    rig = load_rig(name, valve=valve, fidelity=fidelity)
    random = np.random.default_rng(3)
    signal = random.uniform(0.0, 6.0, 700) if valve == 'ppr' else random.uniform(0, 1, (700, 2))
    pull = random.uniform(0.0, 5.0, 700)
    response = rig.simulate(signal, external_force_n=pull)
    plant = rig.plant()
    for i in range(700):
        for ours, theirs in ((plant.time_s, response.time_s), (plant.force_n, response.force_n),
                             (plant.pressure_pa, response.pressure_pa),
                             (plant.contraction_m, response.contraction_m),
                             (plant.velocity_m_per_s, response.velocity_m_per_s),
                             (plant.air_mass_kg, response.air_mass_kg),
                             (plant.supply_pa, response.supply_pa)):
            assert ours == theirs[i] or i == 0
        plant.step(np.atleast_1d(signal[i]), external_force_n=pull[i])
    assert np.array_equal(plant.outputs, response.outputs[-1])
    several = rig.plant()
    plant.reset()
    assert plant.time_s == 0.0
    for i in range(0, 40, 8):
        several.step(np.atleast_1d(signal[i]), external_force_n=pull[i], steps=8)
        for _ in range(8):
            plant.step(np.atleast_1d(signal[i]), external_force_n=pull[i])
        assert np.array_equal(several.outputs, plant.outputs)


def test_plant_refuses_what_does_not_fit():
    plant = load_rig('dmsp_5_300_hanging_mass', valve='hsv').plant()
    with pytest.raises(InputError, match='takes 2 numbers'):
        plant.step(3.0)
    with pytest.raises(InputError, match='not finite'):
        plant.step((np.nan, 0.0))
    plant.step((0.1, 0.0))
    assert np.all(np.isfinite(plant.outputs))
    for steps in (0, -2, 2.5):
        for advance in (plant.step, plant.roll):
            with pytest.raises(InputError, match=f'steps: is {steps}; a whole number, 1 or more'):
                advance((0.1, 0.0), steps=steps)
    with pytest.raises(InputError, match='contraction_m: load `hanging_mass` moves freely'):
        plant.step((0.1, 0.0), contraction_m=0.01)


@pytest.mark.parametrize('given_inputs, words', [
    (('x',), "valve signal and force: has 'x' and 0.0; numbers are needed"),
    (([[1.0]],), 'valve signal and force: has'),
    ((3.0, 'x'), "valve signal and force: has 3.0 and 'x'"),
])
def test_a_plant_refuses_what_is_no_number_in_one_sentence(given_inputs, words):
    plant = load_rig('dmsp_5_300_hanging_mass').plant()
    with pytest.raises(InputError) as caught:
        plant.step(*given_inputs)
    assert str(caught.value).startswith(words)
    plant.step(np.array(3.0))               # an array without dimensions is a number
    assert np.isfinite(plant.outputs).all()
    for wrong, told in (({'seed': 'x'}, "seed: is 'x'"), ({'dt_s': 'x'}, "`dt_s` is 'x'")):
        for of in (load_rig('dmsp_5_300_driven'), load_joint('joint_dmsp_5_300')):
            with pytest.raises(InputError, match=told):
                of.plant(**wrong)
    with pytest.raises(InputError, match='contraction_m` is .x.; a number is needed'):
        load_rig('dmsp_5_300_driven').plant().step(3.0, contraction_m='x')
    with pytest.raises(InputError, match='numbers are needed'):
        load_joint('joint_dmsp_5_300').plant().step(3.0, 'x')


@pytest.mark.parametrize('wrong', [np.nan, -1.0, 8.0, 801.0, 1e9])
def test_a_supply_pressure_is_absolute_and_in_pascals(wrong):
    plant = load_rig('dmsp_5_300_hanging_mass', valve='hsv').plant()
    with pytest.raises(InputError, match=r'supply_pa: is .*; allowed 50662.5 to 2e\+06 Pa absol'):
        plant.supply_pa = wrong
    with pytest.raises(InputError, match="`supply_pa` is 'x'; a number is needed"):
        plant.supply_pa = 'x'
    plant.supply_pa = 3e5
    plant.step((1.0, 0.0), steps=500)
    assert plant.supply_pa == 3e5 and 2.9e5 < plant.pressure_pa <= 3e5


def test_a_held_muscle_is_moved_within_what_it_can_contract():
    plant = load_rig('dmsp_5_300_driven').plant()
    for wrong in (0.2, -0.1, np.nan):
        with pytest.raises(InputError, match=f'contraction_m: is {wrong}; allowed -0.015 to 0.15'):
            plant.step(3.0, contraction_m=wrong)
    plant.step(3.0, contraction_m=0.01)         # none of what was refused is left
    assert plant.contraction_m == 0.01


def test_a_signal_beyond_the_range_of_the_valve_acts_as_the_end_of_it():
    for valve, beyond, end in (('ppr', 100.0, 6.0), ('hsv', (80.0, -1.0), (1.0, 0.0))):
        rig = load_rig('dmsp_5_300_realistic', valve=valve)
        plants = rig.plant(), rig.plant()
        for plant, signal in zip(plants, (beyond, end)):
            plant.step(signal, steps=200)
        assert plants[0].pressure_pa == plants[1].pressure_pa


def test_nominal_sensors_add_nothing():
    chain = SensorChain(load_rig('dmsp_5_300_hanging_mass'), seed=5)
    assert chain.read(0.1, 3e5, 0.01, 40.0) == (3e5, 0.01, 40.0, 0)


def test_realistic_sensors_have_the_stated_noise_and_repeat_with_the_seed():
    rig = load_rig('dmsp_5_300_realistic')
    count = 4000
    chain = SensorChain(rig, seed=5)
    p, x, f, jitter_ns = np.transpose([chain.read(0.0, 4e5, 0.0, 0.0) for _ in range(count)])
    for samples, sigma in ((p, 300.0), (x, 1e-5), (f, 0.1), (jitter_ns, 5e4)):
        assert np.std(samples) == pytest.approx(sigma, rel=0.06)
    again = SensorChain(rig.sensors, seed=5)
    assert again.read(0.0, 4e5, 0.0, 0.0) == (p[0], x[0], f[0], jitter_ns[0])
    assert SensorChain(rig, seed=6).read(0.0, 4e5, 0.0, 0.0)[0] != p[0]


def test_quantisation():
    chain = SensorChain({'contraction_step_m': 1e-4, 'pressure_step_pa': 100.0})
    p, x, f, _ = chain.read(0.0, 400_049.0, 0.01234, 1.23456)
    assert p == pytest.approx(400_000.0) and x == pytest.approx(0.0123) and f == 1.23456
    with pytest.raises(InputError, match='allowed'):
        SensorChain({'pressure_noise_pa': -1.0})
    for seed in (-1, 1.5, 'x'):
        with pytest.raises(InputError, match=f'seed: is {seed!r}; a whole number, 0 or more'):
            SensorChain(seed=seed)

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

"""What any joint with two muscles does: pull, stiffen, stop, stick."""

import numpy as np
from pam_sim.joint import load_joint
from pam_sim.joint.layout import PARAMETERS
from pam_sim.muscle.laws.inoue_pair import InouePair
from pam_sim.records import fields
from pam_sim.units import P_ATM_PA
import pytest

START = P_ATM_PA + 300e3
EVEN = {'flexor_pressure_pa': START, 'extensor_pressure_pa': START}


@pytest.fixture(scope='module')
def joint():
    return load_joint('joint_dmsp_5_300')


@pytest.fixture(scope='module')
def level(joint):
    """Return the joint of a limb that moves level."""
    return joint.with_({'gravity_m_per_s2': 0.0})


def with_effects(joint, effects):
    """Return a joint with the same effects in both muscles."""
    return joint.with_(flexor=joint.flexor.with_(effects=effects),
                       extensor=joint.extensor.with_(effects=effects))


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_equal_muscles_with_equal_signals_do_not_turn_the_limb(level, valve):
    signal = np.random.default_rng(1).uniform(0.0, 1.0, (1500, 2))
    signal = 6.0 * signal[:, 0] if valve == 'ppr' else signal
    response = level.with_(valve=valve).simulate(signal, signal, **EVEN)
    assert np.ptp(response.flexor.pressure_pa) > 5e4
    assert np.all(response.angle_rad == 0.0) and np.all(response.torque_n_m == 0.0)


def test_the_muscles_mirror_each_other(level):
    signal = np.random.default_rng(2).uniform(1.0, 5.0, (2, 500))
    one = level.simulate(signal[0], signal[1], **EVEN)
    other = level.simulate(signal[1], signal[0], **EVEN)
    assert np.ptp(one.angle_rad) > 0.05
    assert np.allclose(one.angle_rad, -other.angle_rad, atol=1e-12)
    assert np.allclose(one.flexor.force_n, other.extensor.force_n, atol=1e-9)


def test_more_flexor_pressure_flexes(joint):
    angles = [joint.static_angle_rad(P_ATM_PA + kpa * 1e3, START)
              for kpa in (0, 100, 200, 300, 400)]
    assert np.all(np.diff(angles) >= 0.0) and angles[-1] > 0.3 > 0.0 > angles[1]
    response = joint.simulate(np.full(8000, 4.0), np.full(8000, 3.0), **EVEN)
    assert response.angle_rad[-1] == pytest.approx(angles[-1], abs=1e-4)
    assert response.torque_n_m[-1] == pytest.approx(
        0.3 * 9.80665 * 0.1 * np.sin(angles[-1]), abs=1e-4)


def test_co_contraction_stiffens_without_turning(level):
    pressures = [P_ATM_PA + kpa * 1e3 for kpa in (250, 350, 450, 550)]
    stiffness = [level.stiffness_n_m_per_rad(0.0, p, p) for p in pressures]
    assert np.all(np.diff(stiffness) > 0.01)
    # The softer joint gives way further under the same torque, and swings more slowly.
    yields = [level.static_angle_rad(p, p, 0.02, near_rad=0.0) for p in pressures]
    assert np.all(np.diff(yields) < 0.0)
    assert np.allclose(yields, 0.02 / np.array(stiffness), rtol=0.01)


def test_linear_pair_of_inoue_near_a_working_point(level):
    # The linear model with the slopes that the force map has at 300 kPa and 5 %: static gain
    # within 0.5 %, natural frequency of a free swing within 0.5 %, damping ratio within 2 %.
    gauge, strain, small = 300e3, 0.05, 1e-4
    muscle = level.flexor.muscle
    force = muscle.law.law.force_n
    slope = (force(gauge, strain + small) - force(gauge, strain - small)) / (2.0 * small)
    per_pa = (force(gauge + 10.0, strain) - force(gauge - 10.0, strain)) / 20.0
    diameter = 0.0072
    a = -slope / (2.0 * gauge * (1.0 - strain) * diameter ** 2)
    pair = InouePair({
        'length_m': muscle.length_m, 'diameter_m': diameter, 'a': a,
        'b': a * (1.0 - strain) ** 2 - per_pa / diameter ** 2, 'pulley_radius_m': 0.012,
        'inertia_kg_m2': 0.004, 'damping_n_m_s': 0.005 + 2.0 * 0.012 ** 2 * 25.0,
        'middle_pressure_pa': gauge, 'middle_strain': strain})
    gain, frequency, ratio = pair.second_order()
    # A difference dp is p0 + dp / 2 against p0 - dp / 2.
    half = 500.0
    angle = level.static_angle_rad(START + half, START - half)
    assert angle / (2.0 * half) == pytest.approx(gain, rel=0.005)
    response = level.simulate(np.full(2000, 3.0), np.full(2000, 3.0), initial_angle_rad=0.01,
                              **EVEN)
    swing, time_s = response.angle_rad, response.time_s
    before = np.flatnonzero((swing[:-1] > 0.0) & (swing[1:] <= 0.0))
    crossings = time_s[before] + 1e-3 * swing[before] / (swing[before] - swing[before + 1])
    assert len(crossings) >= 3
    damped = 2.0 * np.pi / np.mean(np.diff(crossings))
    assert damped / np.sqrt(1.0 - ratio ** 2) == pytest.approx(frequency, rel=0.005)
    depths = [swing[i:j].min() for i, j in zip(before, before[1:])]
    decay = np.log(depths[0] / depths[1]) / (2.0 * np.pi)
    assert decay / np.sqrt(1.0 + decay ** 2) == pytest.approx(ratio, rel=0.02)


def test_stops_hold(joint):
    response = joint.simulate(np.full(1500, 6.0), np.zeros(1500))
    assert response.angle_rad.max() == 1.0 == response.angle_rad[-1]
    assert response.velocity_rad_per_s[-1] == 0.0 == response.acceleration_rad_per_s2[-1]
    assert response.torque_n_m[-1] > 0.3
    back = joint.simulate(np.zeros(1500), np.full(1500, 6.0), 0.0,
                          flexor_pressure_pa=P_ATM_PA + 6e5, initial_angle_rad=1.0)
    assert back.angle_rad[-1] == -1.0 and back.angle_rad.min() == -1.0


def test_a_stretched_muscle_stops_the_joint(joint):
    wide = joint.with_({'lower_stop_rad': -2.0, 'upper_stop_rad': 2.0})
    assert wide.range_rad == pytest.approx((-1.25, 1.25))
    response = wide.simulate(np.full(1500, 6.0), np.zeros(1500))
    assert response.angle_rad[-1] == pytest.approx(1.25)
    assert response.extensor.contraction_m.min() == pytest.approx(0.0, abs=1e-12)
    assert response.extensor.contraction_m.min() >= 0.0


def test_a_muscle_never_pushes_and_a_slack_one_does_not_pull(joint):
    far = joint.with_({'flexor_contraction_at_zero_m': 0.070, 'upper_stop_rad': 1.2})
    response = far.simulate(np.full(800, 6.0), np.zeros(800), 0.5, initial_angle_rad=0.0)
    slack = far.contractions_m(response.angle_rad)[0] > 0.075
    assert slack[-1] and np.all(response.flexor.force_n[slack] == 0.0)
    assert response.flexor.contraction_m.max() <= 0.075
    fast = joint.simulate(np.full(600, 1.0), np.full(600, 1.0), 1.0)
    assert min(fast.flexor.force_n.min(), fast.extensor.force_n.min()) >= 0.0


@pytest.mark.parametrize('effects', [
    [], [{'name': 'coulomb_friction', 'parameters': {'force_n': 2.0}}], ['hysteresis', 'creep']])
def test_a_joint_at_rest_under_friction_stays_at_rest(joint, effects):
    rough = with_effects(joint, effects).with_({'friction_n_m': 0.03})
    start = rough.static_angle_rad(START + 6e4, START)
    signal = np.full(3000, 3.6), np.full(3000, 3.0)
    response = rough.simulate(*signal, 0.02, flexor_pressure_pa=START + 6e4,
                              extensor_pressure_pa=START, initial_angle_rad=start)
    assert start > 0.1
    assert np.all(response.angle_rad == start) and np.all(response.velocity_rad_per_s == 0.0)


def test_dry_friction_of_a_muscle_holds_until_it_gives_way(joint):
    level_n, radius = 2.0, 0.012
    rough = with_effects(joint, [{'name': 'coulomb_friction', 'parameters': {'force_n': level_n}}])
    count = 4000
    push = np.linspace(0.0, 0.1, count)
    response = rough.simulate(np.full(count, 3.0), np.full(count, 3.0), push, **EVEN)
    gives = int(np.argmax(response.angle_rad != 0.0))
    assert push[gives] == pytest.approx(2.0 * radius * level_n, abs=1e-4)
    # While it holds, the tendons carry the push: their readings are those of equilibrium.
    assert np.allclose(response.torque_n_m[1:gives], -push[:gives - 1], atol=1e-12)
    pull = response.flexor.force_n - response.extensor.force_n
    assert np.allclose(radius * pull[1:gives], -push[:gives - 1], atol=1e-12)


def test_friction_ends_a_swing_without_chatter(joint):
    rough = with_effects(joint, ['coulomb_friction', 'hysteresis']).with_({'friction_n_m': 0.02})
    response = rough.simulate(np.full(3000, 3.0), np.full(3000, 3.0), initial_angle_rad=0.6,
                              **EVEN)
    speed = response.velocity_rad_per_s
    moving = np.flatnonzero(speed != 0.0)
    assert moving[-1] < 2000
    assert np.all(response.angle_rad[moving[-1] + 1:] == response.angle_rad[-1])
    assert np.sum(np.diff(np.sign(speed[moving])) != 0) < 15


@pytest.mark.parametrize('inertia, substeps', [(0.003, 1), (2e-4, 3), (2e-5, 8)])
def test_a_light_limb_takes_several_coupling_steps(level, inertia, substeps):
    light = level.with_({'limb_mass_kg': 0.0, 'inertia_kg_m2': inertia})
    signal = 3.0 + np.sin(np.arange(300) * 0.02), np.full(300, 3.0)
    coarse = light.simulate(*signal, **EVEN)
    fine = light.simulate(*(np.repeat(s, 2) for s in signal), dt_s=0.0005, **EVEN)
    count = fields(light.plant().par, PARAMETERS).substeps
    assert substeps <= count <= 2 * substeps
    assert np.max(np.abs(coarse.angle_rad - fine.angle_rad[::2])) < 1e-3 * np.ptp(fine.angle_rad)
    assert coarse.flexor.time_s[-1] == coarse.time_s[-1] == pytest.approx(0.3)


def test_strong_damping_takes_coupling_steps_as_a_number_and_as_an_effect(level):
    light = level.with_({'limb_mass_kg': 0.0, 'inertia_kg_m2': 1e-3})
    as_effect = with_effects(light, [
        {'name': 'viscous_damping', 'parameters': {'damping_n_s_per_m': 1000.0}}])
    of_muscle = {'damping_n_s_per_m': 1000.0 + light.flexor.parameters['damping_n_s_per_m']}
    as_number = light.with_(flexor=light.flexor.with_(of_muscle),
                            extensor=light.extensor.with_(of_muscle))
    nominal, *counts = (fields(one.plant().par, PARAMETERS).substeps
                        for one in (light, as_effect, as_number))
    assert counts[0] == counts[1] > nominal

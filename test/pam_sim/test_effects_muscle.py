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

"""Effects of muscle and load: each against what its equation says."""

import numpy as np
from pam_sim import load_rig
from pam_sim.effects.registry import effects
from pam_sim.units import GRAVITY_M_PER_S2, P_ATM_PA
import pytest

TRIANGLE_M = 0.005 + 0.010 * np.abs((np.arange(8001) / 500.0 + 1.0) % 2.0 - 1.0)   # 20 mm/s


def driven(*effects, gauge_pa=400e3, path_m=TRIANGLE_M):
    """Return the response of a driven rig without damping at constant pressure."""
    rig = load_rig('dmsp_5_300_driven').with_(
        parameters={'damping_n_s_per_m': 0.0},
        effects=[{'name': name, 'parameters': values} for name, values in effects])
    return rig.simulate(np.full(len(path_m) - 1, gauge_pa / 100e3), contraction_m=path_m,
                        initial_pressure_pa=P_ATM_PA + gauge_pa)


def hanging(*effects, seconds=3.0, voltage=None):
    """Return rig and response of the hanging mass, by default on a sine about 350 kPa."""
    rig = load_rig('dmsp_5_300_hanging_mass').with_(
        effects=[{'name': name, 'parameters': values} for name, values in effects])
    time_s = np.arange(int(seconds * 1000)) * 1e-3
    if voltage is None:
        voltage = 3.5 + 1.2 * np.sin(2.0 * np.pi * 0.7 * time_s)
    return rig, rig.simulate(np.broadcast_to(voltage, time_s.shape),
                             initial_pressure_pa=P_ATM_PA + 350e3)


@pytest.mark.parametrize('gauge_pa', [200e3, 400e3])
def test_pressure_friction_grows_with_pressure(gauge_pa):
    nominal = driven(gauge_pa=gauge_pa)
    response = driven(('pressure_friction', {'force_at_400kpa_n': 3.0}), gauge_pa=gauge_pa)
    change = (response.force_n - nominal.force_n)[1:]
    level = 3.0 * gauge_pa / 400e3
    up = np.diff(TRIANGLE_M) > 0.0
    assert np.allclose(change, np.where(up, -level, level), atol=1e-6)


def test_pressure_friction_holds_the_mass():
    effect = ('pressure_friction', {'force_at_400kpa_n': 3.0})
    _, still = hanging(effect, seconds=2.0, voltage=3.52)       # 2 kPa more moves nothing
    assert np.ptp(still.contraction_m) == 0.0
    _, moved = hanging(effect, seconds=2.0, voltage=3.90)
    _, free = hanging(seconds=2.0, voltage=3.90)
    assert 1e-4 < moved.contraction_m[-1] - moved.contraction_m[0] < (
        free.contraction_m[-1] - free.contraction_m[0])


def slow_pull(signal, length_m, gauge_pa, **changes):
    """Return (rig, path [m], response) of a driven rig without damping that is pushed short."""
    rig = load_rig('dmsp_5_300_driven').with_(parameters={'damping_n_s_per_m': 0.0}, **changes)
    path_m = np.linspace(0.0, length_m, len(signal) + 1)
    return rig, path_m, rig.simulate(signal, contraction_m=path_m,
                                     initial_pressure_pa=P_ATM_PA + gauge_pa)


@pytest.mark.parametrize('gauge_pa', [0.0, 20e3, 240e3])
def test_a_threshold_gives_no_force_below_it(gauge_pa):
    """Beyond its stroke, such a law times a pressure below 0 would pull."""
    rig, path_m, response = slow_pull(
        np.full(2000, gauge_pa / 100e3), 0.04, gauge_pa, law='tondu_lopez',
        effects=[{'name': 'threshold_pressure', 'parameters': {'pressure_pa': 40e3}}])
    wanted_n = rig.muscle.law.law.force_n(
        max(gauge_pa - 40e3, 0.0), path_m / rig.muscle.length_m, 'allow')
    assert response.force_n == pytest.approx(wanted_n, abs=1e-6)
    assert wanted_n.any() == (gauge_pa > 40e3)


@pytest.mark.parametrize('law, length_m', [('tondu_lopez', 0.03), ('situm_herceg', 0.07)])
def test_air_below_the_atmosphere_does_not_pull(law, length_m):
    """Both valves are shut, and the muscle is pushed short: its volume grows."""
    _, _, response = slow_pull(np.zeros((2000, 2)), length_m, 0.0, law=law, valve='hsv')
    assert response.pressure_pa[-1] < P_ATM_PA - 1e3
    assert not response.force_n.any()


def test_bladder_stiffness_takes_its_force():
    response = driven(('bladder_stiffness', {'stiffness_n_per_m': 500.0}))
    nominal = driven()
    assert np.allclose(response.force_n, nominal.force_n - 500.0 * nominal.contraction_m,
                       atol=1e-9)
    _, soft = hanging(seconds=6.0, voltage=4.0)
    _, stiff = hanging(('bladder_stiffness', {'stiffness_n_per_m': 500.0}), seconds=6.0,
                       voltage=4.0)
    assert stiff.contraction_m[-1] < soft.contraction_m[-1] - 0.5e-3
    assert stiff.force_n[-1] == pytest.approx(soft.force_n[-1], abs=0.02)   # inside the muscle


def test_a_tube_that_stiffens_is_stated_as_its_secant():
    values = {'stiffness_n_per_m': 150.0, 'hardening_m': 0.03}
    added = driven().force_n - driven(('bladder_stiffness_progressive', values)).force_n
    x = TRIANGLE_M
    assert np.allclose(added, 150.0 * x * (1.0 + x / 0.03), atol=1e-9)
    effect = effects()['bladder_stiffness_progressive']
    (secant, unit), = effect.report(effect.values(values), None).values()
    assert secant == pytest.approx(np.interp(14e-3, x[:501], added[:501]) / 14e-3, rel=1e-3)
    assert unit == 'N/m'
    # It stiffens over ever longer ways, until it is the spring.
    soft = driven(('bladder_stiffness_progressive', values | {'hardening_m': 100.0}))
    spring = driven(('bladder_stiffness', {'stiffness_n_per_m': 150.0}))
    assert np.allclose(soft.force_n, spring.force_n, atol=2e-3)


def test_ends_that_taper_more_at_a_larger_strain_are_stated_at_10_mm():
    growing = {'k_minus_1': 0.05, 'k_per_strain': 0.6}
    rig = load_rig('dmsp_5_300_driven')
    stated = effects()['end_taper_growing'].report(growing, rig)
    k_there = 0.05 + 0.6 * 10e-3 / rig.muscle.length_m
    assert stated['k_minus_1'][0] == pytest.approx(k_there)
    assert stated['force_change_at_500kpa_10mm_n'] == effects()['end_taper'].report(
        {'k_minus_1': k_there}, rig)['force_change_at_500kpa_10mm_n']
    # There it is the constant factor of that size; behind it, it takes more.
    change = [driven((name, values)).force_n - driven().force_n for name, values in (
        ('end_taper_growing', growing), ('end_taper', {'k_minus_1': k_there}))]
    there = np.argmin(np.abs(TRIANGLE_M - 10e-3))
    assert change[0][there] == pytest.approx(change[1][there], rel=1e-6)
    far = TRIANGLE_M > 10.1e-3
    assert np.all(change[0][far] < change[1][far]) and np.all(change[1][far] < 0.0)


def test_a_spring_that_stiffens_is_read_by_the_load_cell():
    values = {'stiffness_n_per_m': 150.0, 'hardening_m': 0.03}
    rig, response = hanging(('parallel_spring_progressive', values))
    x = response.contraction_m
    load = rig.parameters['mass_kg'] * (response.acceleration_m_per_s2 + GRAVITY_M_PER_S2)
    inside = x > 1e-6
    assert np.allclose((response.force_n - load)[inside],
                       (150.0 * x * (1.0 + x / 0.03))[inside], atol=1e-9)
    effect = effects()['parallel_spring_progressive']
    (secant, _), = effect.report(effect.values(values), None).values()
    assert secant == pytest.approx(150.0 * (1.0 + 14.0 / 30.0))


@pytest.mark.parametrize('damping', [30.0, -10.0])
def test_a_damper_that_yields_at_speed(damping):
    values = {'damping_n_s_per_m': damping, 'speed_m_per_s': 0.01}
    added = (driven().force_n - driven(('viscous_damping_thinning', values)).force_n)[1:]
    v = np.diff(TRIANGLE_M) * 1000.0
    assert np.allclose(added, damping * v / (1.0 + np.abs(v) / 0.01), atol=1e-9)
    effect = effects()['viscous_damping_thinning']
    stated = effect.report(effect.values(values), None)['force_at_50mm_per_s_n']
    assert stated == (pytest.approx(damping * 0.05 / 6.0), 'N')
    fast = driven(('viscous_damping_thinning', values | {'speed_m_per_s': 100.0}))
    linear = driven(('viscous_damping', {'damping_n_s_per_m': damping}))
    assert np.allclose(fast.force_n, linear.force_n, atol=2e-4)


@pytest.mark.parametrize('name, more', [
    ('viscous_damping', {}), ('viscous_damping_thinning', {'speed_m_per_s': 100.0})])
@pytest.mark.parametrize('mass_kg, damping', [(0.2, 1000.0), (0.1, 250.0)])
def test_strong_damping_of_a_light_load_is_the_parameter_by_another_name(
        name, more, mass_kg, damping):
    """The step was too long for it: the velocity grew and alternated between the stops."""
    rig = load_rig('dmsp_5_300_hanging_mass').with_({'mass_kg': mass_kg})
    signal = np.repeat([1.5, 2.5, 1.8], 500)
    start = {'initial_pressure_pa': P_ATM_PA + 150e3}
    as_effect = rig.with_(effects=[
        {'name': name, 'parameters': {'damping_n_s_per_m': damping, **more}}]).simulate(
            signal, **start)
    as_number = rig.with_({'damping_n_s_per_m': 25.0 + damping}).simulate(signal, **start)
    for quantity in ('contraction_m', 'velocity_m_per_s'):
        one, other = getattr(as_effect, quantity), getattr(as_number, quantity)
        assert np.abs(one - other).max() < 0.02 * np.ptp(other), quantity


def test_thermal_softening_loses_force_with_work():
    effect = ('thermal_softening', {'gain_loss_at_20mm_per_s': 0.05, 'time_constant_s': 2.0})
    response, nominal = driven(effect), driven()
    loss = 1.0 - response.force_n / nominal.force_n
    expected = 0.05 * (1.0 - np.exp(-response.time_s / 2.0))
    assert np.max(np.abs(loss - expected)) < 1e-4
    # At half the speed half the loss; at rest it recovers.
    path = np.interp(np.arange(8001) * 0.5, np.arange(8001), TRIANGLE_M)
    half = 1.0 - driven(effect, path_m=path).force_n / driven(path_m=path).force_n
    assert half[-1] == pytest.approx(0.5 * loss[-1], rel=1e-3)
    rest = np.concatenate([TRIANGLE_M[:4001], np.full(4000, TRIANGLE_M[4000])])
    cooled = 1.0 - driven(effect, path_m=rest).force_n / driven(path_m=rest).force_n
    assert cooled[8000] == pytest.approx(cooled[4001] * np.exp(-2.0), rel=1e-2)


def test_guide_friction_is_on_the_load_side_of_the_cell():
    for name, in_cell in (('guide_friction', 2.0), ('coulomb_friction', 0.0)):
        rig, response = hanging((name, {'force_n': 2.0}))
        mass = rig.parameters['mass_kg']
        load = mass * (response.acceleration_m_per_s2 + GRAVITY_M_PER_S2)
        moving = (response.velocity_m_per_s != 0.0) & (response.contraction_m > 1e-6)
        extra = (response.force_n - load) * np.sign(response.velocity_m_per_s)
        assert np.sum(moving) > 1000
        assert np.allclose(extra[moving], in_cell, atol=1e-9)


def test_guide_friction_moves_like_friction_inside_the_muscle():
    (_, guide), (_, inside) = (hanging((name, {'force_n': 2.0}))
                               for name in ('guide_friction', 'coulomb_friction'))
    assert np.array_equal(guide.contraction_m, inside.contraction_m)
    # Stuck, the cell reads what the muscle holds beyond the weight, up to the friction.
    _, stuck = hanging(('guide_friction', {'force_n': 4.0}), seconds=2.0, voltage=3.55)
    assert np.ptp(stuck.contraction_m) == 0.0
    assert 0.5 < stuck.force_n[-1] - stuck.force_n[0] < 4.0


def test_parallel_spring_loads_the_cell():
    rig, response = hanging(('parallel_spring', {'stiffness_n_per_m': 400.0}))
    load = rig.parameters['mass_kg'] * (response.acceleration_m_per_s2 + GRAVITY_M_PER_S2)
    inside = response.contraction_m > 1e-6
    assert np.allclose((response.force_n - load)[inside],
                       400.0 * response.contraction_m[inside], atol=1e-9)
    _, free = hanging(seconds=6.0, voltage=4.5)
    _, sprung = hanging(('parallel_spring', {'stiffness_n_per_m': 400.0}), seconds=6.0,
                        voltage=4.5)
    assert sprung.contraction_m[-1] < free.contraction_m[-1] - 0.5e-3
    assert sprung.force_n[-1] > free.force_n[-1] + 3.0

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

"""The formulations of hysteresis and friction: loops, energy, memory, rate."""

import math

import numpy as np
from pam_sim import load_rig
from pam_sim.effects.registry import effects
from pam_sim.muscle.geometry import braid
from pam_sim.units import P_ATM_PA
import pytest
from scipy.integrate import trapezoid

GAUGE_PA = 400e3
ON_TRAVEL = ('hysteresis', 'hysteresis_bouc_wen', 'hysteresis_lugre', 'history_friction')
PLAYS = 'hysteresis_prandtl_ishlinskii'
HALF_WIDTH_N = 2.3


def reported(name, **parameters):
    """Return what a result states for an effect [N]."""
    effect = effects()[name]
    stated = effect.report(effect.values(parameters), load_rig('dmsp_5_300_hanging_mass'))
    return next(iter(stated.values()))[0]


def moved(path_m, name=None, **parameters):
    """Return the force [N] of an undamped driven rig at constant pressure."""
    rig = load_rig('dmsp_5_300_driven').with_(
        parameters={'damping_n_s_per_m': 0.0},
        effects=[{'name': name, 'parameters': parameters}] if name else [])
    return rig.simulate(np.full(len(path_m) - 1, GAUGE_PA / 100e3), contraction_m=path_m,
                        initial_pressure_pa=P_ATM_PA + GAUGE_PA).force_n


def change(path_m, name, **parameters):
    """Return what an effect adds to the force [N]."""
    return moved(path_m, name, **parameters) - moved(path_m)


def sine(per_cycle, cycles=3):
    """Return a contraction of 2 to 22 mm, starting at the lower end."""
    phase = 2.0 * np.pi * np.arange(cycles * per_cycle + 1) / per_cycle
    return 0.012 - 0.010 * np.cos(phase)


def legs(*ends_mm, step_m=2e-5):
    """Return a path with straight legs at 20 mm/s, and the index of each end."""
    path, index = [ends_mm[0] * 1e-3], [0]
    for end in ends_mm[1:]:
        count = round(abs(end * 1e-3 - path[-1]) / step_m)
        path += list(np.linspace(path[-1], end * 1e-3, count + 1)[1:])
        index.append(len(path) - 1)
    return np.array(path), index


@pytest.mark.parametrize('name', ON_TRAVEL)
def test_loop_has_the_stated_width_dissipates_and_closes(name):
    per_cycle = 1000
    path = sine(per_cycle)
    force = moved(path, name)
    added = force - moved(path)
    last = slice(2 * per_cycle, None)
    middle = 2 * per_cycle + per_cycle // 4
    half = 0.5 * (added[middle + per_cycle // 2] - added[middle])
    stated = reported(name)
    assert half == pytest.approx(stated, rel=0.01) == pytest.approx(HALF_WIDTH_N, rel=0.01)
    # More force extending than contracting: what goes in comes out less this.
    lost_j = -trapezoid(force[last], path[last])
    maxwell = moved(path, 'hysteresis')
    assert lost_j == pytest.approx(-trapezoid(maxwell[last], path[last]), rel=0.05)
    assert np.max(np.abs(force[last] - force[per_cycle:2 * per_cycle + 1])) < 1e-6


@pytest.mark.parametrize('name, given, tolerance_n', [
    ('hysteresis', {}, 1e-9), ('history_friction', {}, 1e-9),
    ('hysteresis_bouc_wen', {}, 1e-3), ('hysteresis_bouc_wen', {'exponent': 2.0}, 1e-3),
    ('hysteresis_lugre', {'static_ratio': 1.0, 'bristle_damping_n_s_per_m': 0.0}, 1e-9),
    ('hysteresis_lugre', {}, 0.15 * HALF_WIDTH_N)])
def test_a_loop_does_not_depend_on_the_rate(name, given, tolerance_n):
    slow, fast = change(sine(10_000), name, **given), change(sine(1000), name, **given)
    difference = np.abs(slow[::10] - fast)[1001:]
    assert np.max(difference) < tolerance_n
    middle = np.abs(sine(1000) - 0.012)[1001:] < 5e-3       # far from the turns
    assert np.max(difference[middle]) < 0.02 * HALF_WIDTH_N


@pytest.mark.parametrize('name, given', [
    ('hysteresis_bouc_wen', {}), ('hysteresis_bouc_wen', {'exponent': 3.0, 'sigma': 0.8}),
    ('hysteresis_lugre', {'static_ratio': 1.0, 'bristle_damping_n_s_per_m': 0.0}),
    ('hysteresis_lugre', {'static_ratio': 1.0, 'bristle_damping_n_s_per_m': 0.0,
                          'stiffness_n_per_m': 1e7})])
@pytest.mark.parametrize('stride_m', [0.2e-3, 1e-3, 5e-3])
def test_a_step_may_be_long_against_the_width(name, given, stride_m):
    path, _ = legs(5, 20, 10, 15)
    coarse = round(stride_m / 2e-5)
    fine, long = change(path, name, **given), change(path[::coarse], name, **given)
    assert np.max(np.abs(fine[::coarse] - long)) < 0.005 * HALF_WIDTH_N


@pytest.mark.parametrize('name', [*ON_TRAVEL, 'smooth_friction'])
def test_friction_that_grows_with_pressure_is_none_below_the_atmosphere(name):
    path = np.linspace(0.0, 0.020, 301)              # a shut muscle is made shorter
    shut = load_rig('dmsp_5_300_driven').with_(valve='hsv')
    without, with_it = (rig.simulate(np.zeros((300, 2)), contraction_m=path,
                                     initial_pressure_pa=P_ATM_PA)
                        for rig in (shut, shut.with_(effects=[{'name': name, 'parameters': {
                            'force_n': 0.0, 'force_per_pa': 2e-5}}])))
    assert with_it.pressure_pa[-1] < P_ATM_PA - 10e3
    assert np.array_equal(with_it.force_n, without.force_n)


def test_bouc_wen_follows_its_equation():
    path, _ = legs(5, 7)
    travel = (path - path[0]) / 0.8e-3
    assert np.allclose(change(path, 'hysteresis_bouc_wen'),
                       -HALF_WIDTH_N * (1.0 - np.exp(-travel)), atol=1e-9)
    assert np.allclose(change(path, 'hysteresis_bouc_wen', exponent=2.0),
                       -HALF_WIDTH_N * np.tanh(travel), atol=2e-3)
    # From the sliding state back: straight to zero at sigma = 1/2, else an exponential.
    path, (_, turn, _) = legs(2, 22, 21.4)
    widths = (path[turn] - path[turn:]) / 0.8e-3
    for sigma, share in ((0.5, 1.0 - widths), (0.8, (1.6 * np.exp(-0.6 * widths) - 1.0) / 0.6)):
        assert np.allclose(change(path, 'hysteresis_bouc_wen', sigma=sigma)[turn:],
                           -HALF_WIDTH_N * share, atol=1e-9)


def test_lugre_breaks_away_at_its_static_friction():
    slow = 0.005 + 1e-7 * np.arange(20_001)          # 0.1 mm/s
    force = change(slow, 'hysteresis_lugre', static_ratio=1.5, stribeck_m_per_s=0.01,
                   stiffness_n_per_m=1e5)
    assert force[-1] == pytest.approx(-1.5 * HALF_WIDTH_N, rel=1e-3)
    quick = 0.005 + 5e-5 * np.arange(201)            # 50 mm/s
    force = change(quick, 'hysteresis_lugre', static_ratio=1.5, stribeck_m_per_s=0.01,
                   stiffness_n_per_m=1e5)
    assert force[-1] == pytest.approx(-HALF_WIDTH_N, rel=1e-3)


def hanging(name, amplitude_v, seconds, **parameters):
    """Return rig and response of a hanging mass whose pressure swings once in ``seconds``."""
    rig = load_rig('dmsp_5_300_hanging_mass').with_(
        effects=[{'name': name, 'parameters': parameters}] if name else [])
    count = round(1000 * seconds)
    phase = 2.0 * np.pi * np.arange(3 * count) / count
    return rig, rig.simulate(4.0 - amplitude_v * np.cos(phase),
                             initial_pressure_pa=P_ATM_PA + 1e5 * (4.0 - amplitude_v))


def test_stiff_bristles_are_stable_and_act_as_dry_friction():
    given = {'force_n': 2.0, 'force_per_pa': 0.0}
    _, stiff = hanging('hysteresis_lugre', 1.0, 2.0, stiffness_n_per_m=1e7, static_ratio=1.0,
                       bristle_damping_n_s_per_m=50.0, **given)
    _, dry = hanging('coulomb_friction', 1.0, 2.0, force_n=2.0)
    assert np.max(np.abs(stiff.contraction_m - dry.contraction_m)) < 5e-5


@pytest.mark.parametrize('name', ON_TRAVEL)
def test_reversing_half_way_stays_inside_the_outer_loop(name):
    path, (_, _, start, _, _, _, _, _) = legs(2, 22, 2, 12, 8, 12, 22, 2)
    force = change(path, name)[start + 1:]
    inner = path[start + 1:]
    up, down = (legs(2, 22, 2, 22, 2) for _ in range(2))
    outer = change(up[0], name)
    low = np.interp(inner, up[0][up[1][2] + 1:up[1][3]], outer[up[1][2] + 1:up[1][3]])
    high = np.interp(-inner, -down[0][down[1][3] + 1:], outer[down[1][3] + 1:])
    slack = 0.12 * HALF_WIDTH_N if name == 'hysteresis_lugre' else 1e-3   # its static friction
    away = (inner > 2.1e-3) & (inner < 21.9e-3)
    assert np.all(force[away] > low[away] - slack)
    assert np.all(force[away] < high[away] + slack)


@pytest.mark.parametrize('name, remembers', [
    ('hysteresis', True), ('history_friction', True),
    ('hysteresis_bouc_wen', False), ('hysteresis_lugre', False)])
def test_return_point_memory(name, remembers):
    """Back at the point where a small cycle began, the force is as if there had been none."""
    given = {'static_ratio': 1.0} if name == 'hysteresis_lugre' else {}
    path, index = legs(2, 22, 2, 4, 3.2, 4, 6)
    straight, without = legs(2, 22, 2, 4, 6)
    with_cycle = change(path, name, **given)[index[5]:]
    plain = change(straight, name, **given)[without[3]:]
    first = np.abs(with_cycle - plain)[0]
    assert first < 1e-9 if remembers else first > 0.05
    if remembers:
        assert np.max(np.abs(with_cycle - plain)) < 1e-9


def test_history_friction_builds_up_after_each_turn():
    width_m, dry = 0.75e-3, 0.3
    path, (_, turn, second, _) = legs(5, 6, 5.5, 5.9)
    force = change(path, 'history_friction')

    def expected(sign, first, last, h, scale):
        travel = np.abs(path[first + 1:last + 1] - path[first])
        h = h + scale * sign * (1.0 - np.exp(-travel / (scale * width_m)))
        return -HALF_WIDTH_N * (dry * sign + (1.0 - dry) * h), h[-1]
    up, h = expected(1.0, 0, turn, 0.0, 1.0)
    down, h = expected(-1.0, turn, second, h, 2.0)
    again, _ = expected(1.0, second, len(path) - 1, h, 2.0)
    assert np.allclose(force[1:], np.concatenate([up, down, again]), atol=1e-9)
    # A cycle that grows beyond the first turn goes on as from the start.
    path, _ = legs(5, 6, 2)
    beyond = path < 4e-3 - 1e-9
    expected = HALF_WIDTH_N * (dry + (1.0 - dry) * (1.0 - np.exp((path - 5e-3) / width_m)))
    assert np.allclose(change(path, 'history_friction')[beyond], expected[beyond], atol=1e-9)


def test_history_friction_is_continuous_with_more_turns_than_it_remembers():
    ends = 12.0 + 4.0 * np.cos(np.pi * np.arange(40)) * 0.9 ** np.arange(40)
    path, index = legs(2, *ends, 22)
    force = change(path, 'history_friction')
    assert np.max(np.abs(force)) < HALF_WIDTH_N + 1e-9
    memory = force[1:] + 0.3 * HALF_WIDTH_N * np.sign(np.diff(path))
    assert np.max(np.abs(np.diff(memory))) < 2e-5 * 0.7 * HALF_WIDTH_N / 0.75e-3 * 1.001
    plain, _ = legs(2, 22)
    tail = path[index[-2] + 1:] > 16.1e-3
    expected = np.interp(path[index[-2] + 1:][tail], plain, change(plain, 'history_friction'))
    assert np.allclose(force[index[-2] + 1:][tail], expected, atol=1e-9)


def isometric(gauge_pa, name=None, **parameters):
    """Return the force [N] at 8.86 mm when the pressure goes through the given levels."""
    rig = load_rig('dmsp_5_300_isometric').with_(
        parameters={'contraction_m': 8.86e-3, 'T_m': 0.005},
        effects=[{'name': name, 'parameters': parameters}] if name else [])
    levels = np.concatenate([np.linspace(a, b, 201)[1:] for a, b in zip(gauge_pa, gauge_pa[1:])])
    levels = np.repeat(levels, 60)               # settled at each level
    response = rig.simulate(levels / 100e3, initial_pressure_pa=P_ATM_PA + gauge_pa[0])
    return response.force_n[60::60]


def test_plays_make_the_isometric_loop_they_state():
    force = isometric((300e3, 500e3, 300e3, 500e3), PLAYS)
    stated = reported(PLAYS)
    assert stated == pytest.approx(HALF_WIDTH_N, rel=0.01)
    assert 0.5 * (force[299] - force[499]) == pytest.approx(stated, rel=0.01)
    # Travel winds nothing up, and a muscle at rest has no loop of the other kind.
    assert np.array_equal(moved(sine(500), PLAYS), moved(sine(500)))
    rest = isometric((300e3, 500e3, 300e3), 'hysteresis')
    nominal = isometric((300e3, 500e3, 300e3))
    assert np.array_equal(rest, nominal)


def test_plays_return_to_the_point_where_a_small_loop_began():
    cycle = isometric((300e3, 450e3, 420e3, 450e3, 500e3, 300e3), PLAYS)
    assert cycle[599] == pytest.approx(cycle[199], abs=1e-6)
    plain = isometric((300e3, 450e3, 500e3, 300e3), PLAYS)
    assert np.allclose(cycle[600:], plain[200:], atol=1e-6)
    # Less force while the pressure rises than while it falls.
    rising, falling = plain[:200], plain[400:600]
    falling = np.interp(np.linspace(300e3, 450e3, 201)[1:], np.linspace(300e3, 500e3, 201)[:-1],
                        falling[::-1])
    assert np.all(rising <= falling + 1e-9) and np.max(falling - rising) > 4.0


@pytest.mark.parametrize('name', [*ON_TRAVEL, PLAYS])
def test_on_a_hanging_load_all_give_the_same_kind_of_pressure_loop(name):
    halves, lost = [], []
    for one in (name, 'hysteresis', None):
        rig, response = hanging(one, 1.5, 10.0)
        p = response.pressure_pa[-10_001:] - P_ATM_PA
        x = response.contraction_m[-10_001:]
        assert x[0] == pytest.approx(x[-1], abs=1e-8)
        top = int(np.argmax(x))
        halves.append(0.5 * (np.interp(12e-3, x[:top], p[:top])
                             - np.interp(12e-3, x[:top:-1], p[:top:-1])))
        lost.append(trapezoid(p, rig.volume_m3(x)))
    ours, maxwell, nominal = halves
    assert 8e3 < ours - nominal < 12e3                     # contracting takes more pressure
    assert ours - nominal == pytest.approx(maxwell - nominal, rel=0.05)
    assert lost[0] - lost[2] == pytest.approx(lost[1] - lost[2], rel=0.06)
    assert lost[0] > lost[2] > 0.0


@pytest.mark.parametrize('size', ['dmsp_5_300', 'dmsp_10_250'])
def test_braid_contact_is_friction_of_the_stated_size(size):
    path, (_, turn, _) = legs(5, 15, 5)
    rig = load_rig('dmsp_5_300_driven').with_(muscle=size, effects=[
        {'name': 'braid_contact_friction', 'parameters': {'friction_coefficient': 0.6}}])
    start = {'initial_pressure_pa': P_ATM_PA + GAUGE_PA, 'contraction_m': path}
    volts = np.full(len(path) - 1, GAUGE_PA / 100e3)
    added = (rig.simulate(volts, **start).force_n
             - rig.with_(effects=[]).simulate(volts, **start).force_n)[1:]
    muscle = rig.muscle
    thread_m, turns = braid(muscle.length_m, muscle.bore_m, muscle.braid_angle_rad)
    length = muscle.length_m - path[1:]
    # Load of one crossing, its effective radius, patch and torque, and the virtual work.
    alpha = np.arccos(length / thread_m)
    diameter = thread_m * np.sin(alpha) / (turns * math.pi)
    crossings = 2.0 * 16.0 ** 2 * turns
    load = 0.5 * GAUGE_PA * math.pi * diameter * length / crossings
    radius = 0.2e-3 / np.sin(2.0 * alpha)
    patch = np.cbrt(3.0 * load * radius / (4.0 * 10e6))
    assert np.all((patch < 0.2e-3) == (size == 'dmsp_5_300'))       # the larger one is flat
    patch = np.minimum(patch, 0.2e-3)
    torque = 3.0 * math.pi / 16.0 * 0.6 * load * patch
    level = crossings * torque * 2.0 / (thread_m * np.sin(alpha))
    sign = np.where(np.arange(len(level)) < turn, -1.0, 1.0)
    assert np.allclose(added, sign * level, rtol=1e-9)


def test_braid_contact_grows_with_pressure_until_the_strands_are_flat():
    response = []
    for gauge_pa in (200e3, 400e3):
        rig = load_rig('dmsp_5_300_driven').with_(
            parameters={'damping_n_s_per_m': 0.0}, effects=['braid_contact_friction'])
        path = np.linspace(5e-3, 6e-3, 51)
        start = {'initial_pressure_pa': P_ATM_PA + gauge_pa, 'contraction_m': path}
        volts = np.full(50, gauge_pa / 100e3)
        response.append(rig.with_(effects=[]).simulate(volts, **start).force_n[-1]
                        - rig.simulate(volts, **start).force_n[-1])
    assert response[1] == pytest.approx(response[0] * 2.0 ** (4.0 / 3.0), rel=1e-9)

    def stated(**given):
        return reported('braid_contact_friction', **given)
    assert stated(contact_modulus_pa=1e5) == stated(contact_modulus_pa=1.1e5)    # as wide as it is
    assert stated(contact_modulus_pa=1e9) < 0.5 * stated()


def test_the_shared_lag_is_not_an_effect():
    assert 'lag' not in effects() and 'tube_lag' in effects()

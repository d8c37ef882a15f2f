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

"""Dry friction that bends before it slips, in muscle and guide."""

import numpy as np
from pam_sim import load_rig
from pam_sim.effects.presliding import bent, bent_there_and_back
from pam_sim.units import P_ATM_PA
import pytest
from scipy.integrate import solve_ivp

GAUGE_PA = 400e3
MUSCLE = {'coulomb_friction': 'force_n', 'pressure_friction': 'force_at_400kpa_n'}
NAMES = [*MUSCLE, 'guide_friction']
NO_EXCESS = {'static_excess': 0.0}


def driven(path_m, name, **parameters):
    """Return what an effect adds to the force [N] of a driven rig at constant pressure."""
    start = {'contraction_m': path_m, 'initial_pressure_pa': P_ATM_PA + GAUGE_PA}
    volts = np.full(len(path_m) - 1, GAUGE_PA / 100e3)
    rig = load_rig('dmsp_5_300_driven').with_(parameters={'damping_n_s_per_m': 0.0})
    with_it = rig.with_(effects=[{'name': name, 'parameters': parameters}])
    return with_it.simulate(volts, **start).force_n - rig.simulate(volts, **start).force_n


def hanging(name, volts, **parameters):
    """Return the response of a hanging mass that starts at rest under the first volts."""
    rig = load_rig('dmsp_5_300_hanging_mass').with_(
        effects=[{'name': name, 'parameters': parameters}])
    return rig.simulate(volts, initial_pressure_pa=P_ATM_PA + 1e5 * volts[0])


@pytest.mark.parametrize('name', MUSCLE)
def test_follows_its_equation(name):
    """Against an ODE solver, on a path that reverses within the way of bending."""
    size = {MUSCLE[name]: 3.0}
    way_m, tau_s, excess, speed = 20e-6, 0.4e-3, 0.2, 2e-3
    time_s = 1e-3 * np.arange(2001)
    swing = 2.0 * np.pi * 1.0
    path = 0.01 + 50e-6 * (1.0 - np.cos(swing * time_s))

    def rate(t, z):
        v = 50e-6 * swing * np.sin(swing * t)
        sliding = way_m * (1.0 + excess * np.exp(-(v / speed) ** 2))
        return v - abs(v) * z / sliding
    exact = solve_ivp(rate, (0.0, 2.0), [0.0], t_eval=time_s, max_step=1e-3, rtol=1e-8,
                      atol=1e-12)
    dz = np.array([rate(t, z) for t, z in zip(time_s, exact.y[0])])
    dz *= np.exp(-(50e-6 * swing * np.sin(swing * time_s) / speed) ** 2)
    expected = -3.0 * (exact.y[0] + tau_s * dz) / way_m
    added = driven(path, name + '_presliding', presliding_m=way_m, bristle_time_s=tau_s,
                   static_excess=excess, stribeck_m_per_s=speed, **size)
    assert np.max(np.abs(added - expected)) < 0.02 * 3.0
    assert np.max(np.abs(expected)) > 3.3                 # it broke away


@pytest.mark.parametrize('name', MUSCLE)
def test_breaks_away_above_and_slides_at_the_level(name):
    given = {MUSCLE[name]: 2.0, 'static_excess': 0.5, 'stribeck_m_per_s': 0.01}
    slow = driven(0.005 + 1e-7 * np.arange(3001), name + '_presliding', **given)
    fast = driven(0.005 + 5e-5 * np.arange(201), name + '_presliding', **given)
    assert slow[-1] == pytest.approx(-3.0, rel=1e-3)      # 0.1 mm/s
    assert fast[-1] == pytest.approx(-2.0, rel=1e-3)      # 50 mm/s


@pytest.mark.parametrize('before, after', [(0.01, -0.006), (-0.004, 0.01), (0.01, 0.02)])
def test_a_turn_inside_a_step_is_travelled_both_ways(before, after):
    way_m, elapsed_s = 10e-6, 1e-3
    way = way_m, 1.0 / way_m
    fine = np.linspace(0.0, elapsed_s, 10_001)
    path = before * fine + 0.5 * (after - before) / elapsed_s * fine ** 2
    z = 4e-6
    for dx in np.diff(path):
        z = bent(z, dx, *way)
    assert bent_there_and_back(4e-6, path[-1], after, elapsed_s, *way) == pytest.approx(
        z, abs=1e-9)
    assert bent_there_and_back(4e-6, 0.0, after, 0.0, *way) == 4e-6


def test_pressure_scales_it():
    path = 0.005 + 2e-5 * np.arange(101)
    rig = load_rig('dmsp_5_300_driven').with_(parameters={'damping_n_s_per_m': 0.0})
    added = []
    for gauge_pa in (200e3, 400e3):
        start = {'contraction_m': path, 'initial_pressure_pa': P_ATM_PA + gauge_pa}
        volts = np.full(100, gauge_pa / 100e3)
        added.append(rig.with_(effects=['pressure_friction_presliding']).simulate(
            volts, **start).force_n[-1] - rig.simulate(volts, **start).force_n[-1])
    assert added[1] == pytest.approx(2.0 * added[0], rel=1e-6)


@pytest.mark.parametrize('name', NAMES)
def test_is_dry_friction_where_the_way_is_short(name):
    phase = 2.0 * np.pi * np.arange(6000) / 2000
    volts = 4.0 - np.cos(phase)
    bending = hanging(name + '_presliding', volts, presliding_m=1e-6, **NO_EXCESS)
    dry = hanging(name, volts)
    without = hanging(name, volts, **{MUSCLE.get(name, 'force_n'): 1e-9})
    apart = np.max(np.abs(bending.contraction_m - dry.contraction_m))
    assert apart < 0.03 * np.max(np.abs(without.contraction_m - dry.contraction_m))


@pytest.mark.parametrize('name', NAMES)
def test_gives_way_where_dry_friction_sticks(name):
    """Force short of break-away bends the contact, by less than the way, and it comes back."""
    volts = np.concatenate([np.full(1000, 4.0), np.full(2000, 4.02), np.full(2000, 4.0)])
    given = {'presliding_m': 30e-6, **NO_EXCESS}
    bending = hanging(name + '_presliding', volts, **given).contraction_m
    dry = hanging(name, volts).contraction_m
    assert np.ptp(dry[1000:]) == 0.0
    assert 1e-6 < bending[2999] - bending[999] < 30e-6
    assert abs(bending[-1] - bending[999]) < 0.4 * (bending[2999] - bending[999])


def test_the_cell_carries_the_friction_of_the_guide():
    volts = np.concatenate([np.full(500, 3.0), 3.0 + 5e-4 * np.arange(2000)])
    rig = load_rig('dmsp_5_300_hanging_mass')
    slow = slice(1500, 2400)
    plain = rig.simulate(volts, initial_pressure_pa=P_ATM_PA + 3e5).force_n[slow]
    inside = hanging('coulomb_friction_presliding', volts, force_n=2.0).force_n[slow]
    guide = hanging('guide_friction_presliding', volts, force_n=2.0).force_n[slow]
    assert np.mean(inside - plain) == pytest.approx(0.0, abs=0.05)
    assert np.mean(guide - plain) == pytest.approx(2.0, abs=0.05)

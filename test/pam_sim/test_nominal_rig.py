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

"""The nominal rig against its check points and against an independent solution."""

import numpy as np
from pam_sim import load_rig
from pam_sim.muscle import geometry
from pam_sim.muscle.registry import make_law
from pam_sim.units import P_ATM_PA
from profiles import duties, profile
import pytest
import reference_rig
from scipy.integrate import simpson


@pytest.fixture(scope='module')
def rig():
    return load_rig('dmsp_5_300_hanging_mass')


def within(ours, theirs, share=0.001):
    """Return whether two signals agree within a share of the range of the second."""
    return np.max(np.abs(ours - theirs)) <= share * np.ptp(theirs)


def test_force_map_check_points():
    law = make_law('sarosi')
    assert law.force_n(600e3, 0.0) == pytest.approx(140.0, abs=0.05)
    assert law.force_n(600e3, 0.1993) > 0.0 and law.force_n(600e3, 0.1995) == 0.0
    lift_off = law.pressure_gauge_pa(5.0 * 9.80665, 0.0)
    assert lift_off == pytest.approx(236.3e3, abs=100.0)


def test_volume_check_points(rig):
    assert rig.volume_m3(0.0) - 3.0e-6 == pytest.approx(5.89e-6, abs=0.005e-6)
    assert rig.volume_m3(0.2 * geometry.LENGTH_M) - 3.0e-6 == pytest.approx(10.42e-6, abs=0.005e-6)


@pytest.mark.parametrize('kpa, mm', [(300, 2.62), (400, 8.86), (500, 19.01), (600, 30.16)])
def test_five_kilograms_settle_where_they_should(rig, kpa, mm):
    response = rig.simulate(np.full(8000, kpa / 100.0))
    assert response.contraction_m[-1] == pytest.approx(mm * 1e-3, abs=0.01e-3)
    assert response.force_n[-1] == pytest.approx(5.0 * 9.80665, abs=0.01)
    assert rig.static_pressure_pa(mm * 1e-3) - P_ATM_PA == pytest.approx(kpa * 1e3, abs=200.0)
    assert rig.static_contraction_m(P_ATM_PA + kpa * 1e3) == pytest.approx(mm * 1e-3, abs=1e-5)


@pytest.mark.parametrize('kind', ['step', 'sine', 'random'])
@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_equals_the_independent_solution(rig, valve, kind):
    count = 1000
    signal = profile(kind, count) / 100.0 if valve == 'ppr' else duties(kind, count)
    start = P_ATM_PA + 300e3
    ours = rig.with_(valve=valve).simulate(signal, initial_pressure_pa=start)
    p, x, v = reference_rig.solve(valve, signal, 1e-3, start, ours.contraction_m[0])
    assert within(ours.pressure_pa, p)
    assert within(ours.contraction_m, x)
    assert np.ptp(x) > 1e-3
    # The cell carries the load: muscle force less damping while it hangs free.
    free = (x > 1e-5) & (v != 0.0)
    cell = np.array([reference_rig.force(a, b) for a, b in zip(p, x)]) - 25.0 * v
    assert np.max(np.abs(ours.force_n - cell)[free]) <= 0.001 * np.ptp(cell[free]) + 1e-3


@pytest.mark.parametrize('valve, fidelity', [
    ('ppr', 'averaged'), ('hsv', 'averaged'), ('hsv', 'switching')])
@pytest.mark.parametrize('kind', ['step', 'sine', 'random'])
@pytest.mark.parametrize('name', ['dmsp_5_300_hanging_mass', 'dmsp_5_300_realistic'])
def test_halving_the_step_changes_little(name, valve, fidelity, kind):
    rig = load_rig(name, valve=valve, fidelity=fidelity)
    count = 3000
    signal = profile(kind, count) / 100.0 if valve == 'ppr' else duties(kind, count)
    start = P_ATM_PA + 300e3
    coarse = rig.simulate(signal, initial_pressure_pa=start)
    fine = rig.simulate(np.repeat(signal, 2, axis=0), initial_pressure_pa=start, dt_s=0.0005)
    for signal_name in ('pressure_pa', 'contraction_m', 'force_n'):
        assert within(getattr(coarse, signal_name), getattr(fine, signal_name)[::2]), signal_name


def test_external_force_and_lower_stop(rig):
    signal = np.full(3000, 4.0)
    pull = np.where(np.arange(3000) < 1500, 0.0, 60.0)
    response = rig.simulate(signal, external_force_n=pull)
    assert response.contraction_m[1400] > 0.008
    assert np.all(response.contraction_m >= 0.0)
    assert response.contraction_m[-1] == 0.0 and response.velocity_m_per_s[-1] == 0.0
    assert response.force_n[-1] == pytest.approx(5.0 * 9.80665 + 60.0)


def test_upper_stop_holds_the_mass(rig):
    light = rig.with_(parameters={'mass_kg': 0.1, 'force_map_gain': 5.0})
    response = light.simulate(np.full(4000, 6.0))
    assert response.contraction_m.max() <= 0.25 * 0.3


def test_air_balances(rig):
    for fidelity in ('averaged', 'switching'):
        response = rig.with_(valve='hsv', fidelity=fidelity).simulate(duties('random', 3000))
        gained = response.air_mass_kg - response.air_mass_kg[0]
        assert response.filled_kg[-1] > 1e-5
        assert np.max(np.abs(gained - response.filled_kg + response.vented_kg)) < 1e-14
        volume = rig.volume_m3(response.contraction_m)
        assert np.allclose(response.pressure_pa * volume,
                           response.air_mass_kg * 287.05 * 293.15, rtol=1e-9)


@pytest.mark.parametrize('valve, signal', [('ppr', [4.6]), ('hsv', [0.03, 0.0])])
def test_energy_balances(rig, valve, signal):
    """What the cell passes on is what lifts and moves the mass; the signal is held: no kinks."""
    response = rig.with_(valve=valve).simulate(
        np.tile(signal, (1000, 1)), initial_pressure_pa=P_ATM_PA + 360e3)
    v, x = response.velocity_m_per_s, response.contraction_m
    assert x.min() > 1e-3 and np.ptp(x) > 2e-3
    power = response.force_n * v
    work = simpson(power, dx=1e-3)
    stored = 5.0 * 9.80665 * (x[-1] - x[0]) + 0.5 * 5.0 * (v[-1] ** 2 - v[0] ** 2)
    assert abs(work - stored) <= 1e-6 * np.sum(np.abs(power)) * 1e-3
    # And the muscle's work is that plus what its damping turned into heat.
    tension = np.array([reference_rig.force(a, b) for a, b in zip(response.pressure_pa, x)])
    assert abs(simpson((tension - 25.0 * v) * v, dx=1e-3) - stored) \
        <= 1e-6 * np.sum(np.abs(power)) * 1e-3


def test_venting_never_goes_below_the_atmosphere(rig):
    signal = np.zeros((2000, 2))
    signal[:, 1] = 1.0
    response = rig.with_(valve='hsv').simulate(signal, initial_pressure_pa=P_ATM_PA + 200e3)
    assert response.pressure_pa.min() >= P_ATM_PA - 1e-6
    assert response.pressure_pa[-1] == pytest.approx(P_ATM_PA, abs=1.0)


def test_switching_agrees_with_averaged_in_the_mean(rig):
    signal = np.zeros((1000, 2))
    signal[:200, 0] = 0.35
    averaged = rig.with_(valve='hsv').simulate(signal)
    switching = rig.with_(valve='hsv', fidelity='switching').simulate(signal)
    assert switching.pressure_pa[-1] == pytest.approx(averaged.pressure_pa[-1], rel=0.01)
    assert np.max(np.abs(switching.pressure_pa - averaged.pressure_pa)) > 1e3


def test_prescribed_contraction(rig):
    driven = load_rig('dmsp_5_300_driven')
    x = 0.01 + 0.005 * np.sin(np.arange(501) * 0.01)
    response = driven.simulate(np.full(500, 4.0), contraction_m=x)
    assert np.allclose(response.contraction_m, x, atol=1e-15)
    speed = np.diff(x) / 1e-3
    tension = [reference_rig.force(p, q) for p, q in zip(response.pressure_pa[1:], x[1:])]
    assert np.allclose(response.force_n[1:], np.array(tension) - 25.0 * speed, atol=1e-9)
    held = load_rig('dmsp_5_300_isometric').with_(parameters={'contraction_m': 0.012})
    response = held.simulate(np.full(800, 5.0))
    assert np.all(response.contraction_m == 0.012)
    assert response.force_n[-1] == pytest.approx(reference_rig.force(P_ATM_PA + 500e3, 0.012),
                                                 abs=0.01)

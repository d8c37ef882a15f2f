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

"""Effects of valve and air: each against what its equation says."""

import numpy as np
from pam_sim import load_rig
from pam_sim.effects.registry import effects
from pam_sim.effects.valve_dead_zone import mean_opening
from pam_sim.effects.valve_dead_zone_gradual import mean_opening_with_lift
from pam_sim.errors import InputError
from pam_sim.units import GAS_CONSTANT_AIR, P_ATM_PA, TEMPERATURE_K
from pam_sim.valve.hsv import open_time_in, pulse_edges
from profiles import duties, profile
import pytest
from scipy.integrate import solve_ivp

RT = GAS_CONSTANT_AIR * TEMPERATURE_K
HELD_M = 0.010


def held(valve, *effects, fidelity='averaged', **parameters):
    """Return an isometric rig at 10 mm with effects, each (name, parameters)."""
    return load_rig('dmsp_5_300_isometric').with_(
        valve=valve, fidelity=fidelity, parameters={'contraction_m': HELD_M, **parameters},
        effects=[{'name': name, 'parameters': values} for name, values in effects])


def pulse(fill=0.0, vent=0.0, first=0, last=None, count=1000):
    """Return duties that are on from step ``first`` to ``last``."""
    signal = np.zeros((count, 2))
    signal[first:last] = fill, vent
    return signal


@pytest.mark.parametrize('tau_s', [0.005, 0.020])
def test_tube_lag_of_the_regulator_is_a_second_lag(tau_s):
    start = P_ATM_PA + 300e3
    response = held('ppr', ('tube_lag', {'time_constant_s': tau_s})).simulate(
        np.full(400, 4.0), initial_pressure_pa=start, initial_signal=3.0)
    t, slow = response.time_s, 0.060
    expected = start + 100e3 * (
        1.0 - (slow * np.exp(-t / slow) - tau_s * np.exp(-t / tau_s)) / (slow - tau_s))
    assert np.max(np.abs(response.pressure_pa - expected)) < 20.0


def test_two_stages_of_a_line_are_lags_in_series():
    start, tau_s, slow = P_ATM_PA + 300e3, (0.024, 0.006), 0.060
    response = held('ppr', ('tube_lag_two_stage', {
        'time_constant_s': 0.030, 'second_stage_share': 0.2})).simulate(
            np.full(400, 4.0), initial_pressure_pa=start, initial_signal=3.0)
    # Partial fractions of three lags: the step less each time constant's exponential.
    times, t = (slow, *tau_s), response.time_s
    left = sum(a**2 / np.prod([a - b for b in times if b != a]) * np.exp(-t / a) for a in times)
    assert np.max(np.abs(response.pressure_pa - start - 100e3 * (1.0 - left))) < 30.0


def test_a_line_of_one_stage_is_the_plain_lag():
    start = {'initial_pressure_pa': P_ATM_PA + 300e3}
    signal = pulse(fill=0.2, vent=0.1, last=300)
    one = held('hsv', ('tube_lag', {'time_constant_s': 0.01})).simulate(signal, **start)
    two = held('hsv', ('tube_lag_two_stage', {
        'time_constant_s': 0.01, 'second_stage_share': 0.0})).simulate(signal, **start)
    assert np.max(np.abs(one.pressure_pa - two.pressure_pa)) < 0.1


def test_a_slit_loses_the_flow_it_reports_and_less_at_a_low_pressure():
    effect, flow = effects()['leakage_slit'], 4e-6
    rig = held('hsv', ('leakage_slit', {
        'conductance_m3_per_s_pa': 0.0, 'slit_flow_at_400kpa_kg_per_s': flow}))
    report = effect.report(rig.effect('leakage_slit').parameters, rig)
    assert report['mass_flow_at_400kpa_kg_per_s'][0] == flow
    sonic = report['conductance_m3_per_s_pa'][0]
    orifice = held('hsv', ('leakage', {'conductance_m3_per_s_pa': sonic}))
    for gauge_pa, expected in ((400e3, flow), (200e3, flow * (
            (200e3 + P_ATM_PA)**2 - P_ATM_PA**2) / ((400e3 + P_ATM_PA)**2 - P_ATM_PA**2))):
        lost = [(r.air_mass_kg[0] - r.air_mass_kg[10]) / 0.010 for r in (
            one.simulate(np.zeros((20, 2)), initial_pressure_pa=P_ATM_PA + gauge_pa)
            for one in (rig, orifice))]
        assert lost[0] == pytest.approx(expected, rel=0.01)
        assert lost[1] == pytest.approx(flow, rel=0.01) if gauge_pa == 400e3 else (
            lost[1] > 1.3 * lost[0])
    droops = [P_ATM_PA + 400e3 - held('ppr', (name, values)).simulate(
        np.full(3000, 4.0), initial_pressure_pa=P_ATM_PA + 400e3).pressure_pa[-1]
        for name, values in (('leakage_slit', rig.effect('leakage_slit').parameters),
                             ('leakage', {'conductance_m3_per_s_pa': sonic}))]
    assert droops[0] == pytest.approx(droops[1], rel=0.02) and droops[0] > 10.0


@pytest.mark.parametrize('fidelity', ['averaged', 'switching'])
def test_tube_lag_of_the_switching_valves_delays_the_air_and_loses_none(fidelity):
    signal = pulse(fill=0.3, last=200)
    tau_s = 0.020
    prompt = held('hsv', fidelity=fidelity).simulate(signal)
    late = held('hsv', ('tube_lag', {'time_constant_s': tau_s}), fidelity=fidelity).simulate(
        signal)
    choked = 0.3 * 2.0e-10 * 1.185 * 801_325.0          # kg/s at this low pressure
    missing = np.mean((prompt.filled_kg - late.filled_kg)[190:200])     # one PWM period
    assert missing == pytest.approx(choked * tau_s, rel=0.05)
    assert late.filled_kg[-1] == pytest.approx(prompt.filled_kg[-1], rel=1e-6)
    gained = late.air_mass_kg - late.air_mass_kg[0]
    assert np.max(np.abs(gained - late.filled_kg + late.vented_kg)) < 1e-14


@pytest.mark.parametrize('duty', [0.05, 0.12, 0.15, 0.2, 0.5, 0.95])
@pytest.mark.parametrize('rise_s, fall_s', [(0.2e-3, 0.2e-3), (1.4e-3, 1.4e-3), (2e-3, 0.4e-3)])
def test_gradual_dead_zone_of_a_switching_valve_is_the_area_under_its_lift(duty, rise_s, fall_s):
    period_s, open_s, close_s = 0.010, 1.5e-3, 0.8e-3
    t = (np.arange(40000) + 0.5) * 0.5e-6
    pulse_s = duty * period_s
    lift = np.clip((np.minimum(t, pulse_s) - open_s) / rise_s + 0.5, 0.0, 1.0)
    shut = np.maximum(t - pulse_s - close_s + 0.5 * fall_s, 0.0) / fall_s
    expected = min(np.sum(np.maximum(lift - shut, 0.0)) * 0.5e-6 / period_s, 1.0)
    found = mean_opening_with_lift(duty, period_s, open_s, close_s, rise_s, fall_s)
    # A valve that is not shut when the next pulse comes stays open.
    assert found == pytest.approx(1.0 if duty == 0.95 else expected, abs=1e-4)


@pytest.mark.parametrize('open_s', [0.0, 1.7e-3, 6e-3, 9e-3, 15e-3])
@pytest.mark.parametrize('close_s', [0.0, 2e-3, 6e-3, 9e-3, 15e-3])
def test_the_averaged_valve_opens_like_a_switching_one_that_was_shut(open_s, close_s):
    period_s = 0.010
    for duty in np.linspace(0.0, 1.0, 34):
        off_s, opened_s = 0.0, 0.0
        for period in range(20):
            on_s, off_s = pulse_edges(duty * period_s, off_s, period_s, open_s, close_s)
            if period >= 10:
                opened_s += open_time_in(0.0, period_s, on_s, off_s)
        assert mean_opening(duty, period_s, open_s, close_s) == pytest.approx(
            opened_s / (10 * period_s), abs=1e-9)


@pytest.mark.parametrize('fidelity', ['averaged', 'switching'])
def test_pulses_shorter_than_the_opening_time_let_in_no_air_however_slow_the_valve_shuts(fidelity):
    slow = held('hsv', ('valve_dead_zone', {'open_time_s': 6e-3, 'close_time_s': 6e-3}),
                fidelity=fidelity)
    assert slow.simulate(pulse(fill=0.5)).pressure_pa == pytest.approx(P_ATM_PA)


@pytest.mark.parametrize('fidelity', ['averaged', 'switching'])
def test_a_coil_that_is_always_on_opens_its_valve_whatever_time_that_takes(fidelity):
    slow = held('hsv', ('valve_dead_zone', {'open_time_s': 15e-3}), fidelity=fidelity)
    vented = slow.simulate(np.tile((0.0, 1.0), (1500, 1)), initial_pressure_pa=P_ATM_PA + 400e3)
    assert vented.pressure_pa[-1] == pytest.approx(P_ATM_PA, abs=100.0)
    for edges in ((0.0, 0.0, -10e-3), (-10e-3, 5e-3, 10e-3), (10e-3, 0.0, 10e-3)):
        assert pulse_edges(10e-3, edges[0], 10e-3, 15e-3, 0.0) == pytest.approx(edges[1:])
    assert mean_opening_with_lift(1.0, 10e-3, 15e-3, 0.0, 1e-3, 0.0) == 1.0


@pytest.mark.parametrize('fidelity', ['averaged', 'switching'])
def test_two_equal_ramps_are_the_gradual_dead_zone(fidelity):
    edges = {'open_time_s': 1.5e-3, 'close_time_s': 1.2e-3}
    signal = np.linspace(0.0, 0.6, 1000)[:, np.newaxis] * [1.0, 0.5]
    one = held('hsv', ('valve_dead_zone_gradual', {**edges, 'ramp_s': 1e-3}), fidelity=fidelity)
    two = held('hsv', ('valve_dead_zone_two_ramps', {**edges, 'rise_s': 1e-3, 'fall_s': 1e-3}),
               fidelity=fidelity)
    assert np.array_equal(one.simulate(signal).pressure_pa, two.simulate(signal).pressure_pa)


def test_a_dead_zone_states_what_its_valve_has():
    for name in ('valve_dead_zone', 'valve_dead_zone_gradual'):
        effect = effects()[name]
        assert set(effect.report(effect.values(), held('ppr'))) == {'half_width_pa'}
        assert set(effect.report(effect.values(), held('hsv'))) == {'open_time_s', 'close_time_s'}


def test_gradual_dead_zone_of_the_regulator_is_slow_near_the_set_point():
    width_pa, start = 4e3, P_ATM_PA + 300e3
    rig = held('ppr', ('valve_dead_zone_gradual', {'half_width_pa': width_pa}))
    for distance_pa in (1e3, 4e3, 40e3):
        response = rig.simulate(np.full(2, 3.0 + 1e-5 * distance_pa), initial_signal=3.0,
                                initial_pressure_pa=start)
        left = distance_pa - width_pa * distance_pa / np.hypot(width_pa, distance_pa)
        rate = (response.pressure_pa[1] - start) / 1e-3
        assert rate == pytest.approx(left / 0.060, rel=0.03)


def test_valve_hysteresis_ends_apart_by_its_width():
    rig = held('ppr', ('valve_hysteresis', {'half_width_pa': 4e3}))
    for start_v, end_pa in ((3.0, 396e3), (5.0, 404e3), (4.03, 403e3)):
        response = rig.simulate(np.full(1500, 4.0), initial_signal=start_v,
                                initial_pressure_pa=P_ATM_PA + 1e5 * start_v)
        assert response.pressure_pa[-1] - P_ATM_PA == pytest.approx(end_pa, abs=1.0)


def test_flow_limit_caps_the_rates_it_states():
    given = {'fill_rate_at_400kpa_pa_per_s': 0.5e6, 'vent_rate_at_400kpa_pa_per_s': 0.3e6}
    rig = held('ppr', ('flow_limit', given))
    for end_v, start_pa, rate in ((6.0, 100e3, 0.5e6), (0.0, 600e3, -0.3e6)):
        response = rig.simulate(np.full(9000, end_v), initial_pressure_pa=P_ATM_PA + start_pa)
        p = response.pressure_pa - P_ATM_PA
        near = np.argmin(np.abs(p - 400e3))
        assert np.gradient(p, 1e-3)[near] == pytest.approx(rate, rel=0.01)
        assert p[-1] == pytest.approx(1e5 * end_v, abs=2e3)
    only_fill = held('ppr', ('flow_limit', {**given, 'vent_rate_at_400kpa_pa_per_s': 0.0}))
    fall = only_fill.simulate(np.zeros(200), initial_pressure_pa=P_ATM_PA + 600e3)
    lag = P_ATM_PA + 600e3 * np.exp(-fall.time_s / 0.060)
    assert np.max(np.abs(fall.pressure_pa - lag)) < 1.0


def test_vent_asymmetry_slows_venting_only():
    effect = ('vent_asymmetry', {'ratio_minus_1': 0.5})
    for end_v, tau_s in ((5.0, 0.060), (3.0, 0.090)):
        response = held('ppr', effect).simulate(
            np.full(300, end_v), initial_pressure_pa=P_ATM_PA + 400e3)
        expected = P_ATM_PA + 1e5 * (end_v + (4.0 - end_v) * np.exp(-response.time_s / tau_s))
        assert np.max(np.abs(response.pressure_pa - expected)) < 1e-3
    start = {'initial_pressure_pa': P_ATM_PA + 400e3}
    fast = held('hsv').simulate(pulse(vent=0.2), **start)
    slow = held('hsv', effect).simulate(pulse(vent=0.2), **start)
    # The same path of pressure, run through in 1.5 times the time.
    assert np.max(np.abs(slow.pressure_pa[:900:3] - fast.pressure_pa[:600:2])) < 20.0
    filling = [rig.simulate(pulse(fill=0.2, last=300), **start).pressure_pa
               for rig in (held('hsv'), held('hsv', effect))]
    assert np.array_equal(*filling)


@pytest.mark.parametrize('fidelity', ['averaged', 'switching'])
def test_supply_droop_keeps_the_air(fidelity):
    volume = 2e-4
    rig = held('hsv', ('supply_droop', {'reservoir_volume_m3': volume}), fidelity=fidelity)
    response = rig.simulate(pulse(fill=0.3, last=300))
    air = response.supply_pa * volume / RT + response.air_mass_kg + response.vented_kg
    assert np.ptp(air) < 1e-9 * air[0]
    drop = response.supply_pa[0] - response.supply_pa[-1]
    assert drop == pytest.approx(RT / volume * response.filled_kg[-1], rel=1e-9)
    assert drop > 5e3
    nominal = held('hsv', fidelity=fidelity).simulate(pulse(fill=0.3, last=300))
    assert response.pressure_pa[-1] < nominal.pressure_pa[-1] - 100.0


def test_the_compressor_works_within_its_band():
    rig = held('hsv', ('supply_droop', {'reservoir_volume_m3': 2e-5, 'band_pa': 60e3}))
    response = rig.simulate(pulse(fill=0.3, vent=0.3, count=4000))
    low, high = response.supply_pa.min(), response.supply_pa.max()
    assert 740e3 - 1e3 < low - 1_325.0 < 740e3 + 10.0 and 800e3 < high < 802.5e3
    rises = np.diff(response.supply_pa) > 0.0
    assert 2 <= np.sum(np.diff(rises.astype(int)) > 0) <= 20
    used = np.gradient(response.filled_kg, 1e-3)[1000:]
    rate = np.gradient(response.supply_pa, 1e-3)[1000:]
    running = (rate > 0.0) & (np.roll(rate, 2) > 0.0) & (np.roll(rate, -2) > 0.0)
    assert np.allclose((rate * 2e-5 / RT + used)[running], 2e-4, rtol=1e-3)


@pytest.mark.parametrize('fidelity', ['averaged', 'switching'])
def test_a_line_refills_the_reservoir_the_quicker_the_lower_it_is(fidelity):
    volume, tau_s = 2e-4, 0.4
    rig = held('hsv', ('supply_droop_line', {
        'reservoir_volume_m3': volume, 'refill_time_s': tau_s}), fidelity=fidelity)
    response = rig.simulate(pulse(fill=0.3, vent=0.1, last=600, count=3000))
    t, full = response.time_s, response.supply_pa[0]
    flow = np.gradient(response.filled_kg, 1e-3)
    expected = solve_ivp(lambda now, p: (full - p) / tau_s - RT / volume * np.interp(now, t, flow),
                         (0.0, t[-1]), [full], t_eval=t, max_step=5e-4).y[0]
    fall = full - response.supply_pa
    assert fall.max() > 4e3 and fall[-1] < 0.01 * fall.max()
    assert np.max(np.abs(response.supply_pa - expected)) < 0.02 * fall.max()


@pytest.mark.parametrize('name', ['supply_droop', 'supply_droop_line'])
def test_a_reservoir_one_step_would_empty_is_refused(name):
    with pytest.raises(InputError, match=f'{name}.*at least|at least.*{name}'):
        held('hsv', (name, {'reservoir_volume_m3': 1e-7})).simulate(pulse())


def test_dead_volume_is_the_parameter_by_another_name():
    rig = load_rig('dmsp_5_300_hanging_mass', valve='hsv')
    start = {'initial_pressure_pa': P_ATM_PA + 300e3}
    effect = rig.with_(effects=[
        {'name': 'dead_volume', 'parameters': {'extra_volume_m3': 2e-6}}])
    parameter = rig.with_(parameters={'V_dead': 5e-6})
    ours, theirs = (one.simulate(duties('random', 2000), **start) for one in (effect, parameter))
    assert np.allclose(ours.outputs, theirs.outputs, rtol=1e-7, atol=1e-9)
    gained = ours.air_mass_kg - ours.air_mass_kg[0]
    assert np.max(np.abs(gained - ours.filled_kg + ours.vented_kg)) < 1e-14
    air = ours.pressure_pa * (rig.volume_m3(ours.contraction_m) + 2e-6)
    assert np.allclose(air, ours.air_mass_kg * RT, rtol=1e-9)
    step = held('hsv', ('dead_volume', {'extra_volume_m3': 2e-6})).simulate(
        pulse(fill=0.2, last=20))
    nominal = held('hsv').simulate(pulse(fill=0.2, last=20))
    ratio = (step.pressure_pa[-1] - P_ATM_PA) / (nominal.pressure_pa[-1] - P_ATM_PA)
    volume = held('hsv').volume_m3(HELD_M)
    assert ratio == pytest.approx(volume / (volume + 2e-6), rel=1e-6)


def test_thermal_limits_and_time_constant():
    volume = held('hsv').volume_m3(HELD_M)
    signal = pulse(fill=0.5, last=50, count=3000)
    start = {'initial_pressure_pa': P_ATM_PA + 100e3}
    adiabatic = held('hsv', ('thermal', {'heat_exchange_time_s': 1e3})).simulate(signal, **start)
    gained = adiabatic.air_mass_kg - adiabatic.air_mass_kg[0]
    rise = adiabatic.pressure_pa - adiabatic.pressure_pa[0]
    assert rise[50] == pytest.approx(1.4 * RT / volume * gained[50], rel=1e-3)
    real = held('hsv', ('thermal', {'heat_exchange_time_s': 0.2})).simulate(signal, **start)
    warm = real.pressure_pa * volume / real.air_mass_kg / RT - 1.0
    assert warm[50] > 0.04 and abs(warm[-1]) < 1e-4
    tau_s = 0.2 * real.air_mass_kg[-1] / 8e-5
    expected = warm[50] * np.exp(-(real.time_s[50:] - real.time_s[50]) / tau_s)
    assert np.max(np.abs(warm[50:] - expected)) < 1e-4
    quick = held('hsv', ('thermal', {'heat_exchange_time_s': 1e-6})).simulate(signal, **start)
    nominal = held('hsv').simulate(signal, **start)
    assert np.allclose(quick.pressure_pa, nominal.pressure_pa, rtol=1e-4)


@pytest.mark.parametrize('fidelity', ['averaged', 'switching'])
def test_thermal_closes_the_balances_of_mass_and_energy(fidelity):
    tau_s, gamma = 0.2, 1.4
    rig = load_rig('dmsp_5_300_hanging_mass', valve='hsv', fidelity=fidelity).with_(effects=[
        {'name': 'thermal', 'parameters': {'heat_exchange_time_s': tau_s}}])
    # The physics step of the switching valves: the middle of two samples is a mean over
    # one held opening, not over two across an edge of a pulse.
    dt_s = 1e-4
    signal = np.repeat(duties('sine', 2000), 10, axis=0)
    r = rig.simulate(signal, initial_pressure_pa=P_ATM_PA + 350e3, dt_s=dt_s)
    gained = r.air_mass_kg - r.air_mass_kg[0]
    assert np.max(np.abs(gained - r.filled_kg + r.vented_kg)) < 1e-14
    volume = rig.volume_m3(r.contraction_m)
    rt = r.pressure_pa * volume / r.air_mass_kg
    assert rt.max() > 1.01 * RT and rt.min() < 0.99 * RT

    def middle(signal):
        return 0.5 * (signal[1:] + signal[:-1])
    enthalpy = gamma * (RT * np.diff(r.filled_kg) - middle(rt) * np.diff(r.vented_kg))
    work = (gamma - 1.0) * middle(r.pressure_pa) * np.diff(volume)
    heat = 8e-5 / tau_s * (RT - middle(rt)) * dt_s
    energy = r.pressure_pa * volume                        # times 1 / (gamma - 1)
    left = np.diff(energy) - enthalpy + work - heat
    turned_over = np.sum(np.abs(enthalpy)) + np.sum(np.abs(work))
    assert abs(np.sum(left)) < 1e-7 * turned_over


@pytest.mark.parametrize('delay_s, vent_later_s, edges_s', [
    (0.08, 0.08, (0.04, 0.12)), (0.08, -0.08, (0.12, 0.04)), (0.0604, 0.0, (0.0604, 0.0604)),
    (0.0302, 0.0103, (0.02505, 0.03535)), (0.01, 0.05, (0.0, 0.035))])
def test_each_edge_of_a_command_is_late_by_the_delay_of_its_direction(
        delay_s, vent_later_s, edges_s):
    at = np.arange(3000) * 1e-3
    start = {'initial_pressure_pa': P_ATM_PA + 300e3}
    rig = held('ppr', ('valve_dead_time_by_direction', {
        'delay_s': delay_s, 'vent_later_s': vent_later_s}))
    report = effects()['valve_dead_time_by_direction'].report(
        rig.effect('valve_dead_time_by_direction').parameters, rig)
    for first, then, edge_s, name in ((3.0, 5.0, edges_s[0], 'fill_delay_s'),
                                      (5.0, 3.0, edges_s[1], 'vent_delay_s')):
        start['initial_pressure_pa'] = P_ATM_PA + 100e3 * first
        response = rig.simulate(np.where(at < 0.5, first, then), **start)
        since = np.maximum(response.time_s - 0.5 - edge_s, 0.0)
        expected = P_ATM_PA + 1e5 * (then + (first - then) * np.exp(-since / 0.060))
        assert np.max(np.abs(response.pressure_pa - expected)) < 1000.0      # of one step
        assert report[name][0] == pytest.approx(edge_s)


def test_equal_delays_are_the_plain_dead_time_to_the_bit():
    signal = 3.0 + np.random.default_rng(5).uniform(-2.0, 2.0, 60).repeat(20)
    both = [held('ppr', (name, values)).simulate(signal).outputs for name, values in (
        ('valve_dead_time', {'delay_s': 0.0374}),
        ('valve_dead_time_by_direction', {'delay_s': 0.0374, 'vent_later_s': 0.0}))]
    assert np.array_equal(*both)


@pytest.mark.parametrize('vent_later_s, length_s', [(-0.040, 0.0), (0.040, 0.070)])
def test_a_short_pulse_is_swallowed_or_held_by_the_difference_of_the_delays(
        vent_later_s, length_s):
    signal = np.where(np.abs(np.arange(1000) - 514.5) < 15.0, 5.0, 3.0)       # 30 ms
    response = held('ppr', ('valve_dead_time_by_direction', {
        'delay_s': 0.05, 'vent_later_s': vent_later_s}), T_m=0.001).simulate(
            signal, initial_pressure_pa=P_ATM_PA + 300e3)
    above = np.sum(response.pressure_pa > P_ATM_PA + 400e3) * 1e-3
    assert above == pytest.approx(length_s, abs=1e-9)


def test_a_dead_time_by_direction_beyond_its_memory_is_refused():
    rig = held('ppr', ('valve_dead_time_by_direction', {'delay_s': 0.4, 'vent_later_s': 0.4}))
    with pytest.raises(InputError, match='make a delay of 0.2 s; .* at most 0.1022 s'):
        rig.simulate(np.full(10, 4.0), dt_s=1e-4)


def test_the_vent_closes_above_the_set_point_and_bleeds():
    closing, rate = 18e3, 9e3
    rig = held('ppr', ('vent_bleed', {
        'closing_pressure_pa': closing, 'bleed_rate_pa_per_s': rate}))
    down = rig.simulate(np.full(4000, 2.0), initial_pressure_pa=P_ATM_PA + 400e3)
    above, t = down.pressure_pa - P_ATM_PA - 200e3, down.time_s
    # The lag towards the closing pressure, less what is bled within its time constant.
    aim = closing - 0.060 * rate
    closed = 0.060 * np.log((200e3 - aim) / (closing - aim))
    expected = np.where(t < closed, aim + (200e3 - aim) * np.exp(-t / 0.060),
                        closing - rate * (t - closed))
    bleeding = t < closed + (closing - 0.060 * rate) / rate
    assert np.max(np.abs(above - expected)[bleeding]) < 20.0
    assert 0.0 <= above[-1] < 5.0
    up = [r.simulate(np.full(400, 4.0), initial_pressure_pa=P_ATM_PA + 200e3).pressure_pa
          for r in (rig, held('ppr'))]
    assert np.array_equal(*up)


def test_both_valves_close_before_the_set_point_each_by_its_own_distance():
    vent = {'closing_pressure_pa': 18e3, 'bleed_rate_pa_per_s': 9e3}
    both = held('ppr', ('vent_bleed_fill_creep', {
        **vent, 'fill_closing_pressure_pa': 8e3, 'creep_rate_pa_per_s': 4e3}))
    mirrored = held('ppr', ('vent_bleed', {
        'closing_pressure_pa': 8e3, 'bleed_rate_pa_per_s': 4e3}))
    up = both.simulate(np.full(3000, 4.0), initial_pressure_pa=P_ATM_PA + 200e3).pressure_pa
    down = mirrored.simulate(np.full(3000, 2.0), initial_pressure_pa=P_ATM_PA + 400e3).pressure_pa
    assert np.allclose(up + down, 2.0 * P_ATM_PA + 600e3, rtol=0.0, atol=1e-4)
    falling = [rig.simulate(np.full(3000, 2.0), initial_pressure_pa=P_ATM_PA + 400e3).pressure_pa
               for rig in (both, held('ppr', ('vent_bleed', vent)))]
    assert np.allclose(*falling, rtol=0.0, atol=1e-4)
    assert up[600] - P_ATM_PA == pytest.approx(393e3, abs=1.5e3)


def test_a_bleed_quicker_than_the_lag_is_the_lag():
    quick = held('ppr', ('vent_bleed', {
        'closing_pressure_pa': 20e3, 'bleed_rate_pa_per_s': 1e7}))
    down = [r.simulate(np.full(400, 2.0), initial_pressure_pa=P_ATM_PA + 400e3).pressure_pa
            for r in (quick, held('ppr'))]
    assert np.max(np.abs(down[0] - down[1])) < 1e-3


@pytest.mark.parametrize('lag_s', [0.002, 0.015, 0.15])
@pytest.mark.parametrize('time_constant_s, tolerance_pa', [(0.010, 250.0), (0.060, 10.0)])
def test_a_regulator_that_overshoots_is_a_lag_of_second_order(
        lag_s, time_constant_s, tolerance_pa):
    """The independent solution is scipy's; overdamped, critically damped and swinging."""
    rig = held('ppr', ('regulator_overshoot', {'inner_lag_s': lag_s}), T_m=time_constant_s)
    response = rig.simulate(np.full(600, 4.0), initial_pressure_pa=P_ATM_PA + 200e3)
    solved = solve_ivp(
        lambda t, y: [y[1], ((400e3 - y[0]) / time_constant_s - y[1]) / lag_s], (0.0, 0.7),
        [200e3, 0.0], dense_output=True, rtol=1e-9, atol=1e-3)
    expected = P_ATM_PA + solved.sol(response.time_s)[0]
    assert np.max(np.abs(response.pressure_pa - expected)) < tolerance_pa
    overshoots = lag_s > time_constant_s / 4.0
    assert (np.max(expected) > P_ATM_PA + 400.01e3) == overshoots


def test_a_valve_without_a_lag_is_the_regulator_of_first_order():
    rigs = held('ppr', ('regulator_overshoot', {'inner_lag_s': 0.0})), held('ppr')
    signal = profile('step', 1000) / 100.0
    ours, plain = (rig.simulate(signal).pressure_pa for rig in rigs)
    assert np.max(np.abs(ours - plain)) < 1e-6


def test_the_valve_of_a_regulator_is_never_asked_for_more_than_flows():
    """So a long way up ends with no more overshoot than the limit of the rate allows."""
    limit = {'fill_rate_at_400kpa_pa_per_s': 5e5, 'vent_rate_at_400kpa_pa_per_s': 5e5}
    rig = held('ppr', ('regulator_overshoot', {'inner_lag_s': 0.04}), ('flow_limit', limit),
               T_m=0.02)
    p = rig.simulate(np.full(3000, 5.0), initial_pressure_pa=P_ATM_PA + 100e3).pressure_pa
    rates = np.diff(p) / 1e-3
    fastest = np.max(np.diff(held('ppr', ('flow_limit', limit), T_m=0.02).simulate(
        np.full(3000, 5.0), initial_pressure_pa=P_ATM_PA + 100e3).pressure_pa)) / 1e-3
    assert np.max(rates) <= fastest
    assert 1e3 < np.max(p) - P_ATM_PA - 500e3 < 0.04 * fastest


@pytest.mark.parametrize('name', [
    'flow_limit', 'valve_hysteresis', 'vent_bleed', 'vent_bleed_fill_creep',
    'valve_dead_time_by_direction', 'regulator_overshoot'])
def test_effects_of_the_regulator_leave_the_switching_valves_alone(name):
    signal = duties('random', 300)
    ours = held('hsv', (name, {})).simulate(signal)
    assert np.array_equal(ours.outputs, held('hsv').simulate(signal).outputs)


@pytest.mark.parametrize('name', ['supply_droop', 'dead_volume', 'thermal'])
def test_effects_of_the_switching_valves_leave_the_regulator_alone(name):
    signal = np.full(300, 4.0)
    ours = held('ppr', (name, {})).simulate(signal)
    assert np.array_equal(ours.outputs, held('ppr').simulate(signal).outputs)

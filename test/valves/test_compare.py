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

"""The comparison: its numbers obey the physics they are measured from."""

import copy
import json
import math
from pathlib import Path

import numpy as np
from pam_actuation.cli.main import main
from pam_actuation.models.markdown import row
from pam_actuation.report.valves import as_text
from pam_actuation.valves import measure
from pam_actuation.valves.chain import Bench
from pam_actuation.valves.compare import CHAINS, compare
from pam_actuation.valves.energy import power_values, supplied_kg
from pam_actuation.valves.table42 import number_rows, NUMBERS, statements
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.units import GAS_CONSTANT_AIR, P_ATM_PA, TEMPERATURE_K
import pytest

LAG_S = 0.060
PAGE = Path(__file__).resolve().parents[2] / 'docs' / 'explanation' / 'valves.md'


def bench(name, rig='dmsp_5_300_hanging_mass', effects=None):
    valve, fidelity = CHAINS[name]
    rig = load_rig(rig, valve=valve, fidelity=fidelity)
    return Bench(rig if effects is None else rig.with_(effects=effects))


@pytest.fixture(scope='module')
def result():
    return compare(load_rig('dmsp_5_300_realistic'), hold_s=2.0)


@pytest.mark.parametrize('name', CHAINS)
def test_a_chain_is_the_simulated_rig_to_the_bit(name):
    chosen = bench(name, 'dmsp_5_300_realistic')
    chain = chosen.chain(200e3)
    first = chain.follow(np.repeat([200e3, 350e3], (153, 150)))
    then = chain.impose((0.0,) if name == 'ppr' else (0.0, 1.0), 0.1)
    signal = np.concatenate([first.signal, then.signal])
    alone = chosen.rig.simulate(signal, initial_pressure_pa=P_ATM_PA + 200e3)
    assert np.array_equal(alone.pressure_pa[:len(first)], first.pressure_pa)
    assert np.array_equal(alone.pressure_pa[len(first) - 1:], then.pressure_pa)
    assert np.array_equal(alone.contraction_m[len(first) - 1:], then.contraction_m)


def test_the_regulator_answers_with_its_time_constant():
    chosen = bench('ppr')
    for step in measure.measure_steps(chosen):
        assert step['rise_s'] == pytest.approx(LAG_S * math.log(9.0), rel=1e-3)
        wanted = LAG_S * math.log(min(50.0, abs(step['to_pa'] - step['from_pa']) / 2e3))
        assert step['settling_s'] == pytest.approx(wanted, abs=2e-3)
        assert step['overshoot'] == 0.0
    found = measure.measure_bandwidth(chosen)
    assert found['bandwidth_hz'] == pytest.approx(1.0 / (2.0 * math.pi * LAG_S), rel=0.03)
    off = measure.measure_power_loss(chosen)['off']
    assert off['to_ten_percent_s'] == pytest.approx(LAG_S * math.log(10.0), abs=2e-3)
    assert off['gauge_after_pa'] < 1.0


def test_air_of_a_fill_is_the_mass_balance():
    rig = load_rig('dmsp_5_300_isometric')
    record = Bench(rig).chain(100e3).follow(np.full(1500, 500e3))
    volume = float(rig.volume_m3(0.0))
    wanted = 400e3 * volume / (GAS_CONSTANT_AIR * TEMPERATURE_K)
    assert supplied_kg(record, rig)[-1] == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize('name', ['hsv averaged', 'hsv switching'])
def test_air_through_the_valves_is_the_mass_balance(name):
    chosen = bench(name)
    record = chosen.chain(100e3).follow(np.repeat([500e3, 100e3], 1000))
    stored = record.air_mass_kg - record.air_mass_kg[0]
    through = record.filled_kg - record.vented_kg
    assert np.max(np.abs(through - through[0] - stored)) < 1e-6 * np.ptp(record.air_mass_kg)
    used = supplied_kg(record, chosen.rig)
    assert used[-1] >= stored.max() * (1.0 - 1e-9) and np.all(np.diff(used) >= 0.0)


@pytest.mark.parametrize('name', ['hsv averaged', 'hsv switching'])
def test_a_tight_muscle_is_held_by_shut_valves(name):
    held = measure.measure_hold(bench(name), 3.0, power_values())
    assert held['shut_share'] == 1.0 and held['pulses_per_s'] == 0.0      # duties exactly 0
    assert held['air_kg'] == 0.0 and held['power_w'] == 0.0
    assert held['error_max_pa'] < 2e3
    loss = measure.measure_power_loss(bench(name))
    assert loss['off']['to_ten_percent_s'] is None
    assert loss['off']['gauge_after_pa'] == pytest.approx(measure.HOLD_PA, abs=2e3)
    assert 0.1 < loss['vented']['to_ten_percent_s'] < 2.0


def slit_flow(gauge_pa):
    return (gauge_pa + P_ATM_PA) ** 2 - P_ATM_PA**2


def test_holding_a_leak_costs_the_leak():
    effects = [measure.LEAK]
    leak = bench('ppr', effects=effects).rig
    rate = 2.0e-13 * 1.185 * (measure.HOLD_PA + P_ATM_PA)                # choked: C rho0 p
    held = measure.measure_hold(bench('ppr', effects=effects), 5.0, power_values())
    assert leak.effect('leakage').parameters['conductance_m3_per_s_pa'] == 2.0e-13
    assert held['air_kg'] == pytest.approx(5.0 * rate, rel=1e-3)
    assert held['power_w'] == power_values()['ppr_power_w'] and held['signal_mean'] > 3.9
    # A slit that loses as much at this pressure costs as much.
    slit = [{'name': 'leakage_slit', 'parameters': {
        'conductance_m3_per_s_pa': 0.0,
        'slit_flow_at_400kpa_kg_per_s': rate * slit_flow(400e3) / slit_flow(measure.HOLD_PA)}}]
    through = measure.measure_hold(bench('ppr', effects=slit), 5.0, power_values())
    assert through['air_kg'] == pytest.approx(held['air_kg'], rel=1e-2)
    # The pair tops up: what it fills is what leaks and what it vents, less what is missing.
    held = measure.measure_hold(bench('hsv averaged', effects=effects), 20.0, power_values())
    assert held['air_kg'] > 15.0 * rate and held['pulses_per_s'] > 0.0
    assert 0.0 < held['power_w'] < 1.0 and held['ripple_rms_pa'] > 10.0


def test_the_regulator_is_linear_and_the_pair_is_not(result):
    ppr, hsv = result['valves']['ppr']['flow'], result['valves']['hsv averaged']['flow']
    assert ppr['ratio'] == pytest.approx(1.0, abs=1e-6)
    # Venting is choked: the rate grows with the absolute pressure, less what the volume takes.
    vent = np.abs(hsv['vent'])
    assert vent[0] < vent[1] < vent[2] and hsv['fill'][0] > hsv['fill'][2]


@pytest.mark.parametrize('numbers, levels', [
    ({'ppr_lowest_v': 1.0, 'ppr_highest_v': 5.0, 'K_m': 150e3}, 3),
    ({'ppr_zero_pa': 5e3, 'K_m': 99e3}, 3), ({'ppr_zero_pa': 100e3}, 2)])
def test_a_zero_of_the_regulator_is_no_change_of_its_gain(numbers, levels):
    rig = load_rig('dmsp_5_300_hanging_mass').with_(parameters=numbers)
    flow = measure.measure_flow(rig)
    assert flow['fill'] == pytest.approx([rig.parameters['K_m']] * levels)
    assert flow['at_gauge_pa'] == [100e3, 300e3, 500e3][-levels:]


def test_the_switching_pair_ripples_more_than_its_mean(result):
    valves = result['valves']
    ripples = [valves[name]['accuracy']['ripple_moving_rms_pa'] for name in CHAINS]
    assert ripples[0] < ripples[1] < ripples[2]
    averaged, switching = (valves[name] for name in list(CHAINS)[1:])
    assert switching['cycle']['air_kg'] == pytest.approx(averaged['cycle']['air_kg'], rel=0.03)
    for name in CHAINS:
        assert valves[name]['cycle']['air_kg'] >= valves[name]['cycle']['needed_kg']


def test_statements_follow_the_numbers(result):
    found = {item['statement']: item for item in statements(result)}
    assert len(found) == 14
    for name in ('Linear flow', 'Easy to control', 'Pressure falls to zero if power loss',
                 'Constant control signal required',
                 'Valve can be shut after set point is reached'):
        assert found[name]['verdict'] == 'supported', name
    for name in ('Quiet', 'Noisy', 'Electromagnetic noise from switching'):
        assert found[name]['verdict'] == 'indirect', name
    worse = copy.deepcopy(result)
    ppr, hsv = worse['valves']['ppr'], worse['valves']['hsv switching']
    ppr['accuracy']['steady_error_max_pa'] = 30e3
    ppr['power_loss']['off']['gauge_after_pa'] = 100e3
    ppr['flow']['ratio'] = 2.0
    ppr['accuracy']['ripple_moving_rms_pa'] = 1e5
    hsv['hold']['shut_share'] = 0.5
    turned = {item['statement'] for item in statements(worse)
              if item['verdict'] == 'not supported'}
    assert turned == {'Linear flow', 'Easy to control', 'Quiet', 'Noisy',
                      'Pressure falls to zero if power loss',
                      'Valve can be shut after set point is reached'}


def test_a_regulator_that_sticks_is_no_longer_exact(result):
    sticky = bench('ppr', effects=[{'name': 'valve_dead_zone',
                                    'parameters': {'half_width_pa': 5e3}}])
    found, _ = measure.measure_accuracy(sticky)
    assert found['steady_error_max_pa'] == pytest.approx(5e3, rel=0.02)
    assert found['up_down_difference_pa'] == pytest.approx(10e3, rel=0.02)


def test_numbers_are_plain_and_shown(result):
    assert json.loads(json.dumps(result, allow_nan=False)) == result
    shown = as_text(result)
    for label, *_ in number_rows(result):
        assert label in shown
    tame = copy.deepcopy(result)
    tame['valves']['ppr']['small_sines']['bandwidth_hz'] = None
    assert '> 16' in as_text(tame) and '> 16' not in shown
    assert 'design values' in shown and 'as given by the chapter' in shown


def test_the_page_on_valves_has_the_numbers_of_today(result):
    page = PAGE.read_text(encoding='utf-8')
    # The holds of the page last 60 s, those here 2 s.
    held = {label for label, *_, part, _ in NUMBERS if part.startswith('hold')}
    missing = [row(cells) for cells in number_rows(result)
               if cells[0] not in held and row(cells) not in page]
    assert missing == [], 'run: python docs/generate/figures.py valves'


def test_what_cannot_be_compared_is_refused():
    with pytest.raises(InputError, match='needs a recorded contraction'):
        compare(load_rig('dmsp_5_300_driven'))
    with pytest.raises(InputError, match='allowed 2 to 3600 s'):
        compare(load_rig('dmsp_5_300_realistic'), hold_s=0.0)
    with pytest.raises(InputError, match='`pwm_period_s` is 2.5 ms'):
        compare(load_rig('dmsp_5_300_realistic').with_(parameters={'pwm_period_s': 0.0025}))


def test_the_verb_writes_and_repeats(tmp_path, capsys, result):
    arguments = ['valves', 'compare', '--hold', '2', '--json', '--html', str(tmp_path / 'v.html')]
    assert main(arguments) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown.pop('statements') == statements(result)
    assert shown == result                                              # same seed, same numbers
    content = (tmp_path / 'v.html').read_text()
    assert 'Valve can be shut after set point is reached' in content
    assert main(['valves', 'compare', '--power', 'ppr_power_w=x']) == 2
    assert 'NAME=NUMBER' in capsys.readouterr().err

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

"""``pam rig new`` states data of on/off valves, as parameters of effects."""

import re

from pam_actuation.cli.main import main
from pam_actuation.drivers.for_rig import driver_config
from pam_sim import load_rig
import pytest


def new(*options):
    """Write a rig with options; return it."""
    assert main(['rig', 'new', '--out', 'made.yaml', *options]) == 0
    return load_rig('made.yaml')


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_data_of_valves_are_stated_as_parameters_of_effects(capsys):
    rig = new('--valve', 'hsv', '--known', 'valve_dead_zone.open_time_s=0.0035',
              'valve_dead_zone.close_time_s=0.0025', 'vent_asymmetry.ratio_minus_1=-0.25',
              '--about', 'valve_dead_time.delay_s=0.018±10%', '--known',
              'leakage.conductance_m3_per_s_pa=1e-13', 'supply_droop.reservoir_volume_m3=0.003')
    assert {one.name: one.parameters for one in rig.effects} == {
        'valve_dead_zone': {'half_width_pa': 0.0, 'open_time_s': 0.0035, 'close_time_s': 0.0025},
        'valve_dead_time': {'delay_s': 0.018}, 'vent_asymmetry': {'ratio_minus_1': -0.25},
        'leakage': {'conductance_m3_per_s_pa': 1e-13},
        'supply_droop': {'reservoir_volume_m3': 0.003, 'band_pa': 1e5,
                         'compressor_flow_kg_per_s': 2e-4}}
    assert '  # Venting is quicker than filling.' in open('made.yaml', encoding='utf-8').read()
    assert rig.effect('valve_dead_time').source == {'sd': {'delay_s': 0.0018}}
    driver = driver_config(rig).hsv
    assert (driver.open_time_s, driver.close_time_s) == (0.0035, 0.0025)
    assert 'are not stated' not in capsys.readouterr().out


@pytest.mark.parametrize('stated', [(), ('--known', 'leakage.conductance_m3_per_s_pa=1e-13')])
def test_a_new_file_for_a_pair_of_valves_names_the_data_it_lacks(stated, capsys):
    rig = new('--valve', 'hsv', *stated)
    assert len(rig.effects) == len(stated) // 2
    assert 'opening and closing times of the valves are not stated' in capsys.readouterr().out
    assert main(['rig', 'check', 'made.yaml']) == 0
    assert 'opening and closing times of the valves are not stated' in capsys.readouterr().out
    text = open('made.yaml', encoding='utf-8').read()
    # Without the comment signs, the effects are there with their nominal numbers.
    text = re.sub(r'^# (effects:)$', r'\1', text, flags=re.M)
    text = re.sub(r'^  # (- name: |  parameters:|    \w+: )', r'  \1', text, flags=re.M)
    open('all.yaml', 'w', encoding='utf-8').write(text)
    wanted = ['valve_dead_zone', 'valve_dead_time', 'vent_asymmetry', 'supply_droop']
    assert load_rig('all.yaml').effects == rig.with_(
        effects=[*wanted, *rig.effects]).effects


def test_a_period_of_pulses_that_the_driver_does_not_take_is_told(capsys):
    rig = new('--valve', 'hsv', '--known', 'pwm_period_s=0.02')
    told = '`pwm_period_s` is 0.02 s; the valve driver takes 0.002 to 0.01 s'
    assert told in capsys.readouterr().out
    assert main(['rig', 'check', 'made.yaml']) == 0
    assert f'remark: rig made: {told}' in capsys.readouterr().out
    # The same sentence, not a name that nobody wrote.
    assert main(['simulate', 'short_sine', '--rig', 'made.yaml', '--out', 'bag']) == 2
    said = capsys.readouterr().err
    assert told in said and 'hsv.period_s' not in said
    # Behind a regulator it does not matter.
    assert driver_config(rig.with_(valve='ppr')).hsv.period_s == 0.01
    new('--valve', 'hsv', '--known', 'pwm_period_s=0.004', '--overwrite')
    assert 'the valve driver takes' not in capsys.readouterr().out


def test_a_period_of_pulses_too_short_for_the_valves_is_told(capsys):
    """Every pulse was swallowed up to an opening of 65 %, then the valve stayed open."""
    switching = ('valve_dead_zone.open_time_s=0.0035', 'valve_dead_zone.close_time_s=0.0025')
    rig = new('--valve', 'hsv', '--known', 'pwm_period_s=0.005', *switching)
    told = ('`pwm_period_s` is 0.005 s, in which valves that open in 0.0035 s and shut '
            'in 0.0025 s, with a margin of 0.0001 s, give no short pulse; allowed are above '
            '0.0061 to 0.01 s: state a longer period')
    assert f'{told}. So pam simulate' in capsys.readouterr().out
    assert main(['simulate', 'short_sine', '--rig', 'made.yaml', '--out', 'bag']) == 2
    assert f'rig made: {told}' in capsys.readouterr().err
    assert driver_config(rig.with_(valve='ppr')).hsv.period_s == 0.005
    new('--valve', 'hsv', '--known', 'pwm_period_s=0.0065', *switching, '--overwrite')
    assert 'no short pulse' not in capsys.readouterr().out


def test_the_gain_of_a_regulator_whose_pressures_nobody_stated_is_not_known(capsys):
    rig = new('--regulator-volts', '0:10')
    assert (rig.parameters['K_m'], rig.tolerance['K_m']) == (60e3, 0.5)
    assert 'pressures not stated' in open('made.yaml', encoding='utf-8').read()
    assert 'K_m: 60000 ± 30000 Pa/V' in capsys.readouterr().out
    for options in (['--regulator-volts', '0:10', '--regulator-kpa', '0:600'],
                    ['--regulator', 'smc_itv1050', '--regulator-volts', '0:10'],
                    ['--regulator-kpa', '0:600'], []):
        rig = new(*options, '--overwrite')
        assert rig.prior_sd('K_m') == pytest.approx(0.02 * rig.parameters['K_m'])


def test_a_mass_that_nobody_stated_is_told(capsys):
    said = 'Nobody stated `mass_kg`, so the 5 kg of the nominal rig count as known to 2 %'
    for options, is_told in (([], True), (['--known', 'mass_kg=5'], False),
                             (['--about', 'mass_kg=5±1'], False),
                             (['--unknown', 'mass_kg'], False),
                             (['--load', 'isometric'], False)):
        new(*options, '--overwrite')
        assert (said in capsys.readouterr().out) == is_told, options

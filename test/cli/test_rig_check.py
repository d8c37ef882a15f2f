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

"""``pam rig check``: what a file of a rig or of a joint states."""

import json

from pam_actuation.cli.main import main
import pytest


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_check_tells_what_is_unknown_and_how_well_the_rest_is_known(capsys):
    assert main(['rig', 'new', '--out', 'made.yaml', '--unknown', 'mass_kg', '--about',
                 'pressure_zero_pa=0±500']) == 0
    capsys.readouterr()
    assert main(['rig', 'check', 'made.yaml', '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert told['unknown'] == ['mass_kg']
    assert {'name': 'pressure_zero_pa', 'unit': 'Pa', 'value': 0.0, 'sd': 500.0} in told['about']
    assert main(['rig', 'check', 'made.yaml']) == 0
    printed = capsys.readouterr().out
    assert 'mass_kg: unknown, 0.1 to 500 kg' in printed
    assert 'force_map_gain: 1 ± 0.15\n' in printed and '± 2000 Pa/V\n' in printed
    assert main(['rig', 'check']) == 2 and main(['rig', 'check', 'none.yaml']) == 2


def test_check_shows_effects_and_sensors_with_their_numbers(folder, capsys):
    (folder / 'pair.yaml').write_text(
        'muscle: dmsp_20_300\nload: hanging_mass\nvalve: hsv\neffects:\n'
        '  - {name: valve_dead_zone, parameters: {open_time_s: 0.0017, close_time_s: 0.002}}\n'
        '  - {name: vent_asymmetry, parameters: {ratio_minus_1: -0.25}}\n'
        'sensors: {pressure_noise_pa: 300.0}\n')
    assert main(['rig', 'check', 'pair.yaml']) == 0
    printed = capsys.readouterr().out
    assert 'open_time_s 0.0017 s, close_time_s 0.002 s' in printed
    assert '  effect vent_asymmetry: ratio_minus_1 -0.25\n' in printed
    assert '  sensors: pressure_noise_pa 300 Pa\n' in printed
    assert main(['rig', 'check', 'pair.yaml', '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert told['effects']['valve_dead_zone']['close_time_s'] == 0.002
    assert told['sensors'] == {'pressure_noise_pa': 300.0}


def test_check_takes_the_file_of_a_joint(folder, capsys):
    (folder / 'knee.yaml').write_text(
        'joint: joint_dmsp_5_300\nparameters: {limb_mass_kg: 0.2}\n'
        'flexor: {rig: dmsp_5_300_driven, effects: [{name: creep}]}\n')
    assert main(['rig', 'check', 'knee.yaml']) == 0
    printed = capsys.readouterr().out.splitlines()
    assert 'joint that moves from -57.3 to 57.3 degrees' in printed
    assert '  limb_mass_kg: 0.2 kg' in printed
    for side in ('flexor', 'extensor'):
        assert f'{side}: muscle of 5 mm by 300 mm, load driven, valve ppr' in printed
    assert len([line for line in printed if line.startswith('  effect creep: ')]) == 1
    assert main(['rig', 'check', 'knee.yaml', '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert told['load'] == 'antagonistic_joint' and told['range_rad'] == [-1.0, 1.0]
    assert {'name': 'limb_mass_kg', 'unit': 'kg', 'value': 0.2} in told['numbers']
    assert 'creep' in told['muscles']['flexor']['effects'] and not (
        told['muscles']['extensor']['effects'])
    (folder / 'wrong.yaml').write_text('joint: joint_dmsp_5_300\nparameters: {limb_mass: 0.2}\n')
    assert main(['rig', 'check', 'wrong.yaml']) == 2
    assert 'wrong.yaml:2' in capsys.readouterr().err


def test_check_shows_what_is_exact_and_the_supply_as_gauge_too(folder, capsys):
    (folder / 'slip.yaml').write_text(
        'muscle: dmsp_10_250\nload: hanging_mass\nvalve: hsv\nparameters: {mass_kg: 4.0, '
        'spring_n_per_m: 0.8, supply_pa: 600000.0}\ntolerance: {mass_kg: 0.0}\n')
    assert main(['rig', 'check', 'slip.yaml']) == 0
    printed = capsys.readouterr().out
    assert 'muscle of 10 mm by 250 mm, load hanging_mass, valve hsv\n' in printed
    assert '  mass_kg: 4 kg, exact\n' in printed and 'spring_n_per_m: 0.8 N/m, exact' in printed
    assert 'supply_pa: 600000 ± 3000 Pa absolute (498.7 kPa gauge)\n' in printed
    assert main(['rig', 'check', 'slip.yaml', '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert {'name': 'mass_kg', 'unit': 'kg', 'value': 4.0} in told['exact']
    assert told['muscle'] == {'bore_m': 0.01, 'length_m': 0.25}
    (folder / 'zero.yaml').write_text(
        'rig: dmsp_5_300_hanging_mass\ntolerance: {pressure_zero_pa: 0.05, mass_kg: 0.05}\n')
    assert main(['rig', 'check', 'zero.yaml']) == 0
    printed = capsys.readouterr().out
    assert '`pressure_zero_pa` is 0, and a tolerance of 0.05 is relative' in printed
    assert '`mass_kg`' not in printed

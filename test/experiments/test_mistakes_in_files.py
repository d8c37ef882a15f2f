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

"""Mistakes in files: the sentence says which unit, which point and which key is meant."""

from pam_actuation.control.config import load_controller
from pam_actuation.drivers.config import DriverConfig
from pam_actuation.experiments import load_experiment
from pam_actuation.hardware.files import hardware_file
from pam_actuation.resources import config_dir, list_config
from pam_actuation.rigging.layouts import rig as rig_layout
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.located_yaml import load_yaml
from pam_sim.units import allowed_range
import pytest

NOMINAL = 'rig: dmsp_5_300_hanging_mass\n'


def said(call, *arguments, **options):
    with pytest.raises(InputError) as found:
        call(*arguments, **options)
    text = str(found.value)
    assert '\n' not in text
    return text


@pytest.mark.parametrize('text, words', [
    (f'{NOMINAL}parameters: {{mass_kg: 3,5}}\n', ('2: `mass_kg: 3,5`', 'decimal point: 3.5')),
    (f'{NOMINAL}parameters: {{mass_kg: 0,05, K_m: 1}}\n', ('decimal point: 0.05',)),
    (f'{NOMINAL}parameters: {{mass_kg: -3,05}}\n', ('decimal point: -3.05',)),
    (f'{NOMINAL}parameters:\n  mass_kg: 3,5\n', ('3: `3,5`', 'decimal point', '3.5')),
    (f'{NOMINAL}parameters:\n  mass_kg: 1,000\n', ('no separators',))])
def test_a_decimal_comma_is_told_as_one(text, words):
    found = said(load_rig, text)
    assert all(word in found for word in words) and 'unknown' not in found, found


def test_commas_that_separate_are_left_alone():
    tree = load_yaml('a: [3,5]\nb: {c: 3, 5: }\nd: "3,5"\ne: 3,5 bar\n', 'x')
    assert list(tree['a']) == [3, 5] and tree['d'] == '3,5' and tree['e'] == '3,5 bar'


def test_a_comma_in_experiments_and_controllers_too():
    text = 'name: x\nsegments:\n  - hold: {duration_s: 0,5}\n'
    assert '`duration_s: 0,5` has a decimal comma' in said(load_experiment, text)
    text = 'controller: pid\nsettings: {lead_s: 0,1}\n'
    assert '`lead_s: 0,1` has a decimal comma' in said(load_controller, text)


@pytest.mark.parametrize('segment, words', [
    ('ramp: {to_pa: 350, duration_s: 1.0}', 'ramp reaches 350 Pa after 1 s; allowed'),
    ('ramp: {to_pa: 2.0e+9, duration_s: 1.0}', 'ramp reaches 2e+09 Pa after 1 s; allowed'),
    ('hold: {duration_s: .nan}', 'duration_s')])
def test_a_value_out_of_range_is_the_one_that_was_written(segment, words):
    assert words in said(load_experiment, f'name: x\ndomain: pressure\nsegments:\n  - {segment}\n')


@pytest.mark.parametrize('text, words', [
    ('muscle: dmsp_5_300\nvalve: ppr\n', ('`load` is missing beside `muscle`', 'isometric')),
    ('valve: ppr\nload: hanging_mass\n', ('2: `muscle` is missing beside `load`', 'dmsp_10_250')),
    ('valve: ppr\n', ('`rig` is missing', 'dmsp_5_300_hanging_mass'))])
def test_what_is_missing_of_a_model_is_named(text, words):
    found = said(load_rig, text)
    assert all(word in found for word in words), found


def test_ranges_say_the_unit_and_gauge_pressure():
    assert allowed_range(0.1, 500, 'kg') == '0.1 to 500 kg'
    assert allowed_range(0, 1, '-') == allowed_range(0, 1, name='share') == '0 to 1'
    assert allowed_range(0.01, 10, name='command_timeout_s') == '0.01 to 10 s'
    assert allowed_range(101325, 701325, 'Pa') == (
        '101325 to 701325 Pa absolute (0 to 600 kPa gauge)')
    assert allowed_range(1e3, 1e5, name='max_pressure_gauge_pa') == (
        '1000 to 100000 Pa gauge (1 to 100 kPa gauge)')
    assert allowed_range(0, 1e5, 'Pa') == '0 to 100000 Pa'      # the size of a noise, say


def test_pressures_out_of_range_say_what_to_write(tmp_path):
    text = 'name: x\ndomain: pressure\nsegments:\n  - step: {to_pa: 400, duration_s: 1}\n'
    found = said(load_experiment, text)
    assert '400 Pa' in found and 'Pa absolute (0 to 1199 kPa gauge)' in found
    found = said(load_rig, f'{NOMINAL}parameters: {{supply_pa: 700}}\n')
    assert 'Pa absolute (48.68 to 1499 kPa gauge)' in found
    found = said(DriverConfig.from_parameters, {'max_pressure_gauge_pa': 600.0})
    assert 'Pa gauge (1 to 1000 kPa gauge)' in found
    found = said(load_controller, 'controller: pid\nsettings: {max_pressure_gauge_pa: 1}\n',
                 load_rig('dmsp_5_300_hanging_mass'))
    assert 'kPa gauge)' in found


def test_hardware_must_be_a_parameter_file(tmp_path):
    for name in list_config('hardware'):
        assert hardware_file(name) == str(config_dir() / 'hardware' / f'{name}.yaml')
    own = tmp_path / 'own.yaml'
    own.write_text('/bench:\n  valve_driver:\n    ros__parameters: {backend: dummy}\n')
    assert hardware_file(str(own)) == str(own)
    for text, words in (
            (NOMINAL, 'is a model of a rig, not hardware; give it with --model'),
            ('name: x\nsegments: [rest]\n', 'is an experiment'),
            ('controller: pid\n', 'is a controller'), ('a: {b: 1}\n', 'is no file of hardware'),
            ('valve_driver: {ros__parameters: }\n', 'is no file of hardware'), ('[', 'YAML'),
            ('3\n', 'mapping')):
        path = tmp_path / 'wrong.yaml'
        path.write_text(text)
        found = said(rig_layout, hardware=str(path))
        assert 'wrong.yaml' in found and words in found, found

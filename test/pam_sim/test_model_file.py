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

"""Model files: what they say is what the rig is, and mistakes are told with their place."""

import numpy as np
from pam_sim import load_rig, preset_names
from pam_sim.errors import InputError
from pam_sim.located_yaml import dump_yaml, load_yaml
import pytest

MODEL = """\
rig: dmsp_5_300_hanging_mass
valve: hsv
fidelity: switching
parameters: {mass_kg: 4.5, C: 3e-10}
tolerance: {mass_kg: 0.005}
effects:
  - name: leakage
    parameters: {conductance_m3_per_s_pa: 2.0e-13}
    source: {bag: run_1, date: 2026-01-02, ci95: [1.0e-13, 3.0e-13]}
sensors: {pressure_noise_pa: 100}
"""


def test_model_file_is_read(tmp_path):
    path = tmp_path / 'model.yaml'
    path.write_text(MODEL)
    for rig in (load_rig(MODEL), load_rig(path), load_rig(str(path)), load_rig(load_yaml(path))):
        assert (rig.valve, rig.fidelity, rig.load) == ('hsv', 'switching', 'hanging_mass')
        assert rig.parameters['mass_kg'] == 4.5 and rig.parameters['C'] == 3e-10
        assert rig.parameters['K_m'] == 100e3
        assert rig.tolerance['mass_kg'] == 0.005 and rig.tolerance['supply_pa'] == 0.005
        assert rig.tolerance['C'] == 0.02
        assert rig.effects[0].parameters == {'conductance_m3_per_s_pa': 2e-13}
        assert rig.sensors['pressure_noise_pa'] == 100.0
    assert load_rig(path, valve='ppr').valve == 'ppr'


def test_round_trip():
    for source in [*preset_names(), MODEL]:
        rig = load_rig(source)
        text = rig.to_yaml()
        assert load_rig(text) == rig
        assert load_rig(text).to_yaml() == text


def test_an_effect_whose_file_lies_beside_the_model_is_told_with_the_way_to_it(tmp_path):
    path = tmp_path / 'model.yaml'
    path.write_text('rig: dmsp_5_300_hanging_mass\neffects: [{name: my_effect}]\n')
    with pytest.raises(InputError, match='unknown effect `my_effect`'):
        load_rig(path)
    (tmp_path / 'my_effect.py').touch()
    with pytest.raises(InputError, match=r'model.yaml:2: effect `my_effect` is in .*my_effect.py, '
                       r'a folder that is not searched; name it: export PAM_EFFECTS_PATH=/'):
        load_rig(path)


def test_realistic_preset_has_the_stated_numbers():
    rig = load_rig('dmsp_5_300_realistic')
    assert rig.effect('valve_dead_time').parameters == {'delay_s': 0.030}
    assert rig.effect('hysteresis').parameters['force_per_pa'] == 4.5e-6
    assert rig.effect('creep').parameters['stiffness_2_n_per_m'] == 57.0
    assert rig.effect('valve_dead_zone').parameters['close_time_s'] == 2.0e-3
    assert rig.sensors['stamp_jitter_s'] == 5e-5


def test_effects_of_a_file_are_added_to_those_of_its_rig():
    rig = load_rig('rig: dmsp_5_300_realistic\n'
                   'effects: [{name: end_taper}, {name: creep, parameters: '
                   '{stiffness_1_n_per_m: 0, stiffness_2_n_per_m: 0}}]\n')
    assert [item.name for item in rig.effects] == [
        'valve_dead_time', 'hysteresis', 'creep', 'valve_dead_zone', 'end_taper']
    assert rig.effect('creep').parameters['stiffness_1_n_per_m'] == 0.0


@pytest.mark.parametrize('text, line, parts', [
    ('rig: dmsp_5_300_hanging_mass\nvlave: ppr\n', 2, ['vlave', 'valve']),
    ('rig: dmsp_5_300_hanging_mass\nvalve: xyz\n', 2, ['xyz', 'ppr, hsv']),
    ('rig: nothing_like_it\n', 1, ['nothing_like_it', 'dmsp_5_300_realistic']),
    ('valve: ppr\n', 1, ['`rig` is missing']),
    ('rig: dmsp_5_300_hanging_mass\nparameters:\n  mass_kg: -1\n', 3,
     ['mass_kg', '0.1 to 500 kg']),
    ('rig: dmsp_5_300_hanging_mass\nparameters:\n  mass_kg: heavy\n', 3, ['mass_kg', 'heavy']),
    ('rig: dmsp_5_300_hanging_mass\nparameters:\n  mass_g: 5000\n', 3, ['mass_g', 'mass_kg']),
    ('rig: dmsp_5_300_hanging_mass\nparameters:\n  K_m: 100\n', 3, ['K_m', '500000 Pa/V']),
    ('rig: dmsp_5_300_hanging_mass\nparameters: 5\n', 2, ['parameters', 'mapping']),
    ('rig: dmsp_5_300_hanging_mass\ntolerance:\n  mass_kg: -0.1\n', 3, ['mass_kg', '0 to 1']),
    ('rig: dmsp_5_300_hanging_mass\ntolerance:\n  mass: 0.1\n', 3, ['mass', 'mass_kg']),
    ('rig: dmsp_5_300_hanging_mass\neffects:\n  - name: leekage\n', 3, ['leekage', 'leakage']),
    ('rig: dmsp_5_300_hanging_mass\neffects:\n  - parameters: {}\n', 3, ['`name` is missing']),
    ('rig: dmsp_5_300_hanging_mass\neffects:\n  - name: creep\n    parameters:\n      k: 1\n', 5,
     ['`k`', 'stiffness_1_n_per_m']),
    ('rig: dmsp_5_300_hanging_mass\neffects:\n  - name: valve_dead_time\n'
     '    parameters: {delay_s: 30}\n', 4, ['delay_s', '0 to 0.5 s']),
    ('rig: dmsp_5_300_hanging_mass\neffects: {creep: 1}\n', 2, ['effects', 'list']),
    ('rig: dmsp_5_300_hanging_mass\neffects: [creep, creep]\n', 2, ['mapping']),
    ('rig: dmsp_5_300_hanging_mass\nsensors: {noise: 1}\n', 2, ['noise', 'pressure_noise_pa']),
    ('rig: dmsp_5_300_hanging_mass\nfidelity: exact\n', 2, ['exact', 'averaged, switching']),
    ('rig: dmsp_5_300_hanging_mass\nrig: dmsp_5_300_hanging_mass\n', 2, ['twice']),
    ('rig: [\n', 2, ['YAML']),
    ('- rig\n- valve\n', 1, ['mapping']),
])
def test_mistakes_are_told_with_file_and_line(tmp_path, text, line, parts):
    path = tmp_path / 'model.yaml'
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_rig(path)
    message = str(caught.value)
    assert message.startswith(f'{path}:{line}: ') and '\n' not in message
    for part in parts:
        assert part in message


def test_mistakes_outside_files(tmp_path):
    with pytest.raises(InputError, match='neither a preset nor a file'):
        load_rig('no_such_rig')
    with pytest.raises(InputError, match='No such file'):
        load_rig('no_such_rig.yaml')
    one_muscle = 'is a joint with two muscles, and one muscle is needed here'
    with pytest.raises(InputError, match=f'^joint_dmsp_5_300: {one_muscle}'):
        load_rig('joint_dmsp_5_300')
    (tmp_path / 'knee.yaml').write_text('name: mine\njoint: joint_dmsp_5_300\n')
    with pytest.raises(InputError, match=f'knee.yaml:2: {one_muscle}'):
        load_rig(tmp_path / 'knee.yaml')
    with pytest.raises(InputError, match='xyz'):
        load_rig('dmsp_5_300_realistic', valve='xyz')
    binary = tmp_path / 'binary.yaml'
    binary.write_bytes(bytes(range(256)))
    with pytest.raises(InputError, match='not a text file'):
        load_rig(binary)
    rig = load_rig('dmsp_5_300_hanging_mass')
    with pytest.raises(InputError, match='shape'):
        rig.simulate(np.zeros((5, 2)))
    with pytest.raises(InputError, match='shape'):
        rig.simulate([])
    with pytest.raises(InputError, match='driven'):
        load_rig('dmsp_5_300_driven').simulate([1.0])
    with pytest.raises(InputError, match='load_n'):
        load_rig('dmsp_5_300_isometric').static_pressure_pa(0.01)
    with pytest.raises(InputError, match='unknown parameter'):
        rig.with_(parameters={'mass': 3.0})
    with pytest.raises(InputError, match='dt_s'):
        rig.simulate([1.0], dt_s=1.0)


def test_yaml_numbers_and_words():
    data = load_yaml('a: 2e-10\nb: on\nc: 1_000\nd: 010\ne: -.5\nf: {g: [1, 2.5, x]}\n')
    assert data.plain() == {
        'a': 2e-10, 'b': 'on', 'c': '1_000', 'd': 10, 'e': -0.5, 'f': {'g': [1, 2.5, 'x']}}
    assert data.where('f') == '<text>:6' and data['f']['g'].where(0) == '<text>:6'
    assert load_yaml(dump_yaml(data)).plain() == data.plain()
    assert dump_yaml({'x': np.float64(0.5), 'y': np.arange(2)}) == 'x: 0.5\ny:\n- 0\n- 1\n'
    with pytest.raises(InputError, match='must be a whole number'):
        data.require('a', int)
    with pytest.raises(InputError, match='`z` is missing'):
        data.require('z')
    assert data.get('z', float, 3.0) == 3.0

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

"""Model files of joints: there and back, and every mistake in one sentence."""

from pathlib import Path

import numpy as np
import pam_sim
from pam_sim.errors import InputError
from pam_sim.joint import joint_preset_names, load_joint
from pam_sim.joint.limbs import shank_and_foot
from pam_sim.joint.parameters import PARAMETERS
import pytest

TEXT = """\
load: antagonistic_joint
flexor:
  rig: dmsp_5_300_driven
  valve: hsv
  parameters: {V_dead: 4.0e-6}
  effects:
    - name: hysteresis
      parameters: {force_n: 0.7}
extensor: dmsp_5_300_driven
parameters:
  limb_mass_kg: 0.2
  friction_n_m: 0.01
"""


@pytest.mark.parametrize('name', joint_preset_names())
def test_presets_run_and_come_back_from_their_text(name):
    joint = load_joint(name)
    assert load_joint(joint.to_yaml()) == joint
    response = joint.simulate(np.full(100, 3.0), np.full(100, 2.0))
    assert np.ptp(response.flexor.pressure_pa) > 1e5
    assert response.angle_rad[0] == joint.static_angle_rad(101325.0, 101325.0)


def test_file_comes_back_equal(tmp_path):
    path = tmp_path / 'joint.yaml'
    path.write_text(TEXT)
    joint = load_joint(str(path))
    assert joint.flexor.valve == 'hsv' and joint.flexor.parameters['V_dead'] == 4e-6
    assert joint.flexor.effect('hysteresis').parameters['force_n'] == 0.7
    assert joint.extensor.valve == 'ppr'
    assert joint.parameters['friction_n_m'] == 0.01
    path.write_text(joint.to_yaml())
    assert load_joint(path) == joint
    assert load_joint(path, valve='ppr').flexor.valve == 'ppr'


def test_a_file_may_build_on_a_preset():
    joint = load_joint('joint: joint_dmsp_5_300\nparameters: {limb_mass_kg: 0.1}\n')
    assert joint.parameters['limb_mass_kg'] == 0.1
    assert joint.extensor == load_joint('joint_dmsp_5_300').extensor


@pytest.mark.parametrize('old, new, sentence', [
    ('limb_mass_kg: 0.2', 'limb_mas_kg: 0.2',
     r':11: unknown parameter `limb_mas_kg` \(did you mean `limb_mass_kg`\?\)'),
    ('limb_mass_kg: 0.2', 'limb_mass_kg: -1', ':11: `limb_mass_kg` is -1; allowed 0 to 100 kg'),
    ('limb_mass_kg: 0.2', 'limb_mass_kg: 20',
     ':10: parameters: `inertia_kg_m2` is 0.004; limb_mass_kg times'),
    ('friction_n_m: 0.01', 'lower_stop_rad: 1.2', 'the joint cannot move'),
    ('extensor: dmsp_5_300_driven', 'extensor: dmsp_5_300_hanging_mass',
     ':9: extensor: has load `hanging_mass`; a muscle of a joint has load `driven`'),
    ('extensor: dmsp_5_300_driven', 'extensor: nothing', ':9: rig `nothing` is neither'),
    ('extensor: dmsp_5_300_driven\n', '', ':1: `extensor` is missing'),
    ('extensor: dmsp_5_300_driven', 'extensor: 3', ':9: `extensor` must be a preset'),
    ('name: hysteresis\n      parameters: {force_n: 0.7}',
     'name: guide_friction', 'flexor: effect `guide_friction` acts on the load'),
    ('parameters: {V_dead: 4.0e-6}', 'parameters: {V_dead: -4.0e-6}', ':5: `V_dead`'),
    ('load: antagonistic_joint', 'load: hanging_mass', ':1: `load` is `hanging_mass`, allowed'),
    ('load: antagonistic_joint\n', '', '`load: antagonistic_joint` is missing'),
    ('load: antagonistic_joint', 'load: antagonistic_joint\nknee: 1', ':2: unknown key `knee`'),
])
def test_mistakes_in_a_file(tmp_path, old, new, sentence):
    path = tmp_path / 'joint.yaml'
    assert old in TEXT
    path.write_text(TEXT.replace(old, new))
    with pytest.raises(InputError, match=sentence):
        load_joint(path)


def test_mistakes_in_a_call():
    joint = load_joint('joint_dmsp_5_300')
    ten = np.zeros(10)
    for sentence, call in (
            ('neither a preset nor a file', lambda: load_joint('knee')),
            ('flexor_signal: has shape', lambda: joint.simulate(np.zeros((10, 2)), ten)),
            ('extensor_signal: has 9 samples', lambda: joint.simulate(ten, ten[1:])),
            ('external_torque_n_m: has shape', lambda: joint.simulate(ten, ten, ten[1:])),
            ("external_torque_n_m: is no array of numbers: 'x'",
             lambda: joint.simulate(ten, ten, 'x')),
            ('external_torque_n_m: is nan at sample 0; allowed -10000 to 10000 N m',
             lambda: joint.simulate(ten, ten, np.nan)),
            ('extensor_signal: ppr_voltage is inf at sample 0; allowed -1 to 12 V',
             lambda: joint.simulate(ten, ten + np.inf)),
            ('`initial_angle_rad` is 2; allowed -1 to 1 rad',
             lambda: joint.simulate(ten, ten, initial_angle_rad=2.0)),
            ('`initial_velocity_rad_per_s` is nan',
             lambda: joint.simulate(ten, ten, initial_velocity_rad_per_s=np.nan)),
            ('`initial_pressure_pa` is 0; allowed',
             lambda: joint.simulate(ten, ten, flexor_pressure_pa=0.0)),
            ('`dt_s` is 1', lambda: joint.simulate(ten, ten, dt_s=1.0)),
            ('too little for these muscles', lambda: joint.with_(
                {'limb_mass_kg': 0.0, 'inertia_kg_m2': 1e-6, 'flexor_radius_m': 0.1}).plant()),
            ('`height_m` is 17', lambda: shank_and_foot(70.0, 17.0))):
        with pytest.raises(InputError, match=sentence):
            call()


@pytest.mark.parametrize('given, words', [
    ({'parameters': [1.0]}, 'parameters: is [1.0]; write'),
    ({'flexor': 'dmsp_5_300_driven'}, "flexor: is 'dmsp_5_300_driven'; give a Rig with load"),
    ({'name': 3}, 'name: is 3; a text is needed'),
])
def test_a_change_of_a_joint_of_another_kind_is_refused_in_one_sentence(given, words):
    joint = load_joint('joint_dmsp_5_300')
    with pytest.raises(InputError) as caught:
        joint.with_(**given)
    assert str(caught.value).startswith(words)
    with pytest.raises(InputError, match="`initial_angle_rad` is 'x'; a number is needed"):
        joint.plant(initial_angle_rad='x')


def test_the_page_and_the_presets_say_every_number():
    page = (Path(__file__).parents[2] / 'docs/reference/joint.md').read_text(encoding='utf-8')
    assert [p.name for p in PARAMETERS if f'`{p.name}`' not in page] == []
    assert [name for name in joint_preset_names() if f'`{name}`' not in page] == []
    assert pam_sim.load_joint('joint_dmsp_5_300').load == 'antagonistic_joint'


def test_shank_and_foot_of_a_person():
    # 70 kg, 1.75 m: 4.27 kg, shank 0.4305 m.
    limb = shank_and_foot(70.0, 1.75)
    assert limb['limb_mass_kg'] == pytest.approx(4.27)
    assert limb['centre_of_mass_m'] == pytest.approx(0.2609, abs=1e-4)
    assert limb['inertia_kg_m2'] == pytest.approx(4.27 * 0.31642 ** 2, rel=1e-4)
    knee = load_joint('knee_dmsp_20_300')
    assert {name: knee.parameters[name] for name in limb} == pytest.approx(limb, rel=1e-5)


def test_the_knee_bends_and_lifts_the_shank():
    knee = load_joint('knee_dmsp_20_300')
    assert knee.static_angle_rad(101325.0, 101325.0) == pytest.approx(np.pi / 2, abs=1e-4)
    assert knee.static_angle_rad(701325.0, 101325.0) == 1.8
    assert knee.static_angle_rad(101325.0, 701325.0) == 0.2
    response = knee.simulate(np.zeros(3000), np.full(3000, 4.5))
    assert response.angle_rad[-1] == pytest.approx(
        knee.static_angle_rad(101325.0, 551325.0), abs=0.02)

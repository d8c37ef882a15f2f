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

"""The model of a preset on a rig that moves otherwise than the one it was searched on."""

from pathlib import Path

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.sofc.settings import INERTIA
from pam_actuation.control.suited import force_per_pa, inertia_and_slope, joint_inertia
from pam_actuation.experiments import load_experiment
from pam_actuation.resources import find_config
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.force_loop import ForceLoop
from pam_actuation.tuning.joint_loop import JointLoop
from pam_sim import load_rig
from pam_sim.joint import load_rig_or_joint
import pytest

LIGHT = """\
muscle: dmsp_10_250
load: hanging_mass
valve: ppr
parameters: {mass_kg: 2.0, damping_n_s_per_m: 100.0, T_m: 0.05}
effects:
  - {name: valve_dead_time, parameters: {delay_s: 0.02}}
  - {name: hysteresis, parameters: {force_n: 2.0}}
sensors: {pressure_noise_pa: 300.0, contraction_noise_m: 2.0e-5}
"""
SLOW = """\
muscle: dmsp_20_300
load: hanging_mass
valve: ppr
parameters: {mass_kg: 15.0, damping_n_s_per_m: 300.0, T_m: 0.15}
effects:
  - {name: valve_dead_time, parameters: {delay_s: 0.06}}
  - {name: hysteresis, parameters: {force_n: 5.0}}
sensors: {pressure_noise_pa: 300.0, contraction_noise_m: 2.0e-5}
"""
LIMB = """\
load: antagonistic_joint
""" + ''.join(f"""\
{side}:
  muscle: dmsp_20_300
  load: driven
  valve: ppr
  parameters: {{damping_n_s_per_m: 300.0, T_m: 0.08}}
  effects:
    - {{name: valve_dead_time, parameters: {{delay_s: 0.03}}}}
    - {{name: hysteresis, parameters: {{force_n: 5.0, force_per_pa: 4.5e-5}}}}
  sensors: {{pressure_noise_pa: 300.0, contraction_noise_m: 1.0e-5, force_noise_n: 1.0}}
""" for side in ('flexor', 'extensor')) + """\
parameters:
  flexor_radius_m: 0.025
  extensor_radius_m: 0.025
  flexor_contraction_at_zero_m: 0.025
  extensor_contraction_at_zero_m: 0.025
  limb_mass_kg: 1.0
  centre_of_mass_m: 0.15
  inertia_kg_m2: 0.05
  damping_n_m_s: 0.05
"""
FORCE = """\
muscle: {muscle}
load: isometric
valve: ppr
parameters: {{T_m: 0.08}}
effects:
  - {{name: valve_dead_time, parameters: {{delay_s: 0.03}}}}
sensors: {{pressure_noise_pa: 300.0, force_noise_n: 1.0}}
"""
FORCE_SINE = """\
name: own_force
domain: force
segments:
  - ramp: {{to_n: {low:.1f}, duration_s: 2.0}}
  - sine: {{center_n: {middle}, amplitude_n: {half}, frequency_hz: 1.0, cycles: 20}}
"""
GAINS = ('predicted_proportional_pa_per_m', 'predicted_derivative_pa_s_per_m')


def own(tmp_path, text):
    """Return a rig of a file with this text."""
    path = tmp_path / 'own_rig.yaml'
    path.write_text(text)
    return load_rig(str(path))


def late_error_mm(controller, rig):
    """Return the error [mm] of the last third of a sine."""
    loop = ClosedLoop(rig, load_experiment('sine_half_hz'), preview_s=0.6, slow_start=True)
    run = loop.run(controller)
    return 1e3 * float(np.sqrt(np.mean(run.error_m[2 * loop.ticks // 3:]**2)))


@pytest.mark.parametrize('text, before_mm, now_mm', [(LIGHT, 0.8, 0.1), (SLOW, 4.0, 0.2)])
def test_a_preset_with_a_model_does_not_swing_on_a_light_load(tmp_path, text, before_mm, now_mm):
    rig = own(tmp_path, text)
    searched = load_controller(find_config('controllers', 'sofc_model_ppr'), rig)
    assert late_error_mm(searched, rig) > before_mm        # what the preset did
    assert late_error_mm(load_controller('sofc_model_ppr', rig), rig) < now_mm


@pytest.mark.parametrize('preset', ['sofc_model_ppr', 'sofc_model_hsv', 'sofc_ppr', 'pid'])
@pytest.mark.parametrize('name', ['dmsp_5_300_realistic', 'dmsp_10_250_hanging_mass',
                                  'dmsp_20_300_hanging_mass', 'dmsp_40_300_hanging_mass'])
def test_rigs_like_that_of_the_presets_take_them_as_they_are(preset, name):
    rig = load_rig(name)
    settings = load_controller(find_config('controllers', preset), rig).settings
    assert load_controller(preset, rig).settings == settings


def test_only_a_preset_is_suited_to_a_rig_and_a_file_counts_as_written(tmp_path):
    rig = own(tmp_path, SLOW)
    path = tmp_path / 'mine.yaml'
    path.write_text(Path(find_config('controllers', 'sofc_model_ppr')).read_text())
    mine, preset = (load_controller(one, rig).settings for one in (path, 'sofc_model_ppr'))
    assert mine[INERTIA] == 17000.0
    inertia, slope = inertia_and_slope(rig)
    assert preset[INERTIA] == pytest.approx(17000.0 * inertia / 2.3e4)
    for name in GAINS:
        assert preset[name] == pytest.approx(mine[name] * slope / 9.5e6)
    assert {name for name in mine if mine[name] != preset[name]} == {INERTIA, *GAINS}
    # What is written down has these numbers, so a recording is replayed anywhere.
    again = load_controller(load_controller('sofc_model_ppr', rig).to_yaml())
    assert again.settings == preset


def test_a_heavy_load_has_more_inertia_and_no_more_feedback(tmp_path):
    rig = own(tmp_path, SLOW.replace('mass_kg: 15.0', 'mass_kg: 110.0'))
    mine = load_controller(find_config('controllers', 'sofc_model_ppr'), rig).settings
    preset = load_controller('sofc_model_ppr', rig).settings
    assert preset[INERTIA] > 1.4 * mine[INERTIA]
    assert all(preset[name] == mine[name] for name in GAINS)


def test_a_rig_that_says_nothing_of_its_motion_leaves_a_preset_alone():
    assert inertia_and_slope(load_rig('dmsp_5_300_isometric')) is None
    assert inertia_and_slope(load_rig('dmsp_5_300_driven')) is None
    heavy = load_rig('dmsp_5_300_realistic').with_(parameters={'mass_kg': 60.0})
    assert inertia_and_slope(heavy) is None                # no pressure holds it up


def test_a_preset_of_a_joint_does_not_swing_with_a_light_limb(tmp_path):
    path = tmp_path / 'limb.yaml'
    path.write_text(LIMB)
    joint = load_rig_or_joint(path)
    searched = load_controller(find_config('controllers', 'sofc_model_joint_ppr'), joint)
    preset = load_controller('sofc_model_joint_ppr', joint)
    times = joint_inertia(joint) / 6.45e4
    assert times < 0.5
    for name in (INERTIA, *GAINS):
        assert preset.settings[name] == pytest.approx(times * searched.settings[name])
    loop = JointLoop(joint, load_experiment('joint_tuning'), slow_start=True)
    swings_deg, calm_deg = (
        float(np.degrees(np.sqrt(np.mean(run.error[2 * len(run.error) // 3:]**2))))
        for run in (loop.run(searched), loop.run(preset)))
    assert swings_deg > 10.0 and calm_deg < 0.2


@pytest.mark.parametrize('name, kind', [
    ('joint_dmsp_5_300', 'joint'), ('joint_dmsp_5_300_realistic', 'joint'),
    ('knee_dmsp_20_300', 'knee'), ('knee_dmsp_20_300_realistic', 'knee')])
@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_the_joints_of_the_presets_take_them_as_they_are(name, kind, valve):
    joint = load_rig_or_joint(name, valve)
    for preset in (f'sofc_model_{kind}_{valve}', f'sofc_{kind}_{valve}'):
        settings = load_controller(find_config('controllers', preset), joint).settings
        assert load_controller(preset, joint).settings == settings


@pytest.mark.filterwarnings('ignore::pam_sim.muscle.law.ExtrapolationWarning')
@pytest.mark.parametrize('muscle, middle', [('dmsp_20_300', 400), ('dmsp_40_300', 1600)])
def test_a_preset_of_a_force_suits_a_muscle_that_pulls_harder(muscle, middle, tmp_path):
    rig = own(tmp_path, FORCE.format(muscle=muscle))
    searched = load_controller(find_config('controllers', 'sofc_force_ppr'), rig)
    preset = load_controller('sofc_force_ppr', rig)
    assert preset.stiffness_n_per_m == pytest.approx(1769.5 * force_per_pa(rig) / 2.18e-4)
    loop = ForceLoop(rig, load_experiment(FORCE_SINE.format(
        low=0.75 * middle, middle=middle, half=0.25 * middle)), slow_start=True)
    swings_n, calm_n = (float(np.sqrt(np.mean(run.error[2 * len(run.error) // 3:]**2)))
                        for run in (loop.run(searched), loop.run(preset)))
    assert swings_n > 0.05 * middle and calm_n < 0.003 * middle


@pytest.mark.parametrize('name', ['dmsp_5_300_isometric', 'dmsp_5_300_isometric_realistic',
                                  'dmsp_5_300_driven'])
def test_rigs_of_the_preset_of_a_force_keep_its_number(name):
    for valve in ('ppr', 'hsv'):
        controller = load_controller(f'sofc_force_{valve}', load_rig(name, valve=valve))
        assert controller.stiffness_n_per_m == 1769.5

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

"""The presets with a model for a joint: motions that do not repeat, large errors, its drivers."""

import math

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.drivers.asked import asked_by
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.experiments import load_experiment
from pam_actuation.resources import find_config
from pam_actuation.rigging.layouts import knee
from pam_actuation.tuning.joint_loop import JointLoop
from pam_actuation.tuning.random_rigs import random_rigs
from pam_sim.joint import load_joint
import pytest

PRESETS = {'knee': ('knee_dmsp_20_300_realistic', math.pi / 2.0, 1.0),
           'joint': ('joint_dmsp_5_300_realistic', 0.0, 0.0)}


def moves(kind, segments):
    """Return an experiment that begins in the middle of the motion."""
    _, rest, middle = PRESETS[kind]
    return load_experiment(
        'name: moves\ndomain: joint_angle\nsegments:\n'
        f'  - step: {{to_rad: {rest}, duration_s: 2.0}}\n'
        f'  - ramp: {{to_rad: {middle}, duration_s: 3.0}}\n{segments}')


def random_motion(kind, seed):
    return moves(kind, f'  - multisine: {{center_rad: {PRESETS[kind][2]}, amplitude_rad: 0.3, '
                 f'min_hz: 0.02, max_hz: 1.0, lines: 40, duration_s: 20.0, seed: {seed}}}\n')


def errors_deg(joint, nominal, experiment, controller, preview_s=0.0):
    """Return the errors from 5 s on, with drivers that know the nominal joint."""
    drivers = [driver_config(rig) for rig in (nominal.flexor, nominal.extensor)]
    run = JointLoop(joint, experiment, seed=8, preview_s=preview_s, drivers=drivers).run(
        load_controller(controller, nominal))
    return np.degrees(run.error[run.time_s >= 5.0])


def rms(values):
    return math.sqrt(np.mean(np.square(values)))


@pytest.mark.parametrize('valve, part', [('ppr', 0.2), ('hsv', 0.4)])
@pytest.mark.parametrize('kind', PRESETS)
def test_a_motion_that_does_not_repeat_is_followed_from_the_first_second(kind, valve, part):
    """On the joint they were made for and on random ones, against the rules without a model."""
    nominal = load_joint(PRESETS[kind][0], valve=valve)
    found = np.array([[
        rms(errors_deg(joint, nominal, random_motion(kind, 4100 + k), name))
        for name in (f'sofc_model_{kind}_{valve}', f'sofc_{kind}_{valve}')]
        for k, joint in enumerate([nominal, *random_rigs(nominal, 3, seed=4100)])])
    assert (found[:, 0] < found[:, 1]).all()
    assert rms(found[:, 0]) < part * rms(found[:, 1])


GAIT_BEYOND_REACH = (
    '  - ramp: {to_rad: 0.6, duration_s: 2.0}\n'
    '  - knee_gait: {low_rad: 0.6, high_rad: 1.3, frequency_hz: 0.9, cycles: 8}\n'
    '  - ramp: {to_rad: 1.0, duration_s: 2.0}\n'
    '  - hold: {duration_s: 4.0}\n')


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
@pytest.mark.parametrize('preview_s', [0.0, 0.3])
def test_after_what_the_muscles_cannot_do_the_joint_is_at_rest_again(valve, preview_s):
    """A gait of 40 degrees at 0.9 Hz: extensor and valves are at their limits."""
    nominal = load_joint(PRESETS['knee'][0], valve=valve)
    errors = errors_deg(nominal, nominal, moves('knee', GAIT_BEYOND_REACH),
                        f'sofc_model_knee_{valve}', preview_s)
    assert rms(errors) < 8.0 and np.abs(errors[-400:]).max() < 0.5


def test_a_feedback_without_bound_loses_more_beyond_the_limits_of_valves():
    """As a law of before that starts its prediction anew, it even swings on."""
    nominal = load_joint(PRESETS['knee'][0], valve='hsv')
    text = find_config('controllers', 'sofc_model_knee_hsv').read_text(encoding='utf-8')
    line, = [line for line in text.splitlines() if 'predicted_reach_m' in line]
    bounded, free, of_before = (
        errors_deg(nominal, nominal, moves('knee', GAIT_BEYOND_REACH), text.replace(line, lines))
        for lines in (line, '  predicted_reach_m: 0', '  predicted_reach_m: 0\n  revision: 0'))
    assert rms(free) > 1.3 * rms(bounded)
    assert np.abs(of_before[-400:]).max() > 5.0


def test_drivers_get_what_the_controller_of_their_joint_asks_for():
    nominal = load_joint(PRESETS['knee'][0], valve='hsv')
    text = find_config('controllers', 'sofc_model_knee_hsv').read_text(encoding='utf-8')
    asks = errors_deg(nominal, nominal, random_motion('knee', 4200), text)
    alone = errors_deg(nominal, nominal, random_motion('knee', 4200),
                       text[:text.index('\ndriver:')] + '\n')
    assert rms(asks) < 0.95 * rms(alone)
    drivers = [[node.parameters for node in knee(
        valve='hsv', joint=nominal.name, controller=name) if node.name == 'valve_driver']
        for name in ('sofc_model_knee_hsv', 'sofc_knee_hsv', '')]
    assert [[parameters['controller'] for parameters in pair] for pair in drivers] == [
        ['sofc_model_knee_hsv'] * 2, ['sofc_knee_hsv'] * 2, [''] * 2]
    assert asked_by('sofc_model_knee_hsv') and not asked_by('sofc_knee_hsv')


def test_ages_of_angle_and_pressures_count():
    """The reading is 20 ms old: told so, the controller predicts from there."""
    joint = load_joint(PRESETS['joint'][0])
    commands = []
    for ages_s in ((0.0, 0.0), (0.02, 0.02)):
        controller = load_controller('sofc_model_joint_ppr', joint)
        for k in range(200):
            angle = 0.1 * math.sin(2.0 * math.pi * k / 200.0)
            rate = 0.2 * math.pi * math.cos(2.0 * math.pi * k / 200.0)
            pair = controller.step(0.9 * angle, angle, rate, angle, rate, ages_s=ages_s,
                                   pressures_pa=(4.0e5, 4.0e5))
        commands.append(pair[0])
    assert abs(commands[0] - commands[1]) > 100.0

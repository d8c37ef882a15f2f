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

"""Starts, exchanges of rules and lost readings in the middle of a motion."""

import math

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.sofc.muscle_model import ACCELERATION, RATE
from pam_actuation.control.sofc.records import STATE
from pam_actuation.control.static_inverse import inverse_pressure_pa
from pam_sim import load_rig
from pam_sim.located_yaml import dump_yaml, load_yaml
from pam_sim.records import fields
import pytest

PERIOD_S = 0.005


def controller_of(name='sofc_model_ppr', **settings):
    """Return a preset with some other settings."""
    controller = load_controller(name, load_rig('dmsp_5_300_realistic'))
    return controller.with_settings({**controller.settings, **settings})


def reference(time_s, amplitude_m=0.006, frequency_hz=0.5, center_m=0.012):
    """Return contraction [m] and rate [m/s] of a sine."""
    pulsation = 2.0 * math.pi * frequency_hz
    return (center_m + amplitude_m * math.sin(pulsation * time_s),
            pulsation * amplitude_m * math.cos(pulsation * time_s))


def drive(controller, ticks, learn=True, age_s=0.003, lost=(), error_m=1e-4):
    """Move a muscle that nearly follows, open loop; return commands and outputs of each tick."""
    commands, outputs = [], []
    for tick in ticks:
        time_s = PERIOD_S * tick
        wanted, ahead = reference(time_s), reference(time_s + controller.lead_s)
        x = wanted[0] - error_m * math.sin(3.0 * time_s)
        pressure_pa = inverse_pressure_pa(controller.static_inverse, x)
        commands.append(controller.step(
            x, *wanted, *ahead, learn, PERIOD_S, math.nan if tick in lost else pressure_pa,
            age_s=age_s, pressure_age_s=age_s))
        outputs.append(dict(zip(controller.state_names, controller.state_values())))
    return np.array(commands), outputs


def of(outputs, name):
    """Return one output over the ticks."""
    return np.array([one[name] for one in outputs])


def test_an_exchange_for_the_same_rules_changes_no_command():
    one, other = controller_of(), controller_of()
    for controller in (one, other):
        drive(controller, range(400))
    other.replace_rules(other.rules.copy())
    commands, _ = drive(one, range(400, 460), learn=False)
    again, _ = drive(other, range(400, 460), learn=False)
    assert np.abs(again - commands).max() < 1e-3


def test_a_prediction_that_begins_in_motion_knows_the_rate():
    controller = controller_of(half_strength_m=0.0)
    _, outputs = drive(controller, range(60), age_s=0.0, error_m=0.0)
    assert np.abs(of(outputs, 'predicted_feedback_pa')).max() < 2e4


def test_without_a_pressure_the_prediction_is_finite_from_the_start():
    controller = controller_of(half_strength_m=0.0)
    _, outputs = drive(controller, range(60), lost=range(60))
    assert np.isfinite(of(outputs, 'predicted_feedback_pa')).all()
    assert np.abs(of(outputs, 'predicted_feedback_pa')).max() > 0.0


def test_a_text_of_before_is_of_revision_0():
    rig = load_rig('dmsp_5_300_realistic')
    tree = load_yaml(load_controller('sofc_model_ppr', rig).to_yaml(), name='text').plain()
    assert tree['settings'].pop('revision') == 2.0
    assert load_controller(dump_yaml(tree), rig).settings['revision'] == 0.0
    for name in ('static_inverse', 'made_for', 'initial_rules'):
        del tree[name]
    assert load_controller(dump_yaml(tree), rig).settings['revision'] == 2.0


@pytest.mark.parametrize('age_s', [0.02, 0.05])
def test_before_the_start_the_command_was_that_of_the_start(age_s):
    controller = controller_of(half_strength_m=0.0)
    _, outputs = drive(controller, range(60), age_s=age_s, error_m=0.0)
    assert np.abs(of(outputs, 'predicted_feedback_pa')).max() < 5e4


@pytest.mark.parametrize('name', ['sofc_ppr', 'sofc_model_ppr'])
def test_a_reference_that_moves_at_the_first_tick_is_no_jump(name):
    controller = controller_of(name, rate_hz=50.0)
    for tick in range(3):
        wanted, ahead = (reference(time_s, 0.012, 1.0, 0.015)
                         for time_s in (0.02 * tick, 0.02 * tick + controller.lead_s))
        controller.step(wanted[0], *wanted, *ahead)
        outputs = dict(zip(controller.state_names, controller.state_values()))
        assert outputs['jump_to_go_m'] == 0.0


@pytest.mark.parametrize('settings', [{}, {
    'predicted_proportional_pa_per_m': 0.0, 'predicted_derivative_pa_s_per_m': 0.0}],
    ids=['with_prediction', 'without'])
def test_a_lost_pressure_in_motion_tells_no_acceleration(settings):
    one, other = controller_of(**settings), controller_of(**settings)
    drive(one, range(640))
    _, outputs = drive(other, range(640), lost=(605,))
    assert np.abs(of(outputs[600:], 'disturbance_pa')).max() < 200.0
    assert np.abs(other.rules.numbers - one.rules.numbers).max() < 50.0


@pytest.mark.parametrize('name, value, keeps', [
    ('path_longest_m', 0.005, False), ('path_sets', 6.0, False),
    ('path_fading_longest_m', 0.003, False), ('reference_knots', 12.0, False),
    ('integral_pa_per_m_s', 5e6, True)])
def test_other_settings_keep_rules_only_where_these_keep_their_meaning(name, value, keeps):
    controller = controller_of()
    controller.rules.path[0] = 1e3
    fresh = controller.with_settings({**controller.settings, name: value})
    assert fresh.settings[name] == value and bool(fresh.rules.path.any()) == keeps


STILL = {'predicted_proportional_pa_per_m': 0.0, 'predicted_derivative_pa_s_per_m': 0.0,
         'disturbance_time_s': 0.0}      # nothing answers to the open loop


# What of a table does not change with the motion itself.
STEADY = {'feedforward': ..., 'motion': ..., 'path': 0, 'numbers': [0, RATE, ACCELERATION]}


@pytest.mark.parametrize('name, share', [
    ('feedforward', 1.0), ('motion', 1.0), ('path', 1.0), ('numbers', 1.0),
    ('feedforward', 0.4), ('motion', 0.4)])
def test_an_exchange_makes_no_step_in_the_command(name, share):
    one, other = controller_of(**STILL), controller_of(**STILL)
    for controller in (one, other):
        drive(controller, range(400))
        fields(controller._state, STATE).rules_share = share
        drive(controller, [400], learn=False)
    rules = other.rules.copy()
    getattr(rules, name)[STEADY[name]] += 3e3
    other.replace_rules(rules)
    commands, _ = drive(one, range(401, 404), learn=False)
    again, _ = drive(other, range(401, 404), learn=False)
    assert np.abs(again - commands).max() < 300.0


@pytest.mark.parametrize('name, share', [
    ('feedforward', 1.0), ('motion', 1.0), ('path', 1.0), ('feedforward', 0.4)])
def test_a_roll_back_makes_no_step_in_the_command(name, share):
    found = {}
    for guard_ratio in (0.0, 1.5):
        controller = controller_of(**STILL, guard_ratio=guard_ratio)
        drive(controller, range(480))
        getattr(controller.rules, name)[STEADY[name]] += 3e3
        st = fields(controller._state, STATE)
        # Two windows that are worse and worse; the next turn of the reference ends the second.
        st.window.ticks, st.window.turns, st.window.squares_m2 = 1e4, 1.0, 1.0
        st.window.speeds_m_per_s = st.best_speed_m_per_s = 100.0
        st.best_speed_m_per_s /= 1e4
        st.best_rms_m, st.former_rms_m, st.bad_windows, st.direction = 1e-4, 2e-4, 1.0, -1.0
        st.rules_share = share
        found[guard_ratio], outputs = drive(controller, range(480, 490))
    after = 1 + of(outputs, 'times_rolled_back').tolist().index(1.0)
    assert np.abs(found[1.5] - found[0.0])[:after + 1].max() < 100.0

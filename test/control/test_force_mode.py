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

"""Force mode: files, the equivalent contraction, the table that follows the muscle, faults."""

import math

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.control.modes.force_surface import nominal_stiffness_n_per_m
from pam_actuation.control.modes.tracked import FORCE
from pam_actuation.control.reference_buffer import ReferenceBuffer
from pam_actuation.control.sofc.words import ranked
from pam_actuation.control.static_inverse import inverse_pressure_pa
from pam_actuation.messages import (
    Contraction, Force, Pressure, Reference, ReferenceTrajectory)
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.units import P_ATM_PA
import pytest

MS = 1_000_000
START = 1_700_000_000_000_000_123
TEXT = 'controller: sofc\nmode: force\n'


@pytest.fixture(scope='module')
def rig():
    return load_rig('dmsp_5_300_isometric')


def by_name(names, values):
    return dict(zip(names, values))


def test_the_inverse_is_that_of_the_present_contraction(rig):
    controller = load_controller(TEXT, rig)
    for contraction_m in (0.0, 0.0047, 0.0208):
        controller.pause()
        for _ in range(3):
            controller.step(contraction_m, 40.0, 0.0, 40.0, 0.0, pressure_pa=3e5, force_n=40.0)
        wanted = rig.static_pressure_pa(contraction_m, 40.0)
        found = inverse_pressure_pa(
            controller.static_inverse, 40.0 / controller.stiffness_n_per_m)
        assert found == pytest.approx(wanted, abs=1500.0)


def test_a_moving_muscle_gets_the_pressure_of_where_it_will_be(rig):
    controller = load_controller(TEXT, rig)
    for k in range(200):
        x_m = 0.005 + 0.01 * k / 200
        controller.step(x_m, 40.0, 0.0, 40.0, 0.0, pressure_pa=3e5, force_n=40.0)
    ahead = by_name(controller.state_names, controller.state_values())['contraction_ahead_m']
    assert ahead == pytest.approx(x_m + controller.lead_s * 0.01, abs=1e-5)


def test_the_law_sees_newtons_over_the_stiffness(rig):
    controller = load_controller(TEXT + 'force: {stiffness_n_per_m: 2000}\n', rig)
    for _ in range(400):
        controller.step(0.0, 30.0, 0.0, 30.0, 0.0, pressure_pa=2.2e5, force_n=29.0)
    state = by_name(controller.state_names, controller.state_values())
    assert state['error_m'] == pytest.approx(1.0 / 2000.0, abs=1e-6)
    assert state['force_error_n'] == 1.0


@pytest.mark.parametrize('wanted_n, force_n, slack', [(30.0, 0.2, True), (1.0, 0.5, False)])
def test_only_a_tendon_that_should_pull_can_be_slack(rig, wanted_n, force_n, slack):
    controller = load_controller(TEXT, rig)
    pressure_pa, reasons = P_ATM_PA, set()
    for _ in range(600):
        # The pressure follows: nothing but the tendon can be wrong.
        pressure_pa = controller.step(
            0.0, wanted_n, 0.0, wanted_n, 0.0, pressure_pa=pressure_pa, force_n=force_n)
        reasons.add(controller.learning_reason())
    assert ('muscle slack' in reasons) is slack


def test_a_text_brings_all_a_replay_needs(rig):
    controller = load_controller(TEXT, rig)
    text = controller.to_yaml()
    again = load_controller(text)
    assert again.to_yaml() == text
    steps = [(0.004, 20.0 + k, 50.0, 22.0 + k, 50.0, True, math.nan, 2e5, 19.0) for k in range(9)]
    assert [controller.step(*s) for s in steps] == [again.step(*s) for s in steps]


def test_rules_of_another_mode_or_stiffness_do_not_fit(rig):
    hanging = load_rig('dmsp_5_300_hanging_mass')
    contraction = load_controller('controller: sofc\nsettings: {}\n', hanging)
    controller = load_controller(TEXT, rig)
    other = load_controller(TEXT + 'force: {stiffness_n_per_m: 900}\n', rig)
    for rules in (contraction.rules, other.rules):
        with pytest.raises(InputError, match='learned with .*mode'):
            controller.replace_rules(rules)


@pytest.mark.parametrize('text, words', [
    ('controller: sofc\nmode: torque\n', 'contraction, force, joint'),
    (TEXT + 'force: {stiffness: 1}\n', 'stiffness'),
    (TEXT + 'force: {stiffness_n_per_m: 0}\n', 'allowed'),
    (TEXT + 'joint: {co_contraction_gauge_pa: 1}\n', 'belongs to `mode: joint`'),
    ('controller: sofc\nforce: {contraction_m: 0}\n', 'belongs to `mode: force`'),
    ('controller: sofc\nsettings: {}\n', 'mode: force'),
    ('controller: sofc\nmode: joint\n', 'single muscle')])
def test_mistakes_are_refused_with_their_place(rig, text, words):
    with pytest.raises(InputError) as caught:
        load_controller(text, rig)
    assert words in str(caught.value) and 'controller text:' in str(caught.value)


def test_stiffness_is_the_slope_of_the_static_force(rig):
    law, length_m = rig.muscle.law.law, rig.muscle.length_m
    middle_m = 0.5 * rig.static_contraction_m(P_ATM_PA + 3e5, 0.0)
    force_n = law.force_n(3e5, np.array([middle_m - 1e-4, middle_m + 1e-4]) / length_m)
    assert nominal_stiffness_n_per_m(rig) == pytest.approx(-np.diff(force_n)[0] / 2e-4, rel=1e-3)


def ready(rig):
    loop = ControllerLoop(load_controller(TEXT, rig))
    loop.take('reference', Reference(START, force_n=20.0))
    return loop


def test_the_loop_needs_a_force_and_no_contraction(rig):
    loop = ready(rig)
    loop.take('contraction', Contraction(START, 0.01))
    assert loop.tick(START)[0][0].pressure_pa == P_ATM_PA
    assert not loop.valid and loop.reason == 'no force measured yet'
    loop = ready(rig)
    loop.take('force', Force(START, 15.0))
    loop.take('pressure', Pressure(START, 2e5))
    (command,), state = loop.tick(START)
    assert loop.valid and command.pressure_pa > P_ATM_PA
    state = by_name(state.names, state.values)
    assert state['reference_n'] == 20.0 and 'reference_m' not in state
    assert math.isnan(state['contraction_m']) and state['contraction_stamp_sec'] == -1.0


@pytest.mark.parametrize('message, words', [
    (Force(START - 101 * MS, 15.0), 'older'), (Force(START + 21 * MS, 15.0), 'ahead'),
    (Force(START, math.nan), 'finite'), (Force(START, 1e4), 'outside')])
def test_an_unusable_force_vents_and_recovers(rig, message, words):
    loop = ready(rig)
    loop.take('force', Force(START, 15.0))
    loop.take('pressure', Pressure(START, 2e5))
    loop.tick(START)
    loop.take('force', message)
    assert loop.tick(START)[0][0].pressure_pa == P_ATM_PA
    assert 'force' in loop.reason and words in loop.reason
    loop.take('force', Force(START, 15.0))
    assert loop.tick(START)[0][0].pressure_pa > P_ATM_PA


def test_a_reference_in_metres_says_nothing_to_force_mode(rig):
    loop = ControllerLoop(load_controller(TEXT, rig))
    loop.take('force', Force(START, 15.0))
    loop.take('reference', Reference(START, 0.01, 0.0))
    loop.tick(START)
    assert loop.rejected_references == 1 and 'no reference' in loop.reason


def test_a_trajectory_of_forces_is_followed_along_straight_lines():
    buffer = ReferenceBuffer(FORCE)
    message = ReferenceTrajectory(START, (0, 20 * MS, 600 * MS), force_n=(20.0, 22.0, 22.0))
    assert buffer.set_trajectory(message)
    assert buffer.at(START, START + 5 * MS) == pytest.approx((20.5, 100.0))
    assert not buffer.set_trajectory(ReferenceTrajectory(START, (0,), (0.01,), (0.0,)))


def test_a_joint_has_no_place_in_the_loop_of_one_muscle():
    from pam_sim.joint import load_joint
    controller = load_controller('controller: sofc\nmode: joint\n', load_joint('joint_dmsp_5_300'))
    with pytest.raises(InputError, match='one muscle'):
        ControllerLoop(controller)


def test_rules_read_in_newtons(rig):
    rules = load_controller('sofc_force_ppr', rig).rules
    reference = rules.tables()[1].antecedents[1]
    assert reference.unit == 'N' and reference.knots[-1] == pytest.approx(0.08 * 1769.5)
    rules.motion[5, -1] = 3e3
    rules.motion_fired[5, -1] = 10.0
    assert rules.tables()[1].antecedents[0].words == ('rising', 'falling')
    assert any('N' in one.sentence and 'rising at' in one.sentence for one in ranked(rules))


def test_rule_files_keep_what_is_tracked(rig, tmp_path):
    rules = load_controller('sofc_force_ppr', rig).rules
    rules.motion[5, 3] = 3e3
    path = tmp_path / 'rules.json'
    rules.save(path)
    again = load_controller('sofc_force_ppr', rig, rules_file=path)
    assert again.rules.digest() == rules.digest() and again.rules.scaling == rules.scaling
    for name, value in (
            ('tracked_unit', 'lbf'), ('tracked_per_m', -1.0), ('tracked_zero_m', None)):
        spoiled = rules.copy()
        spoiled.scaling[name] = value
        if value is None:
            del spoiled.scaling[name]
        spoiled.save(path)
        with pytest.raises(InputError, match='tracked'):
            load_controller('sofc_force_ppr', rig, rules_file=path)

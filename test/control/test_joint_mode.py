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

"""Joint mode: the pair of pressures as one, co-contraction, limits, files."""

import math

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.modes.joint_statics import as_one, pair_of
from pam_actuation.control.static_inverse import inverse_pressure_pa
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
from pam_sim.units import P_ATM_PA
import pytest

TEXT = 'controller: sofc\nmode: joint\n'
LOW, HIGH = P_ATM_PA, P_ATM_PA + 6e5


@pytest.fixture(scope='module')
def joint():
    return load_joint('joint_dmsp_5_300')


def settle(controller, joint, angle_rad, wanted_rad, ticks=400):
    """Hold the limb at an angle; return the last commands."""
    commands = (P_ATM_PA, P_ATM_PA)
    for _ in range(ticks):
        commands = controller.step(
            angle_rad, wanted_rad, 0.0, wanted_rad, 0.0, pressures_pa=commands,
            forces_n=(10.0, 10.0))
    return commands


@pytest.mark.parametrize('co_contraction_pa', [LOW, LOW + 2.2e5, HIGH])
def test_the_difference_is_kept_and_co_contraction_gives_way(co_contraction_pa):
    for u_pa in np.linspace(LOW, HIGH, 25):
        flexor, extensor = pair_of(u_pa, co_contraction_pa, LOW, HIGH, HIGH)
        assert LOW - 1e-6 <= min(flexor, extensor) and max(flexor, extensor) <= HIGH + 1e-6
        assert as_one(flexor, extensor, LOW, HIGH) == pytest.approx(u_pa)
        size = 0.5 * abs(flexor - extensor)
        if LOW + size <= co_contraction_pa <= HIGH - size:
            assert 0.5 * (flexor + extensor) == pytest.approx(co_contraction_pa)
    assert pair_of(HIGH + 1e5, co_contraction_pa, LOW, HIGH, HIGH) == pytest.approx((HIGH, LOW))


def test_the_static_pair_holds_the_angle(joint):
    table = load_controller(TEXT, joint).static_inverse
    for angle_rad in (-0.3, 0.0, 0.2):
        u_pa = inverse_pressure_pa(table, joint.contractions_m(angle_rad)[0])
        flexor_pa, extensor_pa = pair_of(u_pa, P_ATM_PA + 3e5, LOW, HIGH, HIGH)
        assert joint.static_angle_rad(flexor_pa, extensor_pa) == pytest.approx(angle_rad, abs=2e-3)
        assert 0.5 * (flexor_pa + extensor_pa) == pytest.approx(P_ATM_PA + 3e5)


def test_start_takes_over_the_pressures_that_are_there(joint):
    controller = load_controller(TEXT, joint)
    first = controller.step(0.0, 0.0, 0.0, 0.0, 0.0, pressures_pa=(P_ATM_PA + 1e5,) * 2)
    assert first == pytest.approx((P_ATM_PA + 1e5,) * 2, abs=3e3)
    assert settle(controller, joint, 0.0, 0.0) == pytest.approx((P_ATM_PA + 3e5,) * 2)


@pytest.mark.parametrize('law', ['sofc', 'pid'])
def test_start_without_pressures_begins_with_both_muscles_vented(joint, law):
    controller = load_controller(TEXT.replace('sofc', law), joint)
    for _ in range(2):
        flexor_pa, extensor_pa = controller.step(0.0, 0.0, 0.0, 0.0, 0.0)
        assert max(flexor_pa, extensor_pa) - P_ATM_PA < 1e4      # was 300 kPa in the extensor
        for _ in range(400):
            commands = controller.step(0.0, 0.0, 0.0, 0.0, 0.0)
        assert commands == pytest.approx((P_ATM_PA + 3e5,) * 2, abs=1e3)
        controller.pause()


def test_after_another_law_it_goes_on_from_those_commands(joint):
    controller = load_controller(TEXT, joint)
    commands = (P_ATM_PA + 2.5e5, P_ATM_PA + 1.5e5)
    controller.stand_aside(commands)
    assert controller.step(0.0, 0.0, 0.0, 0.0, 0.0) == pytest.approx(commands, abs=2e4)


def test_out_of_reach_saturates_without_winding_up(joint):
    controller = load_controller(TEXT, joint)
    settle(controller, joint, 0.0, 0.9, 2000)
    state = dict(zip(controller.state_names, controller.state_values()))
    assert state['saturated_high'] == 1.0
    assert (state['flexor_command_pa'], state['extensor_command_pa']) == pytest.approx((HIGH, LOW))
    assert abs(state['integral_pa']) <= controller.settings['integral_limit_pa']
    back = settle(controller, joint, 0.9, 0.9, 100)
    assert back[0] < HIGH - 1e3


def test_a_text_brings_all_a_replay_needs(joint):
    controller = load_controller(TEXT + 'joint: {co_contraction_gauge_pa: 250000}\n', joint)
    text = controller.to_yaml()
    again = load_controller(text)
    assert again.to_yaml() == text
    steps = [(0.01 * k, 0.1, 0.0, 0.1, 0.0, True, math.nan, (2e5, 3e5)) for k in range(9)]
    assert [controller.step(*s) for s in steps] == [again.step(*s) for s in steps]


def test_the_weaker_tendon_tells_whether_the_muscles_are_slack(joint):
    controller = load_controller(TEXT, joint)
    commands = (P_ATM_PA + 3e5,) * 2
    for _ in range(600):
        commands = controller.step(0.0, 0.05, 0.0, 0.05, 0.0, pressures_pa=commands,
                                   forces_n=(9.0, 0.1))
    assert controller.learning_reason() == 'muscle slack'


@pytest.mark.parametrize('text, words', [
    (TEXT + 'joint: {radius_m: 1}\n', 'radius_m'),
    (TEXT + 'joint: {co_contraction_gauge_pa: 700000}\n', 'pressure limits'),
    (TEXT + 'force: {contraction_m: 0}\n', 'belongs to `mode: force`'),
    ('controller: sofc\nmode: force\n', 'is a joint'),
    ('controller: sofc\nsettings: {}\n', 'needs `mode: joint`')])
def test_mistakes_are_refused_with_their_place(joint, text, words):
    with pytest.raises(InputError) as caught:
        load_controller(text, joint)
    assert words in str(caught.value) and 'controller text:' in str(caught.value)


def test_rules_read_in_degrees(joint):
    reference = load_controller(TEXT, joint).rules.tables()[1].antecedents[1]
    assert reference.unit == 'rad'
    assert joint.contractions_m(reference.knots[3])[0] == pytest.approx(3 * 0.03 / 24)

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

"""A wanted torque of a joint: the pressures that give it, limits, stops, feedback."""

import math

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.joint_torque import JointTorque, STOP_ZONE_RAD
from pam_sim.joint import load_joint
from pam_sim.units import P_ATM_PA
import pytest

LOW, HIGH = P_ATM_PA, P_ATM_PA + 6e5
NOT_MEASURED = (math.nan, math.nan)
RADIUS_M = 0.012


@pytest.fixture(scope='module')
def joint():
    """Return a nominal joint without weight: its static torque is that of the tendons."""
    return load_joint('joint_dmsp_5_300').with_(parameters={'gravity_m_per_s2': 0.0})


@pytest.fixture(scope='module')
def controller(joint):
    return load_controller('sofc_joint_ppr', joint)


@pytest.fixture
def law(joint, controller):
    return JointTorque(joint, controller)


def settle(law, wanted_n_m, angle_rad=0.0, mean_pa=P_ATM_PA + 3e5, forces_n=NOT_MEASURED,
           ticks=400):
    commands = (mean_pa, mean_pa)
    for _ in range(ticks):
        commands = law.step(angle_rad, wanted_n_m, mean_pa, forces_n, commands)
    return commands


@pytest.mark.parametrize('angle_rad', [-0.3, 0.0, 0.4])
def test_the_pressures_give_the_torque_at_any_stiffness(joint, law, angle_rad):
    for wanted_n_m in (-0.3, 0.2):
        stiffness = []
        for gauge_pa in (2e5, 3.5e5):
            law.pause()
            pair = settle(law, wanted_n_m, angle_rad, P_ATM_PA + gauge_pa)
            assert joint.static_torque_n_m(angle_rad, *pair) == pytest.approx(
                wanted_n_m, abs=2e-3)
            assert np.mean(pair) == pytest.approx(P_ATM_PA + gauge_pa)
            stiffness.append(joint.stiffness_n_m_per_rad(angle_rad, *pair))
        assert stiffness[1] > 1.2 * stiffness[0]


def test_more_torque_to_flexion_is_more_flexor_pressure(law):
    flexor_pa = [settle(law, wanted_n_m)[0] for wanted_n_m in (-0.4, 0.0, 0.4)]
    assert flexor_pa[0] + 5e4 < flexor_pa[1] < flexor_pa[2] - 5e4


def test_torque_comes_before_co_contraction(joint, law):
    pair = settle(law, 0.5, mean_pa=P_ATM_PA + 5.5e5)
    assert pair[0] == pytest.approx(HIGH) and np.mean(pair) < P_ATM_PA + 5.1e5
    assert joint.static_torque_n_m(0.0, *pair) == pytest.approx(0.5, abs=2e-3)


def test_out_of_reach_saturates_without_winding_up(joint, law):
    most_n_m = joint.static_torque_n_m(0.0, HIGH, LOW)
    for sign, pair in ((1.0, (HIGH, LOW)), (-1.0, (LOW, HIGH))):
        law.pause()
        seen = []
        for _ in range(2):
            assert settle(law, sign * 5.0, forces_n=(10.0, 10.0)) == pytest.approx(pair)
            seen.append(law.state_values())
        assert seen[0] == seen[1]       # though the torque is short of the wish all the time
        assert seen[0][:2] == pytest.approx((sign * most_n_m, 0.0), abs=2e-3)


def test_feedback_adds_what_the_muscles_lack_and_needs_both_forces(law):
    pair = settle(law, 0.3)
    assert settle(law, 0.3, forces_n=(40.0, math.nan), ticks=100) == pytest.approx(
        pair, abs=100.0)
    short = settle(law, 0.3, forces_n=(0.25 / RADIUS_M, 0.0), ticks=100)
    _, measured_n_m, integral_n_m = law.state_values()
    assert measured_n_m == pytest.approx(0.25)
    assert integral_n_m == pytest.approx(0.05, rel=0.03)    # 0.05 N m over 0.5 s for 0.5 s
    assert short[0] > pair[0] + 5e3


@pytest.mark.parametrize('way, share', [(0.0, 0.0), (0.5, 0.5), (1.0, 1.0)])
def test_towards_a_stop_the_torque_fades_and_away_from_it_stays(joint, law, way, share):
    for sign, stop_rad in zip((-1.0, 1.0), joint.range_rad):
        angle_rad = stop_rad - sign * way * STOP_ZONE_RAD
        settle(law, sign * 0.1, angle_rad, ticks=3)
        assert law.state_values()[0] == pytest.approx(sign * 0.1 * share)
        settle(law, -sign * 0.1, angle_rad, ticks=3)
        assert law.state_values()[0] == pytest.approx(-sign * 0.1)


def test_it_starts_from_the_pressures_before_and_goes_to_the_wish(law):
    before = (P_ATM_PA + 3.2e5, P_ATM_PA + 2.6e5)
    first = law.step(0.1, -0.3, P_ATM_PA + 2.9e5, NOT_MEASURED, before)
    assert first == pytest.approx(before, abs=10.0)
    pair = settle(law, -0.3, 0.1, P_ATM_PA + 2.9e5)
    assert np.mean(pair) == pytest.approx(P_ATM_PA + 2.9e5) and pair[1] > pair[0] + 1e5
    law.pause()
    assert law.step(0.1, 0.0, LOW, NOT_MEASURED, NOT_MEASURED) == pytest.approx((LOW, LOW))

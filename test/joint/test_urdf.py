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

"""Test the robot description: what it says is what the joint is."""

import math
import xml.etree.ElementTree as ElementTree

from pam_sim.joint import load_joint
from pam_sim.joint.statics import static_torque
from pam_sim.joint.urdf import joint_urdf, PRESSURE_PA
from pam_sim.units import P_ATM_PA
import pytest


@pytest.mark.parametrize('name', ['joint_dmsp_5_300', 'knee_dmsp_20_300'])
def test_limits_mass_and_inertia_are_those_of_the_joint(name):
    joint = load_joint(name)
    value = joint.parameters
    robot = ElementTree.fromstring(joint_urdf(joint, 'left_knee').partition('?>')[2])
    assert [link.get('name') for link in robot.findall('link')] == [
        'left_knee_base', 'left_knee_limb']
    revolute, = robot.findall('joint')
    limit = revolute.find('limit')
    assert (float(limit.get('lower')), float(limit.get('upper'))) == pytest.approx(
        joint.range_rad)
    flexion = static_torque(
        joint.with_(parameters={'gravity_m_per_s2': 0.0}), joint.range_rad[0],
        (PRESSURE_PA, P_ATM_PA), 0.0)
    assert float(limit.get('effort')) >= 0.99 * flexion > 0.0
    assert float(revolute.find('origin').get('rpy').split()[1]) == pytest.approx(
        -value['hanging_angle_rad'])
    inertial = robot.findall('link')[1].find('inertial')
    mass = float(inertial.find('mass').get('value'))
    down = -float(inertial.find('origin').get('xyz').split()[2])
    swing = float(inertial.find('inertia').get('iyy'))
    assert mass == pytest.approx(value['limb_mass_kg'])
    assert swing + mass * down ** 2 == pytest.approx(value['inertia_kg_m2'], rel=1e-6)
    assert math.isclose(down, value['centre_of_mass_m'], rel_tol=1e-6)

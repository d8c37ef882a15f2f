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

"""Test the robot descriptions: what they say is what joint and muscle are."""

import copy
import math
import xml.etree.ElementTree as ElementTree

from pam_sim import load_rig, urdf
from pam_sim.joint import load_joint
from pam_sim.joint.parameters import SIDES
from pam_sim.joint.statics import static_torque
from pam_sim.joint.urdf import joint_urdf, PRESSURE_PA
from pam_sim.units import P_ATM_PA
from pam_sim.urdf import muscle_urdf
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


def parsed(text):
    """Return the robot of a URDF that has one root, no loop and only known colours."""
    robot = ElementTree.fromstring(text.partition('?>')[2])
    links = [link.get('name') for link in robot.findall('link')]
    joints = {joint.get('name'): joint for joint in robot.findall('joint')}
    children = [joint.find('child').get('link') for joint in joints.values()]
    parents = [joint.find('parent').get('link') for joint in joints.values()]
    assert len({*links}) == len(links) == len(children) + 1 == len(joints) + 1
    assert {*children} < {*links} >= {*parents} and {*links} - {*children} == {links[0]}
    colours = {one.get('name') for one in robot.findall('material')}
    assert {one.get('name') for one in robot.iter('material')} == colours
    for joint in joints.values():
        limit = {key: float(value) for key, value in joint.find('limit').items()}
        assert limit['lower'] < limit['upper'] and limit['effort'] > 0.0 < limit['velocity']
    for inertial in robot.iter('inertial'):
        assert float(inertial.find('mass').get('value')) > 0.0
        moments = sorted(float(inertial.find('inertia').get(key))
                         for key in ('ixx', 'iyy', 'izz'))
        assert 0.0 < moments[0] and moments[2] <= moments[0] + moments[1] + 1e-12
    return robot, joints


def tubes(robot, link):
    """Return (radius, bottom, top) of the tubes of a muscle that are drawn on a link."""
    found = []
    for visual in robot.find(f"link[@name='{link}']").findall('visual'):
        if visual.find('material').get('name') in ('braid', 'rod'):
            shape, (x, _, z) = visual.find('geometry/cylinder'), map(
                float, visual.find('origin').get('xyz').split())
            half = float(shape.get('length')) / 2.0
            found.append((float(shape.get('radius')), x, z - half, z + half))
    return found


def check_shortens(outer, inner, lower_end_m, stroke_m, length_m):
    """Check that outer and inner tube make up the muscle at every contraction."""
    _, _, low, top = outer
    for contraction_m in (0.0, stroke_m):
        begin = lower_end_m + contraction_m + inner[2]
        assert top - begin == pytest.approx(length_m - contraction_m)       # both ends
        assert low < lower_end_m + contraction_m + inner[3] <= top          # no gap, not beyond
        assert begin < low                                                  # some is to be seen
    assert inner[0] < outer[0]


@pytest.mark.parametrize('name', ['dmsp_5_300_realistic', 'dmsp_20_300_hanging_mass'])
def test_a_muscle_is_as_long_and_as_heavy_as_that_of_the_rig(name):
    rig = load_rig(name)
    robot, joints = parsed(muscle_urdf(rig, 'muscle', 'left'))
    slide, = joints.values()
    assert joints == {'muscle': slide} and slide.get('type') == 'prismatic'
    assert [link.get('name') for link in robot.findall('link')] == ['left_base', 'left_end']
    assert float(slide.find('limit').get('upper')) == pytest.approx(rig.muscle.stroke_m)
    assert float(robot.find('.//mass').get('value')) == pytest.approx(rig.parameters['mass_kg'])
    lower_end_m = float(slide.find('origin').get('xyz').split()[2])
    outer, = tubes(robot, 'left_base')
    inner, = tubes(robot, 'left_end')
    check_shortens(outer, inner, lower_end_m, rig.muscle.stroke_m, rig.muscle.length_m)


def test_a_muscle_without_a_mass_has_none():
    robot, _ = parsed(muscle_urdf(load_rig('dmsp_5_300_isometric'), 'muscle'))
    assert robot.find('.//mass') is None


@pytest.mark.parametrize('name', ['joint_dmsp_5_300', 'knee_dmsp_20_300'])
def test_the_muscles_of_a_joint_shorten_as_the_pulleys_have_it(name):
    joint = load_joint(name)
    plain = ElementTree.fromstring(joint_urdf(joint, 'knee').partition('?>')[2])
    robot, joints = parsed(joint_urdf(joint, 'knee', muscles=True))
    assert list(joints) == ['knee', 'knee_flexor', 'knee_extensor']
    for part in ('joint', "link[@name='knee_limb']"):       # the same joint, with a picture
        one, other = plain.find(part), robot.find(part)
        assert list(one.itertext()) == list(other.itertext())
        assert [(each.tag, each.attrib) for each in one.iter()] == [
            (each.tag, each.attrib) for each in other.iter()]
    outer = dict(zip(SIDES, tubes(robot, 'knee_base')))
    for angle_rad in (*joint.range_rad, 0.1):
        for side, contraction_m in zip(SIDES, joint.contractions_m(angle_rad)):
            mimic = joints[f'knee_{side}'].find('mimic')
            assert mimic.get('joint') == 'knee'
            assert (float(mimic.get('multiplier')) * angle_rad + float(mimic.get('offset'))
                    == pytest.approx(contraction_m, abs=1e-9))
    for side, sign in zip(SIDES, (-1.0, 1.0)):
        muscle = getattr(joint, side).muscle
        x, _, low = map(float, joints[f'knee_{side}'].find('origin').get('xyz').split())
        inner, = tubes(robot, f'knee_{side}')
        assert x == outer[side][1] == sign * joint.parameters[f'{side}_radius_m']
        check_shortens(outer[side], inner, low, muscle.stroke_m, muscle.length_m)


def test_the_inertia_of_another_load_is_no_hanging_mass(monkeypatch):
    monkeypatch.setattr(urdf, 'largest_force_n', lambda rig: 100.0)
    rig = load_rig('dmsp_5_300_hanging_mass')
    assert list(parsed(muscle_urdf(rig, 'biceps'))[0].iter('inertial'))
    other = copy.copy(rig)
    vars(other).update(load='pendulum')         # as of PAM_LOADS_PATH, with its own `mass_kg`
    assert not list(parsed(muscle_urdf(other, 'biceps'))[0].iter('inertial'))

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

"""
A joint as URDF, the robot description that other programs of a stack read.

Two links, base and limb, and one revolute joint about y. The base has x forward and z up; a
positive angle turns the limb, which points down at ``hanging_angle_rad``, backwards, as a knee
flexes. Inertia is that of the joint's parameters, moved to the centre of mass. For a picture the
muscles are added: each has a prismatic joint that follows the angle as the pulley has it.
"""

from typing import TYPE_CHECKING
import xml.etree.ElementTree as ElementTree

from pam_sim.joint.parameters import SIDES
from pam_sim.joint.statics import largest_torque_n_m
from pam_sim.urdf import (
    add_colours, add_cylinder, add_inner_tube, add_limit, add_muscle_joint, add_outer_tube,
    as_text, largest_force_n, numbers, PRESSURE_PA, VELOCITY_M_PER_S)

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

    from pam_sim.joint.rig import JointRig

VELOCITY_RAD_PER_S = 10.0               # URDF asks for a number; nothing here limits the rate
SLENDERNESS = 0.02                      # inertia about the limb's own axis, share of the other
LYING = '1.57079633 0 0'                # a cylinder along y


def joint_urdf(joint: 'JointRig', name: str, muscles: bool = False) -> str:
    """
    Return the text of a URDF with the links ``NAME_base`` and ``NAME_limb``.

    Parameters
    ----------
    joint : JointRig
        With its muscles.
    name : str
        Name of the joint, as in ``name`` of its messages.
    muscles : bool
        Also draw the muscles: the links ``NAME_flexor`` and ``NAME_extensor`` on joints of the
        same names, which mimic the joint.

    """
    value = joint.parameters
    lower, upper = joint.range_rad
    robot = ElementTree.Element('robot', name=name)
    ElementTree.SubElement(robot, 'link', name=f'{name}_base')
    _limb(robot, f'{name}_limb', value)
    revolute = ElementTree.SubElement(robot, 'joint', name=name, type='revolute')
    ElementTree.SubElement(revolute, 'parent', link=f'{name}_base')
    ElementTree.SubElement(revolute, 'child', link=f'{name}_limb')
    ElementTree.SubElement(
        revolute, 'origin', xyz='0 0 0', rpy=f'0 {numbers(-value["hanging_angle_rad"])} 0')
    ElementTree.SubElement(revolute, 'axis', xyz='0 1 0')
    add_limit(revolute, lower, upper, largest_torque_n_m(joint, PRESSURE_PA), VELOCITY_RAD_PER_S)
    ElementTree.SubElement(revolute, 'dynamics', damping=numbers(value['damping_n_m_s']),
                           friction=numbers(value['friction_n_m']))
    if muscles:
        _muscles(robot, joint, name)
    return as_text(robot)


def _muscles(robot: 'Element', joint: 'JointRig', name: str) -> None:
    """Add both muscles above the axis, each over its pulley: the flexor behind, where x < 0."""
    add_colours(robot)
    base, value = robot.find('link'), joint.parameters
    assert base is not None
    for side, sign in zip(SIDES, (1.0, -1.0)):
        rig, radius_m = getattr(joint, side), value[f'{side}_radius_m']
        muscle = rig.muscle
        add_cylinder(base, (0.0, 0.004 * sign, 0.0), 0.008, radius_m, 'load', LYING)
        x_m, low_m = -sign * radius_m, muscle.stroke_m
        add_outer_tube(base, muscle, (x_m, 0.0, low_m + muscle.length_m))
        end = ElementTree.SubElement(robot, 'link', name=f'{name}_{side}')
        add_inner_tube(end, muscle, low_m)
        slide = add_muscle_joint(robot, f'{name}_{side}', f'{name}_base', f'{name}_{side}',
                                 (x_m, 0.0, low_m))
        add_limit(slide, 0.0, muscle.stroke_m, largest_force_n(rig), VELOCITY_M_PER_S)
        ElementTree.SubElement(slide, 'mimic', joint=name, multiplier=numbers(sign * radius_m),
                               offset=numbers(value[f'{side}_contraction_at_zero_m']))


def _limb(robot: 'Element', name: str, value: dict[str, float]) -> None:
    """Add the link of the limb: a rod that hangs down from the axis."""
    down_m, mass_kg = value['centre_of_mass_m'], value['limb_mass_kg']
    swing = max(value['inertia_kg_m2'] - mass_kg * down_m ** 2, 0.0)
    link = ElementTree.SubElement(robot, 'link', name=name)
    inertial = ElementTree.SubElement(link, 'inertial')
    at_centre = {'xyz': f'0 0 {numbers(-down_m)}', 'rpy': '0 0 0'}
    ElementTree.SubElement(inertial, 'origin', at_centre)
    ElementTree.SubElement(inertial, 'mass', value=numbers(mass_kg))
    ElementTree.SubElement(
        inertial, 'inertia', ixx=numbers(swing), iyy=numbers(swing),
        izz=numbers(SLENDERNESS * swing), ixy='0', ixz='0', iyz='0')
    visual = ElementTree.SubElement(link, 'visual')
    ElementTree.SubElement(visual, 'origin', at_centre)
    shape = ElementTree.SubElement(visual, 'geometry')
    ElementTree.SubElement(
        shape, 'cylinder', radius=numbers(0.1 * down_m), length=numbers(2.0 * down_m))

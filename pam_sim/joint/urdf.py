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
flexes. Inertia is that of the joint's parameters, moved to the centre of mass.
"""

from typing import TYPE_CHECKING
import xml.etree.ElementTree as ElementTree

from pam_sim.joint.statics import largest_torque_n_m
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

    from pam_sim.joint.rig import JointRig

PRESSURE_PA = P_ATM_PA + 600_000.0      # the pressure limit for which effort is stated
VELOCITY_RAD_PER_S = 10.0               # URDF asks for a number; nothing here limits the rate
SLENDERNESS = 0.02                      # inertia about the limb's own axis, share of the other


def joint_urdf(joint: 'JointRig', name: str) -> str:
    """
    Return the text of a URDF with the links ``NAME_base`` and ``NAME_limb``.

    Parameters
    ----------
    joint : JointRig
        With its muscles.
    name : str
        Name of the joint, as in ``name`` of its messages.

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
        revolute, 'origin', xyz='0 0 0', rpy=f'0 {_text(-value["hanging_angle_rad"])} 0')
    ElementTree.SubElement(revolute, 'axis', xyz='0 1 0')
    ElementTree.SubElement(
        revolute, 'limit', lower=_text(lower), upper=_text(upper),
        effort=_text(largest_torque_n_m(joint, PRESSURE_PA)), velocity=_text(VELOCITY_RAD_PER_S))
    ElementTree.SubElement(revolute, 'dynamics', damping=_text(value['damping_n_m_s']),
                           friction=_text(value['friction_n_m']))
    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding='unicode') + '\n'


def _limb(robot: 'Element', name: str, value: dict[str, float]) -> None:
    """Add the link of the limb: a rod that hangs down from the axis."""
    down_m, mass_kg = value['centre_of_mass_m'], value['limb_mass_kg']
    swing = max(value['inertia_kg_m2'] - mass_kg * down_m ** 2, 0.0)
    link = ElementTree.SubElement(robot, 'link', name=name)
    inertial = ElementTree.SubElement(link, 'inertial')
    at_centre = {'xyz': f'0 0 {_text(-down_m)}', 'rpy': '0 0 0'}
    ElementTree.SubElement(inertial, 'origin', at_centre)
    ElementTree.SubElement(inertial, 'mass', value=_text(mass_kg))
    ElementTree.SubElement(
        inertial, 'inertia', ixx=_text(swing), iyy=_text(swing), izz=_text(SLENDERNESS * swing),
        ixy='0', ixz='0', iyz='0')
    visual = ElementTree.SubElement(link, 'visual')
    ElementTree.SubElement(visual, 'origin', at_centre)
    shape = ElementTree.SubElement(visual, 'geometry')
    ElementTree.SubElement(
        shape, 'cylinder', radius=_text(0.1 * down_m), length=_text(2.0 * down_m))


def _text(number: float) -> str:
    return f'{number:.9g}'

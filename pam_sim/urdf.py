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
A muscle as URDF, the robot description that RViz and other programs read.

A muscle is drawn as two tubes, one of which slides into the other by the contraction. Lengths,
masses and limits are those of the rig.
"""

import math
from typing import TYPE_CHECKING
import xml.etree.ElementTree as ElementTree

from pam_sim.load.registry import HANGING_MASS
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

    from pam_sim.muscle.muscle import Muscle
    from pam_sim.rig import Rig

PRESSURE_PA = P_ATM_PA + 600_000.0      # the pressure limit for which effort is stated
VELOCITY_M_PER_S = 1.0                  # URDF asks for a number; nothing here limits the rate
TUBE = 0.6                              # length of each tube, share of the muscle at rest
INNER = 0.75                            # radius of the inner tube, share of the outer one
STEEL_KG_PER_M3 = 7850.0
COLOURS = {'braid': '0.15 0.35 0.60 1', 'rod': '0.80 0.45 0.10 1', 'load': '0.45 0.48 0.50 1'}


def muscle_urdf(rig: 'Rig', name: str, frames: str = '') -> str:
    """
    Return the text of a URDF of one muscle that hangs from its frame and pulls a load up.

    It has the links ``FRAMES_base`` and ``FRAMES_end`` and between them the prismatic joint
    ``NAME``, whose position is the contraction [m].

    Parameters
    ----------
    rig : Rig
        A hanging mass is drawn below the muscle; other loads are not drawn.
    name : str
        Name of the muscle, as in ``name`` of its messages.
    frames : str
        What the names of the links begin with; default: ``name``.

    """
    frames = frames or name
    robot = ElementTree.Element('robot', name=frames)
    add_colours(robot)
    muscle = rig.muscle
    base = ElementTree.SubElement(robot, 'link', name=f'{frames}_base')
    add_outer_tube(base, muscle, (0.0, 0.0, 0.0))
    end = ElementTree.SubElement(robot, 'link', name=f'{frames}_end')
    if rig.load == HANGING_MASS:        # of another load it is an inertia, not a thing below
        _add_load(end, rig.parameters['mass_kg'])
    add_inner_tube(end, muscle)
    joint = add_muscle_joint(robot, name, f'{frames}_base', f'{frames}_end',
                             (0.0, 0.0, -muscle.length_m))
    add_limit(joint, 0.0, muscle.stroke_m, largest_force_n(rig), VELOCITY_M_PER_S)
    return as_text(robot)


def largest_force_n(rig: 'Rig') -> float:
    """Return the force [N] of a muscle at rest length at ``PRESSURE_PA``."""
    from pam_sim.records import fields
    from pam_sim.rollout.layout import STATE
    state, _ = rig.pack(initial_pressure_pa=PRESSURE_PA, initial_contraction_m=0.0)
    return max(float(fields(state, STATE).muscle_force_n), 0.0)


def add_muscle_joint(robot: 'Element', name: str, parent: str, child: str,
                     at_m: tuple[float, float, float]) -> 'Element':
    """Add and return the prismatic joint that lifts the lower end of a muscle from ``at_m``."""
    joint = ElementTree.SubElement(robot, 'joint', name=name, type='prismatic')
    ElementTree.SubElement(joint, 'parent', link=parent)
    ElementTree.SubElement(joint, 'child', link=child)
    ElementTree.SubElement(joint, 'origin', xyz=numbers(*at_m), rpy='0 0 0')
    ElementTree.SubElement(joint, 'axis', xyz='0 0 1')
    return joint


def add_limit(joint: 'Element', lower: float, upper: float, effort: float,
              velocity: float) -> None:
    """Add the limits of a joint, SI."""
    ElementTree.SubElement(joint, 'limit', lower=numbers(lower), upper=numbers(upper),
                           effort=numbers(effort), velocity=numbers(velocity))


def add_outer_tube(link: 'Element', muscle: 'Muscle', top_m: tuple[float, float, float]) -> None:
    """Add the tube that hangs from the upper end of a muscle, at ``top_m`` of the link."""
    x, y, z = top_m
    length_m = TUBE * muscle.length_m
    add_cylinder(link, (x, y, z - length_m / 2.0), length_m, muscle.bore_m / 2.0, 'braid')


def add_inner_tube(link: 'Element', muscle: 'Muscle', tendon_m: float = 0.0) -> None:
    """Add the tube that stands on the lower end of a muscle, and a tendon below it."""
    length_m, radius_m = TUBE * muscle.length_m, INNER * muscle.bore_m / 2.0
    add_cylinder(link, (0.0, 0.0, length_m / 2.0), length_m, radius_m, 'rod')
    if tendon_m > 0.0:
        add_cylinder(link, (0.0, 0.0, -tendon_m / 2.0), tendon_m, radius_m / 3.0, 'load')


def add_cylinder(link: 'Element', centre_m: tuple[float, float, float], length_m: float,
                 radius_m: float, colour: str, rpy: str = '0 0 0') -> None:
    """Add a cylinder along z to what is seen of a link."""
    visual = ElementTree.SubElement(link, 'visual')
    ElementTree.SubElement(visual, 'origin', xyz=numbers(*centre_m), rpy=rpy)
    shape = ElementTree.SubElement(visual, 'geometry')
    ElementTree.SubElement(shape, 'cylinder', radius=numbers(radius_m), length=numbers(length_m))
    ElementTree.SubElement(visual, 'material', name=colour)


def add_colours(robot: 'Element') -> None:
    """Add the colours of ``COLOURS`` by name."""
    for colour, rgba in COLOURS.items():
        material = ElementTree.SubElement(robot, 'material', name=colour)
        ElementTree.SubElement(material, 'color', rgba=rgba)


def as_text(robot: 'Element') -> str:
    """Return the XML of a robot."""
    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding='unicode') + '\n'


def numbers(*values: float) -> str:
    """Return numbers as URDF has them, with a space between."""
    return ' '.join(f'{value:.9g}' for value in values)


def _add_load(link: 'Element', mass_kg: float) -> None:
    """Add a hanging mass of steel, as a cylinder as long as it is thick."""
    radius_m = (mass_kg / (2.0 * math.pi * STEEL_KG_PER_M3)) ** (1.0 / 3.0)
    down_m = 1.5 * radius_m
    inertial = ElementTree.SubElement(link, 'inertial')
    ElementTree.SubElement(inertial, 'origin', xyz=numbers(0.0, 0.0, -down_m), rpy='0 0 0')
    ElementTree.SubElement(inertial, 'mass', value=numbers(mass_kg))
    across = mass_kg * radius_m ** 2 * (1.0 / 4.0 + 1.0 / 3.0)
    ElementTree.SubElement(
        inertial, 'inertia', ixx=numbers(across), iyy=numbers(across),
        izz=numbers(mass_kg * radius_m ** 2 / 2.0), ixy='0', ixz='0', iyz='0')
    add_cylinder(link, (0.0, 0.0, -down_m), 2.0 * radius_m, radius_m, 'load')

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
Pressures that hold an antagonistic joint at an angle, as the static inverse of a law.

A pair of pressures (gauge) is written as one: u = middle + difference, with p_flexor = p0 +
difference and p_extensor = p0 - difference. The middle is half way between lowest and highest
pressure, so u has the limits of one muscle. At either limit one muscle is vented and the other one
full. The co-contraction p0 gives way where both pressures could not be kept within limits
otherwise.
"""

import numpy as np
from pam_actuation.control.static_inverse import static_inverse
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled
from pam_sim.joint import JointRig
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA

NODES = 141
_BISECTIONS = 40


@compiled
def room_for(co_contraction_pa: float, difference_pa: float, lowest_pa: float,
             highest_pa: float) -> float:
    """Return the co-contraction [Pa] that leaves room for a difference, nearest to the wanted."""
    size = abs(difference_pa)
    return min(max(co_contraction_pa, lowest_pa + size), highest_pa - size)


@compiled
def pair_of(u_pa: float, co_contraction_pa: float, lowest_pa: float, highest_pa: float,
            limit_pa: float) -> tuple[float, float]:
    """
    Return the pressures of flexor and extensor [absolute Pa].

    Parameters
    ----------
    u_pa : float
        The pair as one pressure, absolute.
    co_contraction_pa, lowest_pa, highest_pa : float
        Wanted mean pressure and limits, absolute.
    limit_pa : float
        Pressure that neither muscle may exceed now, at most ``highest_pa``.

    """
    highest_difference = 0.5 * (limit_pa - lowest_pa)
    difference = u_pa - 0.5 * (lowest_pa + highest_pa)
    difference = min(max(difference, -highest_difference), highest_difference)
    mean = room_for(co_contraction_pa, difference, lowest_pa, limit_pa)
    return mean + difference, mean - difference


@compiled
def as_one(flexor_pa: float, extensor_pa: float, lowest_pa: float, highest_pa: float) -> float:
    """Return a pair of pressures [absolute Pa] as one, NaN where one of them is."""
    return 0.5 * (lowest_pa + highest_pa) + 0.5 * (flexor_pa - extensor_pa)


def tabulate_joint_inverse(joint: JointRig, co_contraction_pa: float, lowest_pa: float,
                           highest_pa: float) -> FloatArray:
    """
    Tabulate the pair, as one pressure, that holds each angle of a joint at rest.

    Nominal muscles without effects, gravity included.

    Parameters
    ----------
    joint : pam_sim.joint.JointRig
        Muscles, pulleys and limb.
    co_contraction_pa, lowest_pa, highest_pa : float
        Mean pressure and limits of both muscles, absolute Pa.

    Returns
    -------
    numpy.ndarray
        Table of ``static_inverse`` over the flexor's contraction; an angle out of reach gets
        the limit.

    """
    lower, upper = joint.range_rad
    angle = np.linspace(lower, upper, NODES)
    low = np.full(NODES, lowest_pa)
    high = np.full(NODES, highest_pa)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        short = _torque_n_m(joint, angle, middle, co_contraction_pa, lowest_pa, highest_pa) < 0.0
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    contraction_m, _ = joint.contractions_m(angle)
    step_m = (contraction_m[-1] - contraction_m[0]) / (NODES - 1)
    return static_inverse(contraction_m[0], step_m, 0.5 * (low + high))


def _torque_n_m(joint: JointRig, angle: FloatArray, u_pa: FloatArray, co_contraction_pa: float,
                lowest_pa: float, highest_pa: float) -> FloatArray:
    """Return the torque at rest [N m] of nominal muscles and gravity, arrays over the angle."""
    value = joint.parameters
    difference = u_pa - 0.5 * (lowest_pa + highest_pa)
    size = np.abs(difference)
    mean = np.clip(co_contraction_pa, lowest_pa + size, highest_pa - size)
    weight_n_m = value['limb_mass_kg'] * value['gravity_m_per_s2'] * value['centre_of_mass_m']
    torque = -weight_n_m * np.sin(angle - value['hanging_angle_rad'])
    for rig, contraction, pressure, arm in zip(
            (joint.flexor, joint.extensor), joint.contractions_m(angle),
            (mean + difference, mean - difference),
            (value['flexor_radius_m'], -value['extensor_radius_m'])):
        torque = torque + arm * nominal_force_n(rig, pressure, contraction)
    return torque


def nominal_force_n(rig: Rig, pressure_pa: FloatArray, contraction_m: FloatArray) -> FloatArray:
    """
    Return the force [N] of the nominal muscle of a rig at rest, without effects.

    Parameters
    ----------
    rig : pam_sim.rig.Rig
        Its muscle and ``force_map_gain`` count.
    pressure_pa, contraction_m : float or numpy.ndarray
        Absolute pressure and contraction, broadcast. Never negative, 0 beyond the stroke.

    """
    strain = np.clip(contraction_m, 0.0, rig.muscle.stroke_m) / rig.muscle.length_m
    force = rig.muscle.law.law.force_n(pressure_pa - P_ATM_PA, strain, 'allow')
    return np.where(contraction_m > rig.muscle.stroke_m, 0.0,
                    rig.parameters['force_map_gain'] * force)

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

"""Where a joint rests: from the forces at rest of the kernel."""

import math
from typing import TYPE_CHECKING

import numpy as np
from pam_sim.errors import InputError
from pam_sim.records import fields
from pam_sim.rollout.layout import PARAMETERS, STATE
from pam_sim.rollout.simulate import told_by_own_file

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

_SCAN = 48                     # angles looked at for changes of sign over the whole range


def static_torque(joint: 'JointRig', angle_rad: float, pressures_pa: tuple[float, float],
                  external_n_m: float) -> float:
    """Return the net torque [N m] at rest; see ``JointRig.static_torque_n_m``."""
    value = joint.parameters
    torque = external_n_m - (
        value['limb_mass_kg'] * value['gravity_m_per_s2'] * value['centre_of_mass_m']
        * math.sin(angle_rad - value['hanging_angle_rad']))
    for rig, contraction, pressure, arm in zip(
            (joint.flexor, joint.extensor), joint.contractions_m(angle_rad), pressures_pa,
            (value['flexor_radius_m'], -value['extensor_radius_m'])):
        torque += arm * _static_force(rig, pressure, contraction)
    return torque


def _static_force(rig: 'Rig', pressure: float, contraction: float) -> float:
    state, par = rig.pack(initial_pressure_pa=pressure,
                          initial_contraction_m=max(contraction, 0.0))
    if contraction > fields(par, PARAMETERS).max_contraction_m:
        return 0.0
    return max(fields(state, STATE).muscle_force_n, 0.0)


def told_by_own_file_of(joint: 'JointRig') -> str:
    """Return which file of the user keeps a muscle of a joint from being stepped, or nothing."""
    sides = (told_by_own_file(rig, rolled=False) for rig in (joint.flexor, joint.extensor))
    return next(filter(None, sides), '')


def largest_torque_n_m(joint: 'JointRig', pressure_pa: float) -> float:
    """Return the largest torque [N m] of either muscle alone, over the range, at a pressure."""
    arms = (joint.parameters['flexor_radius_m'], joint.parameters['extensor_radius_m'])
    return max(
        arm * _static_force(rig, pressure_pa, contraction)
        for angle in joint.range_rad for rig, contraction, arm in zip(
            (joint.flexor, joint.extensor), joint.contractions_m(angle), arms))


def static_angle(joint: 'JointRig', pressures_pa: tuple[float, float], external_n_m: float = 0.0,
                 near_rad: float | None = None) -> float:
    """Return the angle [rad] of rest; see ``JointRig.static_angle_rad``."""
    from scipy.optimize import brentq       # slow to import

    lower, upper = joint.range_rad
    if near_rad is None:
        near_rad = joint.parameters['hanging_angle_rad']
    near_rad = min(max(near_rad, lower), upper)

    def torque(angle: float) -> float:
        return static_torque(joint, angle, pressures_pa, external_n_m)

    if torque(near_rad) == 0.0:
        return near_rad
    angles = np.linspace(lower, upper, _SCAN)
    torques = [torque(angle) for angle in angles]
    if not np.isfinite(torques).all():
        raise InputError('the torque at rest is not finite; ' + (
            told_by_own_file_of(joint) or 'the numbers of the model make no joint that can rest'),
            f'joint {joint.name}')
    found = [brentq(torque, a, b, xtol=1e-13) for a, b, left, right in
             zip(angles, angles[1:], torques, torques[1:]) if left > 0.0 >= right]
    if torques[0] <= 0.0:
        found.append(lower)
    if torques[-1] >= 0.0:
        found.append(upper)
    return float(min(found, key=lambda angle: abs(angle - near_rad)))

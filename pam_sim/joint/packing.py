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

"""Turn a joint into the arrays of its compiled step."""

import math
from typing import TYPE_CHECKING

from pam_sim.annotations import FloatArray
from pam_sim.declared import number_of
from pam_sim.errors import InputError
from pam_sim.joint import layout
from pam_sim.joint.statics import static_angle
from pam_sim.records import fields, values_of, zeros
from pam_sim.rollout import layout as muscle
from pam_sim.rollout.kernel import refuse_terms
from pam_sim.rollout.packing import damping_of_effects
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig

# Coupling step times the highest natural frequency, and times the damping rate: at 0.04 the
# phase of the Verlet step is wrong by 7e-5 rad per radian of free oscillation.
_STEP_PER_PERIOD = 0.04
_STEP_PER_DECAY = 0.1
_MOST_SUBSTEPS = 100


def pack_joint(
        joint: 'JointRig', dt_s: float = 0.001, flexor_pressure_pa: float = P_ATM_PA,
        extensor_pressure_pa: float = P_ATM_PA, initial_angle_rad: float | None = None,
        initial_velocity_rad_per_s: float = 0.0,
) -> tuple[FloatArray, FloatArray, dict[str, float], dict[str, float]]:
    """
    Return (state, par) of the joint and, for each muscle, the arguments that start it.

    Parameters
    ----------
    joint : JointRig
        To be packed.
    dt_s : float
        Step, s.
    flexor_pressure_pa, extensor_pressure_pa : float
        At the start, absolute, Pa.
    initial_angle_rad : float, optional
        By default where the joint rests at these pressures.
    initial_velocity_rad_per_s : float
        Of the joint.

    Returns
    -------
    tuple
        Joint state, joint par, and a dict of arguments of ``Rig.pack`` for flexor and
        extensor.

    Raises
    ------
    InputError
        A start value or step out of range, or a limb too light for its pulleys.

    """
    pressures = (flexor_pressure_pa, extensor_pressure_pa)
    lower, upper = joint.range_rad
    # Checks pressures and step, too.
    packed = [rig.pack(dt_s=dt_s, initial_pressure_pa=pressure, initial_contraction_m=0.0)
              for rig, pressure in zip((joint.flexor, joint.extensor), pressures)]
    for _, par in packed:
        refuse_terms(par)
    if initial_angle_rad is None:
        initial_angle_rad = static_angle(joint, pressures)
    for name, number, least, most, unit in (
            ('initial_angle_rad', initial_angle_rad, lower, upper, 'rad'),
            ('initial_velocity_rad_per_s', initial_velocity_rad_per_s, -100.0, 100.0, 'rad/s')):
        if not least <= number_of(number, name) <= most:
            raise InputError(f'`{name}` is {number:g}; allowed {least:g} to {most:g} {unit}')
    substeps = _substeps(joint, dt_s)
    state = zeros(layout.STATE)
    start = fields(state, layout.STATE)
    start.angle_rad = initial_angle_rad
    start.velocity_rad_per_s = initial_velocity_rad_per_s
    sides = [
        {'dt_s': dt_s / substeps, 'initial_pressure_pa': pressure,
         'initial_contraction_m': min(
             max(contraction, 0.0), fields(par, muscle.PARAMETERS).max_contraction_m)}
        for pressure, contraction, (_, par) in zip(
            pressures, joint.contractions_m(initial_angle_rad), packed)]
    return state, _par(joint, dt_s, substeps), sides[0], sides[1]


def _substeps(joint: 'JointRig', dt_s: float) -> int:
    """Return how many coupling steps one step needs: the limb may not turn far in one."""
    value = joint.parameters
    stiffness = value['limb_mass_kg'] * value['gravity_m_per_s2'] * value['centre_of_mass_m']
    damping = value['damping_n_m_s']
    for arm, rig in ((value['flexor_radius_m'], joint.flexor),
                     (value['extensor_radius_m'], joint.extensor)):
        number = rig.parameters
        stiffness += arm * arm * number['force_map_gain'] * rig.muscle.stiffness_n_per_m
        damping += arm * arm * (number['damping_n_s_per_m'] + damping_of_effects(rig))
    inertia = value['inertia_kg_m2']
    count = max(1, math.ceil(dt_s * math.sqrt(stiffness / inertia) / _STEP_PER_PERIOD),
                math.ceil(dt_s * damping / inertia / _STEP_PER_DECAY))
    if count > _MOST_SUBSTEPS:
        raise InputError(
            f'`inertia_kg_m2` is {inertia:g}, too little for these muscles on these pulleys: one '
            f'step would need {count} coupling steps; allowed {_MOST_SUBSTEPS}', 'parameters')
    return count


def _par(joint: 'JointRig', dt_s: float, substeps: int) -> FloatArray:
    value = joint.parameters
    lower, upper = joint.range_rad
    return values_of(layout.PARAMETERS, {
        'dt_s': dt_s,
        'substeps': substeps,
        'substep_s': dt_s / substeps,
        'flexor_radius_m': value['flexor_radius_m'],
        'extensor_radius_m': value['extensor_radius_m'],
        'flexor_zero_m': value['flexor_contraction_at_zero_m'],
        'extensor_zero_m': value['extensor_contraction_at_zero_m'],
        'weight_torque_n_m': value['limb_mass_kg'] * value['gravity_m_per_s2']
        * value['centre_of_mass_m'],
        'inverse_inertia_per_kg_m2': 1.0 / value['inertia_kg_m2'],
        'damping_n_m_s': value['damping_n_m_s'],
        'friction_n_m': value['friction_n_m'],
        'lower_rad': lower,
        'upper_rad': upper,
        'hanging_rad': value['hanging_angle_rad'],
    })

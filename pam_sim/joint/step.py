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
One step of the joint: two muscles over pulleys turn a limb.

``joint`` is (inp, state, par, out), arrays of :mod:`pam_sim.joint.layout`; ``flexor`` and
``extensor`` are (state, par, inp, out), arrays of :mod:`pam_sim.rollout.layout`. Elsewhere
``state`` and ``par`` are the records of the joint.

    J theta'' = r_f T_f - r_e T_e - m g l sin(theta - theta_h) - d theta' - dry + T_ext
    x_f = x_f0 + r_f theta,   x_e = x_e0 - r_e theta

The scheme is velocity Verlet. The angle at the end of a step follows from angle, velocity and
acceleration at its start. Both muscles (valve, air, memory) then advance to the contractions at
that angle. The velocity follows from the mean of both accelerations. Forces that depend on
velocity use the predicted velocity, which keeps the order. A stop hit or a reversal under dry
friction is located within the step, and the limb starts again from rest there.
"""

import math

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.compiled import inlined
from pam_sim.joint.layout import INPUT, OUTPUT, PARAMETERS, STATE
from pam_sim.records import part
from pam_sim.rollout import layout as muscle
from pam_sim.rollout.kernel import driven_force, driven_tension, look, step

Arrays = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


@inlined
def tendons(share: float, state: np.record, par: np.record) -> float:
    """Return the torque [N m] of both tendons; dry friction acts at ``share`` of its level."""
    flexor = max(state.flexor_force_n - share * state.flexor_dry_n, 0.0)
    extensor = max(state.extensor_force_n + share * state.extensor_dry_n, 0.0)
    return par.flexor_radius_m * flexor - par.extensor_radius_m * extensor


@inlined
def net_torque(angle: float, velocity: float, share: float, external: float, state: np.record,
               par: np.record) -> float:
    """Return the sum of all torques [N m] with dry friction at ``share`` of its level."""
    limb = (external - par.weight_torque_n_m * math.sin(angle - par.hanging_rad)
            - par.damping_n_m_s * velocity - share * par.friction_n_m)
    return limb + tendons(share, state, par)


@inlined
def from_rest(angle: float, external: float, state: np.record,
              par: np.record) -> tuple[float, float]:
    """
    Return (share of dry friction, net torque [N m]) of a limb at rest.

    The torque is zero where dry friction or a stop holds it.
    """
    up = net_torque(angle, 0.0, 1.0, external, state, par)
    down = net_torque(angle, 0.0, -1.0, external, state, par)
    if up > 0.0:
        return 1.0, (up if angle < par.upper_rad else 0.0)
    if down < 0.0:
        return -1.0, (down if angle > par.lower_rad else 0.0)
    # Held: both muscles and the joint take the same share of what they can.
    return ((up + down) / (down - up) if down > up else 0.0), 0.0


@inlined
def at_present(external: float, state: np.record, par: np.record) -> tuple[float, float]:
    """Return (share of dry friction, net torque [N m]) of the present state."""
    velocity = state.velocity_rad_per_s
    if velocity == 0.0:
        return from_rest(state.angle_rad, external, state, par)
    share = math.copysign(1.0, velocity)
    return share, net_torque(state.angle_rad, velocity, share, external, state, par)


@inlined
def geometry(angle: float, par: np.record) -> tuple[float, float]:
    """Return the contractions [m] that belong to a joint angle, not clipped."""
    return (par.flexor_zero_m + par.flexor_radius_m * angle,
            par.extensor_zero_m - par.extensor_radius_m * angle)


@inlined
def within(contraction: float, muscle_par: FloatArray) -> float:
    """Return the contraction a muscle can have [m]; beyond it the tendon is slack."""
    return min(max(contraction, 0.0), part(muscle_par, 0, muscle.PARAMETERS).max_contraction_m)


@inlined
def read_force(tension: float, contraction: float, velocity: float, muscle_state: FloatArray,
               muscle_par: FloatArray) -> tuple[float, float]:
    """Return (force without dry friction, level of dry friction) [N]; zero on a slack tendon."""
    if contraction > part(muscle_par, 0, muscle.PARAMETERS).max_contraction_m:
        return 0.0, 0.0
    return driven_force(tension, velocity, muscle_state, muscle_par)


@inlined
def read_forces(tension_f: float, tension_e: float, velocity: float, joint: Arrays, flexor: Arrays,
                extensor: Arrays) -> None:
    """Take the forces of both muscles into the joint's state for a joint velocity [rad/s]."""
    _, state_array, par_array, _ = joint
    state, par = part(state_array, 0, STATE), part(par_array, 0, PARAMETERS)
    flexor_state, flexor_par, _, _ = flexor
    extensor_state, extensor_par, _, _ = extensor
    x_f, x_e = geometry(state.angle_rad, par)
    state.flexor_force_n, state.flexor_dry_n = read_force(
        tension_f, x_f, par.flexor_radius_m * velocity, flexor_state, flexor_par)
    state.extensor_force_n, state.extensor_dry_n = read_force(
        tension_e, x_e, -par.extensor_radius_m * velocity, extensor_state, extensor_par)


@inlined
def predict(angle: float, velocity: float, acceleration: float, share: float, h: float, dry: bool,
            par: np.record) -> tuple[float, float]:
    """
    Return (angle at the end of the step, time left after an event or -1).

    An event is a reversal under dry friction or a stop.
    """
    end = angle + h * velocity + 0.5 * h * h * acceleration
    rest = -1.0
    if dry and velocity != 0.0 and (velocity + h * acceleration) * share < 0.0:
        until = -velocity / acceleration
        end = angle + 0.5 * velocity * until
        rest = h - until
    if end > par.upper_rad:
        rest = h * (end - par.upper_rad) / (end - angle)
        end = par.upper_rad
    elif end < par.lower_rad:
        rest = h * (end - par.lower_rad) / (end - angle)
        end = par.lower_rad
    return end, rest


@inlined
def coupling_step(joint: Arrays, flexor: Arrays, extensor: Arrays) -> None:
    """Advance limb and muscles by one coupling step."""
    inp_array, state_array, par_array, _ = joint
    inp, state = part(inp_array, 0, INPUT), part(state_array, 0, STATE)
    par = part(par_array, 0, PARAMETERS)
    flexor_state, flexor_par, flexor_inp, flexor_out = flexor
    extensor_state, extensor_par, extensor_inp, extensor_out = extensor
    external = inp.torque_n_m
    h = par.substep_s
    angle = state.angle_rad
    velocity = state.velocity_rad_per_s
    share, torque = at_present(external, state, par)
    moving = velocity != 0.0 or torque != 0.0
    acceleration = torque * par.inverse_inertia_per_kg_m2
    dry = par.friction_n_m > 0.0 or state.flexor_dry_n > 0.0 or state.extensor_dry_n > 0.0
    rest = -1.0
    if moving:
        state.angle_rad, rest = predict(angle, velocity, acceleration, share, h, dry, par)

    x_f, x_e = geometry(state.angle_rad, par)
    part(flexor_inp, 0, muscle.INPUT).contraction_m = within(x_f, flexor_par)
    part(extensor_inp, 0, muscle.INPUT).contraction_m = within(x_e, extensor_par)
    step(flexor_state, flexor_par, flexor_inp, flexor_out)
    step(extensor_state, extensor_par, extensor_inp, extensor_out)
    tension_f = driven_tension(flexor_state, flexor_par)
    tension_e = driven_tension(extensor_state, extensor_par)

    after = 0.0
    if moving and rest < 0.0:
        after = velocity + h * acceleration
        read_forces(tension_f, tension_e, after, joint, flexor, extensor)
        torque = net_torque(state.angle_rad, after, share, external, state, par)
        after = velocity + 0.5 * h * (acceleration + torque * par.inverse_inertia_per_kg_m2)
        if dry and after * share < 0.0:
            after = 0.0
    read_forces(tension_f, tension_e, after, joint, flexor, extensor)
    if rest > 0.0:
        # At rest at the event; what is left of the step may set the limb going again.
        share, torque = from_rest(state.angle_rad, external, state, par)
        after = torque * par.inverse_inertia_per_kg_m2 * rest
        read_forces(tension_f, tension_e, after, joint, flexor, extensor)
    state.velocity_rad_per_s = after


@inlined
def show(share: float, velocity: float, force: float, level: float, side: Arrays) -> None:
    """Let a muscle's own outputs state the motion and the tension it has in the joint."""
    state, par, inp, out = side
    share = share if level > 0.0 else 0.0
    seen = part(state, 0, muscle.STATE)
    seen.velocity_m_per_s = velocity
    seen.direction = share
    seen.muscle_force_n = max(force - share * level, 0.0) + share * level
    look(state, par, inp, out)


@inlined
def observe(joint: Arrays, flexor: Arrays, extensor: Arrays) -> None:
    """Fill the three output rows without advancing anything."""
    inp_array, state_array, par_array, out_array = joint
    inp, state = part(inp_array, 0, INPUT), part(state_array, 0, STATE)
    par, out = part(par_array, 0, PARAMETERS), part(out_array, 0, OUTPUT)
    share, torque = at_present(inp.torque_n_m, state, par)
    velocity = state.velocity_rad_per_s
    out.time_s = state.steps * par.dt_s
    out.angle_rad = state.angle_rad
    out.velocity_rad_per_s = velocity
    out.acceleration_rad_per_s2 = torque * par.inverse_inertia_per_kg_m2
    out.torque_n_m = tendons(share, state, par)
    show(share, par.flexor_radius_m * velocity,
         state.flexor_force_n, state.flexor_dry_n, flexor)
    show(-share, -par.extensor_radius_m * velocity,
         state.extensor_force_n, state.extensor_dry_n, extensor)
    for _, _, _, side_out in (flexor, extensor):
        part(side_out, 0, muscle.OUTPUT).time_s = out.time_s


@inlined
def joint_step_body(joint: Arrays, flexor: Arrays, extensor: Arrays) -> None:
    """Advance the joint by one step of ``par.dt_s`` and fill the three output rows."""
    inp_array, state_array, par_array, _ = joint
    inp, state = part(inp_array, 0, INPUT), part(state_array, 0, STATE)
    par = part(par_array, 0, PARAMETERS)
    _, _, flexor_inp, _ = flexor
    _, _, extensor_inp, _ = extensor
    flexor_given, extensor_given = (
        part(flexor_inp, 0, muscle.INPUT), part(extensor_inp, 0, muscle.INPUT))
    flexor_given.signal_0 = inp.flexor_signal_0
    flexor_given.signal_1 = inp.flexor_signal_1
    extensor_given.signal_0 = inp.extensor_signal_0
    extensor_given.signal_1 = inp.extensor_signal_1
    for _ in range(int(par.substeps)):
        coupling_step(joint, flexor, extensor)
    state.steps += 1.0
    observe(joint, flexor, extensor)


@inlined
def joint_look_body(joint: Arrays, flexor: Arrays, extensor: Arrays) -> None:
    """Take the forces from the muscles and fill the output rows without a step."""
    _, state_array, _, _ = joint
    state = part(state_array, 0, STATE)
    flexor_state, flexor_par, _, _ = flexor
    extensor_state, extensor_par, _, _ = extensor
    read_forces(driven_tension(flexor_state, flexor_par),
                driven_tension(extensor_state, extensor_par),
                state.velocity_rad_per_s, joint, flexor, extensor)
    observe(joint, flexor, extensor)

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
The step of the joint as compiled code; :mod:`pam_sim.joint.kernel` loads this text.

Not imported by its name: it becomes a module of its own, named after the hash of
everything it is compiled from, the muscle's kernel included.

    J theta'' = r_f T_f - r_e T_e - m g l sin(theta - theta_h) - d theta' - dry + T_ext
    x_f = x_f0 + r_f theta,   x_e = x_e0 - r_e theta

Velocity Verlet: the angle at the end of a step follows from angle, velocity and
acceleration at its start, both muscles (valve, air, memory) are advanced to the
contractions that belong to it, and the velocity follows from the mean of both
accelerations; the forces that depend on velocity are read at the velocity
predicted, which keeps the order. A stop hit or a reversal under dry friction is
located within the step, and the limb starts again from rest there.
"""

import math

from numba import njit
from pam_sim.compiled import inlined
from pam_sim.joint.layout import (
    IN_EXTENSOR_0, IN_EXTENSOR_1, IN_FLEXOR_0, IN_FLEXOR_1, IN_TORQUE, OUT_ACCELERATION, OUT_ANGLE,
    OUT_TIME, OUT_TORQUE, OUT_VELOCITY, PAR_DAMPING, PAR_DT, PAR_EXTENSOR_RADIUS,
    PAR_EXTENSOR_ZERO, PAR_FLEXOR_RADIUS, PAR_FLEXOR_ZERO, PAR_FRICTION, PAR_HANGING,
    PAR_INVERSE_INERTIA, PAR_LOWER, PAR_SUBSTEP, PAR_SUBSTEPS, PAR_UPPER, PAR_WEIGHT_TORQUE,
    S_ANGLE, S_EXTENSOR_DRY, S_EXTENSOR_FORCE, S_FLEXOR_DRY, S_FLEXOR_FORCE, S_STEPS, S_VELOCITY)
from pam_sim.rollout import layout as muscle
from pam_sim.rollout.kernel import driven_force, driven_tension, look, step


@inlined
def tendons(share, state, par):
    """Return the torque [N m] of both tendons; dry friction acts at ``share`` of its level."""
    flexor = max(state[S_FLEXOR_FORCE] - share * state[S_FLEXOR_DRY], 0.0)
    extensor = max(state[S_EXTENSOR_FORCE] + share * state[S_EXTENSOR_DRY], 0.0)
    return par[PAR_FLEXOR_RADIUS] * flexor - par[PAR_EXTENSOR_RADIUS] * extensor


@inlined
def net_torque(angle, velocity, share, external, state, par):
    """Return the sum of all torques [N m] with dry friction at ``share`` of its level."""
    limb = (external - par[PAR_WEIGHT_TORQUE] * math.sin(angle - par[PAR_HANGING])
            - par[PAR_DAMPING] * velocity - share * par[PAR_FRICTION])
    return limb + tendons(share, state, par)


@inlined
def from_rest(angle, external, state, par):
    """
    Return (share of dry friction, net torque [N m]) of a limb at rest.

    The torque is zero where dry friction or a stop holds it.
    """
    up = net_torque(angle, 0.0, 1.0, external, state, par)
    down = net_torque(angle, 0.0, -1.0, external, state, par)
    if up > 0.0:
        return 1.0, (up if angle < par[PAR_UPPER] else 0.0)
    if down < 0.0:
        return -1.0, (down if angle > par[PAR_LOWER] else 0.0)
    # Held: both muscles and the joint take the same share of what they can.
    return ((up + down) / (down - up) if down > up else 0.0), 0.0


@inlined
def at_present(external, state, par):
    """Return (share of dry friction, net torque [N m]) of the present state."""
    velocity = state[S_VELOCITY]
    if velocity == 0.0:
        return from_rest(state[S_ANGLE], external, state, par)
    share = math.copysign(1.0, velocity)
    return share, net_torque(state[S_ANGLE], velocity, share, external, state, par)


@inlined
def geometry(angle, par):
    """Return the contractions [m] that belong to a joint angle, not clipped."""
    return (par[PAR_FLEXOR_ZERO] + par[PAR_FLEXOR_RADIUS] * angle,
            par[PAR_EXTENSOR_ZERO] - par[PAR_EXTENSOR_RADIUS] * angle)


@inlined
def within(contraction, muscle_par):
    """Return the contraction a muscle can have [m]; beyond it the tendon is slack."""
    return min(max(contraction, 0.0), muscle_par[muscle.PAR_MAX_CONTRACTION])


@inlined
def read_force(tension, contraction, velocity, muscle_state, muscle_par):
    """Return (force without dry friction, level of dry friction) [N]; zero on a slack tendon."""
    if contraction > muscle_par[muscle.PAR_MAX_CONTRACTION]:
        return 0.0, 0.0
    return driven_force(tension, velocity, muscle_state, muscle_par)


@inlined
def read_forces(tension_f, tension_e, velocity, joint, flexor, extensor):
    """Take the forces of both muscles into the joint's state for a joint velocity [rad/s]."""
    _, state, par, _ = joint
    flexor_state, flexor_par, _, _ = flexor
    extensor_state, extensor_par, _, _ = extensor
    x_f, x_e = geometry(state[S_ANGLE], par)
    state[S_FLEXOR_FORCE], state[S_FLEXOR_DRY] = read_force(
        tension_f, x_f, par[PAR_FLEXOR_RADIUS] * velocity, flexor_state, flexor_par)
    state[S_EXTENSOR_FORCE], state[S_EXTENSOR_DRY] = read_force(
        tension_e, x_e, -par[PAR_EXTENSOR_RADIUS] * velocity, extensor_state, extensor_par)


@inlined
def predict(angle, velocity, acceleration, share, h, dry, par):
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
    if end > par[PAR_UPPER]:
        rest = h * (end - par[PAR_UPPER]) / (end - angle)
        end = par[PAR_UPPER]
    elif end < par[PAR_LOWER]:
        rest = h * (end - par[PAR_LOWER]) / (end - angle)
        end = par[PAR_LOWER]
    return end, rest


@inlined
def coupling_step(joint, flexor, extensor):
    """Advance limb and muscles by one coupling step."""
    inp, state, par, _ = joint
    flexor_state, flexor_par, flexor_inp, flexor_out = flexor
    extensor_state, extensor_par, extensor_inp, extensor_out = extensor
    external = inp[IN_TORQUE]
    h = par[PAR_SUBSTEP]
    angle = state[S_ANGLE]
    velocity = state[S_VELOCITY]
    share, torque = at_present(external, state, par)
    moving = velocity != 0.0 or torque != 0.0
    acceleration = torque * par[PAR_INVERSE_INERTIA]
    dry = par[PAR_FRICTION] > 0.0 or state[S_FLEXOR_DRY] > 0.0 or state[S_EXTENSOR_DRY] > 0.0
    rest = -1.0
    if moving:
        state[S_ANGLE], rest = predict(angle, velocity, acceleration, share, h, dry, par)

    x_f, x_e = geometry(state[S_ANGLE], par)
    flexor_inp[muscle.INP_CONTRACTION] = within(x_f, flexor_par)
    extensor_inp[muscle.INP_CONTRACTION] = within(x_e, extensor_par)
    step(flexor_state, flexor_par, flexor_inp, flexor_out)
    step(extensor_state, extensor_par, extensor_inp, extensor_out)
    tension_f = driven_tension(flexor_state, flexor_par)
    tension_e = driven_tension(extensor_state, extensor_par)

    after = 0.0
    if moving and rest < 0.0:
        after = velocity + h * acceleration
        read_forces(tension_f, tension_e, after, joint, flexor, extensor)
        torque = net_torque(state[S_ANGLE], after, share, external, state, par)
        after = velocity + 0.5 * h * (acceleration + torque * par[PAR_INVERSE_INERTIA])
        if dry and after * share < 0.0:
            after = 0.0
    read_forces(tension_f, tension_e, after, joint, flexor, extensor)
    if rest > 0.0:
        # At rest at the event; what is left of the step may set the limb going again.
        share, torque = from_rest(state[S_ANGLE], external, state, par)
        after = torque * par[PAR_INVERSE_INERTIA] * rest
        read_forces(tension_f, tension_e, after, joint, flexor, extensor)
    state[S_VELOCITY] = after


@inlined
def show(share, velocity, force, level, side):
    """Let a muscle's own outputs state the motion and the tension it has in the joint."""
    state, par, inp, out = side
    share = share if level > 0.0 else 0.0
    state[muscle.S_VELOCITY] = velocity
    state[muscle.S_DIRECTION] = share
    state[muscle.S_MUSCLE_FORCE] = max(force - share * level, 0.0) + share * level
    look(state, par, inp, out)


@inlined
def observe(joint, flexor, extensor):
    """Fill the three output rows without advancing anything."""
    inp, state, par, out = joint
    share, torque = at_present(inp[IN_TORQUE], state, par)
    velocity = state[S_VELOCITY]
    out[OUT_TIME] = state[S_STEPS] * par[PAR_DT]
    out[OUT_ANGLE] = state[S_ANGLE]
    out[OUT_VELOCITY] = velocity
    out[OUT_ACCELERATION] = torque * par[PAR_INVERSE_INERTIA]
    out[OUT_TORQUE] = tendons(share, state, par)
    show(share, par[PAR_FLEXOR_RADIUS] * velocity,
         state[S_FLEXOR_FORCE], state[S_FLEXOR_DRY], flexor)
    show(-share, -par[PAR_EXTENSOR_RADIUS] * velocity,
         state[S_EXTENSOR_FORCE], state[S_EXTENSOR_DRY], extensor)
    for side in (flexor, extensor):
        side[3][muscle.OUT_TIME] = out[OUT_TIME]


@njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
def joint_step(joint, flexor, extensor):
    """
    Advance the joint by one step of ``PAR_DT`` and fill the three output rows.

    Parameters
    ----------
    joint : tuple of float64 arrays
        inp, state, par, out of :mod:`pam_sim.joint.layout`.
    flexor, extensor : tuple of float64 arrays
        state, par, inp, out of :mod:`pam_sim.rollout.layout`.

    """
    inp, state, par, _ = joint
    flexor_inp = flexor[2]
    extensor_inp = extensor[2]
    flexor_inp[muscle.INP_SIGNAL_0] = inp[IN_FLEXOR_0]
    flexor_inp[muscle.INP_SIGNAL_1] = inp[IN_FLEXOR_1]
    extensor_inp[muscle.INP_SIGNAL_0] = inp[IN_EXTENSOR_0]
    extensor_inp[muscle.INP_SIGNAL_1] = inp[IN_EXTENSOR_1]
    for _ in range(int(par[PAR_SUBSTEPS])):
        coupling_step(joint, flexor, extensor)
    state[S_STEPS] += 1.0
    observe(joint, flexor, extensor)


@njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
def joint_look(joint, flexor, extensor):
    """Take the forces from the muscles and fill the output rows without a step."""
    read_forces(driven_tension(flexor[0], flexor[1]), driven_tension(extensor[0], extensor[1]),
                joint[1][S_VELOCITY], joint, flexor, extensor)
    observe(joint, flexor, extensor)


@njit(cache=True, error_model='numpy', nogil=True)
def joint_rollout(inputs, joint, flexor, extensor, joint_rows, flexor_rows, extensor_rows):
    """Step through ``inputs`` (N, IN_SIZE); the rows have N + 1 lines, line 0 the start."""
    inp = joint[0]
    inp[:] = inputs[0]
    joint_look(joint, flexor, extensor)
    for i in range(inputs.shape[0] + 1):
        if i > 0:
            inp[:] = inputs[i - 1]
            joint_step(joint, flexor, extensor)
        joint_rows[i] = joint[3]
        flexor_rows[i] = flexor[3]
        extensor_rows[i] = extensor[3]

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
The motion of the load in one physics step: a Nystroem step, and its events.

Dry friction is held at its level and direction during the step. Where the velocity changes sign,
the instant is located. The mass sticks there if the friction can hold it. Arguments as in
:mod:`pam_sim.rollout.step`.
"""

import math
from typing import NamedTuple

import numpy as np
from pam_sim.compiled import inlined
from pam_sim.load.hanging_mass import acceleration
from pam_sim.rollout.dispatch import hooks
from pam_sim.rollout.forces import load_force, map_tension, muscle_force


class Motion(NamedTuple):
    """The motion at the start of a physics step, and the dry friction that it keeps."""

    contraction_m: float
    velocity_m_per_s: float
    acceleration_m_per_s2: float
    moving: bool                # a free load that nothing holds
    level_n: float              # of dry friction
    dry_n: float                # dry friction, against the velocity


@inlined
def motion_at_start(external: float, beyond: int, state: np.record, par: np.record) -> Motion:
    """Return the motion at the start of the step."""
    p = state.pressure_pa
    x = state.contraction_m
    v = state.velocity_m_per_s
    if not par.free_load > 0.0:
        return Motion(x, v, 0.0, False, 0.0, 0.0)
    level = hooks.muscle_friction(0.0, p, x, v, beyond, state, par) + hooks.load_friction(
        0.0, x, v, beyond, state, par)
    net = state.muscle_force_n - load_force(x, v, 0.0, 0.0, external, beyond, state, par)
    dry = 0.0
    if level > 0.0:
        if v != 0.0:
            dry = math.copysign(level, v)
        elif abs(net) <= level:
            return Motion(x, v, 0.0, False, level, 0.0)
        else:
            dry = math.copysign(level, net)
    a = acceleration(net - dry, x, v, par.inverse_mass_per_kg, par.max_contraction_m)
    return Motion(x, v, a, True, level, dry)


@inlined
def contraction_at_middle(start: Motion, x_target: float, g: float, par: np.record) -> float:
    """Return the contraction [m] at the middle of the step, ``g`` seconds from its start."""
    x = start.contraction_m
    if start.moving:
        return x + g * (start.velocity_m_per_s + 0.5 * g * start.acceleration_m_per_s2)
    return x if par.free_load > 0.0 else 0.5 * (x + x_target)


@inlined
def acceleration_at_middle(p: float, x: float, g: float, start: Motion, external: float,
                           beyond: int, state: np.record, par: np.record) -> float:
    """Return the acceleration [m/s^2] at the middle of the step."""
    a = start.acceleration_m_per_s2
    v = start.velocity_m_per_s + g * a
    dx = x - start.contraction_m
    force = muscle_force(map_tension(p, x, beyond, state, par), p, x, v, dx, g, beyond, state, par)
    opposing = load_force(x, v, dx, g, external, beyond, state, par)
    inverse_mass = par.inverse_mass_per_kg
    a_mid = acceleration(
        force - opposing - start.dry_n, x, v, inverse_mass, par.max_contraction_m)
    # The velocity used was the one with a; the damping feels the mean of a and a_mid.
    return a_mid - 0.5 * g * par.damping_n_s_per_m * inverse_mass * (a_mid - a)


@inlined
def driven_velocity(start: Motion, x_target: float, h: float, state: np.record) -> float:
    """Return the velocity [m/s] of a load that something else moves; note its direction."""
    v = (x_target - start.contraction_m) / h
    if v != 0.0:
        state.direction = math.copysign(1.0, v)
    return v


@inlined
def event(x_free: float, x: float, v: float, h: float, start: Motion,
          par: np.record) -> tuple[float, float]:
    """
    Return (contraction [m], time left [s]) at an end stop, or at a reversal under dry friction.

    ``x_free`` is the contraction at the end of the step without stops, ``x`` that with them, and
    ``v`` the velocity there. Without an event the time left is -1.
    """
    x0 = start.contraction_m
    v0 = start.velocity_m_per_s
    top = par.max_contraction_m
    if x_free != x:
        return x, h * (x_free - x) / (x_free - x0)
    if (x <= 0.0 and v < 0.0) or (x >= top and v > 0.0):
        return x, 0.0
    if start.dry_n != 0.0 and v * start.dry_n < 0.0:
        share = v0 / (v0 - v)
        return min(max(x0 + 0.5 * v0 * share * h, 0.0), top), (1.0 - share) * h
    return x, -1.0


@inlined
def from_rest(net: float, x: float, rest: float, level: float,
              par: np.record) -> tuple[float, float]:
    """
    Return contraction [m] and velocity [m/s] ``rest`` seconds after an event.

    The mass begins at rest, and moves on where the net force is above the level of dry friction.
    """
    if not abs(net) > level:
        return x, 0.0
    top = par.max_contraction_m
    v = acceleration(
        net - math.copysign(level, net), x, 0.0, par.inverse_mass_per_kg, top) * rest
    return min(max(x + 0.5 * v * rest, 0.0), top), v

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
The forces of a physics step: of the muscle, of what it pulls on, and in the load cell.

Arguments as in :mod:`pam_sim.rollout.step`.
"""

import math

import numpy as np
from pam_sim.compiled import inlined
from pam_sim.load.hanging_mass import acceleration
from pam_sim.rollout.dispatch import hooks
from pam_sim.rollout.layout import NOMINAL


@inlined
def map_tension(p: float, x: float, beyond: int, state: np.record, par: np.record) -> float:
    """Return the static tension [N] at pressure p [Pa] and contraction x [m]."""
    gauge, strain = hooks.map_input(
        p - par.atmosphere_pa, x * par.inverse_length_per_m, beyond, state, par)
    tension = hooks.law_tension(gauge, strain, beyond, par)
    if tension < 0.0:           # a muscle does not push
        tension = 0.0
    return hooks.map_output(par.force_gain * tension, p, x, beyond, state, par)


@inlined
def muscle_force(tension: float, p: float, x: float, v: float, dx: float, elapsed: float,
                 beyond: int, state: np.record, par: np.record) -> float:
    """Return the force the muscle transmits [N], its dry friction excepted."""
    force = tension - par.damping_n_s_per_m * v
    if beyond > NOMINAL and par.law_damper > 0.0 and tension > 0.0:
        force -= hooks.law_damper(
            v, p - par.atmosphere_pa, x * par.inverse_length_per_m, par)
    return hooks.muscle_force(force, p, x, v, dx, elapsed, beyond, state, par)


@inlined
def load_force(x: float, v: float, dx: float, elapsed: float, external: float, beyond: int,
               state: np.record, par: np.record) -> float:
    """Return the force of weight, spring, external load and load effects on the load [N]."""
    own = hooks.load(
        par.weight_n + external + par.spring_n_per_m * x, external, x, v, beyond, par)
    return hooks.load_force(own, x, v, dx, elapsed, beyond, state, par)


@inlined
def cell_force(external: float, beyond: int, state: np.record,
               par: np.record) -> tuple[float, float]:
    """Return (load cell force [N], acceleration [m/s^2]) of the present state."""
    p = state.pressure_pa
    x = state.contraction_m
    v = state.velocity_m_per_s
    force = state.muscle_force_n
    inside = hooks.muscle_friction(0.0, p, x, v, beyond, state, par)
    if par.free_load == 0.0:
        return force - inside * state.direction, 0.0
    guide = hooks.load_friction(0.0, x, v, beyond, state, par)
    against = load_force(x, v, 0.0, 0.0, external, beyond, state, par)
    level = inside + guide
    net = force - against
    dry = 0.0
    if level > 0.0:
        if v != 0.0:
            dry = math.copysign(level, v)
        else:
            dry = min(max(net, -level), level)
    a = acceleration(net - dry, x, v, par.inverse_mass_per_kg, par.max_contraction_m)
    cell = par.mass_kg * a + against
    if guide > 0.0:
        cell += dry * guide / level
    return cell, a

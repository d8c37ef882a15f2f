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
One step of the rig.

``state`` and ``par`` are the records ``layout.STATE`` and ``layout.PARAMETERS`` at the begin of
the arrays of the kernel. ``beyond`` tells how far the rig is beyond the nominal one, as
``layout.PARAMETERS`` says. It is a constant where the step is called. So the nominal rig gets
machine code of its own, without hooks, and terms that have no name cost other rigs nothing.

Scheme of one physics step h: the lag of the regulator is exact, and the air mass follows from
Runge-Kutta of fourth order. A Nystroem step moves the load. Its contractions at middle and end
follow from accelerations already known, so that the force map is read twice a step. Velocities
follow from Simpson's rule. The order is three or better, and two where the force of an effect
depends on velocity. Contraction and velocity end at events
(end stop, reversal under dry friction). The stages are in ``valves``, ``air_step``, ``forces``
and ``motion``.
"""

import numpy as np
from pam_sim.compiled import inlined
from pam_sim.load.hanging_mass import acceleration
from pam_sim.rollout.air import air_volume
from pam_sim.rollout.air_step import air_at_end, air_at_middle, air_at_start, air_pressure
from pam_sim.rollout.dispatch import hooks
from pam_sim.rollout.forces import cell_force, load_force, map_tension, muscle_force
from pam_sim.rollout.layout import PPR
from pam_sim.rollout.motion import (
    acceleration_at_middle, contraction_at_middle, driven_velocity, event, from_rest,
    motion_at_start)
from pam_sim.rollout.valves import ppr_pressures

_HALVINGS = 52              # of the stroke, to the last bit


@inlined
def physics_step(signal_0: float, signal_1: float, external: float, x_target: float, time_s: float,
                 beyond: int, state: np.record, par: np.record) -> None:
    """Advance valve, muscle and load by one physics step."""
    h = par.substep_s
    g = 0.5 * h
    top = par.max_contraction_m
    behind_ppr = par.valve == PPR
    state.supply_pa = hooks.supply(par.supply_pa, beyond, state, par)

    start = motion_at_start(external, beyond, state, par)
    x0, v0, a0 = start.contraction_m, start.velocity_m_per_s, start.acceleration_m_per_s2
    x_mid = contraction_at_middle(start, x_target, g, par)
    if behind_ppr:
        p_mid, p_end = ppr_pressures(signal_0, h, beyond, state, par)
    else:
        air = air_at_start(signal_0, signal_1, time_s, h, beyond, state, par)
        p_mid, flow_1, flow_2, flow_3 = air_at_middle(x_mid, g, air, beyond, state, par)
    a_mid = 0.0
    if start.moving:
        a_mid = acceleration_at_middle(p_mid, x_mid, g, start, external, beyond, state, par)

    x1, v1 = x0, v0
    if start.moving:
        x1 = x0 + h * v0 + h * (h * (1.0 / 6.0)) * (a0 + 2.0 * a_mid)
        v1 = v0 + h * a_mid
    elif not par.free_load > 0.0:
        x1 = x_target
        v1 = driven_velocity(start, x_target, h, state)
    x_free = x1
    if start.moving:
        x1 = min(max(x1, 0.0), top)
    if not behind_ppr:
        p_end, mean_flow = air_at_end(
            p_mid, x1, h, flow_1, flow_2, flow_3, air, beyond, state, par)
    tension = map_tension(p_end, x1, beyond, state, par)
    if start.moving:
        dx = x1 - x0
        opposing = load_force(x1, v1, dx, h, external, beyond, state, par)
        force = muscle_force(tension, p_end, x1, v1, dx, h, beyond, state, par)
        a1 = acceleration(
            force - opposing - start.dry_n, x1, v1, par.inverse_mass_per_kg, top)
        v1 = v0 + h * (1.0 / 6.0) * (a0 + 4.0 * a_mid + a1)
        x_event, rest = event(x_free, x1, v1, h, start, par)
        if rest >= 0.0:
            if x_event != x1:
                x1 = x_event
                tension = map_tension(p_end, x1, beyond, state, par)
            net = muscle_force(tension, p_end, x1, 0.0, x1 - x0, h, beyond, state, par) - opposing
            x1, v1 = from_rest(net, x1, rest, start.level_n, par)
            if x1 != x_event:
                tension = map_tension(p_end, x1, beyond, state, par)
            if not behind_ppr:
                p_end = air_pressure(mean_flow, p_end, x1, h, air, beyond, state, par)
    state.pressure_pa = p_end
    state.contraction_m = x1
    state.velocity_m_per_s = v1
    state.muscle_force_n = muscle_force(tension, p_end, x1, v1, x1 - x0, h, beyond, state, par)
    hooks.commit(p_end, x1, v1, x1 - x0, h, beyond, state, par)


@inlined
def observe(force: float, a: float, beyond: int, state: np.record, par: np.record,
            seen: np.record) -> None:
    """Fill ``seen`` from ``state`` and what ``cell_force`` returned for it."""
    p = state.pressure_pa
    x = state.contraction_m
    seen.time_s = state.time_s
    seen.velocity_m_per_s = state.velocity_m_per_s
    if par.valve == PPR:
        seen.air_mass_kg = p * air_volume(p, x, beyond, state, par) * par.inverse_rt_kg_per_j
    else:
        seen.air_mass_kg = state.air_mass_kg
    seen.supply_pa = state.supply_pa
    seen.true_pressure_pa = p
    seen.true_contraction_m = x
    seen.true_force_n = force
    seen.filled_kg = state.filled_kg
    seen.vented_kg = state.vented_kg
    seen.acceleration_m_per_s2 = a
    read_p, read_x, read_f = hooks.sensor(p, x, force, beyond, state, par)
    seen.pressure_pa = read_p + par.pressure_zero_pa
    seen.contraction_m = read_x + par.contraction_zero_m
    seen.force_n = read_f + par.force_zero_n


@inlined
def step_body(beyond: int, state: np.record, par: np.record, given: np.record,
              seen: np.record) -> None:
    """Advance ``state`` by one step of ``par.dt_s`` with ``given``, and fill ``seen``."""
    dt = par.dt_s
    signal_0, signal_1 = hooks.command(
        given.signal_0, given.signal_1, dt, beyond, state, par)
    count = int(par.substeps)
    h = par.substep_s
    start = state.contraction_m
    travel = given.contraction_m - start
    for j in range(count):
        target = given.contraction_m if j == count - 1 else start + travel * ((j + 1) / count)
        physics_step(signal_0, signal_1, given.external_force_n, target,
                     state.time_s + j * h, beyond, state, par)
    state.steps += 1.0
    state.time_s = state.steps * dt
    force, a = cell_force(given.external_force_n, beyond, state, par)
    hooks.sensor_commit(
        state.pressure_pa, state.contraction_m, force, dt, beyond, state, par)
    observe(force, a, beyond, state, par, seen)


@inlined
def look_body(beyond: int, state: np.record, par: np.record, given: np.record,
              seen: np.record) -> None:
    """Fill the outputs ``seen`` from ``state`` without advancing anything."""
    force, a = cell_force(given.external_force_n, beyond, state, par)
    observe(force, a, beyond, state, par, seen)


@inlined
def settle_body(beyond: int, state: np.record, par: np.record) -> None:
    """Make the dependent states agree with pressure and contraction before the first step."""
    p = state.pressure_pa
    x = state.contraction_m
    state.air_mass_kg = p * air_volume(p, x, beyond, state, par) * par.inverse_rt_kg_per_j
    state.supply_pa = hooks.supply(par.supply_pa, beyond, state, par)
    state.muscle_force_n = muscle_force(
        map_tension(p, x, beyond, state, par), p, x, state.velocity_m_per_s, 0.0, 0.0, beyond,
        state, par)


@inlined
def rest_body(p: float, beyond: int, state: np.record, par: np.record) -> float:
    """Return the contraction [m] at which a free load rests at a pressure [Pa], by bisection."""
    low = 0.0
    high = par.max_contraction_m
    if map_tension(p, low, beyond, state, par) <= load_force(
            low, 0.0, 0.0, 0.0, 0.0, beyond, state, par):
        return low
    if map_tension(p, high, beyond, state, par) >= load_force(
            high, 0.0, 0.0, 0.0, 0.0, beyond, state, par):
        return high
    for _ in range(_HALVINGS):
        x = 0.5 * (low + high)
        if map_tension(p, x, beyond, state, par) > load_force(
                x, 0.0, 0.0, 0.0, 0.0, beyond, state, par):
            low = x
        else:
            high = x
    return low

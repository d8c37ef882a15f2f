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
(end stop, reversal under dry friction).
"""

import math

import numpy as np
from pam_sim.compiled import inlined
from pam_sim.load.hanging_mass import acceleration
from pam_sim.rollout.air import air_pressure, air_volume, bore_volume, filled_volume
from pam_sim.rollout.dispatch import hooks
from pam_sim.rollout.layout import HSV_AVERAGED, NOMINAL, PPR
from pam_sim.valve.flow import mass_flow_kg_per_s
from pam_sim.valve.hsv import clip_duty, open_time_in, pulse_edges
from pam_sim.valve.ppr import set_point_pa

_HALVINGS = 52              # of the stroke, to the last bit


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
def valve_flows(fill: float, vent: float, p: float, supply: float, altered: bool, beyond: int,
                state: np.record, par: np.record) -> tuple[float, float]:
    """
    Return (fill, vent) mass flow [kg/s] of the HSV pair at mean openings 0..1.

    The vent flow is negative where air flows in, into a muscle below the atmosphere.
    """
    flow_in = 0.0
    flow_out = 0.0
    if fill > 0.0:
        flow_in = fill * mass_flow_kg_per_s(
            supply, p, par.conductance_kg_per_s_pa, par.critical_ratio)
    if vent > 0.0:
        flow_out = vent * mass_flow_kg_per_s(
            p, par.atmosphere_pa, par.conductance_kg_per_s_pa, par.critical_ratio)
        if p < par.atmosphere_pa and par.intake_kg_per_s_pa > 0.0:
            flow_out = -vent * mass_flow_kg_per_s(
                par.atmosphere_pa, p, par.intake_kg_per_s_pa, par.critical_ratio)
    if altered:
        return hooks.valve_flow(flow_in, flow_out, p, supply, beyond, state, par)
    return flow_in, flow_out


@inlined
def rate_behind_ppr(target: float, time_constant: float, p: float, x: float, beyond: int,
                    state: np.record, par: np.record) -> float:
    """Return the pressure rate [Pa/s] behind the PPR with what effects change of it."""
    return hooks.pressure_rate((target - p) / time_constant, p, x,
                               filled_volume(p, x, beyond, state, par), beyond, state, par)


@inlined
def ppr_pressures(voltage: float, h: float, beyond: int, state: np.record,
                  par: np.record) -> tuple[float, float]:
    """Return the PPR pressure [Pa] at the middle and the end of a physics step."""
    p = state.pressure_pa
    x = state.contraction_m
    target, time_constant = hooks.set_point(
        set_point_pa(voltage, par.gain_ppr_pa_per_v, par.lowest_ppr_v, par.highest_ppr_v,
                     par.at_lowest_ppr_pa),
        par.time_constant_s, p, x, beyond, state, par)
    if not (beyond > NOMINAL and par.used.pressure_rate > 0.0):
        decay = par.decay_half
        if time_constant != par.time_constant_s:
            decay = math.exp(-0.5 * h / time_constant)
        middle = target + (p - target) * decay
        return middle, target + (middle - target) * decay
    middle = p
    for half in range(2):
        q = 0.5 * h
        p = middle
        k1 = rate_behind_ppr(target, time_constant, p, x, beyond, state, par)
        y = p + 0.5 * q * k1
        k2 = rate_behind_ppr(target, time_constant, y, x, beyond, state, par)
        y = p + 0.5 * q * k2
        k3 = rate_behind_ppr(target, time_constant, y, x, beyond, state, par)
        y = p + q * k3
        k4 = rate_behind_ppr(target, time_constant, y, x, beyond, state, par)
        y = p + q / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        if half == 0:
            middle = y
        p = y
    return middle, p


@inlined
def latch_pulses(fill: float, vent: float, beyond: int, state: np.record, par: np.record) -> None:
    """Fix both valves' edges for the PWM period that begins now."""
    period = par.pwm_period_s
    open_s, close_s = hooks.switch_times(0.0, 0.0, beyond, state, par)
    on, off = pulse_edges(clip_duty(fill) * period, state.fill_off_s, period, open_s, close_s)
    state.fill_on_s = on
    state.fill_off_s = off
    on, off = pulse_edges(clip_duty(vent) * period, state.vent_off_s, period, open_s, close_s)
    state.vent_on_s = on
    state.vent_off_s = off


@inlined
def openings(fill: float, vent: float, time_s: float, h: float, beyond: int, state: np.record,
             par: np.record) -> tuple[float, float]:
    """Return the mean openings of both valves over one physics step."""
    period = par.pwm_period_s
    if par.valve == HSV_AVERAGED:
        fill, vent = hooks.opening(clip_duty(fill), clip_duty(vent), period, beyond, state, par)
        return hooks.flow_opening(fill, vent, h, beyond, state, par)
    clock = time_s - hooks.clock_shift(0.0, beyond, state, par)
    index = math.floor(clock / period + 1e-9)
    start = max(clock - index * period, 0.0)
    if index != state.period:
        latch_pulses(fill, vent, beyond, state, par)
        state.period = index
    end = start + h
    stop = end if end < period else period
    fill_s = open_time_in(start, stop, state.fill_on_s, state.fill_off_s)
    vent_s = open_time_in(start, stop, state.vent_on_s, state.vent_off_s)
    if end > period * (1.0 + 1e-9):      # the step reaches into the next period
        latch_pulses(fill, vent, beyond, state, par)
        state.period = index + 1.0
        fill_s += open_time_in(0.0, end - period, state.fill_on_s, state.fill_off_s)
        vent_s += open_time_in(0.0, end - period, state.vent_on_s, state.vent_off_s)
    return hooks.flow_opening(fill_s / h, vent_s / h, h, beyond, state, par)


@inlined
def physics_step(signal_0: float, signal_1: float, external: float, x_target: float, time_s: float,
                 beyond: int, state: np.record, par: np.record) -> None:
    """
    Advance valve, muscle and load by one physics step.

    Dry friction is held at its level and direction during the step. Where the
    velocity changes sign, the instant is located. The mass sticks there if the
    friction can hold it.
    """
    h = par.substep_s
    g = 0.5 * h
    sixth = h * (1.0 / 6.0)
    x0 = state.contraction_m
    v0 = state.velocity_m_per_s
    p0 = state.pressure_pa
    free = par.free_load > 0.0
    inverse_mass = par.inverse_mass_per_kg
    top = par.max_contraction_m
    supply = hooks.supply(par.supply_pa, beyond, state, par)
    state.supply_pa = supply

    # Start of the step: dry friction and acceleration.
    level = 0.0
    dry = 0.0
    a0 = 0.0
    moving = free
    if free:
        level = hooks.muscle_friction(0.0, p0, x0, v0, beyond, state, par) + hooks.load_friction(
            0.0, x0, v0, beyond, state, par)
        net = state.muscle_force_n - load_force(x0, v0, 0.0, 0.0, external, beyond, state, par)
        if level > 0.0:
            if v0 != 0.0:
                dry = math.copysign(level, v0)
            elif abs(net) <= level:
                moving = False
            else:
                dry = math.copysign(level, net)
        if moving:
            a0 = acceleration(net - dry, x0, v0, inverse_mass, top)
    x_mid = x0
    if moving:
        x_mid = x0 + g * (v0 + 0.5 * g * a0)
    elif not free:
        x_mid = 0.5 * (x0 + x_target)

    # Middle of the step: pressure, then acceleration.
    p_mid = p0
    p_end = p0
    fill = 0.0
    vent = 0.0
    altered = False
    flowing = False
    warm = False
    own = False
    mass0 = 0.0
    net_flow = 0.0
    inflow = 0.0
    q1 = 0.0
    q2 = 0.0
    q3 = 0.0
    in1 = 0.0
    in2 = 0.0
    in3 = 0.0
    out1 = 0.0
    out2 = 0.0
    out3 = 0.0
    is_ppr = par.valve == PPR
    if is_ppr:
        p_mid, p_end = ppr_pressures(signal_0, h, beyond, state, par)
    else:
        fill, vent = openings(signal_0, signal_1, time_s, h, beyond, state, par)
        mass0 = state.air_mass_kg
        altered = beyond > NOMINAL and par.used.valve_flow > 0.0
        warm = beyond > NOMINAL and par.used.air_rt > 0.0
        own = beyond > NOMINAL and par.own_volume > 0.0
        # Both valves shut and no air lost: the mass stays, and no stage needs a flow.
        flowing = fill > 0.0 or vent > 0.0 or altered or (
            beyond > NOMINAL and par.used.mass_flow > 0.0)
        if flowing:
            in1, out1 = valve_flows(fill, vent, p0, supply, altered, beyond, state, par)
            q1 = hooks.mass_flow(in1 - out1, p0, x0, supply, beyond, state, par)
        volume = bore_volume(p0, x_mid, beyond, state, par)
        per_m3 = 1.0 / volume
        p_mid = air_pressure(mass0 + g * q1, mass0, in1, q1, p0, x_mid, volume, per_m3, g, warm,
                             own, beyond, state, par)
        if flowing:
            in2, out2 = valve_flows(fill, vent, p_mid, supply, altered, beyond, state, par)
            q2 = hooks.mass_flow(in2 - out2, p_mid, x_mid, supply, beyond, state, par)
            p_mid = air_pressure(mass0 + g * q2, mass0, in2, q2, p0, x_mid, volume, per_m3, g,
                                 warm, own, beyond, state, par)
            in3, out3 = valve_flows(fill, vent, p_mid, supply, altered, beyond, state, par)
            q3 = hooks.mass_flow(in3 - out3, p_mid, x_mid, supply, beyond, state, par)
    a_mid = 0.0
    if moving:
        v_mid = v0 + g * a0
        dx = x_mid - x0
        force = muscle_force(
            map_tension(p_mid, x_mid, beyond, state, par), p_mid, x_mid, v_mid, dx, g, beyond,
            state, par)
        a_mid = acceleration(
            force - load_force(x_mid, v_mid, dx, g, external, beyond, state, par) - dry,
            x_mid, v_mid, inverse_mass, top)
        # The velocity used was the one with a0; the damping feels the mean of a0 and a_mid.
        a_mid -= 0.5 * g * par.damping_n_s_per_m * inverse_mass * (a_mid - a0)

    # End of the step: contraction, pressure, velocity.
    x1 = x0
    v1 = v0
    if moving:
        x1 = x0 + h * v0 + h * sixth * (a0 + 2.0 * a_mid)
        v1 = v0 + h * a_mid
    elif not free:
        x1 = x_target
        v1 = (x_target - x0) / h
        if v1 != 0.0:
            state.direction = math.copysign(1.0, v1)
    x_free = x1
    if moving:
        x1 = min(max(x1, 0.0), top)
    if not is_ppr:
        volume = bore_volume(p_mid, x1, beyond, state, par)
        per_m3 = 1.0 / volume
        p_end = air_pressure(mass0 + h * q3, mass0, in3, q3, p0, x1, volume, per_m3, h, warm, own,
                             beyond, state, par)
        if flowing:
            in4, out4 = valve_flows(fill, vent, p_end, supply, altered, beyond, state, par)
            q4 = hooks.mass_flow(in4 - out4, p_end, x1, supply, beyond, state, par)
            net_flow = (q1 + 2.0 * (q2 + q3) + q4) * (1.0 / 6.0)
            inflow = (in1 + 2.0 * (in2 + in3) + in4) * (1.0 / 6.0)
            mass1 = mass0 + h * net_flow
            state.air_mass_kg = mass1
            state.filled_kg += h * inflow
            state.vented_kg += sixth * (out1 + 2.0 * (out2 + out3) + out4)
            p_end = air_pressure(mass1, mass0, inflow, net_flow, p0, x1, volume, per_m3, h, warm,
                                 own, beyond, state, par)
    tension = map_tension(p_end, x1, beyond, state, par)
    if moving:
        dx = x1 - x0
        opposing = load_force(x1, v1, dx, h, external, beyond, state, par)
        a1 = acceleration(
            muscle_force(tension, p_end, x1, v1, dx, h, beyond, state, par) - opposing - dry,
            x1, v1, inverse_mass, top)
        v1 = v0 + sixth * (a0 + 4.0 * a_mid + a1)

        # Events: an end stop, or a reversal under dry friction.
        rest = -1.0
        if x_free != x1:
            rest = h * (x_free - x1) / (x_free - x0)
        elif (x1 <= 0.0 and v1 < 0.0) or (x1 >= top and v1 > 0.0):
            rest = 0.0
        elif dry != 0.0 and v1 * dry < 0.0:
            share = v0 / (v0 - v1)
            rest = (1.0 - share) * h
            x1 = min(max(x0 + 0.5 * v0 * share * h, 0.0), top)
            tension = map_tension(p_end, x1, beyond, state, par)
        if rest >= 0.0:
            # At rest at the event; does the net force move the mass on within the step?
            v1 = 0.0
            net = muscle_force(tension, p_end, x1, 0.0, x1 - x0, h, beyond, state, par) - opposing
            if abs(net) > level:
                a1 = acceleration(
                    net - math.copysign(level, net), x1, 0.0, inverse_mass, top)
                v1 = a1 * rest
                x1 = min(max(x1 + 0.5 * v1 * rest, 0.0), top)
                tension = map_tension(p_end, x1, beyond, state, par)
            if not is_ppr:
                volume = bore_volume(p_end, x1, beyond, state, par)
                per_m3 = 1.0 / volume
                p_end = air_pressure(state.air_mass_kg, mass0, inflow, net_flow, p0, x1, volume,
                                     per_m3, h, warm, own, beyond, state, par)
    state.pressure_pa = p_end
    state.contraction_m = x1
    state.velocity_m_per_s = v1
    state.muscle_force_n = muscle_force(tension, p_end, x1, v1, x1 - x0, h, beyond, state, par)
    hooks.commit(p_end, x1, v1, x1 - x0, h, beyond, state, par)


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
    """Advance ``state`` by one step of ``par.dt_s`` with ``inp[i…]`` and fill ``out[o…]``."""
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

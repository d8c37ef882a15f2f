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
One step of the rig: the source from which the kernel is made.

As it stands, with hooks that do nothing, it is the nominal rig. The generator
replaces the hooks by calls of the registered effects and compiles the rest
unchanged.

Scheme of one physics step h: the regulator's lag exactly; air mass by
Runge-Kutta of fourth order; the motion by a Nystroem step whose contraction at
middle and end follow from accelerations already known, so that the force map is
read twice a step, velocities by Simpson's rule. Third order or better; second where
an effect's force depends on velocity. Contraction and velocity end at events
(end stop, reversal under dry friction).
"""

import math

from pam_sim.compiled import inlined
from pam_sim.load.hanging_mass import acceleration
from pam_sim.muscle.geometry import volume_m3
from pam_sim.muscle.laws.sarosi import tension_n
from pam_sim.rollout.hooks import (
    air_rt_active, apply_air_rt, apply_clock_shift, apply_command, apply_commit,
    apply_flow_opening, apply_load_force, apply_load_friction, apply_map_input,
    apply_map_output, apply_mass_flow, apply_muscle_force, apply_muscle_friction, apply_opening,
    apply_pressure_rate, apply_sensor, apply_sensor_commit, apply_set_point, apply_supply,
    apply_switch_times, apply_valve_flow, apply_volume, mass_flow_active, pressure_rate_active,
    valve_flow_active)
from pam_sim.rollout.layout import (
    INP_CONTRACTION, INP_EXTERNAL_FORCE, INP_SIGNAL_0, INP_SIGNAL_1, OUT_ACCELERATION,
    OUT_AIR_MASS, OUT_CONTRACTION, OUT_FILLED, OUT_FORCE, OUT_PRESSURE, OUT_SUPPLY, OUT_TIME,
    OUT_TRUE_CONTRACTION, OUT_TRUE_FORCE, OUT_TRUE_PRESSURE, OUT_VELOCITY, OUT_VENTED,
    PAR_ATMOSPHERE, PAR_CONDUCTANCE, PAR_CRITICAL_RATIO, PAR_DAMPING, PAR_DEAD_VOLUME,
    PAR_DECAY_HALF, PAR_DT, PAR_FORCE_GAIN, PAR_FREE_LOAD, PAR_GAIN_PPR, PAR_INVERSE_4_PI_N2,
    PAR_INVERSE_LENGTH, PAR_INVERSE_MASS, PAR_INVERSE_RT, PAR_LAW_DAMPER, PAR_LAW_PLACE,
    PAR_LENGTH, PAR_MASS, PAR_MAX_CONTRACTION, PAR_PWM_PERIOD, PAR_RT, PAR_SUBSTEP,
    PAR_SUBSTEPS, PAR_SUPPLY, PAR_THREAD_SQUARED, PAR_TIME_CONSTANT, PAR_VALVE, PAR_WEIGHT,
    S_AIR_MASS, S_CONTRACTION, S_DIRECTION, S_FILL_OFF, S_FILL_ON, S_FILLED, S_MUSCLE_FORCE,
    S_PERIOD, S_PRESSURE, S_STEPS, S_SUPPLY, S_TIME, S_VELOCITY, S_VENT_OFF, S_VENT_ON,
    S_VENTED, VALVE_HSV_AVERAGED, VALVE_PPR)
from pam_sim.valve.flow import mass_flow_kg_per_s
from pam_sim.valve.hsv import clip_duty, open_time_in, pulse_edges
from pam_sim.valve.ppr import set_point_pa


@inlined
def law_tension(gauge, strain, par):
    """Return the value of the force law [N], negative where it would push."""
    return tension_n(gauge, strain, par, int(par[PAR_LAW_PLACE]))


@inlined
def law_damper(v, gauge, strain, par):
    """Return the force of the law's own damper [N]."""
    return 0.0


# --- kernel: everything below is copied into the generated module -------------------------


@inlined
def air_volume(p, x, state, par):
    """Return the volume the air has [m^3] at pressure p [Pa] and contraction x [m]."""
    volume = par[PAR_DEAD_VOLUME] + volume_m3(
        x, par[PAR_LENGTH], par[PAR_THREAD_SQUARED], par[PAR_INVERSE_4_PI_N2])
    return apply_volume(volume, p, x, state, par)


@inlined
def map_tension(p, x, state, par):
    """Return the static tension [N] at pressure p [Pa] and contraction x [m]."""
    gauge, strain = apply_map_input(
        p - par[PAR_ATMOSPHERE], x * par[PAR_INVERSE_LENGTH], state, par)
    tension = law_tension(gauge, strain, par)
    if tension < 0.0:           # a muscle does not push
        tension = 0.0
    return apply_map_output(par[PAR_FORCE_GAIN] * tension, p, x, state, par)


@inlined
def muscle_force(tension, p, x, v, dx, elapsed, state, par):
    """Return the force the muscle transmits [N], its dry friction excepted."""
    force = tension - par[PAR_DAMPING] * v
    if par[PAR_LAW_DAMPER] > 0.0 and tension > 0.0:
        force -= law_damper(
            v, p - par[PAR_ATMOSPHERE], x * par[PAR_INVERSE_LENGTH], par)
    return apply_muscle_force(force, p, x, v, dx, elapsed, state, par)


@inlined
def load_force(x, v, dx, elapsed, external, state, par):
    """Return the force of weight, external load and load effects against contraction [N]."""
    return apply_load_force(
        par[PAR_WEIGHT] + external, x, v, dx, elapsed, state, par)


@inlined
def valve_flows(fill, vent, p, supply, altered, state, par):
    """Return (fill, vent) mass flow [kg/s] of the HSV pair at mean openings 0..1."""
    flow_in = 0.0
    flow_out = 0.0
    if fill > 0.0:
        flow_in = fill * mass_flow_kg_per_s(
            supply, p, par[PAR_CONDUCTANCE], par[PAR_CRITICAL_RATIO])
    if vent > 0.0:
        flow_out = vent * mass_flow_kg_per_s(
            p, par[PAR_ATMOSPHERE], par[PAR_CONDUCTANCE], par[PAR_CRITICAL_RATIO])
    if altered:
        return apply_valve_flow(flow_in, flow_out, p, supply, state, par)
    return flow_in, flow_out


@inlined
def pressure_per_kg(mass, inflow, net, p, volume, per_m3, elapsed, state, par):
    """
    Return R T / V [Pa/kg] ``elapsed`` into a step that began with ``mass`` at pressure p.

    ``per_m3`` is 1 / V, which is known before the flows are.
    """
    return apply_air_rt(
        par[PAR_RT], mass, inflow, inflow - net, p, volume, elapsed, state, par) * per_m3


@inlined
def ppr_pressures(voltage, h, state, par):
    """Return the PPR pressure [Pa] at the middle and the end of a physics step."""
    p = state[S_PRESSURE]
    x = state[S_CONTRACTION]
    target, time_constant = apply_set_point(
        set_point_pa(voltage, par[PAR_GAIN_PPR], par[PAR_ATMOSPHERE]),
        par[PAR_TIME_CONSTANT], p, x, state, par)
    if not pressure_rate_active(par):
        decay = par[PAR_DECAY_HALF]
        if time_constant != par[PAR_TIME_CONSTANT]:
            decay = math.exp(-0.5 * h / time_constant)
        middle = target + (p - target) * decay
        return middle, target + (middle - target) * decay
    middle = p
    for half in range(2):
        q = 0.5 * h
        p = middle
        k1 = apply_pressure_rate((target - p) / time_constant, p, x, state, par)
        y = p + 0.5 * q * k1
        k2 = apply_pressure_rate((target - y) / time_constant, y, x, state, par)
        y = p + 0.5 * q * k2
        k3 = apply_pressure_rate((target - y) / time_constant, y, x, state, par)
        y = p + q * k3
        k4 = apply_pressure_rate((target - y) / time_constant, y, x, state, par)
        y = p + q / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        if half == 0:
            middle = y
        p = y
    return middle, p


@inlined
def latch_pulses(fill, vent, state, par):
    """Fix both valves' edges for the PWM period that begins now."""
    period = par[PAR_PWM_PERIOD]
    open_s, close_s = apply_switch_times(0.0, 0.0, state, par)
    on, off = pulse_edges(clip_duty(fill) * period, state[S_FILL_OFF], period, open_s, close_s)
    state[S_FILL_ON] = on
    state[S_FILL_OFF] = off
    on, off = pulse_edges(clip_duty(vent) * period, state[S_VENT_OFF], period, open_s, close_s)
    state[S_VENT_ON] = on
    state[S_VENT_OFF] = off


@inlined
def openings(fill, vent, time_s, h, state, par):
    """Return the mean openings of both valves over one physics step."""
    period = par[PAR_PWM_PERIOD]
    if par[PAR_VALVE] == VALVE_HSV_AVERAGED:
        fill, vent = apply_opening(clip_duty(fill), clip_duty(vent), period, state, par)
        return apply_flow_opening(fill, vent, h, state, par)
    clock = time_s - apply_clock_shift(0.0, state, par)
    index = math.floor(clock / period + 1e-9)
    start = max(clock - index * period, 0.0)
    if index != state[S_PERIOD]:
        latch_pulses(fill, vent, state, par)
        state[S_PERIOD] = index
    end = start + h
    stop = end if end < period else period
    fill_s = open_time_in(start, stop, state[S_FILL_ON], state[S_FILL_OFF])
    vent_s = open_time_in(start, stop, state[S_VENT_ON], state[S_VENT_OFF])
    if end > period * (1.0 + 1e-9):      # the step reaches into the next period
        latch_pulses(fill, vent, state, par)
        state[S_PERIOD] = index + 1.0
        fill_s += open_time_in(0.0, end - period, state[S_FILL_ON], state[S_FILL_OFF])
        vent_s += open_time_in(0.0, end - period, state[S_VENT_ON], state[S_VENT_OFF])
    return apply_flow_opening(fill_s / h, vent_s / h, h, state, par)


@inlined
def physics_step(signal_0, signal_1, external, x_target, time_s, state, par):
    """
    Advance valve, muscle and load by one physics step.

    Dry friction is held at its level and direction during the step; where the
    velocity changes sign, the instant is located and the mass sticks if the
    friction can hold it there.
    """
    h = par[PAR_SUBSTEP]
    g = 0.5 * h
    sixth = h * (1.0 / 6.0)
    x0 = state[S_CONTRACTION]
    v0 = state[S_VELOCITY]
    p0 = state[S_PRESSURE]
    free = par[PAR_FREE_LOAD] > 0.0
    inverse_mass = par[PAR_INVERSE_MASS]
    top = par[PAR_MAX_CONTRACTION]
    supply = apply_supply(par[PAR_SUPPLY], state, par)
    state[S_SUPPLY] = supply

    # Start of the step: dry friction and acceleration.
    level = 0.0
    dry = 0.0
    a0 = 0.0
    moving = free
    if free:
        level = apply_muscle_friction(0.0, p0, x0, v0, state, par) + apply_load_friction(
            0.0, x0, v0, state, par)
        net = state[S_MUSCLE_FORCE] - load_force(x0, v0, 0.0, 0.0, external, state, par)
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
    is_ppr = par[PAR_VALVE] == VALVE_PPR
    if is_ppr:
        p_mid, p_end = ppr_pressures(signal_0, h, state, par)
    else:
        fill, vent = openings(signal_0, signal_1, time_s, h, state, par)
        mass0 = state[S_AIR_MASS]
        altered = valve_flow_active(par)
        warm = air_rt_active(par)
        # Both valves shut and no air lost: the mass stays, and no stage needs a flow.
        flowing = fill > 0.0 or vent > 0.0 or altered or mass_flow_active(par)
        if flowing:
            in1, out1 = valve_flows(fill, vent, p0, supply, altered, state, par)
            q1 = apply_mass_flow(in1 - out1, p0, x0, supply, state, par)
        volume = air_volume(p0, x_mid, state, par)
        per_m3 = 1.0 / volume
        density = par[PAR_RT] * per_m3                                 # Pa/kg
        if warm:
            density = pressure_per_kg(mass0, in1, q1, p0, volume, per_m3, g, state, par)
        p_mid = (mass0 + g * q1) * density
        if flowing:
            in2, out2 = valve_flows(fill, vent, p_mid, supply, altered, state, par)
            q2 = apply_mass_flow(in2 - out2, p_mid, x_mid, supply, state, par)
            if warm:
                density = pressure_per_kg(mass0, in2, q2, p0, volume, per_m3, g, state, par)
            p_mid = (mass0 + g * q2) * density
            in3, out3 = valve_flows(fill, vent, p_mid, supply, altered, state, par)
            q3 = apply_mass_flow(in3 - out3, p_mid, x_mid, supply, state, par)
    a_mid = 0.0
    if moving:
        v_mid = v0 + g * a0
        dx = x_mid - x0
        force = muscle_force(
            map_tension(p_mid, x_mid, state, par), p_mid, x_mid, v_mid, dx, g, state, par)
        a_mid = acceleration(
            force - load_force(x_mid, v_mid, dx, g, external, state, par) - dry,
            x_mid, v_mid, inverse_mass, top)
        # The velocity used was the one with a0; the damping feels the mean of a0 and a_mid.
        a_mid -= 0.5 * g * par[PAR_DAMPING] * inverse_mass * (a_mid - a0)

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
            state[S_DIRECTION] = math.copysign(1.0, v1)
    x_free = x1
    if moving:
        x1 = min(max(x1, 0.0), top)
    if not is_ppr:
        volume = air_volume(p_mid, x1, state, par)
        per_m3 = 1.0 / volume
        density = par[PAR_RT] * per_m3
        if warm:
            density = pressure_per_kg(mass0, in3, q3, p0, volume, per_m3, h, state, par)
        p_end = (mass0 + h * q3) * density
        if flowing:
            in4, out4 = valve_flows(fill, vent, p_end, supply, altered, state, par)
            q4 = apply_mass_flow(in4 - out4, p_end, x1, supply, state, par)
            net_flow = (q1 + 2.0 * (q2 + q3) + q4) * (1.0 / 6.0)
            inflow = (in1 + 2.0 * (in2 + in3) + in4) * (1.0 / 6.0)
            mass1 = mass0 + h * net_flow
            state[S_AIR_MASS] = mass1
            state[S_FILLED] += h * inflow
            state[S_VENTED] += sixth * (out1 + 2.0 * (out2 + out3) + out4)
            if warm:
                density = pressure_per_kg(
                    mass0, inflow, net_flow, p0, volume, per_m3, h, state, par)
            p_end = mass1 * density
    tension = map_tension(p_end, x1, state, par)
    if moving:
        dx = x1 - x0
        opposing = load_force(x1, v1, dx, h, external, state, par)
        a1 = acceleration(
            muscle_force(tension, p_end, x1, v1, dx, h, state, par) - opposing - dry,
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
            tension = map_tension(p_end, x1, state, par)
        if rest >= 0.0:
            # At rest at the event; does the net force move the mass on within the step?
            v1 = 0.0
            net = muscle_force(tension, p_end, x1, 0.0, x1 - x0, h, state, par) - opposing
            if abs(net) > level:
                a1 = acceleration(
                    net - math.copysign(level, net), x1, 0.0, inverse_mass, top)
                v1 = a1 * rest
                x1 = min(max(x1 + 0.5 * v1 * rest, 0.0), top)
                tension = map_tension(p_end, x1, state, par)
            if not is_ppr:
                volume = air_volume(p_end, x1, state, par)
                per_m3 = 1.0 / volume
                density = par[PAR_RT] * per_m3
                if warm:
                    density = pressure_per_kg(
                        mass0, inflow, net_flow, p0, volume, per_m3, h, state, par)
                p_end = state[S_AIR_MASS] * density
    state[S_PRESSURE] = p_end
    state[S_CONTRACTION] = x1
    state[S_VELOCITY] = v1
    state[S_MUSCLE_FORCE] = muscle_force(tension, p_end, x1, v1, x1 - x0, h, state, par)
    apply_commit(p_end, x1, v1, x1 - x0, h, state, par)


@inlined
def cell_force(external, state, par):
    """Return (load cell force [N], acceleration [m/s^2]) of the present state."""
    p = state[S_PRESSURE]
    x = state[S_CONTRACTION]
    v = state[S_VELOCITY]
    force = state[S_MUSCLE_FORCE]
    inside = apply_muscle_friction(0.0, p, x, v, state, par)
    if par[PAR_FREE_LOAD] == 0.0:
        return force - inside * state[S_DIRECTION], 0.0
    guide = apply_load_friction(0.0, x, v, state, par)
    against = load_force(x, v, 0.0, 0.0, external, state, par)
    level = inside + guide
    net = force - against
    dry = 0.0
    if level > 0.0:
        if v != 0.0:
            dry = math.copysign(level, v)
        else:
            dry = min(max(net, -level), level)
    a = acceleration(net - dry, x, v, par[PAR_INVERSE_MASS], par[PAR_MAX_CONTRACTION])
    cell = par[PAR_MASS] * a + against
    if guide > 0.0:
        cell += dry * guide / level
    return cell, a


@inlined
def observe(force, a, state, par, out):
    """Fill ``out`` from ``state`` and what ``cell_force`` returned for it."""
    p = state[S_PRESSURE]
    x = state[S_CONTRACTION]
    out[OUT_TIME] = state[S_TIME]
    out[OUT_VELOCITY] = state[S_VELOCITY]
    if par[PAR_VALVE] == VALVE_PPR:
        out[OUT_AIR_MASS] = p * air_volume(p, x, state, par) * par[PAR_INVERSE_RT]
    else:
        out[OUT_AIR_MASS] = state[S_AIR_MASS]
    out[OUT_SUPPLY] = state[S_SUPPLY]
    out[OUT_TRUE_PRESSURE] = p
    out[OUT_TRUE_CONTRACTION] = x
    out[OUT_TRUE_FORCE] = force
    out[OUT_FILLED] = state[S_FILLED]
    out[OUT_VENTED] = state[S_VENTED]
    out[OUT_ACCELERATION] = a
    read_p, read_x, read_f = apply_sensor(p, x, force, state, par)
    out[OUT_PRESSURE] = read_p
    out[OUT_CONTRACTION] = read_x
    out[OUT_FORCE] = read_f


@inlined
def step_body(state, par, inp, out):
    """Advance ``state`` by one step of ``par[PAR_DT]`` and fill ``out``."""
    dt = par[PAR_DT]
    signal_0, signal_1 = apply_command(inp[INP_SIGNAL_0], inp[INP_SIGNAL_1], dt, state, par)
    count = int(par[PAR_SUBSTEPS])
    h = par[PAR_SUBSTEP]
    start = state[S_CONTRACTION]
    travel = inp[INP_CONTRACTION] - start
    for j in range(count):
        target = inp[INP_CONTRACTION] if j == count - 1 else start + travel * ((j + 1) / count)
        physics_step(signal_0, signal_1, inp[INP_EXTERNAL_FORCE], target,
                     state[S_TIME] + j * h, state, par)
    state[S_STEPS] += 1.0
    state[S_TIME] = state[S_STEPS] * dt
    force, a = cell_force(inp[INP_EXTERNAL_FORCE], state, par)
    apply_sensor_commit(
        state[S_PRESSURE], state[S_CONTRACTION], force, dt, state, par)
    observe(force, a, state, par, out)


@inlined
def look_body(state, par, inp, out):
    """Fill ``out`` from ``state`` without advancing anything."""
    force, a = cell_force(inp[INP_EXTERNAL_FORCE], state, par)
    observe(force, a, state, par, out)

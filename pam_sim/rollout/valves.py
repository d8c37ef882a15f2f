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
The valve in a physics step: the pressure behind a regulator, or the flows of an HSV pair.

Arguments as in :mod:`pam_sim.rollout.step`.
"""

import math

import numpy as np
from pam_sim.compiled import inlined
from pam_sim.rollout.air import filled_volume
from pam_sim.rollout.dispatch import hooks
from pam_sim.rollout.layout import HSV_AVERAGED, NOMINAL
from pam_sim.valve.flow import mass_flow_kg_per_s
from pam_sim.valve.hsv import clip_duty, open_time_in, pulse_edges
from pam_sim.valve.ppr import set_point_pa


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

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
The air behind an HSV pair in one physics step: Runge-Kutta of fourth order for its mass.

Contractions at middle and end come from the motion. Arguments as in
:mod:`pam_sim.rollout.step`.
"""

from typing import NamedTuple

import numpy as np
from pam_sim.compiled import called, inlined
from pam_sim.rollout.air import bore_volume, own_volume, pressure_of
from pam_sim.rollout.dispatch import hooks
from pam_sim.rollout.layout import NOMINAL
from pam_sim.rollout.valves import openings, valve_flows

_WARM_PASSES = 3            # temperature and volume in turn


class Air(NamedTuple):
    """What a physics step keeps of the air: the start, and what changes in it."""

    mass_kg: float
    pressure_pa: float
    contraction_m: float
    fill: float                 # mean openings of the valves, 0..1
    vent: float
    flows: bool                 # false: both valves shut and no air lost, so the mass stays
    altered: bool               # effects change the flows of the valves
    warm: bool                  # the temperature changes
    own: bool                   # the volume is that of the muscle law


class Flow(NamedTuple):
    """Mass flows [kg/s] of one stage, or their mean over the step."""

    fill: float
    vent: float                 # negative where air flows in
    net: float                  # into the muscle, with what is lost


@inlined
def air_at_start(fill: float, vent: float, time_s: float, h: float, beyond: int, state: np.record,
                 par: np.record) -> Air:
    """Return the air at the start of the step, for the duties of both valves."""
    fill, vent = openings(fill, vent, time_s, h, beyond, state, par)
    altered = beyond > NOMINAL and par.used.valve_flow > 0.0
    lost = beyond > NOMINAL and par.used.mass_flow > 0.0
    return Air(
        state.air_mass_kg, state.pressure_pa, state.contraction_m, fill, vent,
        fill > 0.0 or vent > 0.0 or altered or lost, altered,
        beyond > NOMINAL and par.used.air_rt > 0.0, beyond > NOMINAL and par.own_volume > 0.0)


@inlined
def flow_at(p: float, x: float, air: Air, beyond: int, state: np.record, par: np.record) -> Flow:
    """Return the mass flows at pressure p [Pa] and contraction x [m]."""
    supply = state.supply_pa
    fill, vent = valve_flows(air.fill, air.vent, p, supply, air.altered, beyond, state, par)
    return Flow(fill, vent, hooks.mass_flow(fill - vent, p, x, supply, beyond, state, par))


@inlined
def no_flow() -> Flow:
    """Return the flows of shut valves."""
    return Flow(0.0, 0.0, 0.0)


@called
def pressure_in_own_volume(flow: Flow, x: float, elapsed: float, air: Air, beyond: int,
                           state: np.record, par: np.record) -> float:
    """Return what ``air_pressure`` does, in a volume that depends on the pressure."""
    mass = air.mass_kg + elapsed * flow.net
    rt = par.rt_j_per_kg
    p = air.pressure_pa
    for _ in range(_WARM_PASSES if air.warm else 1):
        if air.warm:
            rt = hooks.air_rt(
                par.rt_j_per_kg, air.mass_kg, flow.fill, flow.fill - flow.net, air.pressure_pa,
                own_volume(p, x, beyond, state, par), elapsed, beyond, state, par)
        p = pressure_of(mass * rt, p, x, beyond, state, par)
    return p


@inlined
def air_pressure(flow: Flow, p: float, x: float, elapsed: float, air: Air, beyond: int,
                 state: np.record, par: np.record) -> float:
    """
    Return the pressure [Pa] ``elapsed`` seconds into the step, after a constant flow.

    ``x`` is the contraction there [m]. The volume of a bore is that at the pressure ``p`` [Pa].
    """
    if air.own:
        return pressure_in_own_volume(flow, x, elapsed, air, beyond, state, par)
    volume = bore_volume(p, x, beyond, state, par)
    per_m3 = 1.0 / volume
    density = par.rt_j_per_kg * per_m3                                     # Pa/kg
    if air.warm:
        density = hooks.air_rt(
            par.rt_j_per_kg, air.mass_kg, flow.fill, flow.fill - flow.net, air.pressure_pa,
            volume, elapsed, beyond, state, par) * per_m3
    return (air.mass_kg + elapsed * flow.net) * density


@inlined
def air_at_middle(x: float, g: float, air: Air, beyond: int, state: np.record,
                  par: np.record) -> tuple[float, Flow, Flow, Flow]:
    """
    Return the pressure [Pa] at the middle of the step, and the flows of its first three stages.

    ``x`` is the contraction there [m], and ``g`` half of the step [s].
    """
    start = air.pressure_pa
    first, second, third = no_flow(), no_flow(), no_flow()
    if air.flows:
        first = flow_at(start, air.contraction_m, air, beyond, state, par)
    p = air_pressure(first, start, x, g, air, beyond, state, par)
    if air.flows:
        second = flow_at(p, x, air, beyond, state, par)
        p = air_pressure(second, start, x, g, air, beyond, state, par)
        third = flow_at(p, x, air, beyond, state, par)
    return p, first, second, third


@inlined
def weighted(first: float, second: float, third: float, fourth: float) -> float:
    """Return the sum of the stages with the weights of Runge-Kutta: six times their mean."""
    return first + 2.0 * (second + third) + fourth


@inlined
def air_at_end(p_mid: float, x: float, h: float, first: Flow, second: Flow, third: Flow,
               air: Air, beyond: int, state: np.record, par: np.record) -> tuple[float, Flow]:
    """Return the pressure [Pa] at the end of the step and the mean flows; note these in state."""
    p = air_pressure(third, p_mid, x, h, air, beyond, state, par)
    if not air.flows:
        return p, no_flow()
    fourth = flow_at(p, x, air, beyond, state, par)
    sixth = 1.0 / 6.0
    mean = Flow(
        weighted(first.fill, second.fill, third.fill, fourth.fill) * sixth, 0.0,
        weighted(first.net, second.net, third.net, fourth.net) * sixth)
    state.air_mass_kg = air.mass_kg + h * mean.net
    state.filled_kg += h * mean.fill
    state.vented_kg += h * sixth * weighted(first.vent, second.vent, third.vent, fourth.vent)
    return air_pressure(mean, p_mid, x, h, air, beyond, state, par), mean

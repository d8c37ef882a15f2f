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
Feed-forward from known dynamics, and jumps of the reference made smooth moves.

The static inverse gives the pressure that holds the reference one preview ahead. Moving the load
takes more: damping times rate and mass times acceleration, divided by the force per pascal. The
lag of the valve is compensated as well::

    p = p_static(r) + k_v dr/dt + k_a d2r/dt2,   command = p + T_valve dp/dt

A jump of the reference has no acceleration to feed forward. It becomes a move of fixed duration
along ``s = 10 q^3 - 15 q^4 + 6 q^5``. That move starts and ends at rest without acceleration
(minimum jerk, Flash and Hogan 1985). The form ``s = 35 q^4 - 84 q^5 + 70 q^6 - 20 q^7`` has no
jerk there either. To compensate the lag of a valve, the change of pressure is needed, and that
contains the jerk.
"""

import math

import numpy as np
from pam_actuation.control.sofc import credit, reference_bend
from pam_actuation.control.sofc.credit import Ring
from pam_actuation.control.static_inverse import grid_of, GRID_SIZE, inverse_pressure_pa
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled

_SLOPE_BASE_M = 5e-4      # the slope of the static inverse is taken over twice this
_LEAST_SLOPE = 0.2        # of the mean slope of the table
_ACCELERATION_FLOOR_M_PER_S2 = 1e-9       # then it is gone, before it becomes denormal
_LEAST_SHAPE = 0.5        # of the integral, its inverse the largest
_TOLD_TIME_S = 0.5        # of the means of what previews told
_TOLD_FLOOR_M2_PER_S2 = 1e-8      # below, the rate changes too little to tell
_BEND = 0.25              # of a change of rate: what a bent way may differ from a straight one


@compiled
def _while_late(way_m: float, before_m_per_s: float, rate_m_per_s: float,
                elapsed_s: float) -> float:
    """Return how far a reference went beyond what its rates explain over some time [m]."""
    beyond = way_m - 0.5 * (before_m_per_s + rate_m_per_s) * elapsed_s
    bend = _BEND * abs(rate_m_per_s - before_m_per_s) * elapsed_s
    return math.copysign(max(abs(beyond) - bend, 0.0), beyond)


@compiled
def jumps(par: np.record, st: np.record, inp: np.record) -> tuple[float, float]:
    """
    Return by how much reference and lead reference jumped against their rates [m].

    Between readings that came late, more time than a period may have passed. Whichever of the
    two explains more of the way counts.
    """
    period = par.period_s
    rate, lead_rate = inp.reference_rate_m_per_s, inp.lead_rate_m_per_s
    way = inp.reference_m - st.reference_m
    lead_way = inp.lead_reference_m - st.lead_reference_m
    now = way - rate * period
    lead = lead_way - lead_rate * period
    st.gap_s = period
    if inp.elapsed_s > par.late_s > 0.0:       # False for NaN: a period
        late_now = _while_late(way, st.reference_rate_m_per_s, rate, inp.elapsed_s)
        if abs(late_now) < abs(now):
            now = late_now
        # Where only the sensors were late, the lead reference went on by periods.
        late_lead = _while_late(lead_way, st.lead_rate_m_per_s, lead_rate, inp.elapsed_s)
        if abs(late_lead) < abs(lead):
            lead = late_lead
            st.gap_s = inp.elapsed_s
    st.reference_m = inp.reference_m
    st.reference_rate_m_per_s = rate
    st.lead_reference_m = inp.lead_reference_m
    return (now if abs(now) > par.jump_m else 0.0,
            lead if abs(lead) > par.jump_m else 0.0)


@compiled
def to_go(size_m: float, left_s: float, duration_s: float,
          form: float) -> tuple[float, float, float]:
    """Return how much of a move is to come [m], its rate [m/s] and its acceleration [m/s^2]."""
    if not left_s > 0.0:
        return 0.0, 0.0, 0.0
    q = max(1.0 - left_s / duration_s, 0.0)
    still = 1.0 - q
    if form > 0.5:
        done = q * q * q * q * (35.0 + q * (q * (70.0 - 20.0 * q) - 84.0))
        rate = 140.0 * q * q * q * still * still * still / duration_s
        bend = 420.0 * q * q * still * still * (1.0 - 2.0 * q) / (duration_s * duration_s)
    else:
        done = q * q * q * (10.0 + q * (6.0 * q - 15.0))
        rate = 30.0 * q * q * still * still / duration_s
        bend = 60.0 * q * still * (1.0 - 2.0 * q) / (duration_s * duration_s)
    return size_m * (1.0 - done), size_m * rate, size_m * bend


@compiled
def smooth_jump(par: np.record, move: np.record, jump_m: float,
                wait_s: float) -> tuple[float, float, float]:
    """
    Take up a jump in one of the two references; return ``to_go`` of its move.

    ``move`` is a ``records.MOVE``; ``wait_s``: it begins so much later.
    """
    duration = par.jump_time_s
    if not duration > 0.0:
        return 0.0, 0.0, 0.0
    if jump_m != 0.0:
        rest, _, _ = to_go(move.size_m, move.left_s, duration, par.jump_form)
        move.size_m = rest + jump_m
        move.left_s = duration + wait_s
    found = to_go(move.size_m, move.left_s, duration, par.jump_form)
    move.left_s = max(0.0, move.left_s - par.period_s)
    return found


@compiled
def note_announced(par: np.record, ring: Ring, st: np.record, inp: np.record) -> None:
    """
    Find how far the reference comes as its previews told; ``st`` is a ``STATE``.

    Without a preview the lead reference goes on with the present rate. A reference that is told
    ahead has another rate there, and has it one preview later.
    """
    tick = int(st.tick)
    ring[credit.row_of(ring, tick, 0)].told_rate_m_per_s = inp.lead_rate_m_per_s
    if credit.known_ticks(par, st) < par.answer_ticks:
        return
    rate: float = inp.reference_rate_m_per_s
    told = inp.lead_rate_m_per_s - rate
    untold = rate - ring[credit.row_of(ring, tick, int(par.answer_ticks))].told_rate_m_per_s
    part = par.period_s / (_TOLD_TIME_S + par.period_s)
    told_mean: float = st.told_m2_per_s2
    untold_mean: float = st.untold_m2_per_s2
    told_mean += part * (told * told - told_mean)
    untold_mean += part * (untold * untold - untold_mean)
    st.told_m2_per_s2 = told_mean
    st.untold_m2_per_s2 = untold_mean
    if told_mean + untold_mean > _TOLD_FLOOR_M2_PER_S2:      # at rest it stays what it was
        st.announced = told_mean / (told_mean + untold_mean)


@compiled
def between(newer: float, older: float, rest: float) -> float:
    """Return the value a part of a tick before the newer one, on a straight line."""
    return newer + rest * (older - newer)


@compiled
def later(par: np.record, ring: Ring, st: np.record, inp: np.record, lead_m: float,
          rate_m_per_s: float, move_m_per_s: float,
          move_m_per_s2: float) -> tuple[float, float, float, float]:
    """
    Return the lead reference, its rate, and both derivatives of its move, for the dead time.

    The preview is longer than the dead time that was found. A reference that was told ahead is
    used as much later. Another one goes on for the dead time only, with its present rate and as
    it bends (``reference_bend``).
    """
    ahead_s: float = st.lag.dead_s if par.dead_time_s > 0.0 else par.lead_s
    bend = reference_bend.goes_on_m_per_s2(par, ring, st, inp, ahead_s)
    bent_m, bent_rate = 0.5 * bend * ahead_s * ahead_s, bend * ahead_s
    if not par.dead_time_s > 0.0:
        return lead_m + bent_m, rate_m_per_s + bent_rate, move_m_per_s, move_m_per_s2
    tick = int(st.tick)
    entry = ring[credit.row_of(ring, tick, 0)]
    entry.lead_m = lead_m
    entry.lead_rate_m_per_s = rate_m_per_s
    entry.lead_move_m_per_s = move_m_per_s
    entry.lead_move_m_per_s2 = move_m_per_s2
    entry.told_m = inp.lead_reference_m - st.jumps_m
    period: float = par.period_s
    dead_s: float = st.lag.dead_s
    early_s: float = min(par.lead_s - dead_s, st.lead_ticks * period)
    st.lead_ticks += 1.0
    whole = int(early_s / period)
    rest = early_s / period - whole
    new = ring[credit.row_of(ring, tick, whole)]
    old = ring[credit.row_of(ring, tick, whole + (1 if rest > 0.0 else 0))]
    surprise = 1.0 - st.announced
    told_m = between(new.told_m, old.told_m, rest)
    told_rate = between(new.told_rate_m_per_s, old.told_rate_m_per_s, rest)
    straight_m = entry.told_m - early_s * inp.lead_rate_m_per_s
    return (between(new.lead_m, old.lead_m, rest) + surprise * (straight_m - told_m) + bent_m,
            between(new.lead_rate_m_per_s, old.lead_rate_m_per_s, rest)
            + surprise * (inp.lead_rate_m_per_s - told_rate) + bent_rate,
            between(new.lead_move_m_per_s, old.lead_move_m_per_s, rest),
            between(new.lead_move_m_per_s2, old.lead_move_m_per_s2, rest))


@compiled
def note_jump(par: np.record, st: np.record, rate_m_per_s: float, jump_m: float,
              lead_jump_m: float) -> None:
    """
    Remember a jump until the reference moves by itself.

    Feed-forward and motion rules go over to the share they have for so long, and back, in the
    time of a move. Nobody announced a jump that comes at once in the reference and in that of one
    preview ahead; ``jump_announced`` says whether the share holds after the others too.

    What of the integral only undoes the rules stands back with them.
    """
    if lead_jump_m != 0.0:
        st.surprising = 1.0 if jump_m != 0.0 else par.jump_announced
    if st.move.left_s > 0.0 or st.lead_move.left_s > 0.0:
        st.jumped = 1.0
    elif rate_m_per_s != 0.0:
        st.jumped = 0.0
    if par.jump_rules < 1.0 and par.jump_time_s > 0.0:
        step = par.period_s / par.jump_time_s
        wanted = par.jump_rules if st.jumped > 0.0 and st.surprising > 0.5 else 1.0
        if st.rules_share >= 1.0:
            st.balance_pa = min(max(-st.rules_pa, min(st.integral_pa, 0.0)),
                                max(st.integral_pa, 0.0))
        st.rules_share += min(max(wanted - st.rules_share, -step), step)


@compiled
def slope_pa_per_m(table: FloatArray, contraction_m: float) -> float:
    """Return the slope of the static inverse, never below a part of its mean."""
    pressure_pa = table[GRID_SIZE:]
    last = pressure_pa.shape[0] - 1
    mean = (pressure_pa[last] - pressure_pa[0]) / (last * grid_of(table).step_m)
    rise = (inverse_pressure_pa(table, contraction_m + _SLOPE_BASE_M)
            - inverse_pressure_pa(table, contraction_m - _SLOPE_BASE_M))
    return max(0.5 * rise / _SLOPE_BASE_M, _LEAST_SLOPE * mean)


@compiled
def load_shape(par: np.record, contraction_m: float) -> float:
    """
    Return which part of the integral counts at a contraction, 1 in the middle of the range.

    The more a muscle has contracted the less force a pascal makes: what a load beyond the
    nominal one takes is no constant pressure but grows with contraction.
    """
    middle = 0.5 * (par.reference_lower_m + par.reference_upper_m)
    shape = 1.0 + par.integral_growth_per_m * (contraction_m - middle)
    return min(max(shape, _LEAST_SHAPE), 1.0 / _LEAST_SHAPE)


@compiled
def accelerate(par: np.record, st: np.record, rate_m_per_s: float, rate_jumped: bool,
               move_rate_m_per_s: float, move_m_per_s2: float) -> None:
    """
    Find the acceleration of the lead reference; ``st`` is a ``STATE``.

    ``rate_jumped``: the rate of before means nothing. Rate and acceleration of a move made of a
    jump come last; its rate is part of ``rate_m_per_s``.
    """
    period = st.gap_s
    if rate_jumped:
        st.acceleration_m_per_s2 = 0.0
    exact = par.jump_acceleration
    filtered_rate = rate_m_per_s - exact * move_rate_m_per_s
    if rate_jumped:
        st.lead_rate_m_per_s = filtered_rate
    raw = (filtered_rate - st.lead_rate_m_per_s) / period
    st.lead_rate_m_per_s = filtered_rate
    part = period / (par.acceleration_filter_s + period)
    acceleration: float = st.acceleration_m_per_s2 + part * (raw - st.acceleration_m_per_s2)
    if abs(acceleration) < _ACCELERATION_FLOOR_M_PER_S2:
        acceleration = 0.0
    st.acceleration_m_per_s2 = acceleration
    st.moves_m_per_s = rate_m_per_s
    st.moves_m_per_s2 = acceleration + exact * move_m_per_s2


@compiled
def ahead_of_lag_pa(st: np.record, quasi_static_pa: float, rate_jumped: bool) -> float:
    """Return what makes up for the lag of the valve [Pa], for a pressure without it."""
    if rate_jumped:
        st.quasi_static_pa = quasi_static_pa
    lag = st.lag.lag_s * (quasi_static_pa - st.quasi_static_pa) / st.gap_s
    st.quasi_static_pa = quasi_static_pa
    return float(lag)

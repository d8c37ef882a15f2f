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
Compiled core of the HSV pressure loop: model, observer, predictor, pulse choice.

The law keeps a small model of the muscle's air (isothermal chamber, ISO 6358 valves,
volume rising with pressure), runs it on the openings that have reached the muscle,
corrects it by the measured pressure and predicts it over the openings still under way
(dead time). The opening of the next PWM period is the mass-flow inverse of the error
left at the end of that prediction. What the model misses is learned slowly in three
numbers: a gain of the fill flow, a gain of the vent flow and a drift (leak, moving
volume).

The valves rest, both duties exactly 0, once the predicted error is inside the fine band,
and until it leaves the set-point band, so that the noise of the sensor does not wake them.
Where less is wanted than the shortest possible pulse does, both
valves open in the same period and the difference of their pulses is the dose
(``hsv_pulses``). Where that would take pulses too long, at low pressure, an error below a
part of the shortest pulse's effect is left alone.

Source: ISO 6358 (flow).

``P_*`` index the parameter array, ``S_*`` the state array, ``O_*`` the output array.
"""

import math

from numba import njit
from pam_actuation.drivers.hsv_pulses import (
    duty_of_opening, joined_opening, LONGEST_OF_A_PAIR, opening_of_duty, pair_openings,
    shortest_opening)
from pam_sim.compiled import compiled, source_key
from pam_sim.units import GAS_CONSTANT_AIR, P_ATM_PA, TEMPERATURE_K
from pam_sim.valve.flow import mass_flow_kg_per_s

# Parameters.
P_PERIOD = 0            # PWM period [s]
P_DELAY = 1             # dead time told of [periods]
P_DELAY_RANGE = 2       # the learned dead time stays within +- this of it [periods]
P_CONDUCTANCE = 3       # C rho0 sqrt(T0/T) [kg/(s Pa)]
P_CRITICAL_RATIO = 4    # b
P_SUPPLY = 5            # nominal supply [Pa absolute]
P_VOLUME = 6            # volume at atmospheric pressure, dead volume included [m^3]
P_VOLUME_SLOPE = 7      # dV/dp where the load lifts off [m^3/Pa]
P_OPEN = 8              # opening time, part of a period
P_CLOSE = 9             # closing time, part of a period
P_PULSE_MARGIN = 10     # shortest pulse beyond the opening time, part of a period
P_GAIN = 11             # share of the predicted error removed per period
P_BAND = 12             # set-point band: the valves start beyond this error [Pa]
P_REST = 13             # errors below this share of the shortest pulse's effect rest
P_CORRECT = 14          # observer: pressure correction per period
P_CORRECT_VOLUME = 15   # observer: correction of volume, in pressure
P_FLOW_SCALE = 16       # change per period [Pa] from which errors count as gain errors
P_GAIN_LIMIT = 17       # flow gains stay within 1/limit..limit
P_DRIFT_LIMIT = 18      # drift stays within +- this [Pa per period]
P_SUPPLY_MARGIN = 19    # the target stays this far below the supply [Pa]
P_SLOPE = 20            # share of the command's slope fed forward
P_VOLUME_CURVE = 21     # half of d2V/dp2 [m^3/Pa^2]
P_VOLUME_KNEE = 22      # gauge pressure where the load lifts off [Pa]
P_SWING = 23            # load on the muscle: natural frequency at lift-off [rad/period]
P_SWING_SLOPE = 24      # and its change with pressure [rad/(period Pa)]
P_DAMPING = 25          # and its damping ratio
P_CORRECT_RATE = 26     # observer: correction of the volume's rate, in pressure
P_LEARN_DRIFT = 27      # observer: learning of the drift
P_LEARN_GAIN = 28       # observer: learning of the flow gains
P_SWING_LOWEST = 29     # lowest natural frequency of the load [rad/period]
P_LOOK_AHEAD = 30       # periods the error is looked ahead without the valves
P_FINE_BAND = 31        # and rest again within this one, 0 = no pairs of pulses [Pa]
P_LEARN_DELAY = 32      # observer: learning of the dead time
PAR_SIZE = 33

_DELAY_MEAN = 0.3       # of the running mean of what a wrong dead time does, per period
_LEARN_PAIR = 0.06      # of a pair's error taken over, per period
_PAIR_LIMIT = 0.5

# State.
S_MODEL = 0             # model pressure now [Pa]
S_DRIFT = 1             # learned drift [Pa per period]
S_FILL_GAIN = 2         # learned flow gains
S_VENT_GAIN = 3
S_STARTED = 4           # 1 after the first measurement
S_AGE = 5               # set by the caller: age of the measurement [s]
S_COMMAND = 6           # former command [Pa], NaN = none
S_SLOPE = 7             # former change of the command [Pa per period]
S_FLOW = 8              # pressure change by the valves in the last period [Pa]
S_VOLUME = 9            # model volume [m^3]
S_VOLUME_RATE = 10      # and its rate [m^3 per period]
S_DELAY_SHIFT = 11      # learned dead time less the one told of [periods]
S_DELAY_EFFECT = 12     # what a period less of it would have added to the reading [Pa]
S_DELAY_MEAN = 13       # its running mean [Pa]
S_AT_WORK = 14          # 1 from an error beyond the band until one within the fine band
S_PAIR_GAIN = 15        # learned: what a pair fills too much, share of what goes through it
S_SENT = 16             # openings under way, newest first, fill > 0, vent < 0
SENT_SIZE = 32
S_THROUGH = S_SENT + SENT_SIZE      # of the same periods, air through both valves [Pa]
STATE_SIZE = S_THROUGH + SENT_SIZE

# Output.
O_FILL = 0              # fill duty 0..1
O_VENT = 1              # vent duty 0..1
O_PREDICTED = 2         # predicted pressure where the new opening begins to act [Pa]
O_SATURATED = 3         # -1 vent fully open, +1 fill fully open, 0 free
O_TARGET = 4            # the command after the limits of atmosphere and supply [Pa]
OUT_SIZE = 5


@compiled
def _full_rate(state, par, p_pa, volume_m3, supply_pa, filling):
    """Return the pressure change [Pa] in one period with one valve fully open."""
    if filling:
        flow = mass_flow_kg_per_s(
            supply_pa, p_pa, par[P_CONDUCTANCE], par[P_CRITICAL_RATIO])
        flow *= state[S_FILL_GAIN]
    else:
        flow = -mass_flow_kg_per_s(
            p_pa, P_ATM_PA, par[P_CONDUCTANCE], par[P_CRITICAL_RATIO])
        flow *= state[S_VENT_GAIN]
    return GAS_CONSTANT_AIR * TEMPERATURE_K * flow * par[P_PERIOD] / volume_m3


@compiled
def _volume_pull(par, p_pa, volume_m3, rate_m3):
    """
    Return the volume's acceleration [m^3 per period^2].

    The load swings about the volume that belongs to the pressure.
    """
    above = max(p_pa - P_ATM_PA - par[P_VOLUME_KNEE], 0.0)
    rest = par[P_VOLUME] + above * (par[P_VOLUME_SLOPE] + above * par[P_VOLUME_CURVE])
    omega = max(par[P_SWING] + above * par[P_SWING_SLOPE], par[P_SWING_LOWEST])
    return omega * (omega * (rest - volume_m3) - 2.0 * par[P_DAMPING] * rate_m3)


@compiled
def _advance(state, par, p_pa, volume_m3, rate_m3, opening, periods, supply_pa):
    """
    Bring the model forward by a part of a period with a constant opening.

    Returns pressure [Pa], volume [m^3], its rate [m^3 per period] and the pressure
    change made by the valves [Pa].
    """
    flow_pa = 0.0
    substep = 0.5 * periods
    if substep <= 0.0:
        return p_pa, volume_m3, rate_m3, flow_pa
    for _ in range(2):
        rate_m3 += substep * _volume_pull(par, p_pa, volume_m3, rate_m3)
        volume_m3 += substep * rate_m3
        if volume_m3 < par[P_VOLUME]:      # the load rests on its lower stop
            volume_m3 = par[P_VOLUME]
            rate_m3 = max(rate_m3, 0.0)
        change = 0.0
        if opening != 0.0:
            filling = opening > 0.0
            size = abs(opening) * substep
            half = p_pa + 0.5 * size * _full_rate(state, par, p_pa, volume_m3, supply_pa, filling)
            half = min(max(half, P_ATM_PA), max(supply_pa, p_pa))
            change = size * _full_rate(state, par, half, volume_m3, supply_pa, filling)
        flow_pa += change
        after = p_pa + change + substep * (state[S_DRIFT] - p_pa * rate_m3 / volume_m3)
        p_pa = max(after, P_ATM_PA) if after < p_pa else after
    return p_pa, volume_m3, rate_m3, flow_pa


@compiled
def _delay(state, par):
    """Return the dead time as whole periods and the part of one that is left."""
    delay = min(max(par[P_DELAY] + state[S_DELAY_SHIFT], 0.0), SENT_SIZE - 2.0)
    whole = min(int(delay), SENT_SIZE - 3)
    return whole, delay - whole


@compiled
def _learn_delay(state, par, error):
    """
    Move the dead time where a change of the flow shows earlier or later than expected.

    With the dead time a period too long a reading is off by the latest changes of the flow,
    as far as the observer has not made up for them: a gradient step, normalised. Only the
    quick part of them tells: the slow one goes with the motion of the load, whose volume the
    model knows less well.
    """
    state[S_DELAY_MEAN] += _DELAY_MEAN * (state[S_DELAY_EFFECT] - state[S_DELAY_MEAN])
    effect = state[S_DELAY_EFFECT] - state[S_DELAY_MEAN]
    scale = par[P_FLOW_SCALE]
    shift = state[S_DELAY_SHIFT] - (
        par[P_LEARN_DELAY] * error * effect / (effect * effect + scale * scale))
    state[S_DELAY_SHIFT] = min(max(shift, -par[P_DELAY_RANGE]), par[P_DELAY_RANGE])
    state[S_DELAY_EFFECT] *= 1.0 - par[P_CORRECT]


@compiled
def observe(state, par, p_meas_pa, supply_pa):
    """
    Bring the model one period further and correct it by a measurement.

    ``p_meas_pa`` NaN = no measurement this period. Start: the first measurement is the
    model pressure.
    """
    if state[S_STARTED] < 0.5:
        if not math.isfinite(p_meas_pa):
            return
        state[S_MODEL] = p_meas_pa
        above = max(p_meas_pa - P_ATM_PA - par[P_VOLUME_KNEE], 0.0)
        state[S_VOLUME] = par[P_VOLUME] + above * (
            par[P_VOLUME_SLOPE] + above * par[P_VOLUME_CURVE])
        state[S_VOLUME_RATE] = 0.0
        state[S_STARTED] = 1.0
        return
    whole, part = _delay(state, par)
    before = state[S_MODEL]
    early = state[S_SENT + whole + 1]
    late = state[S_SENT + whole]
    p_pa, vol, vrate, flow_early = _advance(
        state, par, before, state[S_VOLUME], state[S_VOLUME_RATE], early, part, supply_pa)
    after, vol, vrate, flow_late = _advance(
        state, par, p_pa, vol, vrate, late, 1.0 - part, supply_pa)
    flow = flow_early + flow_late
    through = (part * state[S_THROUGH + whole + 1] + (1.0 - part) * state[S_THROUGH + whole])
    state[S_DELAY_EFFECT] += flow - state[S_FLOW]
    state[S_FLOW] = flow
    state[S_MODEL] = after
    state[S_VOLUME] = vol
    state[S_VOLUME_RATE] = vrate
    if not math.isfinite(p_meas_pa):
        return
    rate = (after - before) / par[P_PERIOD]
    error = p_meas_pa - (after - rate * state[S_AGE])
    state[S_MODEL] = after + par[P_CORRECT] * error
    _learn_delay(state, par, error)
    if vol > par[P_VOLUME]:
        # A reading above the model: the volume grows less than it thinks.
        per_pa = vol / after
        state[S_VOLUME] = max(vol + par[P_CORRECT_VOLUME] * error * per_pa, par[P_VOLUME])
        state[S_VOLUME_RATE] = vrate - par[P_CORRECT_RATE] * error * per_pa
    # A large flow points to a wrong flow gain, a pair of pulses to a wrong difference of two,
    # anything else to a drift.
    power = through * through + par[P_FLOW_SCALE] ** 2
    pair = state[S_PAIR_GAIN] + _LEARN_PAIR * error * through / power
    state[S_PAIR_GAIN] = min(max(pair, -_PAIR_LIMIT), _PAIR_LIMIT)
    share = 0.0
    if abs(flow) > par[P_FLOW_SCALE]:
        share = 1.0 - (par[P_FLOW_SCALE] / flow) ** 2
        index = S_FILL_GAIN if flow > 0.0 else S_VENT_GAIN
        gain = state[index] * (1.0 + par[P_LEARN_GAIN] * share * error / flow)
        state[index] = min(max(gain, 1.0 / par[P_GAIN_LIMIT]), par[P_GAIN_LIMIT])
    rest = (1.0 - share) * (1.0 - through * through / power)
    drift = state[S_DRIFT] + par[P_LEARN_DRIFT] * rest * error
    state[S_DRIFT] = min(max(drift, -par[P_DRIFT_LIMIT]), par[P_DRIFT_LIMIT])


@compiled
def _push(state, opening, through_pa):
    for i in range(SENT_SIZE - 1, 0, -1):
        state[S_SENT + i] = state[S_SENT + i - 1]
        state[S_THROUGH + i] = state[S_THROUGH + i - 1]
    state[S_SENT] = opening
    state[S_THROUGH] = through_pa


@compiled
def predict(state, par, supply_pa):
    """
    Run the model over all openings under way.

    Returns pressure [Pa], volume [m^3] and its rate [m^3 per period] when the next
    opening begins to act.
    """
    whole, part = _delay(state, par)
    p_pa, vol, vrate, _ = _advance(
        state, par, state[S_MODEL], state[S_VOLUME], state[S_VOLUME_RATE],
        state[S_SENT + whole], part, supply_pa)
    for i in range(whole - 1, -1, -1):
        p_pa, vol, vrate, _ = _advance(
            state, par, p_pa, vol, vrate, state[S_SENT + i], 1.0, supply_pa)
    return p_pa, vol, vrate


@compiled
def _command_slope(state, par, p_cmd_pa):
    """
    Return the change [Pa per period] to feed forward.

    The smaller of the last two changes of the command where they agree in sign: a ramp
    or a sine passes, a step or noise does not.
    """
    slope = 0.0
    if math.isfinite(state[S_COMMAND]):
        slope = p_cmd_pa - state[S_COMMAND]
    former = state[S_SLOPE]
    state[S_COMMAND] = p_cmd_pa
    state[S_SLOPE] = slope
    if slope * former <= 0.0:
        return 0.0
    return par[P_SLOPE] * (slope if abs(slope) < abs(former) else former)


@compiled
def _free_error(state, par, p_pa, volume_m3, rate_m3, target_pa, supply_pa):
    """
    Return the error [Pa] that stays if the valves do nothing from now on.

    The smallest over the look-ahead, 0 where it changes sign: a swing of the load that
    will close the error is left to do so.
    """
    error = 0.0
    for i in range(max(int(par[P_LOOK_AHEAD]), 1)):
        p_pa, volume_m3, rate_m3, _ = _advance(
            state, par, p_pa, volume_m3, rate_m3, 0.0, 1.0, supply_pa)
        now = target_pa - p_pa
        if i == 0:
            error = now
        elif now * error <= 0.0:
            return 0.0
        elif abs(now) < abs(error):
            error = now
    return error


@compiled
def _wanted_openings(state, par, p_pa, volume_m3, error, slope_pa, supply_pa):
    """
    Return the openings (fill, vent) for the next period.

    ``p_pa`` is the pressure it starts at, ``error`` what it has to change [Pa].
    """
    pairs = par[P_FINE_BAND] > 0.0
    at_work = pairs and state[S_AT_WORK] > 0.0
    if abs(error) <= (par[P_FINE_BAND] if at_work else par[P_BAND]):
        state[S_AT_WORK] = 0.0
        return 0.0, 0.0
    state[S_AT_WORK] = 1.0
    # The slope is part of the error one period on: only the rest is scaled by the gain.
    if slope_pa * error < 0.0:
        slope_pa = 0.0
    elif abs(slope_pa) > abs(error):
        slope_pa = error
    wanted = par[P_GAIN] * (error - slope_pa) + slope_pa
    filling = error > 0.0
    middle = p_pa + 0.5 * wanted
    middle = min(max(middle, P_ATM_PA), supply_pa)
    full = abs(_full_rate(state, par, middle, volume_m3, supply_pa, filling))
    if full <= 0.0:
        return 0.0, 0.0
    shortest = shortest_opening(par[P_OPEN], par[P_CLOSE], par[P_PULSE_MARGIN])
    if pairs and abs(wanted) < shortest * full:
        other = abs(_full_rate(state, par, middle, volume_m3, supply_pa, not filling))
        if other > 0.0:
            through = shortest * min(full, other)
            fill, vent = pair_openings(
                wanted - state[S_PAIR_GAIN] * through,
                full if filling else other, other if filling else full, shortest)
            if max(fill, vent) <= LONGEST_OF_A_PAIR:
                return fill, vent
    if abs(error) < par[P_REST] * shortest * full:
        return 0.0, 0.0
    opening = min(max(abs(wanted) / full, shortest), 1.0)
    return (opening, 0.0) if filling else (0.0, opening)


@compiled
def _joined(state, par, p_pa, volume_m3, supply_pa, fill_duty, vent_duty):
    """Return the signed opening that acts like two duties, and the air through both [Pa]."""
    fill = opening_of_duty(fill_duty, par[P_OPEN], par[P_CLOSE])
    vent = opening_of_duty(vent_duty, par[P_OPEN], par[P_CLOSE])
    if fill <= 0.0 or vent <= 0.0:
        return fill - vent, 0.0
    fill_rate = _full_rate(state, par, p_pa, volume_m3, supply_pa, True)
    vent_rate = -_full_rate(state, par, p_pa, volume_m3, supply_pa, False)
    through = min(fill * fill_rate, vent * vent_rate)
    return joined_opening(
        fill, vent, fill_rate, vent_rate, state[S_PAIR_GAIN] * through), through


@compiled
def _duty(par, opening):
    """Return the duty of an opening, exactly 0 for none."""
    if opening <= 0.0:
        return 0.0
    return duty_of_opening(opening, par[P_OPEN], par[P_CLOSE], par[P_PULSE_MARGIN])


@compiled
def _step(state, par, p_cmd_pa, p_meas_pa, supply_pa, out):
    if not math.isfinite(supply_pa):
        supply_pa = par[P_SUPPLY]
    observe(state, par, p_meas_pa, supply_pa)
    slope = _command_slope(state, par, p_cmd_pa)
    target = max(min(p_cmd_pa, supply_pa - par[P_SUPPLY_MARGIN]), P_ATM_PA)
    out[O_TARGET] = target
    out[O_FILL] = 0.0
    out[O_VENT] = 0.0
    out[O_SATURATED] = 0.0
    out[O_PREDICTED] = math.nan
    sent = 0.0
    through = 0.0
    if state[S_STARTED] > 0.5:
        predicted, vol, vrate = predict(state, par, supply_pa)
        out[O_PREDICTED] = predicted
        error = _free_error(state, par, predicted, vol, vrate, target, supply_pa)
        fill, vent = _wanted_openings(state, par, predicted, vol, error, slope, supply_pa)
        out[O_FILL] = _duty(par, fill)
        out[O_VENT] = _duty(par, vent)
        if out[O_FILL] >= 1.0 or out[O_VENT] >= 1.0:
            out[O_SATURATED] = 1.0 if out[O_FILL] >= 1.0 else -1.0
        sent, through = _joined(
            state, par, predicted, vol, supply_pa, out[O_FILL], out[O_VENT])
    _push(state, sent, through)


@compiled
def _hold(state, par, fill_duty, vent_duty, p_meas_pa, supply_pa):
    if not math.isfinite(supply_pa):
        supply_pa = par[P_SUPPLY]
    observe(state, par, p_meas_pa, supply_pa)
    sent, through = _joined(state, par, state[S_MODEL], state[S_VOLUME], supply_pa,
                            fill_duty, vent_duty)
    _push(state, sent, through)
    state[S_COMMAND] = math.nan
    state[S_SLOPE] = 0.0


def _entries(key):
    """Return both entry points as units of compiled code, stored under ``key``."""
    @njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
    def hsv_step(state, par, p_cmd_pa, p_meas_pa, supply_pa, out):
        """
        One PWM period of the pressure loop.

        Parameters
        ----------
        state, par, out : float64 arrays
            Laid out as the ``S_*``, ``P_*`` and ``O_*`` constants; ``state`` and ``out`` are
            written. ``state[S_AGE]`` may be set before to the age of the measurement [s].
        p_cmd_pa, p_meas_pa, supply_pa : float
            Wanted, measured and supply pressure, absolute [Pa]. A measurement of NaN means
            none this period, a supply of NaN the nominal one.

        """
        if key >= 0:      # always; makes the key part of what is stored
            _step(state, par, p_cmd_pa, p_meas_pa, supply_pa, out)

    @njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
    def hsv_hold(state, par, fill_duty, vent_duty, p_meas_pa, supply_pa):
        """One PWM period with imposed duties (vent, missed tick): only the model goes on."""
        if key >= 0:
            _hold(state, par, fill_duty, vent_duty, p_meas_pa, supply_pa)

    return hsv_step, hsv_hold


hsv_step, hsv_hold = _entries(source_key(_step, _hold))

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
One tick of the self-organizing fuzzy controller, compiled, without allocation.

Order of a tick: smooth jumps; error and filtered change of error; fuzzification;
the rule tables, static inverse and dynamics, trim; limits with back-calculation;
memory of the firing strengths; modification of the rules that were active one
credit delay ago; roll-back.
"""

import math

from numba import njit
from pam_actuation.control import inputs as place
from pam_actuation.control.law_parts import (
    faded_offset, filtered_change, first_command_pa, held_offset, integral_growth, limited)
from pam_actuation.control.sofc import credit, dynamics, guard, layout as at, learning
from pam_actuation.control.sofc.membership import (
    gaussian_degree, locate, locate_signed_logarithmic, SET_COUNT)
from pam_actuation.control.sofc.performance_index import index_linear, index_table
from pam_actuation.control.sofc.rule_table import (
    contracting_share, infer_feedback, infer_feedforward, infer_motion)
from pam_actuation.control.static_inverse import inverse_pressure_pa
from pam_sim.compiled import compiled, source_key
from pam_sim.units import P_ATM_PA

_START_BAND_M = 5e-5      # start-up is over when the bumpless offset is below this
_START_TRIM_PA = 1e4      # largest integral taken over at the start: what dry friction explains
_LIFTED_M = 5e-4          # below this contraction the pressure at rest says nothing


@compiled
def _start(par, inverse, values, kept, st, inp):
    """Begin so that the reference starts where the muscle is and the command where it is."""
    x = inp[place.IN_CONTRACTION]
    st[:] = 0.0
    st[at.S_STARTED] = 1.0
    st[at.S_RATE_FACTOR] = 1.0
    st[at.S_RATE_CEILING] = 1.0
    st[at.S_SHARE] = 0.5
    st[at.S_OFFSET] = inp[place.IN_REFERENCE] - x
    st[at.S_CONTRACTION] = x
    st[at.S_REFERENCE] = inp[place.IN_REFERENCE]
    st[at.S_LEAD_REFERENCE] = inp[place.IN_LEAD_REFERENCE]
    guard.keep(values, kept)
    pressure = inp[place.IN_PRESSURE]
    st[at.S_OUTPUT] = first_command_pa(
        pressure, P_ATM_PA + par[at.P_MIN_PRESSURE_GAUGE],
        P_ATM_PA + par[at.P_MAX_PRESSURE_GAUGE])
    if math.isfinite(pressure) and x > _LIFTED_M:
        trim = (pressure - inverse_pressure_pa(inverse, x)) / dynamics.load_shape(par, x)
        st[at.S_INTEGRAL] = min(max(trim, -_START_TRIM_PA), _START_TRIM_PA)
        st[at.S_INTEGRAL_MEAN] = st[at.S_INTEGRAL]


@compiled
def _valve_lags(par, ring, st, inp):
    """
    Tell whether the measured pressure is far from what the commands should have made of it.

    Expected is the command of one preview ago behind the lag of the valve.
    """
    if st[at.S_HISTORY] < par[at.P_ANSWER]:
        st[at.S_EXPECTED] = inp[place.IN_PRESSURE]
        return False
    then = credit.row_of(ring, int(st[at.S_TICK]), int(par[at.P_ANSWER]))
    arrived = ring[then, credit.ENTRY_OUTPUT]
    if not math.isfinite(st[at.S_EXPECTED]):
        st[at.S_EXPECTED] = arrived
    part = par[at.P_PERIOD] / (par[at.P_VALVE_LAG] + par[at.P_PERIOD])
    st[at.S_EXPECTED] += part * (arrived - st[at.S_EXPECTED])
    gap = abs(st[at.S_EXPECTED] - inp[place.IN_PRESSURE])
    return gap > par[at.P_VALVE_GAP]          # False for NaN: pressure is optional


@compiled
def _surprising(par, st, error):
    """Tell whether an error is out of proportion to those of the last window."""
    return abs(error) > par[at.P_SURPRISE] * st[at.S_FORMER] > 0.0


@compiled
def _reason(par, ring, st, inp, error, at_limit, lags):
    """Return why the rules do not change in this tick, ``learning.LEARNING`` if they do."""
    tick = int(st[at.S_TICK])
    delay = int(par[at.P_DELAY])
    spread = int(par[at.P_SPREAD])
    if inp[place.IN_LEARN] < 0.5:
        return learning.FROZEN_OFF
    if st[at.S_HISTORY] < delay + spread or abs(st[at.S_OFFSET]) > _START_BAND_M:
        if st[at.S_ROLLED_BACK] > 0.0 and st[at.S_HISTORY] < delay + spread:
            return learning.FROZEN_ROLLED_BACK
        return learning.FROZEN_START
    if lags:
        return learning.FROZEN_VALVE
    if st[at.S_FREEZE_LEFT] > 0.0:
        return learning.FROZEN_JUMP
    force = inp[place.IN_FORCE]
    if force < par[at.P_SLACK_FORCE]:         # False for NaN: force is optional
        return learning.FROZEN_SLACK
    then = credit.row_of(ring, tick, delay)
    if at_limit or ring[then, credit.ENTRY_VALID] < 0.5:
        return learning.FROZEN_SATURATED
    if _surprising(par, st, error):
        return learning.FROZEN_SURPRISE
    if abs(error) <= par[at.P_DEAD_ZONE]:
        return learning.FROZEN_DEAD_ZONE
    return learning.LEARNING


@compiled
def _learn(par, values, initial, ring, st):
    """Modify the rules whose indices are now all known; return the squares of the changes."""
    tick = int(st[at.S_TICK])
    spread = int(par[at.P_SPREAD])
    row = credit.row_of(ring, tick, int(par[at.P_DELAY]) + spread)
    index = credit.credited_index(ring, tick, spread)
    if index == 0.0 or ring[row, credit.ENTRY_VALID] < 0.5:
        return 0.0, 0.0, 0.0
    rate = par[at.P_LEARNING_RATE] * st[at.S_RATE_FACTOR] * st[at.S_RATE_CEILING]
    leak = abs(index) * par[at.P_PERIOD]
    share = ring[row, credit.ENTRY_SHARE]
    fb_squares = learning.modify_feedback(
        values[0], initial[0], share,
        int(ring[row, credit.ENTRY_ERROR_SET]), ring[row, credit.ENTRY_ERROR_DEGREE],
        int(ring[row, credit.ENTRY_CHANGE_SET]), ring[row, credit.ENTRY_CHANGE_DEGREE],
        rate * index * par[at.P_PERIOD] * par[at.P_FEEDBACK_LEARNING],
        leak * par[at.P_FEEDBACK_LEAK], par[at.P_FEEDBACK_STEP_LIMIT])
    # What the index asks for in pressure, for one pass.
    wanted_pa = rate * (
        index * ring[row, credit.ENTRY_CORRECTION]
        + par[at.P_TAKEOVER] * ring[row, credit.ENTRY_MOVING])
    ff_squares = learning.modify_feedforward(
        values[1], initial[1], share,
        int(ring[row, credit.ENTRY_KNOT]), ring[row, credit.ENTRY_KNOT_DEGREE],
        wanted_pa * ring[row, credit.ENTRY_PASS] * par[at.P_FEEDFORWARD_LEARNING],
        leak * par[at.P_FEEDFORWARD_LEAK],
        par[at.P_FEEDFORWARD_STEP_LIMIT], par[at.P_FEEDFORWARD_LIMIT])
    if st[at.S_JUMPED] > 0.0:
        wanted_pa *= par[at.P_JUMP_MOTION_LEARNING]
    motion_squares = learning.modify_motion(
        values[2], initial[2],
        int(ring[row, credit.ENTRY_MOTION_KNOT]), ring[row, credit.ENTRY_MOTION_KNOT_DEGREE],
        int(ring[row, credit.ENTRY_RATE_KNOT]), ring[row, credit.ENTRY_RATE_KNOT_DEGREE],
        wanted_pa * ring[row, credit.ENTRY_MOTION_PASS] * par[at.P_MOTION_LEARNING],
        leak * par[at.P_FEEDFORWARD_LEAK],
        par[at.P_FEEDFORWARD_STEP_LIMIT], par[at.P_FEEDFORWARD_LIMIT])
    return fb_squares, ff_squares, motion_squares


@compiled
def _count(fired, share, i, wi, j, wj, k, wk, m, wm, n, wn):
    """Add the firing strengths of this tick to the counts of the rules."""
    for d in range(2):
        direction = share if d == 0 else 1.0 - share
        fired[0][d, i, j] += direction * (1.0 - wi) * (1.0 - wj)
        fired[0][d, i, j + 1] += direction * (1.0 - wi) * wj
        fired[0][d, i + 1, j] += direction * wi * (1.0 - wj)
        fired[0][d, i + 1, j + 1] += direction * wi * wj
        fired[1][d, k] += direction * (1.0 - wk)
        fired[1][d, k + 1] += direction * wk
    fired[2][m, n] += (1.0 - wm) * (1.0 - wn)
    fired[2][m, n + 1] += (1.0 - wm) * wn
    fired[2][m + 1, n] += wm * (1.0 - wn)
    fired[2][m + 1, n + 1] += wm * wn


@compiled
def _passes(par, st, knot_place, motion_place, rate_place):
    """
    Return which part of a pass over the feed-forward and the motion rules this tick was.

    A pass is the way from one knot to the next; standing still for ``pass_time_s`` also
    counts as one, just after a jump as ``settling_passes``: what is missing there is an
    error of the rules, later it is creep. Motion rules do not know from which side the
    muscle came to rest, so less of that may count for them (``motion_at_rest``).
    """
    still = par[at.P_PERIOD] / par[at.P_PASS_TIME]
    if st[at.S_JUMP_LEFT] > 0.0:
        st[at.S_SETTLING_LEFT] = par[at.P_SETTLING_TIME]
    elif st[at.S_SETTLING_LEFT] > 0.0:
        st[at.S_SETTLING_LEFT] -= par[at.P_PERIOD]
        still *= par[at.P_SETTLING_PASSES]
    a_pass = still
    motion_pass = still * par[at.P_MOTION_AT_REST]
    if st[at.S_HISTORY] > 0.0:
        by_position = motion_place - st[at.S_MOTION_PLACE]
        by_rate = rate_place - st[at.S_RATE_PLACE]
        a_pass += abs(knot_place - st[at.S_PLACE])
        motion_pass += math.sqrt(by_position * by_position + by_rate * by_rate)
    st[at.S_PLACE] = knot_place
    st[at.S_MOTION_PLACE] = motion_place
    st[at.S_RATE_PLACE] = rate_place
    return min(a_pass, 1.0), min(motion_pass, 1.0)


@compiled
def _tick(par, inverse, values, initial, fired, kept, ring, st, inp, out):
    """Run one tick; see ``sofc_step``."""
    period = par[at.P_PERIOD]
    if st[at.S_STARTED] < 0.5:
        _start(par, inverse, values, kept, st, inp)
    jump, lead_jump = dynamics.jumps(par, st, inp)
    # A jump not seen ahead: the move can only begin one preview from now.
    wait = par[at.P_LEAD] if lead_jump != 0.0 else 0.0
    to_go, extra_rate = dynamics.smooth_jump(par, st, jump, wait, at.S_JUMP, at.S_JUMP_LEFT)
    lead_to_go, lead_extra_rate = dynamics.smooth_jump(
        par, st, lead_jump, 0.0, at.S_LEAD_JUMP, at.S_LEAD_JUMP_LEFT)
    change = filtered_change(
        st[at.S_RATE], par[at.P_CHANGE_FILTER], inp[place.IN_REFERENCE_RATE] + extra_rate,
        inp[place.IN_CONTRACTION] - st[at.S_CONTRACTION], inp[place.IN_ELAPSED], period,
        st[at.S_HISTORY] > 0.0)
    st[at.S_RATE] = change
    st[at.S_CONTRACTION] = inp[place.IN_CONTRACTION]
    dynamics.note_jump(st, inp[place.IN_REFERENCE_RATE])
    lags = _valve_lags(par, ring, st, inp)
    held_back = inp[place.IN_HELD_BACK]
    stays_behind = lags or held_back != 0.0
    if stays_behind or (par[at.P_JUMP_TIME] <= 0.0 and (jump != 0.0 or lead_jump != 0.0)):
        st[at.S_FREEZE_LEFT] = par[at.P_DELAY] * period + par[at.P_JUMP_FREEZE]
    offset = held_offset(
        st[at.S_OFFSET], held_back, inp[place.IN_REFERENCE] - to_go - inp[place.IN_CONTRACTION],
        st[at.S_ERROR], par[at.P_START_TIME], period)
    error = inp[place.IN_REFERENCE] - to_go - offset - inp[place.IN_CONTRACTION]
    st[at.S_ERROR] = error
    lead = inp[place.IN_LEAD_REFERENCE] - lead_to_go - offset
    lead_rate = inp[place.IN_LEAD_RATE] + lead_extra_rate
    st[at.S_OFFSET] = faded_offset(offset, par[at.P_START_TIME], period)

    # Fuzzification.
    error_scaled = error / par[at.P_ERROR_UNIVERSE]
    change_scaled = change / par[at.P_CHANGE_UNIVERSE]
    i, wi = locate(error_scaled, -1.0, 1.0, SET_COUNT)
    j, wj = locate(change_scaled, -1.0, 1.0, SET_COUNT)
    if par[at.P_MEMBERSHIP_FORM] > 0.5:
        wi = gaussian_degree(wi, par[at.P_MEMBERSHIP_WIDTH])
        wj = gaussian_degree(wj, par[at.P_MEMBERSHIP_WIDTH])
    lower = par[at.P_REFERENCE_LOWER]
    upper = par[at.P_REFERENCE_UPPER]
    k, wk = locate(lead, lower, upper, values[1].shape[1])
    m, wm = locate(lead, lower, upper, values[2].shape[0])
    n, wn = locate_signed_logarithmic(
        lead_rate, par[at.P_MOTION_RATE_FINE], par[at.P_MOTION_RATE_UPPER], values[2].shape[1])
    way = 0.0 if st[at.S_HISTORY] < 0.5 else lead - st[at.S_LEAD]
    st[at.S_LEAD] = lead
    share = contracting_share(st[at.S_SHARE], way, par[at.P_DIRECTION_BLEND])
    st[at.S_SHARE] = share
    a_pass, motion_pass = _passes(par, st, k + wk, m + wm, n + wn)

    # Inference and trim.
    base = inverse_pressure_pa(inverse, lead)
    dynamic = dynamics.dynamic_pressure_pa(
        par, st, base, lead_rate, st[at.S_HISTORY] < 0.5 or lead_jump != 0.0)
    feedback = par[at.P_FEEDBACK_GAIN] * infer_feedback(values[0], share, i, wi, j, wj)
    feedforward = infer_feedforward(values[1], share, k, wk)
    motion = infer_motion(values[2], m, wm, n, wn)
    proportional = par[at.P_PROPORTIONAL] * error
    derivative = par[at.P_DERIVATIVE] * change
    integral = st[at.S_INTEGRAL]
    st[at.S_INTEGRAL_SHAPE] = dynamics.load_shape(par, lead)
    trim = integral * st[at.S_INTEGRAL_SHAPE]
    wanted = (base + dynamic + feedback + feedforward + motion
              + proportional + trim + derivative)

    # The limits of the actuator, then of its speed.
    lowest = P_ATM_PA + par[at.P_MIN_PRESSURE_GAUGE]
    highest = P_ATM_PA + par[at.P_MAX_PRESSURE_GAUGE]
    inside, command = limited(
        wanted, st[at.S_OUTPUT], lowest, highest, par[at.P_SLEW] * period)
    at_low = wanted < lowest
    at_high = wanted > highest
    at_slew = command != inside
    at_limit = at_low or at_high or at_slew
    st[at.S_OUTPUT] = command

    # Integral with back-calculation against the limits of pressure.
    integral_gain = par[at.P_INTEGRAL]
    if _surprising(par, st, error):
        integral_gain *= par[at.P_SURPRISE_INTEGRAL]
    growth = integral_growth(
        integral_gain * error, (inside - wanted) / par[at.P_ANTI_WINDUP_TIME],
        held_back) * period
    # Supply, valve or driver hold the pressure back, or the command is on its way: more would
    # not help, and the way from one pressure to another is no error of the pressure at its end.
    if lags or at_slew:
        growth = 0.0
    st[at.S_INTEGRAL] = min(
        max(integral + growth, -par[at.P_INTEGRAL_LIMIT]), par[at.P_INTEGRAL_LIMIT])

    # Credit memory and rule modification.
    undisturbed = st[at.S_FREEZE_LEFT] <= 0.0 and abs(offset) <= _START_BAND_M
    row = credit.row_of(ring, int(st[at.S_TICK]), 0)
    mean = st[at.S_INTEGRAL_MEAN]
    st[at.S_INTEGRAL_MEAN] += period / (par[at.P_TAKEOVER_TIME] + period) * (integral - mean)
    credit.push_feedback(ring, row, i, wi, j, wj, share)
    credit.push_feedforward(ring, row, k, wk, m, wm, n, wn)
    correction = par[at.P_CORRECTION]
    if not correction > 0.0:
        correction = dynamics.slope_pa_per_m(inverse, lead)
    credit.push_outcome(ring, row, a_pass, motion_pass, correction, integral - mean,
                        0.0 if at_limit or not undisturbed else 1.0, command)
    if par[at.P_INDEX_FORM] < 0.5:
        index = index_linear(error, change, par[at.P_INDEX_TAU], par[at.P_INDEX_LIMIT])
    else:
        index = index_table(error_scaled, change_scaled, par[at.P_INDEX_LIMIT])
    reason = _reason(par, ring, st, inp, error, at_limit, stays_behind)
    fb_squares = 0.0
    ff_squares = 0.0
    motion_squares = 0.0
    ring[row, credit.ENTRY_INDEX] = index if reason == learning.LEARNING else 0.0
    if reason == learning.LEARNING or reason == learning.FROZEN_DEAD_ZONE:
        fb_squares, ff_squares, motion_squares = _learn(par, values, initial, ring, st)
    _count(fired, share, i, wi, j, wj, k, wk, m, wm, n, wn)

    out[at.O_COMMAND] = command
    out[at.O_ERROR] = error
    out[at.O_CHANGE] = change
    out[at.O_INVERSE] = base
    out[at.O_DYNAMIC] = dynamic
    out[at.O_FEEDBACK] = feedback
    out[at.O_FEEDFORWARD] = feedforward
    out[at.O_MOTION] = motion
    out[at.O_PROPORTIONAL] = proportional
    out[at.O_INTEGRAL] = trim
    out[at.O_DERIVATIVE] = derivative
    out[at.O_UNLIMITED] = wanted
    out[at.O_SAT_LOW] = 1.0 if at_low else 0.0
    out[at.O_SAT_HIGH] = 1.0 if at_high else 0.0
    out[at.O_SAT_SLEW] = 1.0 if at_slew else 0.0
    out[at.O_SHARE] = share
    out[at.O_ERROR_SET] = i
    out[at.O_ERROR_DEGREE] = wi
    out[at.O_CHANGE_SET] = j
    out[at.O_CHANGE_DEGREE] = wj
    out[at.O_KNOT] = k
    out[at.O_KNOT_DEGREE] = wk
    out[at.O_MOTION_KNOT] = m
    out[at.O_MOTION_KNOT_DEGREE] = wm
    out[at.O_RATE_KNOT] = n
    out[at.O_RATE_KNOT_DEGREE] = wn
    out[at.O_INDEX] = index
    out[at.O_REASON] = reason
    out[at.O_CREDIT] = 1.0 if reason == learning.LEARNING else 0.0
    out[at.O_FEEDBACK_NORM] = par[at.P_FEEDBACK_GAIN] * math.sqrt(fb_squares)
    out[at.O_FEEDFORWARD_NORM] = math.sqrt(ff_squares)
    out[at.O_MOTION_NORM] = math.sqrt(motion_squares)
    out[at.O_OFFSET] = offset
    out[at.O_JUMP] = to_go
    st[at.S_TICK] += 1.0
    st[at.S_HISTORY] += 1.0
    st[at.S_FREEZE_LEFT] = max(0.0, st[at.S_FREEZE_LEFT] - period)
    _guard(par, values, kept, st, inp, error, reason, out)
    return command


@compiled
def _guard(par, values, kept, st, inp, error, reason, out):
    """Watch over learning; a roll-back makes no step in the command."""
    off = reason == learning.FROZEN_OFF or reason == learning.FROZEN_VALVE
    if off or reason == learning.FROZEN_START or reason == learning.FROZEN_JUMP:
        guard.restart_window(st)      # such errors tell nothing about the rules
    elif par[at.P_GUARD_RATIO] > 0.0 and guard.watch(
            par, st, error, inp[place.IN_REFERENCE_RATE], values, kept):
        share = out[at.O_SHARE]
        restored = (
            par[at.P_FEEDBACK_GAIN] * infer_feedback(
                values[0], share, int(out[at.O_ERROR_SET]), out[at.O_ERROR_DEGREE],
                int(out[at.O_CHANGE_SET]), out[at.O_CHANGE_DEGREE])
            + infer_feedforward(
                values[1], share, int(out[at.O_KNOT]), out[at.O_KNOT_DEGREE])
            + infer_motion(
                values[2], int(out[at.O_MOTION_KNOT]), out[at.O_MOTION_KNOT_DEGREE],
                int(out[at.O_RATE_KNOT]), out[at.O_RATE_KNOT_DEGREE]))
        before = out[at.O_FEEDBACK] + out[at.O_FEEDFORWARD] + out[at.O_MOTION]
        limit = par[at.P_INTEGRAL_LIMIT]
        st[at.S_INTEGRAL] = min(
            max(st[at.S_INTEGRAL] + (before - restored) / st[at.S_INTEGRAL_SHAPE], -limit), limit)
        st[at.S_HISTORY] = 1.0        # no credit for rules that are gone
    out[at.O_WINDOW] = st[at.S_FORMER]
    out[at.O_BEST] = st[at.S_BEST]
    out[at.O_RATE_FACTOR] = st[at.S_RATE_FACTOR] * st[at.S_RATE_CEILING]
    out[at.O_ROLLED_BACK] = st[at.S_ROLLED_BACK]


def _entry(key):
    """Return the step function as one unit of compiled code, stored under ``key``."""
    @njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
    def sofc_step(par, inverse, values, initial, fired, kept, ring, st, inp, out):
        """
        Run one tick; return the pressure command [absolute Pa].

        Parameters
        ----------
        par, inverse : float64[:]
            Parameter vector (``settings.parameter_vector``) and static inverse table.
        values, initial, fired, kept : tuple of arrays
            Feedback, feed-forward and motion rules; their initial values, their firing counts,
            the last good ones.
        ring : float64[:, :]
            Credit memory (``credit.ring_rows`` rows).
        st, inp, out : float64[:]
            State (``layout.S_*``), inputs (``inputs.IN_*``), outputs (``layout.O_*``).

        """
        if key < 0:       # never; makes the key part of what is stored
            return P_ATM_PA
        return _tick(par, inverse, values, initial, fired, kept, ring, st, inp, out)

    return sofc_step


sofc_step = _entry(source_key(_tick))

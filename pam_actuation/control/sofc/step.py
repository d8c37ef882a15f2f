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

A tick first smooths jumps and computes error and filtered change of error. Fuzzification, rule
tables, static inverse, dynamics and trim follow, then limits with back-calculation. Last are the
memory of the firing strengths, the modification of the rules that were active one credit delay
ago, and roll-back.
"""

import math

import numpy as np
from pam_actuation.control.inputs import INPUT
from pam_actuation.control.law_parts import (
    faded_offset, filtered_change, first_command_pa, held_offset, integral_growth, limited)
from pam_actuation.control.sofc import (
    credit, dynamics, guard, learning, muscle_model, path_memory, predictor, rules_output,
    valve_lag)
from pam_actuation.control.sofc.credit import Ring
from pam_actuation.control.sofc.membership import (
    gaussian_degree, locate, locate_signed_logarithmic, SET_COUNT)
from pam_actuation.control.sofc.performance_index import index_linear, index_table
from pam_actuation.control.sofc.records import ENTRY, OUTPUT, STATE
from pam_actuation.control.sofc.rule_table import contracting_share, layer, Tables
from pam_actuation.control.sofc.settings import PARAMETERS
from pam_actuation.control.static_inverse import inverse_pressure_pa
from pam_sim.annotations import FloatArray
from pam_sim.compiled import Compiled, compiled, entry_point, source_key
from pam_sim.records import part
from pam_sim.units import P_ATM_PA

_START_BAND_M = 5e-5      # start-up is over when the bumpless offset is below this
_START_TRIM_PA = 1e4      # largest integral taken over at the start: what dry friction explains
_LIFTED_M = 5e-4          # below this contraction the pressure at rest says nothing


@compiled
def _start(par: np.record, inverse: FloatArray, values: Tables, kept: Tables, ring: Ring,
           st: np.record, inp: np.record) -> None:
    """Begin so that the reference starts where the muscle is and the command where it is."""
    x = inp.contraction_m
    st.started = 1.0
    st.integral_pa = 0.0      # where rules were exchanged before the first tick
    st.rules_share = 1.0
    st.rate_factor = 1.0
    st.rate_ceiling = 1.0
    st.lag.lag_s = par.valve_lag_s
    st.lag.dead_s = min(par.dead_time_s, par.lead_s)
    st.contracting_share = 0.5
    st.offset_m = inp.reference_m - x
    st.contraction_m = x
    # It moved before, too.
    way = par.revision * par.period_s
    st.reference_m = inp.reference_m - way * inp.reference_rate_m_per_s
    st.lead_reference_m = inp.lead_reference_m - way * inp.lead_rate_m_per_s
    st.model.slow_m = x
    if par.revision > 0.5:
        muscle_model.begin_motion(st.model, x, inp.pressure_pa)
    guard.keep(values, kept)
    pressure = inp.pressure_pa
    st.command_pa = first_command_pa(
        pressure, P_ATM_PA + par.min_pressure_gauge_pa,
        P_ATM_PA + par.max_pressure_gauge_pa)
    if par.revision > 0.5:
        for row in range(ring.shape[0]):
            ring[row].command_pa = st.command_pa
    if math.isfinite(pressure) and x > _LIFTED_M:
        trim = (pressure - inverse_pressure_pa(inverse, x)) / dynamics.load_shape(par, x)
        st.integral_pa = min(max(trim, -_START_TRIM_PA), _START_TRIM_PA)
        st.integral_mean_pa = st.integral_pa


@compiled
def _surprising(par: np.record, st: np.record, error: float) -> bool:
    """Tell whether an error is out of proportion to those of the last window."""
    return abs(error) > par.surprise_ratio * st.former_rms_m > 0.0


@compiled
def _reason(par: np.record, ring: Ring, st: np.record, inp: np.record, error: float,
            at_limit: bool, lags: bool) -> int:
    """Return why the rules do not change in this tick, ``learning.LEARNING`` if they do."""
    tick = int(st.tick)
    delay = int(par.delay_ticks)
    spread = int(par.spread_ticks)
    if inp.learning < 0.5:
        return learning.FROZEN_OFF
    if st.history_ticks < delay + spread or abs(st.offset_m) > _START_BAND_M:
        if st.rolled_back > 0.0 and st.history_ticks < delay + spread:
            return learning.FROZEN_ROLLED_BACK
        return learning.FROZEN_START
    if lags:
        return learning.FROZEN_VALVE
    if st.freeze_left_s > 0.0:
        return learning.FROZEN_JUMP
    force = inp.force_n
    if force < par.slack_force_n:         # False for NaN: force is optional
        return learning.FROZEN_SLACK
    then = credit.row_of(ring, tick, delay)
    if at_limit or ring[then].valid < 0.5:
        if at_limit or par.revision < 0.5:
            return learning.FROZEN_SATURATED
        return max(int(-ring[then].valid), learning.FROZEN_START)     # 0: rules that are gone
    if _surprising(par, st, error):
        return learning.FROZEN_SURPRISE
    if abs(error) <= par.dead_zone_m:
        return learning.FROZEN_DEAD_ZONE
    return learning.LEARNING


@compiled
def _learn(par: np.record, values: Tables, initial: Tables, ring: Ring,
           st: np.record) -> tuple[float, float, float]:
    """Modify the rules whose indices are now all known; return the squares of the changes."""
    feedback, feedforward, motion, _ = values
    first_feedback, first_feedforward, first_motion, _ = initial
    tick = int(st.tick)
    spread = int(par.spread_ticks)
    entry = ring[credit.row_of(ring, tick, int(par.delay_ticks) + spread)]
    index = credit.credited_index(ring, tick, spread)
    if index == 0.0 or entry.valid < 0.5:
        return 0.0, 0.0, 0.0
    rate = par.learning_rate * st.rate_factor * st.rate_ceiling
    leak = abs(index) * par.period_s
    share = entry.contracting_share
    fb_squares = learning.modify_feedback(
        feedback, first_feedback, share,
        int(entry.error_set), entry.error_degree,
        int(entry.change_set), entry.change_degree,
        rate * index * par.period_s * par.feedback_learning_per_m_s,
        leak * par.feedback_leak_per_m_s, par.feedback_step_limit)
    # What the index asks for in pressure, for one pass.
    wanted_pa = st.rules_share * rate * (
        index * entry.correction_pa_per_m
        + par.takeover * entry.integral_deviation_pa)
    ff_squares = learning.modify_feedforward(
        feedforward, first_feedforward, share,
        int(entry.reference_knot), entry.reference_knot_degree,
        wanted_pa * entry.feedforward_pass * par.feedforward_learning,
        leak * par.feedforward_leak_per_m_s,
        par.feedforward_step_limit_pa, par.feedforward_limit_pa)
    if st.jumped > 0.0:
        wanted_pa *= par.jump_motion_learning
    motion_squares = learning.modify_motion(
        motion, first_motion,
        int(entry.motion_knot), entry.motion_knot_degree,
        int(entry.motion_rate_knot), entry.motion_rate_knot_degree,
        wanted_pa * entry.motion_pass * par.motion_learning,
        leak * par.feedforward_leak_per_m_s,
        par.feedforward_step_limit_pa, par.feedforward_limit_pa)
    return fb_squares, ff_squares, motion_squares


@compiled
def _count(fired: Tables, share: float, i: int, wi: float, j: int, wj: float, k: int, wk: float,
           m: int, wm: float, n: int, wn: float) -> None:
    """Add the firing strengths of this tick to the counts of the rules."""
    feedback, feedforward, motion, _ = fired
    for d in range(2):
        direction = share if d == 0 else 1.0 - share
        feedback[d, i, j] += direction * (1.0 - wi) * (1.0 - wj)
        feedback[d, i, j + 1] += direction * (1.0 - wi) * wj
        feedback[d, i + 1, j] += direction * wi * (1.0 - wj)
        feedback[d, i + 1, j + 1] += direction * wi * wj
        feedforward[d, k] += direction * (1.0 - wk)
        feedforward[d, k + 1] += direction * wk
    motion[m, n] += (1.0 - wm) * (1.0 - wn)
    motion[m, n + 1] += (1.0 - wm) * wn
    motion[m + 1, n] += wm * (1.0 - wn)
    motion[m + 1, n + 1] += wm * wn


@compiled
def _passes(par: np.record, st: np.record, knot_place: float, motion_place: float,
            rate_place: float) -> tuple[float, float]:
    """
    Return which part of a pass over the feed-forward and the motion rules this tick was.

    A pass is the way from one knot to the next. Standing still for ``pass_time_s`` also counts as
    one, just after a jump as ``settling_passes``. There the error is one of the rules; later it is
    creep. Motion rules do not know from which side the muscle came to rest, so less of that may
    count for them (``motion_at_rest``).
    """
    still = par.period_s / par.pass_time_s
    if st.move.left_s > 0.0:
        st.settling_left_s = par.settling_time_s
    elif st.settling_left_s > 0.0:
        st.settling_left_s -= par.period_s
        still *= par.settling_passes
    a_pass = still
    motion_pass = still * par.motion_at_rest
    if st.history_ticks > 0.0:
        by_position = motion_place - st.motion_knot_place
        by_rate = rate_place - st.motion_rate_place
        a_pass += abs(knot_place - st.knot_place)
        motion_pass += math.sqrt(by_position * by_position + by_rate * by_rate)
    st.knot_place = knot_place
    st.motion_knot_place = motion_place
    st.motion_rate_place = rate_place
    return min(a_pass, 1.0), min(motion_pass, 1.0)


@compiled
def _tick(par: np.record, inverse: FloatArray, values: Tables, initial: Tables, fired: Tables,
          kept: Tables, ring: Ring, st: np.record, inp: np.record, out: np.record) -> float:
    """Run one tick; see ``sofc_step``."""
    _, feedforward_rules, motion_rules, path_rules = values
    period = par.period_s
    elapsed_s = inp.elapsed_s if math.isfinite(inp.elapsed_s) else period
    if st.started < 0.5:
        _start(par, inverse, values, kept, ring, st, inp)
    jump, lead_jump = dynamics.jumps(par, st, inp)
    # A jump not seen ahead: the move can only begin one preview from now.
    wait = par.lead_s if lead_jump != 0.0 else 0.0
    to_go, extra_rate, _ = dynamics.smooth_jump(par, st.move, jump, wait)
    lead_to_go, lead_extra_rate, lead_extra = dynamics.smooth_jump(
        par, st.lead_move, lead_jump, 0.0)
    change = filtered_change(
        st.change_m_per_s, par.change_filter_s, inp.reference_rate_m_per_s + extra_rate,
        inp.contraction_m - st.contraction_m, elapsed_s, period,
        st.history_ticks > 0.0)
    st.change_m_per_s = change
    st.contraction_m = inp.contraction_m
    dynamics.note_jump(par, st, inp.reference_rate_m_per_s, jump, lead_jump)
    lags = valve_lag.falls_behind(par, ring, st, inp)
    held_back = inp.held_back
    stays_behind = lags or held_back != 0.0
    if stays_behind or (par.jump_time_s <= 0.0 and (jump != 0.0 or lead_jump != 0.0)):
        st.freeze_left_s = par.delay_ticks * period + par.jump_freeze_s
    offset = held_offset(
        st.offset_m, held_back, inp.reference_m - to_go - inp.contraction_m,
        st.error_m, par.start_time_s, period)
    error = inp.reference_m - to_go - offset - inp.contraction_m
    st.error_m = error
    lead = inp.lead_reference_m - lead_to_go - offset
    lead_rate = inp.lead_rate_m_per_s + lead_extra_rate
    dynamics.note_announced(par, ring, st, inp)
    st.jumps_m += lead_jump
    lead, lead_rate, lead_extra_rate, lead_extra = dynamics.later(
        par, ring, st, inp, lead, lead_rate, lead_extra_rate, lead_extra)
    st.offset_m = faded_offset(offset, par.start_time_s, period)

    # Fuzzification.
    error_scaled = error / par.error_universe_m
    change_scaled = change / par.change_universe_m_per_s
    i, wi = locate(error_scaled, -1.0, 1.0, SET_COUNT)
    j, wj = locate(change_scaled, -1.0, 1.0, SET_COUNT)
    if par.membership_form > 0.5:
        wi = gaussian_degree(wi, par.membership_width)
        wj = gaussian_degree(wj, par.membership_width)
    lower = par.reference_lower_m
    upper = par.reference_upper_m
    k, wk = locate(lead, lower, upper, feedforward_rules.shape[1])
    m, wm = locate(lead, lower, upper, motion_rules.shape[0])
    n, wn = locate_signed_logarithmic(
        lead_rate, par.motion_rate_fine_m_per_s, par.motion_rate_upper_m_per_s,
        motion_rules.shape[1])
    way = 0.0 if st.history_ticks < 0.5 else lead - st.lead_m
    st.lead_m = lead
    share = contracting_share(st.contracting_share, way, par.direction_blend_m)
    st.contracting_share = share
    out.contracting_share = share
    out.error_set, out.error_degree = i, wi
    out.change_set, out.change_degree = j, wj
    out.reference_knot, out.reference_knot_degree = k, wk
    out.motion_knot, out.motion_knot_degree = m, wm
    out.motion_rate_knot, out.motion_rate_knot_degree = n, wn
    a_pass, motion_pass = _passes(par, st, k + wk, m + wm, n + wn)

    # Inference and trim.
    base = inverse_pressure_pa(inverse, lead)
    out.inverse_pa = base
    model = st.model
    # A pressure that does not follow the command may be that of a sensor that is off.
    measured = math.nan if lags else valve_lag.pressure_then(st, inp)
    pressure = measured if math.isfinite(measured) else valve_lag.expected_then(st, inp)
    path = 0.0
    if par.has_model > 0.5:
        predictor.engage(par, model, error, st.announced)
        surprising_move = st.move.left_s > 0.0 and st.surprising > 0.5
        model.held = 1.0 - par.jump_disturbance if surprising_move else 0.0
        if surprising_move:
            muscle_model.forget(par, model)
        muscle_model.observe(par, inverse, path_rules, model, inp.contraction_m,
                             elapsed_s, measured)
        path_memory.go(par, model.lead_path, way)
        rules, numbers = rules_output.path_pa(par, path_rules, st, out)
        path = rules + numbers
    rate_jumped = st.history_ticks < 0.5 or lead_jump != 0.0
    dynamics.accelerate(par, st, lead_rate, rate_jumped, lead_extra_rate, lead_extra)
    moving = rules_output.moving_pa(par, st)
    dynamic = moving + dynamics.ahead_of_lag_pa(
        st, base + par.lag_share * path + moving, rate_jumped)
    predicted = 0.0
    acts = par.predicted_proportional_pa_per_m > 0.0 or par.predicted_derivative_pa_s_per_m > 0.0
    predicts = acts and credit.known_ticks(par, st) >= par.answer_ticks
    now_m, now_rate = inp.contraction_m, 0.0
    if predicts or par.has_model * par.revision > 0.5:
        now_m, now_rate = predictor.motion(
            par, inverse, path_rules, model, inp.contraction_m, elapsed_s, pressure)
    if predicts:
        ahead_m, ahead_rate = predictor.predict(
            par, inverse, path_rules, ring, int(st.tick), model, inp.contraction_m,
            now_m, now_rate, inp.age_s, pressure, st.lag)
        predicted = predictor.predicted_feedback_pa(
            par, model, lead - ahead_m, lead_rate - ahead_rate, st.lag.lag_s)
        path_memory.settle(par, model, lead - ahead_m, lead_rate)
    feedback, whole_feedforward, whole_motion = rules_output.rules_pa(par, values, out)
    feedforward = st.rules_share * whole_feedforward
    motion = st.rules_share * whole_motion
    proportional = par.proportional_pa_per_m * error
    derivative = par.derivative_pa_s_per_m * change
    integral = st.integral_pa
    st.integral_shape = dynamics.load_shape(par, lead)
    trim = (integral - (1.0 - st.rules_share) * st.balance_pa) * st.integral_shape
    st.rules_pa = (whole_feedforward + whole_motion) / st.integral_shape
    wanted = (base + dynamic + feedback + feedforward + motion
              + proportional + trim + derivative
              + path + model.disturbance_pa + predicted)

    # The limits of the actuator, then of its speed.
    lowest = P_ATM_PA + par.min_pressure_gauge_pa
    highest = P_ATM_PA + par.max_pressure_gauge_pa
    inside, command = limited(
        wanted, st.command_pa, lowest, highest, par.slew_pa_per_s * period)
    at_low = wanted < lowest
    at_high = wanted > highest
    at_slew = command != inside
    at_limit = at_low or at_high or at_slew
    st.command_pa = command

    # Integral with back-calculation against the limits of pressure.
    integral_gain = par.integral_pa_per_m_s
    if _surprising(par, st, error):
        integral_gain *= par.surprise_integral
    growth = integral_growth(
        integral_gain * error, (inside - wanted) / par.anti_windup_time_s,
        held_back) * period
    # Supply, valve or driver hold the pressure back, or the command is on its way: more would
    # not help, and the way from one pressure to another is no error of the pressure at its end.
    if lags or at_slew:
        growth = 0.0
    st.integral_pa = min(
        max(integral + growth, -par.integral_limit_pa), par.integral_limit_pa)

    # Credit memory and rule modification.
    valid = 1.0
    if at_limit:
        valid = -float(learning.FROZEN_SATURATED)
    elif st.freeze_left_s > 0.0:
        valid = -float(learning.FROZEN_JUMP)
    elif abs(offset) > _START_BAND_M:
        valid = -float(learning.FROZEN_START)
    entry = ring[credit.row_of(ring, int(st.tick), 0)]
    mean = st.integral_mean_pa
    st.integral_mean_pa += period / (par.takeover_time_s + period) * (integral - mean)
    credit.push_feedback(entry, i, wi, j, wj, share)
    credit.push_feedforward(entry, k, wk, m, wm, n, wn)
    correction = par.correction_pa_per_m
    if not correction > 0.0:
        correction = dynamics.slope_pa_per_m(inverse, lead)
    credit.push_outcome(
        entry, a_pass, motion_pass, correction, integral - mean, valid, command)
    if par.index_form < 0.5:
        index = index_linear(error, change, par.index_tau_s, par.index_limit_m)
    else:
        index = index_table(error_scaled, change_scaled, par.index_limit_m)
    reason = _reason(par, ring, st, inp, error, at_limit, stays_behind)
    fb_squares = 0.0
    ff_squares = 0.0
    motion_squares = 0.0
    path_squares = 0.0
    entry.index_m = index if reason == learning.LEARNING else 0.0
    learns = reason == learning.LEARNING or reason == learning.FROZEN_DEAD_ZONE
    surprised = reason == learning.FROZEN_SURPRISE
    if par.has_model > 0.5 and (learns or surprised):
        muscle_model.find_numbers(par, inverse, model, surprised)
    if learns:
        fb_squares, ff_squares, motion_squares = _learn(par, values, initial, ring, st)
        if par.has_model > 0.5:
            path_squares = muscle_model.learn(par, path_rules, fired[3], model)
    _count(fired, share, i, wi, j, wj, k, wk, m, wm, n, wn)

    out.command_pa = command
    out.error_m = error
    out.change_of_error_m_per_s = change
    out.dynamic_feedforward_pa = dynamic
    out.feedback_rules_pa = feedback
    out.feedforward_rules_pa = feedforward
    out.motion_rules_pa = motion
    out.path_rules_pa = path
    out.disturbance_pa = model.disturbance_pa
    out.predicted_feedback_pa = predicted
    out.proportional_pa = proportional
    out.integral_pa = trim
    out.derivative_pa = derivative
    out.unlimited_command_pa = wanted
    out.saturated_low = 1.0 if at_low else 0.0
    out.saturated_high = 1.0 if at_high else 0.0
    out.slew_limited = 1.0 if at_slew else 0.0
    out.performance_index_m = index
    out.learning_reason = reason
    out.credited_tick_valid = 1.0 if reason == learning.LEARNING else 0.0
    out.feedback_rule_change_norm_pa = par.feedback_gain_pa * math.sqrt(fb_squares)
    out.feedforward_rule_change_norm_pa = math.sqrt(ff_squares)
    out.motion_rule_change_norm_pa = math.sqrt(motion_squares)
    out.path_rule_change_norm_pa = math.sqrt(path_squares)
    out.start_offset_m = offset
    out.jump_to_go_m = to_go
    st.tick += 1.0
    st.history_ticks += 1.0
    st.freeze_left_s = max(0.0, st.freeze_left_s - period)
    _guard(par, values, kept, st, inp, error, reason, out)
    return command


@compiled
def _guard(par: np.record, values: Tables, kept: Tables, st: np.record, inp: np.record,
           error: float, reason: int, out: np.record) -> None:
    """Watch over learning; a roll-back makes no step in the command."""
    off = reason == learning.FROZEN_OFF or reason == learning.FROZEN_VALVE
    if off or reason == learning.FROZEN_START or reason == learning.FROZEN_JUMP:
        guard.restart_window(st)      # such errors tell nothing about the rules
    elif par.guard_ratio > 0.0 and guard.watch(
            par, st, error, inp.reference_rate_m_per_s, values, kept):
        rules = (out.feedback_rules_pa + out.feedforward_rules_pa + out.motion_rules_pa
                 + out.path_rules_pa)
        before = rules, out.path_rules_pa, rules_output.moving_pa(par, st)
        rules_output.keep_command(
            par, st, before, rules_output.output_pa(par, values, st, out))
        st.history_ticks = 1.0        # no credit for rules that are gone
        st.rolled_back = 1.0
    out.window_rms_error_m = st.former_rms_m
    out.best_window_rms_error_m = st.best_rms_m
    out.learning_rate_factor = st.rate_factor * st.rate_ceiling
    out.times_rolled_back = st.times_rolled_back


@compiled
def _step(par: FloatArray, inverse: FloatArray, tables: Tables, ring: FloatArray,
          st: FloatArray, inp: FloatArray, out: FloatArray) -> float:
    """Run one tick on arrays; see ``sofc_step``."""
    return _tick(part(par, 0, PARAMETERS), inverse, layer(tables, 0), layer(tables, 1),
                 layer(tables, 2), layer(tables, 3), ring.view(ENTRY), part(st, 0, STATE),
                 part(inp, 0, INPUT), part(out, 0, OUTPUT))


def _entry(key: int) -> Compiled[..., float]:
    """Return the step function as one unit of compiled code, stored under ``key``."""
    @entry_point
    def sofc_step(par: FloatArray, inverse: FloatArray, tables: Tables, ring: FloatArray,
                  st: FloatArray, inp: FloatArray, out: FloatArray) -> float:
        """
        Run one tick; return the pressure command [absolute Pa].

        Parameters
        ----------
        par, inverse : float64[:]
            Array of ``settings.PARAMETERS`` and static inverse table.
        tables : tuple of arrays
            Feedback, feed-forward, motion and path rules, each with one axis more in front:
            values, initial values, firing counts, the last good values.
        ring : float64[:]
            Credit memory: ``credit.ring_rows`` of ``records.ENTRY``, one behind the other.
        st, inp, out : float64[:]
            Arrays of ``records.STATE``, ``inputs.INPUT`` and ``records.OUTPUT``.

        """
        if key < 0:       # never; makes the key part of what is stored
            return P_ATM_PA
        return _step(par, inverse, tables, ring, st, inp, out)

    return sofc_step


sofc_step = _entry(source_key(_step))

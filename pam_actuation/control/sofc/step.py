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
    faded_offset, filtered_change, first_command_pa, held_offset, integral_growth, sent)
from pam_actuation.control.sofc import (
    credit, dynamics, guard, learning, modification, muscle_model, path_memory, predictor,
    rules_output, valve_lag)
from pam_actuation.control.sofc.credit import Ring
from pam_actuation.control.sofc.membership import (
    gaussian_degree, locate, locate_signed_logarithmic, SET_COUNT)
from pam_actuation.control.sofc.records import ENTRY, OUTPUT, STATE
from pam_actuation.control.sofc.rule_table import contracting_share, layer, Tables
from pam_actuation.control.sofc.settings import PARAMETERS
from pam_actuation.control.static_inverse import inverse_pressure_pa
from pam_sim.annotations import FloatArray
from pam_sim.compiled import Compiled, compiled, entry_point, inlined, source_key
from pam_sim.records import part
from pam_sim.units import P_ATM_PA

_START_TRIM_PA = 1e4      # largest integral taken over at the start: what dry friction explains


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
    way = min(par.revision, 1.0) * par.period_s
    st.reference_m = inp.reference_m - way * inp.reference_rate_m_per_s
    st.lead_reference_m = inp.lead_reference_m - way * inp.lead_rate_m_per_s
    st.model.slow_m = x
    if par.has_model * par.revision > 0.5:
        muscle_model.begin_motion(st.model, x, inp.pressure_pa)
    guard.keep(values, kept)
    pressure = inp.pressure_pa
    st.command_pa = first_command_pa(
        pressure, P_ATM_PA + par.min_pressure_gauge_pa,
        P_ATM_PA + par.max_pressure_gauge_pa)
    if par.revision > 0.5:
        for row in range(ring.shape[0]):
            ring[row].command_pa = st.command_pa
    if math.isfinite(pressure) and x > muscle_model.LIFTED_M:
        trim = (pressure - inverse_pressure_pa(inverse, x)) / dynamics.load_shape(par, x)
        st.integral_pa = min(max(trim, -_START_TRIM_PA), _START_TRIM_PA)
        st.integral_mean_pa = st.integral_pa


@inlined
def _follow(par: np.record, ring: Ring, st: np.record, inp: np.record, elapsed_s: float,
            out: np.record) -> tuple[float, bool, bool]:
    """
    Find the error, and the lead reference without its jumps.

    Return the way of the lead reference, whether its rate of before means nothing, and whether the
    pressure falls behind the commands.
    """
    period = par.period_s
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
    if lags or held_back != 0.0 or (
            par.jump_time_s <= 0.0 and (jump != 0.0 or lead_jump != 0.0)):
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
    way = 0.0 if st.history_ticks < 0.5 else lead - st.lead_m
    st.lead_m = lead
    rate_jumped = st.history_ticks < 0.5 or lead_jump != 0.0
    dynamics.accelerate(par, st, lead_rate, rate_jumped, lead_extra_rate, lead_extra)
    out.error_m = error
    out.change_of_error_m_per_s = change
    out.start_offset_m = offset
    out.jump_to_go_m = to_go
    return way, rate_jumped, lags


@inlined
def _fuzzify(par: np.record, values: Tables, st: np.record, way_m: float, out: np.record) -> None:
    """Find the active rules and their degrees."""
    _, feedforward, motion, _ = values
    i, wi = locate(out.error_m / par.error_universe_m, -1.0, 1.0, SET_COUNT)
    j, wj = locate(
        out.change_of_error_m_per_s / par.change_universe_m_per_s, -1.0, 1.0, SET_COUNT)
    if par.membership_form > 0.5:
        wi = gaussian_degree(wi, par.membership_width)
        wj = gaussian_degree(wj, par.membership_width)
    lower = par.reference_lower_m
    upper = par.reference_upper_m
    st.contracting_share = contracting_share(st.contracting_share, way_m, par.direction_blend_m)
    out.contracting_share = st.contracting_share
    out.error_set, out.error_degree = i, wi
    out.change_set, out.change_degree = j, wj
    out.reference_knot, out.reference_knot_degree = locate(
        st.lead_m, lower, upper, feedforward.shape[1])
    out.motion_knot, out.motion_knot_degree = locate(st.lead_m, lower, upper, motion.shape[0])
    out.motion_rate_knot, out.motion_rate_knot_degree = locate_signed_logarithmic(
        st.moves_m_per_s, par.motion_rate_fine_m_per_s, par.motion_rate_upper_m_per_s,
        motion.shape[1])


@inlined
def _model(par: np.record, inverse: FloatArray, path_rules: FloatArray, ring: Ring, st: np.record,
           inp: np.record, elapsed_s: float, way_m: float, lags: bool, out: np.record) -> None:
    """Let the model of the muscle observe and predict; without one all it adds is 0."""
    model = st.model
    # A pressure that does not follow the command may be that of a sensor that is off.
    measured = math.nan if lags else valve_lag.pressure_then(st, inp)
    pressure = measured if math.isfinite(measured) else valve_lag.expected_then(st, inp)
    out.path_rules_pa = 0.0
    if par.has_model > 0.5:
        predictor.engage(par, model, out.error_m, st.announced)
        surprising_move = st.move.left_s > 0.0 and st.surprising > 0.5
        model.held = 1.0 - par.jump_disturbance if surprising_move else 0.0
        if surprising_move:
            muscle_model.forget(par, model)
        muscle_model.observe(par, inverse, path_rules, model, inp.contraction_m,
                             elapsed_s, measured)
        path_memory.go(par, model.lead_path, way_m)
        rules, numbers = rules_output.path_pa(par, path_rules, st, out)
        out.path_rules_pa = rules + numbers
    out.disturbance_pa = model.disturbance_pa
    out.predicted_feedback_pa = 0.0
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
        out.predicted_feedback_pa = predictor.predicted_feedback_pa(
            par, model, st.lead_m - ahead_m, st.moves_m_per_s - ahead_rate, st.lag.lag_s)
        path_memory.settle(par, model, st.lead_m - ahead_m, st.moves_m_per_s)


@inlined
def _command(par: np.record, values: Tables, st: np.record, rate_jumped: bool,
             out: np.record) -> float:
    """Add all parts of the command within its limits; return what passes those of pressure."""
    moving = rules_output.moving_pa(par, st)
    dynamic = moving + dynamics.ahead_of_lag_pa(
        st, out.inverse_pa + par.lag_share * out.path_rules_pa + moving, rate_jumped)
    feedback, feedforward, motion = rules_output.rules_pa(par, values, out)
    out.dynamic_feedforward_pa = dynamic
    out.feedback_rules_pa = feedback
    out.feedforward_rules_pa = st.rules_share * feedforward
    out.motion_rules_pa = st.rules_share * motion
    out.proportional_pa = par.proportional_pa_per_m * out.error_m
    out.derivative_pa = par.derivative_pa_s_per_m * out.change_of_error_m_per_s
    st.integral_shape = dynamics.load_shape(par, st.lead_m)
    out.integral_pa = (
        st.integral_pa - (1.0 - st.rules_share) * st.balance_pa) * st.integral_shape
    st.rules_pa = (feedforward + motion) / st.integral_shape
    wanted = (out.inverse_pa + dynamic + feedback + out.feedforward_rules_pa + out.motion_rules_pa
              + out.proportional_pa + out.integral_pa + out.derivative_pa
              + out.path_rules_pa + out.disturbance_pa + out.predicted_feedback_pa)
    return sent(par, st, out, wanted, par.period_s)[0]


@inlined
def _integrate(par: np.record, st: np.record, inp: np.record, inside_pa: float, lags: bool,
               out: np.record) -> None:
    """Advance the integral, with back-calculation against the limits of pressure."""
    gain = par.integral_pa_per_m_s
    if modification.surprising(par, st, out.error_m):
        gain *= par.surprise_integral
    growth = integral_growth(
        gain * out.error_m, (inside_pa - out.unlimited_command_pa) / par.anti_windup_time_s,
        inp.held_back) * par.period_s
    # Supply, valve or driver hold the pressure back, or the command is on its way: more would
    # not help, and the way from one pressure to another is no error of the pressure at its end.
    if lags or out.slew_limited > 0.5:
        growth = 0.0
    limit = par.integral_limit_pa
    st.integral_pa = min(max(st.integral_pa + growth, -limit), limit)


@inlined
def _tick(par: np.record, inverse: FloatArray, values: Tables, initial: Tables, fired: Tables,
          kept: Tables, ring: Ring, st: np.record, inp: np.record, out: np.record) -> float:
    """Run one tick; see ``sofc_step``."""
    elapsed_s = inp.elapsed_s if math.isfinite(inp.elapsed_s) else par.period_s
    if st.started < 0.5:
        _start(par, inverse, values, kept, ring, st, inp)
    way_m, rate_jumped, lags = _follow(par, ring, st, inp, elapsed_s, out)
    _fuzzify(par, values, st, way_m, out)
    out.inverse_pa = inverse_pressure_pa(inverse, st.lead_m)
    _model(par, inverse, values[3], ring, st, inp, elapsed_s, way_m, lags, out)
    inside_pa = _command(par, values, st, rate_jumped, out)
    integral_pa = st.integral_pa
    _integrate(par, st, inp, inside_pa, lags, out)
    at_limit = out.saturated_low + out.saturated_high + out.slew_limited > 0.5
    modification.remember(par, inverse, ring, st, integral_pa, at_limit, out)
    reason = modification.reason(
        par, ring, st, inp, out.error_m, at_limit, lags or inp.held_back != 0.0)
    modification.modify(par, inverse, values, initial, fired, ring, st, reason, out)
    st.tick += 1.0
    st.history_ticks += 1.0
    st.freeze_left_s = max(0.0, st.freeze_left_s - par.period_s)
    _guard(par, values, kept, st, inp, out.error_m, reason, out)
    return float(out.command_pa)


@inlined
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


@inlined
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

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
What a tick learns: the credit memory, whether rules change, and the change of all tables.

The rules that were active one credit delay ago change by the performance index of now
(``credit``, ``learning``), the model of the muscle by what it did not explain.
"""

import math

import numpy as np
from pam_actuation.control.sofc import credit, dynamics, learning, muscle_model
from pam_actuation.control.sofc.credit import Ring
from pam_actuation.control.sofc.performance_index import index_linear, index_table
from pam_actuation.control.sofc.rule_table import Tables
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled

_START_BAND_M = 5e-5      # start-up is over when the bumpless offset is below this


@compiled
def surprising(par: np.record, st: np.record, error: float) -> bool:
    """Tell whether an error is out of proportion to those of the last window."""
    return abs(error) > par.surprise_ratio * st.former_rms_m > 0.0


@compiled
def reason(par: np.record, ring: Ring, st: np.record, inp: np.record, error: float,
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
    if surprising(par, st, error):
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
def _count(fired: Tables, out: np.record) -> None:
    """Add the firing strengths of this tick to the counts of the rules."""
    feedback, feedforward, motion, _ = fired
    i, wi, j, wj = int(out.error_set), out.error_degree, int(out.change_set), out.change_degree
    k, wk = int(out.reference_knot), out.reference_knot_degree
    m, wm = int(out.motion_knot), out.motion_knot_degree
    n, wn = int(out.motion_rate_knot), out.motion_rate_knot_degree
    for d in range(2):
        direction = out.contracting_share if d == 0 else 1.0 - out.contracting_share
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
def remember(par: np.record, inverse: FloatArray, ring: Ring, st: np.record, integral_pa: float,
             at_limit: bool, out: np.record) -> None:
    """Write the tick into the credit memory."""
    valid = 1.0
    if at_limit:
        valid = -float(learning.FROZEN_SATURATED)
    elif st.freeze_left_s > 0.0:
        valid = -float(learning.FROZEN_JUMP)
    elif abs(out.start_offset_m) > _START_BAND_M:
        valid = -float(learning.FROZEN_START)
    a_pass, motion_pass = _passes(
        par, st, out.reference_knot + out.reference_knot_degree,
        out.motion_knot + out.motion_knot_degree,
        out.motion_rate_knot + out.motion_rate_knot_degree)
    mean = st.integral_mean_pa
    st.integral_mean_pa += par.period_s / (par.takeover_time_s + par.period_s) * (
        integral_pa - mean)
    correction = par.correction_pa_per_m
    if not correction > 0.0:
        correction = dynamics.slope_pa_per_m(inverse, st.lead_m)
    entry = ring[credit.row_of(ring, int(st.tick), 0)]
    credit.push_active(entry, out)
    credit.push_outcome(
        entry, a_pass, motion_pass, correction, integral_pa - mean, valid, out.command_pa)
    if par.index_form < 0.5:
        out.performance_index_m = index_linear(
            out.error_m, out.change_of_error_m_per_s, par.index_tau_s, par.index_limit_m)
    else:
        out.performance_index_m = index_table(
            out.error_m / par.error_universe_m,
            out.change_of_error_m_per_s / par.change_universe_m_per_s, par.index_limit_m)


@compiled
def modify(par: np.record, inverse: FloatArray, values: Tables, initial: Tables, fired: Tables,
           ring: Ring, st: np.record, reason: int, out: np.record) -> None:
    """Change the rules and the numbers of the model, unless there is a reason not to."""
    fb_squares = 0.0
    ff_squares = 0.0
    motion_squares = 0.0
    path_squares = 0.0
    ring[credit.row_of(ring, int(st.tick), 0)].index_m = (
        out.performance_index_m if reason == learning.LEARNING else 0.0)
    learns = reason == learning.LEARNING or reason == learning.FROZEN_DEAD_ZONE
    surprised = reason == learning.FROZEN_SURPRISE
    if par.has_model > 0.5 and (learns or surprised):
        muscle_model.find_numbers(par, inverse, st.model, surprised)
    if learns:
        fb_squares, ff_squares, motion_squares = _learn(par, values, initial, ring, st)
        if par.has_model > 0.5:
            path_squares = muscle_model.learn(par, values[3], fired[3], st.model)
    _count(fired, out)
    out.learning_reason = reason
    out.credited_tick_valid = 1.0 if reason == learning.LEARNING else 0.0
    out.feedback_rule_change_norm_pa = par.feedback_gain_pa * math.sqrt(fb_squares)
    out.feedforward_rule_change_norm_pa = math.sqrt(ff_squares)
    out.motion_rule_change_norm_pa = math.sqrt(motion_squares)
    out.path_rule_change_norm_pa = math.sqrt(path_squares)

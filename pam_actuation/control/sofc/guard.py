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
How fast to learn: slower once the error no longer falls, and back when it grows.

The squared error is collected over windows of complete movements to and fro. Windows of about the
same mean speed are compared with the best one, which keeps a copy of the rules.

* A window that is no better anneals the learning rate, so that the noise of single passes averages
  out. One beyond ``guard_ratio`` times the best restores the full rate, because then the plant has
  changed.
* Two such windows in a row, the second clearly worse than the first, mean that learning itself
  spoils the rules. After a change of the plant, the error would fall from window to window. The
  copy is restored and the full rate is halved until there is a new best. So do five of them,
  unless they fall.
* The restored rules have to do as well as before. If five windows after a roll-back are bad too,
  the plant has changed: they are the new normal. Meanwhile the rate is not halved again.

Revisions 0 and 1 forgot the best error with each roll-back, and took five windows without growth
for normal at once. So an error that grew slowly became normal step by step.
"""

import math

import numpy as np
from pam_actuation.control.sofc.rule_table import Tables
from pam_sim.compiled import compiled

_SAME_SPEED = 0.25        # windows whose mean speeds differ by more are not compared
_NEW_NORMAL = 5
_FALLING = 0.97           # error of a window over the best one that still counts as falling
_GROWING = 1.1            # error of a bad window over the former one that counts as growing
_STILL_M_PER_S = 1e-4
_LEAST_FACTOR = 1.0 / 64.0


@compiled
def keep(values: Tables, kept: Tables) -> None:
    """Copy the rules of all tables."""
    feedback, feedforward, motion, path = values
    kept_feedback, kept_feedforward, kept_motion, kept_path = kept
    for d in range(2):
        for i in range(feedback.shape[1]):
            for j in range(feedback.shape[2]):
                kept_feedback[d, i, j] = feedback[d, i, j]
        for k in range(feedforward.shape[1]):
            kept_feedforward[d, k] = feedforward[d, k]
    for m in range(motion.shape[0]):
        for n in range(motion.shape[1]):
            kept_motion[m, n] = motion[m, n]
    for q in range(path.shape[0]):
        for k in range(path.shape[1]):
            kept_path[q, k] = path[q, k]


@compiled
def restart_window(st: np.record) -> None:
    """Forget what was collected."""
    st.window.ticks = 0.0
    st.window.squares_m2 = 0.0
    st.window.speeds_m_per_s = 0.0
    st.window.turns = 0.0


@compiled
def _turned(st: np.record, rate_m_per_s: float) -> bool:
    """Tell whether the reference turned round in this tick."""
    if abs(rate_m_per_s) <= _STILL_M_PER_S:
        return False
    moving = math.copysign(1.0, rate_m_per_s)
    turned = moving * st.direction < 0.0
    st.direction = moving
    return turned


@compiled
def _new_best(st: np.record, rms: float, values: Tables, kept: Tables) -> None:
    """Take a window as the one to compare with."""
    st.best_rms_m = rms
    st.bad_windows = 0.0
    st.unproven = 0.0
    keep(values, kept)


@compiled
def _judge(par: np.record, st: np.record, values: Tables, kept: Tables) -> bool:
    """Compare a full window with the best one; return whether to roll back."""
    rms = math.sqrt(st.window.squares_m2 / st.window.ticks)
    speed = st.window.speeds_m_per_s / st.window.ticks
    former = st.former_rms_m
    st.former_rms_m = rms
    best = st.best_rms_m
    if best <= 0.0 or abs(speed - st.best_speed_m_per_s) > _SAME_SPEED * st.best_speed_m_per_s:
        st.best_speed_m_per_s = speed
        st.rate_factor = 1.0
        _new_best(st, rms, values, kept)
        return False
    if rms <= par.guard_ratio * best + par.dead_zone_m:
        st.bad_windows = 0.0
        st.unproven = 0.0
        if rms < best:
            st.rate_ceiling = min(1.0, 2.0 * st.rate_ceiling)
            _new_best(st, rms, values, kept)
        if rms > _FALLING * best:
            st.rate_factor = max(
                par.anneal_floor, par.anneal * st.rate_factor)
        return False
    st.rate_factor = 1.0
    bad_windows: float = st.bad_windows + 1.0
    st.bad_windows = bad_windows
    if bad_windows <= 1.0:
        st.first_bad_rms_m = rms
        return False
    if rms > _GROWING * former:
        return True
    if bad_windows >= _NEW_NORMAL:
        if rms > _GROWING * st.first_bad_rms_m:
            return True
        if par.revision > 1.5 and st.unproven < 0.5:
            falls = _GROWING * rms < st.first_bad_rms_m
            st.bad_windows = 1.0
            st.first_bad_rms_m = rms
            return not falls
        _new_best(st, rms, values, kept)
    return False


@compiled
def watch(par: np.record, st: np.record, error_m: float, rate_m_per_s: float, values: Tables,
          kept: Tables) -> bool:
    """
    Add one tick of learning; roll back where it made things worse.

    Returns
    -------
    bool
        Whether the rules in ``values`` were exchanged for ``kept``.

    """
    turned = _turned(st, rate_m_per_s)
    st.window.ticks += 1.0
    st.window.squares_m2 += error_m * error_m
    st.window.speeds_m_per_s += abs(rate_m_per_s)
    if not turned:
        return False
    st.window.turns += 1.0
    if (st.window.turns % 2.0 != 0.0
            or st.window.ticks * par.period_s < par.guard_window_s):
        return False
    worse = _judge(par, st, values, kept)
    restart_window(st)
    if worse:
        keep(kept, values)
        if st.unproven < 0.5:
            st.rate_ceiling = max(_LEAST_FACTOR, 0.5 * st.rate_ceiling)
        if par.revision < 1.5:
            st.best_rms_m = 0.0          # the restored rules are judged anew
        st.unproven = 1.0
        st.bad_windows = 0.0
        st.times_rolled_back += 1.0
    return worse

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

The squared error is collected over windows of whole movements to and fro; windows
of about the same mean speed are compared with the best one, which keeps a copy of
the rules.

* A window that is no better anneals the learning rate, so that the noise of single
  passes averages out; one beyond ``guard_ratio`` times the best brings the full rate
  back, for then the plant has changed.
* Two such windows in a row, the second clearly worse than the first, mean that
  learning itself spoils the rules (after a change of the plant the error falls from
  window to window): the copy comes back and the full rate is halved until there is a
  new best. So do five of them that grow slowly; five without growth are the new normal.
"""

import math

from pam_actuation.control.sofc import layout as at
from pam_sim.compiled import compiled

_SAME_SPEED = 0.25        # windows whose mean speeds differ by more are not compared
_NEW_NORMAL = 5
_FALLING = 0.97           # error of a window over the best one that still counts as falling
_GROWING = 1.1            # error of a bad window over the former one that counts as growing
_STILL_M_PER_S = 1e-4
_LEAST_FACTOR = 1.0 / 64.0


@compiled
def keep(values, kept):
    """Copy the rules of all tables."""
    for d in range(2):
        for i in range(values[0].shape[1]):
            for j in range(values[0].shape[2]):
                kept[0][d, i, j] = values[0][d, i, j]
        for k in range(values[1].shape[1]):
            kept[1][d, k] = values[1][d, k]
    for m in range(values[2].shape[0]):
        for n in range(values[2].shape[1]):
            kept[2][m, n] = values[2][m, n]


@compiled
def restart_window(st):
    """Forget what was collected."""
    st[at.S_WINDOW_TICKS] = 0.0
    st[at.S_WINDOW_SQUARES] = 0.0
    st[at.S_WINDOW_TRAVEL] = 0.0
    st[at.S_TURNS] = 0.0


@compiled
def _turned(st, rate_m_per_s):
    """Tell whether the reference turned round in this tick."""
    if abs(rate_m_per_s) <= _STILL_M_PER_S:
        return False
    moving = math.copysign(1.0, rate_m_per_s)
    turned = moving * st[at.S_MOVING] < 0.0
    st[at.S_MOVING] = moving
    return turned


@compiled
def _new_best(st, rms, values, kept):
    """Take a window as the one to compare with."""
    st[at.S_BEST] = rms
    st[at.S_BAD_WINDOWS] = 0.0
    keep(values, kept)


@compiled
def _judge(par, st, values, kept):
    """Compare a full window with the best one; return whether to roll back."""
    rms = math.sqrt(st[at.S_WINDOW_SQUARES] / st[at.S_WINDOW_TICKS])
    speed = st[at.S_WINDOW_TRAVEL] / st[at.S_WINDOW_TICKS]
    former = st[at.S_FORMER]
    st[at.S_FORMER] = rms
    best = st[at.S_BEST]
    if best <= 0.0 or abs(speed - st[at.S_BEST_SPEED]) > _SAME_SPEED * st[at.S_BEST_SPEED]:
        st[at.S_BEST_SPEED] = speed
        st[at.S_RATE_FACTOR] = 1.0
        _new_best(st, rms, values, kept)
        return False
    if rms <= par[at.P_GUARD_RATIO] * best + par[at.P_DEAD_ZONE]:
        st[at.S_BAD_WINDOWS] = 0.0
        if rms < best:
            st[at.S_RATE_CEILING] = min(1.0, 2.0 * st[at.S_RATE_CEILING])
            _new_best(st, rms, values, kept)
        if rms > _FALLING * best:
            st[at.S_RATE_FACTOR] = max(
                par[at.P_ANNEAL_FLOOR], par[at.P_ANNEAL] * st[at.S_RATE_FACTOR])
        return False
    st[at.S_RATE_FACTOR] = 1.0
    st[at.S_BAD_WINDOWS] += 1.0
    if st[at.S_BAD_WINDOWS] <= 1.0:
        st[at.S_FIRST_BAD] = rms
        return False
    if rms > _GROWING * former:
        return True
    if st[at.S_BAD_WINDOWS] >= _NEW_NORMAL:
        if rms > _GROWING * st[at.S_FIRST_BAD]:
            return True
        _new_best(st, rms, values, kept)
    return False


@compiled
def watch(par, st, error_m, rate_m_per_s, values, kept):
    """
    Add one tick of learning; roll back where it made things worse.

    Returns
    -------
    bool
        Whether the rules in ``values`` were exchanged for ``kept``.

    """
    turned = _turned(st, rate_m_per_s)
    st[at.S_WINDOW_TICKS] += 1.0
    st[at.S_WINDOW_SQUARES] += error_m * error_m
    st[at.S_WINDOW_TRAVEL] += abs(rate_m_per_s)
    if not turned:
        return False
    st[at.S_TURNS] += 1.0
    if (st[at.S_TURNS] % 2.0 != 0.0
            or st[at.S_WINDOW_TICKS] * par[at.P_PERIOD] < par[at.P_GUARD_WINDOW]):
        return False
    worse = _judge(par, st, values, kept)
    restart_window(st)
    if worse:
        keep(kept, values)
        st[at.S_RATE_CEILING] = max(_LEAST_FACTOR, 0.5 * st[at.S_RATE_CEILING])
        st[at.S_BEST] = 0.0          # the restored rules are judged anew
        st[at.S_BAD_WINDOWS] = 0.0
        st[at.S_ROLLED_BACK] += 1.0
    return worse

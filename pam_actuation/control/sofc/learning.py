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
Rule modification and the reasons to leave the rules alone.

The rules that were active one credit delay ago change in proportion to their firing strength and
to the performance index (Procyk and Mamdani 1979). The local memory is that of fuzzy model
reference learning control (Layne and Passino). With a partition of unity this is the gradient law
``theta' = gamma s xi``. It has the usual protections: bounds, a limit per tick, a dead zone, and a
leak of visited rules towards the initial rules.

Feedback rules learn by time. Feed-forward and motion rules learn by passes: a tick counts by how
far the reference moved over the knots. A rule then corrects the same share of the error in fast
and slow passes.
"""

from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled

LEARNING = 0
FROZEN_OFF = 1            # learning switched off
FROZEN_START = 2          # start-up: bumpless offset or less history than the credit delay
FROZEN_JUMP = 3           # the reference jumped, or the pressure lagged, a moment ago
FROZEN_SATURATED = 4      # the command is, or was when the rules were active, at a limit
FROZEN_DEAD_ZONE = 5      # the error is within noise
FROZEN_SLACK = 6          # the muscle is slack
FROZEN_VALVE = 7          # the pressure does not follow: supply or valve
FROZEN_ROLLED_BACK = 8    # learning had made it worse: the rules are those from before
FROZEN_SURPRISE = 9       # the error is out of proportion: a disturbance, left to the integral
REASONS = (
    'learning', 'learning is off', 'starting', 'settling after a jump', 'command at a limit',
    'error within the dead zone', 'muscle slack', 'pressure does not follow the command',
    'rolled back, learning had made it worse', 'error out of proportion, a disturbance')


@compiled
def _bounded(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


@compiled
def modify_feedback(table: FloatArray, initial: FloatArray, share: float, i: int, wi: float,
                    j: int, wj: float, gain: float, leak: float, step_limit: float) -> float:
    """
    Change the feedback rules that were active; return the squared norm of the change.

    Each rule moves by ``gain x firing strength``, at most ``step_limit``, leaks by
    ``leak x strength`` of its distance to the initial rule, and stays in [-1, 1].
    """
    squares = 0.0
    for d in range(2):
        direction = share if d == 0 else 1.0 - share
        for a in range(2):
            error_degree = wi if a == 1 else 1.0 - wi
            for b in range(2):
                strength = direction * error_degree * (wj if b == 1 else 1.0 - wj)
                if strength > 0.0:
                    old = table[d, i + a, j + b]
                    new = (old + _bounded(gain * strength, step_limit)
                           - leak * strength * (old - initial[d, i + a, j + b]))
                    new = _bounded(new, 1.0)
                    table[d, i + a, j + b] = new
                    squares += (new - old) * (new - old)
    return squares


@compiled
def modify_feedforward(table: FloatArray, initial: FloatArray, share: float, k: int, wk: float,
                       gain_pa: float, leak: float, step_limit_pa: float,
                       limit_pa: float) -> float:
    """
    Change the feed-forward rules that were active; return the squared norm [Pa^2].

    As ``modify_feedback``, with singletons in Pa within ``+-limit_pa``.
    """
    squares = 0.0
    for d in range(2):
        direction = share if d == 0 else 1.0 - share
        for a in range(2):
            strength = direction * (wk if a == 1 else 1.0 - wk)
            if strength > 0.0:
                old = table[d, k + a]
                new = (old + _bounded(gain_pa * strength, step_limit_pa)
                       - leak * strength * (old - initial[d, k + a]))
                new = _bounded(new, limit_pa)
                table[d, k + a] = new
                squares += (new - old) * (new - old)
    return squares


@compiled
def modify_motion(table: FloatArray, initial: FloatArray, m: int, wm: float, n: int, wn: float,
                  gain_pa: float, leak: float, step_limit_pa: float, limit_pa: float) -> float:
    """
    Change the motion rules that were active; return the squared norm [Pa^2].

    As ``modify_feedforward``, over position knots m and rate knots n.
    """
    squares = 0.0
    for a in range(2):
        position = wm if a == 1 else 1.0 - wm
        for b in range(2):
            strength = position * (wn if b == 1 else 1.0 - wn)
            if strength > 0.0:
                old = table[m + a, n + b]
                new = (old + _bounded(gain_pa * strength, step_limit_pa)
                       - leak * strength * (old - initial[m + a, n + b]))
                new = _bounded(new, limit_pa)
                table[m + a, n + b] = new
                squares += (new - old) * (new - old)
    return squares

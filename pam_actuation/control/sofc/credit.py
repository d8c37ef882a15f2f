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
Delayed credit: which rules were active when the present error was caused.

A pneumatic muscle answers a command after dead time, valve lag and filter
delay. A ring buffer keeps the firing strengths of the last ticks; the
performance index of now belongs to the rules of ``delay`` ticks ago, or, when
the delay is not known well, to those of ``delay - spread .. delay + spread``
ticks ago with triangular weights that sum to 1. Each set of active rules is
judged once, when all of the indices that belong to it are known: ``delay +
spread`` ticks later. A spread also keeps fast swings of the error out of the
rules, without a shift in phase.
"""

from pam_sim.compiled import compiled

ENTRY_ERROR_SET = 0       # lower active set of the error
ENTRY_ERROR_DEGREE = 1    # degree of the set above it
ENTRY_CHANGE_SET = 2
ENTRY_CHANGE_DEGREE = 3
ENTRY_SHARE = 4           # degree of 'contracting'
ENTRY_KNOT = 5            # lower active knot of the reference
ENTRY_KNOT_DEGREE = 6
ENTRY_MOTION_KNOT = 7     # the same of the motion rules: position, then rate
ENTRY_MOTION_KNOT_DEGREE = 8
ENTRY_RATE_KNOT = 9
ENTRY_RATE_KNOT_DEGREE = 10
ENTRY_PASS = 11           # part of a pass this tick was, for the feed-forward rules
ENTRY_MOTION_PASS = 12    # the same for the motion rules
ENTRY_CORRECTION = 13     # pressure that mends an index of 1 m there [Pa/m]
ENTRY_VALID = 14          # 1 = neither saturated nor disturbed when it was active
ENTRY_OUTPUT = 15         # command [Pa] of that tick
ENTRY_INDEX = 16          # performance index [m] of that tick, 0 where nothing was learned
ENTRY_MOVING = 17         # what the integral [Pa] added then beyond its mean
ENTRY_SIZE = 18


def ring_rows(delay, spread, answer=0):
    """
    Return the number of rows a ring buffer needs.

    For a credit delay and its spread, and for the time a command takes to the valve's
    answer, in ticks.
    """
    return max(delay + spread, answer) + 1


@compiled
def push_feedback(ring, row, i, wi, j, wj, share):
    """Write the firing strengths of the feedback rules over the oldest entry, ``row``."""
    ring[row, ENTRY_ERROR_SET] = i
    ring[row, ENTRY_ERROR_DEGREE] = wi
    ring[row, ENTRY_CHANGE_SET] = j
    ring[row, ENTRY_CHANGE_DEGREE] = wj
    ring[row, ENTRY_SHARE] = share


@compiled
def push_feedforward(ring, row, k, wk, m, wm, n, wn):
    """Write the firing strengths of the feed-forward and the motion rules."""
    ring[row, ENTRY_KNOT] = k
    ring[row, ENTRY_KNOT_DEGREE] = wk
    ring[row, ENTRY_MOTION_KNOT] = m
    ring[row, ENTRY_MOTION_KNOT_DEGREE] = wm
    ring[row, ENTRY_RATE_KNOT] = n
    ring[row, ENTRY_RATE_KNOT_DEGREE] = wn


@compiled
def push_outcome(
        ring, row, a_pass, motion_pass, correction_pa_per_m, moving_pa, valid, output_pa):
    """Write how far the reference passed the rules, what an error is worth, and the command."""
    ring[row, ENTRY_PASS] = a_pass
    ring[row, ENTRY_MOTION_PASS] = motion_pass
    ring[row, ENTRY_CORRECTION] = correction_pa_per_m
    ring[row, ENTRY_MOVING] = moving_pa
    ring[row, ENTRY_VALID] = valid
    ring[row, ENTRY_OUTPUT] = output_pa


@compiled
def row_of(ring, tick, ago):
    """Return the row of the entry ``ago`` ticks before ``tick``."""
    return (tick - ago) % ring.shape[0]


@compiled
def kernel_weight(offset, spread):
    """Return the triangular weight of the entry ``offset`` ticks off the credit delay."""
    side = spread + 1
    return (side - abs(offset)) / (side * side)


@compiled
def credited_index(ring, tick, spread):
    """Return the index [m] that belongs to the rules of ``delay + spread`` ticks ago."""
    row = row_of(ring, tick, 2 * spread)
    total = 0.0
    for offset in range(-spread, spread + 1):
        total += kernel_weight(offset, spread) * ring[row, ENTRY_INDEX]
        row += 1
        if row == ring.shape[0]:
            row = 0
    return total

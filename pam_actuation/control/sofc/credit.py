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

A pneumatic muscle answers a command after dead time, valve lag and filter delay. A ring buffer
keeps the firing strengths of the last ticks. The present performance index belongs to the rules of
``delay`` ticks ago. If the delay is not known well, it belongs to those of ``delay - spread ..
delay + spread`` ticks ago, with triangular weights that sum to 1. Each set of active rules is
judged once, when all of the indices that belong to it are known: ``delay + spread`` ticks later. A
spread also keeps fast swings of the error out of the rules, without a shift in phase.
"""

from typing import TypeAlias

import numpy as np
from pam_sim.compiled import compiled

# Rows of ``records.ENTRY``.
Ring: TypeAlias = 'np.ndarray[tuple[int], np.dtype[np.record]]'


def ring_rows(delay: int, spread: int, answer: int = 0) -> int:
    """
    Return the number of rows a ring buffer needs.

    For a credit delay and its spread, and for the time a command takes to the valve's
    answer, in ticks.
    """
    return max(delay + spread, answer) + 1


@compiled
def push_feedback(entry: np.record, i: int, wi: float, j: int, wj: float, share: float) -> None:
    """Write the firing strengths of the feedback rules into an entry."""
    entry.error_set = i
    entry.error_degree = wi
    entry.change_set = j
    entry.change_degree = wj
    entry.contracting_share = share


@compiled
def push_feedforward(entry: np.record, k: int, wk: float, m: int, wm: float, n: int,
                     wn: float) -> None:
    """Write the firing strengths of the feed-forward and the motion rules."""
    entry.reference_knot = k
    entry.reference_knot_degree = wk
    entry.motion_knot = m
    entry.motion_knot_degree = wm
    entry.motion_rate_knot = n
    entry.motion_rate_knot_degree = wn


@compiled
def push_active(entry: np.record, out: np.record) -> None:
    """Write the firing strengths of all rules, from an ``OUTPUT``."""
    push_feedback(entry, int(out.error_set), out.error_degree, int(out.change_set),
                  out.change_degree, out.contracting_share)
    push_feedforward(
        entry, int(out.reference_knot), out.reference_knot_degree, int(out.motion_knot),
        out.motion_knot_degree, int(out.motion_rate_knot), out.motion_rate_knot_degree)


@compiled
def push_outcome(
        entry: np.record, feedforward_pass: float, motion_pass: float,
        correction_pa_per_m: float, integral_deviation_pa: float, valid: float,
        command_pa: float) -> None:
    """Write how far the reference passed the rules, what an error is worth, and the command."""
    entry.feedforward_pass = feedforward_pass
    entry.motion_pass = motion_pass
    entry.correction_pa_per_m = correction_pa_per_m
    entry.integral_deviation_pa = integral_deviation_pa
    entry.valid = valid
    entry.command_pa = command_pa


@compiled
def row_of(ring: Ring, tick: int, ago: int) -> int:
    """Return the row of the entry ``ago`` ticks before ``tick``."""
    return (tick - ago) % ring.shape[0]


@compiled
def known_ticks(par: np.record, st: np.record) -> float:
    """
    Return for how many ticks commands and previews are known; ``st`` is a ``STATE``.

    Since the start: an exchange of rules leaves them in the ring. Revision 0 forgot them.
    """
    return float(st.tick if par.revision > 0.5 else st.history_ticks)


@compiled
def kernel_weight(offset: int, spread: int) -> float:
    """Return the triangular weight of the entry ``offset`` ticks off the credit delay."""
    side = spread + 1
    return (side - abs(offset)) / (side * side)


@compiled
def credited_index(ring: Ring, tick: int, spread: int) -> float:
    """Return the index [m] that belongs to the rules of ``delay + spread`` ticks ago."""
    row = row_of(ring, tick, 2 * spread)
    total = 0.0
    for offset in range(-spread, spread + 1):
        total += kernel_weight(offset, spread) * ring[row].index_m
        row += 1
        if row == ring.shape[0]:
            row = 0
    return total

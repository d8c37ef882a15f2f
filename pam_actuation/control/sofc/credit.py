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
ticks ago with triangular weights that sum to 1.
"""

from pam_sim.compiled import compiled

ENTRY_ERROR_SET = 0       # lower active set of the error
ENTRY_ERROR_DEGREE = 1    # degree of the set above it
ENTRY_CHANGE_SET = 2
ENTRY_CHANGE_DEGREE = 3
ENTRY_SHARE = 4           # degree of 'contracting'
ENTRY_KNOT = 5            # lower active knot of the reference
ENTRY_KNOT_DEGREE = 6
ENTRY_VALID = 7           # 1 = neither saturated nor disturbed when it was active
ENTRY_OUTPUT = 8          # command [Pa] of that tick
ENTRY_SIZE = 9


def ring_rows(delay, spread):
    """Return the number of rows a ring buffer needs for a credit delay and spread [ticks]."""
    return delay + spread + 1


@compiled
def push(ring, tick, i, wi, j, wj, share, k, wk, valid, output_pa):
    """Write the firing strengths of a tick over the oldest entry."""
    row = tick % ring.shape[0]
    ring[row, ENTRY_ERROR_SET] = i
    ring[row, ENTRY_ERROR_DEGREE] = wi
    ring[row, ENTRY_CHANGE_SET] = j
    ring[row, ENTRY_CHANGE_DEGREE] = wj
    ring[row, ENTRY_SHARE] = share
    ring[row, ENTRY_KNOT] = k
    ring[row, ENTRY_KNOT_DEGREE] = wk
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

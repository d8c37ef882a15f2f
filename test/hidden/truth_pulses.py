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

"""On/off valves that switch: every pulse opens and shuts, where the other rig has its mean."""

import numpy as np
import truth_numbers
import truth_rig as rig
import truth_run as runs
import truth_sensors as sensors

PERIOD_S = 0.010
PERIOD_STEPS = 100


@rig.jit
def lift(t, on_s, off_s, n):
    """Return the lift, 0 to 1, of a valve whose coil has current from ``on_s`` to ``off_s``."""
    if off_s <= on_s:
        return 0.0
    # Without a ramp of its own an edge takes one step, so that the mean of a step is exact.
    rise = max(n[rig.OPEN_RAMP], rig.STEP_S)
    fall = max(n[rig.CLOSE_RAMP], rig.STEP_S)
    ahead = 0.5 * rig.STEP_S if n[rig.OPEN_RAMP] <= 0.0 else 0.0
    behind = 0.5 * rig.STEP_S if n[rig.CLOSE_RAMP] <= 0.0 else 0.0
    begun = on_s + n[rig.OPEN_DEAD] - ahead
    up = min(max((min(t, off_s + ahead) - begun) / rise, 0.0), 1.0)
    shut = off_s + n[rig.CLOSE_DEAD] - behind
    return max(up - max((t - shut) / fall, 0.0), 0.0)


@rig.jit
def energise(edges, duty, now):
    """Enter a pulse that begins ``now``; the one before goes on falling, or on without a break."""
    unbroken = edges[1] >= now - 1e-9 and edges[1] > edges[0]
    since = edges[0]
    edges[2], edges[3] = edges[0], edges[1]
    edges[0], edges[1] = now, now
    if duty > 0.0:
        edges[0] = since if unbroken else now
        edges[1] = now + min(duty, 1.0) * PERIOD_S


@rig.jit
def simulate(n, times, first, second, start_gauge, end_s, closed):
    """
    Return (rows, duties) as ``truth_rig.simulate`` does, of valves that switch.

    A duty gives one pulse, from the moment it arrives on; what is held longer is repeated.
    """
    steps = int(round(end_s / rig.STEP_S))
    rows = np.empty((steps // rig.EVERY + 1, 6))
    duties = np.empty((int(end_s / PERIOD_S) + 2, 3))
    y, middle = np.zeros(rig.SIZE), np.zeros(rig.SIZE)
    d = np.zeros(rig.SIZE)
    p = rig.ATM + start_gauge
    y[rig.Y_X] = rig._rest(start_gauge, n)
    y[rig.Y_Q1:rig.Y_Q4 + 1] = y[rig.Y_X]
    anchors = np.full(6, y[rig.Y_X])
    room = rig.volume(y[rig.Y_X]) + n[rig.V_DEAD]
    y[rig.Y_AIR], y[rig.Y_ENERGY] = p * room / rig.RT, p * room / (rig.GAMMA - 1.0)
    y[rig.Y_SECOND] = p * n[rig.SECOND_VOLUME] / rig.RT
    y[rig.Y_STORE] = n[rig.SUPPLY] * n[rig.RESERVOIR] / rig.RT
    running, pointer, sent, ready, wanted = 0.0, -1, 0, 0, p
    fill, vent = np.full(4, -1.0), np.full(4, -1.0)
    held_a, held_b, due = 0.0, 0.0, -1.0
    for k in range(steps + 1):
        t = k * rig.STEP_S
        arrived = False
        if closed:
            while pointer + 1 < times.size and times[pointer + 1] <= t + 1e-9:
                pointer += 1
                wanted = first[pointer]
            if k % PERIOD_STEPS == 0:
                a, b = 0.0, 0.0
                if wanted == wanted:
                    a, b = rig.driver(
                        rig.pressure_of(y, rig.HSV, n), wanted, y[rig.Y_X], n)
                duties[sent, 0], duties[sent, 1], duties[sent, 2] = t, a, b
                sent += 1
            while ready < sent and duties[ready, 0] + n[rig.DELAY] <= t + 1e-9:
                held_a, held_b = duties[ready, 1], duties[ready, 2]
                ready += 1
                arrived = True
        else:
            while pointer + 1 < times.size and times[pointer + 1] + n[rig.DELAY] <= t + 1e-9:
                pointer += 1
                held_a, held_b = first[pointer], second[pointer]
                arrived = True
        if arrived or (due >= 0.0 and t >= due - 1e-9):
            energise(fill, held_a, t)
            energise(vent, held_b, t)
            due = t + PERIOD_S
        # The middle of the step: an edge within it counts with its share.
        at = t + 0.5 * rig.STEP_S
        in_a = max(lift(at, fill[0], fill[1], n), lift(at, fill[2], fill[3], n))
        in_b = max(lift(at, vent[0], vent[1], n), lift(at, vent[2], vent[3], n))
        pull, push, p = rig.rates(y, in_a, in_b, t, anchors, rig.HSV, n, d)
        if k % rig.EVERY == 0:
            row = rows[k // rig.EVERY]
            row[rig.O_P], row[rig.O_X], row[rig.O_V] = p, y[rig.Y_X], y[rig.Y_V]
            row[rig.O_F] = n[rig.MASS] * (d[rig.Y_V] + rig.GRAVITY) + push
            row[rig.O_SUPPLY] = n[rig.SUPPLY]
            if n[rig.RESERVOIR] > 0.0:
                row[rig.O_SUPPLY] = y[rig.Y_STORE] * rig.RT / n[rig.RESERVOIR]
            row[rig.O_MASS] = y[rig.Y_AIR]
        running = rig.advance(
            y, middle, d, in_a, in_b, t, anchors, running, rig.HSV, n, rig.STEP_S)
    return rows, duties[:sent]


def run_rig(numbers, times, wanted, held):
    """Return the Truth of wanted pressures on a rig with switching valves."""
    instants = np.concatenate([[-runs.SETTLE_S], times]) + runs.SETTLE_S
    aim = np.concatenate([held[:1], wanted])
    rows, duties = simulate(
        truth_numbers.numbers(**numbers), instants, aim, np.zeros(aim.size), held[0] - rig.ATM,
        instants[-1] + 0.005, True)
    late = duties[:, 0] >= runs.SETTLE_S - 1e-9
    return runs.Truth(rows[int(round(runs.SETTLE_S / sensors.ROW_S)):],
                      duties[late, 0] - runs.SETTLE_S, duties[late, 1:], times, held)


def replay(numbers, valve, truth, start_pa=None):
    """Return the rows of a rig with these numbers on the pulses sent in another run."""
    instants = np.concatenate([[0.0], truth.sent_s + runs.SETTLE_S])
    first, second = (np.concatenate([[0.0], truth.sent[:, j]]) for j in range(2))
    start = truth.rows[0, rig.O_P] if start_pa is None else start_pa
    rows, _ = simulate(
        truth_numbers.numbers(**numbers), instants, first, second, start - rig.ATM,
        runs.SETTLE_S + (truth.rows.shape[0] - 1) * sensors.ROW_S, False)
    return rows[int(round(runs.SETTLE_S / sensors.ROW_S)):]

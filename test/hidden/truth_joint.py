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
Two hidden muscles against each other over a pulley each, turning a limb.

The air, the memory and the pull of each muscle are those of ``truth_rig``. A plain controller
turns the joint after a wanted angle. Each tendon has a load cell.
"""

import numpy as np
import truth_numbers
import truth_rig as rig
import truth_run as runs
import truth_sensors as sensors

SIDES = ('flexor', 'extensor')
RADIUS, AT_ZERO = 0.012, 0.015
CENTRE, STOP = 0.10, 1.0
LIMB = (0.30, 0.004, 0.005)      # mass [kg], moment of inertia [kg m^2], damping [N m s]
WAYS = (1.0, -1.0)
# Of the controller: Pa per rad, Pa per rad and Pa per rad s.
AHEAD, PROPORTIONAL, INTEGRAL = 150e3, 15e3, 60e3
CONTROL_STEPS, DUTY_STEPS = 50, 100


@rig.jit
def pull_of(y, in_a, in_b, t, anchors, valve, n, d):
    """Fill the rates of air and memory of one muscle; return its pull on the tendon [N]."""
    d[:] = 0.0
    p = rig.pressure_of(y, valve, n)
    if valve == rig.PPR:
        d[rig.Y_AIR] = rig.regulator_rate(y, in_a, t, n, d)
    else:
        rig.air_rates(y, p, in_a, in_b, n, d)
    return max(rig.muscle_pull(y, p, t, anchors, n, d), 0.0)


@rig.jit
def start_muscle(y, anchors, x, valve, n):
    """Set a muscle at rest with a contraction, without pressure."""
    y[rig.Y_X] = x
    y[rig.Y_Q1:rig.Y_Q4 + 1] = x
    anchors[:] = x
    room = rig.volume(x) + n[rig.V_DEAD]
    y[rig.Y_AIR] = rig.ATM if valve == rig.PPR else rig.ATM * room / rig.RT
    y[rig.Y_ENERGY] = rig.ATM * room / (rig.GAMMA - 1.0)
    y[rig.Y_SECOND] = rig.ATM * n[rig.SECOND_VOLUME] / rig.RT
    y[rig.Y_STORE] = n[rig.SUPPLY] * n[rig.RESERVOIR] / rig.RT


@rig.jit
def written(row, y, p, pull, n):
    """Fill a row of output of one muscle."""
    row[rig.O_P], row[rig.O_X], row[rig.O_V], row[rig.O_F] = p, y[rig.Y_X], y[rig.Y_V], pull
    row[rig.O_SUPPLY] = n[rig.SUPPLY]
    if n[rig.RESERVOIR] > 0.0:
        row[rig.O_SUPPLY] = y[rig.Y_STORE] * rig.RT / n[rig.RESERVOIR]
    row[rig.O_MASS] = y[rig.Y_AIR]


@rig.jit
def simulate(numbers, valve, wanted, stiffening, end_s):
    """
    Return (rows of both muscles, angles [rad] beside them, signals sent).

    Parameters
    ----------
    numbers : numpy.ndarray, shape (2, N)
        Of flexor and extensor.
    valve : int
        PPR or HSV, with the mean opening of its pulses.
    wanted, stiffening : numpy.ndarray
        Angle [rad] and mean pressure of both [Pa gauge], at 200 Hz.
    end_s : float
        Length.

    What was sent is t, and the signals of flexor and of extensor.

    """
    steps = int(round(end_s / rig.STEP_S))
    count = steps // rig.EVERY + 1
    rows, angles = np.empty((2, count, 6)), np.empty(count)
    every = CONTROL_STEPS if valve == rig.PPR else DUTY_STEPS
    sent = np.zeros((steps // every + 1, 5))
    y, middle, d = np.zeros((2, rig.SIZE)), np.zeros((2, rig.SIZE)), np.zeros((2, rig.SIZE))
    anchors, plays = np.zeros((2, 6)), np.zeros((2, 3))
    pulls, inputs, aims = np.zeros(2), np.zeros((2, 2)), np.zeros(2)
    pointer = np.full(2, -1)
    for j in range(2):
        start_muscle(y[j], anchors[j], AT_ZERO, valve, numbers[j])
    angle, speed, summed = 0.0, 0.0, 0.0
    for k in range(steps + 1):
        t = k * rig.STEP_S
        if k % CONTROL_STEPS == 0:
            place = min(k // CONTROL_STEPS, wanted.size - 1)
            error = wanted[place] - angle
            summed += error * CONTROL_STEPS * rig.STEP_S
            push = AHEAD * wanted[place] + PROPORTIONAL * error + INTEGRAL * summed
            for j in range(2):
                aims[j] = min(max(stiffening[place] + WAYS[j] * push, 0.0), 6e5)
        if k % every == 0:
            row = sent[k // every]
            row[0] = t
            for j in range(2):
                row[1 + 2 * j] = aims[j] / 1e5
                if valve != rig.PPR:
                    row[1 + 2 * j], row[2 + 2 * j] = rig.driver(
                        rig.pressure_of(y[j], valve, numbers[j]), rig.ATM + aims[j],
                        y[j, rig.Y_X], numbers[j])
        for j in range(2):
            n = numbers[j]
            while (pointer[j] + 1 <= k // every
                   and sent[pointer[j] + 1, 0] + n[rig.DELAY] <= t + 1e-9):
                pointer[j] += 1
            now = max(pointer[j], 0)
            raw_a = sent[now, 1 + 2 * j] if pointer[j] >= 0 else 0.0
            raw_b = sent[now, 2 + 2 * j] if pointer[j] >= 0 else 0.0
            inputs[j, 0], inputs[j, 1] = rig.acting(raw_a, raw_b, t, plays[j], valve, n)
            pulls[j] = pull_of(y[j], inputs[j, 0], inputs[j, 1], t, anchors[j], valve, n, d[j])
            if k % rig.EVERY == 0:
                written(rows[j, k // rig.EVERY], y[j], rig.pressure_of(y[j], valve, n),
                        pulls[j], n)
        if k % rig.EVERY == 0:
            angles[k // rig.EVERY] = angle
        angle, speed = advance(
            y, middle, d, inputs, t, anchors, valve, numbers, pulls, angle, speed, LIMB)
    return rows, angles, sent


@rig.jit
def advance(y, middle, d, inputs, t, anchors, valve, numbers, pulls, angle, speed, limb):
    """Take one step from rates that are in ``d`` and ``pulls``; return angle and speed."""
    turn = _turn(pulls, angle, speed, limb)
    # Midpoint: half a step, the rates there, the whole step with them.
    half_angle, half_speed = angle + 0.5 * rig.STEP_S * speed, speed + 0.5 * rig.STEP_S * turn
    for j in range(2):
        middle[j] = y[j] + 0.5 * rig.STEP_S * d[j]
        _place(middle[j], WAYS[j], half_angle, half_speed)
        pulls[j] = pull_of(middle[j], inputs[j, 0], inputs[j, 1], t + 0.5 * rig.STEP_S,
                           anchors[j], valve, numbers[j], d[j])
    angle += rig.STEP_S * half_speed
    speed += rig.STEP_S * _turn(pulls, half_angle, half_speed, limb)
    if abs(angle) > STOP:
        angle, speed = min(max(angle, -STOP), STOP), 0.0
    for j in range(2):
        y[j] += rig.STEP_S * d[j]
        _place(y[j], WAYS[j], angle, speed)
        for i in range(6):
            anchors[j, i] = min(max(anchors[j, i], y[j, rig.Y_X] - rig.SLIP_M[i]),
                                y[j, rig.Y_X] + rig.SLIP_M[i])
    return angle, speed


@rig.jit
def _turn(pulls, angle, speed, limb):
    """Return the acceleration of the joint [rad/s^2]."""
    mass, inertia, damping = limb
    return (RADIUS * (pulls[0] - pulls[1]) - damping * speed
            - mass * rig.GRAVITY * CENTRE * np.sin(angle)) / inertia


@rig.jit
def _place(y, way, angle, speed):
    """Set the contraction and its speed that belong to an angle."""
    y[rig.Y_X], y[rig.Y_V] = AT_ZERO + way * RADIUS * angle, way * RADIUS * speed


@rig.jit
def follow(n, valve, times, first, second, path, start_gauge):
    """Return the rows of one muscle whose contraction and speed are given, on what was sent."""
    rows = np.empty((path.shape[0], 6))
    y, middle, d = np.zeros(rig.SIZE), np.zeros(rig.SIZE), np.zeros(rig.SIZE)
    anchors, plays = np.zeros(6), np.full(3, start_gauge)
    start_muscle(y, anchors, path[0, 0], valve, n)
    p = rig.ATM + start_gauge
    room = rig.volume(path[0, 0]) + n[rig.V_DEAD]
    y[rig.Y_AIR] = p if valve == rig.PPR else p * room / rig.RT
    y[rig.Y_ENERGY], y[rig.Y_SECOND] = p * room / (rig.GAMMA - 1.0), p * n[
        rig.SECOND_VOLUME] / rig.RT
    y[rig.Y_A1] = y[rig.Y_A2] = start_gauge if valve == rig.PPR else 0.0
    pointer = -1
    for k in range((path.shape[0] - 1) * rig.EVERY + 1):
        t, now = k * rig.STEP_S, k // rig.EVERY
        after = min(now + 1, path.shape[0] - 1)
        share = (k % rig.EVERY) / rig.EVERY
        y[rig.Y_X] = path[now, 0] + share * (path[after, 0] - path[now, 0])
        y[rig.Y_V] = path[now, 1] + share * (path[after, 1] - path[now, 1])
        while pointer + 1 < times.size and times[pointer + 1] + n[rig.DELAY] <= t + 1e-9:
            pointer += 1
        in_a, in_b = rig.acting(first[max(pointer, 0)], second[max(pointer, 0)], t, plays, valve,
                                n)
        pull = pull_of(y, in_a, in_b, t, anchors, valve, n, d)
        if k % rig.EVERY == 0:
            written(rows[now], y, rig.pressure_of(y, valve, n), pull, n)
        middle[:] = y + 0.5 * rig.STEP_S * d
        middle[rig.Y_X] = y[rig.Y_X] + 0.5 * rig.STEP_S * y[rig.Y_V]
        middle[rig.Y_V] = y[rig.Y_V]
        pull_of(middle, in_a, in_b, t + 0.5 * rig.STEP_S, anchors, valve, n, d)
        y += rig.STEP_S * d
        for i in range(6):
            anchors[i] = min(max(anchors[i], y[rig.Y_X] - rig.SLIP_M[i]),
                             y[rig.Y_X] + rig.SLIP_M[i])
    return rows


def run_joint(numbers, valve, wanted, stiffening):
    """
    Return ([Truth of flexor, Truth of extensor], angles [rad] every 0.2 ms).

    Parameters
    ----------
    numbers : tuple of dict
        Numbers of flexor and extensor that are not neutral.
    valve : {'ppr', 'hsv'}
        Of both.
    wanted, stiffening : numpy.ndarray
        Angle [rad] and mean pressure [Pa gauge] at 200 Hz.

    """
    lead = int(runs.SETTLE_S * 200)
    rows, angles, sent = simulate(
        np.array([truth_numbers.numbers(**n) for n in numbers]),
        rig.PPR if valve == 'ppr' else rig.HSV,
        np.concatenate([np.full(lead, wanted[0]), wanted]),
        np.concatenate([np.full(lead, stiffening[0]), stiffening]),
        runs.SETTLE_S + wanted.size / 200.0)
    from_here = int(round(runs.SETTLE_S / sensors.ROW_S))
    late = sent[:, 0] >= runs.SETTLE_S - 1e-9
    times = sent[late, 0] - runs.SETTLE_S
    columns = (slice(1, 2), slice(3, 4)) if valve == 'ppr' else (slice(1, 3), slice(3, 5))
    return [runs.Truth(rows[j, from_here:], times, sent[late, c], times, np.zeros(times.size))
            for j, c in enumerate(columns)], angles[from_here:]


def replay(numbers, valve, truth, start_pa=None):
    """Return the rows of a muscle with these numbers on the contraction of another run."""
    second = truth.sent[:, 1] if valve == 'hsv' else np.zeros(truth.sent_s.size)
    start = truth.rows[0, rig.O_P] if start_pa is None else start_pa
    return follow(truth_numbers.numbers(**numbers), rig.PPR if valve == 'ppr' else rig.HSV,
                  truth.sent_s, np.ascontiguousarray(truth.sent[:, 0]),
                  np.ascontiguousarray(second),
                  np.ascontiguousarray(truth.rows[:, [rig.O_X, rig.O_V]]), start - rig.ATM)

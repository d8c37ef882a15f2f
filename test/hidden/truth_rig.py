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
A rig with hidden effects, written anew: nothing here comes from the packages under test.

Formulation: the air is a mass and an inner energy; its pressure is a result. The state is advanced
by the explicit midpoint rule with 0.1 ms. Dry friction is a bristle. Memory is slip elements with
anchors, or Dahl's differential equation.
"""

import math

import numba
import numpy as np
from truth_numbers import NUMBERS

STEP_S = 1e-4
EVERY = 2                     # one row of output per so many steps

(MASS, DAMPING, GAIN_MAP, K_M, T_M, C, V_DEAD, SUPPLY, DELAY, LAG_1, LAG_2, PLAY, DEAD_BAND,
 OPEN_DEAD, OPEN_RAMP, CLOSE_DEAD, CLOSE_RAMP, CAP_FILL, CAP_VENT, VENT_RATIO, LEAK_NOZZLE,
 LEAK_SLIT, RESERVOIR, BAND, REFILL, SECOND_VOLUME, HEAT_TIME, DRY, DRY_400, STRIBECK, LOOP,
 LOOP_400, DAHL_TRAVEL, VISCOUS, VISCOUS_POWER, CREEP_1, CREEP_2, CREEP_3, CREEP_4, CREEP_T1,
 CREEP_T2, CREEP_T3, CREEP_T4, SOFTEN, SOFTEN_T1, SOFTEN_T2, THRESHOLD, TAPER, TAPER_GROWTH,
 TUBE, TUBE_HARDENING, GUIDE, SPRING, SPRING_CUBIC, RIPPLE, RIPPLE_PERIOD, CONTACT, PULSATION,
 PULSATION_HZ, GAIN_DRIFT, DRAG_X2, DRAG_V2, DRY_GROWING, DRY_PULL, STOP_STIFFNESS, STOP_AT,
 RESONANCE_HZ, RESONANCE_DAMPING, WANDER, WANDER_HZ, PULL, FILL_CURVE, DRAG_P, BUMP, BUMP_AT,
 FULL_SLOW, AGEING) = range(len(NUMBERS))

# Physical constants and the muscle.
ATM, AMBIENT, GAS, GRAVITY, RHO = 101325.0, 293.15, 287.05, 9.80665, 1.185
RT = GAS * AMBIENT
GAMMA = 1.4
CV = GAS / (GAMMA - 1.0)
LENGTH, BORE, ANGLE = 0.300, 5.0e-3, math.radians(28.6)
THREAD2 = (LENGTH / math.cos(ANGLE)) ** 2
TURNS = LENGTH * math.tan(ANGLE) / (math.pi * BORE)
VOLUME_SCALE = 1.0 / (4.0 * math.pi * TURNS ** 2)
TOP = 0.25 * LENGTH
CRITICAL = 0.38
HEAT_MASS = 8e-5

# Bristles of dry friction: travel to break-away, damping while nearly at rest.
BRISTLE_M, BRISTLE_SPEED, STRIBECK_SPEED = 15e-6, 0.5e-3, 5e-3
SLIP_M = np.array([0.07e-3, 0.18e-3, 0.45e-3, 0.9e-3, 1.7e-3, 3.4e-3])
SLIP_SHARE = np.array([0.14, 0.16, 0.22, 0.20, 0.16, 0.12])

# State: pressure or air mass, inner energy, motion, bristles, memory, lags, second volume…
(Y_AIR, Y_ENERGY, Y_X, Y_V, Y_DRY, Y_GUIDE, Y_DAHL, Y_Q1, Y_Q2, Y_Q3, Y_Q4, Y_WARM_1, Y_WARM_2,
 Y_A1, Y_A2, Y_B1, Y_B2, Y_SECOND, Y_STORE, Y_SPIN, Y_RATE) = range(21)
SIZE = 21
PPR, HSV = 0, 1
O_P, O_X, O_F, O_V, O_SUPPLY, O_MASS = range(6)

jit = numba.njit(cache=True)


@jit
def volume(x):
    """Return the inner volume of the muscle [m^3]."""
    length = LENGTH - x
    return length * (THREAD2 - length * length) * VOLUME_SCALE


@jit
def volume_slope(x):
    """Return dV/dx [m^2]."""
    length = LENGTH - x
    return (3.0 * length * length - THREAD2) * VOLUME_SCALE


@jit
def iso_flow(p1, p2, conductance, critical):
    """Return the mass flow [kg/s] of ISO 6358 with its linear part near equal pressures."""
    if p2 >= p1:
        return 0.0
    r = p2 / p1
    choked = conductance * RHO * p1
    if r <= critical:
        return choked
    share = (min(r, 0.999) - critical) / (1.0 - critical)
    root = math.sqrt(1.0 - share * share)
    return choked * root * ((1.0 - r) / 0.001 if r > 0.999 else 1.0)


@jit
def nozzle(p1, p2):
    """Return the mass flow of a unit isentropic nozzle, relative to RHO p1 when choked."""
    if p2 >= p1:
        return 0.0
    r = max(p2 / p1, 0.5283)
    flow = math.sqrt(max(r ** (2.0 / GAMMA) - r ** ((GAMMA + 1.0) / GAMMA), 0.0)) / 0.258823
    return RHO * p1 * flow


@jit
def map_force(gauge, strain, gain):
    """Return the force of the nominal map [N], never below zero."""
    kpa = 1e-3 * gauge
    percent = 100.0 * strain
    return max(0.0, gain * (
        (46.3339 - 0.00680486 * kpa) * math.exp(-0.42779 * percent)
        - 0.00817055 * percent * kpa + 0.256907 * kpa - 56.3953))


@jit
def opening(duty, n):
    """Return the mean opening of one on/off valve with dead times and ramps of its lift."""
    period = 0.010
    on = min(max(duty, 0.0), 1.0) * period
    moving = n[OPEN_DEAD] + n[OPEN_RAMP] + n[CLOSE_DEAD] + n[CLOSE_RAMP]
    if moving == 0.0:
        return on / period
    if on <= n[OPEN_DEAD]:
        return 0.0
    if period - on < n[CLOSE_DEAD] + 0.5 * n[CLOSE_RAMP]:
        return 1.0
    lift = 1.0
    if n[OPEN_RAMP] > 0.0:
        lift = min((on - n[OPEN_DEAD]) / n[OPEN_RAMP], 1.0)
    if lift < 1.0:
        area = 0.5 * lift * (on - n[OPEN_DEAD])
    else:
        area = on - n[OPEN_DEAD] - 0.5 * n[OPEN_RAMP]
    area += lift * n[CLOSE_DEAD] + 0.5 * lift * lift * n[CLOSE_RAMP]
    return min(area / period, 1.0)


@jit
def second_stage(y, target, first, second, time_1, time_2, d):
    """Fill the rates of two lags in series and return what leaves them."""
    if time_1 <= 0.0:
        return target
    d[first] = (target - y[first]) / time_1
    if time_2 <= 0.0:
        return y[first]
    d[second] = (y[first] - y[second]) / time_2
    return y[second]


@jit
def bristle(z, v, level, top_ratio, mass, d, slot):
    """Fill the rate of a bristle and return its force [N] against motion."""
    if level <= 0.0:
        d[slot] = 0.0
        return 0.0
    rate = (v - abs(v) * z) / BRISTLE_M
    d[slot] = rate
    high = 1.0 + (top_ratio - 1.0) * math.exp(-(v / STRIBECK_SPEED) ** 2)
    stiffness = level / BRISTLE_M
    damping = 0.6 * math.sqrt(stiffness * mass) * math.exp(-(v / BRISTLE_SPEED) ** 2)
    return level * high * z + damping * BRISTLE_M * rate


@jit
def pressure_of(y, valve, n):
    """Return the pressure in the muscle [Pa absolute]."""
    if valve == PPR:
        return y[Y_AIR]
    room = volume(y[Y_X]) + n[V_DEAD]
    if n[HEAT_TIME] > 0.0:
        return (GAMMA - 1.0) * y[Y_ENERGY] / room
    return y[Y_AIR] * RT / room


@jit
def air_lost(p, n):
    """Return the mass flow of the leak [kg/s]: an orifice and a slit side by side."""
    lost = 0.0
    if n[LEAK_NOZZLE] > 0.0:
        lost += n[LEAK_NOZZLE] * nozzle(p, ATM)
    if n[LEAK_SLIT] > 0.0 and p > ATM:
        lost += n[LEAK_SLIT] * (p * p - ATM * ATM)
    return lost


@jit
def regulator_rate(y, target, t, n, d):
    """Return dp/dt [Pa/s] of the regulator towards ``target`` gauge, and fill its lags."""
    p, x = y[Y_AIR], y[Y_X]
    target = second_stage(y, target, Y_A1, Y_A2, n[LAG_1], n[LAG_2], d)
    if n[PULSATION] != 0.0:
        target += n[PULSATION] * math.sin(2.0 * math.pi * n[PULSATION_HZ] * t)
    if n[WANDER] != 0.0:
        target += n[WANDER] * math.sin(2.0 * math.pi * n[WANDER_HZ] * t + 1.7 * math.sin(0.9 * t))
    distance = target - (p - ATM)
    if n[DEAD_BAND] > 0.0:
        distance -= 0.98 * n[DEAD_BAND] * math.tanh(distance / n[DEAD_BAND])
    if n[RESONANCE_HZ] > 0.0:            # a regulator of second order that swings
        w = 2.0 * math.pi * n[RESONANCE_HZ]
        d[Y_RATE] = w * w * distance - 2.0 * n[RESONANCE_DAMPING] * w * y[Y_RATE]
        return y[Y_RATE]
    rate = distance / n[T_M]
    if n[FULL_SLOW] != 0.0:              # the more air there is to move
        rate /= 1.0 + n[FULL_SLOW] * x / 0.020
    if n[VENT_RATIO] != 1.0:
        falling = 0.5 - 0.5 * math.tanh(distance / 800.0)
        rate /= 1.0 + (n[VENT_RATIO] - 1.0) * falling
    if n[CAP_FILL] > 0.0:
        room = (volume(0.010) + n[V_DEAD]) / (volume(x) + n[V_DEAD])
        if rate > 0.0:
            cap = n[CAP_FILL] * room * nozzle(n[SUPPLY], p) / nozzle(n[SUPPLY], ATM + 4e5)
        else:
            cap = n[CAP_VENT] * room * nozzle(p, ATM) / nozzle(ATM + 4e5, ATM)
        cap = max(cap, 1.0)
        rate /= (1.0 + (abs(rate) / cap) ** 8) ** 0.125
    if n[LEAK_NOZZLE] > 0.0 or n[LEAK_SLIT] > 0.0:
        rate -= RT / (volume(x) + n[V_DEAD]) * air_lost(p, n)
    return rate


@jit
def air_rates(y, p, fill, vent, n, d):
    """Fill the rates of air mass, energy, second volume and reservoir."""
    supply = n[SUPPLY]
    if n[RESERVOIR] > 0.0:
        supply = y[Y_STORE] * RT / n[RESERVOIR]
    fill = second_stage(y, fill, Y_A1, Y_A2, n[LAG_1], n[LAG_2], d)
    vent = second_stage(y, vent, Y_B1, Y_B2, n[LAG_1], n[LAG_2], d)
    inward = fill * iso_flow(supply, p, n[C], CRITICAL)
    outward = vent * iso_flow(p, ATM, n[C], CRITICAL) / n[VENT_RATIO] + air_lost(p, n)
    if n[FILL_CURVE] != 0.0:
        inward *= 1.0 - n[FILL_CURVE] * fill
    if n[FULL_SLOW] != 0.0:
        inward /= 1.0 + n[FULL_SLOW] * y[Y_X] / 0.020
        outward /= 1.0 + n[FULL_SLOW] * y[Y_X] / 0.020
    aside = 0.0
    if n[SECOND_VOLUME] > 0.0:
        beside = y[Y_SECOND] * RT / n[SECOND_VOLUME]
        aside = (p - beside) * n[SECOND_VOLUME] / (RT * 0.004)      # settles within 4 ms
        d[Y_SECOND] = aside
    if n[RESERVOIR] > 0.0:
        d[Y_STORE] = y[Y_SPIN] * n[REFILL] - inward
    temperature = AMBIENT
    if n[HEAT_TIME] > 0.0:
        temperature = y[Y_ENERGY] / (y[Y_AIR] * CV)
        outward *= math.sqrt(AMBIENT / temperature)
        d[Y_ENERGY] = (
            (inward * AMBIENT - outward * temperature) * CV * GAMMA
            - p * volume_slope(y[Y_X]) * y[Y_V]
            + HEAT_MASS * CV / n[HEAT_TIME] * (AMBIENT - temperature))
    d[Y_AIR] = inward - outward - aside


@jit
def muscle_pull(y, p, t, anchors, n, d):
    """Return the tension [N] of map, rubber, memory and bristle, and fill their rates."""
    x, v = y[Y_X], y[Y_V]
    gauge = p - ATM
    strain = x / LENGTH
    if n[THRESHOLD] != 0.0:
        gauge -= n[THRESHOLD] * math.tanh(max(gauge, 0.0) / (2.0 * abs(n[THRESHOLD])))
    if n[TAPER] != 0.0:
        strain *= 1.0 + n[TAPER] * (1.0 + n[TAPER_GROWTH] * strain)
    force = map_force(gauge, strain, n[GAIN_MAP])
    if n[AGEING] != 0.0:
        force *= 1.0 - n[AGEING] * (1.0 - math.exp(-t / 15.0))
    if n[SOFTEN] != 0.0:
        force /= 1.0 + n[SOFTEN] * y[Y_WARM_2]
        d[Y_WARM_1] = (abs(v) / 0.020 - y[Y_WARM_1]) / n[SOFTEN_T1]
        d[Y_WARM_2] = (y[Y_WARM_1] - y[Y_WARM_2]) / n[SOFTEN_T2]
    if n[TUBE] != 0.0:
        force -= n[TUBE] * x * (1.0 + n[TUBE_HARDENING] * (x / 0.020) ** 2)
    for k in range(4):
        if n[CREEP_1 + k] > 0.0:
            d[Y_Q1 + k] = (x - y[Y_Q1 + k]) / n[CREEP_T1 + k]
            force -= n[CREEP_1 + k] * (x - y[Y_Q1 + k])
    if n[VISCOUS] != 0.0:
        force -= math.copysign(n[VISCOUS] * (abs(v) / 0.05) ** n[VISCOUS_POWER], v)
    level = n[LOOP] + n[LOOP_400] * (p - ATM) / 4e5
    if level > 0.0:
        if n[DAHL_TRAVEL] > 0.0:
            d[Y_DAHL] = (v - abs(v) * y[Y_DAHL]) / n[DAHL_TRAVEL]
            force -= level * y[Y_DAHL]
        else:
            for k in range(6):
                force -= level * SLIP_SHARE[k] * min(max(
                    (x - anchors[k]) / SLIP_M[k], -1.0), 1.0)
    dry = n[DRY] + n[DRY_400] * (p - ATM) / 4e5 + n[DRY_GROWING] * x / 0.010
    force -= bristle(y[Y_DRY], v, dry, n[STRIBECK], n[MASS], d, Y_DRY)
    if n[DRY_PULL] > 0.0:
        force -= n[DRY_PULL] * 0.5 * (1.0 + math.tanh(v / 1e-3))
    force -= n[DRAG_X2] * x * x * v + n[DRAG_V2] * abs(v) * v
    if n[RIPPLE] != 0.0:
        force -= n[RIPPLE] * math.sin(2.0 * math.pi * x / n[RIPPLE_PERIOD])
    if n[BUMP] != 0.0:
        force -= n[BUMP] * math.exp(-((x - n[BUMP_AT]) / 2e-3) ** 2)
    return force - (n[DAMPING] + n[DRAG_P] * gauge / 4e5) * v


@jit
def load_push(y, t, n, d):
    """Return the force [N] of the load but its inertia and weight, against contraction."""
    x = y[Y_X]
    force = bristle(y[Y_GUIDE], y[Y_V], n[GUIDE], n[STRIBECK], n[MASS], d, Y_GUIDE)
    if n[SPRING] != 0.0:
        force += n[SPRING] * x * (1.0 + n[SPRING_CUBIC] * (x / 0.020) ** 2)
    if n[STOP_STIFFNESS] > 0.0 and x > n[STOP_AT]:
        force += n[STOP_STIFFNESS] * (x - n[STOP_AT])
    if n[CONTACT] != 0.0 and math.sin(0.83 * t) + math.sin(1.97 * t + 1.0) > 0.7:
        force += n[CONTACT]
    return force + n[PULL]


@jit
def rates(y, in_a, in_b, t, anchors, valve, n, d):
    """Fill dy/dt; return (tension, load force, pressure)."""
    d[:] = 0.0
    p = pressure_of(y, valve, n)
    if valve == PPR:
        d[Y_AIR] = regulator_rate(y, in_a, t, n, d)
    else:
        air_rates(y, p, in_a, in_b, n, d)
    pull = muscle_pull(y, p, t, anchors, n, d)
    push = load_push(y, t, n, d)
    acceleration = (pull - push) / n[MASS] - GRAVITY
    if y[Y_X] <= 0.0 and y[Y_V] <= 0.0 and acceleration < 0.0:
        acceleration = 0.0
    if y[Y_X] >= TOP and y[Y_V] >= 0.0 and acceleration > 0.0:
        acceleration = 0.0
    d[Y_X], d[Y_V] = y[Y_V], acceleration
    return pull, push, p


@jit
def driver(p, wanted, x, n):
    """Return (fill, vent) duty of a plain inner loop: what a third of the error would need."""
    error = wanted - p
    if abs(error) < 2500.0:
        return 0.0, 0.0
    mass = 0.35 * error * (volume(x) + 3.0e-6) / RT
    if error > 0.0:
        return min(mass / (0.010 * iso_flow(801325.0, p, 2.0e-10, CRITICAL) + 1e-12), 1.0), 0.0
    return 0.0, min(-mass / (0.010 * iso_flow(p, ATM, 2.0e-10, CRITICAL) + 1e-12), 1.0)


@jit
def acting(raw_a, raw_b, t, plays, valve, n):
    """Return what acts behind play or lift: regulator aim [Pa gauge] and 0, or two openings."""
    if valve != PPR:
        return opening(raw_a, n), opening(raw_b, n)
    aim = n[K_M] * (1.0 + n[GAIN_DRIFT] * t / 60.0) * min(max(raw_a, 0.0), 6.0)
    if n[PLAY] > 0.0:
        for j in range(3):
            half = n[PLAY] * (0.6 + 0.4 * j)
            plays[j] = min(max(plays[j], aim - half), aim + half)
        aim = 0.25 * plays[0] + 0.5 * plays[1] + 0.25 * plays[2]
    return aim, 0.0


@jit
def advance(y, middle, d, in_a, in_b, t, anchors, running, valve, n, step_s):
    """Take one step from rates that are in ``d``; return whether the compressor runs."""
    for j in range(SIZE):
        middle[j] = y[j] + 0.5 * step_s * d[j]
    rates(middle, in_a, in_b, t + 0.5 * step_s, anchors, valve, n, d)
    for j in range(SIZE):
        y[j] += step_s * d[j]
    if y[Y_X] < 0.0 or y[Y_X] > TOP:
        y[Y_X] = min(max(y[Y_X], 0.0), TOP)
        y[Y_V] = 0.0
    for j in range(6):
        anchors[j] = min(max(anchors[j], y[Y_X] - SLIP_M[j]), y[Y_X] + SLIP_M[j])
    if n[RESERVOIR] > 0.0:
        level = y[Y_STORE] * RT / n[RESERVOIR]
        if level <= n[SUPPLY] - n[BAND]:
            running = 1.0
        elif level >= n[SUPPLY]:
            running = 0.0
        y[Y_SPIN] += (running - y[Y_SPIN]) * step_s / 0.3
    return running


@jit
def simulate(n, valve, times, first, second, start_gauge, end_s, closed):
    """
    Return (rows, duties): the rig's answer to held inputs.

    Parameters
    ----------
    n : numpy.ndarray
        All numbers.
    valve : int
        PPR or HSV.
    times : numpy.ndarray
        Instants [s] from which the inputs hold, rising.
    first, second : numpy.ndarray
        PPR: voltage, and nothing. HSV: duties or, with ``closed``, a wanted absolute
        pressure, NaN for both valves shut, and nothing.
    start_gauge : float
        Pressure at the start [Pa gauge], the mass resting where that holds it.
    end_s : float
        Length.
    closed : bool
        Whether the inner loop drives the on/off valves, once per 10 ms.

    Rows are p, x, F_cell, v, supply, air mass every 0.2 ms; duties are t, fill, vent.

    """
    steps = int(round(end_s / STEP_S))
    rows = np.empty((steps // EVERY + 1, 6))
    duties = np.empty((int(end_s / 0.010) + 2, 3))
    sent, ready = 0, 0
    y, middle = np.zeros(SIZE), np.zeros(SIZE)
    d, anchors = np.zeros(SIZE), np.zeros(6)
    p = ATM + start_gauge
    y[Y_X] = _rest(start_gauge, n)
    y[Y_Q1:Y_Q4 + 1] = y[Y_X]
    anchors = np.full(6, y[Y_X])
    room = volume(y[Y_X]) + n[V_DEAD]
    y[Y_AIR] = p if valve == PPR else p * room / RT
    y[Y_ENERGY] = p * room / (GAMMA - 1.0)
    y[Y_SECOND] = p * n[SECOND_VOLUME] / RT
    y[Y_STORE] = n[SUPPLY] * n[RESERVOIR] / RT
    y[Y_A1] = y[Y_A2] = start_gauge if valve == PPR else 0.0
    plays = np.full(3, start_gauge)
    running, pointer = 0.0, -1
    wanted = p
    raw_a, raw_b = (start_gauge / 1e5 if valve == PPR else 0.0), 0.0
    # A delayed command: what was sent waits in the list of inputs or of duties.
    for k in range(steps + 1):
        t = k * STEP_S
        if closed:
            while pointer + 1 < times.size and times[pointer + 1] <= t + 1e-9:
                pointer += 1
                wanted = first[pointer]
            if k % 100 == 0:
                a, b = 0.0, 0.0
                if wanted == wanted:
                    a, b = driver(pressure_of(y, valve, n), wanted, y[Y_X], n)
                duties[sent, 0], duties[sent, 1], duties[sent, 2] = t, a, b
                sent += 1
            while ready < sent and duties[ready, 0] + n[DELAY] <= t + 1e-9:
                raw_a, raw_b = duties[ready, 1], duties[ready, 2]
                ready += 1
        else:
            while pointer + 1 < times.size and times[pointer + 1] + n[DELAY] <= t + 1e-9:
                pointer += 1
                raw_a, raw_b = first[pointer], second[pointer]
        in_a, in_b = acting(raw_a, raw_b, t, plays, valve, n)
        pull, push, p = rates(y, in_a, in_b, t, anchors, valve, n, d)
        if k % EVERY == 0:
            row = rows[k // EVERY]
            row[O_P], row[O_X], row[O_V] = p, y[Y_X], y[Y_V]
            row[O_F] = n[MASS] * (d[Y_V] + GRAVITY) + push
            row[O_SUPPLY] = n[SUPPLY] if n[RESERVOIR] == 0.0 else y[Y_STORE] * RT / n[RESERVOIR]
            row[O_MASS] = p * (volume(y[Y_X]) + n[V_DEAD]) / RT if valve == PPR else y[Y_AIR]
        running = advance(y, middle, d, in_a, in_b, t, anchors, running, valve, n, STEP_S)
    return rows, duties[:sent]


@jit
def _rest(gauge, n):
    """Return the contraction [m] at which the map holds the weight, by bisection."""
    weight = n[MASS] * GRAVITY
    if map_force(gauge, 0.0, n[GAIN_MAP]) <= weight:
        return 0.0
    low, high = 0.0, TOP
    for _ in range(60):
        middle = 0.5 * (low + high)
        if map_force(gauge, middle / LENGTH, n[GAIN_MAP]) > weight:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)

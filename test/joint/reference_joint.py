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
The joint a second time: its equations, written for ``solve_ivp`` and not shared with the package.

Two DMSP-5-300 muscles on 12 mm pulleys, contraction 15 mm at angle 0, limb 0.3 kg, 0.1 m,
0.004 kg m^2, damping 0.005 N m s, stops at 1 rad; dry friction in the joint where asked for.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp

P_ATM, R, T, G = 101325.0, 287.05, 293.15, 9.80665
L0, D0, ALPHA, V_DEAD = 0.300, 0.005, math.radians(28.6), 3.0e-6
C, B, SUPPLY, RHO0 = 2.0e-10, 0.38, 801325.0, 1.185
RADIUS, X0, MASS, COM, INERTIA, DAMPING = 0.012, 0.015, 0.30, 0.10, 0.004, 0.005
MUSCLE_DAMPING, STOP = 25.0, 1.0


def tension(p, x, v):
    """Return the tension [N] of one muscle, which never pushes."""
    kpa, percent = (p - P_ATM) / 1000.0, 100.0 * x / L0
    static = ((-0.00680486 * kpa + 46.3339) * math.exp(-0.42779 * percent)
              - 0.00817055 * percent * kpa + 0.256907 * kpa - 56.3953)
    return max(0.0, max(0.0, static) - MUSCLE_DAMPING * v)


def torque(angle, velocity, p_f, p_e):
    """Return the torque [N m] on the limb, dry friction and external torque excepted."""
    pull = tension(p_f, X0 + RADIUS * angle, RADIUS * velocity) \
        - tension(p_e, X0 - RADIUS * angle, -RADIUS * velocity)
    return RADIUS * pull - DAMPING * velocity - MASS * G * COM * math.sin(angle)


def flow(p1, p2):
    """Return the mass flow [kg/s] through one valve."""
    r = p2 / p1
    if r >= 1.0:
        return 0.0
    psi = 1.0
    if r > B:
        psi = math.sqrt(1.0 - ((min(r, 0.999) - B) / (1.0 - B)) ** 2)
        if r > 0.999:
            psi *= (1.0 - r) / 0.001
    return C * RHO0 * p1 * psi


def pressure_rate(valve, u, p, x, v):
    """Return dp/dt [Pa/s] of one muscle."""
    if valve == 'ppr':
        return (P_ATM + 1e5 * min(max(u, 0.0), 6.0) - p) / 0.060
    turns, thread, length = L0 * math.tan(ALPHA) / (math.pi * D0), L0 / math.cos(ALPHA), L0 - x
    scale = 4.0 * math.pi * turns ** 2
    volume = length * (thread ** 2 - length ** 2) / scale + V_DEAD
    slope = -(thread ** 2 - 3.0 * length ** 2) / scale
    return (R * T * (u[0] * flow(SUPPLY, p) - u[1] * flow(p, P_ATM)) - p * slope * v) / volume


def solve(valve, flexor, extensor, p_start, angle, velocity=0.0, external=None, friction=0.0,
          dt=1e-3):
    """
    Return (flexor pressure, extensor pressure, angle, velocity) at the samples.

    The limb moves one way, the other way, or is held by friction or a stop; every change
    between the three is located, and each sample interval is solved to 1e-8.
    """
    p_f, p_e = p_start
    rows = [(p_f, p_e, angle, velocity)]
    for index in range(len(flexor)):
        push = 0.0 if external is None else external[index]

        def rates(t, y):
            p_f, p_e, angle, velocity = y
            velocity = velocity if way else 0.0
            net = torque(angle, velocity, p_f, p_e) + push - way * friction
            return (pressure_rate(valve, flexor[index], p_f, X0 + RADIUS * angle,
                                  RADIUS * velocity),
                    pressure_rate(valve, extensor[index], p_e, X0 - RADIUS * angle,
                                  -RADIUS * velocity),
                    velocity, net / INERTIA if way else 0.0)

        def at_rest(y):
            return torque(y[2], 0.0, y[0], y[1]) + push

        def reverses(t, y):
            return way * y[3] + (1e-13 if t == 0.0 else 0.0)

        def stops(t, y):
            return STOP - way * y[2]

        def starts_up(t, y):
            return at_rest(y) - friction if y[2] < STOP else -1.0

        def starts_down(t, y):
            return at_rest(y) + friction if y[2] > -STOP else 1.0
        reverses.direction = stops.direction = starts_down.direction = -1
        starts_up.direction = 1
        for event in (reverses, stops, starts_up, starts_down):
            event.terminal = True
        t = 0.0
        while t < dt * (1.0 - 1e-9):
            y = (p_f, p_e, angle, velocity)
            if velocity != 0.0:
                way = math.copysign(1.0, velocity)
            else:
                way = 1.0 if starts_up(t, y) > 0.0 else (-1.0 if starts_down(t, y) < 0.0 else 0.0)
            events = (reverses, stops) if way else (starts_up, starts_down)
            if friction == 0.0 and way and abs(angle) < STOP - 0.05:
                events = ()                       # nothing to locate: spares time
            answer = solve_ivp(rates, (t, dt), y, events=events or None, rtol=1e-8,
                               atol=(1e-3, 1e-3, 1e-10, 1e-9), max_step=dt)
            t = answer.t[-1]
            p_f, p_e, angle, velocity = answer.y[:, -1]
            if answer.status == 1:
                velocity = 0.0
                if abs(angle) > STOP - 1e-9:
                    angle = math.copysign(STOP, angle)
                if not way:
                    # Just past the level at which it gives way.
                    velocity = 1e-12 * math.copysign(1.0, at_rest((p_f, p_e, angle, 0.0)))
        rows.append((p_f, p_e, angle, velocity))
    return np.array(rows).T

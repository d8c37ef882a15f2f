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

"""The nominal rig written once more from its equations, for SciPy's solvers; no pam_sim code."""

import math

import numpy as np
from scipy.integrate import solve_ivp

P_ATM, T, R, G = 101325.0, 293.15, 287.05, 9.80665
L0, D0, ALPHA, V_DEAD = 0.300, 0.005, math.radians(28.6), 3.0e-6
MASS, DAMPING = 5.0, 25.0
K_M, T_M = 100e3, 0.060
C, B, SUPPLY, RHO0 = 2.0e-10, 0.38, 801325.0, 1.185


def force(p, x):
    """Return the muscle force [N] at absolute pressure p [Pa] and contraction x [m]."""
    kpa = (p - P_ATM) / 1000.0
    e = 100.0 * x / L0
    return max(0.0, (-0.00680486 * kpa + 46.3339) * math.exp(-0.42779 * e)
               - 0.00817055 * e * kpa + 0.256907 * kpa - 56.3953)


def volume(x):
    """Return (V [m^3], dV/dx [m^2]) of the muscle without dead volume."""
    thread = L0 / math.cos(ALPHA)
    turns = L0 * math.tan(ALPHA) / (math.pi * D0)
    length = L0 - x
    scale = 4.0 * math.pi * turns ** 2
    return (length * (thread ** 2 - length ** 2) / scale,
            -(thread ** 2 - 3.0 * length ** 2) / scale)


def flow(p1, p2):
    """Return the mass flow [kg/s] through one valve."""
    r = p2 / p1
    if r >= 1.0:
        return 0.0
    if r <= B:
        psi = 1.0
    else:
        psi = math.sqrt(1.0 - ((min(r, 0.999) - B) / (1.0 - B)) ** 2)
        if r > 0.999:
            psi *= (1.0 - r) / 0.001
    return C * RHO0 * p1 * psi


def solve(valve, signal, dt, p_start, x_start, external=None):
    """
    Return (p, x, v) at the samples; the signal is held between them.

    The mass stays between its stops: at x = 0 it rests while the net force is
    negative. Each sample interval is solved to 1e-9 with the landing located.
    """
    p, x, v = p_start, x_start, 0.0
    rows = [(p, x, v)]
    for index, u in enumerate(signal):
        pull = 0.0 if external is None else external[index]

        def rates(t, y):
            p, x, v = y
            if valve == 'ppr':
                dp = (P_ATM + K_M * min(max(u, 0.0), 6.0) - p) / T_M
            else:
                vol, slope = volume(x)
                dp = (R * T * (u[0] * flow(SUPPLY, p) - u[1] * flow(p, P_ATM))
                      - p * slope * v) / (vol + V_DEAD)
            net = force(p, x) - DAMPING * v - MASS * G - pull
            if resting:
                return dp, 0.0, 0.0
            return dp, v, net / MASS

        def lift(t, y):
            return force(y[0], 0.0) - MASS * G - pull

        def land(t, y):
            return y[1] + 1e-12 if y[2] < 0.0 or t > 0.0 else 1.0
        land.direction, lift.direction = -1, 1
        land.terminal = lift.terminal = True
        t = 0.0
        while t < dt * (1.0 - 1e-12):
            resting = x <= 0.0 and v <= 0.0 and lift(0.0, (p, x, v)) <= 0.0
            answer = solve_ivp(rates, (t, dt), (p, x, v), events=lift if resting else land,
                               rtol=1e-7, atol=(1e-3, 1e-10, 1e-8), max_step=dt)
            t = answer.t[-1]
            p, x, v = answer.y[:, -1]
            if answer.status == 1:
                x, v = 0.0, 0.0
                if resting:
                    p += 1e-6
        rows.append((p, x, v))
    return np.array(rows).T

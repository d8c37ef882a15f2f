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
Pair of high-speed on/off valves (HSV): fill from the supply, vent to atmosphere.

A duty is the share of a PWM period for which the coil is on. The opening follows with the opening
and closing times of ``valve_dead_zone``; without them it equals the duty.

There are two fidelities. Averaged: the mean opening of a period acts. Switching: each valve is
open or shut. A PWM period latches the duty at its start. The share of a 0.1 ms step in which a
valve is open is exact.
"""

from pam_sim.compiled import inlined
from pam_sim.parameters import Parameter

NAME = 'hsv'
SENTENCE = 'Pair of high-speed on/off valves: one fills from the supply, one vents.'
EQUATION = ('dp/dt = (R T (d_f mdot(p_s, p) - d_v (mdot(p, p_atm) - vent_intake mdot(p_atm, p))) '
            '- p dV/dt) / (V + V_dead), mdot(p1, p2) = C rho0 p1 sqrt(T0 / T) psi(p2 / p1), '
            'psi(r) = 1 for r <= b, sqrt(1 - ((r - b) / (1 - b))^2) for b < r < 0.999, linear in '
            '1 - r from there on, 0 for r >= 1')
SOURCE = 'ISO 6358-1:2013 (choked and unchoked flow); mass balance of an isothermal ideal gas.'
SIGNAL_NAMES = ('fill_duty', 'vent_duty')
FIDELITIES = ('averaged', 'switching')
SWITCHING_STEP_S = 1e-4
SIGNAL_RANGE = (0.0, 1.0, '')         # a duty

PARAMETERS = (
    Parameter('C', 'm3/(s Pa)', 2.0e-10, 1e-12, 1e-8, 0.02,
              'Sonic conductance of each valve with its restrictor; the nominal one suits a 5 mm '
              'muscle.',
              'ISO 6358; fitted restrictor'),
    Parameter('b', '-', 0.38, 0.05, 0.9, 0.0,
              'Critical pressure ratio of each valve.', 'ISO 6358; MHJ10-class valves'),
    Parameter('V_dead', 'm3', 3.0e-6, 0.0, 1e-3, 0.02,
              'Volume of tube and fittings beside the muscle.', 'design value'),
    Parameter('supply_pa', 'Pa', 801_325.0, 150e3, 1.6e6, 0.005,
              'Supply pressure, absolute.', 'design value'),
    Parameter('pwm_period_s', 's', 0.010, 0.001, 0.1, 0.0,
              'Period of the pulse width modulation.', 'design value'),
    Parameter('vent_intake', '-', 1.0, 0.0, 1.0, 0.0,
              'Share of C with which an open vent valve lets air in while the muscle is below the '
              'atmosphere; 0 is a vent with a check valve.', 'open passage: 1'),
)


@inlined
def clip_duty(duty: float) -> float:
    """Return a duty limited to 0 … 1."""
    return min(max(duty, 0.0), 1.0)


@inlined
def open_time_in(start_s: float, end_s: float, on_s: float, off_s: float) -> float:
    """Return how long [s] a valve open from ``on_s`` to ``off_s`` is open in [start, end]."""
    overlap = min(end_s, off_s) - max(start_s, on_s)
    return overlap if overlap > 0.0 else 0.0


@inlined
def pulse_edges(pulse_s: float, last_off_s: float, period_s: float, open_time_s: float,
                close_time_s: float) -> tuple[float, float]:
    """
    Return (on, off) edges [s] of one valve in the PWM period that begins now.

    Parameters
    ----------
    pulse_s : float
        Energised time, duty x period.
    last_off_s : float
        Second edge of the period before, from that period's start.
    period_s : float
        PWM period.
    open_time_s, close_time_s : float
        Delay from energising to open and from de-energising to shut, s. A
        pulse shorter than the first is swallowed; a valve not yet shut stays open. A duty of 1
        is one long pulse: while the valve is on its way, the second edge is negative, the time
        for which the coil has been on.

    """
    carry = max(last_off_s - period_s, 0.0)
    if pulse_s <= 0.0:
        return 0.0, carry
    still_on = close_time_s == 0.0 and last_off_s == period_s
    if carry > 0.0 or still_on:
        return 0.0, max(carry, pulse_s + close_time_s)
    energised_s = max(-last_off_s, 0.0)
    if energised_s + pulse_s <= open_time_s:
        return 0.0, -(energised_s + pulse_s) if pulse_s >= period_s else 0.0
    return open_time_s - energised_s, pulse_s + close_time_s

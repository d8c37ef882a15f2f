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
Proportional pressure regulator (PPR): a first order lag of the set point.

    T_m dp_g/dt = p_zero + K_m (sat(u, u_low, u_high) - u_low) - p_g

The nominal regulator has u_low = 0, u_high = 6 V and p_zero = 0. The regulator imposes the
pressure; volume changes do not disturb it.
"""

from collections.abc import Mapping

from pam_sim.compiled import inlined
from pam_sim.parameters import Parameter

NAME = 'ppr'
SENTENCE = 'Proportional pressure regulator: the pressure follows the command voltage with a lag.'
EQUATION = 'T_m dp_g/dt = p_zero + K_m (sat(u, u_low, u_high) - u_low) - p_g'
SOURCE = 'Situm and Herceg 2008 (first order lag of command and pressure).'
SIGNAL_NAMES = ('ppr_voltage',)
MAX_VOLTAGE_V = 6.0
# Beyond 6 V the regulator saturates; beyond these a number is no voltage of such a valve.
SIGNAL_RANGE = (-1.0, 12.0, 'V')

PARAMETERS = (
    Parameter('K_m', 'Pa/V', 100e3, 10e3, 500e3, 0.02,
              'Gain of the proportional pressure regulator.', 'set-point range 0-6 V, 0-600 kPa'),
    Parameter('T_m', 's', 0.060, 0.001, 2.0, 0.02,
              'Time constant of the proportional pressure regulator.', 'design value'),
    Parameter('ppr_lowest_v', 'V', 0.0, -1.0, 4.0, 0.0,
              'Input u_low from which the pressure rises (zero of the input); below it nothing '
              'changes.',
              'set-point range 0-6 V'),
    Parameter('ppr_highest_v', 'V', MAX_VOLTAGE_V, 4.5, 12.0, 0.0,
              'Input u_high at which the range of the regulator ends.', 'set-point range 0-6 V'),
    Parameter('ppr_zero_pa', 'Pa', 0.0, -100e3, 200e3, 0.0,
              'Gauge pressure p_zero that the regulator gives at its lowest input.',
              'an ideal regulator vents there'),
)


@inlined
def set_point_pa(voltage_v: float, gain_pa_per_v: float, lowest_v: float, highest_v: float,
                 at_lowest_pa: float) -> float:
    """
    Return the absolute pressure set point [Pa] of a command voltage.

    Parameters
    ----------
    voltage_v : float
        Command, V; clipped to the range of the regulator.
    gain_pa_per_v : float
        Pa/V.
    lowest_v, highest_v : float
        Range of the input, V.
    at_lowest_pa : float
        Absolute pressure [Pa] at the lowest input.

    """
    voltage = min(max(voltage_v, lowest_v), highest_v)
    return at_lowest_pa + gain_pa_per_v * (voltage - lowest_v)


def set_point_of(voltage_v: float, parameters: Mapping[str, float], atmosphere_pa: float) -> float:
    """Return the absolute set point [Pa] of a command voltage, by the numbers of a rig."""
    lowest_v, highest_v = parameters['ppr_lowest_v'], parameters['ppr_highest_v']
    voltage = min(max(voltage_v, lowest_v), highest_v)
    return (atmosphere_pa + parameters['ppr_zero_pa']) + parameters['K_m'] * (voltage - lowest_v)


def voltage_v(gauge_pa: float, parameters: Mapping[str, float]) -> float:
    """Return the command [V] that gives a gauge pressure [Pa], clipped to the range."""
    lowest_v, highest_v = parameters['ppr_lowest_v'], parameters['ppr_highest_v']
    wanted = lowest_v + (gauge_pa - parameters['ppr_zero_pa']) / parameters['K_m']
    return min(max(wanted, lowest_v), highest_v)

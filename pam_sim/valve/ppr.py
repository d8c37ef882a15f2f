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

    T_m dp_g/dt = K_m sat(u, 0, 6) - p_g

The regulator imposes the pressure; volume changes do not disturb it.
"""

from pam_sim.compiled import inlined
from pam_sim.parameters import Parameter

NAME = 'ppr'
SENTENCE = 'Proportional pressure regulator: the pressure follows the command voltage with a lag.'
EQUATION = 'T_m dp_g/dt = K_m sat(u, 0, 6 V) - p_g'
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
)


@inlined
def set_point_pa(voltage_v: float, gain_pa_per_v: float, atmosphere_pa: float) -> float:
    """Return the absolute pressure set point [Pa] of a command voltage, clipped to 0-6 V."""
    voltage = min(max(voltage_v, 0.0), MAX_VOLTAGE_V)
    return atmosphere_pa + gain_pa_per_v * voltage

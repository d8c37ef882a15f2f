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

"""Physical constants of the rig and the few unit conversions people need (SI inside)."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:      # shell completion reads units without numpy
    from pam_sim.annotations import Number

P_ATM_PA = 101_325.0          # atmospheric pressure; gauge = absolute - P_ATM_PA
LOWEST_PA, HIGHEST_PA = 0.5 * P_ATM_PA, 2e6     # absolute; of a muscle and its supply
EMPTY_PA = 10e3               # gauge; a muscle below is empty and holds no load up
NS_PER_S = 1_000_000_000     # stamps count nanoseconds
GRAVITY_M_PER_S2 = 9.80665
# Units of others: exact, or as NIST SP 811 has them.
PSI_PA, INCH_M, LBF_N, KGF_N = 6894.757293168361, 0.0254, 4.4482216152605, GRAVITY_M_PER_S2
GAS_CONSTANT_AIR = 287.05     # J/(kg K)
TEMPERATURE_K = 293.15        # air temperature of the isothermal models
RHO_REFERENCE = 1.185         # kg/m^3, reference density of ISO 6358
T_REFERENCE_K = 293.15        # K, reference temperature of ISO 6358
LEAST_ABSOLUTE_PA, MOST_ABSOLUTE_PA = 101e3, 1e7    # between them a range is one of pressures
_UNIT_OF_ENDING = (
    ('_m_per_s', 'm/s'), ('_pa_per_s', 'Pa/s'), ('_rad_per_s', 'rad/s'), ('_pa', 'Pa'),
    ('_hz', 'Hz'), ('_kg', 'kg'), ('_rad', 'rad'), ('_n_m', 'N m'), ('_k', 'K'), ('_ns', 'ns'),
    ('_s', 's'), ('_m', 'm'), ('_n', 'N'), ('_voltage', 'V'), ('_sec', 's'),
    ('_nanosec', 'ns'), ('_v', 'V'))


def gauge_pa(absolute_pa: 'Number') -> 'Number':
    """Return gauge pressure [Pa] of an absolute pressure [Pa]; scalar or array."""
    return absolute_pa - P_ATM_PA


def absolute_pa(gauge_pressure_pa: 'Number') -> 'Number':
    """Return absolute pressure [Pa] of a gauge pressure [Pa]; scalar or array."""
    return gauge_pressure_pa + P_ATM_PA


def gauge_kpa(absolute_pressure_pa: float) -> float:
    """Return gauge pressure [kPa] of an absolute pressure [Pa], for people to read."""
    return (absolute_pressure_pa - P_ATM_PA) * 1e-3


def unit_of(name: str) -> str:
    """Return the SI unit a value's name ends in; '1' for plain numbers."""
    return next((unit for ending, unit in _UNIT_OF_ENDING if name.endswith(ending)), '1')


def behind_number(unit: str) -> str:
    """Return what is written behind a number: a space and its unit; '' for the unit ``-``."""
    return '' if unit == '-' else f' {unit}'


def often(count: int) -> str:
    """Return how often something was, in words: ``never``, ``once``, ``3 times``."""
    return {0: 'never', 1: 'once'}.get(count, f'{count} times')


def counted(count: int, noun: str) -> str:
    """Return a number of things in words: ``1 rig``, ``3 rigs``."""
    return f'{count} {noun}' + 's' * (count != 1)


def allowed_range(lower: float, upper: float, unit: str = '', name: str = '') -> str:
    """
    Return a range in words, in the unit that is to be written: ``0.1 to 500 kg``.

    Numbers are told once more as people read them: gauge kPa.

    Parameters
    ----------
    lower, upper : float
        Bounds, SI.
    unit : str
        By default the one that ``name`` ends in.
    name : str
        Of the value; one with ``gauge`` in it is a gauge pressure.

    """
    unit = unit or unit_of(name).replace('1', '')
    numbers = f'{lower:g} to {upper:g}'
    if unit.lower() != 'pa':
        return f'{numbers} {unit}' if unit not in ('', '-', '1') else numbers
    if 'gauge' in name:
        return f'{numbers} Pa gauge ({1e-3 * lower:g} to {1e-3 * upper:g} kPa gauge)'
    if lower < LEAST_ABSOLUTE_PA or upper > MOST_ABSOLUTE_PA:
        return f'{numbers} Pa'          # a difference, a noise, a modulus
    return (f'{numbers} Pa absolute ({gauge_kpa(lower):.4g} to {gauge_kpa(upper):.4g} kPa '
            'gauge)')

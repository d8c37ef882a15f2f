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

P_ATM_PA = 101_325.0          # atmospheric pressure; gauge = absolute - P_ATM_PA
GRAVITY_M_PER_S2 = 9.80665
GAS_CONSTANT_AIR = 287.05     # J/(kg K)
TEMPERATURE_K = 293.15        # air temperature of the isothermal models
RHO_REFERENCE = 1.185         # kg/m^3, reference density of ISO 6358
T_REFERENCE_K = 293.15        # K, reference temperature of ISO 6358


def gauge_pa(absolute_pa):
    """Return gauge pressure [Pa] of an absolute pressure [Pa]; scalar or array."""
    return absolute_pa - P_ATM_PA


def absolute_pa(gauge_pressure_pa):
    """Return absolute pressure [Pa] of a gauge pressure [Pa]; scalar or array."""
    return gauge_pressure_pa + P_ATM_PA


def gauge_kpa(absolute_pressure_pa):
    """Return gauge pressure [kPa] of an absolute pressure [Pa], for people to read."""
    return (absolute_pressure_pa - P_ATM_PA) * 1e-3

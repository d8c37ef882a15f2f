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
Force proportional to pressure and to the length above a shortest one, eq. 4.2 and 4.3.

Z. Situm and S. Herceg (2008). The pressure follows the valve signal as a first
order lag; gain and time constant are the rig's own regulator.
"""

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled
from pam_sim.errors import InputError
from pam_sim.muscle.law import MuscleLaw, ParameterSet, Validity
from pam_sim.parameters import Parameter


def _chosen(bore_m: float, length_m: float, force_n: float, pressure_pa: float,
            shortest: float) -> ParameterSet:
    return ParameterSet(
        {'length_m': length_m, 'shortest_length_m': shortest * length_m,
         'k_p_n_per_pa_m': force_n / (pressure_pa * (1.0 - shortest) * length_m)},
        f'constant chosen for {force_n:g} N at {pressure_pa / 1e3:g} kPa at rest (data sheet) '
        f'and no force at {100 * (1 - shortest):g} % contraction; numbers of the paper not seen',
        Validity((0.0, pressure_pa), (0.0, 1.0 - shortest)), bore_m)


@compiled
def tension_n(gauge_pa: float, strain: float, par: np.record) -> float:
    """Return the formula's value [N], one point."""
    # Below the atmosphere both factors may be negative, and their product would pull.
    return par.k_p_n_per_pa_m * max(gauge_pa, 0.0) * (
        par.length_m * (1.0 - strain) - par.shortest_length_m)


class SitumHerceg(MuscleLaw):
    """F = Kp p (l - l_min), with p(s) / u(s) = Km / (Tm s + 1)."""

    NAME = 'situm_herceg'
    EQUATION = '4.2, 4.3'
    FORMULA = 'F = Kp p (l - l_min); p(s) / u(s) = Km / (Tm s + 1)'
    SOURCE = 'Situm and Herceg 2008, Design and control of a manipulator arm driven by PAMs'
    PARAMETERS = (
        Parameter('length_m', 'm', 0.300, 0.02, 9.0, 0.0, 'Length at rest.', 'chapter, L0'),
        Parameter('shortest_length_m', 'm', 0.240, 0.01, 9.0, 0.05,
                  'Length without force, l_min.', 'data sheet, 20 % contraction'),
        Parameter('k_p_n_per_pa_m', 'N/(Pa m)', 140.0 / (600e3 * 0.06), 1e-6, 10.0, 0.05,
                  'Force per pressure and length, Kp.', 'data sheet, 140 N at 600 kPa'),
        Parameter('k_m_pa_per_v', 'Pa/V', 100e3, 1e3, 1e6, 0.02,
                  'Gauge pressure per volt, Km.', 'chapter, 0 to 6 V for 0 to 600 kPa'),
        Parameter('t_m_s', 's', 0.060, 1e-4, 10.0, 0.02, 'Time constant Tm.', 'design value'),
    )
    SETS = {
        'dmsp_5': _chosen(0.005, 0.300, 140.0, 600e3, 0.80),
        'dmsp_10': _chosen(0.010, 0.250, 630.0, 800e3, 0.75),
        'dmsp_20': _chosen(0.020, 0.300, 1500.0, 600e3, 0.75),
        'dmsp_40': _chosen(0.040, 0.300, 6000.0, 600e3, 0.75),
    }
    CLAIMS = (2, 3, 4)

    def _check(self, where: str) -> None:
        if self.values['shortest_length_m'] >= self.values['length_m']:
            raise InputError(
                f'`shortest_length_m` is {self.values["shortest_length_m"]:g}; it must be below '
                f'`length_m`, {self.values["length_m"]:g} m', where)

    def pressure_rate_pa_per_s(self, signal_v: float, pressure_gauge_pa: float) -> float:
        """Return dp/dt [Pa/s] for a valve signal [V]: (Km u - p) / Tm; arrays broadcast."""
        return (self.values['k_m_pa_per_v'] * np.asarray(signal_v, float)
                - np.asarray(pressure_gauge_pa, float)) / self.values['t_m_s']

    def pressure_after_step_pa(self, time_s: ArrayLike, signal_v: ArrayLike,
                               initial_pa: float = 0.0) -> FloatArray:
        """Return the gauge pressure [Pa] a time after a step of the signal [V], exactly."""
        final = self.values['k_m_pa_per_v'] * np.asarray(signal_v, float)
        return final + (initial_pa - final) * np.exp(
            -np.asarray(time_s, float) / self.values['t_m_s'])


LAW = SitumHerceg

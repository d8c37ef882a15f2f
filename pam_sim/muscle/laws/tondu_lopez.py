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
Cylinder law with the contraction amplified by k, eq. 4.7.

B. Tondu and P. Lopez (2000), IEEE Control Systems Magazine 20(2). With
``k_rise`` = 0 the factor is constant, else k = k0 + k_rise exp(-p / k_pressure_pa).

The chapter prints k <= 1 and calls the contraction amplified by it; Tondu and
Lopez use k >= 1, which is what shortens the stroke. Both fit the bounds.
"""

import math
from typing import Any

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled
from pam_sim.muscle.law import MuscleLaw, ParameterSet, Validity
from pam_sim.muscle.laws.chou_hannaford import (
    check_angle, CYLINDER, GEOMETRY, GEOMETRY_SETS, pack_cylinder)
from pam_sim.parameters import Parameter
from pam_sim.records import record

_CONSTANT = {'k0': 1.25, 'k_rise': 0.0, 'k_pressure_pa': 235e3}


@compiled
def tension_n(gauge_pa: float, strain: float, par: np.record) -> float:
    """Return the formula's value [N], one point."""
    factor = par.k0 + par.k_rise * math.exp(-gauge_pa * par.inverse_k_pressure_per_pa)
    left = max(0.0, 1.0 - factor * strain)
    # Below the atmosphere both factors may be negative, and their product would pull.
    return max(gauge_pa, 0.0) * par.area_m2 * (par.a * left * left - par.b)


@compiled
def volume_m3(gauge_pa: float, strain: float, par: np.record) -> float:
    """
    Return the volume [m^3] whose virtual work is the force, one point.

    The integral of F / p over the way from rest, from the cylinder at rest
    on; for a pressure-dependent k taken at constant pressure.
    """
    factor = par.k0 + par.k_rise * math.exp(-gauge_pa * par.inverse_k_pressure_per_pa)
    left = max(0.0, 1.0 - factor * strain)
    return par.area_m2 * par.length_m * (
        1.0 + par.a * (1.0 - left * left * left) / (3.0 * factor) - par.b * strain)


class TonduLopez(MuscleLaw):
    """
    F = p pi D0^2/4 (3 (1 - k eps)^2 / tan^2 a0 - 1 / sin^2 a0), eq. 4.7.

    1 - k eps ends at 0: beyond k eps = 1 the square would rise again.
    """

    NAME = 'tondu_lopez'
    EQUATION = '4.7'
    FORMULA = ('F = p (pi D0^2 / 4) (3 max(0, 1 - k eps)^2 / tan^2 a0 - 1 / sin^2 a0), '
               'k = k0 + k_rise exp(-p / k_pressure_pa)')
    SOURCE = 'Tondu and Lopez 2000, IEEE Control Systems Magazine 20(2)'
    PARAMETERS = GEOMETRY + (
        Parameter('k0', '-', 1.0, 0.3, 5.0, 0.05, 'Factor k at high pressure.', SOURCE),
        Parameter('k_rise', '-', 9.84, 0.0, 60.0, 0.05,
                  'Rise of k towards zero pressure; 0 for a constant k.', 'fit to a scaled map'),
        Parameter('k_pressure_pa', 'Pa', 235e3, 10e3, 2e6, 0.05,
                  'Pressure over which the rise decays.', 'fit to a scaled map'),
    )
    SETS = {
        'dmsp_5': ParameterSet(
            {'length_m': 0.300, 'diameter_m': 8.97e-3, 'braid_angle_rad': math.radians(33.6),
             'k0': 1.0, 'k_rise': 9.84, 'k_pressure_pa': 235e3},
            'fit of the pressure-dependent k to the scaled DMSP-10-250 map of the rig, '
            '4.7 N RMSE; no DMSP-5 force data exist', Validity((50e3, 600e3), (0.0, 0.25)), 0.005),
        **{f'{name}_constant_k': ParameterSet(
            {**GEOMETRY_SETS[name].values, **_CONSTANT},
            GEOMETRY_SETS[name].rests_on + '; k 1.25 as used for a McKibben arm',
            GEOMETRY_SETS[name].validity, GEOMETRY_SETS[name].bore_m)
           for name in ('dmsp_5', 'dmsp_10', 'dmsp_20', 'dmsp_40')},
    }
    CLAIMS = (1, 2, 3, 4)
    PACKED = record(*CYLINDER, 'length_m', 'k0', 'k_rise', 'inverse_k_pressure_per_pa')

    def _check(self, where: str) -> None:
        check_angle(self.values, where)

    def k(self, pressure_gauge_pa: FloatArray) -> FloatArray:
        """Return the factor on the contraction at a gauge pressure [Pa]; arrays pass through."""
        return self.values['k0'] + self.values['k_rise'] * np.exp(
            -np.asarray(pressure_gauge_pa, float) / self.values['k_pressure_pa'])

    def pack(self) -> dict[str, Any]:
        """Return the cylinder, k0, k_rise and 1 / k_pressure [1/Pa]."""
        value = self.values
        return {**pack_cylinder(value), 'k0': value['k0'],
                'k_rise': value['k_rise'],
                'inverse_k_pressure_per_pa': 1.0 / value['k_pressure_pa']}


LAW = TonduLopez

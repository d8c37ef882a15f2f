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
Contractile element, spring and damper in parallel, eq. 4.1.

D. W. Repperger et al. (1999); pressure-dependent after D. B. Reynolds et al.
(2003), Ann. Biomed. Eng. 31(3), 310-317, doi 10.1114/1.1554921:
M x'' + B x' + K x = F_ce - M g, x the contraction. Every coefficient is linear
in gauge pressure; the spring's slope may change once, and it may stiffen with x.
"""

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled
from pam_sim.errors import InputError
from pam_sim.muscle.law import MuscleLaw, ParameterSet, Validity
from pam_sim.parameters import Parameter
from pam_sim.units import GRAVITY_M_PER_S2


_SOURCE = 'Repperger et al. 1999; Reynolds et al. 2003, doi 10.1114/1.1554921'
_KPA = 1e-3          # per Pa; the published numbers are per kPa and per mm


def _number(name: str, unit: str, nominal: float, lower: float, upper: float,
            text: str) -> Parameter:
    return Parameter(name, unit, nominal, lower, upper, 0.05, text, _SOURCE)


@compiled
def tension_n(gauge_pa: float, strain: float, par: np.record) -> float:
    """Return F_ce - K x [N], one point."""
    x = strain * par.length_m
    bend = par.k_pressure_pa
    spring = (par.k0_n_per_m + par.k1_n_per_m_pa * min(gauge_pa, bend)
              + par.k2_n_per_m_pa * max(gauge_pa - bend, 0.0) + par.k_x_n_per_m2 * x)
    return par.f0_n + par.f1_n_per_pa * gauge_pa - spring * x


@compiled
def damper_force_n(velocity_m_per_s: float, gauge_pa: float, strain: float,
                   par: np.record) -> float:
    """Return B v [N], one point; never pushes the way the muscle moves."""
    if velocity_m_per_s >= 0.0:
        damper = par.b0_n_s_per_m + par.b1_n_s_per_m_pa * gauge_pa
    else:
        damper = par.c0_n_s_per_m + par.c1_n_s_per_m_pa * gauge_pa
    return max(0.0, damper) * velocity_m_per_s


class Repperger(MuscleLaw):
    """F = F_ce(p) - K(p, x) x - B(p, v) v, eq. 4.1."""

    NAME = 'repperger'
    EQUATION = '4.1'
    FORMULA = ('F = f0 + f1 p - K x - B v, x = eps L0, '
               'K = k0 + k1 min(p, p_b) + k2 max(p - p_b, 0) + k_x x, '
               'B = b0 + b1 p contracting, c0 + c1 p relaxing')
    SOURCE = _SOURCE
    PARAMETERS = (
        Parameter('length_m', 'm', 0.250, 0.02, 9.0, 0.0,
                  'Length at rest; turns contraction into x.', 'assumed'),
        _number('f0_n', 'N', 179.2, -2000.0, 2000.0, 'Contractile force at no pressure.'),
        _number('f1_n_per_pa', 'N/Pa', 1.39e-3, 1e-6, 0.1, 'Contractile force per pressure.'),
        _number('k0_n_per_m', 'N/m', 5710.0, -1e6, 1e6, 'Spring at no pressure.'),
        _number('k1_n_per_m_pa', 'N/(m Pa)', 0.0307, -10.0, 10.0, 'Spring per pressure, low.'),
        _number('k2_n_per_m_pa', 'N/(m Pa)', 0.0307, -10.0, 10.0, 'Spring per pressure, high.'),
        _number('k_pressure_pa', 'Pa', 314e3, 0.0, 2e6, 'Pressure where the slope changes.'),
        _number('k_x_n_per_m2', 'N/m^2', 0.0, -1e7, 1e7, 'Stiffening with x.'),
        _number('b0_n_s_per_m', 'N s/m', 1010.0, 0.0, 1e5, 'Damper contracting.'),
        _number('b1_n_s_per_m_pa', 'N s/(m Pa)', 6.91e-3, -1.0, 1.0, 'Its slope.'),
        _number('c0_n_s_per_m', 'N s/m', 600.0, 0.0, 1e5, 'Damper relaxing.'),
        _number('c1_n_s_per_m_pa', 'N s/(m Pa)', -0.803e-3, -1.0, 1.0, 'Its slope.'),
    )
    SETS = {
        'reynolds_2003': ParameterSet(
            {}, 'unverified: recalled coefficients attributed to Reynolds et al. 2003, no source '
            'at hand; only the pressure range is confirmed, by the abstract; a hand-made muscle, '
            'length assumed', Validity((207e3, 621e3), (0.0, 0.25))),
        'two_slopes': ParameterSet(
            {'length_m': 0.200, 'f0_n': 44.6, 'f1_n_per_pa': 2.91 * _KPA,
             'k0_n_per_m': 32.7e3, 'k1_n_per_m_pa': -0.0321, 'k2_n_per_m_pa': 0.0179,
             'k_pressure_pa': 314e3, 'b0_n_s_per_m': 2900.0, 'b1_n_s_per_m_pa': 0.0,
             'c0_n_s_per_m': 1570.0, 'c1_n_s_per_m_pa': 0.0},
            'spring and force as found in public code for a larger fluidic muscle; dampers and '
            'length assumed', Validity((150e3, 550e3), (0.0, 0.25))),
    }
    CLAIMS = (2, 3, 4)

    def _check(self, where: str) -> None:
        low, high = self.validity.pressure_gauge_pa
        pressure = np.array([low, high])
        if np.any(self.damper_n_s_per_m(pressure, 1.0) < 0.0) or np.any(
                self.damper_n_s_per_m(pressure, -1.0) < 0.0):
            raise InputError('the damper B must not be negative in the pressure range', where)
        tension = self._tension_n(np.linspace(low, high, 49)[:, None],
                                  np.linspace(0.0, self.validity.strain[1], 49))
        if np.any((np.diff(tension, axis=1) >= 0.0) & (tension[:, 1:] > 0.0)):
            raise InputError('the spring K must make force fall with contraction wherever the '
                             'muscle pulls', where)
        if np.any((np.diff(tension, axis=0) <= 0.0) & (tension[1:] > 0.0)):
            raise InputError('these coefficients let force fall with pressure while the muscle '
                             'pulls; raise `f1_n_per_pa` or lower the slopes of K', where)

    def spring_n_per_m(self, pressure_gauge_pa: FloatArray,
                       contraction_m: ArrayLike) -> FloatArray:
        """Return K [N/m] at a gauge pressure [Pa] and contraction [m]; arrays broadcast."""
        value = self.values
        pressure = np.asarray(pressure_gauge_pa, dtype=float)
        bend = value['k_pressure_pa']
        return (value['k0_n_per_m'] + value['k1_n_per_m_pa'] * np.minimum(pressure, bend)
                + value['k2_n_per_m_pa'] * np.maximum(pressure - bend, 0.0)
                + value['k_x_n_per_m2'] * np.asarray(contraction_m, dtype=float))

    def damper_n_s_per_m(self, pressure_gauge_pa: ArrayLike,
                         velocity_m_per_s: ArrayLike) -> FloatArray:
        """Return B [N s/m]: one value contracting (v >= 0), another relaxing; arrays broadcast."""
        value, pressure = self.values, np.asarray(pressure_gauge_pa, dtype=float)
        return np.where(
            np.asarray(velocity_m_per_s) >= 0.0,
            value['b0_n_s_per_m'] + value['b1_n_s_per_m_pa'] * pressure,
            value['c0_n_s_per_m'] + value['c1_n_s_per_m_pa'] * pressure)

    def moving_force_n(self, pressure_gauge_pa: ArrayLike, strain: ArrayLike,
                       velocity_m_per_s: ArrayLike, outside: str = 'warn') -> FloatArray:
        """
        Return the tension [N] of the moving muscle, never negative; arrays broadcast.

        Raises
        ------
        InputError
            As ``force_n``, or a velocity that is not finite.

        """
        pressure, shortened = self._judged(pressure_gauge_pa, strain, outside)
        velocity = np.asarray(velocity_m_per_s, dtype=float)
        if not np.all(np.isfinite(velocity)):
            raise InputError('must be finite', 'velocity_m_per_s')
        return np.maximum(0.0, self._tension_n(pressure, shortened)
                          - self.damper_n_s_per_m(pressure, velocity) * velocity)[()]

    def acceleration_m_per_s2(self, pressure_gauge_pa: ArrayLike, contraction_m: ArrayLike,
                              velocity_m_per_s: ArrayLike, mass_kg: float) -> FloatArray:
        """Return x'' [m/s^2] of a hanging mass [kg], eq. 4.1; contraction positive, no stops."""
        force = self.moving_force_n(
            pressure_gauge_pa, np.asarray(contraction_m) / self.values['length_m'],
            velocity_m_per_s, 'allow')
        return force / mass_kg - GRAVITY_M_PER_S2


LAW = Repperger

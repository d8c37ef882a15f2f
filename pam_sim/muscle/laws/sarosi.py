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
Six coefficients in pressure and contraction, after Sarosi: the force map of the nominal rig.

J. Sarosi (2012), "New approximation algorithm for the force of fluidic
muscles", IEEE SACI. The chapter does not have it. No published DMSP-5 force data exist: the
coefficients of that size follow the measured map of a DMSP-10-250 scaled to the
data sheet.
"""

import math

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import FloatArray
from pam_sim.compiled import inlined
from pam_sim.errors import InputError
from pam_sim.muscle.law import MuscleLaw, ParameterSet, Validity
from pam_sim.parameters import Parameter

# Of the DMSP-5-300: P gauge kPa, E contraction %, F newton.
_DMSP_5 = (-0.00680486, 46.3339, -0.42779, -0.00817055, 0.256907, -56.3953)
# Fits to the measured maps of Martens and Boblan 2017 (pam_sim/muscle/fit.py), SI.
_DMSP_10_MAP = (-2.421150e-05, 164.85488, -42.779040, -2.9070609e-03, 9.1406841e-04, -200.65288)
_DMSP_20_MAP = (1.2213924e-04, 421.05634, -56.729761, -8.7174119e-03, 2.6795981e-03, -310.14613)
_AT_REST_20_N = 1791.9526      # of that fit at 600 kPa
_MAP = ('fit to the measured map of a {}, Martens and Boblan 2017, doi 10.3390/act6040033, '
        'within {} % of the largest force (RMSE, in sample)')
_NAMES = ('a1_n_per_pa', 'a2_n', 'a3', 'a4_n_per_pa', 'a5_n_per_pa', 'a6_n')
_SOURCE = 'Sarosi 2012, New approximation algorithm for the force of fluidic muscles'
_PUBLISHED = 'published fit as quoted in a public model comparison; original paper not seen'


def _si(coefficients: tuple[float, ...], pressure_unit_pa: float) -> dict[str, float]:
    """Return the SI values of coefficients stated for a pressure unit and percent."""
    a1, a2, a3, a4, a5, a6 = coefficients
    return dict(zip(_NAMES, (a1 / pressure_unit_pa, a2, 100.0 * a3,
                             100.0 * a4 / pressure_unit_pa, a5 / pressure_unit_pa, a6)))


def _scaled(coefficients: tuple[float, ...], factor: float) -> dict[str, float]:
    """Return the SI values of a map with every force multiplied."""
    return {name: value if name == 'a3' else factor * value
            for name, value in zip(_NAMES, coefficients)}


@inlined
def tension_n(gauge_pa: float, strain: float, par: np.record) -> float:
    """Return the formula's value [N], one point."""
    return ((par.a1_n_per_pa * gauge_pa + par.a2_n) * math.exp(par.a3 * strain)
            + (par.a4_n_per_pa * strain + par.a5_n_per_pa) * gauge_pa + par.a6_n)


class Sarosi(MuscleLaw):
    """F = (a1 p + a2) exp(a3 eps) + a4 eps p + a5 p + a6; p gauge, SI."""

    NAME = 'sarosi'
    EQUATION = 'none in the chapter'
    FORMULA = 'F = (a1 p + a2) exp(a3 eps) + a4 eps p + a5 p + a6'
    SOURCE = _SOURCE
    PARAMETERS = tuple(
        Parameter(name, unit, nominal, lower, upper, 0.02, text, _SOURCE)
        for name, unit, nominal, lower, upper, text in (
            ('a1_n_per_pa', 'N/Pa', _DMSP_5[0] / 1e3, -0.01, 0.01,
             'Pressure part of the decaying term.'),
            ('a2_n', 'N', _DMSP_5[1], 0.0, 5000.0, 'Force of the decaying term.'),
            ('a3', '-', 100.0 * _DMSP_5[2], -500.0, -1.0, 'Decay with contraction.'),
            ('a4_n_per_pa', 'N/Pa', _DMSP_5[3] / 10.0, -1.0, 0.0,
             'Loss of pressure gain with contraction.'),
            ('a5_n_per_pa', 'N/Pa', _DMSP_5[4] / 1e3, 1e-6, 0.1, 'Pressure gain at rest.'),
            ('a6_n', 'N', _DMSP_5[5], -5000.0, 1000.0, 'Offset.'),
        ))
    SETS = {
        'dmsp_5': ParameterSet(
            _si(_DMSP_5, 1e3),
            'the force map of the rig: measured map of a DMSP-10-250 fitted and scaled to 140 N '
            'at 600 kPa; no DMSP-5 force data exist, good to 15 %',
            Validity((50e3, 600e3), (0.0, 0.25)), 0.005),
        'dmsp_10': ParameterSet(
            _si((-9.2194029, 203.7012413, -0.34221042, -3.2255991, 109.2038216, -208.372034),
                1e5), _PUBLISHED, Validity((0.0, 600e3), (0.0, 0.25)), 0.010),
        'dmsp_20_200n': ParameterSet(
            _si((-4.00180705, 292.4620246, -0.32930845, -9.33564098, 294.0538256, -280.498151),
                1e5), _PUBLISHED + '; named for 200 N', Validity((0.0, 600e3), (0.0, 0.27)),
            0.020),
        'dmsp_20_400n': ParameterSet(
            _si((-4.35573, 281.2237, -0.32866, -9.27035, 302.20107, -263.69185), 1e5),
            _PUBLISHED + '; named for 400 N', Validity((0.0, 600e3), (0.0, 0.28)), 0.020),
    }
    SETS['dmsp_10_250_map'] = ParameterSet(
        dict(zip(_NAMES, _DMSP_10_MAP)), _MAP.format('DMSP-10-250', 0.25),
        Validity((50e3, 650e3), (0.0, 0.208)), 0.010)
    SETS['dmsp_20_300_map'] = ParameterSet(
        dict(zip(_NAMES, _DMSP_20_MAP)), _MAP.format('DMSP-20-300', 0.38),
        Validity((35e3, 675e3), (0.0133, 0.26)), 0.020)
    SETS['dmsp_40'] = ParameterSet(
        _scaled(_DMSP_20_MAP, 6000.0 / _AT_REST_20_N),
        'the fitted DMSP-20-300 map scaled to the data sheet, 6000 N at 600 kPa at rest; no '
        'DMSP-40 force data at hand, the shape is that of the smaller muscle',
        Validity((35e3, 600e3), (0.0, 0.25)), 0.040)
    CLAIMS = (2, 3, 4)

    def _check(self, where: str) -> None:
        # The rules hold where force rises with pressure and falls with contraction.
        a1, a2, a3, a4, a5, _ = self.values.values()
        top = self.validity.pressure_gauge_pa[1]
        if min(a2, a1 * top + a2) < 0.0:
            raise InputError(
                f'`a1_n_per_pa` and `a2_n` let force rise with contraction below {top:g} Pa; '
                f'a1 p + a2 must not be negative', where)
        strain = np.linspace(0.0, self.validity.strain[1], 101)
        pulls = self._tension_n(np.asarray(top), strain) > 0.0
        if np.any((a1 * np.exp(a3 * strain) + a4 * strain + a5)[pulls] <= 0.0):
            raise InputError('these coefficients let force fall with pressure while the muscle '
                             'pulls; raise `a5_n_per_pa` or `a1_n_per_pa`', where)

    def _tension_n(self, pressure: FloatArray, strain: FloatArray) -> FloatArray:
        # Arrays of the nominal rig are asked for often, also where numba is not loaded.
        a1, a2, a3, a4, a5, a6 = self.values.values()
        return ((a1 * pressure + a2) * np.exp(a3 * strain)
                + (a4 * strain + a5) * pressure + a6)

    def pressure_gauge_pa(self, force_n: ArrayLike,
                          strain: ArrayLike) -> FloatArray:
        """
        Return the gauge pressure [Pa] that gives a force; arrays broadcast.

        Exact, since the law is linear in pressure; negative where the muscle
        would have to be sucked.
        """
        a1, a2, a3, a4, a5, a6 = self.values.values()
        strain = np.asarray(strain, dtype=float)
        decay = np.exp(a3 * strain)
        return (np.asarray(force_n, float) - a2 * decay - a6) / (a1 * decay + a4 * strain + a5)

    def holding_pressure_pa(self, force_n: ArrayLike, strain: ArrayLike,
                            upper_pa: float = 2e6) -> FloatArray:
        """Return the gauge pressure [Pa] that holds a tension, 0 or more; see MuscleLaw."""
        pressure = self.pressure_gauge_pa(force_n, strain)
        a1, _, a3, a4, a5, _ = self.values.values()
        gain = a1 * np.exp(a3 * np.asarray(strain, float)) + a4 * np.asarray(strain, float) + a5
        held = ~((gain <= 0.0) | (pressure > upper_pa))         # what is NaN stays so
        return np.where(held, np.maximum(pressure, 0.0), np.inf)[()]


LAW = Sarosi

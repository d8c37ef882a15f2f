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
The force at a length that a force map does not hold: between which bounds it probably lies.

Near the full length the force rises steeply. How steeply, shorter lengths do not tell: laws that
fit them equally well part there. So laws of different form are fitted. Two have no steep term
(Tondu and Lopez, Repperger). Two have the steep term of another measured muscle, its force,
contraction and zero of pressure scaled. Lengths were left out of the fit to test this, see
``benchmarks/isometric_records.py`` and ``benchmarks/held_lengths.py``. In 10 of 11 tests the force
lay between the bounds. In the other one it was 1654 N, 4 N above them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.muscle.fit import CASES, fit_law, residuals_n
from pam_sim.muscle.force_maps import ForceMap
from pam_sim.muscle.registry import make_law
from scipy.optimize import least_squares

LAWS = 'tondu_lopez, k(p)', 'repperger, K(p)'
SHAPES = 'dmsp_10_250_map', 'dmsp_20_300_map'
NEAR = 0.005                 # of the length: a map that begins nearer holds the full length
LEAST_LENGTHS = 3            # below, no law is determined
FARTHEST = 2.0, 1.0, 2e5     # logarithms of force and contraction, zero of the pressure [Pa]
WIDENED = 3.0                # times what a law leaves of the points it was fitted to (rms)
HELD, JUDGED = 10, 11        # such bounds that held the measured force; all that were tested

Formula = Callable[[FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class Beyond:
    """
    The force at a length that was not measured.

    Parameters
    ----------
    pressure_gauge_pa : float
        The highest pressure of the map.
    strain : float
        Contraction there, as a fraction of the length at rest.
    nearest_strain : float
        The nearest contraction that was measured.
    low_n, high_n : float
        Bounds between which the force probably lies. They are no limits.

    """

    pressure_gauge_pa: float
    strain: float
    nearest_strain: float
    low_n: float
    high_n: float

    def text(self, length_m: float) -> str:
        """Return what a person should know, for a length at rest [m]."""
        measured_mm, there_mm = (1e3 * length_m * (1.0 - strain) for strain in (
            self.nearest_strain, self.strain))
        return (f'The longest measured length is {measured_mm:.1f} mm. The force at '
                f'{there_mm:.1f} mm is not known from it: laws that fit the table give '
                f'{self.low_n:.0f} to {self.high_n:.0f} N at '
                f'{1e-3 * self.pressure_gauge_pa:.0f} kPa. Of {JUDGED} such ranges that were '
                f'tested, {HELD} held the measured force. Measure at the longest length that you '
                'will use.')


def beyond(points: ForceMap, strain: float = 0.0, apart_from: str = '') -> Beyond | None:
    """
    Return the bounds of the force at a longer length than a force map holds.

    Parameters
    ----------
    points : ForceMap
        What was measured.
    strain : float
        Contraction at that length.
    apart_from : str
        A shape that is not used, because it is that of this muscle.

    Returns
    -------
    Beyond or None
        None where the map holds that length, or no law fits it.

    """
    pulling = np.unique(points.strain[~points.censored])
    if pulling.size < LEAST_LENGTHS or pulling[0] - strain < NEAR:
        return None
    highest_pa = float(points.pressure_gauge_pa.max())
    lows, highs = [], []
    for formula in _fitted(points, apart_from):
        error = residuals_n(formula(points.pressure_gauge_pa, points.strain), points)
        doubt = WIDENED * float(np.sqrt(np.mean(error[~points.censored] ** 2)))
        force = float(formula(np.array([highest_pa]), np.array([strain]))[0])
        lows.append(force - doubt)
        highs.append(force + doubt)
    if not lows:
        return None
    return Beyond(highest_pa, strain, float(pulling[0]), max(min(lows), 0.0), max(highs))


def _fitted(points: ForceMap, apart_from: str) -> list[Formula]:
    found: list[Formula] = []
    for label in LAWS:
        name, muscle, fixed = CASES[label]
        try:
            found.append(fit_law(name, points, muscle, fixed).law._tension_n)
        except InputError:           # its best fit is no muscle
            continue
    return found + [scaled_shape(shape, points) for shape in SHAPES if shape != apart_from]


def scaled_shape(shape: str, points: ForceMap) -> Formula:
    """
    Return the force [N] of another muscle, scaled to some points.

    Parameters
    ----------
    shape : str
        A set of the law ``sarosi``.
    points : ForceMap
        What force, contraction and zero of the pressure are fitted to.

    Returns
    -------
    callable
        Gauge pressure [Pa] and contraction (fraction) in, force [N] out.

    """
    law, largest_n = make_law('sarosi', muscle=shape), float(points.force_n.max())
    top_n = float(law.formula_n(points.pressure_gauge_pa.max(), points.strain.min()))

    def force_n(x: FloatArray, pressure_pa: FloatArray, strain: FloatArray) -> FloatArray:
        return np.exp(x[0]) * law._tension_n(pressure_pa - x[2], strain * np.exp(x[1]))

    def errors(x: FloatArray) -> FloatArray:
        return residuals_n(force_n(x, points.pressure_gauge_pa, points.strain), points) / largest_n

    start = np.log(largest_n / max(top_n, 1e-3 * largest_n))
    done = least_squares(errors, [start, 0.0, 0.0], bounds=(
        [start - FARTHEST[0], -FARTHEST[1], -FARTHEST[2]],
        [start + FARTHEST[0], FARTHEST[1], FARTHEST[2]]), x_scale=[1.0, 1.0, 1e5])
    return lambda pressure_pa, strain: force_n(done.x, pressure_pa, strain)

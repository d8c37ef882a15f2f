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
Fit a force law to few lengths: near the shape of another measured muscle.

Static points at three or four lengths do not determine the six coefficients of the law ``sarosi``.
A free fit follows them, and may be anywhere at a length that was not measured. Here force and
contraction of a measured map are scaled freely. Each coefficient may leave that shape by about a
half, as far as the points ask for it. What the points of a length differ from that law is added,
as a curve over pressure; between lengths it lies on straight lines. ``benchmarks/held_lengths.py``
holds it against free fits.
"""

from collections.abc import Callable
import contextlib
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.muscle.fit import checked, Fit, residuals_n, UncheckedLaw
from pam_sim.muscle.force_maps import ForceMap, some_points
from pam_sim.muscle.laws.sarosi import Sarosi
from scipy.optimize import least_squares

SHAPE = 'dmsp_10_250_map'
LEAST_LENGTHS = 2            # below, force and contraction cannot both be scaled
# Standard deviations: of the logarithm of a coefficient, and of the points of a length as a share
# of the largest force. They are off together, so that more of them tell no more.
COEFFICIENT_SD, LENGTH_SD = 0.5, 0.04
SCALE_SD = 1.0               # of the logarithms of force and contraction: nearly free
STIFFER = 1.0, 4.0, 16.0     # times, until the coefficients make a muscle
# Of the curve over pressure: points for each degree, the highest degree, and to how many digits
# of the highest pressure points count as one.
POINTS_PER_DEGREE, MOST_DEGREE, APART = 4, 2, 2


def fit_near_shape(points: ForceMap) -> Fit:
    """
    Return the Fit of the law ``sarosi`` near the shape of a measured map; deterministic.

    Parameters
    ----------
    points : ForceMap
        Static points at two lengths or more.

    Raises
    ------
    InputError
        Fewer lengths, no force, or coefficients that make no muscle.

    """
    pulls = ~points.censored
    lengths = np.unique(points.strain[pulls]).size
    if lengths < LEAST_LENGTHS:
        raise InputError(f'holds forces at {lengths} lengths; {LEAST_LENGTHS} or more are needed',
                         points.name)
    base = np.array(list(Sarosi.SETS[SHAPE].values.values()))
    largest_n = float(points.force_n.max())
    at_most = Sarosi(None, SHAPE).formula_n(points.pressure_gauge_pa, points.strain)
    begin = math.log(largest_n / max(float(np.max(at_most)), 1e-3 * largest_n))
    refusal = InputError('no coefficients', points.name)
    for times in STIFFER:
        fitted = _fitted(points, base, begin, largest_n, COEFFICIENT_SD / times)
        try:
            return checked(Sarosi(fitted), points)
        except InputError as error:
            refusal = error
    raise refusal


@dataclass(frozen=True)
class Curve:
    """
    What the points of a length differ from a law: a polynomial over pressure.

    Parameters
    ----------
    strain : float
        Contraction at that length.
    range_pa : tuple of float
        Lowest and highest gauge pressure of its points; beyond, the ends hold.
    coefficients : numpy.ndarray
        Of the polynomial over the pressure in units of the highest, N.

    """

    strain: float
    range_pa: tuple[float, float]
    coefficients: FloatArray

    def difference_n(self, gauge_pa: FloatArray) -> FloatArray:
        """Return the difference [N] at a gauge pressure [Pa]."""
        low, high = self.range_pa
        return np.polyval(self.coefficients, np.clip(gauge_pa, low, high) / high)


@dataclass(frozen=True)
class NearShape:
    """
    A force law near a measured shape, corrected by what the points differ from it.

    Parameters
    ----------
    fit : Fit
        The law.
    curves : list of Curve
        By contraction, of the lengths at which the muscle pulled.
    rmse_n, rmse_percent : float
        What the points that pull are off the corrected law, and as a share of the largest force.

    """

    fit: Fit
    curves: list[Curve]
    rmse_n: float = math.nan
    rmse_percent: float = math.nan

    def force_n(self, gauge_pa: ArrayLike, strain: ArrayLike) -> FloatArray:
        """Return the force [N]; arrays broadcast."""
        pressure, contraction = np.broadcast_arrays(
            np.asarray(gauge_pa, float), np.asarray(strain, float))
        force = self.fit.law._tension_n(pressure, contraction)
        at = np.array([curve.strain for curve in self.curves])
        # Share of each length at a point: straight lines between neighbours.
        for curve, own in zip(self.curves, np.eye(at.size)):
            force = force + np.interp(contraction, at, own) * curve.difference_n(pressure)
        return np.maximum(force, 0.0)


def near_shape(points: ForceMap) -> NearShape:
    """Return the NearShape of static points; errors as of ``fit_near_shape``."""
    fit = fit_near_shape(points)
    curves = []
    for strain in np.unique(points.strain[~points.censored]):
        own = some_points(points, (points.strain == strain) & ~points.censored)
        gauge, high = own.pressure_gauge_pa, max(float(own.pressure_gauge_pa.max()), 1.0)
        apart = np.unique(np.round(gauge / high, APART)).size
        degree = min(gauge.size // POINTS_PER_DEGREE, MOST_DEGREE, apart - 1)
        left = own.force_n - fit.law._tension_n(gauge, own.strain)
        curves.append(Curve(float(strain), (float(gauge.min()), high),
                            np.polyfit(gauge / high, left, degree)))
    pulled = some_points(points, ~points.censored)
    rmse_n = _off_n(NearShape(fit, curves), pulled)
    return NearShape(fit, curves, rmse_n, 100.0 * rmse_n / float(points.force_n.max()))


def off_near_shape_n(others: ForceMap, points: ForceMap) -> float:
    """Return how far points are off ``near_shape`` of others, rms [N]; errors as of that."""
    return _off_n(near_shape(others), points)


def left_out_percent(points: ForceMap, off_n: Callable[[ForceMap, ForceMap], float] =
                     off_near_shape_n) -> list[float]:
    """
    Return for every length, by contraction, how far what is fitted to the others is off there.

    Root mean square over its points that pull, in percent of the largest force of all. Not a
    number at a length without one, and where the other lengths determine no law.

    Parameters
    ----------
    points : ForceMap
        Static points.
    off_n : callable
        Takes the points of the other lengths and of this one, and returns the error (rms) [N].

    """
    largest_n, found = float(points.force_n.max()), []
    for strain in np.unique(points.strain):
        left = points.strain == strain
        pulled = some_points(points, left & ~points.censored)
        error_n = math.nan
        if pulled.force_n.size:
            with contextlib.suppress(InputError):       # the others determine none
                error_n = off_n(some_points(points, ~left), pulled)
        found.append(100.0 * error_n / largest_n)
    return found


def _off_n(found: NearShape, points: ForceMap) -> float:
    """Return how far points are off, rms [N]."""
    error = found.force_n(points.pressure_gauge_pa, points.strain) - points.force_n
    return float(np.sqrt(np.mean(error ** 2)))


def _fitted(points: ForceMap, base: FloatArray, begin: float, largest_n: float,
            coefficient_sd: float) -> dict[str, float]:
    """Return the coefficients of the best fit by their names."""
    names = [p.name for p in Sarosi.PARAMETERS]
    law = UncheckedLaw(Sarosi, dict(zip(names, base.tolist())), None)
    share = math.sqrt(np.unique(points.strain).size / points.force_n.size) / (
        largest_n * LENGTH_SD)

    def coefficients(x: FloatArray) -> dict[str, float]:
        a1, a2, a3, a4, a5, a6 = (base * np.exp(x[2:])).tolist()
        force, contraction = np.exp(x[:2]).tolist()
        return dict(zip(names, (force * a1, force * a2, contraction * a3,
                                force * contraction * a4, force * a5, force * a6)))

    def errors(x: FloatArray) -> FloatArray:
        law.values.update(coefficients(x))
        return np.concatenate([
            share * residuals_n(law.tension_n(points), points), [(x[0] - begin) / SCALE_SD],
            [x[1] / SCALE_SD], x[2:] / coefficient_sd])

    return coefficients(least_squares(errors, [begin, *np.zeros(7)]).x)

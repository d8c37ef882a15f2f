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

"""From points to the chapter's surfaces P(m_air, load), eps(P, load), F(eps, P)."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.characterise.dimensions import Dimensions
from pam_sim.characterise.monotone import monotone_surface
from pam_sim.characterise.points import (
    load_grid, not_lifted, Points, with_enough_pressures, with_no_load)
from pam_sim.errors import InputError
from pam_sim.muscle.laws.lookup import Lookup
from pam_sim.muscle.lookup_table import LookupTable
from pam_sim.muscle.registry import make_law
from pam_sim.short_repr import short_repr
from scipy.interpolate import PchipInterpolator, RegularGridInterpolator

STRAIN_STEP = 0.01          # of the tabulated F(eps, P)
REST_SIGMAS = 5.0           # a contraction of fewer standard deviations of its noise is rest
_DIGITS_STRAIN, _DIGITS_MASS = 7, 13     # far below any uncertainty; keeps files short


@short_repr
@dataclass(frozen=True)
class Surfaces:
    """
    Surfaces of one muscle with standard uncertainties (coverage factor 1).

    Parameters
    ----------
    pressure_gauge_pa, load_n : ndarray
        Axes, shapes (P,), (L,).
    strain, strain_u : ndarray, shape (P, L)
        eps(P, load) as a fraction.
    parts : dict of str to ndarray, shape (P, L)
        What ``strain_u`` is made of: noise, hysteresis, settling, load, reading, monotone.
    half_distance : ndarray, shape (P, L)
        Half the distance of the branches; NaN where only one was measured.
    force_strain : ndarray, shape (E,)
        Contractions of the next two.
    force_n, force_u_n : ndarray, shape (P, E)
        F(eps, P); NaN where only loads beyond the largest one would reach.
    air_mass_kg, pressure_u_pa : ndarray, shape (P, L), or None
        Air at every point, and the uncertainty of P(m_air, load) there; None
        where the volume of the muscle is not known.
    monotone : dict
        How many points the monotone fit moved, and how far at most and rms.
    unknown : str
        A sentence on pressures at which no load was lifted, '' without any.

    """

    pressure_gauge_pa: FloatArray
    load_n: FloatArray
    strain: FloatArray
    strain_u: FloatArray
    parts: dict[str, FloatArray]
    half_distance: FloatArray
    force_strain: FloatArray
    force_n: FloatArray
    force_u_n: FloatArray
    air_mass_kg: FloatArray | None = None
    pressure_u_pa: FloatArray | None = None
    monotone: dict[str, Any] = field(default_factory=dict)
    unknown: str = ''

    def table(self, source: str = '') -> LookupTable:
        """
        Return the LookupTable of the surfaces.

        Raises
        ------
        InputError
            The mass of air is not known.

        """
        if self.air_mass_kg is None:
            raise InputError('no lookup table without the mass of air: the bore of the muscle is '
                             'not known', 'characterise')
        return LookupTable(self.pressure_gauge_pa, self.load_n, self.strain, self.air_mass_kg,
                           source)

    def law(self) -> Lookup:
        """Return the Lookup law of contraction and force; the air is right only if known."""
        return _law(self.pressure_gauge_pa, self.load_n, self.strain, self.air_mass_kg)


def build_surfaces(
        points: Points, dimensions: Dimensions, load_step_n: float | None = None,
        loads_n: FloatArray | None = None) -> Surfaces:
    """
    Return the Surfaces through measured Points.

    Parameters
    ----------
    points : pam_sim.characterise.points.Points
        What was measured.
    dimensions : Dimensions
        Without a bore, P(m_air, load) is left out.
    load_step_n : float, optional
        Spacing of the grid of loads, see ``load_grid``.
    loads_n : ndarray, optional
        The loads themselves, ascending from 0, instead of a grid.

    Raises
    ------
    InputError
        Fewer than 3 loads, the smallest too far from 0 N, or nothing contracts.

    """
    smallest_n = float(points.load_n[0])
    points = with_enough_pressures(with_no_load(points))
    unknown = not_lifted(points) & (smallest_n > 0.05)
    loads = load_grid(points.load_n, load_step_n) if loads_n is None else loads_n
    at = np.clip(loads, points.load_n[0], points.load_n[-1])

    def onto(surface: FloatArray) -> FloatArray:
        return np.array([np.interp(at, points.load_n, row) for row in surface])

    measured = PchipInterpolator(points.load_n, points.strain, axis=1)(at)
    strain = np.round(monotone_surface(measured), _DIGITS_STRAIN)
    # What noise alone can make is rest: the force law asks which loads were lifted.
    strain[strain < REST_SIGMAS * np.median(points.noise)] = 0.0
    if strain.max() <= 1e-3:
        raise InputError('the muscle does not contract at any pressure', 'characterise')
    half = onto(points.half_distance)
    slope = np.gradient(strain, loads, axis=1)
    parts = {
        'noise': onto(points.noise),
        # Both branches are equally right: the truth lies anywhere between (uniform).
        'hysteresis': _open_loop(half) / np.sqrt(3.0),
        'settling': onto(points.settling),
        'load': np.abs(slope) * np.interp(at, points.load_n, points.load_u_n),
        'reading': onto(points.reading),
        'monotone': np.abs(strain - measured),
    }
    strain_u = np.sqrt(sum(part ** 2 for part in parts.values()))
    mass, pressure_u = _air(points.pressure_gauge_pa, strain, strain_u, dimensions)
    force_strain, force, force_u = _force(
        points.pressure_gauge_pa, loads, strain, strain_u, mass)
    # The force at rest is at most the load that it does not lift.
    force_u[unknown] = np.hypot(force_u[unknown], smallest_n / np.sqrt(3.0))
    moved = np.abs(strain - measured) > 10.0 ** -_DIGITS_STRAIN
    return Surfaces(
        points.pressure_gauge_pa, loads, strain, strain_u, parts, half, force_strain, force,
        force_u, mass, pressure_u, {
            'points': int(strain.size), 'moved': int(np.count_nonzero(moved)),
            'largest_strain': float(parts['monotone'].max()),
            'rms_strain': float(np.sqrt(np.mean(parts['monotone'] ** 2)))},
        _unknown_text(points.pressure_gauge_pa[unknown], smallest_n))


def _unknown_text(pressure: FloatArray, smallest_n: float) -> str:
    """Return the sentence on pressures at which no load was lifted, '' without any."""
    if not pressure.size:
        return ''
    low, high = (f'{1e-3 * one:.0f}' for one in (pressure.min(), pressure.max()))
    return (f'At {low if low == high else f"{low} to {high}"} kPa no load was lifted: the force '
            f'at rest lies between 0 and {smallest_n:.1f} N there, and the table holds 0. Measure '
            'smaller loads.')


def _open_loop(half_distance: FloatArray) -> FloatArray:
    """
    Return the half distance of the branches as if the loop never closed.

    Where the pressure turns the branches meet without being right: the widest
    distance at lower pressures counts. A load lifted only there has none; that
    of the next smaller load counts.
    """
    widest = np.maximum.accumulate(np.nan_to_num(np.abs(half_distance)), axis=0)
    widest[-1, 1:] = np.maximum(widest[-1, 1:], widest[-1, :-1])
    return widest


def _air(
        pressure: FloatArray, strain: FloatArray, strain_u: FloatArray,
        dimensions: Dimensions) -> tuple[FloatArray | None, FloatArray | None]:
    """Return (air mass, uncertainty of P at a known mass and load), None twice if unknown."""
    if dimensions.bore_m is None:
        return None, None
    mass = dimensions.air_mass_kg(pressure[:, None], strain)
    per_strain = mass * dimensions.volume_slope_m3(strain) / dimensions.volume_m3(strain)
    per_pascal = np.gradient(mass, pressure, axis=0)
    return np.round(mass, _DIGITS_MASS), np.abs(per_strain) * strain_u / per_pascal


def _law(
        pressure: FloatArray, loads: FloatArray, strain: FloatArray,
        mass: FloatArray | None) -> Lookup:
    # The force does not depend on the air: any rising mass serves where it is unknown.
    air = mass if mass is not None else np.repeat(1.0 + pressure[:, None], loads.size, axis=1)
    # By the registry, which gives the class its compiled formula.
    law = make_law('lookup', LookupTable(pressure, loads, strain, air))
    assert isinstance(law, Lookup)
    return law


def _force(
        pressure: FloatArray, loads: FloatArray, strain: FloatArray, strain_u: FloatArray,
        mass: FloatArray | None) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (contractions, F, uncertainty of F); NaN where only larger loads would reach."""
    law = _law(pressure, loads, strain, mass)
    # Without a point that rounding puts beside the largest contraction.
    axis = np.append(np.arange(0.0, strain.max() - 1e-6, STRAIN_STEP), strain.max())
    force = law.force_n(pressure[:, None], axis[None, :], outside='allow')
    # Smooth rows of the largest load say nothing on contractions that only more load reaches.
    beyond = axis[None, :] < strain[:, -1:] - 1e-9
    spread = RegularGridInterpolator((pressure, loads), strain_u)
    at = np.stack(np.broadcast_arrays(pressure[:, None], np.clip(force, 0.0, loads[-1])), -1)
    force_u = np.abs(np.gradient(force, axis, axis=1)) * spread(at)
    return axis, np.where(beyond, np.nan, force), np.where(beyond, np.nan, force_u)

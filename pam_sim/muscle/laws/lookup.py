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
The chapter's empirical model (section 4.3): surfaces through tabulated points.

P(air mass, load), eps(P, load) and, from these, F(eps, P). Piecewise cubic
Hermite (PCHIP) along both axes: smooth, monotone between the points, and none
of the overshoot that would make a muscle lengthen under rising pressure.
``dmsp_5_300`` is shipped, made by ``pam characterise`` from a simulation; measure your own, or
compute one from another law.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TYPE_CHECKING
import warnings

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled
from pam_sim.errors import InputError
from pam_sim.muscle.law import ExtrapolationWarning, MuscleLaw, OUTSIDE, ParameterSet, Validity
from pam_sim.muscle.lookup_table import LookupTable, read_table
from pam_sim.records import part, record, size_of, values_of
from pam_sim.units import absolute_pa, GAS_CONSTANT_AIR, P_ATM_PA, TEMPERATURE_K

if TYPE_CHECKING:
    from scipy.interpolate._rgi import RegularGridInterpolator

STRAIN_POINTS = 41
SHIPPED = Path(__file__).parent.parent / 'lookup_tables'
_SMALL = 1e-7           # contraction below this counts as rest
# What the compiled formulas read: a head, behind it for each pressure the force [N] over
# contraction, and then for each the p V [J] of the air in the muscle.
HEAD = record('pressures', 'points_per_strain')
ISOBAR = record('pressure_pa', ('value', STRAIN_POINTS), ('slope', STRAIN_POINTS))
_HEAD_SIZE, _ISOBAR_SIZE = size_of(HEAD), size_of(ISOBAR)


@compiled
def hermite(y0: float, y1: float, slope0: float, slope1: float, width: float,
            share: float) -> float:
    """Return the cubic between two points at ``share`` of the way; slopes per unit of width."""
    rest = 1.0 - share
    return (rest * rest * ((1.0 + 2.0 * share) * y0 + share * width * slope0)
            + share * share * ((1.0 + 2.0 * rest) * y1 - rest * width * slope1))


@compiled
def middle_slope(width0: float, width1: float, slope0: float, slope1: float) -> float:
    """Return the monotone slope (Fritsch and Carlson 1980) between two intervals."""
    if slope0 * slope1 <= 0.0:
        return 0.0
    weight0 = 2.0 * width1 + width0
    weight1 = width1 + 2.0 * width0
    return (weight0 + weight1) / (weight0 / slope0 + weight1 / slope1)


@compiled
def end_slope(width0: float, width1: float, slope0: float, slope1: float) -> float:
    """Return the slope at the outer end of interval 0, three points, kept monotone."""
    slope = ((2.0 * width0 + width1) * slope0 - width0 * slope1) / (width0 + width1)
    if slope * slope0 <= 0.0:
        return 0.0
    if slope0 * slope1 <= 0.0 and abs(slope) > 3.0 * abs(slope0):
        return 3.0 * slope0
    return slope


@compiled
def in_row(isobar: np.record, column: int, share: float, width: float) -> float:
    """Return the value at one tabulated pressure within a strain interval."""
    return hermite(isobar.value[column], isobar.value[column + 1], isobar.slope[column],
                   isobar.slope[column + 1], width, share)


@compiled
def isobar_of(par: np.record, row: int) -> np.record:
    """Return an ``ISOBAR``; those of the force stand behind the head, then those of the air."""
    return part(par, _HEAD_SIZE + row * _ISOBAR_SIZE, ISOBAR)


@compiled
def clipped(gauge_pa: float, par: np.record) -> float:
    """Return the pressure [Pa gauge] of the table that is nearest."""
    return min(max(gauge_pa, isobar_of(par, 0).pressure_pa),
               isobar_of(par, int(par.pressures) - 1).pressure_pa)


@compiled
def on_surface(gauge_pa: float, strain: float, first: int, par: np.record) -> float:
    """
    Return the value of the surface whose isobars begin at ``first``, one point.

    PCHIP along contraction, then along pressure. Beyond the table its edge is used.
    """
    rows = int(par.pressures)
    place = min(max(strain * par.points_per_strain, 0.0), STRAIN_POINTS - 1.0)
    column = min(int(place), STRAIN_POINTS - 2)
    share = place - column
    width = 1.0 / par.points_per_strain
    pressure = clipped(gauge_pa, par)
    row = 0
    while row < rows - 2 and isobar_of(par, first + row + 1).pressure_pa < pressure:
        row += 1
    low, high = isobar_of(par, first + row), isobar_of(par, first + row + 1)
    y0 = in_row(low, column, share, width)
    y1 = in_row(high, column, share, width)
    h = high.pressure_pa - low.pressure_pa
    slope = (y1 - y0) / h
    slope0 = 0.0
    slope1 = 0.0
    before = 0.0
    after = 0.0
    h_before = h
    h_after = h
    if row > 0:
        lower = isobar_of(par, first + row - 1)
        h_before = low.pressure_pa - lower.pressure_pa
        before = (y0 - in_row(lower, column, share, width)) / h_before
        slope0 = middle_slope(h_before, h, before, slope)
    if row < rows - 2:
        higher = isobar_of(par, first + row + 2)
        h_after = higher.pressure_pa - high.pressure_pa
        after = (in_row(higher, column, share, width) - y1) / h_after
        slope1 = middle_slope(h, h_after, slope, after)
    if row == 0:
        slope0 = end_slope(h, h_after, slope, after)
    if row == rows - 2:
        slope1 = end_slope(h, h_before, slope, before)
    return hermite(y0, y1, slope0, slope1, h, (pressure - low.pressure_pa) / h)


@compiled
def tension_n(gauge_pa: float, strain: float, par: np.record) -> float:
    """Return F(eps, P) [N], one point."""
    return on_surface(gauge_pa, strain, 0, par)


@compiled
def volume_m3(gauge_pa: float, strain: float, par: np.record) -> float:
    """Return the volume [m^3] that the air mass of the muscle fills, one point."""
    return on_surface(gauge_pa, strain, int(par.pressures), par) / (
        clipped(gauge_pa, par) + P_ATM_PA)


def _isobar(strain: FloatArray, load: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Return (strain ascending, load) of the points on which the muscle moves at one pressure.

    Where it lies at rest under the larger loads, the load of lift-off is extrapolated from the
    last two moving points. It is kept below the first load that was not lifted.
    """
    moving = strain > _SMALL
    count = np.count_nonzero(moving)
    eps, pull = strain[:count][::-1], load[:count][::-1]
    if count == 0:
        return np.zeros(1), np.zeros(1)
    top = load[count] if count < load.size else np.inf
    if count > 1 and eps[1] > eps[0]:
        slope = (pull[1] - pull[0]) / (eps[1] - eps[0])
        lift_off = min(top, pull[0] - slope * eps[0])
    else:
        lift_off = top if np.isfinite(top) else pull[0]
    return np.concatenate([[0.0], eps]), np.concatenate([[lift_off], pull])


class Lookup(MuscleLaw):
    """
    Surfaces P(air mass, load), eps(P, load), F(eps, P) through a table.

    Parameters
    ----------
    table : LookupTable, str or Path, optional
        The points, or the CSV file that holds them; by default the shipped ones.
    muscle : str, optional
        ``table`` with a table of your own, ``dmsp_5_300`` (the default) without.
    where : str
        Place for error messages.

    """

    NAME = 'lookup'
    EQUATION = 'section 4.3, Figures 4.6 and 4.7'
    FORMULA = 'P = P(m_air, load); eps = eps(P, load); F = F(eps, P)'
    SOURCE = 'the chapter; interpolation after Fritsch and Carlson 1980'
    SETS = {
        'dmsp_5_300': ParameterSet(
            {}, 'a simulation of the nominal rig, whose force map is scaled from a measured '
            'DMSP-10-250; no DMSP-5 was measured', Validity((0.0, 600e3), (0.0, 0.2)), 0.005),
        'table': ParameterSet({}, 'the table given; its source line says what it is')}
    CLAIMS = (1, 2, 3, 4)
    EXTRAPOLATES = False
    PACKED = HEAD

    def __init__(self, table: LookupTable | Path | str | Mapping[str, float] | None = None,
                 muscle: str | None = None, where: str = '') -> None:
        table = None if table == {} else table
        if muscle is None:
            muscle = 'dmsp_5_300' if table is None else 'table'
        super().__init__(None, muscle, where)
        # Imported when a table is used: it takes longer than all other laws together.
        from scipy.interpolate import PchipInterpolator, RegularGridInterpolator
        if isinstance(table, Mapping) or (table is None) == (muscle == 'table'):
            raise InputError('law `lookup` takes no parameters but a table: a LookupTable or '
                             'the path of a CSV file, and no other set with it', where)
        table = SHIPPED / f'{muscle}.csv' if table is None else table
        self.table = table if isinstance(table, LookupTable) else read_table(table)
        pressure, load = self.table.pressure_gauge_pa, self.table.load_n
        limit = float(self.table.strain.max())
        if limit <= _SMALL:
            raise InputError('no point of the table contracts', where or 'lookup table, strain')
        self.validity = Validity((pressure[0], pressure[-1]), (0.0, limit))
        self._strain = RegularGridInterpolator((pressure, load), self.table.strain, 'pchip')
        self._mass = RegularGridInterpolator((pressure, load), self.table.air_mass_kg, 'pchip')
        # The range of air mass differs from load to load: a fraction of it is the axis.
        mass = self.table.air_mass_kg
        self._lowest = PchipInterpolator(load, mass[0])
        self._highest = PchipInterpolator(load, mass[-1])
        fraction = np.linspace(0.0, 1.0, 4 * pressure.size)
        share = (mass - mass[0]) / (mass[-1] - mass[0])
        columns = [PchipInterpolator(share[:, j], pressure)(fraction) for j in range(load.size)]
        self._pressure = RegularGridInterpolator((fraction, load), np.transpose(columns), 'pchip')
        strain = np.linspace(0.0, limit, STRAIN_POINTS)
        force = np.array([self._pulls(row, strain) for row in self.table.strain])
        value = np.concatenate([force, self._air(strain)])
        slope = np.array([PchipInterpolator(strain, row).derivative()(strain) for row in value])
        self.PACKED = record(*(HEAD.names or ()), ('isobars', (ISOBAR, len(value))))
        self._packed = {
            'pressures': pressure.size, 'points_per_strain': (STRAIN_POINTS - 1) / limit,
            'isobars': np.column_stack([np.tile(pressure, 2), value, slope])}
        self._values = values_of(self.PACKED, self._packed)

    def _check(self, where: str) -> None:
        """Leave it to the interpolation, which keeps what the table keeps."""

    def pack(self) -> dict[str, Any]:
        """Return the head, then pressures, values and their slopes along contraction."""
        return self._packed

    def _pulls(self, strain_of_load: FloatArray, strain: FloatArray) -> FloatArray:
        """Return the force [N] of one tabulated pressure on a grid of contractions."""
        from scipy.interpolate import PchipInterpolator
        eps, pull = _isobar(strain_of_load, self.table.load_n)
        eps, first = np.unique(eps, return_index=True)
        if eps.size < 2:
            return np.zeros_like(strain)
        inside = np.clip(strain, 0.0, eps[-1])
        return np.where(strain > eps[-1], 0.0, PchipInterpolator(eps, pull[first])(inside))

    def _air(self, strain: FloatArray) -> FloatArray:
        """
        Return p V [J] of the air in the muscle on a grid of contractions, a row per pressure.

        A muscle that is slack, contracted further than without load, keeps its volume. At rest
        it has the volume of the points that do not move, of the next pressure where one has none.
        """
        from scipy.interpolate import PchipInterpolator
        table = self.table
        pressure = absolute_pa(table.pressure_gauge_pa)
        volume = (table.air_mass_kg * GAS_CONSTANT_AIR * TEMPERATURE_K / pressure[:, np.newaxis]
                  - (table.dead_volume_m3 or 0.0))
        moving = table.strain > _SMALL
        at_rest = ~moving.all(axis=1)
        least = np.argmin(moving, axis=1)           # of the loads that are not lifted
        rest = np.interp(pressure, pressure[at_rest], volume[at_rest, least[at_rest]]
                         ) if at_rest.any() else volume[:, -1]
        rows = []
        for k, lifted in enumerate(moving):
            eps, first = np.unique(np.append(0.0, table.strain[k, lifted]), return_index=True)
            held = np.append(rest[k], volume[k, lifted])[first]
            rows.append(np.full_like(strain, held[0]) if eps.size < 2 else PchipInterpolator(
                eps, held)(np.minimum(strain, eps[-1])))
        return pressure[:, np.newaxis] * np.array(rows)

    def air_grid_pa(self) -> FloatArray:
        """
        Return the pressures of the table.

        Raises
        ------
        InputError
            The table does not say which dead volume its air mass includes.

        """
        if self.table.dead_volume_m3 is None:
            raise InputError('the table does not say whose air its air_mass_kg is; write into a '
                             'line of comment (#) or its `source`: dead volume 3 mL, that of tube '
                             'and fittings, or 0 mL for the muscle alone', 'lookup table')
        return self.table.pressure_gauge_pa

    def _packed_values(self) -> FloatArray:
        return self._values

    @staticmethod
    def _at(surface: 'RegularGridInterpolator', first: FloatArray,
            second: FloatArray) -> FloatArray:
        first, second = np.broadcast_arrays(first, second)
        points = np.stack([first.ravel(), second.ravel()], axis=-1)
        return surface(points).reshape(first.shape)

    def _ends(self) -> tuple[FloatArray, FloatArray]:
        """Return lowest and highest pressure, and load, of the table."""
        return self.table.pressure_gauge_pa[[0, -1]], self.table.load_n[[0, -1]]

    def _kept(self, values: ArrayLike, low: FloatArray, high: FloatArray,
              name: str, outside: str) -> FloatArray:
        """Return the values moved into the table; warn or refuse where that moved any."""
        value = np.asarray(values, dtype=float)
        if outside not in OUTSIDE:
            raise InputError(f'is {outside!r}; allowed: {", ".join(OUTSIDE)}', 'outside')
        if not np.all(np.isfinite(value)):
            raise InputError('must be finite', name)
        span = 1e-9 * (high - low)
        if outside != 'allow' and np.any((value < low - span) | (value > high + span)):
            text = (f'`{name}` leaves the table, {np.min(low):g} to {np.max(high):g}; '
                    f'the edge is used')
            if outside == 'refuse':
                raise InputError(text.split(';')[0], name)
            warnings.warn(text, ExtrapolationWarning, stacklevel=3)
        return np.clip(value, low, high)

    def strain_at(self, pressure_gauge_pa: ArrayLike, load_n: ArrayLike,
                  outside: str = 'warn') -> FloatArray:
        """Return eps(P, load); arrays broadcast; ``outside`` as in ``force_n``."""
        (low, high), (least, most) = self._ends()
        return self._at(
            self._strain, self._kept(pressure_gauge_pa, low, high, 'pressure_gauge_pa', outside),
            self._kept(load_n, least, most, 'load_n', outside))[()]

    def air_mass_kg(self, pressure_gauge_pa: ArrayLike, load_n: ArrayLike,
                    outside: str = 'warn') -> FloatArray:
        """Return the air mass [kg] at a gauge pressure [Pa] and load [N]; arrays broadcast."""
        (low, high), (least, most) = self._ends()
        return self._at(
            self._mass, self._kept(pressure_gauge_pa, low, high, 'pressure_gauge_pa', outside),
            self._kept(load_n, least, most, 'load_n', outside))[()]

    def pressure_gauge_pa(self, air_mass_kg: ArrayLike, load_n: ArrayLike,
                          outside: str = 'warn') -> FloatArray:
        """Return P(air mass, load), gauge [Pa]; arrays broadcast."""
        _, (least, most) = self._ends()
        load = self._kept(load_n, least, most, 'load_n', outside)
        low, high = self._lowest(load), self._highest(load)
        mass = self._kept(air_mass_kg, low, high, 'air_mass_kg', outside)
        return self._at(self._pressure, (mass - low) / (high - low), load)[()]


LAW = Lookup

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

from pathlib import Path
import warnings

import numpy as np
from pam_sim.errors import InputError
from pam_sim.muscle.law import ExtrapolationWarning, MuscleLaw, OUTSIDE, ParameterSet, Validity
from pam_sim.muscle.lookup_table import LookupTable, read_table
from scipy.interpolate import PchipInterpolator, RegularGridInterpolator

STRAIN_POINTS = 41
SHIPPED = Path(__file__).parent.parent / 'lookup_tables'
_SMALL = 1e-7           # contraction below this counts as rest


def _isobar(strain, load):
    """
    Return (strain ascending, load) of the points on which the muscle moves at one pressure.

    Where it lies at rest under the larger loads, the load of lift-off is
    extrapolated from the last two moving points and kept below the first load
    that was not lifted.
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
            'DMSP-10-250; no DMSP-5 was measured', Validity((0.0, 600e3), (0.0, 0.2))),
        'table': ParameterSet({}, 'the table given; its source line says what it is')}
    CLAIMS = (1, 2, 3, 4)

    def __init__(self, table=None, muscle=None, where=''):
        table = None if table == {} else table
        if muscle is None:
            muscle = 'dmsp_5_300' if table is None else 'table'
        super().__init__(None, muscle, where)
        if isinstance(table, dict) or (table is None) == (muscle == 'table'):
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
        self._force = RegularGridInterpolator(
            (pressure, strain), np.array([self._pulls(row, strain) for row in self.table.strain]),
            'pchip')

    def _pulls(self, strain_of_load, strain):
        """Return the force [N] of one tabulated pressure on a grid of contractions."""
        eps, pull = _isobar(strain_of_load, self.table.load_n)
        eps, first = np.unique(eps, return_index=True)
        if eps.size < 2:
            return np.zeros_like(strain)
        inside = np.clip(strain, 0.0, eps[-1])
        return np.where(strain > eps[-1], 0.0, PchipInterpolator(eps, pull[first])(inside))

    def _tension_n(self, pressure, strain):
        low, high = self.validity.pressure_gauge_pa
        return self._at(self._force, np.clip(pressure, low, high),
                        np.clip(strain, 0.0, self.validity.strain[1]))

    @staticmethod
    def _at(surface, first, second):
        first, second = np.broadcast_arrays(first, second)
        points = np.stack([first.ravel(), second.ravel()], axis=-1)
        return surface(points).reshape(first.shape)

    def _kept(self, value, low, high, name, outside):
        """Return the values moved into the table; warn or refuse where that moved any."""
        value = np.asarray(value, dtype=float)
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

    def strain_at(self, pressure_gauge_pa, load_n, outside='warn'):
        """Return eps(P, load); arrays broadcast; ``outside`` as in ``force_n``."""
        table = self.table
        return self._at(self._strain, *np.broadcast_arrays(
            self._kept(pressure_gauge_pa, *table.pressure_gauge_pa[[0, -1]],
                       'pressure_gauge_pa', outside),
            self._kept(load_n, *table.load_n[[0, -1]], 'load_n', outside)))[()]

    def air_mass_kg(self, pressure_gauge_pa, load_n, outside='warn'):
        """Return the air mass [kg] at a gauge pressure [Pa] and load [N]; arrays broadcast."""
        table = self.table
        return self._at(self._mass, *np.broadcast_arrays(
            self._kept(pressure_gauge_pa, *table.pressure_gauge_pa[[0, -1]],
                       'pressure_gauge_pa', outside),
            self._kept(load_n, *table.load_n[[0, -1]], 'load_n', outside)))[()]

    def pressure_gauge_pa(self, air_mass_kg, load_n, outside='warn'):
        """Return P(air mass, load), gauge [Pa]; arrays broadcast."""
        load = self._kept(load_n, *self.table.load_n[[0, -1]], 'load_n', outside)
        low, high = self._lowest(load), self._highest(load)
        mass = self._kept(air_mass_kg, low, high, 'air_mass_kg', outside)
        return self._at(self._pressure, (mass - low) / (high - low), load)[()]


LAW = Lookup

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

"""The surfaces of a force map, and how far they are off the points that were measured."""

from dataclasses import dataclass, replace
import math

import numpy as np
from pam_sim.characterise.beyond import beyond
from pam_sim.characterise.dimensions import Dimensions
from pam_sim.characterise.points import stepped_loads
from pam_sim.characterise.scattered import smoothed
from pam_sim.characterise.surfaces import build_surfaces, Surfaces
from pam_sim.characterise.tables import map_of, MeasuredTable, points_of_map
from pam_sim.muscle.fit import residuals_n
from pam_sim.muscle.force_maps import ForceMap, some_points
from pam_sim.muscle.laws.lookup import Lookup


@dataclass(frozen=True)
class TableError:
    """
    How far a table is off the force that was measured.

    Parameters
    ----------
    rms_n, worst_n : float
        Over all points, and at the worst one.
    pressure_gauge_pa, strain : float
        Where the worst one is.
    largest_n : float
        The largest force of the map.

    """

    rms_n: float
    worst_n: float
    pressure_gauge_pa: float
    strain: float
    largest_n: float

    def text(self, length_m: float) -> str:
        """Return what a reader should know, for a length at rest [m]."""
        (rms, rms_percent), (worst, worst_percent) = (
            (_short(one), _short(100.0 * one / self.largest_n))
            for one in (self.rms_n, self.worst_n))
        return (f'At the measured points the force of the table is off by {rms} N rms '
                f'({rms_percent} % of the largest force), and by at most {worst} N '
                f'({worst_percent} %) at {1e-3 * self.pressure_gauge_pa:.0f} kPa and '
                f'{1e3 * length_m * (1.0 - self.strain):.1f} mm.')

    def source(self) -> str:
        """Return the line of a table that says it; ``pam rig new`` reads it."""
        return ('force of the table off at the measured points: '
                f'{_short(100.0 * self.rms_n / self.largest_n)} % of the largest force rms')


def _short(value: float) -> str:
    """Return a number with two digits, 0 for what is rounding alone."""
    return f'{float(f"{value:.2g}"):g}' if value >= 1e-3 else '0'


def table_error(law: Lookup, points: ForceMap) -> TableError:
    """Return the TableError of a law made from a force map; a table ends at the full length."""
    points = some_points(points, points.strain >= 0.0)
    error = residuals_n(law.force_n(points.pressure_gauge_pa, points.strain, outside='allow'),
                        points)
    worst = int(np.argmax(np.abs(error)))
    return TableError(float(np.sqrt(np.mean(error ** 2))), float(np.abs(error[worst])),
                      float(points.pressure_gauge_pa[worst]), float(points.strain[worst]),
                      float(points.force_n.max()))


def surfaces_of_map(table: MeasuredTable, dimensions: Dimensions,
                    load_step_n: float | None = None) -> tuple[Surfaces, TableError, list[str]]:
    """
    Return (surfaces, how far they are off the points, what a reader should know).

    Parameters
    ----------
    table : MeasuredTable
        A force map.
    dimensions : Dimensions
        Without a bore, P(m_air, load) is left out.
    load_step_n : float, optional
        Spacing of the loads; by default they keep the ends of the isobars.

    Raises
    ------
    InputError
        Too few pressures or loads, or the muscle does not contract.

    """
    length_m, measured = dimensions.length_m, map_of(table, dimensions.length_m)
    wanted = None if load_step_n is None else stepped_loads(
        float(measured.force_n.max()), load_step_n)
    smooth = smoothed(table, length_m)
    points = points_of_map(smooth.table if smooth else table, length_m, wanted,
                           all_forces=smooth is None)
    points = smooth.doubted(points) if smooth else points
    loads_n = points.load_n if load_step_n is None else None
    error = table_error(build_surfaces(points, dimensions, load_step_n, loads_n).law(), measured)
    # What the fit of a law leaves is in its contraction already.
    more_n = math.sqrt(max(error.rms_n ** 2 - (smooth.fit.fit.rmse_n if smooth else 0.0) ** 2,
                           0.0))
    surfaces = build_surfaces(replace(points, load_u_n=np.full_like(points.load_n, more_n)),
                              dimensions, load_step_n, loads_n)
    remarks = [smooth.text() if smooth else (
        'A force map is read as one branch and states no noise: the uncertainty given is that of '
        'the contraction at which the force vanishes, and what the table is off at its points.')]
    repeated = table.columns['force'].size - measured.force_n.size
    if repeated:
        remarks.append(
            f'{repeated} rows repeat a pressure and a contraction of other rows, so the mean of '
            'their forces was taken. The uncertainty does not hold how far they are apart.')
    remarks.append(error.text(length_m))
    longer = beyond(measured)
    return surfaces, error, remarks + ([] if longer is None else [longer.text(length_m)])

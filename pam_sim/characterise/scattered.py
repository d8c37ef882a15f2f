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
A force map whose pressures do not recur at every length, put on isobars.

A muscle held at a few lengths and filled in steps gives such a map: each length has pressures of
its own. No isobar can be read through them. So a smooth force law is fitted, and read on isobars.
"""

from dataclasses import dataclass, replace
import math

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.characterise.points import Points, SAME_PA
from pam_sim.characterise.tables import map_of, MeasuredTable
from pam_sim.muscle.fit_shape import left_out_percent, near_shape, NearShape

LENGTHS = 3                  # of an isobar that can be read
PRESSURES = 16               # isobars the law is read on
STRAIN_STEP, MOST_STRAIN = 0.005, 0.4
FEWEST_LEFT_OUT = 3          # lengths, so that two are left to be fitted


@dataclass(frozen=True)
class Smoothed:
    """
    A force law in place of scattered points.

    Parameters
    ----------
    table : MeasuredTable
        The law on isobars, from no pressure to the highest measured one.
    fit : NearShape
        The corrected law, and how far the points are off it.
    left_out_percent : list of float
        By contraction: how far a fit to all other lengths is off, of the largest force.

    """

    table: MeasuredTable
    fit: NearShape
    left_out_percent: list[float]

    def text(self) -> str:
        """Return what a reader should know."""
        said = ('The pressures differ from length to length, so the force law `sarosi` was fitted '
                'near the shape of a measured DMSP-10-250, and corrected at each length. The '
                f'points are off the result by {self.fit.rmse_n:.1f} N rms, '
                f'{self.fit.rmse_percent:.1f} % of the largest force.')
        inside = [one for one in self.left_out_percent[1:-1] if math.isfinite(one)]
        if inside:
            said += (f' At a length between others that the fit does not know it is off by up to '
                     f'{max(inside):.1f} %.')
        return said

    def doubted(self, points: Points) -> Points:
        """Return Points with what the fit leaves in the uncertainty of the contraction."""
        # Between lengths the correction is known no better than what it corrects.
        law, rmse_n = self.fit.fit.law, self.fit.fit.rmse_n
        half = 0.5 * STRAIN_STEP
        pressure = points.pressure_gauge_pa[:, None]
        fall = law._tension_n(pressure, points.strain - half) - law._tension_n(
            pressure, points.strain + half)
        doubt = rmse_n * STRAIN_STEP / np.maximum(fall, 1e-9)
        # Below the pressure at which a muscle begins to pull, its contraction is 0 for certain.
        doubt = np.where(points.strain > 0.0, doubt, 0.0)
        return replace(points, reading=np.hypot(points.reading, doubt))


def is_scattered(pressure: FloatArray, strain: FloatArray) -> bool:
    """Return whether most pressures of a force map stand at too few lengths to read an isobar."""
    own = [np.unique(strain[pressure == level]).size for level in np.unique(pressure)]
    return float(np.median(own)) < min(LENGTHS, max(np.unique(strain).size, 2))


def smoothed(table: MeasuredTable, length_m: float) -> Smoothed | None:
    """
    Return a force map on isobars, None where its own pressures are some.

    Parameters
    ----------
    table : MeasuredTable
        A force map.
    length_m : float
        Length at rest.

    Raises
    ------
    InputError
        The points determine no force law.

    """
    measured = map_of(table, length_m)
    if not is_scattered(measured.pressure_gauge_pa, measured.strain):
        return None
    fit = near_shape(measured)
    highest_pa = SAME_PA * math.floor(measured.pressure_gauge_pa.max() / SAME_PA)
    # From none on: a rig is vented, and at the edge of a table its muscle would go on pulling.
    levels = np.unique(SAME_PA * np.round(np.linspace(0.0, highest_pa, PRESSURES) / SAME_PA))
    strain = np.arange(0.0, MOST_STRAIN, STRAIN_STEP)
    pressures, strains = (axis.ravel() for axis in np.meshgrid(levels, strain, indexing='ij'))
    on_isobars = MeasuredTable(
        table.kind, {'pressure': pressures, 'strain': strains,
                     'force': fit.force_n(pressures, strains)},
        [], table.source, table.path)
    left_out = left_out_percent(measured) if (
        np.unique(measured.strain).size >= FEWEST_LEFT_OUT) else []
    return Smoothed(on_isobars, fit, left_out)

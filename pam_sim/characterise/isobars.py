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
The isobars of a force map: the contraction under any load, and the loads that keep their points.

A muscle pulls most at its full length, and its force rises steeply there. Loads at equal distances
miss the ends of the isobars, so the forces that were measured are loads too.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.muscle.force_maps import ForceMap
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

EQUAL_LOADS = 16            # of a force map, from 0 to the largest force
APART = 0.01                # of the largest force: other loads are no closer to each other
ENDS_APART = 0.001          # the same for the ends of isobars
# A muscle contracted this little tells at which load it leaves its full length.
END_STRAIN = 1e-6


@dataclass(frozen=True)
class Isobar:
    """
    The force of one pressure over contraction, down to 0 N and up to the length at rest.

    Parameters
    ----------
    load_n, strain : ndarray, shape (N,)
        Ascending loads and the contraction under each; empty where the muscle does not pull.
        Beyond the longest measured length it goes on in a straight line.
    measured_n : ndarray
        The forces that were measured.
    vanishes_within : float
        Width of the interval of contraction in which the force vanishes.
    longest_strain : float
        Contraction at the longest measured length.

    """

    load_n: FloatArray
    strain: FloatArray
    measured_n: FloatArray
    vanishes_within: float
    longest_strain: float

    def contraction(self, loads: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (contraction, its standard uncertainty) under each load."""
        if not self.load_n.size:
            return np.zeros(loads.size), np.zeros(loads.size)
        # A load above the force at rest is not lifted.
        eps = np.where(loads > self.load_n[-1] + 1e-9, 0.0, np.maximum(self._at(loads), 0.0))
        share = np.clip(1.0 - loads / self.measured_n[0], 0.0, 1.0)
        doubt = np.where(loads > self.measured_n[-1] + 1e-9, self.longest_strain,
                         share * self.vanishes_within)
        return eps, np.maximum(doubt, 0.0) / np.sqrt(12.0)

    def ends_n(self) -> list[float]:
        """Return the loads under which the muscle leaves its full length, and was longest."""
        if self.load_n.size < 2 or self.strain[-2] <= END_STRAIN:
            return []
        leaves = float(brentq(lambda load: float(self._at(np.array(load))) - END_STRAIN,
                              self.load_n[-2], self.load_n[-1]))
        return [leaves] + ([float(self.measured_n[-1])] if self.strain[-1] < self.longest_strain
                           else [])

    def _at(self, loads: FloatArray) -> FloatArray:
        straight = np.interp(loads, self.load_n, self.strain)
        known = self.load_n <= self.measured_n[-1]
        if np.count_nonzero(known) < 3:
            return straight
        curve = PchipInterpolator(self.load_n[known], self.strain[known])
        return np.where(loads > self.measured_n[-1], straight,
                        curve(np.clip(loads, 0.0, self.measured_n[-1])))


def isobars_of(points: ForceMap) -> list[Isobar]:
    """Return the Isobars of a force map, by ascending pressure."""
    return [_isobar(points.strain[rows], points.force_n[rows], points.censored[rows])
            for rows in (points.pressure_gauge_pa == level
                         for level in np.unique(points.pressure_gauge_pa))]


def loads_of(isobars: list[Isobar], measured: bool = True) -> FloatArray:
    """
    Return the loads at which isobars are read so that they keep their ends.

    Parameters
    ----------
    isobars : list of Isobar
        Of one force map.
    measured : bool
        Whether to keep the measured forces between the ends, too.

    Returns
    -------
    ndarray
        Ascending from 0 to the largest force: the ends of the isobars, measured forces, and
        equal distances where these leave a gap.

    """
    largest = max(float(one.load_n[-1]) for one in isobars if one.load_n.size)
    chosen = [0.0]

    def choose(wanted: Iterable[float], apart: float) -> None:
        for load in wanted:
            if np.min(np.abs(load - np.array(chosen))) > apart * largest:
                chosen.append(float(load))

    choose(sorted(load for one in isobars for load in one.ends_n()), ENDS_APART)
    chosen.append(largest)
    if measured:
        # The longest lengths first: there the force rises most steeply.
        choose(sorted((force for one in isobars for force in one.measured_n), reverse=True), APART)
    choose(np.linspace(0.0, largest, EQUAL_LOADS), APART)
    return np.sort(np.array(chosen))


def _isobar(strain: FloatArray, force: FloatArray, slack: BoolArray) -> Isobar:
    """Return the Isobar of the points at one pressure."""
    order = np.argsort(strain)
    strain, force = strain[order], np.minimum.accumulate(force[order])
    # Shorter than at the first slack point the muscle is slack too, whatever the load cell reads.
    count = np.count_nonzero(~np.logical_or.accumulate(slack[order]))
    nothing = np.zeros(0)
    if count == 0:
        return Isobar(nothing, nothing, nothing, 0.0, 0.0)
    last = strain[count - 1]
    slope = ((force[count - 2] - force[count - 1]) / (last - strain[count - 2])
             if count > 1 else 0.0)
    # The force vanishes between the last point that pulled and the first that did not.
    end = last + force[count - 1] / slope if slope > 0.0 else np.inf
    limit = strain[count] if count < strain.size else end
    if not np.isfinite(limit):
        limit = last
    zero = min(end, limit) if count > 1 else 0.5 * (last + limit)
    width = (limit - last) if count < strain.size else (zero - last)
    x = np.append(strain[:count], zero)[::-1]
    f = np.append(force[:count], 0.0)[::-1]
    f, first = np.unique(f, return_index=True)
    x = x[first]
    if x[0] <= 0.0:
        return Isobar(nothing, nothing, nothing, 0.0, 0.0)
    measured = f[1:]
    if x[-1] < 0.0:
        # Longer than at rest is beyond what a table holds.
        at_rest = float(PchipInterpolator(x[::-1], f[::-1])(0.0)) if f.size > 2 else float(
            np.interp(0.0, x[::-1], f[::-1]))
        f, x = np.append(f[x > 0.0], at_rest), np.append(x[x > 0.0], 0.0)
        measured = f[1:]
    elif x[-1] > 0.0 and x[-2] > x[-1]:
        f = np.append(f, f[-1] + x[-1] * (f[-1] - f[-2]) / (x[-2] - x[-1]))
        x = np.append(x, 0.0)
    return Isobar(f, x, measured, max(width, 0.0), float(strain[0]))

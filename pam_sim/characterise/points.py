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
Contraction on a grid of pressures and measured loads, with the parts of its uncertainty.

Rising and falling pressure are averaged: the chapter's "quasi-static system
with the hysteresis lumped into the non-linear characteristic curve". Half the
distance of the branches is kept.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.characterise.fixed_load import by_load, FixedLoad, NEAR_PA
from pam_sim.errors import InputError
from pam_sim.muscle.geometry import MOST_STRAIN
from pam_sim.short_repr import short_repr
from scipy.interpolate import PchipInterpolator

EDGE_PA = 3e3               # a pressure this far beyond a branch is read at its end
LIFTED_STRAIN = 1e-4        # contraction from which a load counts as lifted
STUCK_STRAIN = 5e-3         # branches closer than this are never a stuck muscle
_SURFACES = ('strain', 'half_distance', 'noise', 'settling', 'reading')
LEAST = 4                   # points a cubic needs along an axis
SAME_PA = 1e3               # grid pressures are rounded to this


@short_repr
@dataclass(frozen=True)
class Points:
    """
    Contraction and its uncertainty, surfaces of shape (P, L), contraction as a fraction.

    Parameters
    ----------
    pressure_gauge_pa, load_n : ndarray
        Ascending; shapes (P,), (L,).
    load_u_n : ndarray, shape (L,)
    strain : ndarray
        Mean of the branches.
    half_distance : ndarray
        Half of falling minus rising branch; NaN where only one was measured.
    noise, settling, reading : ndarray
        Standard uncertainties: scatter of the means, remaining drift, and how the
        number was read from the source (extrapolation, censored values).

    """

    pressure_gauge_pa: FloatArray
    load_n: FloatArray
    load_u_n: FloatArray
    strain: FloatArray
    half_distance: FloatArray
    noise: FloatArray
    settling: FloatArray
    reading: FloatArray


def points_of(loads: Sequence[FixedLoad], pressures_pa: FloatArray | None = None) -> Points:
    """
    Return the Points of recordings.

    Parameters
    ----------
    loads : list of FixedLoad
        Repetitions of one load are put together.
    pressures_pa : array_like, optional
        Grid, gauge; by default the levels within the range of all loads at which half of
        them or more were settled.

    Raises
    ------
    InputError
        Fewer than 3 loads or pressures.

    """
    loads = by_load(loads)
    grid = _levels(loads) if pressures_pa is None else np.asarray(pressures_pa, dtype=float)
    columns = [_column(one, grid) for one in loads]
    strain, half, noise, settling, reading = (np.array(part).T for part in zip(*columns))
    return Points(grid, np.array([one.load_n for one in loads]),
                  np.array([one.load_u_n for one in loads]), strain, half, noise, settling,
                  reading)


def _levels(loads: Sequence[FixedLoad]) -> FloatArray:
    low = max(min(h.pressure_gauge_pa for h in one.holds) for one in loads)
    high = min(max(h.pressure_gauge_pa for h in one.holds) for one in loads)
    levels = SAME_PA * np.round(loads[0].branch('up')[0] / SAME_PA)
    # A load may not have settled where most others did.
    for level in np.unique(np.concatenate([
            SAME_PA * np.round(one.branch('up')[0] / SAME_PA) for one in loads[1:]])):
        held = sum(one.is_held_at(level) for one in loads)
        if 2 * held >= len(loads) and np.abs(levels - level).min() > NEAR_PA:
            levels = np.append(levels, level)
    levels = np.unique(np.maximum(
        levels[(levels >= low - EDGE_PA) & (levels <= high + EDGE_PA)], 0.0))
    if levels.size < 3:
        raise InputError(
            f'{levels.size} pressure levels are common to all loads ({1e-3 * low:.0f} to '
            f'{1e-3 * high:.0f} kPa); 3 or more are needed')
    return levels


def _column(
        one: FixedLoad, grid: FloatArray) -> tuple[FloatArray, ...]:
    """Return (mean, half distance, noise, settling, reading) of one load on the pressures."""
    parts = []
    for name in ('up', 'down'):
        pressure, strain, noise, drift = one.branch(name)
        if pressure.size < 3:
            parts.append(np.full((4, grid.size), np.nan))
            continue
        at = np.clip(grid, pressure[0], pressure[-1])
        curve = PchipInterpolator(pressure, strain)
        # The mean pressure of a hold is uncertain too; its slope carries it over.
        hold_u = np.mean([hold.pressure_u_pa for hold in one.holds])
        total = np.hypot(np.interp(at, pressure, noise), curve(at, 1) * hold_u)
        # Where no hold settled, all between the holds before and after is possible.
        is_far = np.abs(at[:, None] - pressure).min(axis=1) > NEAR_PA
        after = np.clip(np.searchsorted(pressure, at), 1, pressure.size - 1)
        doubt = is_far / np.sqrt(3.0) * np.abs(
            [strain[after - 1] - curve(at), strain[after] - curve(at)]).max(axis=0)
        part = np.array([curve(at), total, np.interp(at, pressure, drift), doubt])
        part[:, (grid < pressure[0] - EDGE_PA) | (grid > pressure[-1] + EDGE_PA)] = np.nan
        parts.append(part)
    up, down = parts
    both = np.isfinite(up[0]) & np.isfinite(down[0])
    either = np.where(np.isfinite(up), up, down)
    return (np.where(both, 0.5 * (up[0] + down[0]), either[0]),
            np.where(both, 0.5 * (down[0] - up[0]), np.nan),
            np.where(both, 0.5 * np.hypot(up[1], down[1]), either[1]),
            np.where(both, 0.5 * (up[2] + down[2]), either[2]) / np.sqrt(3.0),
            np.where(both, 0.5 * (up[3] + down[3]), np.where(np.isfinite(up[3]), up[3], down[3])))


def load_grid(load_n: FloatArray, step_n: float | None = None) -> FloatArray:
    """
    Return the loads of the surfaces [N], ascending from 0.

    Parameters
    ----------
    load_n : ndarray
        Measured loads, ascending.
    step_n : float, optional
        Spacing, up to the largest measured load; by default the measured one rounded to 1 N where
        it is regular and reaches that load, else the measured loads themselves are the grid.

    Raises
    ------
    InputError
        Fewer than 3 loads on the grid.

    """
    largest_n, spacing = float(load_n[-1]), np.diff(load_n)
    if step_n is None:
        usual = float(np.median(spacing))
        step_n = float(np.round(usual))
        if (usual < 1.0 or np.any(np.abs(spacing[1:] - usual) > 0.2 * usual)
                or largest_n - step_n * _steps(largest_n, step_n) > 0.1 * usual):
            inner = np.round(load_n[load_n > 0.05], 1)
            return _with_middles(np.concatenate([[0.0], inner[inner > 0.25 * usual]]))
    return _with_middles(stepped_loads(largest_n, step_n))


def stepped_loads(largest_n: float, step_n: float) -> FloatArray:
    """
    Return loads [N] at equal steps from 0, up to the largest.

    Raises
    ------
    InputError
        A step of 0 or less, or one that makes fewer than 3 loads.

    """
    if not step_n > 0.0:
        raise InputError(f'is {step_n:g}; allowed is above 0', '--load-step-n')
    grid = step_n * np.arange(_steps(largest_n, step_n) + 1)
    if grid.size < 3:
        raise InputError(f'of {step_n:g} N makes {grid.size} loads up to {largest_n:.1f} N; '
                         f'3 or more are needed', '--load-step-n')
    return grid


def _steps(largest_n: float, step_n: float) -> int:
    """Return how many steps there are up to the largest load, which may be a little too small."""
    return int(largest_n / step_n + 0.02)


def _with_middles(axis: FloatArray) -> FloatArray:
    """Return an axis; with the middles between its points where they are too few for PCHIP."""
    if axis.size >= LEAST:
        return axis
    return np.sort(np.concatenate([axis, 0.5 * (axis[:-1] + axis[1:])]))


def with_enough_pressures(points: Points) -> Points:
    """Return Points with at least LEAST pressures; those between are interpolated."""
    old, new = points.pressure_gauge_pa, _with_middles(points.pressure_gauge_pa)
    if new.size == old.size:
        return points
    between = {name: np.array([np.interp(new, old, column) for column in
                               getattr(points, name).T]).T for name in _SURFACES}
    between['strain'] = PchipInterpolator(old, points.strain)(new)
    return Points(new, points.load_n, points.load_u_n, **between)


def without_stuck(points: Points) -> tuple[Points, list[float]]:
    """
    Return (Points, loads left out [N]): without small loads that friction alone can hold.

    A load smaller than the friction inside the muscle does not pull it long
    again; its branches lie far apart and their mean says little. Such a run is
    told by branches more than twice as far apart as those of the next load.
    """
    left_out = []
    while points.load_n.size > 3:
        with np.errstate(invalid='ignore'):
            apart = np.sqrt(np.mean(np.nan_to_num(points.half_distance[:, :2]) ** 2, axis=0))
        if apart[0] < STUCK_STRAIN or apart[0] < 2.0 * apart[1]:
            break
        left_out.append(float(points.load_n[0]))
        points = Points(points.pressure_gauge_pa, points.load_n[1:], points.load_u_n[1:], *(
            getattr(points, name)[:, 1:] for name in _SURFACES))
    return points, left_out


def with_no_load(points: Points) -> Points:
    """
    Return the Points with a column of 0 N, extrapolated where no run had it.

    Through the three smallest loads where they are lifted; where fewer are, with
    the slope of the next higher pressure. The difference from a straight line, or
    half of the step, is taken for its uncertainty. Where no load was lifted, the
    contraction without one may be anything from 0 to that of the next pressure.

    Raises
    ------
    InputError
        The smallest load is too large for that.

    """
    load = points.load_n
    if load[0] <= 0.05:
        return _replaced(points, np.concatenate([[0.0], load[1:]]), None)
    if load[0] > 1.1 * np.max(np.diff(load)):
        raise InputError(
            f'the smallest load of {load[0]:.1f} N is too far from 0 N; measure one of at most '
            f'{np.max(np.diff(load)):.1f} N')
    first, second, third = points.strain[:, :3].T
    a, b, c = load[:3]
    line = first + a * (first - second) / (b - a)
    bend = ((third - second) / (c - b) - (second - first) / (b - a)) / (c - a)
    curve = line + a * b * bend
    extrapolated, doubt = first.copy(), np.zeros_like(first)
    slope, most = np.nan, MOST_STRAIN
    for i in range(first.size - 1, -1, -1):
        if third[i] > LIFTED_STRAIN:
            extrapolated[i] = max(curve[i], first[i])
            doubt[i] = abs(curve[i] - line[i])
            slope = (extrapolated[i] - first[i]) / a
        elif first[i] > LIFTED_STRAIN and np.isfinite(slope):
            extrapolated[i] = first[i] + a * slope
            doubt[i] = 0.5 * a * slope
        elif first[i] > LIFTED_STRAIN or points.pressure_gauge_pa[i] > EDGE_PA:
            doubt[i] = (most - first[i]) / np.sqrt(3.0)
            continue
        doubt[i] = np.hypot(doubt[i], points.reading[i, 0])
        most = min(most, extrapolated[i] + 2.0 * doubt[i])
    return _replaced(points, np.concatenate([[0.0], load]), (extrapolated, doubt))


def not_lifted(points: Points) -> BoolArray:
    """Return the pressures, shape (P,), at which a muscle under pressure lifted no load."""
    lifted = points.strain[:, points.load_n > 0.05].max(axis=1) > LIFTED_STRAIN
    return ~lifted & (points.pressure_gauge_pa > EDGE_PA)


def _replaced(
        points: Points, load: FloatArray, added: tuple[FloatArray, FloatArray] | None) -> Points:
    """Return Points with other loads and, if ``added``, one more column in front."""
    def front(surface: FloatArray, column: FloatArray | None = None) -> FloatArray:
        if added is None:
            return surface
        column = surface[:, 0] if column is None else column
        return np.column_stack([column, surface])

    extrapolated, doubt = added if added is not None else (None, None)
    spread = points.load_u_n if added is None else np.concatenate(
        [points.load_u_n[:1], points.load_u_n])
    return Points(points.pressure_gauge_pa, load, spread, front(points.strain, extrapolated),
                  front(points.half_distance), front(points.noise), front(points.settling),
                  front(points.reading, doubt))

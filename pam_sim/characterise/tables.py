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
Static points measured by others, from a CSV file.

Two kinds. A force map: gauge pressure, length (or contraction) and force; forces of
a slack muscle are censored, they say that it did not pull. A contraction
table: gauge pressure, load and contraction. Lines that begin with ``#`` are
kept as the source.
"""

from collections.abc import Callable
from dataclasses import dataclass
import re

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.characterise.fixed_load import FixedLoad, SCATTER_N
from pam_sim.characterise.holds import Hold
from pam_sim.characterise.isobars import isobars_of, loads_of
from pam_sim.characterise.points import Points
from pam_sim.characterise.slack import slack_points
from pam_sim.errors import InputError
from pam_sim.files import StrPath
from pam_sim.muscle.force_maps import ForceMap
from pam_sim.muscle.lookup_table import read_commented_csv
from pam_sim.short_repr import short_repr
from pam_sim.units import INCH_M, KGF_N, LBF_N, P_ATM_PA, PSI_PA

# Column name in lower case -> (quantity, factor to SI).
COLUMNS = {
    'pressure_pa': ('pressure', 1.0), 'pressure_gauge_pa': ('pressure', 1.0),
    'pressure_kpa': ('pressure', 1e3), 'pressure_gauge_kpa': ('pressure', 1e3),
    'length_m': ('length', 1.0), 'length_mm': ('length', 1e-3),
    'contraction_m': ('contraction', 1.0), 'contraction_mm': ('contraction', 1e-3),
    'strain': ('strain', 1.0), 'contraction_percent': ('strain', 0.01),
    'force_n': ('force', 1.0), 'load_n': ('load', 1.0),
    'contraction_u_m': ('contraction_u', 1.0), 'contraction_u_mm': ('contraction_u', 1e-3),
    'load_u_n': ('load_u', 1.0), 'drift_m': ('drift', 1.0), 'pressure_u_pa': ('pressure_u', 1.0),
    **{f'pressure_{kind}{unit}': ('pressure', pa) for kind in ('', 'gauge_')
       for unit, pa in (('bar', 1e5), ('mpa', 1e6), ('psi', PSI_PA))},
    'length_cm': ('length', 1e-2), 'length_in': ('length', INCH_M),
    'contraction_cm': ('contraction', 1e-2), 'contraction_in': ('contraction', INCH_M),
    'contraction_%': ('strain', 0.01), 'strain_%': ('strain', 0.01),
    **{f'{name}_{unit}': (name, newton) for name in ('force', 'load') for unit, newton in (
        ('kn', 1e3), ('kg', KGF_N), ('kgf', KGF_N), ('lbf', LBF_N), ('lb', LBF_N),
        ('lbs', LBF_N))},
}
_OF_PRESSURE = re.compile(r'(?:\w*[_ ])?[\d.,]+[_ ]*(?:pa|kpa|mpa|bar|psi)')      # `2_bar`
_IN_BRACKETS = re.compile(r'[\s_]*[\[(]\s*([^\])]*?)\s*[\])]$')
# From about the atmosphere on, rows so close to the lowest pressure, moved by less than a share.
NEAR_ATMOSPHERE_PA, LEVEL_PA, RESTS = 5e3, 3e3, 0.02
RowsOf = Callable[[StrPath], tuple[list[list[str]], str]]


@short_repr
@dataclass(frozen=True)
class MeasuredTable:
    """
    A table as read: columns in SI by quantity, its source lines, ``branch`` where given.

    ``kind`` is ``force map`` or ``contraction table``.
    """

    kind: str
    columns: dict[str, FloatArray]
    branch: list[str]
    source: str
    path: str


def read_measured_table(path: StrPath, rows_of: RowsOf = read_commented_csv) -> MeasuredTable:
    """
    Return the MeasuredTable of a CSV file.

    Parameters
    ----------
    path : path
        The file.
    rows_of : callable
        Returns (rows of cells, text of the ``#`` lines) of a file; by default of one with commas
        between the columns and decimal points.

    Raises
    ------
    InputError
        File missing, unknown or missing column, two of one quantity, a cell that is no
        number, a negative pressure, pressures that seem absolute.

    """
    rows, source = rows_of(path)
    head = [_plain(name) for name in rows[0]] if rows else []
    unknown = [name for name in head if name not in COLUMNS and name != 'branch']
    if not rows:
        raise InputError('holds no table', str(path))
    if len(head) == 1 and (sign := next((one for one in ';\t|' if one in head[0]), None)):
        raise InputError(f'separates columns by {sign!r}; write commas, and decimal points in the '
                         'numbers', str(path))
    if len(pressures := [one for one in head if _OF_PRESSURE.fullmatch(one)]) > 1:
        raise InputError(
            f'has a column for each pressure, such as `{rows[0][head.index(pressures[0])]}`; '
            'write a row for each point, with columns such as pressure_bar, '
            f'{head[0] if head[0] in COLUMNS else "length_mm"}, force_N', str(path))
    if unknown:
        raise InputError(
            f'has the column `{unknown[0]}`; known are {", ".join(COLUMNS)}, branch', str(path))
    first: dict[str, str] = {}
    for name in head:
        quantity = COLUMNS[name][0] if name in COLUMNS else name
        if quantity in first:
            raise InputError(f'states {quantity} twice, `{first[quantity]}` and `{name}`; allowed '
                             'is one column of each', str(path))
        first[quantity] = name
    cells: dict[str, list[float]] = {COLUMNS[name][0]: [] for name in head if name != 'branch'}
    branch: list[str] = []
    for number, row in enumerate(rows[1:], 1):
        if len(row) != len(head):
            raise InputError(f'has {len(row)} cells in data row {number}, not {len(head)}',
                             str(path))
        for name, cell in zip(head, row):
            if name == 'branch':
                branch.append(cell.strip())
                continue
            try:
                value = float(cell) * COLUMNS[name][1]
            except ValueError:
                value = float('nan')
            if not np.isfinite(value):
                raise InputError(f'data row {number}, `{name}`: {cell!r} is no number', str(path))
            cells[COLUMNS[name][0]].append(value)
    columns = {name: np.array(values) for name, values in cells.items()}
    have = set(columns)
    way = have & {'length', 'contraction', 'strain'}
    kind = 'force map' if 'force' in have else 'contraction table' if 'load' in have else None
    if kind is None or not way or 'pressure' not in have or len(rows) < 2:
        raise InputError(
            f'needs pressure, length or contraction, and force or load; has {", ".join(head)}',
            str(path))
    if np.any(columns['pressure'] < -1e3):
        raise InputError('has a negative pressure; pressures are gauge', str(path))
    _check_gauge(columns, first['pressure'], str(path))
    return MeasuredTable(kind, columns, branch, source, str(path))


def _plain(name: str) -> str:
    """Return the name of a column as it is known: ``pressure_kpa`` for ``Pressure [kPa]``."""
    return re.sub(r'\s+', '_', _IN_BRACKETS.sub(r'_\1', name.strip()).lower())


def _check_gauge(columns: dict[str, FloatArray], name: str, path: str) -> None:
    """Refuse pressures from the atmosphere on, at which nothing pulls, unless called gauge."""
    pressure = columns['pressure']
    lowest_pa = float(pressure.min())
    if 'gauge' in name or abs(lowest_pa - P_ATM_PA) > NEAR_ATMOSPHERE_PA:
        return
    what = next(one for one in ('force', 'contraction', 'strain', 'length') if one in columns)
    moved = columns[what].max() - columns[what] if what == 'length' else columns[what]
    if moved[pressure <= lowest_pa + LEVEL_PA].max() < RESTS * moved.max():
        raise InputError(
            f'`{name}` begins at {1e-3 * lowest_pa:.4g} kPa, where the muscle does nothing, so it '
            f'seems absolute; take {P_ATM_PA:g} Pa off, or call it '
            f'`{name.replace("pressure", "pressure_gauge")}` if it is gauge', path)


def strain_of(table: MeasuredTable, length_m: float) -> FloatArray:
    """Return the contraction (fraction) of every row, for a length at rest [m]."""
    columns = table.columns
    if 'strain' in columns:
        strain = columns['strain']
    elif 'contraction' in columns:
        strain = columns['contraction'] / length_m
    else:
        strain = 1.0 - columns['length'] / length_m
    if np.any(strain < -0.1) or np.any(strain > 0.9):
        raise InputError(
            f'contractions of {100 * strain.min():.0f} to {100 * strain.max():.0f} % of the '
            f'length of {length_m:g} m are impossible', table.path)
    return strain


def map_of(table: MeasuredTable, length_m: float) -> ForceMap:
    """
    Return the ForceMap of a table of kind ``force map``, for a length at rest [m].

    The forces of rows at one pressure and contraction are averaged.
    """
    force = table.columns['force']
    pressure, strain = table.columns['pressure'], strain_of(table, length_m)
    points, place = np.unique(
        np.column_stack([pressure, strain]), axis=0, return_inverse=True)
    if len(points) < force.size:
        place = place.ravel()
        force = np.bincount(place, force) / np.bincount(place)
        pressure, strain = points.T
    return ForceMap(table.path, length_m, pressure, strain, force,
                    slack_points(pressure, strain, force))


def loads_of_table(table: MeasuredTable, length_m: float) -> list[FixedLoad]:
    """Return the FixedLoads of a contraction table, one per load that it lists."""
    columns, strain = table.columns, strain_of(table, length_m)
    zeros = np.zeros_like(strain)
    contraction = columns.get('contraction', strain * length_m)
    branch = table.branch or ['up'] * strain.size
    wrong = [name for name in branch if name not in ('up', 'down')]
    if wrong:
        raise InputError(f'has the branch {wrong[0]!r}; allowed: up, down', table.path)
    smallest_n = columns['load'].min()
    # A load cell may read a little below 0 N without a load.
    if smallest_n < -SCATTER_N:
        raise InputError(f'has a load of {smallest_n:g} N; pull is positive, allowed is 0 N or '
                         'more', table.path)
    loads = []
    for load in np.unique(columns['load']):
        rows = np.flatnonzero(columns['load'] == load)
        holds = [Hold(
            0.0, 0.0, columns['pressure'][k], contraction[k], float('nan'),
            columns.get('pressure_u', zeros)[k], columns.get('contraction_u', zeros)[k], 0.0,
            columns.get('drift', zeros)[k], branch[k], True) for k in rows]
        if len({round(hold.pressure_gauge_pa / 3e3) for hold in holds}) < 3:
            raise InputError(f'has fewer than 3 pressures at {load:g} N', table.path)
        loads.append(FixedLoad(float(load), float(columns.get('load_u', zeros)[rows].mean()),
                               'table', length_m, holds, [], table.path))
    return loads


def points_of_map(table: MeasuredTable, length_m: float, loads_n: FloatArray | None = None,
                  all_forces: bool = True) -> Points:
    """
    Return the Points of a force map: the isobars read at the same loads.

    Parameters
    ----------
    table : MeasuredTable
        A force map.
    length_m : float
        Length at rest.
    loads_n : array_like, optional
        Ascending from 0; by default those that keep the isobars, see ``loads_of``.
    all_forces : bool
        Whether these keep the measured forces between the ends of the isobars.

    Raises
    ------
    InputError
        Fewer than 3 pressures, no force, or none at any contraction.

    """
    measured = map_of(table, length_m)
    pulling = np.count_nonzero(~measured.censored)
    levels = np.unique(measured.pressure_gauge_pa)
    if levels.size < 3 or not pulling:
        raise InputError(f'has {levels.size} pressures and {pulling} points with a force; '
                         '3 pressures or more are needed', table.path)
    isobars = isobars_of(measured)
    if not any(one.load_n.size for one in isobars):
        raise InputError('the muscle does not contract at any pressure', table.path)
    if loads_n is None:
        loads_n = loads_of(isobars, all_forces)
    eps, doubt = (np.array(part) for part in zip(*(
        one.contraction(loads_n) for one in isobars)))
    nothing = np.zeros_like(eps)
    return Points(levels, np.asarray(loads_n, dtype=float), np.zeros(len(loads_n)), eps,
                  np.full_like(eps, np.nan), nothing, nothing, doubt)

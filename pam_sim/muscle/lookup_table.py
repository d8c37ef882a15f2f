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

"""The table behind the lookup law: contraction and air mass against pressure and load."""

from collections.abc import Callable, Iterable
import csv
from dataclasses import dataclass
import os
from pathlib import Path
import re
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.files import refuse_pipe, whole_file
from pam_sim.short_repr import short_repr
from pam_sim.units import absolute_pa, GAS_CONSTANT_AIR, TEMPERATURE_K

if TYPE_CHECKING:
    from pam_sim.muscle.law import MuscleLaw

COLUMNS = ('pressure_gauge_pa', 'load_n', 'strain', 'air_mass_kg')
_DEAD_VOLUME = re.compile(r'dead volume ((?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?) mL')


@short_repr
@dataclass(frozen=True, eq=False)
class LookupTable:
    """
    Static points on a full grid of pressure and load.

    Parameters
    ----------
    pressure_gauge_pa : ndarray
        Ascending, shape (P,), P >= 4.
    load_n : ndarray
        Ascending from 0, shape (L,), L >= 4.
    strain, air_mass_kg : ndarray
        Shape (P, L). Contraction rises with pressure and falls with load (or
        rests at 0); air mass rises with pressure.
    source : str
        What the points are. ``dead volume 3 mL`` in it says whose air is in ``air_mass_kg``
        besides that of the muscle.

    Raises
    ------
    InputError
        Wrong shape, not finite, axis not ascending, or points that break
        these rules.

    """

    pressure_gauge_pa: np.ndarray
    load_n: np.ndarray
    strain: np.ndarray
    air_mass_kg: np.ndarray
    source: str = ''

    def __post_init__(self) -> None:
        for name in COLUMNS:
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=float))
            if not np.all(np.isfinite(getattr(self, name))):
                raise InputError('must hold finite numbers only', f'lookup table, {name}')
        shape = (self.pressure_gauge_pa.size, self.load_n.size)
        for name in COLUMNS[:2]:
            axis = getattr(self, name)
            if axis.ndim != 1 or axis.size < 4 or np.any(np.diff(axis) <= 0) or axis[0] < 0:
                raise InputError('needs at least 4 ascending values, none negative',
                                 f'lookup table, {name}')
        for name in COLUMNS[2:]:
            if getattr(self, name).shape != shape:
                raise InputError(f'has shape {getattr(self, name).shape}; expected {shape}',
                                 f'lookup table, {name}')
        if self.load_n[0] != 0.0:
            raise InputError('must begin with 0 N', 'lookup table, load_n')
        if np.any(self.strain < 0.0) or np.any(self.strain >= 0.9):
            raise InputError('contraction must be from 0 to 0.9', 'lookup table, strain')
        if np.any(np.diff(self.strain, axis=0) < 0.0) or np.any(np.diff(self.strain, axis=1) > 0):
            raise InputError('contraction must not fall with pressure nor rise with load',
                             'lookup table, strain')
        if np.any(self.air_mass_kg <= 0) or np.any(np.diff(self.air_mass_kg, axis=0) <= 0.0):
            raise InputError('air mass must be positive and rise with pressure',
                             'lookup table, air_mass_kg')

    @property
    def dead_volume_m3(self) -> float | None:
        """Volume [m^3] of tube and fittings whose air is in the table; None if no number is."""
        found = _DEAD_VOLUME.search(self.source)
        return 1e-6 * float(found[1]) if found else None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, LookupTable) and self.source == other.source and all(
            np.array_equal(getattr(self, name), getattr(other, name)) for name in COLUMNS)

    __hash__ = None     # type: ignore[assignment]  # that is how Python says `not hashable`

    def write_csv(self, path: Path) -> None:
        """Write the table, one line per point, atomically; the source goes into a comment."""
        with whole_file(path) as temporary, \
                open(temporary, 'w', newline='', encoding='utf-8') as stream:
            for line in self.source.splitlines():
                stream.write(f'# {line}\n')
            writer = csv.writer(stream)
            writer.writerow(COLUMNS)
            for i, pressure in enumerate(self.pressure_gauge_pa):
                for j, load in enumerate(self.load_n):
                    writer.writerow([repr(float(value)) for value in (
                        pressure, load, self.strain[i, j], self.air_mass_kg[i, j])])


def lines_and_source(lines: Iterable[str]) -> tuple[list[str], str]:
    """Return (lines that hold cells, text of the ``#`` lines) of a table."""
    held = [line for line in lines if line.strip()]
    source = '\n'.join(line[1:].strip() for line in held if line.startswith('#'))
    return [line for line in held if not line.startswith('#')], source


def read_commented_csv(path: str | os.PathLike[str]) -> tuple[list[list[str]], str]:
    """
    Return (rows, text of the ``#`` lines) of a CSV file.

    Raises
    ------
    InputError
        The file cannot be read as text.

    """
    refuse_pipe(path)
    try:
        lines = Path(path).read_text(encoding='utf-8').splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f'cannot be read as a table: {error}', str(path)) from None
    cells, source = lines_and_source(lines)
    return list(csv.reader(cells)), source


def read_table(path: str | os.PathLike[str]) -> LookupTable:
    """
    Return the LookupTable of a CSV file with the header of ``COLUMNS``; ``#`` lines are source.

    Raises
    ------
    InputError
        File missing, wrong columns, not a number, or points missing from the grid.

    """
    rows, source = read_commented_csv(path)
    if not rows or tuple(rows[0]) != COLUMNS:
        raise InputError(f'first row must be {",".join(COLUMNS)}', str(path))
    try:
        data = np.array([[float(cell) for cell in row] for row in rows[1:]]).reshape(-1, 4)
    except ValueError as error:
        raise InputError(f'holds a cell that is no number: {error}', str(path)) from None
    pressure, i = np.unique(data[:, 0], return_inverse=True)
    load, j = np.unique(data[:, 1], return_inverse=True)
    surfaces = np.full((2, pressure.size, load.size), np.nan)
    surfaces[:, i, j] = data[:, 2:].T
    if len(data) != pressure.size * load.size or np.any(np.isnan(surfaces)):
        raise InputError(f'needs every pair of {pressure.size} pressures and {load.size} loads '
                         f'once; has {len(data)} rows', str(path))
    strain, air_mass_kg = surfaces
    return LookupTable(pressure, load, strain, air_mass_kg, source)


def table_from_law(law: 'MuscleLaw', volume_m3: Callable[..., Any], pressure_gauge_pa: FloatArray,
                   load_n: FloatArray, dead_volume_m3: float = 0.0) -> LookupTable:
    """
    Return the table an ideal experiment on another law would give.

    Parameters
    ----------
    law : MuscleLaw
        Gives the contraction.
    volume_m3 : callable
        Strain array to inner volume [m^3].
    pressure_gauge_pa, load_n : ndarray
        Axes.
    dead_volume_m3 : float
        Added to the volume; the air is at 293.15 K.

    """
    pressure = np.asarray(pressure_gauge_pa, dtype=float)
    load = np.asarray(load_n, dtype=float)
    strain = law.max_strain(pressure[:, None], load[None, :])
    mass = absolute_pa(pressure)[:, None] * (volume_m3(strain) + dead_volume_m3) / (
        GAS_CONSTANT_AIR * TEMPERATURE_K)
    return LookupTable(pressure, load, strain, mass,
                       f'computed from law {law.NAME}, set {law.muscle}; dead volume '
                       f'{1e6 * dead_volume_m3:g} mL; not a measurement')

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

"""A column of the muscle's length: the contraction is what it lacks of the length at rest."""

from dataclasses import dataclass

import numpy as np
from pam_actuation.bags.plausibility import MUSCLE_LENGTH_M, Size
from pam_actuation.tables.mapping import ColumnMap, TableMapping
from pam_actuation.tables.units import LENGTH, Unit, unit_of_text
from pam_sim.annotations import FloatArray
from pam_sim.muscle.geometry import MOST_STRAIN

SHORTEST_M, LONGEST_M = 0.03, 3.0           # of muscles, at rest
LEAST_KEPT = 0.5                            # of the length at rest: no muscle gets shorter
LEAST_MOVE_M = 5e-5
_UNITS = ('mm', 'm', 'in')                  # tried in this order, where none is stated


@dataclass(frozen=True)
class LengthColumn:
    """
    A column that seems to be the length of the muscle.

    Parameters
    ----------
    column : str
        Its name.
    low, high : float
        Smallest and largest value, in the unit of the column.
    maps : tuple of ColumnMap
        How it would be read as a contraction, one for each unit that fits.

    """

    column: str
    low: float
    high: float
    maps: tuple[ColumnMap, ...]

    @property
    def answers(self) -> tuple[str, ...]:
        """Return unit, zero and gain of each, as they stand in ``--map`` after the column."""
        return tuple(one.words for one in self.maps)

    @property
    def question(self) -> str:
        """Return what only the user knows of it, in one sentence."""
        return (f'column "{self.column}", {self.low:.4g} to {self.high:.4g}, seems to be the '
                'length of the muscle, of which its contraction follows: is the zero, its length '
                f'at rest, the largest length seen, {self.high:.4g} (a guess to be checked)?')


def length_column(column: str, values: FloatArray, unit_text: str) -> LengthColumn | None:
    """
    Return how a column is read as the length of a muscle; None where its range is of none.

    Parameters
    ----------
    column : str
        Its name.
    values : ndarray
        Its numbers, shape (rows,).
    unit_text : str
        The unit that the file states, '' where it states none.

    """
    finite = values[np.isfinite(values)]
    if not len(finite):
        return None
    low, high = float(finite.min()), float(finite.max())
    if low < LEAST_KEPT * high:
        return None
    units = [unit_of_text(one, LENGTH) for one in ([unit_text] if unit_text else _UNITS)]
    fitting = [unit for unit in units if unit is not None and _fits(low, high, unit)]
    maps = tuple(ColumnMap(column, unit, zero=float(f'{high:.4g}'), gain=-1.0)
                 for unit in fitting)
    return LengthColumn(column, low, high, maps) if maps else None


def size_of_mapping(mapping: TableMapping) -> Size:
    """Return the size of the longest muscle that a mapping tells by a zero; else the usual one."""
    longest_m = max((one.zero * one.unit.factor * -one.gain
                     for name, one in mapping.signals.items()
                     if name.endswith('contraction') and one.gain < 0.0), default=0.0)
    return Size(longest_m, MOST_STRAIN, 'length') if longest_m > MUSCLE_LENGTH_M else Size()


def _fits(low: float, high: float, unit: Unit) -> bool:
    return (SHORTEST_M <= high * unit.factor <= LONGEST_M
            and (high - low) * unit.factor >= LEAST_MOVE_M)

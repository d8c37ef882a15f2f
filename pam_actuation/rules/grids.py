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
Tables of rules as grids of two axes, in the units people read.

Every presentation draws these: a table over two axes is one grid, one over a
direction and two more axes is a grid per direction. Nothing here knows a table
by its name.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.control.sofc.membership import SET_NAMES, SET_WORDS
from pam_actuation.control.sofc.words import DIRECTION, number, shown
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.errors import InputError
from pam_sim.short_repr import short_repr

if TYPE_CHECKING:
    from pam_actuation.control.sofc.rule_table import Antecedent, RuleBase, RuleTable

SHOWN_KPA = 0.005          # what two digits of a number show
_SHORT = dict(zip(SET_WORDS, SET_NAMES))


@short_repr
@dataclass(frozen=True)
class Axis:
    """
    One axis of a grid.

    ``values`` are the knots in ``unit`` (for people), ``names`` the short names of sets, or
    empty; ``labels`` say both.
    """

    name: str
    unit: str
    values: FloatArray
    names: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """Name with unit."""
        return f'{self.name} [{self.unit}]' if self.unit else self.name

    @property
    def labels(self) -> tuple[str, ...]:
        """One text per knot."""
        if not self.unit:
            return self.names
        texts = [number(value) for value in self.values]
        return tuple(f'{name} {text}' for name, text in zip(self.names, texts)) \
            if self.names else tuple(texts)


@short_repr
@dataclass(frozen=True)
class Grid:
    """
    One grid of rules, shape (len(rows.values), len(columns.values)).

    ``values`` and ``before`` are outputs now and before [kPa], ``fired_s`` how long each
    rule acted [s].
    """

    title: str
    rows: Axis
    columns: Axis
    values: FloatArray
    before: FloatArray
    fired_s: FloatArray

    @property
    def change(self) -> FloatArray:
        """Return what was changed [kPa]."""
        return self.values - self.before

    @property
    def never(self) -> BoolArray:
        """Which rules never fired."""
        return self.fired_s <= 0.0

    def firing(self, mark: str = '') -> str:
        """
        Return in words how many rules never fired, ``mark`` being how these are marked.

        Running changes only rules that fired. Where others differ, it says where from.
        """
        never, size = int(self.never.sum()), self.never.size
        text = f'None of the {size} rules has fired' if never == size \
            else f'{never} of {size} rules never fired{mark}'
        came = int(np.sum(self.never & (np.abs(self.change) >= SHOWN_KPA)))
        return text if not came else (
            f'{text}; {came} of them differ all the same: they came so from tuning or from '
            'another file, not from running')


def grids(rules: 'RuleBase', before: 'RuleBase | None' = None) -> list[Grid]:
    """
    Return all rules of a rule base as grids.

    Parameters
    ----------
    rules : RuleBase
        What is shown.
    before : RuleBase, optional
        What changes are counted against; by default the initial rules kept in ``rules``.

    Raises
    ------
    InputError
        The two have not the same antecedents.

    """
    earlier: Sequence[RuleTable | None] = [None] * len(rules.tables())
    if before is not None:
        check_comparable(rules, before)
        earlier = before.tables()
    rate_hz = rules.scaling.get('rate_hz', 1.0)
    return [grid for table, other in zip(rules.tables(), earlier)
            for grid in _of_table(table, other, rate_hz)]


def check_comparable(rules: 'RuleBase', other: 'RuleBase') -> None:
    """Raise InputError unless the rules of two bases stand for the same places."""
    mine, theirs = (one.tables() for one in (rules, other))
    for table, second in zip(mine, theirs):
        for a, b in zip(table.antecedents, second.antecedents):
            if len(a.knots) != len(b.knots):
                raise InputError(
                    f'cannot be compared: {table.name} rules have {len(b.knots)} knots of '
                    f'{a.name} there and {len(a.knots)} here')
            if not np.allclose(a.knots, b.knots, rtol=1e-9, atol=0.0):
                raise InputError(
                    f'cannot be compared: the {a.name} of the {table.name} rules runs from '
                    f'{_span(b)} there and from {_span(a)} here')


def _span(antecedent: 'Antecedent') -> str:
    ends = [shown(float(antecedent.knots[k]), antecedent.unit) for k in (0, -1)]
    return f'{number(ends[0][0])} to {number(ends[1][0])} {ends[1][1]}'.rstrip()


def _of_table(table: 'RuleTable', other: 'RuleTable | None', rate_hz: float) -> list[Grid]:
    """Return the grids of one table."""
    now = table.values * table.scale * 1e-3
    then = (table.initial * table.scale if other is None else other.values * other.scale) * 1e-3
    arrays = [now, then, table.fired / rate_hz]
    axes = [_axis(antecedent) for antecedent in table.antecedents]
    if len(axes) == 1:
        axes.append(Axis('', '', np.zeros(1), ('',)))
        arrays = [array[:, None] for array in arrays]
    if len(axes) == 2:
        # Directions side by side, knots below each other.
        if axes[0].name == DIRECTION:
            axes, arrays = axes[::-1], [array.T for array in arrays]
        return [_grid(f'{table.name} rules', axes, arrays)]
    return [_grid(f'{table.name} rules, {name}', axes[1:], [array[d] for array in arrays])
            for d, name in enumerate(axes[0].names)]


def _grid(title: str, axes: list[Axis], arrays: list[FloatArray]) -> Grid:
    (rows, columns), (values, before, fired_s) = axes, arrays
    return Grid(title, rows, columns, values, before, fired_s)


def _axis(antecedent: 'Antecedent') -> Axis:
    values, unit = shown(np.asarray(antecedent.knots, dtype=float), antecedent.unit)
    return Axis(antecedent.name, unit, values,
                tuple(_SHORT.get(word, word) for word in antecedent.words))


def counted(found: Sequence[Grid], since: str) -> str:
    """
    Return in words how many rules there are, how many never fired, and how many differ.

    Parameters
    ----------
    found : sequence of Grid
        All grids of the rules.
    since : str
        What they are compared with, in words.

    """
    count = sum(grid.values.size for grid in found)
    never = sum(int(grid.never.sum()) for grid in found)
    changed = sum(int(np.sum(grid.change != 0.0)) for grid in found)
    largest = max(float(np.max(np.abs(grid.change))) for grid in found)
    text = f'{count} rules, {never} never fired, '
    if not changed:
        return f'{text}none differs from {since}'
    return f'{text}{changed} differ from {since} (by up to {largest:.2f} kPa)'

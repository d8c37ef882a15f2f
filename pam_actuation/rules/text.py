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

"""Rules in the terminal: aligned grids, coloured where there are colours, and sentences."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.control.sofc.words import number
from pam_actuation.rules.grids import Grid, SHOWN_KPA as _LEAST_KPA
from pam_sim.annotations import BoolArray

if TYPE_CHECKING:
    from pam_actuation.rules.source import FoundRules
    from pam_actuation.rules.view import View

NEVER = '·'
_GAP = 2
_CHANGED = 'changed by'
_FEW = 2                  # columns that leave room for changes and firing beside them
# 256-colour codes from little to much: adding pressure towards orange, taking off towards blue.
_ADD, _TAKE = (223, 215, 208, 202), (153, 111, 69, 33)
_DIM, _PLAIN = '\x1b[2m', '\x1b[0m'


def as_text(found: 'FoundRules', view: 'View', top: int, width: int = 99,
            colour: bool = False) -> str:
    """
    Return rules as text for a terminal.

    Parameters
    ----------
    found : FoundRules
        Where they come from.
    view : View
        Grids and sentences.
    top : int
        How many sentences.
    width : int
        Columns of the terminal; wide grids are broken into blocks.
    colour : bool
        Whether the terminal has colours.

    """
    lines = [f'{found.title} ({found.kind}), {view.summary()}', *found.remarks, *view.remarks]
    for grid in view.grids:
        lines += ['', *_grid(grid, view.since, width, colour)]
    lines += ['', *_sentences(view, top)]
    return '\n'.join(lines)


def _grid(grid: Grid, since: str, width: int, colour: bool) -> list[str]:
    """Return the lines of one grid: values, then changes and firing where there are any."""
    shown, rows, columns = _trimmed(grid)
    if not shown.any():
        return [f'{grid.title}: all zero, never fired']
    title = (f'{grid.title}, kPa: {grid.rows.title} downwards'
             + (f', {grid.columns.title} across' if grid.columns.name else ''))
    legend = _legend(grid, since, rows, columns)
    below = [f'  ({"; ".join(legend)})'] if legend else []
    parts = _parts(grid, rows, columns, colour)
    names = [grid.columns.labels[c] for c in columns]
    labels = [grid.rows.labels[r] for r in rows]
    if len(columns) <= _FEW:
        against = f'; changes against {since}' if _CHANGED in parts else ''
        heads = [what or name for name in names for what in parts]
        cells = [[part[row][c] for c in range(len(columns)) for part in parts.values()]
                 for row in range(len(rows))]
        return [title + against, *below, *_block(labels, heads, cells, width)]
    lines = [title, *below]
    for what, part in parts.items():
        if what:
            against = f', kPa, against {since}' if what == _CHANGED else ''
            lines.append(f'{grid.title}, {what}{against}')
        lines += _block(labels, names, part, width)
    return lines


def _legend(grid: Grid, since: str, rows: range, columns: range) -> list[str]:
    """Return what is to be said of the marks of a grid and of what it leaves out."""
    legend = [f'{NEVER} never fired'] if grid.never[np.ix_(rows, columns)].any() else []
    if (grid.never & (np.abs(grid.change) >= _LEAST_KPA)).any() and grid.before.any():
        legend.append(grid.firing())
    if grid.change.any() and not grid.before.any():
        legend.append(f'all zero in {since}')
    left_out = grid.values.size - len(rows) * len(columns)
    if left_out:
        legend.append(f'{left_out} rules at the borders are zero and never fired')
    return legend


def _parts(grid: Grid, rows: range, columns: range, colour: bool
           ) -> dict[str, list[list[tuple[str, str]]]]:
    """Return the cells by what they say, '' for the values; what says nothing is left out."""
    limit, largest = (float(np.max(np.abs(one))) for one in (grid.values, grid.change))
    parts = {'': _part(rows, columns, lambda r, c: _value(
        float(grid.values[r, c]), bool(grid.never[r, c]), limit, colour))}
    if largest >= _LEAST_KPA and grid.before.any():
        parts[_CHANGED] = _part(rows, columns, lambda r, c: _value(
            float(grid.change[r, c]), abs(float(grid.change[r, c])) < _LEAST_KPA, largest, colour,
            ''))
    if not grid.never.all():
        parts['fired, s'] = _part(
            rows, columns, lambda r, c: _seconds(float(grid.fired_s[r, c]), colour))
    return parts


def _part(rows: range, columns: range,
          cell: Callable[[int, int], tuple[str, str]]) -> list[list[tuple[str, str]]]:
    """Return one cell, (plain, painted), per rule that is shown."""
    return [[cell(r, c) for c in columns] for r in rows]


def _trimmed(grid: Grid) -> tuple[BoolArray, range, range]:
    """Return what is worth showing, and the rows and columns between whose ends it lies."""
    shown = ~grid.never | (grid.values != 0.0) | (grid.change != 0.0)
    ends = []
    for axis in (1, 0):
        places = np.flatnonzero(shown.any(axis=axis))
        ends.append(range(places[0], places[-1] + 1) if len(places) else range(0))
    rows, columns = ends
    return shown, rows, columns


def _block(labels: list[str], names: list[str], cells: list[list[tuple[str, str]]],
           width: int) -> list[str]:
    """Return the lines of a table, broken into blocks of columns that fit the width."""
    head = max(map(len, labels))
    size = max([len(plain) for row in cells for plain, _ in row] + [*map(len, names)])
    fit = max((width - head - _GAP) // (size + _GAP), 1)
    lines = []
    for begin in range(0, len(names), fit):
        part = slice(begin, begin + fit)
        lines.append(' ' * (head + _GAP) + ''.join(
            name.rjust(size + _GAP) for name in names[part]))
        for label, row in zip(labels, cells):
            lines.append((' ' * _GAP + label.rjust(head) + ''.join(
                ' ' * (_GAP + size - len(plain)) + painted
                for plain, painted in row[part])).rstrip())
    return lines


def _value(value: float, dim: bool, limit: float, colour: bool,
           mark: str = NEVER) -> tuple[str, str]:
    """Return a number as (plain, painted) text; what never fired is marked."""
    plain = f'{value:+.2f}' if abs(value) >= _LEAST_KPA else '0'
    plain += mark if dim else ' ' * len(mark)
    return plain, _painted(plain, value / limit if limit else 0.0, dim) if colour else plain


def _seconds(value: float, colour: bool) -> tuple[str, str]:
    if value <= 0.0:
        return NEVER, f'{_DIM}{NEVER}{_PLAIN}' if colour else NEVER
    plain = '<0.01' if value < 0.01 else f'{value:.2f}' if value < 10.0 else number(value)
    return plain, plain


def _painted(plain: str, share: float, dim: bool) -> str:
    """Return a text in the colour of a share -1 to 1 of the largest size."""
    if dim:
        return f'{_DIM}{plain}{_PLAIN}'
    scale = _ADD if share > 0.0 else _TAKE
    step = min(int(abs(share) * len(scale)), len(scale) - 1)
    return plain if share == 0.0 else f'\x1b[38;5;{scale[step]}m{plain}{_PLAIN}'


def _sentences(view: 'View', top: int) -> list[str]:
    """Return the most important rules in words."""
    spoken = view.spoken[:top]
    if not view.spoken:
        return ['No rule acts: all that fired are zero.']
    if not spoken:
        return []
    if view.fired:
        lines = [f'The {len(spoken)} most important of {len(view.spoken)} rules that acted '
                 '(firing times size), with their share of the whole:']
        total = sum(one.importance_pa_s for one in view.spoken)
        return lines + [f'  {100.0 * one.importance_pa_s / total:5.1f} %  {one.sentence}'
                        for one in spoken]
    lines = [f'No rule has fired yet; the {len(spoken)} largest of {len(view.spoken)}:']
    return lines + [f'  {one.sentence}' for one in spoken]

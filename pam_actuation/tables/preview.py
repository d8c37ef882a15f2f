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

"""What a table holds and how it would be read, as lines for people."""

from collections.abc import Collection, Mapping
import re
from typing import Any

import numpy as np
from pam_actuation.tables.clock import clock_of, FEWEST_RISING, own_time, time_column
from pam_actuation.tables.day_and_time import pair_of
from pam_actuation.tables.guess import (
    BELOW_ATMOSPHERE, falls_below_atmosphere, Guess, plausible_units, unit_of_column)
from pam_actuation.tables.lengths import length_column
from pam_actuation.tables.mapping import usual_unit
from pam_actuation.tables.parts import likely_signals, measured_by, name_of_parts
from pam_actuation.tables.questions import needs_gain
from pam_actuation.tables.signals import are_of_joint, BY_NAME
from pam_actuation.tables.table import Table
from pam_actuation.tables.units import (
    ABSOLUTE, DATE, form_of, GAUGE, PRESSURE, unit_of_text, VOLTAGE)
from pam_actuation.tables.words import words_of
from pam_actuation.topics.table import OF_A_RUN, short_name
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.units import P_ATM_PA

_MOST_COLUMNS = 60
_MOST_KPA = 2e3                      # no muscle stands more
# Words of a likely column, and the gain of a sensor of 4 to 20 mA (10 bar, 100 mm).
_EXAMPLES = {'pressure': (r'\bp\b|press', 62.5),
             'contraction': (r'\bx\b|dist|pos|disp|stroke|contract', 6.25)}


def preview(tables: Collection[Table], found: Guess, missing: Collection[str] = ()) -> str:
    """
    Return a line for each column: number, name, range, first values, and the signal it is.

    Parameters
    ----------
    tables : collection of Table
        Of one recording.
    found : Guess
        How they are read.
    missing : collection of str
        Texts that stand for missing values.

    """
    lines = []
    for table in tables:
        rows_are = f'{table.topic}, {len(table)} messages' if table.topic else f'{len(table)} rows'
        lines.append(f'{table.source}: {rows_are}, {len(table.columns)} columns')
        rows = [('', 'column', 'lowest', 'highest', 'first', 'read as')]
        rows += [(f'#{number}', one['column'], *_range(one), one['first'], one['read_as'] or '–')
                 for number, one in enumerate(
                     described(table, found, missing, _MOST_COLUMNS), 1)]
        if len(table.columns) > _MOST_COLUMNS:
            rows.append(('', f'and {len(table.columns) - _MOST_COLUMNS} more', '', '', '', ''))
        widths = [max(len(row[place]) for row in rows) for place in range(5)]
        lines += ['  ' + '  '.join(f'{cell:{width}}' for cell, width in zip(row, widths))
                  + f'  {row[5]}' for row in rows]
    return '\n'.join(lines)


def described(table: Table, found: Guess, missing: Collection[str] = (),
              most: int | None = None) -> list[dict[str, Any]]:
    """
    Return what is known of each column of a table, as plain data.

    Parameters
    ----------
    table : Table
        The table.
    found, missing
        As ``preview``.
    most : int, optional
        Of so many columns.

    Returns
    -------
    list of dict
        ``column`` (name), ``lowest`` and ``highest`` (None where there is no number), ``first``
        (value as text), ``is_text``, ``read_as`` ('' where it is not read).

    """
    meant = _meaning(table, found)
    return [{'column': name, **_facts(table, name, missing), 'read_as': meant.get(name, '')}
            for name in list(table.columns)[:most]]


def time_problems(tables: Collection[Table], found: Guess, sort: bool = False,
                  part: int = 0) -> list[str]:
    """Return a sentence for each table whose time cannot be read, if a signal is in the table."""
    columns = [one.column for one in found.mapping.signals.values()] + [
        one.column for one in found.questions if one.column]
    problems = []
    for table in tables:
        if any(table.name_of(one) is not None for one in columns) or len(tables) == 1:
            try:
                clock_of(table, own_time(table, tables, found.mapping), sort=sort, part=part)
            except InputError as error:
                problems.append(str(error))
    return problems


def questions_text(found: Guess) -> str:
    """Return what only the user knows, a line for each question."""
    return '\n'.join(f'? {one.text}\n    {one.options()}' for one in found.questions)


def question_sentence(found: Guess) -> str:
    """Return the questions as one sentence, for the end of a call that cannot ask."""
    return ' '.join(f'{one.text} Add {one.options()}, or --leave-out "{one.column or "COLUMN"}".'
                    for one in found.questions)


def how_to_begin(tables: Collection[Table], found: Guess) -> str:
    """
    Return the words of the command line that begin a mapping, with columns of the file.

    A column goes with a signal only where its unit, if the file states one, is one of the signal.
    The name of a topic counts before names of its fields, and these before units.
    """
    left = {column: table for table in tables if not _is_of_internals(table)
            for column in unread([table], found) if not _is_constant(table, column)}
    said: dict[str, str] = {}
    times = [one for strictly in (True, False) for one, table in left.items()
             if _is_a_time(table, one, found, strictly)]
    if times:
        del left[times[0]]
    left = {one: table for one, table in left.items()
            if not _counts_rows(table, one, found) and 'header' not in words_of(one).split()}
    for fits in (_has_the_topic, _is_likely, _is_called, _has_the_unit, _has_no_unit):
        for signal in ('pressure', 'contraction', 'force', 'ppr_voltage'):
            column = next((one for one, table in left.items() if signal not in said
                           and fits(table, one, signal)), None)
            if column is not None:
                said[signal] = _option(left.pop(column), column, signal)
    words = [said[one] for one in BY_NAME if one in said] or ['--map SIGNAL="COLUMN:UNIT"']
    return ' '.join([*(f'--map time="{one}:s"' for one in times[:1]), *words])


def may_be_signals(tables: Collection[Table], found: Guess) -> list[str]:
    """Return an option for each column that is not read and may be a signal that is missing."""
    known = {*found.mapping.signals, *(name for one in found.questions for name in one.signals)}
    # Of a joint each muscle has its own: `pressure` alone is none.
    missing = {name for name in BY_NAME if name not in known
               and are_of_joint([name]) == are_of_joint(known)}
    return list(dict.fromkeys(
        _option(table, column, signal) for table in tables for column in unread([table], found)
        for signal in _likely(table, column) if signal in missing))


def _likely(table: Table, column: str) -> list[str]:
    return likely_signals(words_of(column), unit_of_column(table, column))


# Each of these returns whether a column may be a signal, the surest first.

def _has_the_topic(table: Table, column: str, signal: str) -> bool:
    return (bool(table.topic) and _has_the_unit(table, column, signal)
            and signal == name_of_parts(words_of(short_name(table.topic))))


def _is_likely(table: Table, column: str, signal: str) -> bool:
    return signal in _likely(table, column)


def _is_called(table: Table, column: str, signal: str) -> bool:
    words, _ = _EXAMPLES.get(signal, ('', 0.0))
    text = unit_of_column(table, column)
    return bool(words and (text in ('', 'mA') or _has_the_unit(table, column, signal))
                and re.search(words, words_of(column)))


def _has_the_unit(table: Table, column: str, signal: str) -> bool:
    text, quantity = unit_of_column(table, column), BY_NAME[signal].quantity
    return quantity != VOLTAGE and bool(text) and unit_of_text(text, quantity) is not None


def _has_no_unit(table: Table, column: str, signal: str) -> bool:
    return signal in _EXAMPLES and unit_of_column(table, column) in ('', 'mA')


def _is_a_time(table: Table, column: str, found: Guess, strictly: bool) -> bool:
    """
    Return whether a column rises from row to row in a table whose time is not known.

    Not strictly, it stands still in less than half of the rows: a time in ms of quicker rows.
    """
    mapping = found.mapping
    if (mapping.rate_hz or table.stamp_ns is not None or unit_of_column(table, column)
            or time_column(table, mapping) is not None):
        return False
    values = _finite(table, column)
    if len(values) != len(table) or len(table) < FEWEST_RISING:
        return False
    steps = np.diff(values)
    return bool((steps > 0.0).all() if strictly else
                (steps >= 0.0).all() and (steps > 0.0).mean() > 0.5)


def _counts_rows(table: Table, column: str, found: Guess) -> bool:
    """Return whether a column without a unit counts the rows, or is the time once more."""
    if unit_of_column(table, column):
        return False
    values, time = _finite(table, column), time_column(table, found.mapping)
    is_count = len(values) >= FEWEST_RISING and bool((np.diff(values) == 1.0).all())
    return is_count or time is not None and table.name_of(time.column) is not None and (
        np.array_equal(values, _finite(table, table.require(time.column))))


def _is_constant(table: Table, column: str) -> bool:
    finite = _finite(table, column)
    return bool(finite.size and (finite == finite[0]).all())


def _is_of_internals(table: Table) -> bool:
    """Return whether a table is a topic of internals, such as the states of a controller."""
    row = OF_A_RUN.get(short_name(table.topic))
    return row is not None and row.internals


def _option(table: Table, column: str, signal: str) -> str:
    """Return how a column is mapped to a signal, in the unit that the file states for it."""
    text, quantity = unit_of_column(table, column), BY_NAME[signal].quantity
    unit = unit_of_text(text, quantity) if text else None
    finite = _finite(table, column)
    length = length_column(column, finite, text) if signal == 'contraction' else None
    if length is not None:
        return length.maps[0].option(signal)
    if unit is None and text and needs_gain(text, quantity) and not (
            text == 'mA' and signal in _EXAMPLES):
        return f'--map {signal}="{column}:{form_of(quantity)}"'
    if unit is None and quantity != VOLTAGE and VOLTAGE in measured_by(words_of(column)):
        return f'--map {signal}="{column}:{form_of(quantity)}"'     # such as `Voltage_0`
    if unit is None:
        if text == 'mA':
            return (f'--map {signal}="{column}:{usual_unit(quantity)}:zero=4:'
                    f'gain={_EXAMPLES[signal][1]:g}"')
        return f'--map {signal}="{column}:{_usual_unit(signal, finite)}"'
    if unit.is_complete:
        return f'--map {signal}="{column}:{unit.name}"'
    is_gauge = falls_below_atmosphere(finite, unit).any()
    other = '' if is_gauge else f' (or {unit.name}_{ABSOLUTE})'
    return f'--map {signal}="{column}:{unit.name}_{GAUGE}"{other}'


def _usual_unit(signal: str, finite: FloatArray) -> str:
    """Return the unit in which most programs write a signal, or one for a pressure in Pa."""
    usual = usual_unit(BY_NAME[signal].quantity)
    if BY_NAME[signal].quantity != PRESSURE or not len(finite) or finite.max() < _MOST_KPA:
        return usual
    fitting = plausible_units(BY_NAME[signal], float(finite.min()), float(finite.max()))
    return fitting[-1] if finite.min() > BELOW_ATMOSPHERE * P_ATM_PA else fitting[0]


def unread(tables: Collection[Table], found: Guess) -> list[str]:
    """Return the columns that are neither the time nor a signal."""
    read = [(table, _meaning(table, found)) for table in tables]
    return list(dict.fromkeys(
        name for table, meant in read for name in table.columns if name not in meant))


def _meaning(table: Table, found: Guess) -> dict[str, str]:
    """Return column to what it is read as."""
    meant = {}
    time = time_column(table, found.mapping)
    if time is not None and table.name_of(time.column) is not None:
        name = table.require(time.column)
        meant[name] = 'time' + (f' in {time.unit}' if time.unit else '')
        if time.unit in ('', DATE) and (pair := pair_of(table, name)) is not None:
            meant.update(zip(pair, ('date of the time', 'time of day')))
    for name, one in found.mapping.signals.items():
        column = table.name_of(one.column)
        if column is not None:
            meant[column] = f'{name} in {one.reading} ({found.told.get(name, "as stated")})'
    for question in found.questions:
        if table.name_of(question.column) is not None:
            meant[question.column] = ' or '.join(
                f'{name}? ({BY_NAME[name].meaning})' for name in question.signals)
    return meant


def _facts(table: Table, name: str, missing: Collection[str]) -> dict[str, Any]:
    """Return lowest, highest and first value of a column, and whether it holds texts."""
    found: dict[str, Any] = {
        'lowest': None, 'highest': None, 'is_text': False,
        'first': str(table.columns[name].iloc[0])[:23] if len(table) else ''}
    try:
        values = table.numbers(name, missing)
    except InputError:
        return found | {'is_text': True}
    finite = values[np.isfinite(values)]
    if not len(finite):
        return found
    return found | {'lowest': float(finite.min()), 'highest': float(finite.max())}


def _range(one: Mapping[str, Any]) -> tuple[str, str]:
    """Return the lowest and highest value of a column for people, '' of one of texts."""
    if one['lowest'] is None:
        return '' if one['is_text'] else 'no number', ''
    return f'{one["lowest"]:.6g}', f'{one["highest"]:.6g}'


def _finite(table: Table, name: str) -> FloatArray:
    """Return the numbers of a column, none for one of texts."""
    try:
        values = table.numbers(name)
    except InputError:
        return np.empty(0)
    return values[np.isfinite(values)]

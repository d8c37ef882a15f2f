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

"""What a column is, by its name, its unit and its range: certain, or a question."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
import re

import numpy as np
from pam_actuation.tables.day_and_time import is_called_time
from pam_actuation.tables.lengths import length_column, LengthColumn
from pam_actuation.tables.mapping import column_of_text, ColumnMap, TableMapping
from pam_actuation.tables.parts import is_length_of_muscle, kind_of_pressure, worked_on
from pam_actuation.tables.questions import (
    either_of, needs_gain, of_a_joint, of_output_column, Question, which_of)
from pam_actuation.tables.signals import (
    ANGLES, are_of_joint, BY_NAME, of_words, Signal)
from pam_actuation.tables.table import Table
from pam_actuation.tables.units import (
    ABSOLUTE, ANGLE, checked_unit, FACTORS, GAUGE, LENGTH, names_of, PRESSURE, si_unit, Unit,
    unit_of_text, VOLTAGE)
from pam_actuation.tables.words import Heading, heading, words_in, words_of
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.errors import InputError
from pam_sim.units import P_ATM_PA

BELOW_ATMOSPHERE = 0.9            # of it: no muscle on a rig is evacuated further
LOWEST_AIR = 0.6                  # of it: the air of the highest towns
# What names of other programs end in that says only where in a message the number stands.
_PLACE = re.compile(r'(?<=.)/(data|value|[xyz])([.\[]\d+\]?)?$')
FEW_BELOW = 0.02                  # share of the rows; fewer may be a sensor that drops out
_EXT = re.compile(r'(?<![^\W_])ext(?![^\W_])', re.IGNORECASE)
_STRAIN = re.compile(r'\b(strain|epsilon|ratio)\b')
_Meaning = tuple[ColumnMap, str] | Question     # what a column is and why, or what must be asked


@dataclass
class Guess:
    """
    A mapping that was completed, and what is still open.

    Parameters
    ----------
    mapping : TableMapping
        What is known, by the user's words and by the file.
    told : dict of str to str
        Why a signal is taken to be a column, by name of the signal.
    questions : list of Question
        What only the user knows.

    """

    mapping: TableMapping
    told: dict[str, str] = field(default_factory=dict)
    questions: list[Question] = field(default_factory=list)


def as_stated(mapping: TableMapping) -> Guess:
    """Return what the user said, and nothing else."""
    return Guess(mapping, dict.fromkeys(mapping.signals, 'as stated'))


def guess(tables: Collection[Table], mapping: TableMapping,
          missing: Collection[str] = (), left_out: Collection[str] = ()) -> Guess:
    """
    Complete a mapping from names, units and ranges.

    What the user said stays. A column that the user mapped is not mapped again.

    Parameters
    ----------
    tables : list of Table
        Of one recording.
    mapping : TableMapping
        What the user said.
    missing : collection of str
        Texts that stand for missing values.
    left_out : collection of str
        Columns that are no signals, by name or number.

    Raises
    ------
    InputError
        No table has a column that is left out.

    """
    tables = list(tables)
    for one in left_out:
        if tables and all(table.name_of(one) is None for table in tables):
            tables[0].require(one)
    found = as_stated(mapping)
    seen, either = _meant(tables, mapping, missing, left_out)
    found.questions += either
    signals = dict(mapping.signals)
    joint = are_of_joint(signals) or are_of_joint(seen.keys() - {one.name for one in ANGLES})
    for name, candidates in seen.items():
        if are_of_joint([name]) != joint:       # such as the angle of a joint with one muscle
            continue
        chosen = _chosen(name, _least_worked_on(tables, candidates))
        if isinstance(chosen, Question):
            found.questions.append(chosen if not seen.keys() & {one.name for one in ANGLES}
                                   else of_a_joint(chosen))
        else:
            signals[name], found.told[name] = chosen
    found.mapping = replace(mapping, signals=signals)
    measured = {name for name, of_name in seen.items() if not all(
        map(_is_output, of_name.values()))}
    if not joint and 'contraction' not in {*signals, *measured} and (
            lengths := _of_lengths(tables, found.mapping, missing, left_out)):
        found.questions = [one for one in found.questions if one.signal != 'contraction']
        found.questions += lengths
    return found


def _meant(tables: Collection[Table], mapping: TableMapping, missing: Collection[str],
           left_out: Collection[str]) -> tuple[dict[str, dict[str, _Meaning]], list[Question]]:
    """Return (by signal the columns that may be it, questions on columns of several signals)."""
    seen: dict[str, dict[str, _Meaning]] = {}
    either: dict[str, Question] = {}
    for table in tables:
        used = _used(table, mapping, left_out)
        for column in table.columns:
            if column in used or is_called_time(table, column):
                continue
            meant = {signal.name: answer for signal in _signals_of(table, column)
                     if signal.name not in mapping.signals and (
                         answer := _of_column(table, column, signal, missing)) is not None}
            if len(meant) > 1:
                either[column] = either_of(column, {
                    name: _units_of(answer) for name, answer in meant.items()})
                continue
            for name, answer in meant.items():
                of_name = seen.setdefault(name, {})
                of_name.setdefault(column, answer)
                for other in _numbered_on(table, column):
                    second = None if other in used else _readable(
                        table, other, BY_NAME[name], missing)
                    if second is not None:
                        of_name.setdefault(other, second)
    return seen, list(either.values())


def _used(table: Table, mapping: TableMapping, left_out: Collection[str]) -> set[str | None]:
    """Return the columns of a table that are mapped, or left out."""
    stated = [one.column for one in mapping.signals.values()]
    if mapping.time is not None:
        stated.append(mapping.time.column)
    return {table.name_of(one) for one in (*stated, *left_out)}


def _numbered_on(table: Table, column: str) -> list[str]:
    """Return the columns called as one that ends in 1, but in 2, 3 and so on."""
    words = words_of(_name_of(table, column))
    if not words.endswith('1'):
        return []
    return [other for number in range(2, 10) for other in table.columns
            if not _signals_of(table, other)
            and words_of(_name_of(table, other)) == f'{words[:-1]}{number}']


def _readable(table: Table, column: str, signal: Signal, missing: Collection[str]
              ) -> _Meaning | None:
    """Return what ``_of_column`` does, None for a column that holds texts."""
    try:
        return _of_column(table, column, signal, missing)
    except InputError:
        return None


def _of_lengths(tables: Collection[Table], mapping: TableMapping, missing: Collection[str],
                left_out: Collection[str]) -> list[Question]:
    """Return a question where the length of the muscle stands in place of its contraction."""
    used = {(id(table), table.name_of(one)) for table in tables
            for one in (*(own.column for own in mapping.signals.values()), *left_out)}
    lengths: dict[str, LengthColumn] = {}
    for table in tables:
        for column in table.columns:
            words = words_in(_heading_of(table, column).name.rpartition('/')[2])
            if (id(table), column) in used or not is_length_of_muscle(words) or (
                    table.begins_with_text(column)):
                continue
            one = length_column(
                column, table.numbers(column, missing), unit_of_column(table, column))
            if one is not None and (column not in lengths or one.high > lengths[column].high):
                lengths[column] = one
    if len(lengths) > 1:
        names = ' and '.join(f'"{column}"' for column in lengths)
        text = (f'columns {names} could each be the length of the muscle: which one, and is the '
                'zero, its length at rest, the largest length seen (a guess to be checked)?')
        return [Question('contraction', '', text, tuple(
            f'{column}:{answer}' for column, one in lengths.items() for answer in one.answers))]
    return [Question('contraction', column, one.question, one.answers)
            for column, one in lengths.items()]


def _least_worked_on(tables: Collection[Table], candidates: dict[str, _Meaning]
                     ) -> dict[str, _Meaning]:
    """Return the columns of a signal as such; without one those called raw, then filtered."""
    worked = {column: min(worked_on(words_in(_heading_of(table, column).name)) for table in tables
                          if column in table.columns) for column in candidates}
    return {column: one for column, one in candidates.items()
            if worked[column] == min(worked.values())}


def _chosen(name: str, candidates: dict[str, _Meaning]) -> _Meaning:
    """Return the one column that is a signal, or the question which of several is."""
    exported = [one for column, one in candidates.items() if is_exported(column, BY_NAME[name])]
    measured = {column: one for column, one in candidates.items() if not _is_output(one)}
    candidates = measured or candidates
    if exported or len(candidates) == 1:
        return exported[0] if exported else next(iter(candidates.values()))
    return which_of(BY_NAME[name], [
        (column, _units_of(one)) for column, one in candidates.items()])


def _units_of(one: _Meaning) -> tuple[str, ...]:
    """Return the units in which a column may be read."""
    return one.answers if isinstance(one, Question) else (one[0].unit.name,)


def _is_output(one: _Meaning) -> bool:
    return isinstance(one, Question) and one.is_output


def ask(found: Guess, answer: Callable[[Question], str | None]) -> Guess:
    """
    Return the guess with the questions answered; None as an answer leaves the signal out.

    Parameters
    ----------
    found : Guess
        With questions.
    answer : callable
        Returns an answer that the question does not refuse, or None.

    """
    signals, told = dict(found.mapping.signals), dict(found.told)
    for question in found.questions:
        said = answer(question)
        if said:
            signal, rest = question.parted(said)
            signals[signal] = column_of_text(signal, rest, 'the answer')
            told[signal] = 'as answered'
    return Guess(replace(found.mapping, signals=signals), told)


def falls_below_atmosphere(values: FloatArray, unit: Unit) -> BoolArray:
    """Return where pressures would be below the atmosphere if they were absolute."""
    return values * unit.factor < BELOW_ATMOSPHERE * P_ATM_PA


def is_thin_air(values: FloatArray, unit: Unit) -> bool:
    """Return whether pressures go down to that of the air high above the sea, and not lower."""
    lowest_pa = float(values.min()) * unit.factor
    return LOWEST_AIR * P_ATM_PA <= lowest_pa < BELOW_ATMOSPHERE * P_ATM_PA


def _name_of(table: Table, column: str) -> str:
    """Return what a column is called before ``/data`` or ``/z``; '' for one that stands still."""
    name = table.called.get(column, column)
    if _PLACE.search(name) is None:
        return name
    return _PLACE.sub('', name) if table.columns[column].nunique() > 1 else ''


def unit_of_column(table: Table, column: str) -> str:
    """Return the unit that a table states for a column, as it is written; '' without one."""
    return table.units.get(column, '') or _heading_of(table, column).unit


def _heading_of(table: Table, column: str) -> Heading:
    """Return name and unit of a column; the unit may stand in a row below."""
    name = _name_of(table, column)
    own, unit = heading(name), table.units.get(column, '')
    return own if own.unit or not unit else heading(f'{name} [{unit}]')


def _signals_of(table: Table, column: str) -> list[Signal]:
    """Return the signals that a column may be by its name and unit; two where that is open."""
    exported = next((one for one in BY_NAME.values() if is_exported(
        _name_of(table, column), one)), None)
    if exported is not None:
        return [exported]
    own, unit = _heading_of(table, column), unit_of_column(table, column)
    names = [own.name, *([own.inlet] if own.inlet else [])]
    if _is_beside_a_flexor(table, column):
        names = [_EXT.sub('extensor', one) for one in names]
    # A unit after a stroke, as in `p/bar`, or the last part of a path.
    for texts in (names, [_name_of(table, column)] if own.unit else []):
        found = [of_words(words_in(name), path, unit) for path, _, name in (
            text.rpartition('/') for text in texts)]
        if any(found):
            return list(dict.fromkeys(one for one in found if one is not None))
    return []


def _is_beside_a_flexor(table: Table, column: str) -> bool:
    """Return whether `ext` means the extensor, as in `P_ext` beside `P_flex`: else external."""
    flexor = _EXT.sub('flex', column.lower())
    return flexor != column.lower() and flexor in {one.lower() for one in table.columns}


def is_exported(column: str, signal: Signal) -> bool:
    """Return whether a column has the name that ``pam export`` gives a signal; it is in SI."""
    name = f'{signal.topic}.{signal.field}'
    # As a MAT file and an HDF5 file have it.
    return column in (name, re.sub('[./]', '_', name), name.replace('/', '.'))


def _of_column(table: Table, column: str, signal: Signal, missing: Collection[str]
               ) -> _Meaning | None:
    """Return what a column is and why, a question, or None for one that is another quantity."""
    if is_exported(column, signal):
        si = si_unit(signal.quantity)
        return ColumnMap(column, si), f'unit {si.name} by name'
    text = unit_of_column(table, column) or _share_of_length(table, column, signal, missing)
    unit = unit_of_text(text, signal.quantity) if text else None
    is_output = unit is None and bool(text) and needs_gain(text, signal.quantity)
    if unit is None and not is_output and any(unit_of_text(text, one) for one in FACTORS):
        return None                                     # of another quantity
    values = table.numbers(column, missing)
    finite = values[np.isfinite(values)]
    if not len(finite):
        return None
    low, high = float(finite.min()), float(finite.max())
    shown = f'column "{column}", {low:.4g} to {high:.4g}, seems to be the {signal.meaning}'
    if unit is None and text:
        return of_output_column(signal, column, shown, text)
    if unit is None:
        return Question(signal.name, column, f'{shown}: in which unit?',
                        tuple(plausible_units(signal, low, high)))
    if unit.is_complete:
        by = 'message type' if column in table.by_type else 'name'
        return ColumnMap(column, unit), f'unit {unit.name} by {by}'
    below = falls_below_atmosphere(finite, unit)
    by, kind = 'name', kind_of_pressure(words_of(_name_of(table, column)))
    if column in table.by_type:                             # as the type of the message says
        by, kind = 'message type', ABSOLUTE
    is_thin = is_thin_air(finite, unit)
    if kind == GAUGE or kind == ABSOLUTE and (not below.any() or is_thin and by == 'name'):
        chosen = checked_unit(f'{unit.name}_{kind}', PRESSURE, column)
        return ColumnMap(column, chosen), f'unit {chosen.name} by {by}'
    if is_thin:
        zero = f'{unit.name}_{GAUGE}:zero={low:.4g}'
        return Question(signal.name, column, f'{shown}: gauge (0 when vented), or absolute and '
                        f'measured high above the sea, where a vented muscle reads {low:.4g} (a '
                        'guess to be checked)?', (zero, f'{unit.name}_{GAUGE}'))
    if below.any() and float(below.mean()) < FEW_BELOW:
        shown += f', below 1 atmosphere in {int(below.sum())} of {len(finite)} rows only'
    elif below.any():
        chosen = checked_unit(f'{unit.name}_{GAUGE}', PRESSURE, column)
        return ColumnMap(column, chosen), f'gauge, since it falls to {low:.3g} {unit.name}'
    return Question(signal.name, column,
                    f'{shown}: gauge (0 when vented) or absolute?',
                    (f'{unit.name}_{GAUGE}', f'{unit.name}_{ABSOLUTE}'))


def _share_of_length(table: Table, column: str, signal: Signal, missing: Collection[str]) -> str:
    """Return '1' or '%' for a strain that has no unit, '' for any other column."""
    words = words_in(_heading_of(table, column).name.rpartition('/')[2])
    if signal.quantity != LENGTH or not _STRAIN.search(words):
        return ''
    return '%' if (np.abs(table.numbers(column, missing)) > 1.0).any() else '1'


# The largest value that a rig of this kind has, SI; a tenth to a hundredth of it is usual.
_LARGEST = {PRESSURE: 1e6, LENGTH: 0.12, 'force': 2000.0, VOLTAGE: 10.5, 'duty': 1.0,
            ANGLE: 3.5}


def plausible_units(signal: Signal, low: float, high: float) -> list[str]:
    """Return the units in which a range fits a rig; all of them where none does."""
    # A length may count from anywhere.
    largest = high - low if signal.quantity == LENGTH else max(abs(low), abs(high))
    fitting = []
    for name in names_of(signal.quantity):
        unit: Unit | None = unit_of_text(name, signal.quantity)
        if unit is None or name.startswith(('hPa', 'atm', 'mmHg', 'kgf/cm2', 'gf', 'daN', 'cm')):
            continue
        size = largest * unit.factor
        limit = _LARGEST[signal.quantity]
        if limit / 300.0 <= size <= limit and not (
                name.endswith(ABSOLUTE) and low * unit.factor < BELOW_ATMOSPHERE * P_ATM_PA):
            fitting.append(name)
    return fitting or names_of(signal.quantity)

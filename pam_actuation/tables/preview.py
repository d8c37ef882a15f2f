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

from collections.abc import Collection
import re

import numpy as np
from pam_actuation.tables.clock import time_column
from pam_actuation.tables.guess import Guess
from pam_actuation.tables.signals import BY_NAME
from pam_actuation.tables.table import Table
from pam_actuation.tables.words import unit_in, words_of
from pam_sim.errors import InputError

_MOST_COLUMNS = 60
# Signal, unit, words of a likely column, gain of a sensor of 4 to 20 mA (10 bar, 100 mm).
_EXAMPLES = (('pressure', 'kPa_gauge', r'\bp\b|press', 62.5),
             ('contraction', 'mm', r'\bx\b|dist|pos|len|disp|stroke|contract', 6.25))


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
        meant = _meaning(table, found)
        rows_are = f'{table.topic}, {len(table)} messages' if table.topic else f'{len(table)} rows'
        lines.append(f'{table.source}: {rows_are}, {len(table.columns)} columns')
        rows = [('', 'column', 'lowest', 'highest', 'first', 'read as')]
        for number, name in enumerate(table.columns):
            if number == _MOST_COLUMNS:
                rows.append(('', f'and {len(table.columns) - number} more', '', '', '', ''))
                break
            rows.append((f'#{number + 1}', name, *_facts(table, name, missing),
                         meant.get(name, '–')))
        widths = [max(len(row[place]) for row in rows) for place in range(5)]
        lines += ['  ' + '  '.join(f'{cell:{width}}' for cell, width in zip(row, widths))
                  + f'  {row[5]}' for row in rows]
    return '\n'.join(lines)


def questions_text(found: Guess) -> str:
    """Return what only the user knows, a line for each question."""
    return '\n'.join(f'? {one.text}\n    {one.options()}' for one in found.questions)


def question_sentence(found: Guess) -> str:
    """Return the questions as one sentence, for the end of a call that cannot ask."""
    return ' '.join(f'{one.text} Add {one.options()}.' for one in found.questions)


def how_to_begin(tables: Collection[Table], found: Guess) -> str:
    """Return the words of the command line that begin a mapping, with columns of the file."""
    columns, said = unread(tables, found), []
    for signal, unit, words, gain in _EXAMPLES:
        if not columns:
            break
        column = next((one for one in columns if re.search(words, words_of(one))), columns[0])
        columns.remove(column)
        more = f':zero=4:gain={gain:g}' if unit_in(column) == 'mA' else ''
        said.append(f'--map {signal}="{column}:{unit}{more}"')
    return ' '.join(said)


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
        meant[table.require(time.column)] = 'time' + (f' in {time.unit}' if time.unit else '')
    for name, one in found.mapping.signals.items():
        column = table.name_of(one.column)
        if column is not None:
            meant[column] = f'{name} in {one.unit.name} ({found.told.get(name, "as stated")})'
    for question in found.questions:
        if table.name_of(question.column) is not None:
            meant[question.column] = f'{question.signal}? ({BY_NAME[question.signal].meaning})'
    return meant


def _facts(table: Table, name: str, missing: Collection[str]) -> tuple[str, str, str]:
    """Return lowest, highest and first value of a column; '' for those of texts."""
    first = str(table.columns[name].iloc[0])[:23] if len(table) else ''
    try:
        values = table.numbers(name, missing)
    except InputError:
        return '', '', first
    finite = values[np.isfinite(values)]
    if not len(finite):
        return 'no number', '', first
    return f'{finite.min():.6g}', f'{finite.max():.6g}', first

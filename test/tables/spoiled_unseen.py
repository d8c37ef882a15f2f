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

"""Ways to spoil a table that were written after the import was mended, and run once unseen."""

import re

import numpy as np
from spoiled_draft import ATMOSPHERE_PA, Column


def clock_of_minutes(draft, random):
    """Spoil: the time is written as minutes and seconds."""
    draft.separator, draft.decimal = ';', '.'
    draft.names[0] = 'time'

    def change(rows):
        for row, time_s in zip(rows, draft.time_s):
            row[0] = f'{int(time_s // 60):02d}:{time_s % 60:06.3f}'
    draft.steps.append(change)


def row_of_units_against_names(draft, random):
    """Spoil: the row of units says kPa, as the numbers are; the name says bar."""
    place = draft.place('pressure')
    draft.names[place] = 'p_bar'
    gauge_kpa = 1e-3 * (draft.truth['pressure'] - ATMOSPHERE_PA)
    draft.columns[place].numbers = gauge_kpa
    units = [{'': 's' if one.factor == 1.0 else 'ms', 'pressure': 'kPa',
              'contraction': {1.0: 'm', 1e-2: 'cm'}.get(one.factor, 'mm'),
              'force': 'N' if one.factor == 1.0 else 'lbf', 'ppr_voltage': 'V'}.get(
                  one.signal, '%') for one in draft.columns]
    draft.line_steps.append(lambda lines, first: [
        *lines[:first], draft.separator.join(units), *lines[first:]])


def two_muscles(draft, random):
    """Spoil: pressures and lengths of two muscles stand side by side."""
    for signal, names in (('pressure', ('p1', 'p2')), ('contraction', ('x1', 'x2'))):
        place = draft.place(signal)
        one = draft.columns[place]
        unit = re.split(r'[_ ]', re.sub(r'[\[\]]', '', draft.names[place]), maxsplit=1)[1]
        draft.names[place] = f'{names[0]}_{unit}'
        draft.columns.append(Column(names[1], 0.8 * one.numbers + 0.2 * one.numbers.max()))
        draft.names.append(f'{names[1]}_{unit}')


def times_of_few_digits(draft, random):
    """Spoil: seconds from 1970 were written with nine digits."""
    draft.columns[0].numbers, draft.columns[0].form = 1_764_000_000 + draft.time_s, '.9g'
    draft.names[0], draft.start_s, draft.shift_s = 'time_s', 1_764_000_000.0, 10.0


def error_page_below(draft, random):
    """Spoil: the download ended with the page of an error."""
    draft.tail = '<html><body>\n<h1>504 Gateway Time-out</h1>\n</body></html>\n'


def days_of_a_spreadsheet(draft, random):
    """Spoil: the time is a number of days, as a spreadsheet holds dates."""
    draft.columns[0].numbers = 46_351.4 + draft.time_s / 86_400.0
    draft.columns[0].form = '.12f'
    draft.start_s = (46_351.4 - 25_569.0) * 86_400.0
    draft.names[0] = random.choice(['time', 'Date'])


def times_before_the_trigger(draft, random):
    """Spoil: the time counts from a trigger within the recording."""
    time = draft.columns[0]
    time.numbers = time.numbers - time.numbers[100]
    draft.time_s = draft.time_s - draft.time_s[100]


def newest_row_first(draft, random):
    """Spoil: the rows stand in the opposite order."""
    for one in draft.columns:
        one.numbers = one.numbers[::-1]


def long_preamble(draft, random):
    """Spoil: three hundred lines of settings stand above."""
    draft.head = [f'setting {number}{draft.separator}{number * 0.5:g}'.replace(
        '.', draft.decimal) for number in range(300)]


def separators_in_quoted_names(draft, random):
    """Spoil: names hold the separator within quotes, and so do remarks in the rows."""
    draft.names = [f'"{name.partition("_")[0]}{draft.separator} muscle [{name.partition("_")[2]}]"'
                   if '_' in name else name for name in draft.names]
    draft.columns.append(Column('note', np.zeros(draft.rows)))
    draft.names.append('note')

    def change(rows):
        for row in rows[::7]:
            row[-1] = f'"up{draft.separator} then ""down"""'
    draft.steps.append(change)


KINDS = (clock_of_minutes, row_of_units_against_names, two_muscles, times_of_few_digits,
         error_page_below, days_of_a_spreadsheet, times_before_the_trigger, newest_row_first,
         long_preamble, separators_in_quoted_names)

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

"""What loggers, spreadsheets and people do to columns: names, units, numbers, texts."""

import numpy as np
from spoiled_draft import ATMOSPHERE_PA, Column, PSI_PA

# What a label may say although the numbers are in another unit: factor of the numbers. Lies of
# less than that a rig could have, such as N for lbf, cannot be seen in a file.
LIES = {'pressure': (0.01, 0.1, 100.0, 1000.0), 'contraction': (0.001, 0.1, 10.0, 1000.0),
        'force': (0.001, 1000.0), 'ppr_voltage': (1000.0,)}


def _one(draft, random, signals=('pressure', 'contraction', 'force')):
    """Return the place of a column of one of the signals."""
    there = [draft.place(one) for one in signals if draft.place(one) >= 0]
    return int(random.choice(there))


def _rename(draft, place, name):
    draft.names[place] = name


def unit_label_lies(draft, random):
    """Spoil: the numbers of a column are in another unit than its name says."""
    place = _one(draft, random, LIES)
    one = draft.columns[place]
    one.numbers = one.numbers * random.choice(LIES[one.signal])


def unit_not_said(draft, random):
    """Spoil: the name of a column says no unit."""
    place = _one(draft, random)
    _rename(draft, place, {'pressure': 'pressure', 'contraction': 'position', 'force': 'force'}[
        draft.columns[place].signal])


def pressure_kind_not_said(draft, random):
    """Spoil: the pressure is absolute or gauge, and its name does not say which."""
    place = draft.place('pressure')
    _rename(draft, place, 'pressure [bar]')
    bar = 1e-5 * draft.truth['pressure']
    draft.columns[place].numbers = bar if random.integers(2) else bar - 1e-5 * ATMOSPHERE_PA


def absolute_with_dropouts(draft, random):
    """Spoil: an absolute pressure in bar reads 0 in a few rows; the name says bar only."""
    place = draft.place('pressure')
    _rename(draft, place, 'p_bar')
    bar = 1e-5 * draft.truth['pressure']
    rows = random.choice(len(bar), 2, replace=False)
    bar[rows] = 0.0
    draft.truth['pressure'][rows] = np.nan
    draft.columns[place].numbers = bar


def time_unit_not_said(draft, random):
    """Spoil: the time has no unit."""
    _rename(draft, 0, random.choice(['t', 'time', 'Time']))


def time_label_lies(draft, random):
    """Spoil: the time is in another unit than its name says."""
    draft.columns[0].numbers = draft.columns[0].numbers * random.choice([1e3, 1e6])
    draft.telltale = 'rows a second; in'


def length_for_contraction(draft, random):
    """Spoil: the column holds the length of the muscle, 300 mm at rest."""
    place = draft.place('contraction')
    draft.columns[place].numbers = (
        0.3 - draft.truth['contraction']) / draft.columns[place].factor


def sign_of_the_encoder(draft, random):
    """Spoil: the encoder counts the other way."""
    place = draft.place('contraction')
    draft.columns[place].numbers = -draft.columns[place].numbers


def decimal_commas_in_some_rows(draft, random):
    """Spoil: some rows were written with the other decimal sign."""
    other = {'.': ',', ',': '.'}[draft.decimal]
    if draft.separator == ',':
        draft.separator = ';'
    begin = int(random.integers(draft.rows // 2))

    def change(rows):
        for row in rows[begin:begin + 20]:
            row[:] = [text.replace(draft.decimal, other) for text in row]
    draft.steps.append(change)


def most_columns_whole_numbers(draft, random):
    """Spoil: three columns of counts stand beside a few with decimal commas."""
    draft.separator, draft.decimal = ';', ','
    for number in range(7):
        draft.columns.append(Column(f'count {number}', np.arange(draft.rows) % 7.0))
        draft.names.append(f'count {number}')


def thousands_separated(draft, random):
    """Spoil: the numbers of a column have marks between thousands."""
    mark = random.choice([',', "'", ' ', '\u00a0', '.'])
    if mark == draft.decimal or mark == draft.separator:
        mark = "'"
    place = draft.place('pressure')
    one = draft.columns[place]
    _rename(draft, place, 'pressure [Pa abs]')
    one.numbers, one.form = draft.truth['pressure'], '.0f'
    draft.truth['pressure'] = np.round(draft.truth['pressure'])

    def change(rows):
        for row in rows:
            row[place] = f'{int(float(row[place])):,}'.replace(',', mark)
    draft.steps.append(change)


def quoted_decimal_commas(draft, random):
    """Spoil: commas separate, commas are decimal signs, and quotes hold the numbers together."""
    draft.separator, draft.decimal, draft.quote = ',', ',', '"'


def whole_force_with_points(draft, random):
    """Spoil: a spreadsheet wrote 41200 mN as 41.200 beside decimal commas."""
    place = draft.place('force')
    if place < 0:
        return quoted_decimal_commas(draft, random)
    draft.separator, draft.decimal = ';', ','
    _rename(draft, place, 'F_mN')
    one = draft.columns[place]
    one.numbers, one.form = np.round(1e3 * draft.truth['force']), '.0f'
    draft.truth['force'] = 1e-3 * one.numbers

    def change(rows):
        for row in rows:
            row[place] = f'{int(row[place]):,}'.replace(',', '.')
    return draft.steps.append(change)


def column_missing(draft, random):
    """Spoil: a column is not there at all."""
    place = int(random.integers(1, len(draft.columns)))
    signal = draft.columns[place].signal
    del draft.columns[place], draft.names[place]
    draft.truth.pop(signal, None)


def header_lacks_a_name(draft, random):
    """Spoil: the header names one column less than there are."""
    del draft.names[int(random.integers(len(draft.names)))]


def header_has_one_more(draft, random):
    """Spoil: the header names one column more than there are."""
    draft.names.insert(int(random.integers(len(draft.names) + 1)), 'status')


def header_absent_columns_numbered(draft, random):
    """Spoil: there is no header; the user gives the columns by number."""
    draft.has_header = False
    _by_number(draft)


def header_of_numbers(draft, random):
    """Spoil: the header holds 0, 1, 2, as NumPy writes it; the user numbers the columns."""
    draft.names = [str(k) for k in range(len(draft.columns))]
    _by_number(draft)
    draft.options = [one for one in draft.options if 'time=' not in one]
    draft.options[:0] = ['--rate', f'{1.0 / np.median(np.diff(draft.time_s)):g}']
    del draft.options[draft.options.index('--map')]
    draft.options.extend([])


def _by_number(draft):
    units = {'pressure': {1e5: 'bar_gauge', 1e3: 'kPa_abs', PSI_PA: 'psi_gauge', 1.0: 'Pa_abs'},
             'contraction': {1e-3: 'mm', 1.0: 'm', 1e-2: 'cm'},
             'force': {1.0: 'N', 4.4482216152605: 'lbf', 1e-3: 'mN'}, 'ppr_voltage': {1.0: 'V'},
             'fill_duty': {1e-2: '%'}, 'vent_duty': {1e-2: '%'}}
    draft.options += ['--map', 'time=#1:' + {1.0: 's', 1e-3: 'ms'}[draft.columns[0].factor]]
    for number, one in enumerate(draft.columns[1:], 2):
        if one.signal:
            draft.options += ['--map', f'{one.signal}=#{number}:{units[one.signal][one.factor]}']


def names_twice(draft, random):
    """Spoil: two columns have the same name, and differ."""
    place = _one(draft, random)
    one = draft.columns[place]
    draft.columns.append(Column(one.name, 0.7 * one.numbers))
    draft.names.append(draft.names[place])


def two_of_a_kind(draft, random):
    """Spoil: a second column could be the same signal, and stands first."""
    place = draft.place('pressure')
    draft.columns.insert(1, Column('Druck_kPa_abs', 150.0 + np.arange(draft.rows) % 50))
    draft.names.insert(1, draft.columns[1].name)
    assert place


def index_in_front(draft, random):
    """Spoil: rows are numbered in a first column without a name."""
    draft.columns.insert(0, Column('', np.arange(draft.rows, dtype=float)))
    draft.names.insert(0, '')


def texts_with_quotes(draft, random):
    """Spoil: a column of remarks holds single quotation marks, as in 5" tube."""
    draft.columns.append(Column('note', np.zeros(draft.rows)))
    draft.names.append('note')
    marked = random.choice(draft.rows, 2, replace=False)
    at_begin = bool(random.integers(2))

    def change(rows):
        for number, row in enumerate(rows):
            row[-1] = ('"tube' if at_begin else '5" tube') if number in marked else 'ok'
    draft.steps.append(change)


def cells_blank(draft, random):
    """Spoil: some fields are empty."""
    _cells(draft, random, '')


def cells_of_words(draft, random):
    """Spoil: some fields hold a word of the program."""
    _cells(draft, random, random.choice(['---', '#DIV/0!', 'OVERFLOW', 'NaN', 'n/a', 'TRUE']))


def cells_of_sentinels(draft, random):
    """Spoil: some fields hold a number that stands for none."""
    _cells(draft, random, random.choice(['-9999', '9.9E+37', '1e400', '-32768']))


def _cells(draft, random, text):
    place = _one(draft, random)
    rows = random.choice(draft.rows, 5, replace=False)
    draft.truth[draft.columns[place].signal][rows] = np.nan
    draft.damaged += 5

    def change(table):
        for row in rows:
            table[row][place] = text
    draft.steps.append(change)


def numbers_of_another_hand(draft, random):
    """Spoil: numbers as other programs write them: typographic minus, D exponent, plus, spaces."""
    how = int(random.integers(5))
    place = _one(draft, random)

    def write(text):
        return (text.replace('-', '\u2212'), '+' + text, f'\u00a0{text}', f'{text}D+00',
                f'{text} ')[how]
    draft.encoding, draft.mark = 'utf-8', b''

    def change(rows):
        for row in rows:
            row[place] = write(row[place])
    draft.steps.append(change)


KINDS = (unit_label_lies, unit_not_said, pressure_kind_not_said, absolute_with_dropouts,
         time_unit_not_said, time_label_lies, length_for_contraction, sign_of_the_encoder,
         decimal_commas_in_some_rows, most_columns_whole_numbers, thousands_separated,
         quoted_decimal_commas, whole_force_with_points, column_missing, header_lacks_a_name,
         header_has_one_more, header_absent_columns_numbered, header_of_numbers, names_twice,
         two_of_a_kind, index_in_front, texts_with_quotes, cells_blank, cells_of_words,
         cells_of_sentinels, numbers_of_another_hand)

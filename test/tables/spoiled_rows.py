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

"""What loggers, disks and people do to rows, times, encodings and bytes of a text file."""

import codecs

import numpy as np
from pam_actuation.messages import START_NS


def _cut(draft, kept):
    """Keep rows of the columns; the truth stays whole."""
    for one in draft.columns:
        one.numbers = one.numbers[kept]


def gap(draft, random):
    """Spoil: a block of rows is missing; the times say so."""
    begin = int(random.integers(50, draft.rows - 150))
    kept = np.r_[:begin, begin + 80:draft.rows]
    _cut(draft, kept)


def clock_jumps_on(draft, random):
    """Spoil: the clock is set forward by an hour within the recording."""
    time = draft.columns[0]
    row = int(random.integers(50, draft.rows - 50))
    time.numbers = time.numbers.copy()
    time.numbers[row:] += 3600.0 / time.factor


def clock_wraps(draft, random):
    """Spoil: the counter of the time begins again at 0."""
    time = draft.columns[0]
    time.numbers = time.numbers % time.numbers[int(random.integers(50, draft.rows - 50))]


def rows_shuffled(draft, random):
    """Spoil: a block of rows stands before the one that it follows."""
    begin = int(random.integers(50, draft.rows - 150))
    _cut(draft, np.r_[:begin, begin + 50:begin + 100, begin:begin + 50, begin + 100:draft.rows])


def rows_twice(draft, random):
    """Spoil: a block of rows was written twice."""
    begin = int(random.integers(50, draft.rows - 150))
    row = np.arange(draft.rows)
    _cut(draft, np.sort(np.r_[row, row[begin:begin + 30]]))


def stamps_twice(draft, random):
    """Spoil: some rows have the time of the row before."""
    time = draft.columns[0]
    time.numbers = time.numbers.copy()
    rows = random.choice(np.arange(10, draft.rows), 4, replace=False)
    time.numbers[rows] = time.numbers[rows - 1]
    draft.damaged += 4


def time_too_coarse(draft, random):
    """Spoil: the time is written to a few digits, so that rows share one."""
    time = draft.columns[0]
    step = float(np.median(np.diff(time.numbers)))
    places = max(0, int(np.floor(-np.log10(2.0 * step * 1.0001))))
    coarse = 10.0 ** -places
    time.numbers = np.floor(time.numbers / coarse + 1e-9) * coarse
    draft.shift_s = 1.01 * coarse * time.factor


def another_recording_follows(draft, random):
    """Spoil: a second recording follows in the same file, with or without its header."""
    again = bool(random.integers(2))
    draft.line_steps.append(
        lambda lines, first: [*lines, *lines[first - again:]])


def row_cut_short(draft, random):
    """Spoil: writing broke off within a row, and went on with the next."""
    row = int(random.integers(20, draft.rows - 20))
    share = random.uniform(0.2, 0.9)
    draft.damaged += 1

    def change(lines, first):
        line = lines[first + row]
        lines[first + row] = line[:int(share * len(line))]
    draft.line_steps.append(change)


def row_lacks_a_field(draft, random):
    """Spoil: a field within a row is missing with its separator, so those after it move."""
    row, place = int(random.integers(20, draft.rows - 20)), int(
        random.integers(1, len(draft.columns)))
    draft.damaged += 1

    def change(rows):
        del rows[row][place]
    draft.steps.append(change)


def blanks_between_and_a_blank_field(draft, random):
    """Spoil: columns stand under each other between blanks, and a field is blank."""
    draft.separator, draft.encoding, draft.mark, draft.decimal = ' ', 'utf-8', b'', '.'
    draft.names = [name.replace(' ', '_') for name in draft.names]
    place, blank = int(random.integers(1, len(draft.columns))), {
        int(one) for one in random.choice(draft.rows, 3, replace=False)}
    draft.damaged += 3

    def change(rows):
        for number, row in enumerate(rows):
            row[:] = [f'{"" if number in blank and k == place else text:>14}'
                      for k, text in enumerate(row)]
    draft.steps.append(change)


def file_cut_short(draft, random):
    """Spoil: the file ends within a row."""
    share = random.uniform(0.5, 0.95)
    draft.damaged += draft.rows
    draft.byte_steps.append(lambda content: content[:int(share * len(content)) // 2 * 2])


def packed_file_cut_short(draft, random):
    """Spoil: the file ends within a row and was packed afterwards."""
    file_cut_short(draft, random)
    draft.ending = random.choice(['.csv.gz', '.csv.bz2'])


def zeros_of_a_power_cut(draft, random):
    """Spoil: a block of the file holds zero bytes only."""
    share = random.uniform(0.4, 0.9)
    draft.damaged += 40

    def change(content):
        begin = int(share * len(content)) // 2 * 2
        return content[:begin] + bytes(512) + content[begin + 512:]
    draft.byte_steps.append(change)


def zeros_far_down(draft, random):
    """Spoil: a long file holds zero bytes after the part by which its layout is found."""
    draft.encoding, draft.mark = 'utf-8', b''
    draft.head = ['# ' + 'x' * 10_000] * 26
    zeros_of_a_power_cut(draft, random)
    draft.byte_steps[-1] = lambda content: (
        content[:-9000] + bytes(64) + content[-9000 + 64:])


def lines_glued(draft, random):
    """Spoil: the end of a line is missing."""
    row = int(random.integers(20, draft.rows - 20))
    draft.damaged += 2

    def change(lines, first):
        lines[first + row:first + row + 2] = [lines[first + row] + lines[first + row + 1]]
    draft.line_steps.append(change)


def lines_end_twice(draft, random):
    """Spoil: every line ends as in text mode within text mode."""
    draft.end = '\r\r\n'


def lines_end_in_three_ways(draft, random):
    """Spoil: lines end now as on Windows, now as on Linux."""
    draft.end = '\n'
    draft.line_steps.append(lambda lines, first: [
        line + '\r' * (number % 3 == 0) for number, line in enumerate(lines)])


def preamble_with_odd_breaks(draft, random):
    """Spoil: the lines above hold breaks that only some programs take for an end of line."""
    draft.head = ['Logger' + random.choice(['\x0b', '\x0c', '\x1c', '\u2028', '\x85']) + ' rig 3']
    draft.encoding, draft.mark = 'utf-8', b''


def preamble_of_numbers(draft, random):
    """Spoil: the lines above hold numbers."""
    draft.head = [draft.separator.join(['Channels', '5']),
                  draft.separator.join(['Rate', '200', 'Hz']), '']


def comments_between(draft, random):
    """Spoil: marks stand between the rows as comments; the user gives a rate."""
    step = float(np.median(np.diff(draft.time_s)))
    draft.options += ['--rate', f'{1.0 / step:g}']
    row = int(random.integers(20, draft.rows - 20))
    draft.line_steps.append(lambda lines, first: [
        *lines[:first + row], '# marker 1', *lines[first + row:]])


def statistics_below(draft, random):
    """Spoil: means and highest values stand below the rows."""
    count = len(draft.columns)
    draft.tail = draft.end.join(['', *(
        draft.separator.join([word, *['1'] * (count - 1)]) for word in ('Mean', 'Max'))]
    ) + draft.end


def fewer_columns_from_a_row_on(draft, random):
    """Spoil: from a row on the last column is no longer written."""
    row = int(random.integers(50, draft.rows - 50))
    draft.damaged += draft.rows - row

    def change(rows):
        for one in rows[row:]:
            one.pop()
    draft.steps.append(change)


def columns_swap_from_a_row_on(draft, random):
    """Spoil: a second header within the file names the columns in another order."""
    row = int(random.integers(50, draft.rows - 50))

    def change(lines, first):
        fields = [line.split(draft.separator) for line in lines]
        turned = [draft.separator.join([*one[:1], *one[:0:-1]]) for one in fields]
        return [*lines[:first + row], turned[first - 1], *turned[first + row:]]
    draft.line_steps.append(change)


def utf16_without_mark(draft, random):
    """Spoil: UTF-16 without its mark."""
    draft.encoding, draft.mark = random.choice(['utf-16-le', 'utf-16-be']), b''


def utf32(draft, random):
    """Spoil: UTF-32 with its mark."""
    draft.encoding, draft.mark = 'utf-32-le', codecs.BOM_UTF32_LE


def marks_twice(draft, random):
    """Spoil: the mark of the encoding stands twice."""
    draft.encoding, draft.mark = 'utf-8', 2 * codecs.BOM_UTF8


def latin_names(draft, random):
    """Spoil: names with umlauts and micro in an encoding of one byte."""
    draft.encoding, draft.mark = random.choice(['latin-1', 'cp1252', 'mac-roman', 'cp437']), b''
    draft.head = ['Prüfstand für Muskeln']
    draft.columns[0].numbers = np.round(1e6 * draft.time_s)
    draft.columns[0].factor = 1e-6
    draft.names[0] = 'Zeit [µs]'


def characters_broken_far_down(draft, random):
    """Spoil: a byte that is no UTF-8 stands in a remark far down."""
    draft.encoding, draft.mark = 'utf-8', b''
    draft.head = ['# Prüfstand ' + 'x' * 10_000] * 26
    draft.tail = ''
    row = draft.rows - 10

    def change(lines, first):
        lines[first + row] = lines[first + row].replace('1', '\u0141', 1)
        return lines
    draft.line_steps.append(change)
    draft.damaged += 1
    draft.byte_steps.append(lambda content: content.replace('\u0141'.encode(), b'\xff'))


def dates_of_the_country(draft, random):
    """Spoil: the time is written as dates of a country."""
    draft.decimal, draft.separator = '.', ';'
    form = random.choice(['%d.%m.%Y %H:%M:%S.%f', '%m/%d/%Y %H:%M:%S.%f', '%H:%M:%S.%f',
                          '%Y-%m-%d %H:%M:%S.%f'])
    from datetime import datetime, timedelta, timezone
    begin = datetime(2026, 3, 4, 9, 30, tzinfo=timezone.utc)
    draft.names[0] = 'timestamp'
    stamps = [(begin + timedelta(seconds=float(one))).strftime(form) for one in draft.time_s]
    of_day_s = 9.5 * 3600.0
    # 03/04 may be in March or in April: only the time of day is certain.
    draft.start_s = begin.timestamp() if form[:2] in ('%Y', '%d') else 1e-9 * START_NS + of_day_s

    def change(rows):
        for row, stamp in zip(rows, stamps):
            row[0] = stamp
    draft.steps.append(change)


KINDS = (gap, clock_jumps_on, clock_wraps, rows_shuffled, rows_twice, stamps_twice,
         time_too_coarse, another_recording_follows, row_cut_short, row_lacks_a_field,
         blanks_between_and_a_blank_field, file_cut_short, packed_file_cut_short,
         zeros_of_a_power_cut, zeros_far_down, lines_glued, lines_end_twice,
         lines_end_in_three_ways, preamble_with_odd_breaks, preamble_of_numbers,
         comments_between, statistics_below, fewer_columns_from_a_row_on,
         columns_swap_from_a_row_on, utf16_without_mark, utf32, marks_twice, latin_names,
         characters_broken_far_down, dates_of_the_country)

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

"""How a text file with numbers is laid out: encoding, separator, decimal sign, header."""

from collections import Counter
from collections.abc import Sequence
import csv
from dataclasses import dataclass, field
import re

from pam_actuation.tables.formats.labview import lvm_header
from pam_actuation.tables.thousands import with_thousands
from pam_sim.errors import InputError

SAMPLE_BYTES = 256 * 1024
_BOMS = ((b'\xff\xfe\0\0', 'utf-32'), (b'\0\0\xfe\xff', 'utf-32'),
         (b'\xef\xbb\xbf', 'utf-8-sig'), (b'\xff\xfe', 'utf-16'), (b'\xfe\xff', 'utf-16'))
WIDTH = {'utf-32': 4, 'utf-16': 2, 'utf-16-le': 2, 'utf-16-be': 2}      # bytes of a character
LINE_END = re.compile(r'\r\n|\r|\n')               # as pandas counts lines; no other break is one
# Separator as pandas takes it; of equally good ones the first.
_SEPARATORS = (';', '\t', ',', '|', r'\s+')
_NUMBER = r'[+-]?(\d+{0}?\d*|{0}\d+)([eEdD][+-]?\d+)?'
_DATE = re.compile(
    r'\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}([T ]\d{1,2}:\d{2}[^;|\t]*)?|\d{1,2}:\d{2}(:[\d.,]+)?'
    r'|-?\d+ days? \d{1,2}:\d{2}:[\d.]+|[\d.,]+ (sec|min|hr)')      # durations
_DATE_AND_TIME = re.compile(r'\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4} +\d{1,2}:\d{2}')
_EMPTY = {'', 'nan', 'na', 'n/a', 'null', 'none', '-', 'inf', '+inf', '-inf', '#n/a'}
COMMENTS = ('#', '%', '//')
_LOOKED_AT = 200                     # lines


@dataclass(frozen=True)
class TextLayout:
    """
    How to read a text file.

    Parameters
    ----------
    encoding, separator, decimal : str
        As ``pandas.read_csv`` takes them; separator and decimal sign are the same where quotes
        hold the numbers together.
    names : tuple of str
        Of the columns; ``#1``, ``#2``, … where the file has none.
    units : tuple of str
        Of a row of units below the names; empty without one.
    first_line : int
        Line of the first row, counted from 1.
    line_bytes : float
        Usual length of a row.
    remark : str
        What was odd about the header.
    called : dict of str to str
        What the file calls columns whose name stands twice.
    optional : int
        How many of the last columns a row may lack.
    first_s, step_s : float
        Time of the first row and between rows, where the rows hold no time; else the step is 0.
    is_lvm : bool
        Whether it is a file of LabVIEW, in which a header may stand between rows.

    """

    encoding: str
    separator: str
    decimal: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    first_line: int
    line_bytes: float
    remark: str = ''
    called: dict[str, str] = field(default_factory=dict)
    optional: int = 0
    first_s: float = 0.0
    step_s: float = 0.0
    is_lvm: bool = False


def layout_of(head: bytes, source: str) -> TextLayout:
    """
    Return the layout of a text file.

    Parameters
    ----------
    head : bytes
        Its beginning, up to SAMPLE_BYTES.
    source : str
        The file, for messages.

    Raises
    ------
    InputError
        No text, no rows of numbers, or a header with another number of columns.

    """
    encoding = encoding_of(head, source)
    lines = LINE_END.split(head.decode(encoding, errors='ignore'))
    lines = lines[:-1] if len(head) >= SAMPLE_BYTES or not lines[-1] else lines
    if (own := lvm_header(lines)) is not None:
        names = _unique([*own.names])
        return TextLayout(
            encoding, own.separator, own.decimal, names, own.units, own.begin + 1,
            _line_bytes(lines[own.begin:], encoding), called=_called(names, own.names),
            optional=own.optional, first_s=own.first_s, step_s=own.step_s,
            is_lvm=True)
    said = None
    if lines and re.fullmatch(r'sep=.', lines[0].strip()):
        said = lines[0].strip()[4:]
    best: tuple[tuple[float, ...], str, str, int, int] | None = None
    for separator in (said,) if said else _SEPARATORS:
        for decimal in '.,':
            if decimal == separator and not any('"' in line for line in lines[-_LOOKED_AT:]):
                continue
            begin, share, count, numbers = _first_row(lines, separator, decimal)
            # Fields that are numbers before many fields: 0,5;1,5 has two, and no third "5;1".
            rank = (len(lines) - begin, share, _names(lines[:begin], separator) == count,
                    separator != r'\s+', count, numbers)
            if count and (best is None or rank > best[0]):
                best = (rank, separator, decimal, begin, count)
    if best is None:
        raise InputError(
            'holds no rows of numbers with a separator that is ; , | a tab or spaces', source)
    _, separator, decimal, begin, count = best
    named, units = _header(lines[:begin], separator, count, begin, source, decimal)
    names = _unique(named or [''] * count)
    remark = ''
    if not named and _counts(split(lines[begin], separator)):
        remark = f'line {begin + 1} numbers the columns: it was taken for a header'
        begin += 1
    return TextLayout(encoding, separator, decimal, names, units, begin + 1,
                      _line_bytes(lines[begin:], encoding), remark, _called(names, named))


def _line_bytes(lines: list[str], encoding: str) -> float:
    """Return the usual length of a row, bytes."""
    rows = lines[:_LOOKED_AT]
    return WIDTH.get(encoding, 1) * sum(len(line) + 1 for line in rows) / len(rows)


def _called(names: Sequence[str], named: Sequence[str]) -> dict[str, str]:
    """Return what the file calls the columns that have another name of their own."""
    return {own: name for own, name in zip(names, named) if name and own != name}


def _number(decimal: str) -> re.Pattern[str]:
    """Return the expression of a number with a decimal sign."""
    return re.compile(f'{_NUMBER.format(re.escape(decimal))}|{with_thousands(decimal)}')


def _names(above: list[str], separator: str) -> int:
    """Return how many names the line above the rows holds with a separator, 0 for one alone."""
    fields = split(next((line for line in reversed(above) if line.strip()), ''), separator)
    return len(fields) if len(fields) > 1 else 0


def _counts(fields: list[str]) -> bool:
    """Return whether fields are 0, 1, 2, …, as NumPy and pandas head columns without names."""
    counted = [one for one in fields if one]
    return len(counted) > 2 and len(fields) - len(counted) <= 1 and counted == [
        str(place) for place in range(len(counted))]


def encoding_of(head: bytes, source: str) -> str:
    """Return the encoding of a text by its first bytes; InputError for what is no text."""
    for mark, encoding in _BOMS:
        if head.startswith(mark):
            return encoding
    if b'\0' in head:
        for encoding, zeros, others in (('utf-16-le', head[1::2], head[::2]),
                                        ('utf-16-be', head[::2], head[1::2])):
            if 10 * zeros.count(0) >= 9 * len(zeros) and not others.count(0):
                return encoding
        raise InputError('is no text file: it holds zero bytes', source)
    try:
        # The sample may end within a character.
        head[:-4].decode('utf-8') if len(head) >= SAMPLE_BYTES else head.decode('utf-8')
    except UnicodeDecodeError:
        return 'cp1252' if not {0x81, 0x8d, 0x8f, 0x90, 0x9d} & {*head} else 'latin-1'
    return 'utf-8'


def split(line: str, separator: str) -> list[str]:
    """Return the fields of a line, without quotes and spaces around them."""
    if separator == r'\s+':
        return line.split()
    if '"' in line:
        return [one.strip() for one in next(csv.reader([line.strip()], delimiter=separator,
                                                       skipinitialspace=True))]
    return [one.strip() for one in line.strip(' \r\n').split(separator)]


def _first_row(lines: list[str], separator: str, decimal: str) -> tuple[int, float, int, int]:
    """
    Return where the rows begin, and what they hold.

    That is the share of their fields that are numbers, dates or empty, the number of fields of a
    row, and how many numbers all rows hold.
    """
    number = _number(decimal)
    numbers = fitting = of_rows = 0

    def kind(line: str, fields: list[str]) -> int:
        nonlocal numbers, fitting, of_rows
        numeric = sum(bool(number.fullmatch(one)) for one in fields)
        dates = sum(bool(_DATE.fullmatch(one)) for one in fields)
        empty = sum(one.lower() in _EMPTY for one in fields)
        numbers += numeric
        # A text in a row of numbers is a flag, or a value that the import will name.
        if separator == r'\s+':      # a date and its time stand for one value
            dates -= len(_DATE_AND_TIME.findall(line))
        known = numeric + dates + empty
        if not numeric or 2 * known < len(fields):
            return 0
        fitting, of_rows = fitting + known, of_rows + len(fields)
        return len(fields)

    split_lines = [split(line, separator) for line in lines[:_LOOKED_AT]]
    looked_at = [kind(line, fields) for line, fields in zip(lines, split_lines)]
    # Settings above a table, such as "Rate;200", begin with a word, and its rows with a number.
    rows = [place for place, count in enumerate(looked_at) if count]
    numbered = [place for place in rows if not _begins_with_word(split_lines[place])]
    if 2 * len(numbered) > len(rows):
        looked_at[:numbered[0]] = [0] * numbered[0]
    counts = Counter(count for count in looked_at if count)
    if not counts:
        return 0, 0.0, 0, 0
    usual = max(counts, key=lambda count: (counts[count], count))
    if 2 * counts[usual] < sum(1 for line in lines[:_LOOKED_AT] if line.strip()) and (
            counts[usual] < 3):
        return 0, 0.0, 0, 0
    return looked_at.index(usual), fitting / of_rows, usual, numbers


def _begins_with_word(fields: list[str]) -> bool:
    """Return whether the first field is no number, and does not stand for a missing one."""
    return fields[0][:1].isalpha() and fields[0].lower() not in _EMPTY


def _header(above: list[str], separator: str, count: int, begin: int, source: str,
            decimal: str) -> tuple[list[str], tuple[str, ...]]:
    """Return names and units from the lines above the rows; no names without any."""
    rows = []
    for line in above:
        # A row of units may begin with an empty field, which a tab ends.
        text = (line.strip(' \r\n') if separator == '\t' else line.strip()).lstrip('\ufeff')
        for mark in COMMENTS:
            text = text.removeprefix(mark).strip() if text.startswith(mark) else text
        if text and not re.fullmatch(r'sep=.', text):
            rows.append(split(text, separator))
    if not rows:
        return [], ()
    # A first row of missing values is no header.
    while rows and rows[-1] and all(one.lower() in _EMPTY for one in rows[-1]):
        rows.pop()
    last = rows[-1] if rows else []
    if len(last) == count + 1 and not last[-1]:
        last = rows[-1] = last[:-1]
    if len(last) != count:
        likely = [row for row in rows if len(row) > 1]
        if last and likely and last == likely[-1] and begin:
            raise InputError(
                f'the line above the numbers names {len(last)} columns, but the rows have '
                f'{count} (separator {_told(separator)}, decimal sign "{decimal}"); correct '
                'the header, or write decimal points', f'{source}:{begin}')
        return [], ()
    number = _number(decimal)
    if all(number.fullmatch(one) or _DATE.fullmatch(one) or one.lower() in _EMPTY
           for one in last):
        return [], ()               # the first row of a file without names, with empty fields
    previous = rows[-2] if len(rows) > 1 else []
    if len(previous) == count and all(previous) and _are_units(last):
        return previous, tuple(last)
    return last, ()


def _are_units(fields: list[str]) -> bool:
    from pam_actuation.tables.units import FACTORS, is_output, TIME, unit_of_text
    known = sum(not one or is_output(one, TIME) or any(
        unit_of_text(one, quantity) for quantity in FACTORS) for one in fields)
    return any(fields) and 2 * known > len(fields)


def _unique(names: list[str]) -> tuple[str, ...]:
    """Return names, each once; one that is empty or stands twice is called by its number."""
    counts = Counter(names)
    return tuple(name if name and counts[name] == 1 else f'#{place + 1}'
                 for place, name in enumerate(names))


def _told(separator: str) -> str:
    return {'\t': 'tab', r'\s+': 'spaces'}.get(separator, f'"{separator}"')

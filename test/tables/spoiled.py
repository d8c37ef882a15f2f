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

"""A hundred text files as loggers, spreadsheets and accidents make them, with what is in them."""

import codecs
from collections.abc import Callable
from dataclasses import dataclass, field
import gzip
from itertools import product

import numpy as np

ROWS, STEP_S = 400, 0.005
TIME_S = np.arange(ROWS) * STEP_S
PRESSURE_PA = 101_325.0 + 1e5 * np.round(2.0 - 2.0 * np.cos(2.0 * np.pi * 0.7 * TIME_S), 4)
CONTRACTION_M = 1e-3 * np.round(9.0 - 9.0 * np.cos(2.0 * np.pi * 0.7 * TIME_S - 0.2), 3)
FORCE_N = np.round(41.2 + 3.0 * np.sin(2.0 * np.pi * 0.7 * TIME_S), 2)
VOLTAGE_V = np.round(3.0 - 3.0 * np.cos(2.0 * np.pi * 0.7 * TIME_S + 0.1), 3)
TRUTH = {'pressure': PRESSURE_PA, 'contraction': CONTRACTION_M, 'force': FORCE_N,
         'ppr_voltage': VOLTAGE_V}
NAMES = ('time_s', 'p_bar', 'x_mm', 'F_N', 'u_V')
RIGHT, REMARK, REFUSED = 0, 1, 2


@dataclass
class Spoiled:
    """
    One file: its content, further options, and how the import must end.

    ``remark`` is part of what must be said where the end is not 0. ``differs`` names signals
    whose values may be other than the truth, since the remark says so.
    """

    name: str
    content: bytes
    ends: int = RIGHT
    remark: str = ''
    options: tuple[str, ...] = ()
    file: str = 'log.csv'
    differs: tuple[str, ...] = ()
    rows: slice = field(default_factory=lambda: slice(None))


def table(names=NAMES, separator=',', decimal='.', columns=None, end='\n', head=(), quote=''):
    """Return the text of the recording."""
    if columns is None:
        columns = (TIME_S, 1e-5 * (PRESSURE_PA - 101_325.0), 1e3 * CONTRACTION_M, FORCE_N,
                   VOLTAGE_V)
    lines = list(head)
    if names:
        lines.append(separator.join(f'{quote}{name}{quote}' for name in names))
    for row in zip(*columns):
        lines.append(separator.join(
            quote + (one if isinstance(one, str) else f'{one:.6g}').replace('.', decimal) + quote
            for one in row))
    return end.join(lines) + end


def column(name, values):
    """Return the columns of the recording with one replaced."""
    usual = dict(zip(NAMES, (TIME_S, 1e-5 * (PRESSURE_PA - 101_325.0), 1e3 * CONTRACTION_M,
                             FORCE_N, VOLTAGE_V)))
    return tuple({**usual, name: values}.values())


def edited(change: Callable[[list[str]], list[str] | None]):
    """Return the recording with its lines changed."""
    lines = table().splitlines()
    return ('\n'.join(change(lines) or lines) + '\n').encode()


def set_field(row, place, text):
    """Return a change of lines that replaces one field."""
    def change(lines):
        fields = lines[row + 1].split(',')
        fields[place] = text
        lines[row + 1] = ','.join(fields)
    return change


def forms():
    """Yield files that are in order, in the many forms that programs write."""
    signs = [(s, d) for s, d in product((',', ';', '\t', '|', ' '), '.,') if s != d]
    for (separator, decimal), (encoding, mark) in product(signs, (
            ('utf-8', b''), ('utf-8', codecs.BOM_UTF8), ('utf-16', b''))):
        content = mark + table(separator=separator, decimal=decimal).encode(encoding)
        yield Spoiled(f'separator {separator!r} {decimal!r} {encoding} {mark!r}', content)
    yield Spoiled('no header', table(names=None).encode(), options=(
        '--map', 'time=#1:s', '--map', 'pressure=#2:bar_gauge', '--map', 'contraction=#3:mm',
        '--map', 'force=#4:N', '--map', 'ppr_voltage=#5:V'))
    yield Spoiled('lines end as on Windows', table(end='\r\n').encode())
    yield Spoiled('lines end as on old Macs', table(end='\r').encode())
    yield Spoiled('quotes', table(quote='"').encode())
    yield Spoiled('spaces after commas', table(separator=', ').encode())
    yield Spoiled('sep= of a spreadsheet', table(separator=';', head=('sep=;',)).encode())
    yield Spoiled('comments above', table(head=('# rig 3', '# 2026-11-25', '#')).encode())
    yield Spoiled('names in a comment', ('# ' + table(separator=' ')).encode())
    yield Spoiled('preamble of a logger', table(head=(
        'Logger 4.2', 'Operator,Kim', 'Channels,5', '', '')).encode())
    yield Spoiled('row of units', table(
        names=('Time', 'Pressure', 'Position', 'Force', 'Voltage'),
        head=()).replace('Voltage\n', 'Voltage\n(s),(bar),(mm),(N),(V)\n').encode())
    yield Spoiled('units in brackets', table(names=(
        'Time [s]', 'Pressure [bar]', 'Displacement [mm]', 'Force [N]', 'Voltage [V]')).encode())
    yield Spoiled('umlauts of cp1252', table(names=(
        'Zeit [s]', 'Druck [bar]', 'Weg [mm]', 'Kraft [N]', 'Spannung [V]'), head=(
            'Prüfstand',)).encode('cp1252'))
    yield Spoiled('packed', gzip.compress(table().encode(), mtime=0), file='log.csv.gz')
    yield Spoiled('separator at the end of lines', table().replace('\n', ',\n').encode())
    yield Spoiled('empty lines at the end', (table() + '\n\n\n').encode())
    yield Spoiled('empty lines between', table(end='\n\n').encode())
    yield Spoiled('milliseconds', table(names=('t_ms', *NAMES[1:]), columns=column(
        'time_s', 1e3 * TIME_S)).encode())
    yield Spoiled('milliseconds, not said', table(names=('t', *NAMES[1:]), columns=column(
        'time_s', 1e3 * TIME_S)).encode())
    yield Spoiled('dates', table(names=('timestamp', *NAMES[1:]), columns=column('time_s', [
        f'2026-11-25T09:30:{second:09.6f}' for second in TIME_S])).encode())
    yield Spoiled('seconds from 1970', table(columns=column('time_s', [
        f'{1_764_000_000 + second:.3f}' for second in TIME_S])).encode())
    yield Spoiled('column of texts', table(names=(*NAMES, 'state'), columns=(
        *column('F_N', FORCE_N), ['up', 'down'] * (ROWS // 2))).encode())
    yield Spoiled('psi, named', table(names=('time_s', 'p_psig', *NAMES[2:]), columns=column(
        'p_bar', [f'{value:.8g}' for value in (PRESSURE_PA - 101_325.0) / 6894.757293168361]
    )).encode())
    yield Spoiled('length that falls', table(names=('time_s', 'p_bar', 'L', *NAMES[3:]),
                                             columns=column('x_mm', 300.0 - 1e3 * CONTRACTION_M)
                                             ).encode(),
                  options=('--map', 'contraction=L:mm:zero=300:gain=-1'))
    yield Spoiled('sensor in volts', table(names=('time_s', 'sensor', *NAMES[2:]), columns=column(
        'p_bar', [f'{0.5 + 0.4e-5 * (value - 101_325.0):.8g}' for value in PRESSURE_PA])).encode(),
        options=('--map', 'pressure=sensor:bar_gauge:zero=0.5:gain=2.5'))


def remarked():
    """Yield files with something odd that the import can live with, and says."""
    yield Spoiled('last line ends early', table().encode()[:-4], REMARK, 'may be incomplete',
                  rows=slice(None, -1))
    yield Spoiled('nan', edited(set_field(7, 1, 'nan')), REMARK, '1 of 400 values are missing')
    yield Spoiled('empty field', edited(set_field(7, 3, '')), REMARK, '1 of 400 values')
    yield Spoiled('infinite', edited(set_field(7, 3, 'inf')), REMARK, '1 of 400 values')
    yield Spoiled('text for missing', edited(set_field(7, 3, 'OVL')), REMARK, '1 of 400 values',
                  ('--missing', 'OVL'))
    yield Spoiled('force is dead', table(columns=column('F_N', 0.0 * FORCE_N)).encode(), REMARK,
                  'the value never changes', differs=('force',))
    yield Spoiled('rows twice', edited(lambda lines: [*lines[:9], *lines[8:]]), REMARK,
                  'stand twice')
    yield Spoiled('coarse time', table(columns=column(
        'time_s', np.round(1e3 * TIME_S) // 10 / 100.0)).encode(), REMARK, 'spread')
    yield Spoiled('rows out of order, sorted', edited(
        lambda lines: [*lines[:9], lines[10], lines[9], *lines[11:]]), REMARK, 'in order',
        ('--sort',))
    yield Spoiled('absolute said to be gauge', table(columns=column(
        'p_bar', 1e-5 * PRESSURE_PA)).encode(), REMARK, 'absolute',
        ('--map', 'pressure=p_bar:bar_gauge'), differs=('pressure',))
    yield Spoiled('m said to be mm', table(names=('time_s', 'p_bar', 'x', 'F_N', 'u_V'),
                                           columns=column('x_mm', CONTRACTION_M)).encode(),
                  REMARK, 'x:m"', ('--map', 'contraction=x:mm'), differs=('contraction',))
    yield Spoiled('kN said to be N', table(names=('time_s', 'p_bar', 'x_mm', 'load', 'u_V'),
                                           columns=column('F_N', [f'{one:.9g}' for one in
                                                                  1e-3 * FORCE_N])).encode(),
                  REMARK, 'load:kN"', ('--map', 'force=load:N'), differs=('force',))
    yield Spoiled('name says psi', table(names=('time_s', 'p_psi', *NAMES[2:])).encode(), REMARK,
                  'says psi', ('--map', 'pressure=p_psi:bar_gauge'))
    yield Spoiled('dropouts of the force', edited(lambda lines: [
        lines[0], *(line if place % 9 else ','.join([*line.split(',')[:3], '', '0'])
                    for place, line in enumerate(lines[1:]))]), REMARK, 'values are missing',
        differs=('ppr_voltage',))


def refused():
    """Yield files that cannot be right, or do not say what they mean."""
    yield Spoiled('empty', b'', REFUSED, 'empty')
    yield Spoiled('only a header', (','.join(NAMES) + '\n').encode(), REFUSED, 'no rows')
    yield Spoiled('prose', b'Dear diary,\nthe muscle moved today.\n' * 9, REFUSED, 'no rows')
    yield Spoiled('a picture', b'\x89PNG\r\n\x1a\n\0\0\0\rIHDR' + bytes(99), REFUSED, 'no text')
    yield Spoiled('another ending', table().encode(), REFUSED, '.xlsx', file='log.xlsx')
    yield Spoiled('said to be packed', table().encode(), REFUSED, 'unpacked', file='log.csv.gz')
    yield Spoiled('text in a number', edited(set_field(7, 1, 'OVL')), REFUSED, ':9: column')
    yield Spoiled('decimal comma once', edited(set_field(7, 1, '"1,5"')), REFUSED, 'decimal')
    yield Spoiled('one field more', edited(set_field(7, 1, '1,5')), REFUSED, '6 fields')
    yield Spoiled('header of other length', table(names=NAMES[:4]).encode(), REFUSED,
                  'names 4 columns')
    yield Spoiled('decimal commas as separators', table(decimal=',').encode(), REFUSED,
                  'log.csv')
    yield Spoiled('time runs back', edited(lambda lines: [*lines[:200], *lines[100:]]), REFUSED,
                  'runs back')
    yield Spoiled('two recordings', (table() + table()).encode(), REFUSED, 'log.csv:402')
    yield Spoiled('two headers', (table() + table(names=('again', *NAMES[1:]))).encode(), REFUSED,
                  'log.csv:402')
    yield Spoiled('no time', table(names=('a', *NAMES[1:])).encode(), REFUSED, '--rate')
    yield Spoiled('time missing', edited(set_field(7, 0, '')), REFUSED, 'has no time here')
    yield Spoiled('ms said to be s', table(columns=column('time_s', 1e3 * TIME_S * 60)).encode(),
                  REFUSED, 'rows a second')
    yield Spoiled('time stands still', table(columns=column('time_s', 0.0 * TIME_S)).encode(),
                  REFUSED, 'time of the row before')
    yield Spoiled('column not there', table().encode(), REFUSED, 'did you mean "p_bar"',
                  ('--map', 'pressure=p_baar:bar_gauge'))
    yield Spoiled('column number not there', table().encode(), REFUSED, 'no column "#9"',
                  ('--map', 'pressure=#9:bar_gauge'))
    yield Spoiled('unit that none is', table().encode(), REFUSED, 'no unit of a pressure',
                  ('--map', 'pressure=p_bar:barn'))
    yield Spoiled('gauge or absolute', table().encode(), REFUSED, 'gauge or absolute',
                  ('--map', 'pressure=p_bar:bar'))
    yield Spoiled('gauge or absolute, not told by the range', table(
        columns=column('p_bar', 1e-5 * PRESSURE_PA)).encode(), REFUSED, 'bar_abs')
    yield Spoiled('gauge said to be absolute', table().encode(), REFUSED, 'bar_gauge"',
                  ('--map', 'pressure=p_bar:bar_abs'))
    yield Spoiled('bar said to be Pa', table().encode(), REFUSED, 'p_bar:bar_gauge"',
                  ('--map', 'pressure=p_bar:Pa_abs'))
    yield Spoiled('mm said to be m', table().encode(), REFUSED, 'x_mm:mm"',
                  ('--map', 'contraction=x_mm:m'))
    yield Spoiled('unit not said', table(names=('time_s', 'pressure', 'x_mm', 'F_N', 'u_V')
                                         ).encode(), REFUSED, 'in which unit')
    yield Spoiled('one duty only', table(names=(*NAMES[:4], 'fill_duty'), columns=column(
        'u_V', np.round(VOLTAGE_V / 10.0, 3))).encode(), REFUSED, 'vent_duty',
        ('--map', 'fill_duty=fill_duty:1'))
    yield Spoiled('zero bytes within', table().encode()[:3000] + bytes(64) + table().encode()[
        3064:], REFUSED, 'zero bytes')
    yield Spoiled('other values at one time', edited(lambda lines: [
        *lines[:9], '0.040,3,1,40,5', '0.040,1,2,41,4', *lines[11:]]), REFUSED, 'log.csv:')


def cases():
    """Return all files."""
    return [*forms(), *remarked(), *refused()]

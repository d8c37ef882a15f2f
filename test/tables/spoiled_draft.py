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

"""Three recordings whose SI values are known, as text files that can be spoiled."""

import bz2
from dataclasses import dataclass, field
import gzip

import numpy as np

ATMOSPHERE_PA, PSI_PA = 101_325.0, 6894.757293168361
EPOCH_S = 1_764_000_000


@dataclass
class Column:
    """
    One column: its name in the file, its numbers there, and the signal they are.

    ``signal`` is '' for the time and for what no rig has.
    """

    name: str
    numbers: np.ndarray
    signal: str = ''
    factor: float = 1.0
    offset: float = 0.0
    form: str = '.9g'

    def si(self):
        """Return the values in SI."""
        return self.factor * self.numbers + self.offset


@dataclass
class Draft:
    """
    A text file before it is written, and what is known of it.

    ``damaged`` counts the rows that may be lost. ``shift_s`` is how far a time may be off where
    the import says so. ``telltale`` is a part of the remark that tells what is wrong beside a
    remark on the signal itself. ``truth`` holds the SI values by signal, and stays what it is.
    """

    columns: list
    separator: str = ','
    decimal: str = '.'
    encoding: str = 'utf-8'
    mark: bytes = b''
    end: str = '\n'
    ending: str = '.csv'
    quote: str = ''
    start_s: float = 0.0
    has_header: bool = True
    head: list = field(default_factory=list)
    tail: str = ''
    options: list = field(default_factory=list)
    steps: list = field(default_factory=list)
    line_steps: list = field(default_factory=list)
    byte_steps: list = field(default_factory=list)
    damaged: int = 0
    shift_s: float = 0.0
    telltale: str = ''
    names: list = field(default_factory=list)
    truth: dict = field(default_factory=dict)
    time_s: np.ndarray = None

    def __post_init__(self):
        self.time_s = self.columns[0].si()
        self.truth = {one.signal: one.si() for one in self.columns if one.signal}
        self.names = [one.name for one in self.columns]

    @property
    def rows(self):
        """Return the number of rows."""
        return len(self.columns[0].numbers)

    def place(self, signal):
        """Return the number of the column of a signal, -1 without it."""
        return next((k for k, one in enumerate(self.columns) if one.signal == signal), -1)

    def cells(self):
        """Return the fields of all rows as texts, with the decimal sign of the file."""
        texts = [[format(float(value), one.form) for value in one.numbers]
                 for one in self.columns]
        return [[text.replace('.', self.decimal) for text in row] for row in zip(*texts)]

    def content(self):
        """Return the bytes of the file."""
        rows = self.cells()
        for change in self.steps:
            rows = change(rows) or rows
        quoted = [[f'{self.quote}{text}{self.quote}' for text in row] for row in rows]
        lines = [*self.head]
        if self.has_header:
            lines.append(self.separator.join(f'{self.quote}{n}{self.quote}' for n in self.names))
        first = len(lines)
        lines += [self.separator.join(row) for row in quoted]
        for change in self.line_steps:
            lines = change(lines, first) or lines
        text = self.end.join(lines) + self.end + self.tail
        content = self.mark + text.encode(self.encoding)
        for change in self.byte_steps:
            content = change(content)
        if self.ending.endswith('.gz'):
            return gzip.compress(content, mtime=0)
        return bz2.compress(content) if self.ending.endswith('.bz2') else content


def _waves(time_s, hz):
    """Return gauge pressure [Pa], contraction [m], force [N] and voltage [V] of a slow wave."""
    phase = 2.0 * np.pi * hz * time_s
    return (1e5 * np.round(2.0 - 2.0 * np.cos(phase), 4),
            1e-3 * np.round(9.0 - 9.0 * np.cos(phase - 0.2), 3),
            np.round(41.2 + 3.0 * np.sin(phase), 2), np.round(3.0 - 3.0 * np.cos(phase + 0.1), 3))


def regulator():
    """Return 3 s at 200 Hz behind a regulator: bar, mm, N, V."""
    time_s = 0.005 * np.arange(600)
    p, x, f, u = _waves(time_s, 0.7)
    return Draft([Column('time_s', time_s), Column('p_bar', 1e-5 * p, 'pressure', 1e5,
                                                   ATMOSPHERE_PA),
                  Column('x_mm', 1e3 * x, 'contraction', 1e-3), Column('F_N', f, 'force'),
                  Column('u_V', u, 'ppr_voltage')])


def valves():
    """Return 1.6 s at 500 Hz of an on/off pair: ms, kPa absolute, m, duties in percent."""
    time_s = 0.002 * np.arange(800)
    p, x, _, u = _waves(time_s, 1.1)
    fill, vent = np.round(100.0 * np.maximum(u - 3.0, 0.0) / 6.0, 1), np.round(
        100.0 * np.maximum(3.0 - u, 0.0) / 6.0, 1)
    return Draft([Column('t_ms', 1e3 * time_s, factor=1e-3),
                  Column('pressure_kPa_abs', 1e-3 * (p + ATMOSPHERE_PA), 'pressure', 1e3),
                  Column('displacement [m]', x, 'contraction'),
                  Column('fill_duty_%', fill, 'fill_duty', 1e-2),
                  Column('vent_duty_%', vent, 'vent_duty', 1e-2)])


def slow_loop():
    """Return 200 s at 2 Hz of a slow loop: psi gauge, cm, lbf, V."""
    time_s = 0.5 * np.arange(400)
    p, x, f, u = _waves(time_s, 0.02)
    return Draft([Column('Time [s]', time_s),
                  Column('Pressure [psig]', np.round(p / PSI_PA, 4), 'pressure', PSI_PA,
                         ATMOSPHERE_PA),
                  Column('Position [cm]', np.round(1e2 * x, 4), 'contraction', 1e-2),
                  Column('Force [lbf]', np.round(f / 4.4482216152605, 4), 'force',
                         4.4482216152605),
                  Column('Voltage [V]', u, 'ppr_voltage')])


TABLES = (regulator, valves, slow_loop)
STYLES = ((',', '.'), (';', ','), (';', '.'), ('\t', '.'), ('\t', ','), ('|', ','))


def styled(draft, random, styles=STYLES):
    """Return the draft in one of the forms that programs write."""
    draft.separator, draft.decimal = styles[random.integers(len(styles))]
    draft.end = ('\n', '\r\n')[random.integers(2)]
    draft.encoding, draft.mark = (('utf-8', b''), ('utf-8', b'\xef\xbb\xbf'), ('cp1252', b''),
                                  ('utf-16-le', b'\xff\xfe'))[random.integers(4)]
    return draft

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

"""Which column is which signal, in which unit: said on the command line or in a mapping file."""

from collections.abc import Iterable, Mapping as MappingOf
from dataclasses import dataclass, field, replace
import math
import re
from typing import Any

import numpy as np
from pam_actuation.tables.signals import ALLOWED, signal_of
from pam_actuation.tables.units import checked_unit, DATE, TIME, Unit
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.files import StrPath
from pam_sim.keys import Key, names_of
from pam_sim.located_yaml import dump_yaml, load_yaml, Located

LEAST_RATE_HZ, MOST_RATE_HZ = 0.1, 1e6
MOST_LATE_S = 10.0
SYNTAX = 'COLUMN:UNIT[:zero=Z][:gain=G][:missing=N][:late_s=S]'
_NUMBER = re.compile(r'\s*(zero|gain|missing|late_s)\s*=')
COLUMN_KEYS = (
    Key('column', str, 'name of the column, or its number such as `#3`', required=True),
    Key('unit', str, 'unit of the column, such as `bar_gauge`', required=True),
    Key('zero', float, 'value of the column that means 0', 0.0),
    Key('gain', float, 'units for each step of the column; -1 turns the sign round', 1.0),
    Key('missing', float, 'number that stands for a missing value, such as 0 of a broken wire',
        otherwise='none'),
    Key('late_s', float, 'how much later than its time stamp says the column tells a value; its '
        'stamps are moved back by it', 0.0, unit='s', lower=-MOST_LATE_S, upper=MOST_LATE_S),
    Key('optional', bool, 'whether a table without the column is read all the same', False))
TIME_KEYS = (COLUMN_KEYS[0], Key(
    'unit', str, '`s`, `ms`, `us`, `ns`, `min`, `h`, or `date`', otherwise='from the name'))
KEYS = (
    Key('time', dict, 'the column of the time', otherwise='found by name'),
    Key('rate_hz', float, 'rows a second, where no column is the time', unit='Hz',
        otherwise='a column of the time', lower=LEAST_RATE_HZ, upper=MOST_RATE_HZ),
    Key('signals', dict, 'each signal with its column', required=True))


@dataclass(frozen=True)
class ColumnMap:
    """
    One column and what its numbers mean: ``gain`` × (column - ``zero``), in ``unit``.

    Parameters
    ----------
    column : str
        Its name, or its number such as ``#3``.
    unit : Unit
        Of the result, before SI.
    zero, gain : float
        Such as 0.5 and 2.5 for a sensor of 0.5 to 4.5 V that means 0 to 10 bar.
    missing : float, optional
        Number in the column that stands for a missing value.
    late_s : float
        How late it tells a value [s]; its stamps are moved back by it.
    optional : bool
        Whether the column may be missing.
    where : str
        Where the user said so, for messages.

    """

    column: str
    unit: Unit
    zero: float = 0.0
    gain: float = 1.0
    missing: float | None = None
    late_s: float = 0.0
    optional: bool = False
    where: str = field(default='', compare=False)

    def to_si(self, values: FloatArray) -> FloatArray:
        """Return the numbers of the column in SI, pressures absolute; NaN where missing."""
        if self.missing is not None:
            values = np.where(values == self.missing, np.nan, values)
        if self.zero or self.gain != 1.0:
            values = (values - self.zero) * self.gain
        return self.unit.to_si(values)

    def plain(self) -> dict[str, Any]:
        """Return the entry of a mapping file."""
        entry: dict[str, Any] = {'column': self.column, 'unit': self.unit.name}
        if self.zero:
            entry['zero'] = self.zero
        if self.gain != 1.0:
            entry['gain'] = self.gain
        if self.missing is not None:
            entry['missing'] = self.missing
        if self.late_s:
            entry['late_s'] = self.late_s
        return entry | ({'optional': True} if self.optional else {})

    @property
    def numbers(self) -> tuple[str, ...]:
        """Return zero, gain and others as ``zero=200``, those that differ from the usual."""
        usual = {'zero': 0.0, 'gain': 1.0, 'missing': None, 'late_s': 0.0}
        return tuple(f'{name}={own:.15g}' for name, one in usual.items()
                     if (own := getattr(self, name)) != one)

    @property
    def reading(self) -> str:
        """Return how its numbers are taken, for people: ``mm, zero=200, gain=-1``."""
        return ', '.join([self.unit.name, *self.numbers])

    @property
    def words(self) -> str:
        """Return what stands after the column in ``--map``: ``mm:zero=200:gain=-1``."""
        return ':'.join([self.unit.name, *self.numbers])

    def option(self, name: str) -> str:
        """Return the words of the command line that say the same."""
        return f'--map {name}="{self.column}:{self.words}"'


@dataclass(frozen=True)
class TimeMap:
    """The column of the time and its unit, ``date`` for text; '' where it must be found out."""

    column: str
    unit: str = ''
    where: str = field(default='', compare=False)


@dataclass(frozen=True)
class TableMapping:
    """
    What a table means.

    Parameters
    ----------
    signals : dict of str to ColumnMap
        By name of the signal (``tables/signals.py``).
    time : TimeMap, optional
        The column of the time.
    rate_hz : float, optional
        Rows a second, where no column is the time.

    """

    signals: MappingOf[str, ColumnMap] = field(default_factory=dict)
    time: TimeMap | None = None
    rate_hz: float | None = None

    def to_yaml(self) -> str:
        """Return the text of a mapping file."""
        data: dict[str, Any] = {}
        if self.rate_hz is not None:
            data['rate_hz'] = self.rate_hz
        elif self.time is not None:
            data['time'] = {'column': self.time.column} | (
                {'unit': self.time.unit} if self.time.unit else {})
        data['signals'] = {name: one.plain() for name, one in self.signals.items()}
        return dump_yaml(data)

    def with_options(self, options: Iterable[str], rate_hz: float | None = None
                     ) -> 'TableMapping':
        """
        Return the mapping with what ``--map`` and ``--rate`` say in addition.

        Raises
        ------
        InputError
            An option that is not ``NAME=COLUMN:UNIT``, with the name of a signal or ``time``.

        """
        signals, time, rows_hz = dict(self.signals), self.time, self.rate_hz
        for text in options:
            name, equals, rest = text.partition('=')
            name, where = name.strip(), f'--map {text}'
            if not equals or not rest.strip():
                raise InputError(
                    f'write --map NAME="{SYNTAX}", NAME one of time, {ALLOWED}', where)
            if name == TIME:
                time, rows_hz = _time_of_text(rest, where), None
            else:
                signals[name] = column_of_text(name, rest, where)
        if rate_hz is not None:
            time, rows_hz = None, rate_hz
        return replace(self, signals=signals, time=time, rate_hz=rows_hz)

    def without(self, names: Iterable[str]) -> 'TableMapping':
        """Return the mapping without some signals; InputError for one that it does not hold."""
        signals = dict(self.signals)
        for name in names:
            if signals.pop(name, None) is None:
                raise InputError(f'{name!r} is no signal of the mapping; it holds '
                                 f'{", ".join(self.signals) or "none"}', '--without')
        return replace(self, signals=signals)


def column_of_text(signal: str, text: str, where: str) -> ColumnMap:
    """Return what a text such as ``SYNTAX`` says of a signal; InputError if it cannot."""
    quantity = signal_of(signal, where).quantity
    column, words = _split(text)
    numbers: dict[str, Any] = {}
    while words and _NUMBER.match(words[-1]):
        key, _, value = words.pop().partition('=')
        numbers[key.strip()] = _number(value, key.strip(), where)
    if len(words) > 1:
        column, words = ':'.join([column, *words[:-1]]), words[-1:]
    if not words or not words[0].strip():
        raise InputError(
            f'the unit is missing: write {signal}="{column}:UNIT", such as '
            f'{signal}="{column}:{usual_unit(quantity)}"', where)
    return _checked(ColumnMap(column, checked_unit(words[0], quantity, where),
                              where=where, **numbers))


def load_mapping(path: StrPath) -> TableMapping:
    """
    Return the mapping in a file.

    Raises
    ------
    InputError
        No such file; a key, signal or unit that is not known; a value out of range.

    """
    tree = load_yaml(path).check_keys(names_of(KEYS))
    time_key, rate_key, signals_key = KEYS
    time = None
    if time_key.name in tree:
        entry = time_key.read(tree).check_keys(names_of(TIME_KEYS))
        time = TimeMap(_column(entry), _time_unit(
            TIME_KEYS[1].read(entry) or '', entry.where('unit')), entry.where('column'))
    rate_hz = rate_key.read(tree)
    if time is not None and rate_hz is not None:
        raise tree.error('give time or rate_hz, not both', 'rate_hz')
    signals = {}
    for name, entry in signals_key.read(tree).items():
        quantity = signal_of(name, tree['signals'].where(name)).quantity
        entry = tree['signals'].require(name, dict).check_keys(names_of(COLUMN_KEYS))
        _, unit, zero, gain, missing, late_s, optional = COLUMN_KEYS
        signals[name] = _checked(ColumnMap(
            _column(entry), checked_unit(unit.read(entry), quantity, entry.where('unit')),
            zero.read(entry), gain.read(entry), missing.read(entry), late_s.read(entry),
            optional.read(entry), entry.where()))
    return TableMapping(signals, time, rate_hz)


def _column(entry: Located) -> str:
    return str(COLUMN_KEYS[0].read(entry))


def _checked(one: ColumnMap) -> ColumnMap:
    if one.gain == 0.0 or not all(map(math.isfinite, (
            one.gain, one.zero, one.missing or 0.0))):
        more = '' if one.missing is None else f', missing = {one.missing:g}'
        raise InputError(
            f'zero = {one.zero:g} and gain = {one.gain:g}{more}; allowed are finite numbers, and '
            'a gain that is not 0', one.where)
    if not abs(one.late_s) <= MOST_LATE_S:
        raise InputError(f'late_s = {one.late_s:g}; allowed are -{MOST_LATE_S:g} to '
                         f'{MOST_LATE_S:g} s', one.where)
    return one


def _time_of_text(text: str, where: str) -> TimeMap:
    column, words = _split(text)
    if words and _is_time_unit(words[-1]):
        return TimeMap(':'.join([column, *words[:-1]]), _time_unit(words[-1], where), where)
    if len(words) == 1:
        _time_unit(words[0], where)
    return TimeMap(':'.join([column, *words]), '', where)


def _is_time_unit(text: str) -> bool:
    from pam_actuation.tables.units import unit_of_text
    return text.strip() == DATE or unit_of_text(text, TIME) is not None


def _time_unit(text: str, where: str) -> str:
    if not text or text.strip() == DATE:
        return text.strip()
    return checked_unit(text, TIME, where).name


def _split(text: str) -> tuple[str, list[str]]:
    column, *words = text.strip().split(':')
    return column.strip(), words


def _number(text: str, key: str, where: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f'{key} is {text!r}; allowed is a number, with a decimal point',
                         where) from None


def usual_unit(quantity: str) -> str:
    """Return the unit in which most programs write a quantity."""
    return {'pressure': 'kPa_gauge', 'length': 'mm', 'force': 'N', 'voltage': 'V',
            'duty': '1', 'angle': 'deg', 'speed': 'mm/s', 'angular rate': 'deg/s'}[quantity]

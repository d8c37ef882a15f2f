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

"""
Rules in words, for any table of a rule base.

A rule over named sets reads "if error is small positive and change of error is about zero
(contracting) then raise pressure a little (+1.2 kPa)". A rule over places reads "near 14 mm,
extending: add 6.3 kPa". How much is said by size:

=====================  =======================================================
below 0.05 kPa         leave pressure as it is
below 2 kPa            a little
2 to 10 kPa            (no word)
10 kPa and more        much
=====================  =======================================================

The 5 mm muscle under 5 kg moves 0.04 to 0.11 mm per kPa. So a little is about a tenth of a
millimetre, and much is about a whole one.
"""

from dataclasses import dataclass
import math
from typing import TYPE_CHECKING

import numpy as np
from pam_sim.annotations import Number

if TYPE_CHECKING:
    from pam_actuation.control.sofc.rule_table import Antecedent, RuleBase, RuleTable

NOTHING_KPA, LITTLE_KPA, MUCH_KPA = 0.05, 2.0, 10.0
_ACTS_PA = 1.0            # a rule whose output is smaller does nothing
DIRECTION, PATH, FADING = 'direction', 'path', 'fading'
# SI unit -> factor and unit for people.
SHOWN = {'Pa': (1e-3, 'kPa'), 'm': (1e3, 'mm'), 'm/s': (1e3, 'mm/s'),
         'rad': (180.0 / math.pi, 'deg'), 'rad/s': (180.0 / math.pi, 'deg/s')}
WAYS = {'m/s': ('contracting', 'extending'), 'rad/s': ('flexing', 'extending')}


@dataclass(frozen=True)
class SpokenRule:
    """
    One rule: where it stands, what it adds, how often it fired, and how it reads.

    ``value_pa`` and ``initial_pa`` are its present and initial output [Pa]. ``fired_s`` is the sum
    of its firing strengths times the period [s]. ``importance_pa_s`` is the product of ``fired_s``
    and the size of the output.
    """

    table: str
    place: tuple[int, ...]
    value_pa: float
    initial_pa: float
    fired_s: float
    sentence: str

    @property
    def importance_pa_s(self) -> float:
        """How long the rule acted times how much [Pa s]."""
        return self.fired_s * abs(self.value_pa)


def shown(value: Number, unit: str) -> tuple[Number, str]:
    """Return a value in the unit people read, and that unit."""
    factor, name = SHOWN.get(unit, (1.0, unit))
    return value * factor, name


def number(value: float) -> str:
    """Return a number of a knot in three significant digits, without an exponent."""
    if abs(value) < 1e-9:
        return '0'
    digits = max(2 - math.floor(math.log10(abs(value))), 0)
    text = f'{value:.{digits}f}'
    return text.rstrip('0').rstrip('.') if '.' in text else text


def sentence(table: 'RuleTable', place: tuple[int, ...]) -> str:
    """
    Return one rule of a table in words.

    Parameters
    ----------
    table : RuleTable
        As ``RuleBase.tables`` gives it.
    place : tuple of int
        Index of the rule, one entry per antecedent.

    """
    named, knots, direction, path = [], [], '', ''
    for antecedent, index in zip(table.antecedents, place):
        if antecedent.name == DIRECTION:
            direction = antecedent.words[index]
        elif antecedent.name == PATH:
            path = _path(antecedent, index)
        elif antecedent.words:
            named.append(f'{antecedent.name} is {antecedent.words[index]}')
        else:
            knots.append(_near(antecedent, index))
    size_kpa = float(table.values[place]) * table.scale * 1e-3
    if named:
        side = f' ({direction})' if direction else ''
        return f'if {" and ".join(named + knots)}{side} then {_action(size_kpa)}'
    places = knots + [word for word in (direction, path) if word]
    return f'{", ".join(places)}: {_addition(size_kpa)}'


def _near(antecedent: 'Antecedent', index: int) -> str:
    """Return in words where a knot is: a place, or a rate with its direction."""
    value, unit = shown(float(antecedent.knots[index]), antecedent.unit)
    if not antecedent.unit.endswith('/s'):
        return f'near {number(value)} {unit}'.rstrip()
    if number(value) == '0':
        return 'at rest'
    up, down = WAYS.get(antecedent.unit, ('rising', 'falling'))
    return f'{up if value > 0 else down} at {number(abs(value))} {unit}'


def _path(antecedent: 'Antecedent', index: int) -> str:
    """Return in words which path led there; the rule takes off as much after the opposite one."""
    if index == 0:
        return 'after any path'
    value, unit = shown(float(antecedent.knots[index]), antecedent.unit)
    up, down = WAYS.get(f'{antecedent.unit}/s', ('rising', 'falling'))
    way = f'{number(value)} {unit}'
    if antecedent.words and antecedent.words[index] == FADING:
        return f'after {up}, fading over {way} (after {down} the opposite)'
    return f'after {up} by {way} (after {down} the opposite)'


def _action(size_kpa: float) -> str:
    """Return what a rule does to the pressure, with its size in a word and as a number."""
    size = abs(size_kpa)
    if size < NOTHING_KPA:
        return f'leave pressure as it is ({size_kpa + 0.0:+.2f} kPa)'
    much = ' a little' if size < LITTLE_KPA else ' much' if size >= MUCH_KPA else ''
    digits = 2 if size < 1.0 else 1
    return (f'{"raise" if size_kpa > 0 else "lower"} pressure{much} '
            f'({size_kpa:+.{digits}f} kPa)')


def _addition(size_kpa: float) -> str:
    """Return what a rule adds to the pressure."""
    size = abs(size_kpa)
    if size < NOTHING_KPA:
        return 'add nothing'
    return f'{"add" if size_kpa > 0 else "take off"} {size:.{2 if size < 1.0 else 1}f} kPa'


def ranked(rules: 'RuleBase') -> list[SpokenRule]:
    """
    Return the rules that act, as SpokenRule, the most important first.

    Importance is firing times size. Where no rule has fired at all, every rule that adds
    something is returned, the largest first.
    """
    tables = rules.tables()
    rate_hz = rules.scaling.get('rate_hz', 1.0)
    idle = not any(table.fired.any() for table in tables)
    found = []
    for table in tables:
        acting = np.abs(table.values) * table.scale >= _ACTS_PA
        if not idle:
            acting &= table.fired > 0.0
        for place in map(tuple, np.argwhere(acting).tolist()):
            found.append(SpokenRule(
                table.name, place, float(table.values[place]) * table.scale,
                float(table.initial[place]) * table.scale,
                float(table.fired[place]) / rate_hz, sentence(table, place)))
    return sorted(found, key=lambda one: (-one.importance_pa_s, -abs(one.value_pa)))

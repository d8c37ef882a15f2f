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

"""What a file does not say of a column: the question, and which answers it admits."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import re

from pam_actuation.tables.mapping import column_of_text
from pam_actuation.tables.signals import BY_NAME, Signal
from pam_actuation.tables.units import (
    ABSOLUTE, bare, DUTY, example_of, filled_unit, form_of, GAIN, GAUGE, is_output, LENGTH,
    unit_of_text, ZERO)
from pam_sim.errors import InputError
from pam_sim.joint.parameters import SIDES

_NUMBERS = re.compile(r'(?::\s*(?:zero|gain|missing)\s*=[^:]*)+$')
MUSCLES = ' Of several muscles, import each by itself.'
_SHARES = {'%': '1/100 of that length', '1': 'that length'}


@dataclass(frozen=True)
class Question:
    """
    What the file does not say of a column that seems to be a signal.

    Parameters
    ----------
    signal, column : str
        Which is meant; the column is '' where several could be the signal, the signal is '' where
        the column could be one of several.
    text : str
        The question, in one sentence.
    answers : tuple of str
        Units among which to choose, as after the column in ``--map``; of several columns
        ``COLUMN:UNIT``, of several signals ``SIGNAL=UNIT``. ``ZERO`` and ``GAIN`` are to be
        filled in.
    any_unit : bool
        Whether every unit of the signal is an answer.
    is_output : bool
        Whether the column holds what a sensor puts out, so that an answer needs a gain. Another
        column that could be the signal goes before it.

    """

    signal: str
    column: str
    text: str
    answers: tuple[str, ...]
    any_unit: bool = False
    is_output: bool = False

    @property
    def signals(self) -> list[str]:
        """Return the signals that are meant, more than one where that is the question."""
        return list(dict.fromkeys(self.parted(one)[0] for one in self.answers))

    def options(self) -> str:
        """Return the words of the command line that answer it, one of them for each answer."""
        return ' or '.join(f'--map {signal}="{text}"' for signal, text in map(
            self.parted, self.answers))

    def parted(self, answer: str) -> tuple[str, str]:
        """Return the signal and what is said of it, ``COLUMN:UNIT``, of an answer."""
        signal, equals, unit = ('', '', answer) if self.signal else answer.partition('=')
        if not equals:
            signal, unit = self.signal, answer
        return signal, f'{self.column}:{unit}' if self.column else unit

    def choice(self) -> str:
        """Return among which answers a person at a terminal chooses, in words."""
        if self.any_unit:
            return f'such as {" or ".join(self.answers)}, with numbers in place of capitals'
        more = ', where the zero may be another' if any('zero=' in one and ZERO not in one
                                                        for one in self.answers) else ''
        more += ', with numbers in place of capitals' if any(
            GAIN in one for one in self.answers) else ''
        return f'one of: {", ".join(self.answers)}{more}'

    def refusal(self, said: str) -> str:
        """Return why an answer is none, in one sentence; '' for one that is."""
        offered = {_NUMBERS.sub('', one): one for one in self.answers}
        own = _NUMBERS.sub('', said)
        if not self.any_unit and own not in offered:
            return f'{said!r} is not one of them'
        try:
            column_of_text(*self.parted(said), f'{said!r}')
        except InputError as error:
            return str(error)
        needed = ('gain=',) if self.is_output else () if self.any_unit else tuple(
            key for key in ('zero=', 'gain=') if key in offered[own] and ZERO not in offered[own]
            or key == 'gain=' and GAIN in offered[own])
        lacking = next((key for key in needed if key not in said), '')
        return f'{said!r} says no {lacking.rstrip("=")}' if lacking else ''


def of_output_column(signal: Signal, column: str, shown: str, unit: str) -> Question:
    """
    Return the question how a column is read whose unit is none of the signal.

    Parameters
    ----------
    signal : Signal
        Which it seems to be.
    column, shown : str
        Its name, and what it seems to be in words.
    unit : str
        The text that stands where a unit stands.

    """
    target = filled_unit(signal.quantity)
    # A form for each kind of pressure; one for all else.
    forms = tuple(dict.fromkeys(form_of(signal.quantity, kind) for kind in (GAUGE, ABSOLUTE)))
    share = _share_of(unit, signal.quantity)
    if share:
        return Question(
            signal.name, column, f'{shown}, as a share of the length at rest: how long is '
            f'the muscle at rest ({GAIN} is {_SHARES[share]}, in mm)?',
            (f'mm:gain={GAIN}',), True, True)
    example = example_of(unit, signal.quantity)
    step = bare(unit) if example or bare(unit) == '%' else 'step'
    asked = (f'which reading of it means 0 ({ZERO}), and how many {target.partition("_")[0]} is '
             f'one {step} ({GAIN})?' + (f' Such as {example}.' if example else ''))
    article = 'an' if signal.quantity[0] == 'a' else 'a'
    if needs_gain(unit, signal.quantity):
        return Question(signal.name, column, f'{shown}, in {unit}, which is no unit of {article} '
                        f'{signal.quantity}: {asked}', forms, True, True)
    return Question(
        signal.name, column, f'{shown}, but "{unit}" is no known unit of {article} '
        f'{signal.quantity}: {asked} If it is not meant as a unit, state one in place of '
        f'{forms[0]}.', forms, True)


def needs_gain(unit: str, quantity: str) -> bool:
    """Return whether a text is known to be no unit of a quantity, but what stands for one."""
    return is_output(unit, quantity) or bool(_share_of(unit, quantity)) or (
        quantity != DUTY and bare(unit) == '%')


def _share_of(unit: str, quantity: str) -> str:
    """Return '%' or '1' for a share of the muscle's length, '' for anything else."""
    return _name_of(unit, DUTY) if quantity == LENGTH else ''


def _name_of(unit: str, quantity: str) -> str:
    found = unit_of_text(unit, quantity)
    return '' if found is None else found.name


def which_of(signal: Signal, columns: Sequence[tuple[str, tuple[str, ...]]]) -> Question:
    """Return the question which of several columns, each with its answers, is the signal."""
    quoted = [f'"{column}"' for column, _ in columns]
    names = ' and '.join([', '.join(quoted[:-1]), quoted[-1]] if len(quoted) > 1 else quoted)
    more = MUSCLES if len(columns) > 2 else ''
    return Question(signal.name, '', f'columns {names} could each be the {signal.meaning}: '
                    f'which one?{more}', tuple(f'{column}:{unit}' for column, units in columns
                                               for unit in units[:2]))


def of_a_joint(question: Question) -> Question:
    """Return the question which of two columns is a signal, with how both are of a joint."""
    first: dict[str, str] = {}                  # answer of each column
    for answer in question.answers:
        first.setdefault(answer.partition(':')[0], answer)
    if question.column or len(first) != len(SIDES) or any(
            f'{side}/{question.signal}' not in BY_NAME for side in SIDES):
        return question
    maps = ' '.join(f'--map {side}/{question.signal}="{one}"'
                    for side, one in zip(SIDES, first.values()))
    return replace(question, text=f'{question.text} If they are the two of a joint, write {maps}.')


def either_of(column: str, signals: Mapping[str, tuple[str, ...]]) -> Question:
    """Return the question which of several signals, each with its units, a column is."""
    meanings = ' or the '.join(BY_NAME[name].meaning for name in signals)
    return Question('', column, f'column "{column}" could be the {meanings}: which one?', tuple(
        f'{name}={unit}' for name, units in signals.items() for unit in units))

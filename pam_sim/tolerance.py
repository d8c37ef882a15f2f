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
How well a number of a rig is known: relatively, absolutely, or not at all.

In a model file under ``tolerance``: a number is a relative standard deviation, ``{sd: 500.0}``
one in the unit of the parameter, and the word ``unknown`` leaves its whole range open.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import math
import re
from typing import Any

from pam_sim.declared import check_mapping, shown
from pam_sim.errors import did_you_mean, InputError
from pam_sim.keys import Key, names_of
from pam_sim.located_yaml import Located
from pam_sim.parameters import Parameter
from pam_sim.units import behind_number

UNKNOWN = math.inf           # as a tolerance; the word in a file is WORD
WORD = 'unknown'
_NUMBER = r'[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?'
_ABOUT = re.compile(rf'({_NUMBER})\s*(?:±|\+-|\+/-)\s*({_NUMBER})\s*(%?)')
_NUMBER_FIRST = re.compile(rf'{_NUMBER}(?=\s*[^\s\d.,])')
SD_KEYS = (
    Key('sd', float, 'Standard deviation in the unit of the parameter; the only way to say it '
        'for a number that is 0.', required=True, otherwise='required', lower=0.0),
)


@dataclass(frozen=True)
class AbsoluteSd:
    """
    A standard deviation in the unit of its parameter.

    Parameters
    ----------
    sd : float
        At most the width of the range of the parameter.

    """

    sd: float


Tolerance = float | AbsoluteSd


def read_tolerance(stated: Located, parameter: Parameter, key: str = '') -> Tolerance:
    """
    Return the tolerance of one parameter, stated by its name or another key in a mapping.

    Raises
    ------
    InputError
        Another word, an unknown key, or a number that is negative, not finite or too large.

    """
    name = key or parameter.name
    value = stated[name]
    if value == WORD:
        return UNKNOWN
    if isinstance(value, Located):
        value.check_keys(names_of(SD_KEYS))
        return AbsoluteSd(value.require('sd', float, 0.0, _width(parameter), unit=parameter.unit))
    if isinstance(value, str):
        raise stated.error(f'`{name}` is `{value}`; allowed: {_allowed(parameter)}', name)
    return float(stated.require(name, float, lower=0.0, upper=1.0))


def refuse_texts(given: Located, known: Iterable[Parameter]) -> None:
    """
    Refuse texts in place of the numbers of parameters, such as ``unknown`` and ``1.2±0.3``.

    Parameters
    ----------
    given : Located
        Name to number; other names, and other values than texts, are left alone.
    known : iterable of Parameter
        What can be given.

    Raises
    ------
    InputError
        A text. The sentence says where a tolerance is stated.

    """
    for parameter in known:
        name = parameter.name
        text = given[name] if name in given else None
        if not isinstance(text, str):
            continue
        about, number = _ABOUT.fullmatch(text.strip()), _NUMBER_FIRST.match(text.strip())
        if text.strip() == WORD:
            fix = (f'write `{name}: {WORD}` under `tolerance`, and here the number to begin '
                   'with, or nothing')
        elif about:
            sd = f'{float(about[2]) / 100.0:g}' if about[3] else f'{{sd: {about[2]}}}'
            fix = f'write {about[1]} here, and `{name}: {sd}` under `tolerance`'
        elif number and behind_number(parameter.unit):
            fix = f'write the number alone, in {parameter.unit}'
        else:
            fix = f'allowed {parameter.allowed}'
        raise given.error(f'`{name}` must be a number, not {shown(text)}; {fix}', name)


def check_tolerance(value: Any, parameter: Parameter, where: str = 'tolerance') -> Tolerance:
    """
    Return a tolerance given in code, checked; integers become floats.

    Raises
    ------
    InputError
        Not ``UNKNOWN``, a relative standard deviation or an AbsoluteSd within its range.

    """
    number = value.sd if isinstance(value, AbsoluteSd) else value
    top = _width(parameter) if isinstance(value, AbsoluteSd) else 1.0
    if (isinstance(number, bool) or not isinstance(number, (int, float))
            or not (0.0 <= number <= top or (number == UNKNOWN and number is value))):
        raise InputError(f'`{parameter.name}` is {value!r}; allowed: {_allowed(parameter)}', where)
    return value if isinstance(value, AbsoluteSd) else float(value)


def plain_tolerance(value: Tolerance) -> Any:
    """Return a tolerance as plain data for a model file."""
    if isinstance(value, AbsoluteSd):
        return {'sd': value.sd}
    return WORD if value == UNKNOWN else value


def prior_sd(parameter: Parameter, value: float, tolerance: Tolerance) -> float:
    """
    Return the standard deviation of what is known of a number, in its unit.

    A relative one is taken of ``value``. Of an unknown number it is half of the allowed range,
    ``(upper - lower) / 2``. Where both bounds are positive it is half of the range of the
    logarithm, ``value * ln(upper / lower) / 2``. Such a range covers scales (0.1 to 500 kg), and
    its plain half would be nearer to the largest than to any likely number. Both bounds are then
    within some deviations, so a prior of this width decides nothing that data can decide.

    Parameters
    ----------
    parameter : Parameter
        With its bounds.
    value : float
        What the rig says the number is.
    tolerance : float or AbsoluteSd
        As of ``Rig.tolerance``.

    """
    if isinstance(tolerance, AbsoluteSd):
        return tolerance.sd
    if tolerance != UNKNOWN:
        return abs(value) * tolerance
    if parameter.lower > 0.0:
        return 0.5 * value * math.log(parameter.upper / parameter.lower)
    return 0.5 * _width(parameter)


def tolerances(known: tuple[Parameter, ...], given: Mapping[str, Any],
               exact: tuple[Parameter, ...] = ()) -> dict[str, Tolerance]:
    """
    Return the tolerance of every parameter: that of its declaration, or the one given.

    Those of ``exact`` are known exactly, and left out, unless another one is given.

    Raises
    ------
    InputError
        Unknown name, or as of ``check_tolerance``.

    """
    check_mapping(given, 'tolerance')
    names = [p.name for p in (*known, *exact)]
    for name in given:
        if name not in names:
            raise InputError(f'unknown parameter `{name}`{did_you_mean(name, names)}; allowed: '
                             f'{", ".join(names)}', 'tolerance')
    return {p.name: check_tolerance(given[p.name], p) if p.name in given else p.tolerance
            for p in (*known, *(p for p in exact if p.name in given))}


def relative_to_zero(parameter: Parameter, value: float, tolerance: Tolerance) -> str:
    """
    Return a sentence on a number that is 0 and known relatively, which makes it exact; '' else.

    Parameters are those of ``prior_sd``.
    """
    if value != 0.0 or isinstance(tolerance, AbsoluteSd) or tolerance in (0.0, UNKNOWN):
        return ''
    return (f'`{parameter.name}` is 0, and a tolerance of {tolerance:g} is relative: '
            f'{tolerance:g} of 0 is 0, so the number counts as exact; write '
            f'{{sd: NUMBER}}, in {parameter.unit}')


def _width(parameter: Parameter) -> float:
    return parameter.upper - parameter.lower


def _allowed(parameter: Parameter) -> str:
    widest = f'{_width(parameter):g}{behind_number(parameter.unit)}'
    return f'0 to 1 (relative), {{sd: 0 to {widest}}} or `{WORD}`'

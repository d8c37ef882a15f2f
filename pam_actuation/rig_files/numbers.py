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

"""Numbers as people state them: known, known to ± x, or unknown."""

from collections.abc import Iterable
from dataclasses import dataclass
import math
import re

from pam_sim.errors import did_you_mean, InputError
from pam_sim.parameters import Parameter
from pam_sim.tolerance import AbsoluteSd, check_tolerance, Tolerance, UNKNOWN, WORD

_ABOUT = re.compile(r'(?P<value>[^±%]+?)\s*(?:±|\+/?-)\s*(?P<sd>[^±%]+?)\s*(?P<percent>%?)')
FORMS = f'`1.2` (known), `1.2±0.3` or `1.2±10%` (one standard deviation), `{WORD}`'


@dataclass(frozen=True)
class Stated:
    """
    What was said of one number.

    Parameters
    ----------
    value : float or None
        None: not said.
    tolerance : float, AbsoluteSd or None
        As in a rig; None: that of the parameter.

    """

    value: float | None = None
    tolerance: Tolerance | None = None


def read_stated(text: str, parameter: Parameter, where: str) -> Stated:
    """
    Return what a text says of a number: ``1.2``, ``1.2±0.3``, ``1.2±10%`` or ``unknown``.

    Parameters
    ----------
    text : str
        ``+-`` and ``+/-`` stand for ``±``.
    parameter : Parameter
        Gives range and unit.
    where : str
        Option or question, for messages.

    Raises
    ------
    InputError
        Another form, a number out of range, or per cent of 0.

    """
    said = text.strip()
    if said == WORD:
        return Stated(None, UNKNOWN)
    about = _ABOUT.fullmatch(said)
    if about is None:
        return Stated(parameter.check(_number(said, parameter, where), where), 0.0)
    value = parameter.check(_number(about['value'], parameter, where), where)
    sd = _number(about['sd'], parameter, where)
    if about['percent'] and value == 0.0 and sd > 0.0:
        raise InputError(f'`{parameter.name}` is `{said}`, and {about["sd"]} % of 0 is 0; write '
                         f'0+-NUMBER, in {parameter.unit}', where)
    known = sd / 100.0 if about['percent'] else AbsoluteSd(sd)
    return Stated(value, check_tolerance(known, parameter, where))


def split_statement(text: str, known: Iterable[str], where: str) -> tuple[str, str]:
    """
    Return (name, rest) of ``NAME=REST``; the rest is empty where there is no ``=``.

    Raises
    ------
    InputError
        A name that is not known.

    """
    name, _, rest = (part.strip() for part in text.partition('='))
    names = list(known)
    if name not in names:
        raise InputError(f'unknown parameter `{name}`{did_you_mean(name, names)}; allowed: '
                         f'{", ".join(names)}, or EFFECT.PARAMETER', where)
    return name, rest


def read_range(text: str, where: str, unit: str) -> tuple[float, float]:
    """
    Return (lowest, highest) of ``LOW:HIGH``.

    Raises
    ------
    InputError
        Not two numbers, or the first is not below the second.

    """
    parts = text.split(':')
    try:
        low, high = (float(part) for part in parts)
    except ValueError:
        raise InputError(f'`{text}` is no range; write LOW:HIGH in {unit}, such as 0:10',
                         where) from None
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise InputError(f'`{text}` is no range; the first number must be below the second, both '
                         f'in {unit}', where)
    return low, high


def _number(text: str, parameter: Parameter, where: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f'`{parameter.name}` is `{text}`; write {FORMS}, within '
                         f'{parameter.allowed}', where) from None

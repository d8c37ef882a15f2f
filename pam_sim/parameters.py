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

"""Declared parameters: name, unit, default, range and meaning, and the check of a given value."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
import math
from typing import Any, SupportsFloat

from pam_sim.declared import check_fields, check_mapping, shown
from pam_sim.errors import did_you_mean, InputError
from pam_sim.units import allowed_range

MOST_LISTED = 20             # names that a message lists beside a hint


@dataclass(frozen=True)
class Parameter:
    """
    One parameter: of a rig, an effect, a control law, a driver, a device or a node.

    Parameters
    ----------
    name : str
        Key in files; carries its SI unit where that reads well.
    unit : str
        SI unit, ``'-'`` for none.
    default : float, int, str or bool
        Value where none is given, of a rig its nominal number. Its type is that of the parameter.
    lower, upper : float
        Inclusive bounds of a number.
    tolerance : float
        Relative standard deviation of the number of a rig, 0 for exactly known.
    description : str
        One sentence.
    source : str
        Where number or equation come from.
    choices : tuple of str
        The texts allowed; empty: any.

    Raises
    ------
    InputError
        A text, number or tuple that is something else, or a number out of its own range.

    """

    name: str
    unit: str
    default: Any
    lower: float = -math.inf
    upper: float = math.inf
    tolerance: float = 0.0
    description: str = ''
    source: str = ''
    choices: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what no file could state: a wrong order of the fields, a default out of range."""
        check_fields(self, f'parameter `{self.name}`')
        default = self.default
        if (isinstance(default, (int, float)) and not isinstance(default, bool)
                and not self.lower <= default <= self.upper):
            raise InputError(f'`{self.name}` is {default:g} by default; allowed {self.allowed}')

    @property
    def bounded(self) -> bool:
        """Whether it is a number with a range."""
        return math.isfinite(self.lower) and math.isfinite(self.upper)

    @property
    def allowed(self) -> str:
        """Return the range of a number in words, in its unit: ``0.1 to 500 kg``."""
        return allowed_range(self.lower, self.upper, self.unit, self.name)

    def check(self, value: object, where: str = '') -> float:
        """
        Return a value of a parameter that is a number, as float.

        Raises
        ------
        InputError
            Not a finite number, or out of bounds.

        """
        # Plain numbers first: to ask a protocol takes longer than all the rest of the check.
        if isinstance(value, bool) or not isinstance(value, (int, float, SupportsFloat)):
            raise InputError(f'`{self.name}` must be a number, not {shown(value)}; '
                             f'allowed {self.allowed}', where)
        try:
            number = float(value)
        except OverflowError:           # a whole number beyond all floats
            number = math.inf
        except (TypeError, ValueError):     # an array of several numbers
            raise InputError(f'`{self.name}` must be a number, not {shown(value)}; '
                             f'allowed {self.allowed}', where) from None
        if not math.isfinite(number) or not self.lower <= number <= self.upper:
            raise InputError(f'`{self.name}` is {number:g}; allowed {self.allowed}', where)
        return number


def check_given(
        parameters: Iterable[Parameter], values: Mapping[str, Any], what: str = 'parameter',
        where: str | Callable[[str], str] = '') -> dict[str, float]:
    """
    Return the given values as floats, checked.

    Parameters
    ----------
    parameters : iterable of Parameter
        What is known.
    values : mapping
        Name to number; a ``Located`` mapping gives the line in messages.
    what : str
        Noun used in messages.
    where : str or callable
        Place for messages when ``values`` does not know its own; ``where(name)`` returns that
        of a name.

    Raises
    ------
    InputError
        No mapping, unknown name, wrong type or out of bounds.

    """
    known = {parameter.name: parameter for parameter in parameters}
    place = getattr(values, 'where', where)
    if not isinstance(values, (dict, Mapping)):
        one, of, rest = what.partition(' of ')
        check_mapping(values, where if isinstance(where, str) and where else f'{one}s{of}{rest}')
    result = {}
    for name, value in values.items():
        if name not in known:
            hint = did_you_mean(name, known)
            # A list that nobody reads hides the name that was meant.
            listed = '' if hint and len(known) > MOST_LISTED else (
                f'; allowed: {", ".join(known) or "none"}')
            raise InputError(f'unknown {what} `{name}`{hint}{listed}',
                             place(name) if callable(place) else place)
        result[name] = known[name].check(value, place(name) if callable(place) else place)
    return result


def check_parameters(
        parameters: Iterable[Parameter], values: Mapping[str, Any], what: str = 'parameter',
        where: str | Callable[[str], str] = '') -> dict[str, float]:
    """
    Return the values of all parameters: the defaults overlaid with those given.

    Parameters and errors are those of ``check_given``.
    """
    known = tuple(parameters)
    return {**{parameter.name: parameter.default for parameter in known},
            **check_given(known, values, what, where)}

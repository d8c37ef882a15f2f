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

"""Numbers of the rig with unit, bounds, tolerance and source."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import math
from typing import Any, SupportsFloat

from pam_sim.errors import did_you_mean, InputError
from pam_sim.units import allowed_range


@dataclass(frozen=True)
class Parameter:
    """
    One number of a rig or an effect.

    Parameters
    ----------
    name : str
        Key in model files; carries its SI unit where that reads well.
    unit : str
        SI unit, ``'-'`` for none.
    nominal : float
    lower, upper : float
        Inclusive bounds of what a model file may say.
    tolerance : float
        Relative standard deviation of the nominal number, 0 for exactly known.
    description : str
        One sentence.
    source : str
        Where number or equation come from.

    """

    name: str
    unit: str
    nominal: float
    lower: float
    upper: float
    tolerance: float = 0.0
    description: str = ''
    source: str = ''

    def check(self, value: object, where: str = '') -> float:
        """
        Return ``value`` as float.

        Raises
        ------
        InputError
            Not a finite number, or out of bounds.

        """
        allowed = f'allowed {allowed_range(self.lower, self.upper, self.unit, self.name)}'
        if not isinstance(value, SupportsFloat) or isinstance(value, bool):
            raise InputError(f'`{self.name}` must be a number, not {value!r}; {allowed}', where)
        number = float(value)
        if not math.isfinite(number) or not self.lower <= number <= self.upper:
            raise InputError(f'`{self.name}` is {number:g}; {allowed}', where)
        return number


def check_parameters(
        parameters: Iterable[Parameter], values: Mapping[str, Any], what: str = 'parameter',
        where: str = '') -> dict[str, float]:
    """
    Return the full value dict: nominal values overlaid with ``values``.

    Parameters
    ----------
    parameters : iterable of Parameter
        What is known.
    values : mapping
        Name to number; a ``Located`` mapping gives the line in messages.
    what : str
        Noun used in messages.
    where : str
        Place for messages when ``values`` does not know its own.

    Raises
    ------
    InputError
        Unknown name, wrong type or out of bounds.

    """
    known = {parameter.name: parameter for parameter in parameters}
    result = {name: parameter.nominal for name, parameter in known.items()}
    for name, value in values.items():
        place = values.where(name) if hasattr(values, 'where') else where
        if name not in known:
            raise InputError(
                f'unknown {what} `{name}`{did_you_mean(name, known)}; allowed: '
                f'{", ".join(known) or "none"}', place)
        result[name] = known[name].check(value, place)
    return result

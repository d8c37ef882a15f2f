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

"""Settings of a controller: named numbers with unit, default and allowed range."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pam_sim.declared import shown
from pam_sim.errors import InputError
from pam_sim.parameters import check_parameters, Parameter
from pam_sim.records import record

LIMITS = 'min_pressure_gauge_pa', 'max_pressure_gauge_pa'      # of the command of every law


def setting(name: str, unit: str, default: float, lower: float, upper: float,
            description: str) -> Parameter:
    """Declare one number a controller can be given."""
    return Parameter(name, unit, default, lower, upper, description=description)


@dataclass(frozen=True)
class Switch(Parameter):
    """
    A setting that chooses: 0 the first of its ``choices``, 1 the second.

    A file states the word or the number; the law gets the number.
    """

    @property
    def allowed(self) -> str:
        """Return numbers and words: ``0 or linear, 1 or table``."""
        return ', '.join(f'{number} or {word}' for number, word in enumerate(self.choices))

    def check(self, value: object, where: str = '') -> float:
        """
        Return the number of a choice.

        Raises
        ------
        InputError
            Neither a word nor a number of a choice.

        """
        if value in self.choices:
            return float(self.choices.index(str(value)))
        if isinstance(value, str):
            raise InputError(f'`{self.name}` is {shown(value)}; allowed {self.allowed}', where)
        number = super().check(value, where)
        if not number.is_integer():
            raise InputError(f'`{self.name}` is {number:g}; allowed {self.allowed}', where)
        return number


def switch(name: str, default: float, choices: tuple[str, ...], description: str) -> Parameter:
    """Declare a setting that is one of some words, in the order of their numbers from 0."""
    return Switch(name, '-', default, 0.0, len(choices) - 1.0, description=description,
                  choices=choices)


def parameter_record(
        specification: Sequence[Parameter],
        *derived: str | tuple[str, int]) -> 'np.dtype[np.record]':
    """
    Return the record of a law's compiled parameters.

    Parameters
    ----------
    specification : sequence of Parameter
        The settings of the law; each is a field of its name.
    derived : str or (str, int)
        Further fields, computed from the settings: a name, or one with the length of an array.

    """
    return record(*(one.name for one in specification), *derived)


def checked_settings(
        specification: Sequence[Parameter], given: Mapping[str, object] | None,
        where: Callable[[str], str] | None = None) -> dict[str, float]:
    """
    Return all settings of a law, from those that differ from its defaults.

    Parameters
    ----------
    specification : sequence of Parameter
        The settings of the law.
    given : mapping of str, optional
        What differs.
    where : callable, optional
        Place of a setting for errors.

    Raises
    ------
    InputError
        A setting is unknown or out of range, or the lowest pressure is not below the highest.

    """
    settings = check_parameters(specification, given or {}, 'setting', where or '')
    lowest, highest = LIMITS
    if lowest in settings and settings[highest] <= settings[lowest]:
        raise InputError(f'{highest} must be larger than {lowest}',
                         where(highest) if where else highest)
    return settings


def limits_within(settings: Mapping[str, float], lowest_gauge_pa: float,
                  highest_gauge_pa: float) -> tuple[float, float]:
    """Return the pressure limits of settings cut to a range; NaN cuts nothing."""
    lowest, highest = (settings[name] for name in LIMITS)
    return max(lowest, lowest_gauge_pa), max(lowest, min(highest, highest_gauge_pa))

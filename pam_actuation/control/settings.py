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
from pam_sim.errors import did_you_mean, InputError
from pam_sim.records import record


@dataclass(frozen=True)
class Setting:
    """One number a controller can be given."""

    name: str
    unit: str
    default: float
    lower: float
    upper: float
    description: str


def parameter_record(
        specification: Sequence[Setting], *derived: str) -> 'np.dtype[np.record]':
    """
    Return the record of a law's compiled parameters.

    Parameters
    ----------
    specification : sequence of Setting
        Each is a field of its name.
    derived : str
        Further fields, computed from the settings.

    """
    return record(*(setting.name for setting in specification), *derived)


def checked_settings(
        specification: Sequence[Setting], given: Mapping[str, object],
        where: Callable[[str], str] | None = None) -> dict[str, float]:
    """
    Return every setting of a specification as floats, the given ones checked.

    Parameters
    ----------
    specification : sequence of Setting
        What the controller knows.
    given : mapping of str -> number
        What differs from the defaults.
    where : callable, optional
        Returns the place (``file:line``) of a given name.

    Raises
    ------
    InputError
        Unknown name, not a number, or outside the allowed range.

    """
    place = where if where is not None else (lambda name: name)
    known = {setting.name: setting for setting in specification}
    for name in given:
        if name not in known:
            hint = did_you_mean(name, known, '', '; did you mean {}')
            raise InputError(
                f'unknown setting {name}{hint}; known are {", ".join(sorted(known))}',
                place(name))
    values = {}
    for setting in specification:
        value = given.get(setting.name, setting.default)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InputError(
                f'{setting.name} must be a number, not {_short(value)}', place(setting.name))
        # Also refuses what is not finite, and whole numbers beyond all floats.
        if not setting.lower <= value <= setting.upper:
            raise InputError(
                f'{setting.name} = {_short(value)} {setting.unit} is outside '
                f'{setting.lower:g}...{setting.upper:g} {setting.unit}'
                + _as_gauge(setting), place(setting.name))
        values[setting.name] = float(value)
    return values


def _as_gauge(setting: Setting) -> str:
    """Return the range of a gauge pressure in kPa, '' of anything else."""
    if setting.unit != 'Pa' or 'gauge' not in setting.name:
        return ''
    return f' ({1e-3 * setting.lower:g} to {1e-3 * setting.upper:g} kPa gauge)'


def _short(value: object) -> str:
    """Return a value of any size as a short piece of one sentence."""
    text = repr(value)
    return text if len(text) <= 60 else f'{text[:60]}...'

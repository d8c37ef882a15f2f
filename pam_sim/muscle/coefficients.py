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
Coefficients of a force law as numbers of a rig: ``law.NAME``, each known, about known or unknown.

A published coefficient belongs to another specimen of the muscle, or was fitted to a map that
was scaled. A rig may therefore state how well it is known, as of its other numbers. The word
``law`` stands for all coefficients on which the static force depends.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.declared import number_of
from pam_sim.errors import InputError
from pam_sim.muscle.law import MuscleLaw
from pam_sim.muscle.muscle import LawChoice, Muscle
from pam_sim.parameters import Parameter

ALL = 'law'                  # all coefficients of the static force
PREFIX = f'{ALL}.'
FACTOR = 2.0                 # an unknown one is within this factor of its value
SHARE = 0.1                  # or changes the force by so much of the largest one
_STEP = 1e-3                 # of a coefficient, to see what it does to the force


def coefficients(choice: LawChoice) -> tuple[Parameter, ...]:
    """
    Return the coefficients of a law, named ``law.NAME``; none of a table.

    The default is the value in the set of the law. The bounds are those of an unknown coefficient.
    It is within a factor of two of that value, or as far as the force changes by a tenth of the
    largest one. They stay within those that the law declares. A value beyond them widens them to
    a factor of two about itself.
    """
    if choice.table is not None:
        return ()
    found = _of_set(choice.name, choice.law.muscle)
    if not choice.parameters:
        return found
    values = choice.law.values
    return tuple(_about(p, values[p.name], one) if p.name in choice.parameters else one
                 for p, one in zip(choice.law.PARAMETERS, found))


def leading(choice: LawChoice) -> tuple[str, ...]:
    """Return the names of the coefficients on which the static force depends."""
    if choice.table is not None:
        return ()
    law = choice.law
    return tuple(PREFIX + p.name for p in law.PARAMETERS
                 if p.tolerance > 0.0 and _force_per_unit(law, p) > 0.0)


def stated_names(choice: LawChoice, name: str, where: str = '') -> tuple[str, ...]:
    """
    Return the coefficients that a name stands for: all leading ones for ``law``, else itself.

    Raises
    ------
    InputError
        The law has no coefficients.

    """
    if name != ALL:
        return (name,)
    found = leading(choice)
    if not found:
        raise InputError(f'law `{choice.name}` is a table without coefficients; allowed: a law '
                         'with a formula. The strength of a table is `force_map_gain`; state that '
                         'as unknown', where)
    return found


def with_coefficients(choice: LawChoice, values: Mapping[str, float]) -> LawChoice:
    """
    Return the law with other values of its coefficients, by ``law.NAME``.

    Raises
    ------
    InputError
        The values together make no muscle, or one is out of bounds.

    """
    given = {name.removeprefix(PREFIX): number_of(value, name) for name, value in values.items()}
    found = replace(choice, parameters={**choice.parameters, **given})
    _ = found.law               # checked here, and made once
    return found


def with_numbers(muscle: Muscle,
                 numbers: Mapping[str, float]) -> tuple[dict[str, float], Muscle]:
    """
    Return the numbers of a rig, and its muscle with those named ``law.NAME``.

    Raises
    ------
    InputError
        As of ``with_coefficients``.

    """
    of_rig = {key: value for key, value in numbers.items() if not key.startswith(PREFIX)}
    of_law = {key: value for key, value in numbers.items() if key not in of_rig}
    if of_law:
        muscle = replace(muscle, law=with_coefficients(muscle.law, of_law))
    return of_rig, muscle


def own_value(choice: LawChoice, name: str) -> float:
    """Return the value of a coefficient ``law.NAME``."""
    return float(choice.law.values[name.removeprefix(PREFIX)])


@lru_cache(maxsize=None)
def _of_set(name: str, muscle: str) -> tuple[Parameter, ...]:
    law = LawChoice(name, muscle).law
    largest = float(np.max(law.formula_n(*_grid(law))))
    return tuple(_of(law, p, largest) for p in law.PARAMETERS)


def _of(law: MuscleLaw, p: Parameter, largest_n: float) -> Parameter:
    value, per_unit = float(law.values[p.name]), _force_per_unit(law, p)
    reach = SHARE * largest_n / per_unit if per_unit > 0.0 else 0.0
    ends = (value / FACTOR, value * FACTOR, value - reach, value + reach)
    low, high = max(p.lower, min(ends)), min(p.upper, max(ends))
    if low == high:             # 0, and without a say in the static force
        low, high = p.lower, p.upper
    return replace(p, name=PREFIX + p.name, default=value, lower=low, upper=high)


def _about(declared: Parameter, value: float, found: Parameter) -> Parameter:
    if found.lower <= value <= found.upper:
        return found
    ends = (found.lower, found.upper, value / FACTOR, value * FACTOR)
    return replace(found, lower=max(declared.lower, min(ends)),
                   upper=min(declared.upper, max(ends)))


def _grid(law: MuscleLaw) -> tuple[FloatArray, FloatArray]:
    valid = law.validity
    return np.linspace(*valid.pressure_gauge_pa, 13)[:, np.newaxis], np.linspace(*valid.strain, 11)


def _force_per_unit(law: MuscleLaw, p: Parameter) -> float:
    """Return the largest change of the force [N] with a coefficient, where the muscle pulls."""
    value = float(law.values[p.name])
    step = _STEP * (abs(value) or min(abs(p.upper), abs(p.lower)) or p.upper - p.lower)
    pressure, strain = _grid(law)
    before = law.formula_n(pressure, strain)
    for change in (step, -step):
        try:
            other = type(law)({**law.values, p.name: value + change}, law.muscle)
        except InputError:      # at the end of its range
            continue
        moved = np.abs(other.formula_n(pressure, strain) - before)[before > 0.0]
        return float(np.max(moved, initial=0.0)) / step
    return 0.0

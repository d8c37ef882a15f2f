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

"""Whether a force law keeps the rules of the chapter that it claims, on a grid of points."""

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.compiled import Compiled, interpreted
from pam_sim.errors import InputError
from pam_sim.records import fields, values_of

if TYPE_CHECKING:
    from pam_sim.muscle.law import MuscleLaw

# The chapter's rules of PAM behaviour (section 4.1, after Daerden and Lefeber).
RULES = {
    1: 'Contraction goes with an increasing volume.',
    2: 'At constant load, more pressure means more contraction.',
    3: 'At constant pressure, less load means more contraction.',
    4: 'Contraction has an upper limit, where the muscle pulls with zero force.',
}
MIN_STRAIN, MAX_STRAIN = -0.1, 0.9      # beyond these a length is a mistake, not a muscle
_PRESSURES, _STRAINS = 5, 9     # points of the range of a set
_LOWEST = 0.05                  # of the highest pressure; below it forces are small


def check_rules(law: 'MuscleLaw', where: str) -> None:
    """
    Refuse a law whose force is not finite, or that breaks a rule it claims.

    Parameters
    ----------
    law : MuscleLaw
        With numbers.
    where : str
        Place for the message, its file.

    Raises
    ------
    InputError
        The sentence names the rule, the point and what was found there.

    """
    for problem in _problems(law):
        raise InputError(f'law `{law.NAME}` (set `{law.muscle}`) {problem}', where)


def _problems(law: 'MuscleLaw') -> Iterator[str]:
    """Say what is wrong, the first mistake first."""
    unknown = [rule for rule in law.CLAIMS if rule not in RULES]
    if unknown:
        yield f'claims rule {unknown[0]}; allowed {", ".join(map(str, RULES))}'
    pressure, strain = grid(law)
    force = formula_at(law, pressure, strain)
    for p, row in zip(pressure, force):
        for e, f in zip(strain, row):
            if not np.isfinite(f):
                yield f'has the force {f:g} N {at(p, e)}; a force must be finite'
    for rule, found in ((1, _rule_1), (2, _rule_2), (3, _rule_3), (4, _rule_4)):
        if rule in law.CLAIMS:
            for broken in found(law, pressure, strain, force):
                yield f'claims rule {rule} ("{RULES[rule]}") and breaks it: {broken}'


def grid(law: 'MuscleLaw') -> tuple[FloatArray, FloatArray]:
    """Return pressures [Pa gauge] and contractions of the range of a law's set."""
    low, high = law.validity.pressure_gauge_pa
    return (np.linspace(max(low, _LOWEST * high), high, _PRESSURES),
            np.linspace(*law.validity.strain, _STRAINS))


def formula_at(law: 'MuscleLaw', pressure: FloatArray, strain: FloatArray,
               formula: Compiled[..., float] | None = None) -> FloatArray:
    """Return the force [N], or another formula's value, on a grid, by the function in Python."""
    packed = type(law).PACKED
    par = fields(values_of(law.PACKED, law.pack()), packed) if packed.names else None
    one = interpreted(formula or type(law).COMPILED)
    with np.errstate(all='ignore'):
        return np.array([[one(p, e, par) for e in strain] for p in pressure], float)


def _rule_1(law: 'MuscleLaw', pressure: FloatArray, strain: FloatArray,
            force: FloatArray) -> Iterator[str]:
    formula = type(law).COMPILED_VOLUME
    if formula is None:
        yield 'its file has no `volume_m3(gauge_pa, strain, par)`'
        return
    volume = formula_at(law, pressure, strain, formula)
    for p, row, grown in zip(pressure, force, np.diff(volume)):
        for k in np.flatnonzero((row[1:] > 0.0) & ~(grown > 0.0)):
            yield f'the volume does not grow with contraction {at(p, strain[k])}'


def _rule_2(law: 'MuscleLaw', pressure: FloatArray, strain: FloatArray,
            force: FloatArray) -> Iterator[str]:
    for (p, less), (_, more) in pairwise(zip(pressure, force)):
        for k in np.flatnonzero((more <= less) & (np.maximum(less, more) > 0.0)):
            yield (f'the force does not grow with pressure {at(p, strain[k])}, '
                   f'{less[k]:g} N, but is {more[k]:g} N above it')


def _rule_3(law: 'MuscleLaw', pressure: FloatArray, strain: FloatArray,
            force: FloatArray) -> Iterator[str]:
    for p, row in zip(pressure, force):
        for k in np.flatnonzero((row[1:] >= row[:-1]) & (row[1:] > 0.0)):
            yield (f'the force does not fall with contraction {at(p, strain[k])}, {row[k]:g} N, '
                   f'but is {row[k + 1]:g} N at {strain[k + 1]:g}')


def _rule_4(law: 'MuscleLaw', pressure: FloatArray, strain: FloatArray,
            force: FloatArray) -> Iterator[str]:
    beyond = np.linspace(law.validity.strain[1], MAX_STRAIN, _STRAINS)
    for p, row in zip(pressure, formula_at(law, pressure, beyond)):
        for k in np.flatnonzero((row[1:] > 0.0) & (row[1:] > row[:-1])):
            yield (f'the force returns: {at(p, beyond[k + 1])} it is {row[k + 1]:g} N; let the '
                   'formula be 0 from the contraction on at which the force ends')
        if np.all(row > 0.0):
            yield f'the force never ends; {at(p, beyond[-1])} it is {row[-1]:g} N'


def at(pressure: float, strain: float) -> str:
    return f'at {pressure:g} Pa gauge and contraction {strain:g}'

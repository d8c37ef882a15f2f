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

"""Whether the values of a mapped column can be what the user says, with the fix in words."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from pam_actuation.bags.plausibility import MAX_CONTRACTION, MAX_VOLTAGE, value_findings
from pam_actuation.tables.mapping import ColumnMap
from pam_actuation.tables.signals import BY_NAME, Signal
from pam_actuation.tables.units import (
    ABSOLUTE, FORCE, GAUGE, LENGTH, names_of, PRESSURE, unit_of_text)
from pam_actuation.tables.words import unit_in
from pam_sim.annotations import FloatArray
from pam_sim.units import P_ATM_PA

LEAST_MOVE = {PRESSURE: 200.0, LENGTH: 5e-5, FORCE: 0.2}       # below: another unit is likely
NEAR_ATMOSPHERE_PA = 5e3


@dataclass(frozen=True)
class Doubt:
    """A sentence on a signal; with ``is_wrong`` the values cannot be what the mapping says."""

    sentence: str
    is_wrong: bool = False


def doubts(values: Mapping[str, FloatArray], mapped: Mapping[str, ColumnMap],
           length_m: float) -> list[Doubt]:
    """
    Return what is doubtful in the signals of a recording.

    Parameters
    ----------
    values : dict of str to ndarray
        SI values by name of the signal, NaN where missing.
    mapped : dict of str to ColumnMap
        Where they come from.
    length_m : float
        Length of the muscle at rest, for its largest contraction.

    """
    found = []
    for name, column in values.items():
        signal, finite = BY_NAME[name], column[np.isfinite(column)]
        said = f'{name} (column "{mapped[name].column}" in {mapped[name].unit.name})'
        lost = len(column) - len(finite)
        if not len(finite):
            found.append(Doubt(f'{said} holds no number', True))
            continue
        if lost:
            found.append(Doubt(f'{said}: {lost} of {len(column)} values are missing and were '
                               'left out'))
        found += [Doubt(f'{said}: {one.sentence}', one.is_wrong)
                  for one in _of_values(signal, mapped[name], finite, length_m)]
    return found


def _of_values(signal: Signal, mapped: ColumnMap, finite: FloatArray, length_m: float
               ) -> list[Doubt]:
    low, high = float(finite.min()), float(finite.max())
    wrong = value_findings('', signal.field, finite, lambda: length_m)
    if any(one.unusable for one in wrong) or signal.quantity == LENGTH and (
            high - low > 2.0 * MAX_CONTRACTION * length_m):
        return [Doubt(f'{_shown(signal, low)} to {_shown(signal, high)}, which no rig has'
                      f'{_fix(signal, mapped, finite, length_m)}', True)]
    found = [Doubt(one.sentence.partition(': ')[2].rstrip('.')) for one in wrong]
    if low == high:
        return [*found, Doubt(f'the value never changes ({_shown(signal, low)}): is the sensor '
                              'connected?')]
    least = LEAST_MOVE.get(signal.quantity)
    if least is not None and high - low < least:
        found.append(Doubt(f'it moves by {_shown(signal, high - low, difference=True)} only'
                           f'{_fix(signal, mapped, finite, length_m)}'))
    if signal.quantity == PRESSURE:
        found += _gauge_or_absolute(mapped, low)
    said = unit_of_text(unit_in(mapped.column), signal.quantity) if unit_in(mapped.column) \
        else None
    if said is not None and said.factor != mapped.unit.factor and mapped.gain == 1.0:
        found.append(Doubt(f'the name of the column says {said.name}'))
    return found


def _gauge_or_absolute(mapped: ColumnMap, low: float) -> list[Doubt]:
    """Ask about a gauge pressure that ends where an absolute one does when vented."""
    if not mapped.unit.name.endswith(GAUGE):
        return []
    if abs(low - 2.0 * P_ATM_PA) < NEAR_ATMOSPHERE_PA:
        return [Doubt('it falls to 1 atmosphere gauge and never below: is it absolute? '
                      f'Then write {mapped.unit.name.replace(GAUGE, ABSOLUTE)}')]
    return []


def _fix(signal: Signal, mapped: ColumnMap, finite: FloatArray, length_m: float) -> str:
    """Return the unit in which the values would be plausible, with the option to write."""
    raw = (finite - mapped.unit.offset) / mapped.unit.factor
    fitting = []
    for name in names_of(signal.quantity):
        unit = unit_of_text(name, signal.quantity)
        if unit is None or name == mapped.unit.name:
            continue
        values = unit.to_si(raw)
        moved = float(values.max() - values.min())
        if not value_findings('', signal.field, values, lambda: length_m) and (
                moved >= 10.0 * LEAST_MOVE.get(signal.quantity, 0.0)):
            fitting.append(replace(mapped, unit=unit))
    usual = [one for one in fitting if not one.unit.name.startswith(
        ('hPa', 'mbar', 'atm', 'mmHg', 'kgf/cm2', 'um', 'gf', 'cm'))] or fitting
    if not usual:
        return '; look for the unit, zero and gain of the column'
    return '; plausible would be ' + ' or '.join(one.option(signal.name) for one in usual[:3])


def _shown(signal: Signal, value: float, difference: bool = False) -> str:
    if signal.quantity == PRESSURE:
        return f'{1e-3 * value:.4g} kPa' if difference else (
            f'{1e-3 * (value - P_ATM_PA):.4g} kPa gauge')
    if signal.quantity == LENGTH:
        return f'{1e3 * value:.4g} mm'
    return f'{value:.4g} ' + {FORCE: 'N', 'voltage': f'V of {MAX_VOLTAGE:g} V'}.get(
        signal.quantity, '').strip()

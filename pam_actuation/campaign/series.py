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

"""The sizes of a campaign over time: one series for each rig, name and quantity."""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Any

import numpy as np
from pam_actuation.campaign.cases import Case
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.gap.data.noise import MAD_TO_SD
from pam_sim.short_repr import short_repr

IN_95 = 1.959963984540054       # standard deviations on either side of a 95 % interval
LEAST_SHARE = 1e-12             # of the largest value, which rounding may be
# Of these nothing follows for names that they do not hold.
TELL_NOTHING = ('failed', 'refused', 'unknown')


@short_repr
@dataclass(eq=False)
class Series:
    """
    One quantity of one rig, by time.

    Attributes
    ----------
    rig, name, kind, quantity, unit : str
        Where, of what, and what is counted in which unit.
    time : ndarray, shape (N,)
        Days.
    days : list of str
        The same as told.
    value, sd : ndarray, shape (N,)
        SI. Where nothing is named: ``nothing``, as uncertain as the smallest size that shows.
        Where no value has an interval: as uncertain as they differ from one to the next.
    named : ndarray of bool, shape (N,)
        Whether the recording names it.
    cases : list of Case
        Whose values they are.
    nothing : float
        The value that means that all is as the model says.

    """

    rig: str
    name: str
    kind: str
    quantity: str
    unit: str
    time: FloatArray
    days: list[str]
    value: FloatArray
    sd: FloatArray
    named: BoolArray
    cases: list[Case]
    nothing: float

    def __len__(self) -> int:
        """Return the number of values."""
        return len(self.time)


def series_of(rows: Sequence[dict[str, Any]]) -> list[Series]:
    """
    Return the series of all names that some recording of a rig holds, by rig and name.

    Parameters
    ----------
    rows : list of dict
        Of a ``Campaign``, by rig and time.

    """
    of_rig: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        of_rig.setdefault(row['case'].rig, []).append(row)
    return [one for rig, several in sorted(of_rig.items()) for one in _of_rig(rig, several)]


def _of_rig(rig: str, rows: list[dict[str, Any]]) -> list[Series]:
    kinds = {(size['name'], size['quantity']): size for row in rows for size in row['sizes']}
    found = []
    for (name, quantity), like in sorted(kinds.items()):
        points = [(row, *point) for row in rows
                  if (point := _point(row, name, quantity, like)) is not None]
        value, sd, named = (np.array([point[k] for point in points]) for k in (1, 2, 3))
        known = sd[np.isfinite(sd) & (sd > 0.0)]
        sd = np.where(np.isfinite(sd) & (sd > 0.0), sd,
                      np.median(known) if len(known) else _scatter(value))
        cases = [point[0]['case'] for point in points]
        found.append(Series(
            rig, name, like['kind'], quantity, like['unit'],
            np.array([case.time for case in cases]), [case.day for case in cases], value, sd,
            named.astype(bool), cases,
            math.nan if like['nothing'] is None else like['nothing']))
    return found


def _scatter(value: FloatArray) -> float:
    """Return the standard deviation of values from the next ones; a step counts for little."""
    if len(value) < 2:
        return 1.0
    scatter = MAD_TO_SD * float(np.median(np.abs(np.diff(value)))) / math.sqrt(2.0)
    return max(scatter, LEAST_SHARE * float(np.max(np.abs(value)))) or 1.0


def _point(row: dict[str, Any], name: str, quantity: str, like: dict[str, Any]
           ) -> tuple[float, float, bool] | None:
    """Return (value, standard deviation, named) of a row, None where it tells nothing."""
    for size in row['sizes']:
        if (size['name'], size['quantity']) == (name, quantity):
            return size['value'], _sd(size), True
    if row['verdict'] in TELL_NOTHING or name in row['ambiguous']:
        return None
    for size in row.get('calibrated', ()):
        if like['kind'] == 'parameter' and size['name'] == name:
            return size['value'], _sd(size), False
    least = row['least'].get(name)
    if like['kind'] == 'effect' and least is not None and least['value'] is not None and (
            least['quantity'] == quantity):
        return 0.0, abs(least['value']) / IN_95, False
    return None


def _sd(size: dict[str, Any]) -> float:
    if size['low'] is None or size['high'] is None:
        return math.nan
    return float(size['high'] - size['low']) / (2.0 * IN_95)

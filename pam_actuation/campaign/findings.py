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

"""What a person should know of a campaign: changes in sentences, odd recordings, alerts."""

from dataclasses import dataclass
import math
from typing import Any, TYPE_CHECKING

from pam_actuation.campaign.cases import Case
from pam_actuation.campaign.changes import Change, changes_of, FAR, far_from_neighbours
from pam_actuation.campaign.series import IN_95, Series, series_of

if TYPE_CHECKING:
    from pam_actuation.campaign.campaign import Campaign

SHOWN = {'Pa': (1e-3, 'kPa'), 'm': (1e3, 'mm'), 's': (1e3, 'ms'), 'Pa/s': (1e-3, 'kPa/s'),
         '-': (1.0, ''), '1': (1.0, '')}
NEAR_DAYS = 1.5         # changes of one rig that begin so near are told together


@dataclass
class Odd:
    """A recording that does not fit, why, and how far from what was expected [sd]."""

    row: dict[str, Any]
    why: str
    far: float


@dataclass
class Findings:
    """
    What a campaign shows.

    Attributes
    ----------
    series : list of Series
    changes : list of list of Change
        Those of one rig that begin together stand together, the most certain first.
    odd : list of Odd
        The worst first.

    """

    series: list[Series]
    changes: list[list[Change]]
    odd: list[Odd]

    def sentences(self) -> list[str]:
        """Return one sentence for each change."""
        return [sentence(group) for group in self.changes]

    def identities(self) -> list[str]:
        """Return what tells changes and odd recordings from those of another run."""
        return sorted([*(_identity(one, one.begin) for group in self.changes for one in group),
                       *(_of_recording(one) for one in self.odd)])

    def new(self, told: set[str]) -> list[str]:
        """
        Return the identities of what another run did not tell.

        Parameters
        ----------
        told : set of str
            What ``seen_before`` returned. A change is told if it was told with a beginning
            within its interval.

        """
        found = [_of_recording(one) for one in self.odd
                 if told.isdisjoint((_of_recording(one), one.row['case'].name))]
        for group in self.changes:
            possible = [{_identity(one, place) for place in range(one.earliest, one.latest + 1)}
                        for one in group]
            if told.isdisjoint(map(of_group, set().union(*possible))):
                found += [_identity(one, one.begin) for one, several in zip(group, possible)
                          if told.isdisjoint(several)]
        return sorted(found)


def identity(rig: str, name: str, quantity: str, shape: str, rises: bool, begin: str) -> str:
    """Return what tells a change from others, also to a person."""
    return f'{rig} {name} {quantity} {shape} {"up" if rises else "down"} from {begin}'


def of_group(one: str) -> str:
    """Return what tells a change, by its identity, together with all that began with it."""
    return f'{one}, and what began with it'


def _identity(change: Change, place: int) -> str:
    """Return the identity of a change, if it began at that place of its series."""
    one = change.series
    return identity(one.rig, one.name, one.quantity, change.shape, change.after > change.before,
                    one.days[place])


def _of_recording(odd: Odd) -> str:
    return f'{odd.row["case"].rig} {odd.row["recording"]}'


def find(campaign: 'Campaign') -> Findings:
    """Return what a campaign shows."""
    series = series_of(campaign.rows)
    changes = changes_of(series)
    return Findings(series, _together(changes), _odd(campaign, series, changes))


def _together(changes: list[Change]) -> list[list[Change]]:
    """Return the changes in groups of one rig and one beginning."""
    groups: list[list[Change]] = []
    for change in sorted(changes, key=lambda one: (one.series.rig, one.p, one.series.name)):
        for group in groups:
            first = group[0]
            if first.series.rig == change.series.rig and abs(
                    began(first) - began(change)) <= NEAR_DAYS:
                group.append(change)
                break
        else:
            groups.append([change])
    return groups


def began(change: Change) -> float:
    """Return the time at which a change began [days]."""
    return float(change.series.time[change.begin])


def _odd(campaign: 'Campaign', series: list[Series], changes: list[Change]) -> list[Odd]:
    """Return the recordings that do not fit, the worst first; each once."""
    fitted = {id(change.series): change.fitted() for change in changes}
    found: dict[Case, Odd] = {}
    rows = {row['case']: row for row in campaign.rows}
    for row in campaign.rows:
        if row['bad']:
            found[row['case']] = Odd(row, row['reason'] or row['verdict'], math.inf)
    for one in series:
        far = far_from_neighbours(one)
        expected = fitted.get(id(one))
        for k in range(len(one)):
            if not far[k] or one.cases[k] in found:
                continue
            middle = _expected(one, k) if expected is None else float(expected[k])
            distance = abs(one.value[k] - middle) / one.sd[k]
            if distance > FAR:
                found[one.cases[k]] = Odd(rows[one.cases[k]], (
                    f'{one.name}: {one.quantity} is {shown(one.value[k], one.unit)}, recordings '
                    f'near it say {shown(middle, one.unit)}'), float(distance))
    return sorted(found.values(), key=lambda odd: (-odd.far, odd.row['case'].rig,
                                                   odd.row['case'].time))


def _expected(series: Series, k: int) -> float:
    others = sorted(float(value) for i, value in enumerate(series.value) if i != k)
    return others[len(others) // 2] if others else float(series.value[k])


def shown(value: float, unit: str) -> str:
    """Return a number as people read it."""
    factor, name = SHOWN.get(unit, (1.0, unit))
    return f'{factor * value:.3g} {name}'.strip()


def span(change: Change) -> str:
    """Return when a change began, with its interval."""
    days = change.series.days
    if change.shape == 'line':
        return f'over all {_step(change)}s from {days[0]}'
    day, low, high = days[change.begin], days[change.earliest], days[change.latest]
    return f'from {day} on' + (f' (95 %: {low} to {high})' if (low, high) != (day, day) else '')


def _step(change: Change) -> str:
    """Return what the time of a series counts: recordings without a date are numbered."""
    return 'recording' if change.series.days[0].isdigit() else 'day'


def sentence(group: list[Change]) -> str:
    """Return a change of a rig, and what changed with it, as a sentence."""
    first = group[0]
    one, half = first.series, IN_95 * first.amount_sd
    low, high = (shown(first.amount + sign * half, one.unit) for sign in (-1.0, 1.0))
    new = abs(first.before - one.nothing) < IN_95 * float(one.sd[0]) and not bool(
        one.named[:max(first.begin, 1)].any())
    if first.shape == 'step':
        does = 'begins' if new else 'rises' if first.after > first.before else 'falls'
        how = f'by {shown(first.amount, one.unit)} (95 %: {low} to {high})'
    else:
        does = 'grows' if abs(first.after) > abs(first.before) else 'shrinks'
        how = f'by {shown(first.amount, one.unit)} a {_step(first)} (95 %: {low} to {high})'
    text = (f'{one.rig}: {one.name} {does} {span(first)}: {one.quantity} changes {how}, '
            f'to {shown(first.after, one.unit)}; p = {first.p:.1g}.')
    also = list(dict.fromkeys(other.series.name for other in group[1:]
                              if other.series.name != one.name))
    return text + (f' With it: {", ".join(also)}.' if also else '')

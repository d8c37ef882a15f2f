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

"""What an identification found, as data and as text for people."""

from dataclasses import dataclass, field, replace
from typing import Any

from pam_sim.gap.verify.together import Combination
from pam_sim.identify.judgement import DETERMINED, is_narrow, UNDETERMINED
from pam_sim.identify.numbers import Number
from pam_sim.identify.profile import Interval
from pam_sim.rig import Rig
from pam_sim.short_repr import short_repr
from pam_sim.units import behind_number

# For people: factor from SI and unit.
READABLE = {'Pa': (1e-3, 'kPa'), 'Pa/V': (1e-3, 'kPa/V'), 'm': (1e3, 'mm'), 's': (1e3, 'ms'),
            'N/m': (1e-3, 'N/mm')}
AT_EDGE, STARTING = 'at the edge', 'starting value'


@dataclass(frozen=True)
class Found:
    """
    One unknown number.

    Parameters
    ----------
    number : Number
    value : float
        The likeliest one, SI.
    interval : Interval
        95 %.
    status : str
        ``determined``, ``only together`` or ``not determined``.
    at_edge : bool
        Whether the value lies at an end of its allowed range. It is then not determined, however
        short the interval.
    is_bent : bool
        Whether no effect explains a clear rest of its signals. It is then not determined either.

    """

    number: Number
    value: float
    interval: Interval
    status: str
    at_edge: bool = False
    is_bent: bool = False

    @property
    def is_narrow(self) -> bool:
        """Tell whether the interval is short: more recordings of this kind tell little more."""
        return is_narrow(self.number, self.interval.low, self.interval.high)

    @property
    def verdict(self) -> str:
        """Return the status in words for people."""
        if not self.is_narrow:
            return self.status
        return AT_EDGE if self.at_edge else STARTING if self.is_bent else self.status

    @property
    def is_open(self) -> bool:
        """Tell whether another recording would tell more; another model may be what is needed."""
        return not self.is_narrow and (
            not self.is_bent or self.interval.open_low or self.interval.open_high)

    def as_bent(self) -> 'Found':
        """Return the same number as one that a missing effect has bent."""
        return replace(self, is_bent=True,
                       status=UNDETERMINED if self.status == DETERMINED else self.status)

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data; an open end of the interval is null."""
        n, i = self.number, self.interval
        return {'name': n.name, 'effect': n.effect or None, 'parameter': n.parameter,
                'unit': n.unit, 'status': self.status, 'value': self.value,
                'at_edge': self.at_edge,
                'ci95': [None if i.open_low else i.low, None if i.open_high else i.high],
                'allowed': [n.lower, n.upper],
                'profile': [{'value': v, 'rise': r} for v, r in i.points]}

    def shown(self) -> tuple[str, str]:
        """Return (value, 95 % interval) for people, with units."""
        factor, unit = READABLE.get(self.number.unit, (1.0, self.number.unit))
        unit = behind_number(unit)
        i = self.interval
        low, high = f'{factor * i.low:.4g}', f'{factor * i.high:.4g}'
        span = {(False, False): f'{low} to {high}{unit}', (True, False): f'up to {high}{unit}',
                (False, True): f'{low}{unit} or more', (True, True): 'anywhere in its range'}
        return f'{factor * self.value:.4g}{unit}', span[i.open_low, i.open_high]

    def text(self) -> str:
        """Return it as a line."""
        value, span = self.shown()
        is_open = self.interval.open_low and self.interval.open_high
        return (f'{self.number.name:24} {self.verdict:15} {value} '
                f'({span if is_open else f"95 %: {span}"})')

    def edge(self) -> str:
        """Return a sentence on a value at an end of its allowed range."""
        factor, unit = READABLE.get(self.number.unit, (1.0, self.number.unit))
        other = 'another law' if self.number.of_law else 'another model'
        return (f'{self.number.name}: at the edge of its allowed range '
                f'({factor * self.number.lower:.4g} to {factor * self.number.upper:.4g}'
                f'{behind_number(unit)}): {other} or a wider range may fit better')


@short_repr
@dataclass
class Identification:
    """
    The unknown numbers of a rig after some recordings.

    Attributes
    ----------
    rig : pam_sim.Rig
        With the numbers that are determined, and how well they are known.
    found : list of Found
    combinations : list of Combination
    records : list of dict
        Path and kind of each recording.
    signals : dict
        Name -> unit, ``rmse_before`` and ``rmse_after``, SI.
    incomplete : bool
        Whether the numbers alone leave more than noise, so that effects were fitted along.
    wanted : list of str
        Names of all unknown numbers, also of those that nothing in the recordings depends on.
    next_experiment : dict or None
        ``why``, ``determines`` (names), ``experiment`` (for ``pam run``) and ``added_kg``.
    remarks : list of str
    bent : list of str
        Numbers in whose signals no effect explains a clear rest (``Criteria.clear_rest``).

    """

    rig: Rig
    found: list[Found]
    combinations: list[Combination]
    records: list[dict[str, Any]]
    signals: dict[str, dict[str, Any]]
    incomplete: bool
    wanted: list[str]
    next_experiment: dict[str, Any] | None = None
    remarks: list[str] = field(default_factory=list)
    bent: list[str] = field(default_factory=list)

    def __getitem__(self, name: str) -> Found:
        """Return one number by its name."""
        return {one.number.name: one for one in self.found}[name]

    @property
    def open_names(self) -> list[str]:
        """Return the names of the numbers that are not determined."""
        known = {one.number.name for one in self.found if one.status == DETERMINED}
        return [name for name in self.wanted if name not in known]

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        return {'schema': 1, 'numbers': [one.to_dict() for one in self.found],
                'combinations': [{'weights': c.weights, 'value': c.value,
                                  'half_width': c.half_width, 'product': c.product,
                                  'text': c.text()} for c in self.combinations],
                'records': self.records, 'signals': self.signals,
                'incomplete': self.incomplete, 'next_experiment': self.next_experiment,
                'remarks': self.remarks}

    def text(self) -> str:
        """Return the whole for a terminal."""
        lines = [f'{r["path"]}: {r["kind"]}' for r in self.records]
        lines += [one.text() for one in self.found]
        lines += [f'known together: {c.text()}' for c in self.combinations]
        for name, s in self.signals.items():
            factor, unit = READABLE.get(s['unit'], (1.0, s['unit']))
            lines.append(f'{name}: {factor * s["rmse_before"]:.3g} {unit} off before, '
                         f'{factor * s["rmse_after"]:.3g} {unit} after (rms)')
        if self.incomplete:
            lines.append('the numbers alone leave more than noise: effects of the library were '
                         'fitted along, and the intervals allow for them (next: pam gap)')
        lines += [f'remark: {one}' for one in self.remarks]
        if self.next_experiment is not None:
            lines.append(f'what to measure next: {self.next_experiment["why"]}')
        return '\n'.join(lines)


def half_width(one: Found) -> float:
    """Return half of the interval of a number, in its unit."""
    return 0.5 * (one.interval.high - one.interval.low)

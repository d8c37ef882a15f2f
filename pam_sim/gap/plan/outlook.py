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
Before measuring: what a protocol could show on a rig, and which effects it would confuse.

Everything is local: how each known number and each effect moves the signals of a protocol, in
noise floors. The part that parameters can explain within their tolerance is removed from the
signature of an effect. The rest gives the smallest size that shows. The rest after fitting a rival
as well gives the smallest size that can be named. Only inner products are kept, so protocols made
of the same pieces are joined by adding them.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Any

import numpy as np
from pam_sim.effects.effect import Effect
from pam_sim.effects.registry import get_effect
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.plan.sensitivity import grows_with, InnerProducts, Sensitivities, sized
from pam_sim.rig import Rig
from pam_sim.short_repr import short_repr

SMALLEST_FACTOR, LARGEST_FACTOR = 1e-3, 100.0     # of the typical size of an effect
CLOSE_ENOUGH = 0.05          # of the wanted rms, where the look for a size ends
STEPS = 10


@short_repr
@dataclass(frozen=True)
class Outlook:
    """
    What a protocol could tell about one effect.

    Parameters
    ----------
    name : str
    visible, named : dict or None
        Parameters from which on it shows, and from which on no rival can stand in for it;
        None where that takes more than the effect's range.
    factors : tuple of float
        Both as multiples of the typical size, ``inf`` where out of range.
    rivals : tuple of (str, float)
        Which need more than the visible size to be told from it: name and how many times
        as much, the worst first.
    inseparable_factor : float
        Beyond which a rival is called inseparable.

    """

    name: str
    visible: dict[str, float] | None
    named: dict[str, float] | None
    factors: tuple[float, float]
    rivals: tuple[tuple[str, float], ...] = ()
    inseparable_factor: float = CRITERIA.inseparable_factor

    @property
    def inseparable(self) -> tuple[str, ...]:
        """Return the rivals that cannot be told from it even at many times the visible size."""
        return tuple(name for name, factor in self.rivals
                     if factor > self.inseparable_factor)

    def to_dict(self, rig: Rig) -> dict[str, Any]:
        """Return it as plain data, sizes in units of the parameters and as reported."""
        effect = get_effect(self.name)
        return {'name': self.name, 'family': effect.family, 'subsystem': effect.subsystem,
                'visible_from': _size(effect, self.visible, rig),
                'named_from': _size(effect, self.named, rig),
                'rivals': [{'name': n, 'times_visible': None if math.isinf(f) else f}
                           for n, f in self.rivals],
                'inseparable': list(self.inseparable)}


def _size(effect: Effect, values: Mapping[str, float] | None, rig: Rig) -> dict[str, Any] | None:
    if values is None:
        return None
    units = {p.name: p.unit for p in effect.parameters}
    report = effect.report(effect.values(values), rig)
    return {'parameters': {n: {'value': float(v), 'unit': units[n]} for n, v in values.items()},
            'equivalent': {n: {'value': float(v), 'unit': u} for n, (v, u) in report.items()}}


def outlooks(sensitivities: Sensitivities, floors: float = 1.0) -> list[Outlook]:
    """
    Return the Outlook of every effect, each looked at near its least size.

    Parameters
    ----------
    sensitivities : Sensitivities
        Of the protocol.
    floors : float
        An effect shows when it moves some signal by so many noise floors (rms).

    """
    factors, seen = least_factors([sensitivities], floors)
    inner = sensitivities.inner(factors)
    return [_outlook(sensitivities.probes[n], inner, factors[n], seen[n]) for n in inner.names]


def least_factors(pieces: Sequence[Sensitivities], floors: float = 1.0
                  ) -> tuple[dict[str, float], dict[str, float]]:
    """
    Return (multiple of the typical size from which on an effect shows, rms seen), by name.

    Parameters
    ----------
    pieces : list of Sensitivities
        Measured one after the other.
    floors : float
        As in :func:`outlooks`; the rms seen comes in these.

    """
    probes = pieces[0].probes
    tried: dict[str, dict[float, float]] = {n: {} for n in probes}
    factors = dict.fromkeys(probes, 1.0)
    for _ in range(STEPS):
        inners = [p.inner(factors, with_rivals=False) for p in pieces]
        for n, rms in sum(inners[1:], inners[0]).seen().items():
            tried[n][factors[n]] = rms / floors
        factors = {n: _nearer(probes[n], tried[n]) for n in probes}
        if all(factors[n] in tried[n] for n in probes):
            break
    best = {n: min(points, key=lambda f: abs(math.log(max(points[f], 1e-12))))
            for n, points in tried.items()}
    return best, {n: tried[n][f] for n, f in best.items()}


def in_proportion(inner: InnerProducts, factors: Mapping[str, float], floors: float = 1.0
                  ) -> list[tuple[float, float]]:
    """Return the (visible, named) factor of every effect, by proportion from given factors."""
    found = []
    for name, seen in inner.seen().items():
        visible = factors[name] * floors / max(seen, 1e-12)
        left = min(inner.confused(name).values(), default=math.inf)
        named = factors[name] * inner.criteria.visible_sd / max(left, 1e-12)
        found.append((visible, max(visible, named)))
    return found


def _nearer(candidate: Candidate, tried: Mapping[float, float]) -> float:
    """Return the next factor to try, or one that was, after factor -> share of the wanted rms."""
    close = [f for f, seen in tried.items() if abs(seen - 1.0) < CLOSE_ENOUGH]
    low = max((f for f, seen in tried.items() if seen < 1.0), default=None)
    high = min((f for f, seen in tried.items() if seen >= 1.0 and f > (low or 0.0)), default=None)
    if close:
        return close[0]
    if low is None or high is None:
        start = low if low is not None else high if high is not None else 1.0
        step = min(max(1.0 / max(tried[start], 1e-12), 0.03), 30.0)
        return min(max(start * step, SMALLEST_FACTOR), _largest(candidate))
    # Between the two, on a straight line of the logarithms; numbers at their limit bend it.
    first, second = math.log(max(tried[low], 1e-12)), math.log(tried[high])
    share = min(max(-first / (second - first), 0.1), 0.9)
    return low * (high / low) ** share


def _outlook(probe: Candidate, inner: InnerProducts, factor: float, seen: float) -> Outlook:
    if seen < 1.0 - 4.0 * CLOSE_ENOUGH:
        return Outlook(probe.name, None, None, (math.inf, math.inf))
    apart, largest = inner.criteria.visible_sd, inner.criteria.inseparable_factor
    rivals = [(rival, apart / max(left, 1e-12))
              for rival, left in inner.confused(probe.name).items() if left < apart]
    rivals.sort(key=lambda pair: -pair[1])
    needed = factor * (rivals[0][1] if rivals else 1.0)
    reachable = needed <= min(_largest(probe), largest * factor)
    return Outlook(probe.name, sized(probe, factor), sized(probe, needed) if reachable else None,
                   (factor, needed if reachable else math.inf), tuple(rivals), largest)


def score(factors: Iterable[tuple[float, float]]) -> float:
    """
    Return how good a protocol is: mean decades below ``LARGEST_FACTOR``, visible and named.

    Parameters
    ----------
    factors : iterable of (float, float)
        Visible and named size of each effect, in typical sizes.

    """
    capped = [min(max(f, SMALLEST_FACTOR), LARGEST_FACTOR) for pair in factors for f in pair]
    return float(np.mean(np.log10(LARGEST_FACTOR / np.array(capped))))


def _largest(candidate: Candidate) -> float:
    """Return the largest multiple of the typical size within the range of the effect."""
    values = candidate.starts()[0]
    if candidate.amplitudes:
        return min(f.upper / values[f.name] for f in candidate.amplitudes)
    ends = [(f.upper / values[f.name]) if grows_with(candidate) else (values[f.name] / f.lower)
            for f in candidate.free]
    return min(ends)

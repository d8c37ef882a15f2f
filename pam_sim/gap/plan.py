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

Everything is local: how each known number and each effect moves the signals of a
protocol, in noise floors. What the numbers can do within their tolerance is taken out of
an effect's signature; what is left tells from which size on the effect shows, and what
is left once a rival has done its best too, from which size on it can be named. Only inner
products are kept, so protocols made of the same pieces are joined by adding them.
"""

from dataclasses import dataclass, field, replace
import math

import numpy as np
from pam_sim.effects.registry import get_effect
from pam_sim.errors import InputError
from pam_sim.gap.candidates import candidates, is_limit, split_refinements
from pam_sim.gap.cuts import acts_on, cuts_of
from pam_sim.gap.fit import BOX
from pam_sim.gap.parts import UNUSED
from pam_sim.gap.side_by_side import side_by_side
from pam_sim.short_repr import short_repr

APART = 0.3                  # floors (rms) that the best rival must leave in some signal
LARGE = 10.0                 # times the visible size; rivals that need more are called inseparable
SMALLEST_FACTOR, LARGEST_FACTOR = 1e-3, 100.0     # of the typical size of an effect
CLOSE_ENOUGH = 0.05          # of the wanted rms, where the look for a size ends
STEPS = 10
GENTLE = 1e-9                # keeps columns that say the same solvable


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

    """

    name: str
    visible: dict | None
    named: dict | None
    factors: tuple
    rivals: tuple = ()

    @property
    def inseparable(self):
        """Return the rivals that cannot be told from it at ``LARGE`` times the visible size."""
        return tuple(name for name, factor in self.rivals if factor > LARGE)

    def to_dict(self, rig):
        """Return it as plain data, sizes in units of the parameters and as reported."""
        effect = get_effect(self.name)
        return {'name': self.name, 'family': effect.family, 'subsystem': effect.subsystem,
                'visible_from': _size(effect, self.visible, rig),
                'named_from': _size(effect, self.named, rig),
                'rivals': [{'name': n, 'times_visible': None if math.isinf(f) else f}
                           for n, f in self.rivals],
                'inseparable': list(self.inseparable)}


def _size(effect, values, rig):
    if values is None:
        return None
    units = {p.name: p.unit for p in effect.parameters}
    report = effect.report(effect.values(values), rig)
    return {'parameters': {n: {'value': float(v), 'unit': units[n]} for n, v in values.items()},
            'equivalent': {n: {'value': float(v), 'unit': u} for n, (v, u) in report.items()}}


@short_repr
@dataclass
class Inner:
    """
    Inner products of known numbers, effects, and what rivals may do, in this order.

    Attributes
    ----------
    names : tuple of str
        Of the effects.
    priors : int
        How many known numbers.
    rivals : dict
        Name -> formulation -> its columns.
    products : dict of str -> numpy.ndarray, shape (C, C)
        By signal, in floors squared.
    samples : dict of str -> int
        Compared, by signal.

    """

    names: tuple
    priors: int
    rivals: dict = field(default_factory=dict)
    products: dict = field(default_factory=dict)
    samples: dict = field(default_factory=dict)

    def __add__(self, other):
        """Return the inner products of both protocols measured one after the other."""
        return replace(self, products={
            s: self.products[s] + other.products[s] for s in self.products}, samples={
            s: self.samples[s] + other.samples[s] for s in self.samples})

    def seen(self):
        """Return by name the rms by which an effect moves a signal that numbers cannot."""
        return {n: self.left(self.priors + k) for k, n in enumerate(self.names)}

    def confused(self, name):
        """Return by rival the rms that it leaves of an effect, in its best formulation."""
        column = self.priors + self.names.index(name)
        return {rival: min(self.left(column, columns) for columns in formulations.values())
                for rival, formulations in self.rivals.items()
                if rival != name and not is_limit(name, rival)}

    def left(self, column, free=()):
        """
        Return the rms of a column, in floors, of the signal in which most of it is left.

        Parameters
        ----------
        column : int
            Whose.
        free : sequence of int
            Columns that may be subtracted in any amount, beside the known numbers: those up
            to ``BOX`` times, with a standard normal prior.

        """
        whole = sum(self.products.values())
        rest = np.zeros(len(whole))
        rest[column] = 1.0
        out = np.concatenate([np.arange(self.priors), np.asarray(free, dtype=int)])
        weak = np.where(out < self.priors, 1.0, GENTLE * np.maximum(np.diag(whole)[out], 1e-300))
        while out.size:
            rest[out] = 0.0
            found = -np.linalg.solve(whole[np.ix_(out, out)] + np.diag(weak), whole[out] @ rest)
            rest[out] = found
            beyond = np.where(out < self.priors, np.abs(found) - BOX, -1.0)
            if beyond.max() <= 0.0:
                break
            worst = int(np.argmax(beyond))          # one at a time: the others may come back
            rest[out[worst]] = np.sign(found[worst]) * BOX
            out, weak = np.delete(out, worst), np.delete(weak, worst)
        return max(math.sqrt(max(float(rest @ self.products[s] @ rest), 0.0) / n)
                   for s, n in self.samples.items())


class Sensitivities:
    """
    How a protocol answers to numbers and effects.

    Parameters
    ----------
    rig : pam_sim.Rig
        The model.
    recording : Recording
        The protocol simulated with it, sensors with their noise.
    only : sequence of str, optional
        Names to look at; all by default.

    """

    def __init__(self, rig, recording, only=None):
        self.rig = rig
        self.cuts = cuts_of(rig, [recording], own_proof=False)
        self.signals = sum((cut.signals for cut in self.cuts), ())
        self.pool, _ = split_refinements(candidates(rig, self.signals, only))
        self.probes = {c.name: c for c in self.pool if c.effect == c.name}
        self._base = [cut.values(rig, np.zeros(len(cut.known))) for cut in self.cuts]
        self._rows = [cut.part != UNUSED for cut in self.cuts]
        self._floor = [np.array([cut.floor[s] for s in cut.signals])[cut.signal]
                       for cut in self.cuts]
        self._signal = np.concatenate([
            [self.signals.index(cut.signals[s]) for s in cut.signal[rows]]
            for cut, rows in zip(self.cuts, self._rows)])
        self._known = self._known_columns()
        self.priors = len(self._known)

    def change(self, candidate, values):
        """Return what an effect does to all signals, in floors; None if it cannot be run."""
        rig = self.rig.with_(effects=[*self.rig.effects, candidate.setting(values)])
        parts = []
        for cut, base, rows, floor in zip(self.cuts, self._base, self._rows, self._floor):
            if acts_on(candidate.effect, cut.subsystem):
                try:
                    change = cut.values(rig, np.zeros(len(cut.known))) - base
                except InputError:
                    return None
                parts.append((change / floor)[rows])
            else:
                parts.append(np.zeros(rows.sum()))
        return np.concatenate(parts)

    def inner(self, factors, with_rivals=True):
        """
        Return the Inner products, everything at multiples of its typical size.

        Parameters
        ----------
        factors : dict of str -> float
            By name of the effect; formulations of it take the same.
        with_rivals : bool
            False leaves the columns out in which rivals may vary.

        """
        jobs = [(self.probes[n], sized(self.probes[n], factors[n])) for n in self.probes]
        if with_rivals:
            jobs += [(c, v) for c in self.pool for v in _columns(c, factors[c.name])]
        columns = side_by_side(lambda job: self.change(*job), jobs)
        nothing = np.zeros(self._signal.size)
        matrix = np.column_stack([*self._known, *(nothing if c is None else c for c in columns)])
        found = Inner(tuple(self.probes), self.priors)
        for k, (candidate, _) in enumerate(jobs[len(self.probes):]):
            found.rivals.setdefault(candidate.name, {}).setdefault(candidate.effect, []).append(
                self.priors + len(self.probes) + k)
        for k, signal in enumerate(self.signals):
            chosen = matrix[self._signal == k]
            found.products[signal], found.samples[signal] = chosen.T @ chosen, len(chosen)
        return found

    def _known_columns(self):
        """Return one column per known number and cut: what one deviation does."""
        columns = []
        for place, (cut, base) in enumerate(zip(self.cuts, self._base)):
            for k, unit in zip(cut.known, np.eye(len(cut.known))):
                slope = (cut.values(self.rig, k.step * unit) - base) / k.step
                parts = [np.zeros(rows.sum()) for rows in self._rows]
                parts[place] = (slope / self._floor[place])[self._rows[place]]
                columns.append(np.concatenate(parts))
        return columns


def outlooks(looks, floors=1.0):
    """
    Return the Outlook of every effect, each looked at near its least size.

    Parameters
    ----------
    looks : Sensitivities
        Of the protocol.
    floors : float
        An effect shows when it moves some signal by so many noise floors (rms).

    """
    factors, seen = least_factors([looks], floors)
    inner = looks.inner(factors)
    return [_outlook(looks.probes[n], inner, factors[n], seen[n]) for n in inner.names]


def least_factors(pieces, floors=1.0):
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
    tried = {n: {} for n in probes}
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


def in_proportion(inner, factors, floors=1.0):
    """Return the (visible, named) factor of every effect, by proportion from given factors."""
    found = []
    for name, seen in inner.seen().items():
        visible = factors[name] * floors / max(seen, 1e-12)
        left = min(inner.confused(name).values(), default=math.inf)
        found.append((visible, max(visible, factors[name] * APART / max(left, 1e-12))))
    return found


def _nearer(candidate, tried):
    """Return the next factor to try, or one that was, after factor -> share of the wanted rms."""
    close = [f for f, seen in tried.items() if abs(seen - 1.0) < CLOSE_ENOUGH]
    low = max((f for f, seen in tried.items() if seen < 1.0), default=None)
    high = min((f for f, seen in tried.items() if seen >= 1.0 and f > (low or 0.0)), default=None)
    if close:
        return close[0]
    if low is None or high is None:
        start = high if low is None else low
        step = min(max(1.0 / max(tried[start], 1e-12), 0.03), 30.0)
        return min(max(start * step, SMALLEST_FACTOR), _largest(candidate))
    # Between the two, on a straight line of the logarithms; numbers at their limit bend it.
    first, second = math.log(max(tried[low], 1e-12)), math.log(tried[high])
    share = min(max(-first / (second - first), 0.1), 0.9)
    return low * (high / low) ** share


def _outlook(probe, inner, factor, seen):
    if seen < 1.0 - 4.0 * CLOSE_ENOUGH:
        return Outlook(probe.name, None, None, (math.inf, math.inf))
    rivals = [(rival, APART / max(left, 1e-12))
              for rival, left in inner.confused(probe.name).items() if left < APART]
    rivals.sort(key=lambda pair: -pair[1])
    needed = factor * (rivals[0][1] if rivals else 1.0)
    reachable = needed <= min(_largest(probe), LARGE * factor)
    return Outlook(probe.name, sized(probe, factor), sized(probe, needed) if reachable else None,
                   (factor, needed if reachable else math.inf), tuple(rivals))


def score(factors):
    """
    Return how good a protocol is: mean decades below ``LARGEST_FACTOR``, visible and named.

    Parameters
    ----------
    factors : iterable of (float, float)
        Visible and named size of each effect, in typical sizes.

    """
    capped = [min(max(f, SMALLEST_FACTOR), LARGEST_FACTOR) for pair in factors for f in pair]
    return float(np.mean(np.log10(LARGEST_FACTOR / np.array(capped))))


def _columns(candidate, factor):
    """Return the parameters of every column: each amplitude alone, from every start."""
    found = []
    for values in candidate.starts():
        values = sized(candidate, factor, values)
        for f in candidate.amplitudes or (None,):
            found.append({g.name: values[g.name] if g.shape or f is None or g is f else 0.0
                          for g in candidate.free})
    return [dict(t) for t in dict.fromkeys(tuple(v.items()) for v in found)]


def sized(candidate, factor, values=None):
    """Return the parameters at a multiple of the typical size, or of given values."""
    values = values or candidate.starts()[0]
    if candidate.amplitudes:
        found = {f.name: values[f.name] * (1.0 if f.shape else factor) for f in candidate.free}
    else:
        power = 1.0 if _grows(candidate) else -1.0
        found = {f.name: values[f.name] * factor ** power for f in candidate.free}
    return {f.name: min(max(found[f.name], f.lower), f.upper) for f in candidate.free}


def _grows(candidate):
    """Return whether an effect without amplitude grows with its parameter: a time does."""
    return all(f.name.endswith('_s') and '_per_' not in f.name for f in candidate.free)


def _largest(candidate):
    """Return the largest multiple of the typical size within the range of the effect."""
    values = candidate.starts()[0]
    if candidate.amplitudes:
        return min(f.upper / values[f.name] for f in candidate.amplitudes)
    ends = [(f.upper / values[f.name]) if _grows(candidate) else (values[f.name] / f.lower)
            for f in candidate.free]
    return min(ends)

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
Which effects are worth a fit: sensitivity signatures against what the baseline leaves.

One simulation per formulation and start. Its change of the errors is freed of what the
known numbers can do within their priors; what is left is the effect's signature, and
its projection on the remaining errors gives amplitude and promise in closed form.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from pam_sim.effects.registry import get_effect
from pam_sim.errors import InputError
from pam_sim.gap.candidates import Candidate
from pam_sim.gap.cuts import acts_on
from pam_sim.gap.side_by_side import side_by_side

AMPLITUDE_RANGE = (0.05, 30.0)      # of the screening size, for the start of a fit


@dataclass(frozen=True)
class Screened:
    """
    A candidate with its best start and the share of the squared errors it promises.

    ``seen`` is the rms of its signature in noise floors, of the signal that shows it most,
    for ``size``, the parameters that were tried first. ``flat`` is the same with all errors at
    full weight: a misfit that lasts has little weight left, and what explains it promises
    nothing.
    """

    candidate: Candidate
    start: tuple
    promise: dict
    seen: float = 0.0
    size: dict = field(default_factory=dict)
    flat: 'Screened' = None


def screen(problem, near, found):
    """
    Return the candidates with start and promise.

    Parameters
    ----------
    problem : Problem
        Cuts and slopes.
    near : Found
        Where the search stands; its effects stay in.
    found : list of Candidate
        What is tried.

    Returns
    -------
    list of Screened
        In the order given; ``promise`` by subsystem, 0 where a candidate does not act.

    """
    spaces, flat = spaces_of(problem, near), flat_spaces_of(problem, near)
    return side_by_side(lambda c: _screened(problem, near, c, spaces, flat), found)


def spaces_of(problem, near):
    """Return by subsystem the fitted errors with what the known numbers can do taken out."""
    return {cut.subsystem: _Space(problem, cut, near) for cut in problem.cuts}


def flat_spaces_of(problem, near):
    """Return the same as ``spaces_of`` with all errors at full weight."""
    return spaces_of(problem, replace(near, temper={
        s: np.ones_like(temper) for s, temper in near.temper.items()}))


def free_signature(problem, near, candidate, values, cut, space):
    """Return what an effect does to the weighted errors of a cut that known numbers cannot."""
    return space.free_of_known(_change(problem, near, candidate, values, cut))


def _change(problem, near, candidate, values, cut):
    rig = problem.with_effects([*near.settings(), candidate.setting(values)])
    return cut.errors(rig, near.known_z[cut.subsystem]) - near.errors[cut.subsystem]


class _Space:
    """Errors of the fitted part, weighted, with what the known numbers can do taken out."""

    def __init__(self, problem, cut, near):
        self.cut, self.mask = cut, np.isin(cut.part, problem.use)
        self.weight = 1.0 / np.sqrt(near.temper[cut.subsystem][cut.signal[self.mask]])
        slopes = problem.slopes[cut.subsystem][self.mask] * self.weight[:, np.newaxis]
        # The priors as further rows: numbers may move only as far as they are uncertain.
        self.basis, _ = np.linalg.qr(np.vstack([slopes, np.eye(slopes.shape[1])]))
        self.left = self.free_of_known(near.errors[cut.subsystem],
                                       near.known_z[cut.subsystem])

    def free_of_known(self, errors, known_z=None):
        """Return weighted errors orthogonal to the known numbers."""
        tail = np.zeros(self.basis.shape[1]) if known_z is None else known_z
        y = np.concatenate([errors[self.mask] * self.weight, tail])
        return y - self.basis @ (self.basis.T @ y)

    def rms(self, change):
        """Return the rms of a weighted change in floors, of the signal where it is largest."""
        plain = change[:self.weight.size] / self.weight
        signal = self.cut.signal[self.mask]
        return max(float(np.sqrt(np.mean(plain[signal == s] ** 2)))
                   for s in range(len(self.cut.signals)))


def least_sizes(screened, rig, floors=1.0):
    """
    Return the smallest size of each effect that shows, as ``minimum_detectable`` of gap.json.

    A size shows when its signature, freed of what the known numbers can do, has an rms of
    ``floors`` noise floors. Effects whose response is not about proportional to their
    size are left out.
    """
    found = {}
    for s in screened:
        effect = get_effect(s.candidate.effect)
        if effect.variant_of or not s.candidate.amplitudes or s.seen <= 0.0:
            continue
        factor = floors / s.seen
        values = {f.name: s.size[f.name] * (1.0 if f.shape else factor)
                  for f in s.candidate.free}
        values = {f.name: min(max(values[f.name], f.lower), f.upper) for f in s.candidate.free}
        report = effect.report(effect.values(s.candidate.setting(values)['parameters']), rig)
        quantity, (value, unit) = next(iter(report.items()))
        found[effect.name] = {'value': float(value), 'unit': unit, 'quantity': quantity}
    return found


def _screened(problem, near, candidate, spaces, flat):
    """Return a Screened; each start is simulated once for both weights."""
    changes = []
    for values in candidate.starts():
        changes.append((values, {}))
        for cut in problem.cuts:
            if acts_on(candidate.effect, cut.subsystem):
                try:
                    changes[-1][1][cut.subsystem] = _change(problem, near, candidate, values, cut)
                except InputError:
                    continue
    return replace(_best_start(candidate, changes, spaces),
                   flat=_best_start(candidate, changes, flat))


def _best_start(candidate, changes, spaces):
    best = Screened(candidate, candidate.typical_start(), {})
    first, seen = changes[0][0], 0.0
    for values, by_cut in changes:
        promise, factors = {}, []
        for subsystem, change in by_cut.items():
            space = spaces[subsystem]
            change = space.free_of_known(change)
            size = float(change @ change)
            if size <= 0.0:
                continue
            if values is first:
                seen = max(seen, space.rms(change))
            factor = -float(change @ space.left) / size
            if candidate.amplitudes:
                low = min((f.lower / values[f.name] for f in candidate.amplitudes
                           if values[f.name]), default=0.0)
                high = AMPLITUDE_RANGE[1]
                factor = float(np.clip(factor, max(low, -high), high))
            else:
                factor = float(np.clip(factor, 0.0, 1.0))
            left = space.left + factor * change
            promise[subsystem] = 1.0 - float(left @ left) / float(space.left @ space.left)
            factors.append(factor)
        if sum(promise.values()) > sum(best.promise.values()):
            factor = factors[int(np.argmax(list(promise.values())))]
            if 0.0 <= factor < AMPLITUDE_RANGE[0]:
                factor = AMPLITUDE_RANGE[0]
            start = tuple(f.coordinate(values[f.name] * (1.0 if f.shape else factor))
                          for f in candidate.free)
            best = Screened(candidate, start, promise)
    return replace(best, seen=seen, size=first)

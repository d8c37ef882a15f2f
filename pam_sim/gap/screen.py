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

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from pam_sim.errors import InputError
from pam_sim.gap.candidates import Candidate
from pam_sim.gap.cuts import acts_on
from pam_sim.rollout.batch import default_workers

AMPLITUDE_RANGE = (0.05, 30.0)      # of the screening size, for the start of a fit


@dataclass(frozen=True)
class Screened:
    """A candidate with its best start and the share of the squared errors it promises."""

    candidate: Candidate
    start: tuple
    promise: dict


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
    spaces = {cut.subsystem: _Space(problem, cut, near) for cut in problem.cuts}
    with ThreadPoolExecutor(default_workers()) as pool:
        return list(pool.map(lambda c: _best_start(problem, near, c, spaces), found))


def signature(problem, near, candidate, values, cut):
    """Return the change of a cut's errors that an effect makes, shape (N,)."""
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


def _best_start(problem, near, candidate, spaces):
    best = Screened(candidate, tuple(f.coordinate(f.scale) for f in candidate.free), {})
    for values in candidate.starts():
        promise, factors = {}, []
        for cut in problem.cuts:
            if not acts_on(candidate.effect, cut.subsystem):
                continue
            space = spaces[cut.subsystem]
            try:
                change = space.free_of_known(signature(problem, near, candidate, values, cut))
            except InputError:
                continue
            size = float(change @ change)
            if size <= 0.0:
                continue
            factor = -float(change @ space.left) / size
            if candidate.amplitudes:
                low = min(f.lower / values[f.name] for f in candidate.amplitudes)
                high = AMPLITUDE_RANGE[1]
                factor = float(np.clip(factor, max(low, -high), high))
            else:
                factor = float(np.clip(factor, 0.0, 1.0))
            left = space.left + factor * change
            promise[cut.subsystem] = 1.0 - float(left @ left) / float(space.left @ space.left)
            factors.append(factor)
        if sum(promise.values()) > sum(best.promise.values()):
            factor = factors[int(np.argmax(list(promise.values())))]
            if 0.0 <= factor < AMPLITUDE_RANGE[0]:
                factor = AMPLITUDE_RANGE[0]
            start = tuple(f.coordinate(values[f.name] * (1.0 if f.shape else factor))
                          for f in candidate.free)
            best = Screened(candidate, start, promise)
    return best

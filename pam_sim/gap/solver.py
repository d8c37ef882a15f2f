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
One least-squares problem: what an effect adds and the known numbers of the cuts it acts in.

Bounded, with a Gaussian prior on every known number and a wide one on every shape; weights
are lowered by misfit and memory until they agree with the errors.
"""

import numpy as np
from pam_sim.effects.registry import get_effect
from pam_sim.errors import InputError
from pam_sim.gap.cuts import acts_on
from pam_sim.gap.hypothesis import Found, Hypothesis
from pam_sim.gap.noise import autocorrelation_time
from scipy.optimize import least_squares

FREE_BOX = 60.0
HELD_BOX = 1e-3
SHAPE_SD = 2.0               # of the logarithm of a shape; where data say nothing, it is typical
FREE_SD = 30.0               # factor on the deviation of the prior of a freed number
EFFECT_STEP = 0.01           # of a parameter of an effect, relative
ROUNDS = 4
SETTLED = 0.3                # relative change of the weights that ends the rounds
EVALUATIONS = 12
FTOL, XTOL = 1e-3, 1e-2      # slopes of known numbers are from elsewhere; polishing does the rest
SCORE_BLOCKS = 4             # test blocks whose scores are summed
REFUSED = 1e3                # error of a model that cannot be simulated, in floors


def shows(effect, cut):
    """
    Return whether an effect changes the errors of a cut.

    What is read of the contraction, the volume behind the valve is taken from, too.
    """
    return (acts_on(effect, cut.subsystem)
            or get_effect(effect).fitting.sensor_signal == 'contraction')


def within_reach(hypothesis, known, cuts):
    """
    Return the cuts in which two hypotheses differ, or may be fitted otherwise because of that.

    An effect that shows in two cuts may be fitted otherwise in both. All, where nothing differs.
    """
    differ = Hypothesis(tuple(set(hypothesis.effects) ^ set(known.effects)),
                        tuple(set(hypothesis.freed) ^ set(known.freed)))
    found = [c for c in cuts if differ.touches(c) or any(
        shows(e.effect, c) for e in differ.effects)]
    for effect in hypothesis.effects * len(cuts):
        if any(shows(effect.effect, c) for c in found):
            found = [c for c in cuts if c in found or shows(effect.effect, c)]
    return found or cuts


class Solver:
    """
    One least-squares problem; x holds the effects' parameters, then each cut's numbers.

    Parameters
    ----------
    problem : Problem
        With the slopes for known numbers, the parts that are fitted and the box of numbers.
    hypothesis : Hypothesis
    cuts : list of Cut
        That are fitted.
    temper : dict of str -> numpy.ndarray
        By how much the weight of each signal is lowered at first, by subsystem.
    hold : bool
        Whether latency and skew of the measurement stay at their prior.

    """

    def __init__(self, problem, hypothesis, cuts, temper, hold=False):
        self.problem, self.hypothesis, self.cuts, self.temper = problem, hypothesis, cuts, temper
        self.free = [f for c in hypothesis.effects for f in c.free]
        self.owner = [c.effect for c in hypothesis.effects for _ in c.free]
        self.masks = {c.subsystem: np.isin(c.part, problem.use) for c in cuts}
        low = [f.coordinate(f.lower) for f in self.free]
        high = [f.coordinate(f.upper) for f in self.free]
        self.prior = [SHAPE_SD if f.shape else np.inf for f in self.free]
        for cut in cuts:
            lowest, highest = cut.bounds()
            for k, at_least, at_most in zip(cut.known, lowest, highest):
                freed = k.name in hypothesis.freed
                box = FREE_BOX if freed or not k.of_rig else problem.box
                if hold and k.unit == 's' and not k.of_rig:
                    box = HELD_BOX
                low.append(max(at_least, -box))
                high.append(min(at_most, box))
                self.prior.append(FREE_SD if freed else 1.0)
        self.bounds = (np.array(low, float), np.array(high, float))
        self.prior = np.array(self.prior)
        self._last = {}

    def join(self, theta, known_z):
        """Return what ``split`` takes apart."""
        return np.concatenate([theta] + [known_z[cut.subsystem] for cut in self.cuts])

    def split(self, x):
        """Return (parameters of the effects, [(subsystem, known numbers)])."""
        first, found = len(self.free), []
        for cut in self.cuts:
            found.append((cut.subsystem, x[first:first + len(cut.known)]))
            first += len(cut.known)
        return x[:len(self.free)], found

    def errors(self, x):
        """Return the errors of every touched cut, by subsystem."""
        key = x.tobytes()
        if self._last.get('key') != key:
            self._last = {'key': key, 'errors': self._simulated(x)}
        return self._last['errors']

    def _simulated(self, x, effect=None):
        """Return the errors of the cuts, or of those alone in which an effect shows."""
        theta, known = self.split(x)
        rig = self.problem.with_effects(Found(
            self.hypothesis, theta, {}, {}, {}).settings())
        return {s: cut_errors(cut, rig, z) for cut, (s, z) in zip(self.cuts, known)
                if effect is None or shows(effect, cut)}

    def residuals(self, x):
        """Return weighted errors, then the priors."""
        errors = self.errors(x)
        return np.concatenate([self._weighted(c, errors[c.subsystem]) for c in self.cuts]
                              + [x / self.prior])

    def slopes(self, x):
        """Return the derivatives of ``residuals``."""
        base, count = self.errors(x), len(self.free)
        columns = np.zeros((self.residuals(x).size, x.size))
        rows = columns.shape[0] - self.prior.size
        columns[rows:] = np.diag(1.0 / self.prior)
        for j in range(count):
            step = EFFECT_STEP * max(abs(x[j]), 0.3)
            if x[j] + step > self.bounds[1][j]:
                step = -step
            moved = np.array(x)
            moved[j] += step
            # An effect of one cut leaves the other one as it is.
            errors = {**base, **self._simulated(moved, self.owner[j])}
            columns[:rows, j] = np.concatenate([
                self._weighted(c, errors[c.subsystem] - base[c.subsystem])
                for c in self.cuts]) / step
        row, column = 0, count
        for cut in self.cuts:
            slope = self._weighted(cut, self.problem.slopes[cut.subsystem])
            columns[row:row + len(slope), column:column + len(cut.known)] = slope
            row, column = row + len(slope), column + len(cut.known)
        return columns

    def blocks(self):
        """Return the number of the block of every weighted error, rising, cut by cut."""
        found, first = [np.zeros(0, int)], 0
        for cut in self.cuts:
            found.append(first + cut.block[self.masks[cut.subsystem]] // SCORE_BLOCKS)
            first = int(found[-1].max()) + 1
        return np.concatenate(found)

    def run(self, x):
        """Return the solution from a start."""
        low, high = self.bounds
        if not x.size:
            return x
        margin = 1e-6 * (high - low)
        start = np.clip(x, low + margin, high - margin)
        return least_squares(self.residuals, start, self.slopes, (low, high), x_scale='jac',
                             ftol=FTOL, xtol=XTOL, max_nfev=EVALUATIONS).x

    def settle(self, x, rounds=ROUNDS):
        """Return (solution, errors by subsystem) once weights and errors agree."""
        for _ in range(rounds):
            x = self.run(x)
            errors = dict(self.errors(x))
            if self.retemper(errors):
                break
        return x, errors

    def retemper(self, errors):
        """Set the weights after the errors; return whether they had settled."""
        settled = True
        for cut in self.cuts:
            fresh = tempering(cut, errors[cut.subsystem], self.problem.use)
            old = self.temper[cut.subsystem]
            settled = settled and bool(np.all(np.abs(fresh / old - 1.0) < SETTLED))
            self.temper[cut.subsystem] = fresh
        return settled

    def _weighted(self, cut, errors):
        mask = self.masks[cut.subsystem]
        weight = 1.0 / np.sqrt(self.temper[cut.subsystem][cut.signal[mask]])
        return errors[mask] * (weight if errors.ndim == 1 else weight[:, np.newaxis])


def tempering(cut, errors, use):
    """Return by signal by how much its weight must fall: misfit times memory."""
    found = []
    for s in range(len(cut.signals)):
        chosen = errors[np.isin(cut.part, use) & (cut.signal == s)]
        found.append(max(float(np.mean(chosen ** 2)), 1.0) * autocorrelation_time(chosen))
    return np.array(found)


def cut_errors(cut, rig, known_z):
    """Return the errors of a cut; far off where the numbers cannot be simulated."""
    try:
        return cut.errors(rig, known_z)
    except InputError:
        return np.full(cut.part.size, REFUSED)

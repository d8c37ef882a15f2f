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
Fit a hypothesis: the model with some effects added and some numbers set free.

Bounded least squares of the cuts' errors with a Gaussian prior on every known number,
which stays within ``BOX`` deviations unless the hypothesis frees it. A cut the hypothesis
does not touch keeps its baseline. Errors of a model that still misses something are
neither white nor at the floor; their weight is tempered by misfit and memory, or
the known numbers would bend to hide what is missing.

Slopes with respect to the known numbers are taken once for all rivals of a step: they
change little, and each iteration costs only the parameters of the effects.
"""

import copy
from dataclasses import dataclass, replace

import numpy as np
from pam_sim.errors import InputError
from pam_sim.gap.cuts import acts_on
from pam_sim.gap.noise import autocorrelation_time
from pam_sim.gap.parts import FIT, SELECT
from pam_sim.gap.side_by_side import side_by_side
from scipy.optimize import least_squares

BOX = 3.5                    # prior deviations; beyond it a number is wrong, not inexact
FREE_BOX = 60.0
HELD_BOX = 1e-3
SHAPE_SD = 2.0               # of the logarithm of a shape; where data say nothing, it is typical
FREE_SD = 30.0               # factor on the deviation of the prior of a freed number
EFFECT_STEP = 0.01           # of a parameter of an effect, relative
ROUNDS = 4
BASE_PASSES = 2              # of the baseline, the second with slopes where the first ended
POLISHES = 4
WORTH_POLISHING = 0.8        # of the cost before; a fit that falls below goes on
SETTLED = 0.3                # relative change of the weights that ends the rounds
EVALUATIONS = 12
FTOL, XTOL = 1e-3, 1e-2      # slopes of known numbers are from elsewhere; polishing does the rest
SCORE_BLOCKS = 4             # test blocks whose scores are summed
UNTOUCHED = 1e-6             # inverse variance of a normalised number that nothing depends on
REFUSED = 1e3                # error of a model that cannot be simulated, in floors


@dataclass(frozen=True)
class Hypothesis:
    """``effects``: tuple of Candidate; ``freed``: names of numbers without their prior."""

    effects: tuple = ()
    freed: tuple = ()

    @property
    def names(self):
        """Return what a result calls it: effects, then numbers."""
        return tuple(c.name for c in self.effects) + self.freed

    @property
    def size(self):
        """Return how many numbers it adds to the fit."""
        return sum(len(c.free) for c in self.effects) + len(self.freed)

    def rows(self, place):
        """Return which of the normalised parameters are those of one effect, as a slice."""
        first = sum(len(c.free) for c in self.effects[:place])
        return slice(first, first + len(self.effects[place].free))

    def touches(self, cut):
        """Return whether it can change the errors of a cut."""
        return (any(acts_on(c.effect, cut.subsystem) for c in self.effects)
                or any(k.name in self.freed for k in cut.known))


@dataclass
class Found:
    """
    A fitted hypothesis.

    Attributes
    ----------
    hypothesis : Hypothesis
    theta : numpy.ndarray
        Normalised parameters of its effects, in order.
    known_z : dict of str -> numpy.ndarray
        Normalised known numbers, by subsystem of the cut.
    errors : dict of str -> numpy.ndarray
        Errors of all samples in floors, by subsystem.
    temper : dict of str -> numpy.ndarray
        By how much the weight of each signal is lowered, by subsystem.

    """

    hypothesis: Hypothesis
    theta: np.ndarray
    known_z: dict
    errors: dict
    temper: dict

    def values(self):
        """Return the parameters of each effect, in the order of the hypothesis."""
        return [{f.name: f.value(t) for f, t in zip(c.free, self.theta_of(place))}
                for place, c in enumerate(self.hypothesis.effects)]

    def theta_of(self, place):
        """Return the normalised parameters of one effect of the hypothesis."""
        return self.theta[self.hypothesis.rows(place)]

    def settings(self):
        """Return the effects as entries of a model file."""
        return [c.setting(v) for c, v in zip(self.hypothesis.effects, self.values())]


@dataclass(frozen=True)
class Precision:
    """
    How well what a hypothesis adds is known: theta, then freed numbers in deviations.

    Attributes
    ----------
    likelihood : numpy.ndarray, shape (K, K)
        Covariance by the tempered likelihood and the priors.
    blocks : numpy.ndarray, shape (K, K)
        Covariance by how much the scores of time blocks differ: errors that last through a
        block count once (White 1980, for clusters).
    held : numpy.ndarray, shape (K,)
        Solution with latency and skew of the measurement at their prior. What they took
        up of a delay may have been the effect's own.

    """

    likelihood: np.ndarray
    blocks: np.ndarray
    held: np.ndarray


class Problem:
    """
    The cuts of a rig, ready for hypotheses.

    Parameters
    ----------
    rig : pam_sim.Rig
        The given model.
    cuts : list of Cut
    use : tuple of int
        Parts that are fitted.

    """

    def __init__(self, rig, cuts, use=(FIT,)):
        self.rig, self.cuts, self.use, self.box = rig, cuts, use, BOX
        self.slopes = {}
        self.take_slopes([], {c.subsystem: np.zeros(len(c.known)) for c in cuts})
        self.base = self.fit_base()

    def take_slopes(self, effects, known_z, cuts=None):
        """Take the slopes of cuts, all by default, for their known numbers at a point."""
        rig = self.with_effects(effects)
        for cut in self.cuts if cuts is None else cuts:
            z = known_z[cut.subsystem]
            base = _errors(cut, rig, z)
            self.slopes[cut.subsystem] = np.column_stack(side_by_side(
                lambda j, cut=cut, z=z, base=base: (_errors(cut, rig, z + cut.known[j].step * (
                    np.arange(z.size) == j)) - base) / cut.known[j].step, range(z.size)))

    def _own(self, **changed):
        """Return a copy whose slopes and settings are its own; the cuts are the same."""
        own = copy.copy(self)
        own.slopes = dict(self.slopes)
        for name, value in changed.items():
            setattr(own, name, value)
        return own

    def _slopes_at(self, found):
        """Take the slopes at a fit, of the cuts that fitting it again looks at."""
        self.take_slopes(found.settings(), found.known_z,
                         [c for c in self.cuts if found.hypothesis.touches(c)])

    @property
    def simulations(self):
        """Return how many simulations were made so far."""
        return sum(cut.simulations for cut in self.cuts)

    def with_effects(self, effects):
        """Return the given model with entries of a model file added."""
        return self.rig.with_(effects=[*self.rig.effects, *effects])

    def fit(self, hypothesis, theta=(), near=None, hold=False):
        """
        Fit a hypothesis.

        Parameters
        ----------
        hypothesis : Hypothesis
            What the model has beyond the given one.
        theta : array_like
            Start of the normalised parameters of its effects.
        near : Found, optional
            Where known numbers, weights and untouched cuts start; the baseline by default.
        hold : bool
            Whether latency and skew of the measurement stay at their prior.

        Returns
        -------
        Found

        """
        near = near or self.base
        touched = [cut for cut in self.cuts if hypothesis.touches(cut)]
        # From full weight: a low one is its own reason, for it keeps the misfit that made it.
        search = _Search(self, hypothesis, touched, {
            c.subsystem: np.ones(len(c.signals)) for c in touched}, hold)
        # The baseline's numbers are bent by what is missing; a better model starts unbent.
        bent = near is self.base
        x = np.concatenate([np.asarray(theta, float)] + [
            (0.0 if bent else 1.0) * near.known_z[cut.subsystem] for cut in touched])
        x, errors = search.settle(x)
        theta, known_z = search.split(x)
        known_z, temper = dict(known_z), search.temper
        for cut in self.cuts:
            if cut not in touched:      # as it is without any effect
                s = cut.subsystem
                known_z[s], errors[s] = self.base.known_z[s], self.base.errors[s]
                temper[s] = self.base.temper[s]
        return Found(hypothesis, theta, known_z, errors, temper)

    def polish(self, found):
        """Return a fit that went on with slopes taken where it stands, as long as that helps."""
        own = self._own()
        for _ in range(POLISHES):
            own._slopes_at(found)
            again = own.fit(found.hypothesis, found.theta, found)
            before, after = self.cost(found), self.cost(again)
            found = again if after < before else found
            if after > WORTH_POLISHING * before:
                break
        return found

    def crossed(self, found):
        """Return the same hypothesis fitted to the part of the data that judges, from there."""
        return self._own(use=(SELECT,)).fit(found.hypothesis, found.theta, found)

    def unbent(self, found, box):
        """Return the best fit of the same hypothesis with numbers within ``box`` deviations."""
        own = self._own(box=box)
        return own.polish(own.fit(found.hypothesis, found.theta, found))

    def cost(self, found):
        """Return the mean squared error over the fitted parts, in floors squared, all cuts."""
        return sum(float(np.mean(found.errors[c.subsystem][np.isin(c.part, self.use)] ** 2))
                   for c in self.cuts)

    def precision(self, found):
        """Return the Precision of what a hypothesis adds, with slopes taken at the solution."""
        own = self._own()
        own._slopes_at(found)
        touched = [c for c in self.cuts if found.hypothesis.touches(c)]
        names, likelihood, blocks = own._covariances(found, touched)
        held = own.fit(found.hypothesis, found.theta, found, hold=True)
        count = len(found.theta)
        chosen = [*range(count), *(names.index(n) for n in found.hypothesis.freed)]
        z = np.concatenate([held.theta] + [held.known_z[c.subsystem] for c in touched])
        pick = np.ix_(chosen, chosen)
        return Precision(likelihood[pick], blocks[pick], z[chosen])

    def certainty(self, found, place):
        """
        Return by how many standard deviations the size of an effect differs from none.

        Its shapes are held: a size that is known only together with a shape is none the less
        there. Infinite for an effect of shapes alone, of which no value inside its
        range means none.
        """
        own = self._own()
        own._slopes_at(found)
        effect, first = found.hypothesis.effects[place], found.hypothesis.rows(place).start
        held = [first + j for j, f in enumerate(effect.free) if f.shape]
        size = [first + j for j, f in enumerate(effect.free) if not f.shape]
        touched = [c for c in self.cuts if found.hypothesis.touches(c)]
        _, *covariances = own._covariances(found, touched, held)
        theta = found.theta[size]
        return min((float(np.sqrt(theta @ np.linalg.pinv(c[np.ix_(size, size)]) @ theta))
                    for c in covariances if size), default=np.inf)

    def spread(self, found):
        """
        Return how uncertain a fit is: its parameters, then the known numbers of every cut.

        Returns
        -------
        covariances : list of numpy.ndarray, shape (K, K)
            By likelihood and by blocks, as of ``Precision``.
        at : callable
            ``at(j, step)``: the fit with number ``j`` moved by ``step``, not fitted again.

        """
        own = self._own()
        own.take_slopes(found.settings(), found.known_z)
        _, *covariances = own._covariances(found, self.cuts)
        search = _Search(self, found.hypothesis, self.cuts, dict(found.temper))
        x = np.concatenate([found.theta] + [found.known_z[c.subsystem] for c in self.cuts])

        def at(j, step):
            theta, known_z = search.split(x + step * (np.arange(x.size) == j))
            return replace(found, theta=theta, known_z=dict(known_z))

        return covariances, at

    def _covariances(self, found, cuts, held=()):
        """
        Return (names of all numbers, None for theta; covariance by likelihood; by blocks).

        Of the fit's own parameters and the numbers of ``cuts``; ``held`` are places that do not
        move.
        """
        search = _Search(self, found.hypothesis, cuts, dict(found.temper))
        x = np.concatenate([found.theta] + [found.known_z[c.subsystem] for c in cuts])
        slope, residuals, blocks = search.slopes(x), search.residuals(x), search.blocks()
        slope[:, list(held)] = 0.0
        # What the data do not touch is unknown, not certain.
        whole = np.linalg.inv(slope.T @ slope + UNTOUCHED * np.eye(x.size))
        scores = np.zeros((blocks.max(initial=0) + 1, x.size))
        np.add.at(scores, blocks, slope[:blocks.size] * residuals[:blocks.size, np.newaxis])
        priors = slope[blocks.size:]
        between = scores.T @ scores + priors.T @ priors
        names = [None] * len(found.theta) + [k.name for c in cuts for k in c.known]
        return names, whole, whole @ between @ whole

    def fit_base(self):
        """Return the baseline: known numbers fitted to the parts that are used now."""
        known = {c.subsystem: np.zeros(len(c.known)) for c in self.cuts}
        temper = {c.subsystem: np.ones(len(c.signals)) for c in self.cuts}
        for _ in range(BASE_PASSES):
            search = _Search(self, Hypothesis(), self.cuts, dict(temper))
            x, errors = search.settle(np.concatenate([known[c.subsystem] for c in self.cuts]))
            known, temper = dict(search.split(x)[1]), search.temper
            self.take_slopes([], known)
        return Found(Hypothesis(), np.zeros(0), known, errors, temper)


class _Search:
    """One least-squares problem; x holds the effects' parameters, then each cut's numbers."""

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
        """
        Return the errors of the cuts, or of those alone in which an effect acts.

        What is read of the contraction, the volume behind the valve is taken from, too.
        """
        theta, known = self.split(x)
        rig = self.problem.with_effects(Found(
            self.hypothesis, theta, {}, {}, {}).settings())
        return {s: _errors(cut, rig, z) for cut, (s, z) in zip(self.cuts, known)
                if effect is None or acts_on(effect, s) or effect.startswith('contraction')}

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

    def settle(self, x):
        """Return (solution, errors by subsystem) once weights and errors agree."""
        for _ in range(ROUNDS):
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


def _errors(cut, rig, known_z):
    """Return the errors of a cut; far off where the numbers cannot be simulated."""
    try:
        return cut.errors(rig, known_z)
    except InputError:
        return np.full(cut.part.size, REFUSED)

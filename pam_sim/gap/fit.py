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
from dataclasses import replace
from itertools import compress

import numpy as np
from pam_sim.gap.doubt import distance_to_none
from pam_sim.gap.hypothesis import Found, Hypothesis, Precision
from pam_sim.gap.parts import FIT, SELECT
from pam_sim.gap.side_by_side import side_by_side
from pam_sim.gap.solver import cut_errors, ROUNDS, shows, Solver, within_reach

BOX = 3.5                    # prior deviations; beyond it a number is wrong, not inexact
BASE_PASSES = 2              # of the baseline, the second with slopes where the first ended
BENT = 1.5                   # prior deviations; a fit starts without what bent the baseline more
POLISHES = 4
WORTH_POLISHING = 0.8        # of the cost before; a fit that falls below goes on
CROSSED_ROUNDS = 2           # they begin at a solution
UNTOUCHED = 1e-6             # inverse variance of a normalised number that nothing depends on


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
            base = cut_errors(cut, rig, z)
            self.slopes[cut.subsystem] = np.column_stack(side_by_side(
                lambda j, cut=cut, z=z, base=base: (cut_errors(cut, rig, z + cut.known[j].step * (
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
        self.take_slopes(found.settings(), found.known_z, self._touched(found.hypothesis))

    def _touched(self, hypothesis):
        return [cut for cut in self.cuts if hypothesis.touches(cut)]

    @property
    def simulations(self):
        """Return how many simulations were made so far."""
        return sum(cut.simulations for cut in self.cuts)

    def with_effects(self, effects):
        """Return the given model with entries of a model file added."""
        return self.rig.with_(effects=[*self.rig.effects, *effects])

    def fit(self, hypothesis, theta=(), near=None, hold=False, whole=True, rounds=ROUNDS):
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
        whole : bool
            False to leave the cuts as ``near`` has them in which nothing shows that it does not
            have, too.
        rounds : int
            At most so many times weights are set after the errors.

        Returns
        -------
        Found

        """
        near = near or self.base
        touched = self._touched(hypothesis)
        fitted = touched if whole else within_reach(hypothesis, near.hypothesis, touched)
        theta = np.array(theta, dtype=float)
        moves = [any(shows(c.effect, cut) for cut in fitted) for c in hypothesis.effects]
        part = Hypothesis(tuple(compress(hypothesis.effects, moves)), hypothesis.freed)
        free = np.array([m for c, m in zip(hypothesis.effects, moves) for _ in c.free], bool)
        # From full weight: a low one is its own reason, for it keeps the misfit that made it.
        search = Solver(self, part, fitted, {
            c.subsystem: np.ones(len(c.signals)) for c in fitted}, hold)
        # Numbers of the baseline are bent by what is missing; a better model starts unbent.
        x, errors = search.settle(search.join(theta[free], {
            s: np.where((near is self.base) & (np.abs(z) > BENT), 0.0, z)
            for s, z in near.known_z.items()}), rounds)
        theta[free], known_z = search.split(x)
        known_z, temper = dict(known_z), search.temper
        for cut in self.cuts:
            if cut not in fitted:       # untouched ones are as without any effect
                s, kept = cut.subsystem, near if cut in touched else self.base
                known_z[s], errors[s], temper[s] = kept.known_z[s], kept.errors[s], kept.temper[s]
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
        own = self._own(use=(SELECT,))
        if not found.hypothesis.names:
            return own.fit_base()
        return own.fit(found.hypothesis, found.theta, found, rounds=CROSSED_ROUNDS)

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
        touched = self._touched(found.hypothesis)
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
        there. The numbers that could stand in for it stay within their ranges: a latency is
        no longer than the longest. An effect of shapes alone, of which no value means none, is
        as certain as the best known of them, in relation to itself: a reservoir that may as well
        be twice as large is none that empties.
        """
        own = self._own()
        own._slopes_at(found)
        effect, first = found.hypothesis.effects[place], found.hypothesis.rows(place).start
        held = [first + j for j, f in enumerate(effect.free) if f.shape]
        size = [first + j for j, f in enumerate(effect.free) if not f.shape]
        touched = self._touched(found.hypothesis)
        if not size:
            _, *covariances = own._covariances(found, touched)
            return min(1.0 / np.sqrt(np.diag(c)[held].min()) for c in covariances)
        _, *covariances = own._covariances(found, touched, held)
        search = Solver(own, found.hypothesis, touched, dict(found.temper))
        x = search.join(found.theta, found.known_z)
        low, high = (np.delete(end, held) for end in search.bounds)
        none = np.isin(np.delete(np.arange(x.size), held), size)
        return min(distance_to_none(np.delete(np.delete(c, held, 0), held, 1),
                                    np.delete(x, held), none, low, high) for c in covariances)

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
        search = Solver(self, found.hypothesis, self.cuts, dict(found.temper))
        x = search.join(found.theta, found.known_z)

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
        search = Solver(self, found.hypothesis, cuts, dict(found.temper))
        x = search.join(found.theta, found.known_z)
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
            search = Solver(self, Hypothesis(), self.cuts, dict(temper))
            x, errors = search.settle(search.join(np.zeros(0), known))
            known, temper = dict(search.split(x)[1]), search.temper
            self.take_slopes([], known)
        return Found(Hypothesis(), np.zeros(0), known, errors, temper)

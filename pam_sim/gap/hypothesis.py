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

"""What a model may have beyond the given one, and what a fit of it found."""

from dataclasses import dataclass

import numpy as np
from pam_sim.gap.cuts import acts_on
from pam_sim.short_repr import short_repr


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


@short_repr
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

    def pulls(self, cut):
        """Return by name the normalised numbers of the rig in a cut that keep their prior."""
        return {known.name: float(z) for known, z in zip(cut.known, self.known_z[cut.subsystem])
                if known.of_rig and known.name not in self.hypothesis.freed}

    def settings(self):
        """Return the effects as entries of a model file."""
        return [c.setting(v) for c, v in zip(self.hypothesis.effects, self.values())]


@short_repr
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

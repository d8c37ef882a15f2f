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

from collections.abc import Sequence
from dataclasses import dataclass

from pam_sim.annotations import FloatArray
from pam_sim.gap.fit.candidate import Candidate, Setting
from pam_sim.gap.subsystems.effects import acts_on, shows
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.short_repr import short_repr


@dataclass(frozen=True)
class Hypothesis:
    """``effects``: tuple of Candidate; ``numbers``: names of numbers without their prior."""

    effects: tuple[Candidate, ...] = ()
    numbers: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Return what a result calls it: effects, then numbers."""
        return tuple(c.name for c in self.effects) + self.numbers

    @property
    def size(self) -> int:
        """Return how many numbers it adds to the fit."""
        return sum(len(c.free) for c in self.effects) + len(self.numbers)

    def rows(self, place: int) -> slice:
        """Return which of the normalised parameters are those of one effect, as a slice."""
        first = sum(len(c.free) for c in self.effects[:place])
        return slice(first, first + len(self.effects[place].free))

    def touches(self, problem: SubsystemProblem) -> bool:
        """Return whether it can change the errors of a subsystem."""
        return (any(acts_on(c.effect, problem.subsystem) for c in self.effects)
                or any(k.name in self.numbers for k in problem.known))


@short_repr
@dataclass
class Fit:
    """
    A fitted hypothesis.

    Attributes
    ----------
    hypothesis : Hypothesis
    theta : numpy.ndarray
        Normalised parameters of its effects, in order.
    known_z : dict of str -> numpy.ndarray
        Normalised known numbers, by subsystem of the subsystem.
    errors : dict of str -> numpy.ndarray
        Errors of all samples in floors, by subsystem.
    temper : dict of str -> numpy.ndarray
        By how much the weight of each signal is lowered, by subsystem.

    """

    hypothesis: Hypothesis
    theta: FloatArray
    known_z: dict[str, FloatArray]
    errors: dict[str, FloatArray]
    temper: dict[str, FloatArray]

    def values(self) -> list[dict[str, float]]:
        """Return the parameters of each effect, in the order of the hypothesis."""
        return [{f.name: f.value(t) for f, t in zip(c.free, self.theta_of(place))}
                for place, c in enumerate(self.hypothesis.effects)]

    def theta_of(self, place: int) -> FloatArray:
        """Return the normalised parameters of one effect of the hypothesis."""
        return self.theta[self.hypothesis.rows(place)]

    def prior_deviations(self, problem: SubsystemProblem) -> dict[str, float]:
        """Return by name the normalised numbers of the rig that keep their prior."""
        values = self.known_z[problem.subsystem]
        return {known.name: float(z) for known, z in zip(problem.known, values)
                if known.of_rig and known.name not in self.hypothesis.numbers}

    def settings(self) -> list[Setting]:
        """Return the effects as entries of a model file."""
        return [c.setting(v) for c, v in zip(self.hypothesis.effects, self.values())]


@short_repr
@dataclass(frozen=True)
class Precision:
    """
    How well a fit is known: theta, then the known numbers of every subsystem in deviations.

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
    ends : numpy.ndarray, shape (P, 2, K)
        All numbers at both ends of the 95 % interval of each of theta (``profile_ends``).

    """

    likelihood: FloatArray
    blocks: FloatArray
    held: FloatArray
    ends: FloatArray


def within_reach(hypothesis: Hypothesis, known: Hypothesis, problems: Sequence[SubsystemProblem]
                 ) -> Sequence[SubsystemProblem]:
    """
    Return the subsystems in which two hypotheses differ or are fitted otherwise.

    An effect that shows in two may be fitted otherwise in both. All, where nothing differs.
    """
    differ = Hypothesis(tuple(set(hypothesis.effects) ^ set(known.effects)),
                        tuple(set(hypothesis.numbers) ^ set(known.numbers)))
    found = [c for c in problems if differ.touches(c) or any(
        shows(e.effect, c) for e in differ.effects)]
    for effect in hypothesis.effects * len(problems):
        if any(shows(effect.effect, c) for c in found):
            found = [c for c in problems if c in found or shows(effect.effect, c)]
    return found or problems

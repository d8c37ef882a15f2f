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
Whether a subsystem leaves a gap that its noise cannot make, however its free run drifts.

Errors are averaged over half a second and over 20 ms. These means are compared with those that
noise, stamps and the drift of sensors make in the same run. What the numbers of the model may do
is taken out before.

A muscle behind on/off valves integrates the errors of its flow. Errors of stamps alone take its
free run far away, and a gap of the flow hides in that. Its errors count against their own mean
shortly before, so a test sees the flow and not where it led to. They must not follow the time,
the pressure, or a number of the valve that changes with either; ``flow`` has this test.

A recorded supply pressure is a witness of its own: where it moves, a model with a constant one
has a gap.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.effects.registry import get_effect
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.data.means import free_of, means_of, recent
from pam_sim.gap.data.noise import MAD_TO_SD, noise_of, STAMP_SD_S
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.split import FIT, SELECT
from pam_sim.gap.data.supply import DRIFT_SD, supply_scatter
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.verify.flow import Flow
from pam_sim.gap.verify.own_runs import OwnRuns
from pam_sim.rig import Rig

SLOW_S, FAST_S = 0.5, 0.02   # of the means that are compared with those of noise
MEMORY_S = 1.0               # of the mean before that errors behind on/off valves count against
DRAWS = 4
LEAST_STAMP_SD_S = 0.05e-3   # stamps as regular as that may be those of a clock, not of the valve


@dataclass(frozen=True)
class Notice:
    """
    Means of the errors of one signal.

    Parameters
    ----------
    subsystem, signal : str
        Of which.
    rms, expected : float
        Of the means, and of those that noise alone makes, in deviations of the sensor.
    deviations : float
        By how many standard deviations the errors of a flow follow something; 0 of the others.
    span_s : float
        Of the means.
    witness : str
        Another signal that shows the same errors, '' where none was asked.

    """

    subsystem: str
    signal: str
    rms: float
    expected: float
    deviations: float = 0.0
    span_s: float = SLOW_S
    witness: str = ''

    def is_gap(self, criteria: Criteria) -> bool:
        """Return whether noise cannot have made this."""
        beyond = math.sqrt(max(self.rms ** 2 - self.expected ** 2, 0.0))
        # What lasts shows with less; a quick gap must be as large as the noise.
        least = criteria.greater_part if self.span_s >= SLOW_S else criteria.hint_sd
        large = self.rms > criteria.likely_sd * self.expected and beyond > least
        if self.deviations > 0.0:        # of a flow: large alone is not enough, for it adds up
            return self.deviations > criteria.certain_size or (
                large and self.deviations > criteria.certain_sd)
        return large


def notices(runs: OwnRuns) -> list[Notice]:
    """
    Return what the recordings show that the calibrated model does not, signal by signal.

    Parameters
    ----------
    runs : OwnRuns
        Each subsystem on its own measured inputs, on the certify data. The searched data count as
        well where a flow is integrated.

    """
    estimator, found = runs.validation.estimator, runs.validation.base
    doubt = _doubt(estimator, found)
    tested = []
    for (problem, rig, known), searched in zip(runs.at(found), estimator.problems):
        here = _Certified(runs, problem, rig, known, doubt, np.random.default_rng(0))
        for signal in problem.signals:
            followed = 0.0
            if _integrates(problem, problem.recordings[0]):
                z = here.flow.follows(0, runs.chosen(problem, signal))
                flow, mine = Flow(searched, rig, found.known_z[searched.subsystem]), np.isin(
                    searched.part, (FIT, SELECT))
                followed = _most([z, *(flow.follows(index, mine & (searched.run == index))
                                       for index in range(len(searched.recordings)))])
            # Dealt out in short stretches, the certify data hold no long spans.
            if not (problem is searched and problem.is_dealt_short):
                tested.append(here.notice(signal, SLOW_S, followed))
            # When a valve opens is known no better than its pulses are long.
            if not _integrates(problem, problem.recordings[0]):
                tested.append(here.notice(signal, FAST_S))
    return tested


def _most(z: Sequence[FloatArray]) -> float:
    """Return the largest of some deviations, of recordings one by one and together."""
    told = np.array([one for one in z if one.size])
    if not told.size:
        return 0.0
    together = np.abs(told.sum(axis=0)) / math.sqrt(len(told))
    return float(max(np.abs(told).max(), together.max()))


def supply_notice(recording: Recording, rig: Rig, noise_pa: float, least: float
                  ) -> Notice | None:
    """
    Return the Notice of a recorded supply pressure that moves, None where it does not matter.

    Parameters
    ----------
    recording : Recording
        The certify data.
    rig : pam_sim.Rig
        The calibrated model, whose supply pressure is constant.
    noise_pa : float
        Standard deviation of the pressure sensor [Pa].
    least : float
        By how many of them the pressure must move for a gap to matter.

    """
    found = supply_scatter(recording)
    if found is None or any('supply' in get_effect(e.name).hooks for e in rig.effects):
        return None
    moved_pa, expected_pa, sd = found
    # The flow of a fill is proportional to the supply pressure, and so is what it moves.
    matters = moved_pa / rig.parameters['supply_pa'] * float(
        recording.measured['pressure'].std()) > least * noise_pa
    return Notice('valve', 'supply_pressure', moved_pa / sd, expected_pa / sd) if matters else None


def _integrates(problem: SubsystemProblem, recording: Recording) -> bool:
    return problem.subsystem == 'valve' and recording.valve == 'hsv'


def _doubt(estimator: Estimator, found: Fit) -> dict[str, float]:
    """Return how uncertain the numbers are, by name, in deviations of their prior."""
    covariances, _ = estimator.spread(found)
    names = [k.name for p in estimator.problems for k in p.known]
    spread = np.max([np.sqrt(np.diag(c)) for c in covariances], axis=0)[len(found.theta):]
    return {name: float(min(sd, 1.0)) for name, sd in zip(names, spread)}


class _Certified:
    """Means of the errors of a problem on the certify data, and what is expected of them."""

    def __init__(self, runs: OwnRuns, problem: SubsystemProblem, rig: Rig, known: FloatArray,
                 doubt: Mapping[str, float], random: np.random.Generator) -> None:
        self._runs, self._problem, self._random = runs, problem, random
        self.flow = Flow(problem, rig, known)
        base, self._errors, self._slopes = self.flow.base, self.flow.errors, self.flow.slopes
        self._limits = np.array([doubt.get(k.name, 1.0) if k.of_rig else 1.0
                                 for k in problem.known])
        self._draws = []
        for _ in range(DRAWS):
            problem.disturb(random)
            self._draws.append(problem.values(rig, known) - base)
        problem.shift_inputs(DRIFT_SD)
        self._drift = problem.values(rig, known) - base
        problem.disturb(None)

    def notice(self, signal: str, span_s: float, followed: float = 0.0) -> Notice:
        """Return the Notice of a signal, by its means over a span."""
        recording = self._problem.recordings[0]
        mine = (self._problem.run == 0) & (
            self._problem.signal == self._problem.signals.index(signal))
        inside = self._runs.chosen(self._problem, signal)[mine]
        time_s = self._problem.time_s[mine]
        noise = noise_of(recording.time_s[signal], recording.measured[signal])
        integrates = _integrates(self._problem, recording)

        def means(values: FloatArray) -> FloatArray:
            values = recent(values, time_s, MEMORY_S) if integrates else values
            return means_of(values, time_s, span_s, inside) / max(noise.sd, 1e-12)

        late = STAMP_SD_S * np.gradient(self.flow.base[mine], time_s)
        expected = float(np.mean([np.mean(means(
            d[mine] + noise.draw(time_s, self._random)
            + late * self._random.standard_normal(late.size)) ** 2) for d in self._draws]))
        expected += 0.0 if integrates else float(
            np.mean(means(self._drift[mine]) ** 2)) + DRIFT_SD ** 2
        left = free_of(means(self._errors[mine]), np.column_stack(
            [means(s[mine]) for s in self._slopes]), self._limits, expected)
        return Notice(self._problem.subsystem, signal, float(np.sqrt(np.mean(left ** 2))),
                      math.sqrt(expected), followed, span_s)


def stamp_sd_s(recording: Recording) -> float:
    """
    Return the standard deviation [s] of the stamps of the valve signal.

    Not more than by how much they scatter about even ones, as those of a loop are. ``STAMP_SD_S``
    where there is none.
    """
    if recording.pressure_given:
        return STAMP_SD_S
    steps = np.diff(recording.valve_stamps_s)
    usual = float(np.median(steps))
    # Of a difference of two; the median is blind to messages that are missing.
    scatter = MAD_TO_SD * float(np.median(np.abs(steps - usual))) / math.sqrt(2.0)
    return min(max(scatter, LEAST_STAMP_SD_S), STAMP_SD_S)

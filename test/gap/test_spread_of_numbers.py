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

"""Doubt about numbers, what the other subsystem says of a tie, and fits side by side."""

from gap_runs import nominal, recorded, voltages
import numpy as np
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.split import SELECT
from pam_sim.gap.fit.distance import distance_to_none
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select.candidates import candidates
from pam_sim.gap.select.ranking import Ranking
from pam_sim.gap.select.rival import Rival
from pam_sim.gap.subsystems.parallel import parallel_map
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.gap.verify.spread import spread_of_numbers
from pam_sim.gap.verify.validation import Validation
import pytest

TIME_S = np.arange(4000) * 0.005


class Given(Validation):
    """A calibrated model with one number, known within 1, that moves its run like ``form``."""

    def __init__(self, form):
        self.form, self.simulations, self.base, self.estimator = form, 0, None, self
        self.part = {'contraction': np.ones(TIME_S.size, dtype=bool)}
        self.refit = {'contraction': np.zeros(TIME_S.size)}

    def run(self, found):
        """Return the run with the number moved."""
        return {'contraction': self.refit['contraction'] + found * self.form}

    @staticmethod
    def spread(found):
        """Stand for the problem, too."""
        return [np.eye(1), np.eye(1)], lambda j, step: step


def test_a_number_that_one_motion_hardly_shows_leaves_doubt_in_another():
    validation = Given(3e-5 * np.cos(TIME_S))
    # Known within 1, it moves the run by its form; the rms of a cosine.
    spread = spread_of_numbers(validation)
    assert spread['contraction'] == pytest.approx(3e-5 / np.sqrt(2.0), rel=0.01)


@pytest.mark.parametrize('most', [np.inf, 1.0, 3.0])
def test_a_number_stands_in_for_an_effect_within_its_range_only(most):
    """Known together far better than each alone: 0.5 their sum, 2 the effect itself."""
    axes = np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2.0)
    covariance = axes.T @ np.diag([0.5 ** 2, 2.0 * 2.0 ** 2 - 0.5 ** 2]) @ axes
    x, none = np.array([4.0, 0.0]), np.array([True, False])
    free = distance_to_none(covariance, x, none, np.full(2, -np.inf), np.full(2, np.inf))
    assert free == pytest.approx(4.0 / np.sqrt(covariance[0, 0])) == pytest.approx(2.0)
    bounded = distance_to_none(covariance, x, none, np.zeros(2), np.array([9.0, most]))
    assert bounded >= free - 1e-9
    # The other goes where it does most, or as far as it may.
    best = min(np.sqrt(d @ np.linalg.inv(covariance) @ d) for d in (
        np.array([-4.0, w]) for w in np.linspace(0.0, min(most, 9.0), 2001)))
    assert bounded == pytest.approx(best, rel=1e-5)
    assert distance_to_none(covariance, x, np.array([True, True]), x, x) == pytest.approx(
        np.sqrt(x @ np.linalg.inv(covariance) @ x))


class Blocks(SubsystemProblem):
    """Sixty blocks of one signal that judge; nothing is simulated."""

    known, level = [], 1.0

    def __init__(self, subsystem, signal):
        self.subsystem, self.signals = subsystem, (signal,)
        self.block = np.repeat(np.arange(60), 100)
        self.part = np.full(self.block.size, SELECT)
        self.signal = np.zeros(self.block.size, dtype=int)


@pytest.mark.parametrize('in_valve, before, names', [
    (0.4, 0.0, ['threshold_pressure']), (0.0, 0.0, ['threshold_pressure', 'pressure_bias']),
    (0.05, 3.0, ['threshold_pressure', 'pressure_bias'])])
def test_a_tie_is_decided_where_one_of_the_two_does_harm(in_valve, before, names):
    problems = [Blocks('valve', 'pressure'), Blocks('muscle', 'contraction')]
    pool = {c.name: c for c in candidates(nominal(), ('pressure', 'contraction'))}
    noise = np.random.default_rng(1).standard_normal(6000)

    def found(name, valve, muscle):
        effects = (pool[name],) if name else ()
        return Fit(Hypothesis(effects), np.full(len(effects), 0.5),
                   {'valve': np.zeros(0), 'muscle': np.zeros(0)},
                   {'valve': noise + valve, 'muscle': noise + muscle}, {})

    class Tied:
        base, criteria = found(None, before, 5.0), CRITERIA
        cross_fit = polish = staticmethod(lambda found: found)

    Tied.problems = problems
    ranking = Ranking(Tied, Tied.base, 0.05)
    rivals = [Rival(name, found(name, valve, 0.0)) for name, valve in (
        ('threshold_pressure', before), ('pressure_bias', before + in_valve))]
    for r in rivals:
        r.share = ranking.shares(r.found)
    tied = ranking.tied(rivals, Tied.base, problems[1])
    assert sorted(r.name for r in tied) == sorted(names)


def test_fits_side_by_side_are_those_one_after_another():
    estimator = Estimator(nominal(), subsystem_problems(nominal(), [Recording(recorded(
        nominal().with_(effects=[{'name': 'parallel_spring', 'parameters': {}}]),
        voltages(12.0)), 'ppr')]))
    slopes = {s: of.copy() for s, of in estimator.slopes.items()}
    pool = [c for c in candidates(nominal(), ('contraction',))
            if c.effect in ('parallel_spring', 'bladder_stiffness', 'end_taper')]
    fits = [estimator.fit(Hypothesis((c,)), [0.5]) for c in pool]
    alone = [estimator.polish(f) for f in fits]
    for one, other in zip(alone, parallel_map(estimator.polish, fits)):
        assert np.array_equal(one.theta, other.theta)
        assert all(np.array_equal(one.errors[s], other.errors[s]) for s in one.errors)
    assert all(np.array_equal(estimator.slopes[s], slopes[s]) for s in slopes)

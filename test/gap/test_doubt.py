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

"""Doubt about numbers, what the other cut says of a tie, and fits side by side."""

from gap_runs import nominal, recorded, voltages
import numpy as np
from pam_sim.gap.candidates import candidates
from pam_sim.gap.choice import Choice, Rival
from pam_sim.gap.cuts import Cut, cuts_of
from pam_sim.gap.doubt import distance_to_none, spread_of_numbers
from pam_sim.gap.fit import Problem
from pam_sim.gap.free_run import Recording
from pam_sim.gap.hypothesis import Found, Hypothesis
from pam_sim.gap.parts import SELECT
from pam_sim.gap.prove import Proof
from pam_sim.gap.side_by_side import side_by_side
import pytest

TIME_S = np.arange(4000) * 0.005


class Given(Proof):
    """A calibrated model with one number, known within 1, that moves its run like ``form``."""

    def __init__(self, form):
        self.form, self.simulations = form, 0
        self.part = {'contraction': np.ones(TIME_S.size, dtype=bool)}
        self.refit = {'contraction': np.zeros(TIME_S.size)}

    def run(self, found, whole):
        """Return the run with the number moved."""
        return {'contraction': self.refit['contraction'] + found * self.form}

    @staticmethod
    def spread(found):
        """Stand for the problem, too."""
        return [np.eye(1), np.eye(1)], lambda j, step: step


def test_a_number_that_one_motion_hardly_shows_leaves_doubt_in_another():
    proof = Given(3e-5 * np.cos(TIME_S))
    # Known within 1, it moves the run by its form; the rms of a cosine.
    spread = spread_of_numbers(proof, Given, None, True)
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


class Blocks(Cut):
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
    cuts = [Blocks('valve', 'pressure'), Blocks('muscle', 'contraction')]
    pool = {c.name: c for c in candidates(nominal(), ('pressure', 'contraction'))}
    noise = np.random.default_rng(1).standard_normal(6000)

    def found(name, valve, muscle):
        effects = (pool[name],) if name else ()
        return Found(Hypothesis(effects), np.full(len(effects), 0.5),
                     {'valve': np.zeros(0), 'muscle': np.zeros(0)},
                     {'valve': noise + valve, 'muscle': noise + muscle}, {})

    class Tied:
        base = found(None, before, 5.0)
        crossed = polish = staticmethod(lambda found: found)

    Tied.cuts = cuts
    choice = Choice(Tied, Tied.base, 0.05)
    rivals = [Rival(name, found(name, valve, 0.0)) for name, valve in (
        ('threshold_pressure', before), ('pressure_bias', before + in_valve))]
    for r in rivals:
        r.share = choice.shares(r.found)
    tied = choice.tied(rivals, Tied.base, cuts[1])
    assert sorted(r.name for r in tied) == sorted(names)


def test_fits_side_by_side_are_those_one_after_another():
    problem = Problem(nominal(), cuts_of(nominal(), [Recording(recorded(
        nominal().with_(effects=[{'name': 'parallel_spring', 'parameters': {}}]),
        voltages(12.0)), 'ppr')]))
    slopes = {s: of.copy() for s, of in problem.slopes.items()}
    pool = [c for c in candidates(nominal(), ('contraction',))
            if c.effect in ('parallel_spring', 'bladder_stiffness', 'end_taper')]
    fits = [problem.fit(Hypothesis((c,)), [0.5]) for c in pool]
    alone = [problem.polish(f) for f in fits]
    for one, other in zip(alone, side_by_side(problem.polish, fits)):
        assert np.array_equal(one.theta, other.theta)
        assert all(np.array_equal(one.errors[s], other.errors[s]) for s in one.errors)
    assert all(np.array_equal(problem.slopes[s], slopes[s]) for s in slopes)

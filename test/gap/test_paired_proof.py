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

"""What stays in a set by its form alone, and what the certify data say of that."""

from types import SimpleNamespace

from gap_runs import nominal
import numpy as np
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select.candidates import candidates
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.verify.refutation import refute
from pam_sim.gap.verify.validation import Validation
import pytest

TIME_S = np.arange(4000) * 0.005
BY_NAME = {c.effect: c for c in candidates(nominal(), ('pressure', 'contraction', 'force'))}
NAMES = BEST, RIVAL = ('valve_dead_time', 'tube_lag')
MOVED, APART = 20.0 * np.sin(TIME_S), np.cos(TIME_S)     # the rival explains 99.75 %


def found_of(*names):
    effects = tuple(BY_NAME[n] for n in names)
    theta = np.concatenate([np.zeros(0), *(np.ones(len(c.free)) for c in effects)])
    return Fit(Hypothesis(effects), theta, {}, {'valve': np.zeros(1)}, {})


def set_after(behind_t=3.0, drift=0.0, number_sd=0.0, rest=0.0, left=0.0, truth=BEST):
    """Return the names that stay of the set of both."""
    runs = {(): 0.0 * MOVED, (BEST,): MOVED, (RIVAL,): MOVED + APART}
    validation = Validation.__new__(Validation)
    validation.recording = SimpleNamespace(
        signals=('pressure',), pressure_given=True,
        measured={'pressure': runs[truth,] + left * np.sin(9.0 * TIME_S) + np.random.default_rng(
            3).standard_normal(TIME_S.size)})
    validation.part = {'pressure': np.ones(TIME_S.size, dtype=bool)}
    validation.noise, validation.floor = {'pressure': 1.0}, {'pressure': 1.1}
    validation.simulations, validation.after = 0, {'pressure': MOVED}
    validation.drift = [{'pressure': 0.0 * MOVED}]
    validation.drift_with = lambda stamp_sd_s: [
        {'pressure': sign * drift * APART} for sign in (-1.0, 1.0)]
    validation.run = lambda found, whole: {'pressure': runs[found.hypothesis.names] + np.sum(
        found.theta - 1.0) * APART}
    fits = {n: found_of(n) for n in NAMES}
    best = fits[BEST]
    estimator = SimpleNamespace(
        criteria=CRITERIA, polish=lambda found: found,
        problems=[SimpleNamespace(subsystem='valve', chi2=lambda errors, part: 1.0 + rest)],
        spread=lambda found: ([np.array([[max(number_sd, 1e-6) ** 2]])] * 2,
                              lambda j, step: Fit(best.hypothesis, best.theta + step, {}, {}, {})))
    rivals = [Rival(BEST, best), Rival(RIVAL, fits[RIVAL], t={'valve': behind_t})]
    kept, _ = refute([NamedEffect(BEST, 'valve', rivals, NAMES)], estimator, found_of(),
                     best, validation, True)
    return kept[0].names


def test_what_a_form_alone_keeps_in_a_set_goes_where_the_best_leaves_nothing():
    assert set_after() == (BEST,)


@pytest.mark.parametrize('case', [
    {'behind_t': 2.0},              # the searched data do not leave it behind
    {'drift': 2.0},                 # stamps may move the errors that way
    {'number_sd': 2.0},             # and so may the numbers
    {'rest': 0.2}, {'left': 2.0},   # the best is not exact: in searched data, in the proof
    {'truth': RIVAL}])              # the proof says the rival
def test_it_stays_where_one_of_these_is_in_doubt(case):
    assert set(set_after(**case)) == set(NAMES)

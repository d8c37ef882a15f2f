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

"""What the certify data refuse, and what is too small for a name."""

from types import SimpleNamespace

from gap_runs import nominal
import numpy as np
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.split import SELECT
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select.backward import is_missed
from pam_sim.gap.select.candidates import candidates, is_limit_at
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.subsystems.known import SKEW_MAX_S
from pam_sim.gap.verify.materiality import is_material
from pam_sim.gap.verify.model import held_without
from pam_sim.gap.verify.refutation import refute, refuted_alone, unconfirmed
from pam_sim.gap.verify.validation import Validation
import pytest

SIGNALS = ('pressure', 'contraction', 'force')
BY_NAME = {c.effect: c for c in candidates(nominal(), SIGNALS)}
SAMPLES = 4000
NAMES = ('pressure_bias', 'threshold_pressure')


def found_of(*names):
    effects = tuple(BY_NAME[n] for n in names)
    theta = np.concatenate([np.zeros(0), *(np.ones(len(c.free)) for c in effects)])
    return Fit(Hypothesis(effects), theta, {}, {}, {})


@pytest.mark.parametrize('moved, apart, drift, left', [
    (2.0, 1.5, 0.1, NAMES[1:]),       # another course altogether
    (2.0, 1.5, 3.0, NAMES),           # the valve drifts that way by itself, too
    (1.0, 1.5, 3.0, NAMES[::-1]),     # and the errors fall with the other one alone
    (0.2, 1.5, 3.0, NAMES),           # by nothing that can be seen
    (20.0, 1.5, 0.1, NAMES),          # no formulation is that true
    (0.5, 0.2, 0.1, NAMES)])          # nothing can be seen
def test_a_name_of_a_set_goes_where_the_certify_data_contradict_it(moved, apart, drift, left):
    time_s = np.arange(SAMPLES) * 0.005
    truth = moved * np.sin(time_s)
    noise = np.random.default_rng(3).standard_normal(SAMPLES)
    fits = {n: found_of(n) for n in NAMES}
    runs = {(): 0.0 * truth, (NAMES[1],): truth, (NAMES[0],): truth + apart * np.cos(time_s)}
    validation = Validation.__new__(Validation)
    validation.drift = [{'contraction': sign * drift * np.cos(time_s)} for sign in (-1.0, 1.0)]

    class Given:
        signals, measured = ('contraction',), {'contraction': truth + noise}

    class Unchanged:
        criteria = CRITERIA
        polish = staticmethod(lambda found: found)

    validation.recording, validation.part = Given(), {'contraction': np.ones(SAMPLES, dtype=bool)}
    # Sine and cosine have half of the square.
    validation.noise = {'contraction': 1.0 / np.sqrt(2.0)}
    validation.run = lambda found: {'contraction': runs[found.hypothesis.names]}
    validation.estimator, validation.whole = Unchanged(), True
    validation.base, validation.final = found_of(), fits[NAMES[0]]
    named = [NamedEffect(NAMES[0], 'muscle', [Rival(n, f) for n, f in fits.items()], NAMES)]
    kept, final = refute(named, validation)
    assert kept[0].names == left and kept[0].name == left[0]
    assert final is fits[left[0]]


@pytest.mark.parametrize('t, rest, whole, goes', [
    (4.0, 0.0, True, True),      # two motions say so
    (4.0, 0.0, False, False),    # one motion in two parts: no formulation is that true
    (4.0, 3.0, True, False),     # what is left may be its doing
    (2.0, 0.0, True, False),     # the certify data alone
    (np.nan, 0.0, True, False)])
def test_a_name_that_both_motions_leave_behind_is_held_to_what_the_best_leaves(
        t, rest, whole, goes):
    time_s = np.arange(SAMPLES) * 0.005
    truth = 20.0 * np.sin(time_s)
    noise = np.random.default_rng(3).standard_normal(SAMPLES)
    runs = {(): 0.0 * truth, NAMES[:1]: truth, NAMES[1:]: truth + 1.5 * np.cos(time_s)}
    validation = Validation.__new__(Validation)
    validation.drift = [{'contraction': 0.1 * np.cos(time_s)}]
    validation.recording = SimpleNamespace(signals=('contraction',), measured={
        'contraction': truth + noise + rest * np.sin(7.0 * time_s)})
    validation.part = {'contraction': np.ones(SAMPLES, dtype=bool)}
    validation.noise, validation.floor = {'contraction': 1.0}, {'contraction': 1.1}
    validation.run = lambda found: {'contraction': runs[found.hypothesis.names]}
    validation.after = {'contraction': truth}
    rivals = [Rival(NAMES[0], found_of(NAMES[0])),
              Rival(NAMES[1], found_of(NAMES[1]), t={'muscle': t})]
    named = [NamedEffect(NAMES[0], 'muscle', rivals, NAMES)]
    validation.estimator = SimpleNamespace(criteria=CRITERIA, polish=lambda found: found)
    validation.base, validation.final, validation.whole = found_of(), rivals[0].found, whole
    kept, _ = refute(named, validation)
    assert kept[0].names == NAMES[:1 if goes else 2]


@pytest.mark.parametrize('spurious', NAMES)
def test_the_name_that_the_certify_data_confirm_least_goes_first(spurious):
    time_s = np.arange(SAMPLES) * 0.005
    truth, drift = 5.0 * np.sin(time_s), 8.0 * np.cos(time_s)
    noise = np.random.default_rng(4).standard_normal(SAMPLES)
    moves = {name: drift if name == spurious else truth for name in NAMES}
    validation = Validation.__new__(Validation)

    class Given:
        signals, measured = ('contraction',), {'contraction': truth + noise}

    class Refitted:
        criteria = CRITERIA
        fit = staticmethod(lambda left, theta, near: found_of(*left.names))

    validation.recording, validation.part = Given(), {'contraction': np.ones(SAMPLES, dtype=bool)}
    validation.noise = validation.floor = {'contraction': 1.0}
    validation.run = lambda found: {
        'contraction': sum((moves[n] for n in found.hypothesis.names), 0.0 * truth)}
    final = validation.final = found_of(*NAMES)
    validation.estimator, validation.base = Refitted(), found_of()
    validation.after = validation.run(final)
    validation.drift = [{'contraction': 0.0 * truth}]
    named = [NamedEffect(n, 'muscle', [], (n,)) for n in NAMES]
    name, left = unconfirmed(named, validation)
    assert name == spurious
    assert left.hypothesis.names == tuple(n for n in NAMES if n != spurious)
    # Where the valve may drift that way by itself, the fall tells nothing.
    validation.drift = [{'contraction': sign * drift} for sign in (-1.0, 1.0)]
    assert unconfirmed(named, validation) == (None, final)
    validation.drift = [{'contraction': 0.0 * truth}]
    # Beside what leaves far more, a small one is not judged.
    Given.measured = {'contraction': truth + noise + 50.0 * np.sin(7.0 * time_s)}
    assert unconfirmed(named, validation) == (None, final)
    Given.measured = {'contraction': truth + noise}
    # What is true stays; of what moves nothing that could be seen there, nothing is said.
    validation.final, validation.after = left, validation.run(left)
    true = [w for w in named if w.name != spurious]
    assert unconfirmed(true, validation) == (None, left)
    moves[true[0].name] = -0.01 * truth
    validation.after = validation.run(left)
    assert unconfirmed(true, validation) == (None, left)


@pytest.mark.parametrize('skew_s, left_s', [
    (1e-3, 0.0), (-1e-3, 0.0), (4e-3, 4e-3 - SKEW_MAX_S)])
def test_a_run_gets_the_skew_of_the_certify_recording_within_bounds(skew_s, left_s):
    time_s = np.arange(SAMPLES) * 0.005
    validation = Validation.__new__(Validation)

    class Given:
        measured = {'contraction': np.sin(3.0 * (time_s - skew_s))}

    Given.time_s = {'contraction': time_s}
    validation.recording, validation.part = Given(), {'contraction': np.ones(SAMPLES, dtype=bool)}
    run = {'contraction': np.sin(3.0 * time_s), 'pressure': time_s}
    aligned = validation._aligned(run, {'contraction': 0.0, 'force': 0.0})
    assert aligned['pressure'] is time_s
    error = aligned['contraction'] - Given.measured['contraction']
    slope = np.cos(3.0 * time_s) * 3.0
    assert float(np.sum(error * slope) / np.sum(slope ** 2)) == pytest.approx(left_s, abs=2e-5)


@pytest.mark.parametrize('own, refitted, found_again, is_so', [
    (4.0, 2.0, False, True),
    (4.0, 0.5, False, True),          # the numbers could hide most of it, but not all
    (4.0, 0.25, False, False),
    (4.0, 0.15, True, True),          # little is left, but that little is seen
    (4.0, 0.05, True, False),
    (0.1, 4.0, False, True),          # another motion; there the numbers it bent are wrong
    (0.5, 0.5, True, False)])
def test_an_effect_matters_by_what_it_moves_itself_or_what_nothing_replaces(
        own, refitted, found_again, is_so):
    assert is_material({'pressure': own}, {'force': refitted}, 1.0, found_again) == is_so


def test_effects_are_taken_out_while_the_numbers_stay():
    both = found_of('coulomb_friction', 'creep')
    left = held_without(both, ('creep',))
    assert left.hypothesis.names == ('creep',) and left.theta.size == len(BY_NAME['creep'].free)
    assert left.known_z is both.known_z
    assert held_without(both).hypothesis.names == () and held_without(both).theta.size == 0


@pytest.mark.parametrize('force_n, is_so', [(0.05, True), (1.0, False)])
def test_stiff_bristles_under_a_small_force_are_dry_friction(force_n, is_so):
    values = {'force_n': force_n, 'force_per_pa': 0.0, 'stiffness_n_per_m': 3e3}
    assert is_limit_at(BY_NAME['hysteresis_lugre'], values) == is_so
    assert not is_limit_at(BY_NAME['coulomb_friction'], {'force_n': force_n})


@pytest.mark.parametrize('harm', ['muscle', 'valve', None])
def test_an_effect_is_missed_in_whichever_cut_gets_worse_without_it(harm):
    class Judged:
        block = np.repeat(np.arange(40), 50)
        part, signal = np.full(2000, SELECT), np.zeros(2000, dtype=int)
        signals, level, known, criteria = ('contraction',), 1.0, [], CRITERIA
        is_dealt_short = False

        def __init__(self, subsystem):
            self.subsystem = subsystem

        def chi2(self, errors, part):
            return float(np.mean(errors ** 2))

    noise = np.random.default_rng(5).standard_normal(2000)
    problems = [Judged('valve'), Judged('muscle')]

    def errors(off):
        return Fit(Hypothesis(), np.zeros(0), {}, {
            c.subsystem: noise + off * (off == 5.0 or c.subsystem == harm) for c in problems}, {})

    given = SimpleNamespace(criteria=CRITERIA, first_gap={'valve': 25.0, 'muscle': 25.0},
                            least_gap=0.01, base=errors(5.0))
    missed = [c.subsystem for c in problems if is_missed(given, c, errors(0.0), errors(3.0))]
    assert missed == [harm] * (harm is not None)


@pytest.mark.parametrize('explained, drift, found', [
    (1.0, 0.1, True), (0.1, 0.1, False),        # a fall of 1, and of -0.8
    (1.0, 2.0, False)])                         # which the drift of a valve may make as well
def test_an_effect_is_found_again_where_the_drift_of_a_valve_cannot_make_the_errors_fall(
        explained, drift, found):
    time_s = np.arange(SAMPLES) * 0.005
    noise = np.random.default_rng(5).standard_normal(SAMPLES)
    validation = Validation.__new__(Validation)
    validation.estimator = SimpleNamespace(criteria=CRITERIA)
    validation.recording = SimpleNamespace(
        signals=('pressure',), measured={'pressure': explained * np.sin(time_s) + noise})
    validation.part = {'pressure': np.ones(SAMPLES, dtype=bool)}
    validation.noise = {'pressure': 1.0}
    validation.refit, validation.after = {'pressure': 0.0 * time_s}, {'pressure': np.sin(time_s)}
    validation.drift = [{'pressure': sign * drift * np.sin(time_s)} for sign in (-1.0, 1.0)]
    assert validation.finds_again() is found


@pytest.mark.parametrize('told, gone', [
    ((-1.0, 0.5, 0.1), True), ((0.9, 0.5, 0.1), False),       # a fall of none, of a true effect
    ((-1.0, 0.5, 0.9), False), ((-1.0, 0.1, 0.1), False)])    # in the noise; too small to be seen
def test_of_a_slow_log_the_run_of_the_valve_alone_refutes_its_names(told, gone):
    named = [NamedEffect(name, subsystem, [], (name,)) for name, subsystem in (
        ('tube_lag', 'valve'), ('creep', 'muscle'))]
    asked = []

    def fall(subsystem, worse, better):
        asked.append((subsystem, worse.hypothesis.names))
        return told

    refitted = SimpleNamespace(
        criteria=CRITERIA, fit=lambda left, theta, near: found_of(*left.names))
    name, left = refuted_alone(named, SimpleNamespace(fall=fall, validation=SimpleNamespace(
        estimator=refitted, base=found_of(), final=found_of('tube_lag', 'creep'))))
    assert asked == [('valve', ('creep',))]
    assert (name, left.hypothesis.names) == (
        ('tube_lag', ('creep',)) if gone else (None, ('tube_lag', 'creep')))

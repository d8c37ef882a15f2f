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

"""A model with effects is never worse on a signal of the certify run than the calibrated one."""

from types import SimpleNamespace

from gap_runs import assert_form, nominal, recorded, voltages
import numpy as np
from pam_sim.gap import find_gap
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.result import SignalGap
from pam_sim.gap.select.rival import NamedEffect
from pam_sim.gap.verify import harm
from pam_sim.gap.verify.validation import Validation
import pytest


def rig(friction_n, sticky_pa=0.0):
    effects = [{'name': 'coulomb_friction', 'parameters': {'force_n': friction_n}}]
    if sticky_pa:
        effects += [{'name': 'valve_hysteresis', 'parameters': {'half_width_pa': sticky_pa}}]
    return nominal().with_(effects=effects)


def test_what_makes_a_signal_worse_is_not_added_and_the_rest_is():
    """The regulator of the proof does not stick; its muscle rubs more than that of the search."""
    result = find_gap(
        recorded(rig(2.0, 1.5e3), voltages(16.0)), nominal(),
        recorded(rig(4.0), voltages(16.0, seed=5), seed=8),
        effects=['coulomb_friction', 'valve_hysteresis'], unnamed=())
    assert_form(result)
    assert [e['name'] for e in result.effects] == ['coulomb_friction']
    pressure, contraction = result.signals['pressure'], result.signals['contraction']
    # The valve is the calibrated one again, to the last bit.
    assert pressure.rmse_after == pressure.rmse_refit
    assert contraction.rmse_after < 0.8 * contraction.rmse_refit
    assert 'valve_hysteresis would raise the gap in pressure of the proof from' in result.reason
    assert result.reason.endswith('so it is not added.')
    assert 'valve_hysteresis' not in result.model_yaml and result.verdict == 'partial'
    assert result.subsystems['valve'].names == ()


def test_a_subsystem_without_a_name_stays_as_calibrated():
    run = recorded(rig(2.0, 1.5e3), voltages(16.0))
    result = find_gap(run, nominal(), effects=['coulomb_friction'])
    assert [e['name'] for e in result.effects] == ['coulomb_friction']
    own = result.subsystems['valve'].gap
    assert own.rmse_after == own.rmse_refit < own.rmse_before


def validation(after, drift_pa=0.0, noise=300.0, floor=300.0):
    """Return a Validation with errors of 3 kPa calibrated, and ``after`` kPa in the end."""
    found = object.__new__(Validation)
    time_s = np.linspace(0.0, 10.0, 2001)
    shape = np.sqrt(2.0) * np.sin(time_s * 2.0 * np.pi)
    found.recording = SimpleNamespace(
        signals=('pressure',), measured={'pressure': np.zeros(time_s.size)})
    found.part = {'pressure': np.ones(time_s.size, dtype=bool)}
    found.before = found.refit = {'pressure': 3e3 * shape}
    found.after = {'pressure': 1e3 * after * shape}
    found.drift = [{'pressure': sign * drift_pa * shape} for sign in (-1.0, 1.0)]
    found.noise, found.floor = {'pressure': noise}, {'pressure': floor}
    found.highest_floor = found.floor
    found.estimator = SimpleNamespace(criteria=CRITERIA)
    return found


@pytest.mark.parametrize('after, more, worse', [
    (2.9, {}, False), (3.0, {}, False), (3.1, {}, True), (3.1, {'drift_pa': 2e3}, False),
    (3.1, {'floor': 2.7e3}, False), (3.01, {}, False), (3.01, {'noise': 200.0}, True),
    (3.1, {'noise': 6e4}, False)])
def test_worse_is_what_noise_stamps_and_start_do_not_explain(after, more, worse):
    assert (validation(after, **more).worse() == ['pressure']) == worse


def test_two_gaps_that_take_turns_are_no_harm():
    turns = validation(3.1)
    # As large, at other places: the mean of the squares differs by chance.
    turns.after = {'pressure': np.roll(turns.after['pressure'], 50) * np.linspace(0.5, 1.4, 2001)}
    assert turns.signals()['pressure'].rmse_after > 3.0e3
    assert turns.worse() == []


NAMED = [NamedEffect(n, s, [], (n,)) for n, s in (
    ('tube_lag', 'valve'), ('creep', 'muscle'), ('mass_kg', 'muscle'))]
PROBLEMS = [SimpleNamespace(subsystem='valve', signals=('pressure',), known=[]),
            SimpleNamespace(subsystem='muscle', signals=('contraction', 'force'),
                            known=[SimpleNamespace(name='mass_kg')])]


@pytest.mark.parametrize('worse, stay, told', [
    ([[]], ['tube_lag', 'creep', 'mass_kg'], []),
    ([['pressure'], []], ['creep', 'mass_kg'], [('tube_lag',)]),
    ([['contraction'], []], ['tube_lag'], [('creep', 'mass_kg')]),
    ([['pressure'], ['force']], [], [('tube_lag',), ('creep', 'mass_kg')]),
    ([['force'], ['force']], [], [('creep', 'mass_kg'), ('tube_lag',)])])
def test_the_subsystem_of_the_signal_goes_back_to_the_calibrated_one(
        monkeypatch, worse, stay, told):
    rounds = iter(worse)

    def validated(final):
        now = next(rounds, [])
        return SimpleNamespace(
            worse=lambda: now, final=final, of=validated, estimator=estimator,
            signals=lambda: {s: SignalGap('', 1.0, 3.0, 2.0, 4.0) for s in now})

    def left(gone, validation):
        h = validation.final.hypothesis
        return Fit(Hypothesis(tuple(c for c in h.effects if c.name not in gone), tuple(
            n for n in h.numbers if n not in gone)), np.zeros(0), {}, {}, {})

    monkeypatch.setattr(harm, 'less', left)
    final = Fit(Hypothesis((Candidate('tube_lag', ()), Candidate('creep', ())), ('mass_kg',)),
                np.zeros(0), {}, {}, {})
    estimator = SimpleNamespace(problems=PROBLEMS)
    named, left_over, harms = harm.without_harm(NAMED, validated(final))
    assert [w.name for w in named] == stay == list(left_over.final.hypothesis.names)
    assert [one.names for one in harms] == told

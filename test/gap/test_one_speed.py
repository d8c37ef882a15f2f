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

"""Memory seen at one speed only is a set of creep and hysteresis, with a second speed to run."""

from types import SimpleNamespace

from gap_runs import assert_form, nominal, recorded
import numpy as np
from pam_actuation.experiments import load_experiment
from pam_actuation.report.gap import write_gap
from pam_sim.gap import find_gap
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.speeds import moves_at_one_speed, strokes
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select import memory
from pam_sim.gap.select.rival import NamedEffect
from pam_sim.located_yaml import dump_yaml
import pytest

MEMORY = ['creep', 'hysteresis']
TIME_S = np.arange(0.0, 24.0, 0.005)


def triangle(period_s, time_s=TIME_S):
    return np.abs(2.0 * np.mod(time_s / period_s, 1.0) - 1.0)


def loop(period_s, seconds=8.0):
    """Return a voltage per millisecond: a second of rest, then one triangle after another."""
    t = np.arange(int(seconds * 1000)) * 1e-3
    return np.where(t < 1.0, 3.0, 3.0 + 2.4 * (1.0 - triangle(period_s, t - 1.0)))


@pytest.mark.parametrize('path, one', [
    (triangle(8.0), True), (np.sin(1.3 * TIME_S), True),
    (triangle(8.0) + 0.1 * np.sin(9.0 * TIME_S), True),      # ripple is no stroke
    (np.where(TIME_S < 16.0, triangle(8.0), triangle(1.6)), False),
    (np.mod(TIME_S / 8.0, 1.0), False),                      # slow up, quick down
    (np.mod(TIME_S, 8.0) < 4.0, False),                      # rests after steps
    (np.clip(4.0 * triangle(8.0) - 1.5, 0.0, 1.0), False),
    (np.zeros(TIME_S.size), True)])
def test_a_second_speed_is_another_stroke_or_a_rest(path, one):
    noise = 0.002 * np.random.default_rng(1).standard_normal(TIME_S.size)
    recording = SimpleNamespace(
        time_s={'pressure': TIME_S}, measured={'pressure': path + noise * np.any(path)})
    assert moves_at_one_speed([recording], CRITERIA) == one


def test_a_second_recording_may_be_the_second_speed():
    slow, quick = (SimpleNamespace(time_s={'pressure': TIME_S}, measured={
        'pressure': triangle(period)}) for period in (8.0, 2.0))
    assert moves_at_one_speed([slow, slow], CRITERIA)
    assert moves_at_one_speed([quick], CRITERIA)
    assert not moves_at_one_speed([slow, quick], CRITERIA)


def test_the_speed_of_a_stroke_is_that_of_its_middle():
    assert strokes(TIME_S, 3.0 * triangle(8.0)) == pytest.approx([0.75] * 6, rel=0.03)


@pytest.fixture(scope='module', params=MEMORY)
def one_loop(request):
    rig = nominal().with_(effects=[{'name': request.param}])
    return request.param, rig, recorded(rig, loop(3.0))


def test_one_speed_gives_a_set_and_the_experiment_at_a_second_one(one_loop, tmp_path):
    truth, _, run = one_loop
    result = write_gap([run], nominal(), tmp_path / 'gap', effects=MEMORY)
    assert_form(result)
    assert result.verdict == 'ambiguous' and sorted(result.ambiguity_set) == MEMORY
    assert result.ambiguity_set[0] == truth
    assert 'only a second speed tells which it is' in result.reason
    assert result.subsystems['muscle'].verdict == 'ambiguous'
    assert result.next_experiment['name'] == 'tell_apart_speeds'
    experiment = load_experiment(dump_yaml(result.next_experiment['experiment']))
    periods = [s['triangle']['period_s'] for s in experiment.to_dict()['segments']
               if 'triangle' in s]
    assert max(periods) > 2.0 * min(periods)


def test_a_proof_at_the_same_speed_does_not_tell_and_a_second_speed_does(one_loop):
    truth, rig, run = one_loop
    same = find_gap(run, nominal(), recorded(rig, loop(3.0), seed=4), effects=MEMORY)
    assert same.verdict == 'ambiguous' and sorted(same.ambiguity_set) == MEMORY
    two = find_gap([run, recorded(rig, loop(0.8), seed=5)], nominal(), effects=MEMORY)
    assert two.verdict == 'effects' and two.ambiguity_set == [truth]


def test_what_may_not_be_tried_is_not_in_the_set(one_loop):
    truth, _, run = one_loop
    result = find_gap(run, nominal(), effects=[truth])
    assert result.verdict == 'effects' and result.ambiguity_set == [truth]


def test_both_in_the_model_are_one_set(monkeypatch):
    """Each is compared with the model that lacks it."""
    monkeypatch.setattr(memory, 'fit_without', lambda estimator, fit, name, put=None: Fit(
        Hypothesis(tuple(c for c in fit.hypothesis.effects if c.name != name)),
        np.zeros(0), {}, {}, {}))
    context = SimpleNamespace(
        estimator=SimpleNamespace(polish=lambda found: found), pool=(),
        ranking=SimpleNamespace(shares=lambda found: {'muscle': 0.9}))
    final = Fit(Hypothesis(tuple(Candidate(n, ()) for n in MEMORY)), np.zeros(0), {}, {}, {})
    named = [NamedEffect(n, 'muscle', [], (n,)) for n in (*MEMORY, 'mass_kg')]
    found = memory.as_sets(context, named, final)
    assert [sorted(w.names) for w in found] == [MEMORY, MEMORY, ['mass_kg']]
    assert [r.found.hypothesis.names for r in found[0].rivals] == [
        ('creep', 'hysteresis'), ('hysteresis',)]
    assert memory.as_sets(context, found, final) == found

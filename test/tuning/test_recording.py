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

"""What recordings say about a tuning: the model judged, the commands compared."""

from dataclasses import replace
import json

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.control.config import load_controller
from pam_actuation.control.tick import RUNNING
from pam_actuation.experiments.experiment import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.report.tuning_page import tuning_report
from pam_actuation.tuning.recording import check_recordings, counterfactual
from pam_actuation.tuning.tune import tune
from pam_sim import load_rig
from pam_sim.run import Run
import pytest


@pytest.fixture(scope='module')
def rig():
    return load_rig('dmsp_5_300_realistic')


@pytest.fixture(scope='module')
def run(rig, tmp_path_factory):
    bag = tmp_path_factory.mktemp('bags') / 'bag'
    controller = load_controller('sofc_ppr', rig)
    simulate_experiment(
        load_experiment('short_sine'), rig, controller, bag, learning=False)
    return load_run(bag)


def check(run, rig, controller):
    return check_recordings([run], rig, controller)[0]


def test_the_model_that_made_it_is_trusted_and_its_own_controller_agrees(run, rig):
    found = check(run, rig, load_controller('sofc_ppr', rig))
    assert found.model.verdict == 'trusted' and found.model.share < 0.01
    assert found.counterfactual.rms_pa == 0.0 and found.notes == ()
    assert 'trustworthy for tuning' in found.lines()[0]


def test_another_model_is_not_trusted_and_another_controller_differs(run, rig):
    wrong = rig.with_(parameters={'force_map_gain': 0.85})
    found = check(run, wrong, load_controller('pid_plain', rig))
    assert found.model.verdict == 'wrong' and found.model.signal == 'contraction'
    assert 'not trustworthy' in found.model.sentence()
    assert found.counterfactual.rms_pa > 1e3
    assert found.counterfactual.largest_pa >= found.counterfactual.rms_pa
    assert json.dumps(found.to_dict())


def test_both_shares_at_a_limit_are_of_the_ticks_with_usable_inputs(run, rig):
    """The ticks at the start, without a reference, count in neither; nor does the order."""
    states = run.topics['controller_state']
    used = np.isin(states.values['input_reason'], RUNNING)
    assert not used.all()
    limited = used & (states.values['tick'] >= 600)
    changed = states.values | {'saturated_high': limited.astype(float)}
    backwards = replace(states, stamp_ns=states.stamp_ns[::-1], values={
        name: column[::-1] for name, column in changed.items()})
    found = counterfactual(
        Run({**run.topics, 'controller_state': backwards}, run.metadata, '/muscle', 'changed'),
        load_controller('sofc_ppr', rig))
    assert found.ticks == used.sum()
    assert found.recorded_saturated == pytest.approx(limited.sum() / used.sum())


def test_what_a_recording_cannot_tell_is_a_note(run, rig):
    foreign = Run({name: run.topics[name] for name in ('pressure', 'contraction')},
                  {}, '/muscle', 'foreign')
    found = check(foreign, rig, load_controller('pid', rig))
    assert not found.model.valve_judged and found.model.verdict == 'trusted'
    assert found.model.sentence().endswith('so this says nothing of the valve.')
    assert found.counterfactual is None
    assert len(found.notes) == 1 and found.notes[0].startswith('No counterfactual check')
    silent = Run({'pressure': run.topics['pressure']}, {}, '/muscle', 'silent')
    found = check(silent, rig, load_controller('pid', rig))
    assert found.model is None and found.counterfactual is None
    assert len(found.notes) == 2 and all(note.startswith('No ') for note in found.notes)


def test_the_page_shows_search_rules_and_recordings(run, rig, tmp_path):
    experiment = load_experiment('short_sine')
    result = tune(rig, load_controller('sofc_untuned', rig), experiment, budget=20, seed=1)
    recordings = check_recordings([run], rig, result.controller)
    tuning_report(tmp_path / 'page.html', result, recordings, rig, [experiment], [run])
    page = (tmp_path / 'page.html').read_text()
    for words in ('held-out cost after', 'The searched motion with other noise',
                  'The initial rules', 'trustworthy for tuning', 'would have commanded',
                  'short_sine'):
        assert words in page, words

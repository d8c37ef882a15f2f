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

"""The second witness: binned maps of the errors, without any model of what is missing."""

import re

from gap_runs import nominal, recorded, voltages
import numpy as np
from pam_actuation.report.sections.gap import gap_section
from pam_sim.gap import find_gap
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.report.fingerprint import BinnedMap, CONDITIONS, conditions_of, explained
import pytest


@pytest.fixture(scope='module')
def conditions():
    """Return the conditions of a protocol at 200 Hz."""
    recording = Recording(recorded(nominal(), voltages(20.0)), 'ppr')
    return conditions_of(recording, 'muscle', np.arange(0.5, 19.5, 5e-3))


@pytest.mark.parametrize('strongest, errors', [
    ('direction', lambda c, t: 3.0 * c['direction']),
    ('rate', lambda c, t: 100.0 * c['rate']),
    ('pressure', lambda c, t: 3.0 * np.sin(c['pressure'] / 3e4)),
    ('contraction', lambda c, t: 3.0 * np.sin(c['contraction'] / 3e-3)),
    ('time since reversal', lambda c, t: 4.0 * np.exp(-c['time since reversal'] / 0.2))])
def test_a_map_finds_what_the_errors_depend_on(conditions, strongest, errors):
    time_s = np.arange(0.5, 19.5, 5e-3)
    learn = (time_s // 2.0) % 2 == 0
    noise = np.random.default_rng(1).standard_normal(time_s.size)
    shares = explained(conditions, errors(conditions, time_s) + noise, learn, ~learn)
    alone = {n: shares[n] for n in CONDITIONS}
    assert max(alone, key=alone.get) == strongest and alone[strongest] > 0.7
    # What depends on nothing measured is explained by no map.
    outside = 3.0 * np.sign(np.sin(7.3 * time_s ** 1.2))
    assert max(explained(conditions, outside + noise, learn, ~learn).values()) < 0.3
    assert explained(conditions, noise, learn, ~learn) is None


def test_times_since_reversal_start_anew_at_every_turn(conditions):
    since, direction = conditions['time since reversal'], conditions['direction']
    assert since.min() >= 0.0 and np.ptp(since) > 0.5
    turned = np.flatnonzero(direction[1:] * direction[:-1] < 0)
    assert turned.size and since[turned + 1].max() < 0.02


def test_a_bin_that_was_hardly_filled_predicts_nothing():
    model = BinnedMap([np.append(-np.ones(100), 1.0)], np.append(np.ones(100), 50.0))
    assert model.at([np.array([-1.0, 1.0])]) == pytest.approx([1.0, 0.0])


def test_friction_leaves_its_mark_in_direction_and_the_report_shows_it():
    rig = nominal().with_(effects=[
        {'name': 'coulomb_friction', 'parameters': {'force_n': 2.0}}])
    result = find_gap(recorded(rig, voltages(16.0)), nominal(), effects=['coulomb_friction'])
    found = result.to_dict()['fingerprint']['muscle']
    assert 'valve' not in result.fingerprint
    assert found['strongest'] == 'direction' and found['explained']['direction'] > 0.7
    assert found['unit'] == 'N' and found['rms'] > 4.0 * found['rms_left']
    page = gap_section(result).body
    assert 'What the gap depends on' in page and 'Residuals by condition' in page
    assert re.search('contracting', page)

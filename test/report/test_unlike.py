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

"""Runs on one page that differ in more than their controllers are told."""

import json

import numpy as np
from pam_actuation.cli.main import main
from pam_actuation.report.unlike import unlike, unlike_section
from pam_sim.run import Run, Series
import pytest

PID, SOFC = 'controller: pid\n', 'controller: sofc\n'


def run_of(controller=SOFC, tracks=True, **metadata):
    """Return a run with some metadata."""
    topics = {'reference' if tracks else 'pressure': Series(
        np.arange(3) * 10_000_000, {'contraction_m': np.zeros(3)})}
    return Run(topics, {'controller': controller, 'experiment_name': 'sine', **metadata},
               '/muscle', 'run')


@pytest.mark.parametrize('one, other, told', [
    (run_of(), run_of(), ''),
    (run_of(), run_of(PID), ''),
    (run_of(preview_s='0.6'), run_of(PID), ''),                     # as live
    (run_of(preview_s='0'), run_of(PID), 'reference told ahead 0 s (a), as live (b)'),
    (run_of(preview_s='0'), run_of(), 'reference told ahead 0 s (a), as live (b)'),
    (run_of(), run_of(PID, experiment_name='gait'), 'experiment sine (a), gait (b)'),
    (run_of(), run_of(experiment_name='gait'), ''),                 # one controller, two motions
    (run_of(tracks=False), run_of(PID, preview_s='0'), '')])
def test_what_differs_beside_the_controller_is_told(one, other, told):
    said = unlike([('a', one), ('b', other)])
    assert said.endswith(told) and bool(said) == bool(told)
    section = unlike_section([('a', one), ('b', other)])
    assert (section is None) == (not told)


def test_a_report_tells_of_a_preview_that_one_of_two_had(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for out, more in (('ahead', []), ('late', ['--preview', '0'])):
        assert main(['simulate', 'short_sine', '--controller', 'pid', '--out', out, *more]) == 0
    capsys.readouterr()
    assert main(['report', 'ahead', 'late', '--out', 'both.html', '--json']) == 0
    remarks = json.loads(capsys.readouterr().out)['remarks']
    assert sum('do not compare controllers alone' in one for one in remarks) == 1
    assert 'No comparison of controllers alone' in (tmp_path / 'both.html').read_text()

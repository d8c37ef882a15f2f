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

"""A run whose on/off valves are too small says so, with the number and what to do."""

import json

import numpy as np
from pam_actuation.cli.main import main
from pam_actuation.report.full_valves import full_valves
from pam_sim import load_rig
from pam_sim.run import Run, Series
import pytest


def run_of(share, rig=None, tracks=True):
    """Return a run with a valve fully open for a share of its messages."""
    stamp = np.arange(1000) * 4_000_000
    fill = (np.arange(1000) < 1000 * share).astype(float)
    topics = {'valve_signal': Series(stamp, {'fill_duty': fill, 'vent_duty': 0.0 * fill})}
    if tracks:
        topics['reference'] = Series(stamp, {'contraction_m': 0.01 * np.ones(1000)})
    return Run(topics, {} if rig is None else {'rig': rig.to_yaml()}, '/muscle', 'run')


@pytest.mark.parametrize('share, tracks, told', [
    (0.25, True, True), (0.05, True, False), (0.25, False, False)])
def test_a_valve_that_is_fully_open_for_long_in_tracking_is_told(share, tracks, told):
    assert bool(full_valves(run_of(share, tracks=tracks))) == told


def test_the_number_by_size_stands_beside_one_that_is_smaller():
    small = load_rig('dmsp_10_250_hanging_mass', valve='hsv').with_(parameters={'C': 2e-10})
    said = full_valves(run_of(0.25, small))
    assert said.startswith('a valve stood fully open for 25 % of the time, so the valves limit')
    assert 'larger valves (C is 2e-10 m3/(s Pa); 7e-10 by the size of the muscle)' in said
    preset = load_rig('dmsp_10_250_hanging_mass', valve='hsv')
    assert '(C is 7e-10 m3/(s Pa)), a higher supply' in full_valves(run_of(0.25, preset))
    assert 'larger valves, a higher supply' in full_valves(run_of(0.25))


def test_simulation_and_report_tell_it(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'small.yaml').write_text(
        'rig: dmsp_5_300_hanging_mass\nvalve: hsv\nparameters: {C: 3.0e-11}\n')
    for rig, told in (('small.yaml', 1), ('dmsp_5_300_hanging_mass', 0)):
        assert main(['simulate', 'short_sine', '--rig', rig, '--valve', 'hsv', '--controller',
                     'pid_hsv', '--out', 'bag', '--overwrite', '--json']) == 0
        remarks = json.loads(capsys.readouterr().out)['remarks']
        assert sum('fully open' in one for one in remarks) == told
        assert main(['report', 'bag', '--overwrite', '--json']) == 0
        assert sum('fully open' in one
                   for one in json.loads(capsys.readouterr().out)['remarks']) == told
        page = (tmp_path / 'report.html').read_text()
        assert ('Valves too small' in page) == bool(told)


def test_a_joint_is_told_of_the_valves_of_each_muscle(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    small = ('joint: joint_dmsp_5_300\nflexor: {rig: dmsp_5_300_driven, '
             'parameters: {C: 2.0e-11}}\nextensor: dmsp_5_300_driven\n')
    (tmp_path / 'small.yaml').write_text(small)
    for rig, told in (('small.yaml', 1), ('joint_dmsp_5_300', 0)):
        assert main(['simulate', 'joint_tuning', '--rig', rig, '--valve', 'hsv', '--out', 'bag',
                     '--overwrite', '--json']) == 0
        remarks = json.loads(capsys.readouterr().out)['remarks']
        said = [one for one in remarks if 'stood fully open' in one]
        assert len(said) == told
        assert main(['report', 'bag', '--out', 'page.html', '--overwrite', '--json']) == 0
        assert [one for one in json.loads(capsys.readouterr().out)['remarks']
                if 'stood fully open' in one] == said
        assert ('Valves too small' in (tmp_path / 'page.html').read_text()) == bool(told)
        for one in said:
            assert one.startswith('a valve of the flexor stood fully open')
            assert '(C is 2e-11 m3/(s Pa); ' in one and 'extensor' not in one

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
"""Test what ``pam run`` and ``pam up`` tell of a Ctrl-C before and after the rig is up."""

import json
from pathlib import Path

from pam_actuation.cli.main import main
import pytest

pytest.importorskip('rclpy')

from pam_actuation.bags.load import load_run                                # noqa: E402, I100
from pam_actuation.rigging import node_group, node_template, session, supervisor    # noqa: E402

pytestmark = pytest.mark.ros


def stop(*_, **__):
    raise KeyboardInterrupt


def test_a_run_that_is_stopped_before_it_records_names_no_bag(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(node_group.NodeGroup, 'change', stop)
    bag = tmp_path / 'bag'
    assert main(['run', 'short_sine', '--out', str(bag)]) == 130
    out, err = capsys.readouterr()
    assert (out, err) == ('nothing is recorded\n', 'pam run: stopped\n')
    assert not bag.exists()
    bag.mkdir()                     # of an earlier run, which was to be replaced
    assert main(['run', 'short_sine', '--out', str(bag), '--overwrite', '--json']) == 130
    assert json.loads(capsys.readouterr().out)['bag'] == ''


def test_a_run_that_is_stopped_later_names_its_bag(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(session.RigSession, 'run', stop)
    assert main(['run', 'short_sine', '--out', str(tmp_path / 'bag')]) == 130
    out, err = capsys.readouterr()
    assert err == 'pam run: stopped\n' and 'not completed: stopped by the user' in out
    bag = next(line for line in out.splitlines() if line.startswith('bag: ')).split()[1]
    assert Path(bag) == tmp_path / 'bag' and load_run(bag).topics


@pytest.mark.parametrize('recorded, whole, number, verb', [
    ({}, False, 'an unknown number of', 'info --recover'),
    ({'/a': 3}, False, '3', 'info --recover'), ({'/a': 3}, True, '3', 'report')])
def test_a_run_whose_recorder_failed_says_how_much_is_there(
        recorded, whole, number, verb, tmp_path, monkeypatch, capsys):
    bag = tmp_path / 'bag'
    bag.mkdir()
    if whole:
        (bag / 'metadata.yaml').touch()
    monkeypatch.setattr(node_template, 'prepare_template', lambda: None)
    monkeypatch.setattr(session, 'run_experiment', lambda *_, **__: session.Result(
        str(bag), failure='experiment_recorder ended', recorded=recorded))
    assert main(['run', 'short_sine', '--out', str(tmp_path / 'new')]) == 1
    first, *_, last = capsys.readouterr().out.splitlines()
    assert first.endswith(f': {number} messages recorded')
    assert last == f'next: pam {verb} {bag}'


def test_to_bring_nodes_up_is_interrupted_and_to_keep_them_up_is_ended(monkeypatch, capsys):
    with monkeypatch.context() as patch:
        patch.setattr(node_group.NodeGroup, 'change', stop)
        assert main(['up', 'rig']) == 130
    assert capsys.readouterr() == ('', 'pam up: stopped while the nodes started\n')
    monkeypatch.setattr(supervisor.Supervisor, 'watch', stop)
    assert main(['up', 'rig']) == 0
    out, err = capsys.readouterr()
    assert 'vented, all nodes ended in order' in out and err == ''

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

"""Test the demo where the computer stands still during a live run."""

import os

from pam_actuation import demo
from pam_actuation.rigging.session import Result
from pam_sim.errors import InputError
import pytest

SILENT = '/muscle/valve_watchdog: vented because the valve signal fell silent for 51 ms'


def live(monkeypatch, tmp_path, outcomes):
    """Let live runs have these outcomes; return the Demo and what it asked for."""
    asked = []

    def run_experiment(experiment, rig, controller, valve, out_dir, *, overwrite, **_):
        asked.append((os.path.basename(out_dir), overwrite))
        return outcomes.pop(0)

    def nothing_beside(jobs, calls):
        return (one for one in ({},))

    monkeypatch.setattr(demo, 'run_experiment', run_experiment)
    monkeypatch.setattr(demo, 'in_processes', nothing_beside)
    monkeypatch.setattr(demo, 'load_run', lambda bag: bag)
    return demo.Demo(tmp_path, quick=True), asked


def test_an_interrupted_live_run_is_made_once_more(monkeypatch, tmp_path):
    stalled = Result('first', findings=[SILENT], published={'/p': 5}, recorded={'/p': 5})
    one, asked = live(monkeypatch, tmp_path, [Result('ppr'), stalled, Result('second')])
    told = []
    one._live('ppr_learning', 'short_sine', True, told.append)
    one._live('hsv_learning', 'short_sine', True, told.append)
    assert asked == [('ppr_learning', False), ('hsv_learning', False), ('hsv_learning', True)]
    assert one.result.bags == {'ppr_learning': 'ppr', 'hsv_learning': 'second'}
    assert one.result.findings == [] and not one.result.busy
    said, = one.result.repeated
    assert said.startswith('HSV, learning: the first run was interrupted') and SILENT in said
    assert f'repeated: {said}' in one.result.text() and 'next: a live' not in one.result.text()
    assert one.result.to_dict()['repeated'] == [said]
    assert next(one._read['ppr_learning']) == {} and next(one._found) == {}    # nothing was lost


def test_a_live_run_that_is_interrupted_twice_is_a_finding_with_advice(monkeypatch, tmp_path):
    lost = Result('bag', published={'/p': 5}, recorded={'/p': 3})
    one, asked = live(monkeypatch, tmp_path, [lost, Result('bag', findings=[SILENT])])
    one._live('hsv_learning', 'short_sine', True, lambda share: None)
    assert len(asked) == 2
    assert one.result.findings == [f'HSV, learning: {SILENT}']
    assert '2 messages were not recorded' in one.result.repeated[0]
    assert 'close other programs, then start the demo again' in one.result.text()


@pytest.mark.parametrize('outcome, error', [
    (Result('', failure='valve_driver did not configure'), InputError),
    (Result('bag', failure='stopped by the user'), KeyboardInterrupt)])
def test_what_is_no_interruption_is_not_repeated(monkeypatch, tmp_path, outcome, error):
    one, asked = live(monkeypatch, tmp_path, [outcome])
    with pytest.raises(error):
        one._live('ppr_learning', 'short_sine', True, lambda share: None)
    assert len(asked) == 1


def test_a_node_that_ended_is_a_finding_at_once(monkeypatch, tmp_path):
    dead = Result('bag', failure='plant_simulator was ended by SIGKILL')
    one, asked = live(monkeypatch, tmp_path, [dead])
    one._live('ppr_learning', 'short_sine', True, lambda share: None)
    assert len(asked) == 1 and one.result.repeated == []
    assert one.result.findings == ['PPR, learning: plant_simulator was ended by SIGKILL']

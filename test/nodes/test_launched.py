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
"""How a launch file ends a rig: that of programs which stand in for its nodes."""

import json
from pathlib import Path
import sys

import pytest

launch = pytest.importorskip('launch')
pytest.importorskip('launch_ros')

from launch.actions import ExecuteProcess                                   # noqa: E402, I100
from launch.event_handlers import OnProcessExit                             # noqa: E402
from pam_actuation.nodes.launched import RigEnd                             # noqa: E402

KILLED = 'import os; os.kill(os.getpid(), 9)'
REFUSES = 'raise SystemExit(2)'
ENDS = 'pass'
RUNS = 'import time; time.sleep(60)'


def program(name, text):
    """Return what stands in for a node."""
    return ExecuteProcess(cmd=[sys.executable, '-c', text], name=name)


def launched(*actions):
    """Run a launch of some actions to its end."""
    service = launch.LaunchService()
    service.include_launch_description(launch.LaunchDescription(actions))
    assert service.run() == 0


@pytest.mark.parametrize('name, text, told', [
    ('valve_driver', KILLED, {'ended': 'error', 'because': 'valve_driver was ended by SIGKILL'}),
    ('plant_simulator', REFUSES, {
        'ended': 'error', 'because': 'plant_simulator ended with exit code 2'}),
    ('reference_generator', REFUSES, {
        'ended': 'error', 'because': 'reference_generator ended with exit code 2'}),
    ('valve_driver', ENDS, {'ended': 'interrupted', 'because': 'it ended'}),
    ('reference_generator', ENDS, None)])
def test_the_recorder_is_told_of_a_node_that_ended(name, text, told):
    end = RigEnd()
    nodes = program(name, text), program('experiment_recorder', RUNS)
    launched(*nodes, *end.handlers([(node, 'it ended') for node in nodes]))
    file = Path(end.notes_folder) / 'ended.json'
    assert (json.loads(file.read_text()) if file.exists() else None) == told


@pytest.mark.parametrize('whole', [True, False])
def test_a_rig_ends_the_whole_launch_or_its_own_nodes(whole):
    codes = {}
    end = RigEnd()
    end.shuts_launch_down = whole
    own = program('reference_generator', ENDS), program('valve_driver', RUNS)
    other = program('planner', 'import time; time.sleep(2.0)')
    noted = [launch.actions.RegisterEventHandler(OnProcessExit(
        target_action=one, on_exit=lambda event, _: codes.update(
            {event.process_name.rpartition('-')[0]: event.returncode})))
        for one in (*own, other)]
    launched(*own, other, *noted, *end.handlers([(node, 'it ended') for node in own]))
    assert codes['reference_generator'] == 0 and codes['valve_driver'] != 0
    assert (codes['planner'] == 0) is not whole

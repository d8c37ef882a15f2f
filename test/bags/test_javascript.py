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

"""Bags open and decode with the MCAP library for JavaScript, which this project did not write."""

import json
from pathlib import Path
import shutil
import subprocess

import pytest
from sample_bag import example_messages, full_name, METADATA, write_bag

FOLDER = Path(__file__).parent / 'javascript'
NODE = shutil.which('node')
COUNT = 30

pytestmark = [
    pytest.mark.skipif(NODE is None, reason='node is not installed'),
    pytest.mark.skipif(
        not (FOLDER / 'node_modules' / '@mcap').is_dir(),
        reason='the JavaScript libraries are missing: npm install in test/bags/javascript'),
]


@pytest.fixture(scope='module')
def found(tmp_path_factory):
    bag = write_bag(tmp_path_factory.mktemp('bags') / 'run', COUNT)
    done = subprocess.run(
        [NODE, str(FOLDER / 'read_bag.mjs'), str(bag / 'run_0.mcap')], capture_output=True,
        text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_every_message_is_decoded(found):
    counts = {name: topic['count'] for name, topic in found['topics'].items()}
    assert counts == {full_name(short): COUNT for short in example_messages()}


@pytest.mark.parametrize('place, i', [('first', 0), ('last', COUNT - 1)])
def test_values_are_those_written(found, place, i):
    wanted = example_messages(i)
    wire = {name.rsplit('/', 1)[-1]: topic[place] for name, topic in found['topics'].items()}
    for short in ('pressure', 'contraction', 'force', 'valve_signal', 'controller_state'):
        stamp = wire[short]['header']['stamp']
        assert stamp['sec'] * 10**9 + stamp['nanosec'] == wanted[short].stamp_ns
    assert wire['pressure']['fluid_pressure'] == wanted['pressure'].pressure_pa
    assert wire['contraction']['position'] == [wanted['contraction'].contraction_m]
    assert wire['contraction']['velocity'] == [wanted['contraction'].velocity_m_per_s]
    assert wire['force']['wrench']['force']['x'] == wanted['force'].force_n
    assert wire['valve_signal']['name'] == list(wanted['valve_signal'].names)
    assert wire['valve_signal']['effort'] == list(wanted['valve_signal'].efforts)
    assert wire['controller_state']['position'] == list(wanted['controller_state'].values)
    points = wire['reference_trajectory']['points']
    assert [point['positions'][0] for point in points] == list(
        wanted['reference_trajectory'].contraction_m)
    status, = wire['diagnostics']['status']
    assert status['name'] == '/muscle/valve_driver' and len(status['values']) == 2


def test_metadata_is_there(found):
    assert found['metadata']['pam_experiment'] == METADATA
    assert 'version: 9' in found['metadata']['rosbag2']['serialized_metadata']

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

"""A new topic is one row of the table: recorded, loaded, checked and documented by it alone."""

import json
import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROW = """
    Topic('muscle_temperature', Numbers(
        'sensor_msgs/msg/Temperature', messages.message_of('temperature_k'),
        (Value('temperature_k', 'temperature'),)), 'temperature of the bladder', (), (),
        limits={'temperature_k': (250.0, 400.0)}),
)
"""
# A copy would be compiled anew, and no number of this test depends on machine code.
INTERPRETED = {'NUMBA_DISABLE_JIT': '1'}
COPIED = ('pam_actuation', 'pam_sim', 'config', 'msg_docs', 'package.xml')
# What becomes of messages of the new topic, the last of them out of the limits.
RECORD = """
import json, sys
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from pam_actuation.bags.check import independent_readers
from pam_actuation.bags.info import bag_info
from pam_actuation.bags.load import load_run
from pam_actuation.bags.writer import BagWriter
from pam_actuation.topics import codec, table
from sample_bag import START_NS, STEP_NS, write_bag

def change(short, i, message):
    if short == 'muscle_temperature' and i == 19:
        message = type(message)(message.stamp_ns, 1e3)
    return message

folder = Path(sys.argv[1])
run = load_run(write_bag(folder / 'bag', 20, change=change))
series = run['muscle_temperature']
grid = run.on_grid(0.01)
renamed = load_run(folder / 'bag', topics={'muscle_temperature': '/muscle/muscle_temperature'})
info = bag_info(folder / 'bag')
print(json.dumps({
    'values': series['temperature_k'].tolist(), 'unit': series.unit,
    'on_grid': grid['muscle_temperature', 'temperature_k'][0],
    'renamed': len(renamed['muscle_temperature']), 'implausible': run.implausible,
    'ranges': info.topic('/muscle/muscle_temperature').ranges, 'remarks': info.remarks,
    'decoded': [counts['/muscle/muscle_temperature']
                for counts in independent_readers(folder / 'bag').values()]}))
"""
# A sensor that sends to the recorder, and the recorder.
LIVE = """
import sys, time
from pam_actuation.nodes.endpoints import CountedPublisher
from pam_actuation.nodes.ros_messages import class_of
from pam_actuation.rigging.client import local_context
from pam_actuation.topics.codec import Writer
from pam_actuation.topics.table import topic_of
from rclpy.node import Node

node = Node('sensor', namespace='/muscle', context=local_context(int(sys.argv[1])))
topic = 'muscle_temperature'
publisher, writer = CountedPublisher(node, class_of(topic), topic), Writer(topic)
deadline = time.monotonic() + 60.0
while not publisher.matched_with('/muscle/experiment_recorder'):
    assert time.monotonic() < deadline
    time.sleep(0.01)
for k in range(50):
    publisher.publish(writer.fill(topic_of(topic).content.message(time.time_ns(), 300.0 + k)))
    time.sleep(0.005)
assert publisher.wait_for_all_acked(5.0)
"""


@pytest.fixture(scope='module')
def house(tmp_path_factory):
    """Return a copy of the packages with one more row."""
    folder = tmp_path_factory.mktemp('house')
    for name in COPIED:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=shutil.ignore_patterns('__pycache__'))
        else:
            shutil.copy(source, folder)
    table = folder / 'pam_actuation' / 'topics' / 'table.py'
    text = table.read_text(encoding='utf-8')
    assert text.count('\n)\n\nBY_NAME') == 1
    table.write_text(text.replace('\n)\n\nBY_NAME', ROW + '\nBY_NAME'), encoding='utf-8')
    return folder


def run(house, *arguments, **options):
    """Run Python in the copy; return what it printed."""
    environment = {**os.environ, **INTERPRETED, 'PYTHONPATH': str(house),
                   **options.pop('environment', {})}
    done = subprocess.run(
        [sys.executable, *map(str, arguments)], cwd=house, env=environment, capture_output=True,
        text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def test_it_is_recorded_loaded_and_checked(house, tmp_path):
    found = json.loads(run(house, '-c', RECORD, tmp_path, ROOT / 'test' / 'bags').splitlines()[-1])
    assert found['values'] == [325.0] * 19 + [1e3] and found['unit'] == {'temperature_k': 'K'}
    assert (found['on_grid'], found['renamed'], found['decoded']) == (325.0, 20, [20, 20])
    assert found['ranges'] == {'temperature_k': [325.0, 1e3]}
    sentence = ('/muscle/muscle_temperature: temperature_k from 325 to 1000 leaves '
                '250 to 400 K.')
    assert found['implausible'] == [sentence] and sentence in found['remarks']


def test_it_is_documented(house):
    pages = house / 'msg_docs'
    before = {path.name: path.read_text(encoding='utf-8') for path in pages.iterdir()}
    run(house, '-m', 'pam_actuation.cli.main', 'nodes', '--topics', pages)
    after = {path.name: path.read_text(encoding='utf-8') for path in pages.iterdir()}
    changed = {name for name in after if after[name] != before.get(name)}
    assert changed == {'README.md', 'muscle_temperature.md'}
    assert '[`muscle_temperature`](muscle_temperature.md) | `sensor_msgs/msg/Temperature` | ' \
        'temperature of the bladder' in after['README.md']
    for text in ('`temperature` | K | 250 to 400 K | `temperature_k`', 'temperature: 250.0'):
        assert text in after['muscle_temperature.md']


@pytest.mark.ros
@pytest.mark.shared
def test_a_recorder_takes_it_and_says_so(house, tmp_path):
    pytest.importorskip('rclpy')
    from pam_actuation.bags.info import bag_info
    from pam_actuation.rigging.domain import DomainLock
    from pam_actuation.rigging.processes import node_environment
    shown = run(house, '-m', 'pam_actuation.cli.main', 'nodes', 'experiment_recorder')
    assert '| takes | `muscle_temperature` | `sensor_msgs/msg/Temperature` |' in shown
    lock = DomainLock()
    environment = {
        **node_environment(lock.domain_id, tmp_path), **INTERPRETED, 'PYTHONPATH': str(house)}
    recorder = subprocess.Popen(
        [sys.executable, '-m', 'pam_actuation.nodes.experiment_recorder', '--ros-args', '-r',
         '__ns:=/muscle', '-p', f'output:={tmp_path / "bag"}'], env=environment, cwd=house)
    try:
        run(house, '-c', LIVE, lock.domain_id, environment=environment)
    finally:
        recorder.terminate()
        assert recorder.wait(30.0) == 0
        lock.release()
    found = bag_info(tmp_path / 'bag').topic('/muscle/muscle_temperature')
    assert (found.type_name, found.count, found.lost) == ('sensor_msgs/msg/Temperature', 50, 0)

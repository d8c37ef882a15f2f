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

"""The layouts for Foxglove and PlotJuggler name only topics and fields that there are."""

import json
from pathlib import Path
import re
import xml.etree.ElementTree as ElementTree

from pam_actuation import resources
from pam_actuation.bags.load import load_run
from pam_actuation.bags.source import read_bag
from pam_actuation.messages import Force
from pam_actuation.topics.codec import encode
from pam_actuation.topics.definitions import typestore
from pam_actuation.topics.table import RECORDED
import pytest

ROOT = Path(__file__).resolve().parents[2]
LAYOUTS = ROOT / 'config' / 'layouts'
PINNED = ROOT / 'test' / 'replay' / 'pinned'
NAMESPACE = '/muscle/'


@pytest.fixture(scope='module')
def messages():
    """Return short topic name to one ROS message of every pinned bag that has the topic."""
    found = {}
    for path in sorted(PINNED.glob('*.mcap')):
        for name, topic in read_bag(path).topics.items():
            found.setdefault(name.rsplit('/', 1)[-1], []).append(
                typestore().deserialize_cdr(topic.payloads[-1], topic.type_name))
    raw = encode('external_force', Force(1, 2.0))
    found['external_force'] = [
        typestore().deserialize_cdr(raw, RECORDED['external_force'].type_name)]
    assert load_run(path).namespace + '/' == NAMESPACE
    return found


def foxglove():
    return json.loads((LAYOUTS / 'foxglove.json').read_text(encoding='utf-8'))


def foxglove_paths():
    """Return (topic, field path) of every line drawn."""
    paths = [line['value'] for panel in foxglove()['configById'].values()
             for line in panel.get('paths', ())]
    return [re.fullmatch(rf'{NAMESPACE}(\w+)\.(.+)', path).groups() for path in paths]


def plotjuggler_curves():
    """Return (topic, field path) of every curve."""
    tree = ElementTree.parse(LAYOUTS / 'plotjuggler.xml')
    names = [curve.get('name') for curve in tree.iter('curve')]
    return [re.fullmatch(rf'{NAMESPACE}(\w+)/(.+)', name).groups() for name in names]


def has_number(message, path):
    """Return whether a path such as ``wrench.force.x`` or ``effort[1]`` leads to a number."""
    for part in path.split('.'):
        name, _, index = part.partition('[')
        message = getattr(message, name, None)
        if index:
            place = int(index.rstrip(']'))
            message = message[place] if message is not None and place < len(message) else None
    return isinstance(message, float)


@pytest.mark.parametrize('topic, path', foxglove_paths())
def test_foxglove_lines_lead_to_numbers(messages, topic, path):
    assert (ROOT / 'msg_docs' / f'{topic}.md').is_file()
    assert any(has_number(message, path) for message in messages[topic])


@pytest.mark.parametrize('topic, path', plotjuggler_curves())
def test_plotjuggler_curves_lead_to_numbers(messages, topic, path):
    assert (ROOT / 'msg_docs' / f'{topic}.md').is_file()
    if RECORDED[topic].type_name == 'sensor_msgs/msg/JointState':
        # PlotJuggler sorts the entries of this message by their names.
        name, field = path.split('/')
        assert any(name in message.name and has_number(
            message, f'{field}[{message.name.index(name)}]') for message in messages[topic])
    else:
        assert any(has_number(message, path.replace('/', '.')) for message in messages[topic])


def test_both_show_the_same_topics():
    shown = {topic for topic, _ in foxglove_paths()} | {
        panel['topicPath'].removeprefix(NAMESPACE)
        for panel in foxglove()['configById'].values() if 'topicPath' in panel}
    assert shown == {topic for topic, _ in plotjuggler_curves()}
    assert shown == {name for name, topic in RECORDED.items() if topic.drawn}


def test_every_panel_of_foxglove_has_its_place():
    def places(node):
        return {node} if isinstance(node, str) else places(node['first']) | places(node['second'])

    assert places(foxglove()['layout']) == set(foxglove()['configById'])


def test_a_path_that_leads_nowhere_is_noticed(messages):
    assert not has_number(messages['pressure'][0], 'fluid_presure')
    assert not has_number(messages['contraction'][0], 'effort[0]')


def test_the_layouts_are_found_where_the_package_is_installed():
    folder = resources.config_dir() / 'layouts'
    assert {path.name for path in folder.iterdir()} == {'foxglove.json', 'plotjuggler.xml'}

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

"""The table of topics agrees with itself, with ROS's definitions and with the pages."""

from pathlib import Path
import re

from pam_actuation.models.topics import index, page, service_text
from pam_actuation.topics import cdr
from pam_actuation.topics.contents import Numbers
from pam_actuation.topics.definitions import typestore
from pam_actuation.topics.table import (
    BY_NAME, EVERY_NODE, JOINT, ONLOOKER, RECORDED, RECORDER, topic_of, TOPICS)
from pam_sim.errors import InputError
from pam_sim.run import HELD_TOPICS
import pytest

PAGES = Path(__file__).resolve().parents[2] / 'msg_docs'
NODES = {node for topic in TOPICS for node in (*topic.published_by, *topic.consumed_by, RECORDER)}


def nodes_in(text):
    """Return the nodes of this package that a text names."""
    return NODES & {*re.findall(r'`(\w+)`', text)}


def floats(type_name, prefix=''):
    """Return the paths of the float64 of a message type behind its header, in order."""
    found = []
    for name, (kind, detail) in typestore().fielddefs[type_name][1]:
        if name == 'header':
            continue
        if kind.name == 'NAME':
            found += floats(detail, f'{prefix}{name}.')
        else:
            assert (kind.name, detail[0]) == ('BASE', 'float64')
            found.append(f'{prefix}{name}')
    return tuple(found)


@pytest.mark.parametrize('type_name', cdr.STAMPED_NUMBERS)
def test_messages_of_numbers_are_those_of_ros(type_name):
    assert cdr.STAMPED_NUMBERS[type_name] == floats(type_name)


def test_names_are_unique_and_words_are_known():
    assert len(BY_NAME) == len(TOPICS)
    for topic in TOPICS:
        assert topic.place in ('muscle', 'joint', 'rig', 'root') and topic.meaning
        assert topic.need in ('needed', 'used', 'extra')
        # Told without the type store, which takes long to read.
        assert typestore().fielddefs[topic.type_name][1][0][0] == 'header'
        assert topic.missing in ('told', 'kept', 'allowed')
        if topic.numeric:
            assert set(topic.limits) <= set(topic.numeric.always)
        if isinstance(topic.content, Numbers):
            known = cdr.STAMPED_NUMBERS.get(topic.type_name, cdr.JOINT_FIELDS)
            assert {value.field for value in topic.content.values} <= set(known)


def test_a_series_is_held_as_its_name_alone_would_have_it():
    """A run that is made by hand knows no table."""
    assert set(HELD_TOPICS) == {topic.name for topic in TOPICS if topic.held}


def test_a_topic_is_found_by_the_end_of_its_name():
    assert topic_of('/left/flexor/pressure') is topic_of('pressure') is BY_NAME['pressure']
    assert BY_NAME['diagnostics'].full_name('/left') == '/diagnostics'
    assert BY_NAME['force'].full_name('/left') == '/left/force'
    with pytest.raises(InputError, match='/left/temprature: no topic of a rig; known are'):
        topic_of('/left/temprature')


def test_the_list_of_topics_is_current():
    text = (PAGES / 'README.md').read_text(encoding='utf-8')
    assert text == index(text), 'run: pam nodes --topics msg_docs'


@pytest.mark.parametrize('name', RECORDED)
def test_a_page_says_who_speaks_and_listens_and_the_quality_of_service(name):
    topic, page = RECORDED[name], PAGES / f'{name}.md'
    assert page.is_file(), 'run: pam nodes --topics msg_docs'
    text = page.read_text(encoding='utf-8')
    assert service_text(topic.service) in text
    speaks, listens = (re.search(rf'^\| {word} by \| (.*) \|$', text, re.M)[1]
                       for word in ('published', 'consumed'))
    assert nodes_in(speaks) == {*topic.published_by} - {EVERY_NODE, ONLOOKER}
    assert nodes_in(listens) == {*topic.consumed_by, RECORDER}


@pytest.mark.parametrize('name', [topic.name for topic in TOPICS if topic.place == JOINT])
def test_the_page_of_a_joint_lists_its_topics(name):
    text, topic = (PAGES / 'joint.md').read_text(encoding='utf-8'), BY_NAME[name]
    speaks, listens = re.search(
        rf'^\| `{name}` \| `{topic.type_name}` \| (.*?) \| (.*?) \|', text, re.M).groups()
    assert nodes_in(speaks) == {*topic.published_by}
    assert nodes_in(listens) == {*topic.consumed_by}


@pytest.mark.parametrize('name', [name for name in BY_NAME if name != 'diagnostics'])
def test_a_page_can_be_made_of_every_row(name):
    made = page(BY_NAME[name])
    assert BY_NAME[name].meaning in made and service_text(BY_NAME[name].service) in made
    for heading in ('## Fields', '## Rules', '## Quality of service', '## Example'):
        assert heading in made

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

"""Test that pages and access policies say what the nodes do."""

import itertools
from pathlib import Path
import re
import time
import xml.etree.ElementTree as ElementTree

import pytest

pytest.importorskip('rclpy')

from pam_actuation.messages import SAFE_EFFORTS, VALVE_NAMES, ValveSignal  # noqa: E402, I100
from pam_actuation.nodes.interfaces import Inspector, node_class, VARIANTS  # noqa: E402
from pam_actuation.nodes.pages import pages                                 # noqa: E402
from pam_actuation.nodes.policy import policy                               # noqa: E402
from pam_actuation.nodes.ros_messages import class_of                       # noqa: E402
from pam_actuation.rigging import layouts                                   # noqa: E402
from pam_actuation.rigging.client import local_context                      # noqa: E402
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
from pam_actuation.topics import table                                      # noqa: E402
from pam_actuation.topics.codec import Writer                               # noqa: E402
import rclpy                                                                # noqa: E402
from rclpy.node import Node                                                 # noqa: E402
from rclpy.parameter import Parameter                                       # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.shared]

ROOT = Path(__file__).resolve().parents[2]
POLICIES = {
    'rig': lambda: layouts.rig(valve='hsv', experiment='sine_quarter_hz', record='bag'),
    'exo': lambda: layouts.exo(valve='hsv')}
MARKED = {'rig': ['/muscle/marker'], 'exo': ['/left_knee/marker', '/right_knee/marker']}


@pytest.fixture(scope='module')
def made():
    return pages()


def test_every_executable_has_its_page(made):
    scripts = re.findall(r'(\w+) = pam_actuation\.nodes', (ROOT / 'setup.py').read_text())
    assert {f'{name}.md' for name in scripts} == set(made)
    assert {path.name for path in (ROOT / 'docs' / 'reference' / 'nodes').iterdir()} == set(made)


@pytest.mark.parametrize('name', VARIANTS)
def test_the_page_of_a_node_is_current(made, name):
    committed = (ROOT / 'docs' / 'reference' / 'nodes' / f'{name}.md').read_text(encoding='utf-8')
    assert committed == made[f'{name}.md'], 'run: pam nodes --markdown docs/reference/nodes'


def test_an_example_of_a_node_of_a_joint_stands_in_its_namespace(made):
    of_joint = [name for name in VARIANTS if name.startswith('joint_')]
    assert len(of_joint) == 3
    for name in of_joint:
        assert '__ns:=/knee ' in made[f'{name}.md'] and '/muscle/' not in made[f'{name}.md']
        assert "-p muscle:='knee'" in made[f'{name}.md']


def test_the_page_of_all_nodes_says_what_may_change_while_they_run():
    text = (ROOT / 'docs' / 'reference' / 'nodes.md').read_text(encoding='utf-8')
    said, = re.findall(r'can be set while a node runs: (.*?) The others', ' '.join(text.split()))
    live = {name: node_class(name).LIVE for name in VARIANTS}
    named = {*(name for name, own in live.items() if own), *itertools.chain(*live.values())}
    assert {*re.findall(r'`(\w+)`', said)} - {'configure', 'activate'} == named


def test_what_comes_with_certain_parameters_is_said_so(made):
    line, = re.findall(r'.*`valve_command`.*', made['valve_driver.md'].split('## Param')[0])
    assert '`accept_valve_command:=true`' in line
    assert '| serves | `~/pause` | `std_srvs/srv/SetBool` | `use_sim_time:=true` |' in (
        made['plant_simulator.md'])


def test_nodes_speak_and_listen_as_the_table_of_topics_says():
    with Inspector() as inspector:
        found = {name: inspector.whole_interface(name)[0] for name in VARIANTS}
    offered = {kind: {name: {table.short_name(topic): type_name
                             for topic, type_name in getattr(one, kind).items()}
                      for name, one in found.items() if name != table.RECORDER}
               for kind in ('publishes', 'subscribes')}
    for topic in (one for one in table.TOPICS if one.place != table.ROOT):
        for nodes, known in zip((topic.published_by, topic.consumed_by), offered.values()):
            there = {name for name in known if topic.name in known[name]}
            # The live page has no executable.
            assert there == set(nodes) - {table.ONLOOKER}, topic.name
            assert {known[name][topic.name] for name in there} <= {topic.type_name}


@pytest.mark.parametrize('name', POLICIES)
def test_the_policy_gives_the_nodes_what_they_need_and_no_more(name):
    text = (ROOT / 'config' / 'security' / f'{name}.policy.xml').read_text(encoding='utf-8')
    nodes = POLICIES[name]()
    assert text == policy(nodes), 'make it anew, see docs/guides/security.md'
    publishers, enclaves = {}, ElementTree.fromstring(text.encode()).findall('.//enclave')
    assert [enclave.get('path') for enclave in enclaves] == [
        *(f'{node.namespace}/{node.name}' for node in nodes), '/rig_session', '/operator',
        '/pam_view']
    called = [service.text for service in enclaves[-2].iterfind('.//service')]
    # The live page may stop and reset, and send markers of whole rigs.
    assert {service.text.rsplit('/', 1)[-1] for service in enclaves[-1].iterfind('.//service')
            } == {'emergency_stop', 'reset'}
    assert [topic.text for topic in enclaves[-1].iterfind(
        ".//topics[@publish='ALLOW']/topic")] == MARKED[name]
    for node in nodes:
        if node.name == 'valve_driver':
            assert {f'{node.namespace}/valve_driver/emergency_stop',
                    f'{node.namespace}/valve_driver/reset'} <= {*called}
    for profile in ElementTree.fromstring(text.encode()).iter('profile'):
        for topic in profile.findall("topics[@publish='ALLOW']/topic"):
            if not topic.text.startswith(('/', '~')):
                publishers.setdefault(f'{profile.get("ns")}/{topic.text}', set()).add(
                    profile.get('node'))
    for topic, who in publishers.items():
        if topic.endswith('/valve_signal'):
            assert who == {'valve_driver', 'valve_watchdog'}
        else:
            assert len(who) == 1, topic
    assert not any(topic.endswith('/clock') for topic in publishers)


@pytest.mark.parametrize(('name', 'parameters', 'kind', 'topic'), [
    ('plant_simulator', {}, 'publishes', 'supply_pressure'),
    ('valve_driver', {'hsv.correct_by_contraction': 0.8}, 'subscribes', 'contraction')])
def test_a_node_takes_the_valve_of_its_rig_file(tmp_path, name, parameters, kind, topic):
    file = tmp_path / 'lab.yaml'
    file.write_text('rig: dmsp_5_300_hanging_mass\nvalve: hsv\n')
    with Inspector() as inspector:
        of_rig, of_parameter = (getattr(inspector.interface(
            name, {**parameters, 'rig': str(file), **given}), kind)
            for given in ({}, {'valve_type': 'ppr'}))
    assert topic in of_rig and topic not in of_parameter


def test_the_driver_is_told_the_name_of_its_watchdog():
    safe = Writer('valve_signal').fill(ValveSignal(1, VALVE_NAMES['ppr'], SAFE_EFFORTS['ppr']))
    lock = DomainLock()
    context = local_context(lock.domain_id)
    driver = node_class('valve_driver')(
        context=context, namespace='/muscle', enable_rosout=False,
        parameter_overrides=[Parameter('watchdog', value='guard')])
    driver.trigger_configure()
    others = [Node(name, namespace='/muscle', context=context) for name in ('guard', 'other')]

    def told(node):
        """Return the fault, if any, and whether the driver heard that another one vents."""
        publisher = node.create_publisher(class_of('valve_signal'), 'valve_signal', 10)
        deadline = time.monotonic() + 0.4       # longer than a new writer may stay unnamed
        heard, fault = False, None
        while fault is None and time.monotonic() < deadline:
            publisher.publish(safe)
            time.sleep(0.01)
            driver.ear.listen()
            heard, fault = heard or driver.ear.vented, driver.ear.fault(driver.now_ns())
        return heard, fault and fault[1]

    try:
        assert told(others[0]) == (True, None)
        heard, sentence = told(others[1])
        assert heard and '/muscle/other as well as by this driver' in sentence
    finally:
        for node in (driver, *others):
            node.destroy_node()
        rclpy.try_shutdown(context=context)
        lock.release()


def test_a_node_that_cannot_be_configured_says_why():
    from pam_sim.errors import InputError
    with Inspector() as inspector, pytest.raises(InputError, match='dmsp_99'):
        inspector.interface('plant_simulator', {'rig': 'dmsp_99'})

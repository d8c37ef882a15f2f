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

"""Topics of a bag under names of its own: taken where they are named, refused in a sentence."""

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.topics import codec, definitions
from pam_actuation.topics.table import RECORDED
from pam_sim.errors import InputError
import pytest
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter
from sample_bag import example_messages, START_NS, STEP_NS

OTHER = {'contraction': '/robot/encoder', 'pressure': '/robot/p', 'force': '/robot/cell'}
COUNT = 20


@pytest.fixture(scope='module', params=list(StoragePlugin), ids=lambda plugin: plugin.name)
def bag(request, tmp_path_factory):
    """Return a bag with three topics under other names, a text, and a driver's signal."""
    directory = tmp_path_factory.mktemp('renamed') / request.param.name
    store = definitions.typestore()
    text = bytes(store.serialize_cdr(
        store.types['std_msgs/msg/String'](data='hello'), 'std_msgs/msg/String'))
    names = {**OTHER, 'valve_signal': '/muscle/valve_signal'}
    with RosbagsWriter(directory, version=9, storage_plugin=request.param) as writer:
        connections = {short: writer.add_connection(name, RECORDED[short].type_name,
                                                    typestore=store)
                       for short, name in names.items()}
        note = writer.add_connection('/robot/note', 'std_msgs/msg/String', typestore=store)
        writer.add_connection('/robot/empty', RECORDED['force'].type_name, typestore=store)
        for i in range(COUNT):
            messages = example_messages(i)
            for short, connection in connections.items():
                writer.write(connection, START_NS + i * STEP_NS,
                             codec.encode(short, messages[short]))
            writer.write(note, START_NS + i * STEP_NS, text)
    return directory


def test_topics_under_other_names_are_read_as_ours(bag):
    run = load_run(bag, topics=OTHER)
    assert {*OTHER, 'valve_signal'} == set(run.topics)      # the rest from the one namespace
    for short in OTHER:
        assert len(run[short]) == COUNT
    wanted = [example_messages(i)['pressure'].pressure_pa for i in range(COUNT)]
    np.testing.assert_array_equal(run['pressure']['pressure_pa'], wanted)
    # A slash in front may be missing.
    assert len(load_run(bag, topics={'contraction': 'robot/encoder'})['contraction']) == COUNT


@pytest.mark.parametrize('topics, words', [
    ({'presure': '/robot/p'}, ['`presure` is no topic of a run', 'did you mean `pressure`']),
    ({'pressure': '/robot/q'}, ['no topic /robot/q', '/robot/p', 'its topics']),
    ({'pressure': '/robot/note'}, ['/robot/note is std_msgs/msg/String',
                                   'sensor_msgs/msg/FluidPressure']),
    ({'contraction': '/robot/p'}, ['sensor_msgs/msg/JointState']),
    ({'force': '/robot/empty'}, ['/robot/empty has no messages']),
    ({'force': '/robot/cell', 'external_force': '/robot/cell'}, ['for two topics']),
    ({'force': ''}, ['needs the name of a topic'])])
def test_names_that_lead_nowhere_are_told_in_a_sentence(bag, topics, words):
    with pytest.raises(InputError) as told:
        load_run(bag, topics=topics)
    assert all(word in str(told.value) for word in words), told.value
    assert '\n' not in str(told.value)


def test_without_names_nothing_changes(bag):
    with pytest.raises(InputError, match='no messages on a pressure or contraction topic'):
        load_run(bag)

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

import shutil

import numpy as np
from pam_actuation.bags.info import bag_info
from pam_actuation.bags.load import load_run
from pam_actuation.bags.load_joint import load_recording
from pam_actuation.bags.metadata import names_of
from pam_actuation.bags.source import read_bag
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.replay.compare import replay_run
from pam_actuation.topics import codec, definitions
from pam_actuation.topics.table import RECORDED
from pam_sim import load_rig
from pam_sim.errors import InputError
import pytest
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter
from sample_bag import example_messages, START_NS, STEP_NS, write_bag
from sample_foreign import with_other_names

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


REMAPPED = {'/muscle/pressure': '/daq/p1', '/muscle/contraction': '/daq/enc1',
            '/muscle/valve_signal': '/daq/valve'}
SHORT = """
name: short
segments:
- rest: {duration_s: 0.2}
- sine: {center_m: 0.012, amplitude_m: 0.004, frequency_hz: 1.0, cycles: 1}
"""


def assert_same(run, other):
    assert set(run.topics) == set(other.topics) and run.namespace == other.namespace
    for short, series in run.topics.items():
        np.testing.assert_array_equal(series.stamp_ns, other[short].stamp_ns)
        for name, column in series.values.items():
            np.testing.assert_array_equal(column, other[short].values[name])


def test_a_rig_with_remapped_topics_is_read_by_the_names_that_its_recorder_tells(tmp_path):
    plain = write_bag(tmp_path / 'plain', 200)
    remapped = with_other_names(plain, tmp_path / 'remapped', REMAPPED)
    # Without metadata.yaml, as after a kill, the file alone tells the names.
    lone = shutil.copy(remapped / 'remapped_0.mcap', tmp_path / 'lone.mcap')
    for path in (remapped, lone):
        assert set(REMAPPED) <= set(read_bag(path).topics)
        assert read_bag(path).topics['/muscle/pressure'].recorded_name == '/daq/p1'
        for load in (load_run, load_recording):
            assert_same(load(path), load(plain))
            assert load(path).remarks == () and names_of(load(path).metadata) == REMAPPED
        info, as_plain = bag_info(path), bag_info(plain)
        assert info.remarks == []
        assert '/muscle/pressure is /daq/p1 in the bag.' in info.notes
        assert {(one.name, one.count) for one in info.topics} == {
            (one.name, one.count) for one in as_plain.topics}


def test_what_nodes_published_is_counted_by_the_names_they_use(tmp_path):
    def lose(short, i, message):
        return None if short == 'valve_signal' and 100 <= i < 110 else message
    plain = write_bag(tmp_path / 'plain', 200, change=lose)
    info = bag_info(with_other_names(plain, tmp_path / 'run', REMAPPED))
    # The nodes here still report the old name; of the new one nothing is known.
    assert info.topic('/muscle/valve_signal').published is None
    others = {'/muscle/valve_signal': '/muscle/signal', '/muscle/force': '/muscle/valve_signal'}
    info = bag_info(with_other_names(plain, tmp_path / 'swapped', others))
    assert info.topic('/muscle/force').published == 200


@pytest.mark.parametrize('told', [
    'no json', '[1]', '{"/muscle/pressure": 5}', '{"/muscle/pressure": "/not/there"}'])
def test_names_that_mean_nothing_change_nothing(tmp_path, told):
    bag = write_bag(tmp_path / 'run', 5, metadata={'valve': 'ppr', 'topic_names': told})
    assert len(load_run(bag)['contraction']) == 5


def test_a_remapped_recording_is_replayed_as_any_other(tmp_path):
    rig = load_rig('dmsp_5_300_realistic', valve='ppr')
    made = simulate_experiment(load_experiment(SHORT), rig, load_controller('sofc_ppr', rig),
                               tmp_path / 'plain')
    remapped = with_other_names(made['bag'], tmp_path / 'remapped', REMAPPED)
    result = replay_run(load_run(remapped))
    assert result.controller.identical and result.driver.identical

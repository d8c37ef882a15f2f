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

import json
import shutil

import numpy as np
from pam_actuation.bags.info import bag_info
from pam_actuation.bags.load import load_run
from pam_actuation.bags.load_joint import load_recording
from pam_actuation.bags.metadata import names_of
from pam_actuation.bags.source import read_bag
from pam_actuation.cli.main import main
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.replay.compare import replay_run
from pam_actuation.report.joint_gap import questions
from pam_actuation.topics import codec, definitions
from pam_actuation.topics.table import RECORDED
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.joint import load_rig_or_joint
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
    ({'contraction': '/robot/p'}, ['sensor_msgs/msg/JointState', 'pam import BAG --preview']),
    ([('pressure', '/robot/p')], ["is no mapping; write `{'pressure': '/robot/p'}`"]),
    ({'force': '/robot/empty'}, ['/robot/empty has no messages']),
    ({'force': '/robot/cell', 'external_force': '/robot/cell'}, ['for two topics']),
    ({'force': ''}, ['needs the name of a topic'])])
def test_names_that_lead_nowhere_are_told_in_a_sentence(bag, topics, words):
    with pytest.raises(InputError) as told:
        load_run(bag, topics=topics)
    assert all(word in str(told.value) for word in words), told.value
    assert '\n' not in str(told.value)


def test_without_names_the_refusal_gives_the_option(bag):
    with pytest.raises(InputError, match='no messages on a pressure or contraction topic') as told:
        load_run(bag)
    assert '`--topic pressure=/robot/p` reads it' in str(told.value)
    assert '`--topic contraction=/robot/encoder` reads it' in str(told.value)


REMAPPED = {'/muscle/pressure': '/daq/p1', '/muscle/contraction': '/daq/enc1',
            '/muscle/valve_signal': '/daq/valve'}
ANGLE = """
name: short_angle
domain: joint_angle
segments:
- rest: {duration_s: 0.5}
"""
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


@pytest.fixture(scope='module')
def silent(tmp_path_factory):
    """Return a bag with the same other names that does not say so, and its plain original."""
    folder = tmp_path_factory.mktemp('silent')
    plain = write_bag(folder / 'plain', 200)
    return with_other_names(plain, folder / 'other', REMAPPED, told=False), plain


OPTIONS = [word for name, other in REMAPPED.items()
           for word in ('--topic', f'{name.removeprefix("/muscle/")}={other}')]


def test_every_verb_that_reads_bags_takes_the_names(silent, tmp_path, capsys):
    bag = str(silent[0])
    more = {'tune': ['--out', str(tmp_path / 'tuned.yaml')],
            'identify': ['--rig', 'dmsp_5_300_hanging_mass'],
            'gap': ['--model', 'dmsp_5_300_hanging_mass', '--out', str(tmp_path / 'gap')],
            'characterise': ['--out', str(tmp_path / 'characterise')],
            'export': ['--out', str(tmp_path / 'table.csv')]}
    for verb in ('info', 'replay', 'report', 'gap', 'tune', 'identify', 'export', 'characterise',
                 'rules'):
        assert main([verb, bag, *more.get(verb, []), '--topic', 'pressure=/daq/p2']) == 2
        said = capsys.readouterr().err
        assert 'has no topic /daq/p2 (did you mean `/daq/p1`?)' in said, (verb, said)
    assert not list(tmp_path.iterdir())


def test_the_option_reads_what_goes_by_other_names(silent, tmp_path, capsys):
    bag, plain = map(str, silent)
    names = dict(word.split('=') for word in OPTIONS if '=' in word)
    assert_same(load_run(bag, topics=names), load_run(plain))
    assert main(['info', bag, '--json', *OPTIONS]) == 0
    info = json.loads(capsys.readouterr().out)
    assert info['namespaces'] == ['/muscle'] and info['remarks'] == []
    tables = []
    for path, options in ((bag, OPTIONS), (plain, [])):
        out = tmp_path / f'{len(tables)}.csv'
        assert main(['export', path, '--out', str(out), *options]) == 0
        tables.append(out.read_bytes())
    assert tables[0] == tables[1]
    question, = questions('dmsp_5_300_hanging_mass', bag, None, names)
    assert_same(question.load(bag), load_run(plain))


@pytest.mark.parametrize('words, said', [
    (['pressure'], "'pressure' is not NAME=TOPIC, such as pressure=/daq/p1"),
    (['=/daq/p1'], 'is not NAME=TOPIC'), (['pressure='], 'is not NAME=TOPIC'),
    (['pressure=/daq/p1', 'pressure=/daq/p1'], 'pressure is given twice'),
    (['presure=/daq/p1'], '`presure` is no topic of a run (did you mean `pressure`?)'),
    (['pressure=/daq/enc1'], '/daq/enc1 is sensor_msgs/msg/JointState'),
    (['pressure=/daq/p1', 'supply_pressure=/daq/p1'], '/daq/p1 is given for two topics')])
def test_mistakes_in_the_option_are_told_in_a_sentence(silent, capsys, words, said):
    options = [part for word in words for part in ('--topic', word)]
    try:
        code = main(['replay', str(silent[0]), *options])
    except SystemExit as ended:
        code = ended.code
    assert code == 2 and said in capsys.readouterr().err


def test_a_topic_of_ours_gives_way_to_the_one_that_is_named(silent):
    run = load_run(silent[1], topics={'pressure': '/muscle/supply_pressure'})
    assert (run['pressure']['pressure_pa'] == 8.0e5).all() and 'supply_pressure' not in run
    info = bag_info(silent[1], topics={'pressure': '/muscle/supply_pressure'})
    assert info.topic('/muscle/pressure (replaced)').count == 200


def test_topics_of_a_joint_have_their_place_in_the_name(tmp_path):
    plain = simulate_experiment(
        load_experiment(ANGLE), rig := load_rig_or_joint('joint_dmsp_5_300_realistic'),
        load_controller('sofc_joint_ppr', rig), tmp_path / 'plain')['bag']
    other = with_other_names(plain, tmp_path / 'other', {
        '/knee/flexor/pressure': '/daq/p1', '/knee/joint_state': '/daq/angle'}, told=False)
    with pytest.raises(InputError, match='both muscles of the joint /knee but no joint_state'):
        load_recording(other)
    run = load_recording(other, topics={'flexor/pressure': '/daq/p1', 'joint_state': '/daq/angle'})
    assert_same(run, load_recording(plain))
    with pytest.raises(InputError, match='choose a muscle with --namespace'):
        questions('joint_dmsp_5_300', other, None, {'pressure': '/daq/p1'})
    question, = questions('joint_dmsp_5_300', other, '/knee/flexor', {'pressure': '/daq/p1'})
    assert_same(question.load(other), load_run(plain, '/knee/flexor'))


def test_info_says_how_the_topics_of_a_joint_are_read(tmp_path, capsys):
    plain = simulate_experiment(
        load_experiment(ANGLE), rig := load_rig_or_joint('joint_dmsp_5_300_realistic'),
        load_controller('sofc_joint_ppr', rig), tmp_path / 'plain')['bag']
    other = str(with_other_names(plain, tmp_path / 'other', {
        '/knee/flexor/pressure': '/daq/p1', '/knee/extensor/pressure': '/daq/p2',
        '/knee/joint_state': '/daq/angle'}, told=False))
    hints = ('joint_state=/daq/angle', 'flexor/pressure=/daq/p1', 'extensor/pressure=/daq/p2')
    for options in ((), ('--namespace', '/knee')):
        assert main(['info', other, *options]) == 1
        said = capsys.readouterr().out
        assert '/knee has no messages on joint_state: the analyses of a joint need it.' in said
        assert all(f'`--topic {hint}` reads it' in said for hint in hints), said
        assert '`--topic pressure=' not in said
    with pytest.raises(InputError, match='`--topic joint_state=/daq/angle` reads it'):
        load_recording(other)
    options = [word for hint in hints for word in ('--topic', hint)]
    assert main(['info', other, '--namespace', '/knee', *options]) == 0
    assert 'has no messages on' not in capsys.readouterr().out

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

"""What is odd in a recording stands beside every answer that rests on it."""

from dataclasses import replace
import json
import shlex

from mcap.writer import Writer
import numpy as np
from pam_actuation import messages
from pam_actuation.bags.info import bag_info
from pam_actuation.bags.load import load_run
from pam_actuation.bags.load_joint import load_recording
from pam_actuation.bags.oddities import recording_remarks, stray
from pam_actuation.bags.source import read_bag
from pam_actuation.bags.writer import BagWriter, EXPERIMENT_RECORD
from pam_actuation.cli.main import main
from pam_actuation.topics import cdr
from pam_actuation.topics.codec import decode, encode
from pam_actuation.topics.table import BY_NAME
from pam_sim.errors import InputError
import pytest
from sample_bag import START_NS, write_bag

PRESSURE, CONTRACTION = '/muscle/pressure', '/muscle/contraction'
# What is done to the pressure, the sentence and whether messages are lost.
SPOILED = {
    'damaged': ('messages are not sensor_msgs/msg/FluidPressure, left out', True),
    'stepped': (f'{PRESSURE}: the stamp goes back once, by up to 5', False),
    'ahead': (f'{PRESSURE}: the stamp goes ahead once, by up to 3.6e+03 s more', False),
    'unstamped': (f'{PRESSURE}: no message has a header stamp', False)}


def spoiled_message(how, data, k, count):
    """Return a serialised pressure, number ``k`` of ``count``, that is spoiled."""
    if how == 'damaged':
        return data[:12] if k % 50 == 7 else data
    one = decode('pressure', data)
    stamp_ns = one.stamp_ns
    if how == 'stepped':
        stamp_ns -= 5_000_000_000 * (k > count // 2)
    elif how == 'ahead':
        stamp_ns += 3_600_000_000_000 * (k > count // 2)
    else:
        stamp_ns = 0
    return encode('pressure', messages.Pressure(stamp_ns, one.pressure_pa))


def spoiled_bag(bag, how, directory, leave_out=''):
    """Copy a bag with a spoiled pressure; return its folder."""
    old = read_bag(bag)
    with BagWriter(directory, {EXPERIMENT_RECORD: old.experiment}) as writer:
        for name, topic in old.topics.items():
            if name == leave_out:
                continue
            writer.add_topic(name, topic.type_name)
            for k, (log_ns, data) in enumerate(zip(topic.log_time_ns.tolist(), topic.payloads)):
                if name == PRESSURE:
                    data = spoiled_message(how, data, k, len(topic.payloads))
                writer.write(name, data, log_ns, log_ns)
    return directory


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    """Return a dict of a simulated bag, 'whole', and of its copies by how they are spoiled."""
    folder = tmp_path_factory.mktemp('bags')
    assert main(['simulate', 'short_sine', '--rig', 'dmsp_5_300_hanging_mass', '--out',
                 str(folder / 'whole')]) == 0
    return {'whole': folder / 'whole', **{
        how: spoiled_bag(folder / 'whole', how, folder / how) for how in SPOILED}}


def asked(verb, bag, folder):
    """Return the arguments of a verb about a bag, with results in ``folder``."""
    return [str(word) for word in {
        'replay': ('replay', bag, '--only', 'plant'),
        'report': ('report', bag, '--out', folder / 'page.html'),
        'rules': ('rules', bag), 'export': ('export', bag, '--out', folder / 'table.csv'),
        'gap': ('gap', bag, '--seconds', 1, '--effects', 'coulomb_friction',
                '--out', folder / 'gap'),
        'identify': ('identify', bag, '--rig', 'dmsp_5_300_hanging_mass', '--unknown', 'mass_kg',
                     '--out', folder / 'identify'),
        'tune': ('tune', bag, '--rollouts', 10, '--patience', 1, '--out', folder / 'tuned.yaml'),
    }[verb]]


VERBS = {'replay': '', 'report': 'page.html', 'rules': '', 'export': '', 'gap': 'gap/report.html',
         'identify': 'identify/report.html', 'tune': 'tuned.html'}


@pytest.mark.parametrize('how, verb', [
    *(('damaged', verb) for verb in VERBS),
    # All tell by the same function.
    *((how, verb) for how in ('stepped', 'unstamped')
      for verb in ('replay', 'report', 'rules', 'export')), ('ahead', 'export')])
def test_every_verb_tells_what_is_odd(bags, how, verb, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr('pam_actuation.cli.gap.SAID_EVERY_S', 0.0)
    page, (sentence, lost) = VERBS[verb], SPOILED[how]
    for form in ([], ['--json', '--overwrite']):
        arguments = asked(verb, bags[how], tmp_path)
        code = main([*arguments, *form])
        shown, progress = capsys.readouterr()
        told = json.loads(shown)['remarks'] if form else shown.splitlines()
        assert ('gap: 84 % after' in progress) == (verb == 'gap' and not form)
        assert sum(sentence in one for one in told) == 1
        assert code == 1 or not lost
    if page:
        assert (tmp_path / page).read_text().count(sentence) == 1
    if verb == 'gap':
        told = json.loads((tmp_path / 'gap' / 'gap.json').read_text())['remarks']
        assert sum(sentence in one for one in told) == 1


def test_nothing_is_odd_in_a_whole_bag(bags):
    run = load_run(bags['whole'])
    assert recording_remarks([run]) == [] and run.left_out == () and not run.implausible


def test_what_is_harmless_is_no_remark(tmp_path):
    """Two senders of one topic overtake each other by milliseconds, in any live recording."""
    def change(short, i, message):
        if short != 'pressure':
            return message
        stamp_ns = START_NS + 5_000_000 * (i - 2 * (i == 7))
        return messages.Pressure(stamp_ns, message.pressure_pa)

    run = load_run(write_bag(tmp_path / 'bag', 20, change=change))
    assert recording_remarks([run]) == []
    assert [one.partition(': ')[2] for one in run.notes] == [
        'the stamp goes back once, by up to 0.005 s; sorted by stamp.',
        '1 messages repeat the stamp before, kept.']
    assert np.all(np.diff(run['pressure'].stamp_ns) >= 0)


def retyped(bag, directory, type_name='sensor_msgs/msg/JointState', encoding='cdr'):
    """Copy a bag with a contraction of another type or encoding into one file; return it."""
    old = read_bag(bag)
    directory.mkdir()
    with open(directory / 'run.mcap', 'wb') as stream:
        writer = Writer(stream)
        writer.start('ros2')
        for name, topic in old.topics.items():
            odd = name == CONTRACTION
            channel = writer.register_channel(
                name, encoding if odd else 'cdr', writer.register_schema(
                    type_name if odd else topic.type_name, 'ros2msg', b''))
            for log_ns, data in zip(topic.log_time_ns.tolist(), topic.payloads):
                writer.add_message(channel, log_ns, data, log_ns)
        writer.finish()
    return directory / 'run.mcap'


def test_a_topic_of_another_type_is_no_missing_one(bags, tmp_path, capsys):
    bag = retyped(bags['whole'], tmp_path / 'bag', 'sensor_msgs/msg/FluidPressure')
    sentence = (f'{CONTRACTION} is sensor_msgs/msg/FluidPressure in cdr, not '
                'sensor_msgs/msg/JointState in cdr: left out')
    model = ['--model', 'dmsp_5_300_hanging_mass']
    for arguments, code in ((['replay', bag, '--only', 'plant', *model], 2), (['info', bag], 1),
                            (['gap', bag, '--out', tmp_path / 'gap', *model], 1)):
        assert main([str(word) for word in arguments]) == code
        assert sentence in ''.join(capsys.readouterr()), arguments


def test_an_encoding_that_is_not_read_is_named(bags, tmp_path):
    bag = retyped(spoiled_bag(bags['whole'], 'damaged', tmp_path / 'copy', leave_out=PRESSURE),
                  tmp_path / 'bag', encoding='json')
    with pytest.raises(InputError, match=f'{CONTRACTION} is sensor_msgs/msg/JointState in json'):
        load_run(bag)


def test_what_is_not_there_is_told_without_another_quantity(bags, tmp_path, capsys):
    for name, words in ((f'{PRESSURE}_command', 'has no `pressure_command` messages; topics'),
                        ('/muscle/valve_signal', 'has no `valve_signal` messages; topics')):
        bag = spoiled_bag(bags['whole'], 'stepped', tmp_path / name.rpartition('/')[2],
                          leave_out=name)
        assert main(['replay', str(bag), '--only', 'driver']) == 2
        assert f'{words} with messages: ' in capsys.readouterr().err


def test_a_recording_that_broke_off_says_no_zeros(bags, tmp_path, capsys):
    data = next(bags['whole'].glob('*.mcap')).read_bytes()
    (tmp_path / 'cut.mcap').write_bytes(data[:2 * len(data) // 3])
    assert main(['info', str(tmp_path / 'cut.mcap')]) == 1
    assert 'Incomplete: the recording broke off. Remarks:\n' in capsys.readouterr().out


def strayed(bag, directory, name, by_ns, which):
    """Copy a bag with other stamps of some messages of a topic, by index; return its folder."""
    old = read_bag(bag)
    short = name.rpartition('/')[2]
    with BagWriter(directory, {EXPERIMENT_RECORD: old.experiment}) as writer:
        for topic in old.topics.values():
            writer.add_topic(topic.name, topic.type_name)
            chosen = {k % len(topic.payloads) for k in which if topic.name == name}
            for k, (log_ns, data) in enumerate(zip(topic.log_time_ns.tolist(), topic.payloads)):
                if k in chosen:
                    one = decode(short, data)
                    data = encode(short, replace(one, stamp_ns=one.stamp_ns + by_ns))
                writer.write(topic.name, data, log_ns, log_ns)
    return directory


@pytest.mark.parametrize('name, by_s, which, words', [
    (PRESSURE, 20, [500], '20.0 s ahead'), (PRESSURE, 400_000_000, [0], 'ahead'),
    (CONTRACTION, -3600, [-1], 'behind'), (CONTRACTION, 20, [100, 101, 900], '20.0 s ahead'),
    ('/muscle/valve_signal', 400_000_000, [300], '400000000.0 s ahead')])
def test_a_stray_stamp_is_left_out(bags, tmp_path, name, by_s, which, words):
    run = load_run(strayed(bags['whole'], tmp_path / 'bag', name, by_s * 10**9, which))
    whole = load_run(bags['whole'])
    short = name.rpartition('/')[2]
    told, = run.left_out
    assert f'{name}: {len(which)} messages have a stamp far from' in told and words in told
    kept = np.delete(np.arange(len(whole[short])), which)
    np.testing.assert_array_equal(run[short].stamp_ns, whole[short].stamp_ns[kept])
    for key, column in whole[short].values.items():
        np.testing.assert_array_equal(run[short].values[key], column[kept])


@pytest.mark.parametrize('by_s, which', [
    (0.5, [500]),                       # less than the shortest that is stray
    (20, range(500, 900)),              # a clock that was set, and set back
    (20, range(500, 10_000))])          # a clock that was set
def test_a_clock_that_was_set_is_not_stray(bags, tmp_path, by_s, which):
    count = len(load_run(bags['whole'])['pressure'])
    run = load_run(strayed(bags['whole'], tmp_path / 'bag', PRESSURE, int(by_s * 1e9),
                           [k for k in which if k < count]))
    assert run.left_out == () and len(run['pressure']) == count


def test_messages_that_came_late_are_not_stray():
    """Their stamps are right; nor are receive times of use that all messages share."""
    stamp_ns = np.arange(1000) * 4_000_000
    for late in (slice(995, 1000), slice(0, 3), slice(200, 950)):
        late_ns = stamp_ns.copy()
        late_ns[late] = late_ns[late].max() + 3_000_000_000
        assert not stray(stamp_ns, np.maximum.accumulate(late_ns)).any()
    with_hole_ns = stamp_ns + 60_000_000_000 * (np.arange(1000) > 0)
    assert not stray(with_hole_ns, np.zeros(1000, dtype=np.int64)).any()
    assert not stray(with_hole_ns, with_hole_ns + 300_000).any()


def test_an_announced_topic_without_messages_is_no_mistake(tmp_path):
    bag = write_bag(tmp_path / 'run', 20, change=lambda short, i, message: (
        None if short == 'contraction' else message))
    assert bag_info(bag).topic(CONTRACTION).count == 0
    assert 'contraction' not in load_run(bag).topics


def test_unstamped_messages_are_told_as_such_and_not_as_another_clock(tmp_path):
    def change(short, i, message):
        if short == 'pressure':
            return messages.Pressure(0, message.pressure_pa)
        if short == 'contraction' and i % 3:
            return messages.Contraction(0, message.contraction_m)
        return message

    info = bag_info(write_bag(tmp_path / 'run', 400, change=change))
    told, = [one for one in info.remarks if '/muscle/pressure' in one]
    assert 'no message has a header stamp, so receive times are used' in told
    assert info.topic('/muscle/pressure').rate_hz == pytest.approx(200.0)
    text = ' '.join(info.remarks)
    assert '/muscle/contraction: 266 messages without a header stamp, left out' in text
    assert not any(word in text for word in ('clocks', 'goes back', 'repeat'))


def test_a_stray_stamp_does_not_make_gap_refuse(bags, tmp_path, capsys):
    bag = strayed(bags['whole'], tmp_path / 'bag', '/muscle/valve_signal', 4 * 10**17, [300])
    assert main(asked('gap', bag, tmp_path)) == 1
    found = json.loads((tmp_path / 'gap' / 'gap.json').read_text())
    assert found['verdict'] == 'no_gap' and '400000000.0 s ahead' in found['remarks'][-1]


def bag_of_joint_states(directory, named):
    """Write a bag with a pressure and JointStates with these names in turn; return its folder."""
    with BagWriter(directory, {}) as writer:
        writer.add_topic(PRESSURE, 'sensor_msgs/msg/FluidPressure')
        writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
        for i in range(60):
            stamp_ns, names = START_NS + i * 5_000_000, named[i % len(named)]
            numbers = [0.01 * (k + 1) for k in range(max(len(names), 1))]
            packer, (one, two, three) = cdr.joint_packer('', names, (len(numbers), 0, 0))
            joints = packer.pack(
                cdr.ENCAPSULATION, *cdr.split_stamp(stamp_ns), one, *numbers, two, three)
            pressure = encode('pressure', messages.Pressure(stamp_ns, 2e5 + i))
            for name, data in ((PRESSURE, pressure), ('/joint_states', joints)):
                writer.write(name, data, stamp_ns, stamp_ns)
    return directory


@pytest.mark.parametrize('named, words', [
    ([('hip', 'slider')], ["messages have 2 entries ('hip', 'slider'), and the first one is"]),
    ([('hip',), ('slider',)], ["the first entry is 'hip', 'slider' in turn, and all are read as"]),
    ([('slider',), ()], [])])
def test_entries_that_are_not_read_are_told(tmp_path, named, words):
    bag, topics = bag_of_joint_states(tmp_path / 'bag', named), {'contraction': '/joint_states'}
    for remarks in (load_run(bag, topics=topics).remarks, bag_info(bag, topics=topics).remarks):
        told = [one for one in remarks if 'entr' in one]
        assert len(told) == len(words)
        assert all(f'{CONTRACTION}: {text}' in one for text, one in zip(words, told))


def test_what_the_remark_advises_reads_another_entry(tmp_path):
    bag = bag_of_joint_states(tmp_path / 'bag', [('hip', 'slider')])
    told, = (one for one in load_run(bag, topics={'contraction': '/joint_states'}).remarks
             if 'entr' in one)
    advised = shlex.split(told[told.index('`pam ') + 1:told.rindex('`')])
    words = [str(bag) if word == 'BAG' else word for word in advised[1:]]
    main([*words, '--out', str(tmp_path / 'run')])
    contraction = load_run(tmp_path / 'run').topics['contraction'].values['contraction_m']
    assert contraction == pytest.approx(0.02)


def bag_of_a_joint(directory, odd):
    """Write a bag of /knee in which one topic, relative to it, is another type."""
    sent = {'joint_state': messages.JointAngle, 'flexor/pressure': messages.Pressure,
            'extensor/pressure': messages.Pressure, 'flexor/followed_pressure': messages.Pressure,
            'extensor/followed_pressure': messages.Pressure}
    with BagWriter(directory, {}) as writer:
        for name, message in sent.items():
            short = name.rpartition('/')[2]
            full = f'/knee/{name}'
            writer.add_topic(
                full, 'std_msgs/msg/Float64' if name == odd else BY_NAME[short].type_name)
            for i in range(60):
                stamp_ns = START_NS + i * 5_000_000
                data = bytes(12) if name == odd else encode(short, message(stamp_ns, 2e-1 + i))
                writer.write(full, data, stamp_ns, stamp_ns)
    return directory


def test_a_topic_of_a_joint_of_another_type_is_no_missing_one(tmp_path):
    odd = 'std_msgs/msg/Float64 in cdr, not sensor_msgs/msg/'
    bag = bag_of_a_joint(tmp_path / 'angle', 'joint_state')
    with pytest.raises(InputError, match=f'joint /knee, but /knee/joint_state is {odd}JointState'):
        load_recording(bag)
    assert sum(f'/knee/joint_state is {odd}JointState in cdr: left out.' in one
               for one in bag_info(bag).remarks) == 1
    bag = bag_of_a_joint(tmp_path / 'pressure', 'extensor/pressure')
    sentence = f'/knee/extensor/pressure is {odd}FluidPressure in cdr: left out'
    run = load_recording(bag)
    assert run.namespace == '/knee' and f'{sentence}.' in run.remarks
    with pytest.raises(InputError, match=sentence):
        run.require('extensor/pressure')
    assert bag_info(bag).remarks.count(f'{sentence}.') == 1

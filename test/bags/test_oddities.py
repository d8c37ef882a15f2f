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

import json

from mcap.writer import Writer
import numpy as np
from pam_actuation import messages
from pam_actuation.bags.load import load_run
from pam_actuation.bags.oddities import recording_remarks
from pam_actuation.bags.source import read_bag
from pam_actuation.bags.writer import BagWriter, EXPERIMENT_RECORD
from pam_actuation.cli.main import main
from pam_actuation.topics.codec import decode, encode
from pam_sim.errors import InputError
import pytest
from sample_bag import START_NS, write_bag

PRESSURE, CONTRACTION = '/muscle/pressure', '/muscle/contraction'
# What is done to the pressure, the sentence and whether messages are lost.
SPOILED = {
    'damaged': ('messages are not sensor_msgs/msg/FluidPressure, left out', True),
    'stepped': (f'{PRESSURE}: the stamp goes back 1 times, by up to 5', False),
    'unstamped': (f'{PRESSURE}: no message has a header stamp', False)}


def spoiled_message(how, data, k, count):
    """Return a serialised pressure, number ``k`` of ``count``, that is spoiled."""
    if how == 'damaged':
        return data[:12] if k % 50 == 7 else data
    one = decode('pressure', data)
    stamp_ns = one.stamp_ns
    if how == 'stepped':
        stamp_ns -= 5_000_000_000 * (k > count // 2)
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
        'rules': ('rules', bag),
        'gap': ('gap', bag, '--seconds', 1, '--effects', 'coulomb_friction',
                '--out', folder / 'gap'),
        'identify': ('identify', bag, '--rig', 'dmsp_5_300_hanging_mass', '--unknown', 'mass_kg',
                     '--out', folder / 'identify'),
        'tune': ('tune', bag, '--rollouts', 10, '--patience', 1, '--out', folder / 'tuned.yaml'),
    }[verb]]


@pytest.mark.parametrize('verb, page', [
    ('replay', ''), ('report', 'page.html'), ('rules', ''), ('gap', 'gap/report.html'),
    ('identify', 'identify/report.html'), ('tune', 'tuned.html')])
@pytest.mark.parametrize('how', SPOILED)
def test_every_verb_tells_what_is_odd(bags, how, verb, page, tmp_path, capsys):
    sentence, lost = SPOILED[how]
    for form in ([], ['--json', '--overwrite']):
        arguments = asked(verb, bags[how], tmp_path)
        code = main([*arguments, *form])
        shown = capsys.readouterr().out
        told = json.loads(shown)['remarks'] if form else shown.splitlines()
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
        'the stamp goes back 1 times, by up to 0.005 s; sorted by stamp.',
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

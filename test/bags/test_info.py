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

"""What is said about a bag: rates, gaps, losses, and what cannot be true."""

import json
import math

import numpy as np
from pam_actuation import messages
from pam_actuation.bags.in_namespace import in_namespace
from pam_actuation.bags.info import bag_info, render_text
from pam_actuation.bags.metadata import experiment_metadata, UNITS
from pam_actuation.bags.recorder import RecorderCore
from pam_actuation.bags.renamed import may_be, may_be_in
from pam_actuation.bags.source import read_bag
from pam_actuation.bags.writer import BagWriter
from pam_actuation.cli.main import main
from pam_actuation.topics import codec
from pam_actuation.topics.table import BY_NAME, RECORDED
from pam_sim.errors import InputError
import pytest
from sample_bag import example_messages, full_name, METADATA, START_NS, STEP_NS, write_bag

COUNT = 400


def said(info, *words):
    return any(all(word in remark for word in words) for remark in info.remarks)


def test_good_bag(tmp_path):
    info = bag_info(write_bag(tmp_path / 'run', COUNT))
    assert info.remarks == [] and info.notes == [] and not info.has_findings
    assert info.message_count == COUNT * len(RECORDED)
    assert info.namespaces == ['/muscle'] and info.metadata == METADATA
    assert info.duration_s == pytest.approx((COUNT - 1) * 0.005)
    pressure = info.topic('/muscle/pressure')
    assert pressure.type_name == 'sensor_msgs/msg/FluidPressure' and pressure.count == COUNT
    assert pressure.rate_hz == pytest.approx(200.0)
    assert pressure.max_gap_s == pytest.approx(0.005) and pressure.gaps == 0
    assert pressure.stamp_jitter_s == pytest.approx(0.0, abs=1e-9)
    assert pressure.ranges['pressure_pa'] == (pytest.approx(2.89e5, abs=50),
                                              pytest.approx(2.91e5, abs=50))
    signal = info.topic('/muscle/valve_signal')
    assert (signal.published, signal.count, signal.lost) == (COUNT, COUNT, 0)
    # Only one topic is reported as published, so completeness is not known.
    assert info.complete is None
    data = json.loads(json.dumps(info.to_dict()))
    names = [one['name'] for one in data['topics']]
    assert names == sorted(names) and '/muscle/contraction' in names and data['lost'] == 0
    with pytest.raises(InputError, match='no topic /x'):
        info.topic('/x')


def test_text_is_in_units_of_people(tmp_path):
    text = render_text(bag_info(write_bag(tmp_path / 'run', COUNT)))
    assert '/muscle/pressure: 187.7 to 189.7 kPa gauge' in text
    assert '/muscle/contraction: 13.00 to 15.00 mm' in text
    assert '200.0 Hz' in text and 'experiment_name: sine' in text
    assert 'Nothing is known to be missing' in text


def test_gap_and_loss_against_published(tmp_path):
    def lose(short, i, message):
        return None if short == 'valve_signal' and 100 <= i < 110 else message

    info = bag_info(write_bag(tmp_path / 'run', COUNT, change=lose))
    signal = info.topic('/muscle/valve_signal')
    assert (signal.count, signal.published, signal.lost) == (COUNT - 10, COUNT, 10)
    assert signal.gaps == 1 and signal.max_gap_s == pytest.approx(0.055)
    assert info.complete is False and info.has_findings
    assert said(info, '/muscle/valve_signal', '10 messages of 400 published never arrived')
    assert said(info, '/muscle/valve_signal', '1 gaps, the longest 55 ms')
    assert 'Incomplete: 10 messages lost' in render_text(info)


def test_a_namespace_of_a_bag_is_told_alone(tmp_path, capsys):
    with BagWriter(tmp_path / 'run', METADATA) as writer:
        for name in ('/knee/flexor/pressure', '/knee/flexor/contraction', '/arm/pressure',
                     '/armed/pressure', '/diagnostics'):
            short = name.rpartition('/')[2]
            writer.add_topic(name, RECORDED[short].type_name)
            for i in (*range(50), *range(150, 200)):
                now_ns = START_NS + i * STEP_NS
                writer.write(
                    name, codec.encode(short, example_messages(i)[short]), now_ns, now_ns)
    bag = str(tmp_path / 'run')
    whole = bag_info(bag)
    assert said(whole, '/knee/flexor/pressure: 1 gaps') and said(whole, '/arm has no messages on')
    assert main(['info', bag, '--namespace', 'knee', '--json']) == 1
    knee = json.loads(capsys.readouterr().out)
    assert [one['name'] for one in knee['topics']] == [
        '/knee/flexor/contraction', '/knee/flexor/pressure']
    assert knee['namespaces'] == ['/knee/flexor']
    assert knee['remarks'] == [one for one in whole.remarks if one.startswith('/knee')]
    assert knee['notes'][-1] == '2 of 5 topics are shown, those in /knee.'
    assert main(['info', bag, '--namespace', '/arm/']) == 1
    printed = capsys.readouterr().out
    assert '/arm has no messages on contraction' in printed and '/armed' not in printed
    assert in_namespace(whole, '/') == whole
    assert main(['info', bag, '--namespace', '/ar']) == 2
    assert 'namespace /ar; the bag has /arm, /armed, /knee/flexor' in capsys.readouterr().err


def test_a_topic_under_another_name_is_looked_for(tmp_path, capsys):
    with BagWriter(tmp_path / 'run', METADATA) as writer:
        for name, short in (('/hip/pressure', 'pressure'), ('/enc/hip', 'contraction'),
                            ('/hip/controller_state', 'controller_state')):
            writer.add_topic(name, RECORDED[short].type_name)
            writer.write(name, codec.encode(short, example_messages(0)[short]), START_NS, START_NS)
    for options in ((), ('--namespace', '/hip')):
        assert main(['info', str(tmp_path / 'run'), *options]) == 1
        printed = capsys.readouterr().out
        assert '/hip has no messages on contraction' in printed
        assert ('Note: contraction may have another name in the bag: /enc/hip has its type. '
                "`--topic contraction=/enc/hip` reads it (in Python: topics={'contraction': "
                "'/enc/hip'}).") in printed
        assert 'force may have' not in printed
    types = {f'/enc/{k}': RECORDED['contraction'].type_name for k in range(7)}
    assert '/enc/4 and 2 more have its type' in may_be('contraction', types)
    assert may_be('pressure', types) == '' and may_be_in(tmp_path, 'pressure') == ''


def test_loss_of_a_node_that_died_before_its_last_report(tmp_path):
    def change(short, i, message):
        if short == 'diagnostics' and i > 200:
            return None
        return None if short == 'valve_signal' and i == 50 else message

    info = bag_info(write_bag(tmp_path / 'run', COUNT, change=change))
    assert info.topic('/muscle/valve_signal').lost == 1


def test_recorder_counts_reach_the_info(tmp_path):
    core = RecorderCore(BagWriter(tmp_path / 'run', METADATA))
    for short, topic in RECORDED.items():
        core.add_topic(full_name(short), topic.type_name)
    for i in range(20):
        for short, message in example_messages(i).items():
            if short == 'diagnostics':
                statuses = [messages.Status(
                    message[0].stamp_ns, 0, '/muscle/node', 'ok',
                    ((f'published.{full_name("diagnostics")}', str(i + 1)),))]
                message = statuses
            skip = 3 if short == 'force' and i > 10 else 0
            received_ns = START_NS + i * STEP_NS
            core.receive(
                full_name(short), codec.encode(short, message), received_ns - 1000,
                received_ns, i + 1 + skip)
    core.close()
    info = bag_info(tmp_path / 'run')
    assert info.topic('/muscle/force').lost == 3 and info.lost == 3 and info.dropped == 0
    assert info.complete is False
    # Without that loss every topic is accounted for.
    info.topic('/muscle/force').lost = 0
    assert info.complete is True and 'Complete' in render_text(info)


@pytest.mark.parametrize('unknown_send_times', [False, True])
def test_recorder_and_info_count_the_same_losses(tmp_path, unknown_send_times):
    # Lost without a gap in the sequence numbers: the last ones of a topic, and all of a node
    # whose middleware gives none; one node dies before it reports what it sent last.
    random = np.random.default_rng(3)
    for k in range(12):
        core = RecorderCore(BagWriter(tmp_path / f'run_{k}', METADATA))
        topics = ('pressure', 'contraction', 'force')
        for short in (*topics, 'diagnostics'):
            core.add_topic(full_name(short), RECORDED[short].type_name)
        dies_at, numbered = int(random.integers(20, 60)), bool(k % 2)
        for i in range(60):
            now_ns = START_NS + i * STEP_NS
            messages_now = example_messages(i)
            for short in topics:
                if random.random() < 0.1 or (short == 'force' and i > dies_at + 5):
                    continue
                core.receive(
                    full_name(short), codec.encode(short, messages_now[short]),
                    0 if unknown_send_times else now_ns - 1000, now_ns,
                    i + 1 if numbered and short != 'contraction' else 0)
            for node, sent in (('plant', topics[:2]), ('cell', topics[2:])):
                if i % 10 == 9 and (node == 'plant' or i <= dies_at):
                    counts = tuple((f'published.{full_name(s)}', str(i + 1)) for s in sent)
                    status = messages.Status(now_ns, 0, f'/muscle/{node}', 'ok', counts)
                    core.receive(full_name('diagnostics'), codec.encode(
                        'diagnostics', [status]), now_ns, now_ns + 5)
        summary, info = core.close(), bag_info(tmp_path / f'run_{k}')
        assert summary.lost == info.lost > 0
        for short in topics:
            name = full_name(short)
            assert summary.counts[name].lost == info.topic(name).lost
        assert not summary.complete and info.complete is False


@pytest.mark.parametrize('late_s, missed', [(0.0, 0), (2.0, 6)])
def test_messages_before_the_recorder_are_told_from_losses(late_s, missed, tmp_path):
    # A sensor that was there before is no finding, one that comes late is: its begin is missing.
    core = RecorderCore(BagWriter(tmp_path / 'run', METADATA))
    for short in ('pressure', 'valve_signal', 'diagnostics'):
        core.add_topic(full_name(short), RECORDED[short].type_name)
    first = codec.encode('pressure', example_messages(5)['pressure'])
    core.receive(full_name('pressure'), first, START_NS, START_NS, 1)
    for i in range(6, 20):
        for short in ('valve_signal', 'diagnostics'):
            received_ns = START_NS + i * STEP_NS + round(late_s * 1e9)
            core.receive(
                full_name(short), codec.encode(short, example_messages(i)[short]),
                received_ns - 1000, received_ns, i + 1)
    core.close()
    info = bag_info(tmp_path / 'run')
    signal = info.topic('/muscle/valve_signal')
    assert (signal.published, signal.count, signal.missed_at_start, signal.sent_before) == (
        20, 14, missed, 6 - missed)
    assert signal.lost == 0 and info.missing == bool(missed)
    assert said(info, '6 messages were sent before the recorder was connected') == bool(missed)
    assert ('6 messages were published before this bag begins.' in info.notes) == (not missed)


@pytest.mark.parametrize('late_s', [0.0, 1.0, 2.0])
def test_reports_before_the_recorder_are_told_from_lost_ones(late_s, tmp_path):
    # Of a node that is not heard for 2 s the begin is missing. Others were there before.
    core = RecorderCore(BagWriter(tmp_path / 'run', METADATA))
    name = '/diagnostics'
    core.add_topic(name, RECORDED['diagnostics'].type_name)
    for i in range(10):
        for node, missing, late_ns in (
                ('plant', (5,), 0), ('driver', (0, 1, 2), round(late_s * 1e9))):
            if i not in missing:
                now_ns = START_NS + i + late_ns
                status = messages.Status(
                    now_ns, 0, f'/muscle/{node}', 'ok', ((f'published.{name}', str(i + 1)),))
                core.receive(name, codec.encode('diagnostics', [status]), now_ns, now_ns + 5)
    counts, info = core.close().counts[name], bag_info(tmp_path / 'run').topic(name)
    assert (counts.lost, counts.missed_at_start) == (1, 3)
    missed = 3 * (late_s > 1.5)
    assert (info.lost, info.missed_at_start, info.sent_before) == (1, missed, 3 - missed)


@pytest.mark.parametrize('node, late_s, own', [
    ('/other/driver', 2.0, 0), ('/muscle_2/driver', 2.0, 0), ('/muscle/driver', 2.0, 400),
    ('/muscle/driver', 0.0, 0)])
def test_reports_of_another_bench_or_before_the_recorder_are_no_loss(
        tmp_path, node, late_s, own):
    core = RecorderCore(BagWriter(tmp_path / 'run', METADATA))
    for short in ('pressure', 'diagnostics'):
        core.add_topic(full_name(short), RECORDED[short].type_name)
    for i in range(10):
        now_ns = START_NS + i * STEP_NS
        core.receive(full_name('pressure'), codec.encode(
            'pressure', example_messages(i)['pressure']), now_ns, now_ns, i + 1)
        for name, number, late_ns in (
                ('/muscle/plant', i + 1, 0), (node, i + 401, round(late_s * 1e9))):
            status = messages.Status(now_ns, 0, name, 'ok', (
                ('published./diagnostics', str(number)),
                *([('published./muscle/pressure', str(number))] if 'plant' in name else [])))
            core.receive('/diagnostics', codec.encode('diagnostics', [status]),
                         now_ns + late_ns, now_ns + late_ns)
    core.close()
    info = bag_info(tmp_path / 'run')
    assert (info.lost, info.missed_at_start) == (0, own)
    assert info.complete is (own == 0) and info.topic('/diagnostics').sent_before == 400 - own
    assert ('400 messages were published before this bag begins.' in info.notes) == (own == 0)


@pytest.mark.parametrize('metadata', [{}, {**METADATA, 'origin': 'live'}])
@pytest.mark.parametrize('lost', [(), (150, 151, 299)])
def test_a_logger_that_began_after_the_nodes_has_lost_what_is_missing_since(
        tmp_path, metadata, lost):
    def change(short, i, message):
        return None if i < 100 or short == 'valve_signal' and i in lost else message

    info = bag_info(write_bag(tmp_path / 'run', 300, metadata=metadata, change=change))
    signal = info.topic('/muscle/valve_signal')
    assert (signal.published, signal.sent_before, signal.lost) == (300, 100, len(lost))
    assert info.has_findings == bool(lost) and info.missed_at_start == 0
    assert said(info, '3 messages of 300 published never arrived') == bool(lost)
    assert info.complete is (False if lost else None)
    assert any('100 messages were published before this bag' in note for note in info.notes)
    assert json.loads(json.dumps(info.to_dict()))['topics'][-1]['sent_before'] == 100


def test_a_logger_is_not_blamed_for_late_nodes_and_unknown_send_times(tmp_path):
    # Two nodes publish on one topic, the second from the middle on. Receive times scatter.
    random, name = np.random.default_rng(4), full_name('valve_signal')
    with BagWriter(tmp_path / 'run', {}) as writer:
        for short in ('valve_signal', 'diagnostics'):
            writer.add_topic(full_name(short), RECORDED[short].type_name)
        arrivals, late = [], int(30e6)
        for i in range(50, 200):
            now_ns = START_NS + i * STEP_NS
            for node, since in (('driver', 0), ('watchdog', 120)):
                if i >= since:
                    arrivals.append((now_ns + int(random.integers(late)), 'valve_signal',
                                     example_messages(i)['valve_signal']))
                if i >= since and i % 20 == 5:
                    values = ((f'published.{name}', str(i + 1 - since)),
                              (f'published.{full_name("diagnostics")}', str(i // 20 + 1)))
                    arrivals.append((now_ns + int(random.integers(late)), 'diagnostics', [
                        messages.Status(now_ns, 0, f'/muscle/{node}', 'ok', values)]))
        for received_ns, short, message in sorted(arrivals, key=lambda one: one[0]):
            writer.write(full_name(short), codec.encode(short, message), received_ns, received_ns)
    info = bag_info(tmp_path / 'run')
    assert info.lost == 0 and not info.topic(name).missed_at_start
    assert 40 <= info.topic(name).sent_before <= 90
    assert not said(info, 'never arrived')


@pytest.mark.parametrize('short, message, words', [
    ('pressure', messages.Pressure(0, 2.5e5 - 101325.0 - 1.2e5), ('mostly below', 'gauge')),
    ('contraction', messages.Contraction(0, 0.09, 0.0), ('leaves 0 to 75 mm',)),
    ('contraction', messages.Contraction(0, -0.01, 0.0), ('-10.0',)),
    ('pressure', messages.Pressure(0, 2e6), ('more than the muscle stands',)),
    ('force', messages.Force(0, float('nan')), ('not finite',)),
    ('valve_signal', messages.ValveSignal(0, ('ppr_voltage',), (11.0,)), ('leaves 0 to 10 V',)),
    ('valve_signal', messages.ValveSignal(0, ('fill_duty',), (1.5,)), ('leaves 0 to 1',)),
])
def test_values_that_cannot_be_true(tmp_path, short, message, words):
    def change(name, i, given):
        if name != short:
            return given
        fields = {field: getattr(message, field) for field in message.__slots__}
        return type(message)(**{**fields, 'stamp_ns': given.stamp_ns})

    measured = {**METADATA, 'origin': 'live'}
    info = bag_info(write_bag(tmp_path / 'run', 30, metadata=measured, change=change))
    assert said(info, f'/muscle/{short}', *words)


def test_a_topic_of_which_no_message_can_be_decoded_is_told(tmp_path):
    with BagWriter(tmp_path / 'run', {}) as writer:
        writer.add_topic('/muscle/contraction', RECORDED['contraction'].type_name)
        raw = codec.encode('contraction', messages.Contraction(START_NS, 0.01, 0.0))
        for i in range(3):
            writer.write('/muscle/contraction', raw[:12], START_NS + i, START_NS + i)
    assert said(bag_info(tmp_path / 'run'), '/muscle/contraction: 3 messages cannot be decoded')


def test_undefined_internals_and_short_pauses_are_no_findings(tmp_path):
    def change(short, i, message):
        if short == 'controller_state':
            return messages.ControllerState(message.stamp_ns, ('a',), (float('nan'),))
        return None if short == 'force' and 10 <= i < 15 else message

    info = bag_info(write_bag(tmp_path / 'run', 100, change=change))
    assert info.topic('/muscle/force').gaps == 1 and not info.has_findings


def restamped(move):
    def change(short, i, message):
        if short != 'pressure':
            return message
        return messages.Pressure(message.stamp_ns + move(i), message.pressure_pa)
    return change


def test_stamps_that_cannot_be_true(tmp_path):
    future = bag_info(write_bag(tmp_path / 'a', 30, change=restamped(lambda i: 10**9)))
    assert said(future, '/muscle/pressure', '30 stamps lie in the future', '1 s')
    other = bag_info(write_bag(tmp_path / 'b', 30, change=restamped(lambda i: -10**12)))
    assert said(other, '/muscle/pressure', 'different clocks')
    slow = bag_info(write_bag(tmp_path / 'c', 30, change=restamped(lambda i: -i * 10**7 + 10**7)))
    assert said(slow, '/muscle/pressure', 'goes back 29 times')
    frozen = bag_info(write_bag(tmp_path / 'd', 30, change=restamped(lambda i: -i * STEP_NS)))
    assert said(frozen, '/muscle/pressure', '29 messages repeat')


def test_messages_stored_in_any_order_are_read_by_log_time(tmp_path):
    """As an SQLite bag and all readers of MCAP deliver them."""
    stamps = START_NS + STEP_NS * np.random.default_rng(0).permutation(60)
    with BagWriter(tmp_path / 'run', {}) as writer:
        writer.add_topic('/muscle/pressure', BY_NAME['pressure'].type_name)
        for stamp_ns in stamps.tolist():
            raw = codec.encode('pressure', messages.Pressure(stamp_ns, 2e5 + stamp_ns % 1000))
            writer.write('/muscle/pressure', raw, stamp_ns + 1000, stamp_ns)
    topic = read_bag(tmp_path / 'run').topics['/muscle/pressure']
    sent_ns = [codec.decode('pressure', raw).stamp_ns for raw in topic.payloads]
    assert sent_ns == sorted(stamps) == topic.publish_time_ns.tolist()
    assert not said(bag_info(tmp_path / 'run'), '/muscle/pressure', 'goes back')


def test_slow_and_missing_topics(tmp_path):
    def every_fourth(short, i, message):
        return message if i % 4 == 0 or short != 'contraction' else None

    path = write_bag(tmp_path / 'run', 100, leave_out=('valve_signal', 'force', 'diagnostics'),
                     change=every_fourth)
    info = bag_info(path)
    assert said(info, '/muscle/contraction', '50.0 Hz is below 100 Hz')
    assert said(info, 'no messages on valve_signal')
    assert info.notes == ['/muscle has no messages on force.']


@pytest.mark.parametrize('valve, expected', [
    ('ppr', []),
    ('hsv', ['/knee/extensor has no messages on supply_pressure.',
             '/knee/flexor has no messages on supply_pressure.'])])
def test_a_muscle_of_a_joint_needs_no_reference_and_a_regulator_no_supply(
        tmp_path, valve, expected):
    left_out = ('reference', 'supply_pressure')
    joint = bag_info(write_bag(
        tmp_path / 'joint', namespaces=('/knee/flexor', '/knee/extensor'), leave_out=left_out,
        valve=valve, metadata={'valve': valve}))
    assert joint.notes == expected
    alone = bag_info(write_bag(
        tmp_path / 'alone', namespaces=('/flexor',), leave_out=left_out, valve=valve,
        metadata={'valve': valve}))
    also = 'supply_pressure, ' if valve == 'hsv' else ''
    assert alone.notes == [f'/flexor has no messages on {also}reference.']
    unsaid = bag_info(write_bag(tmp_path / 'unsaid', leave_out=left_out, metadata={}))
    assert unsaid.notes == ['/muscle has no messages on supply_pressure, reference.']
    # Of an imported table nobody says the valve, and a commanded pressure is a command as well.
    commanded = bag_info(write_bag(tmp_path / 'commanded', leave_out=('valve_signal',),
                                   metadata={}))
    assert not said(commanded, 'valve_signal') and commanded.notes == [
        '/muscle has no messages on valve_signal: pam gap and pam identify take '
        'pressure_command for the input of a regulator.']


def joint_info(path, angle_rad, stamp_ns):
    """Return what is known of a bag with the angle of a joint and an unstamped co-contraction."""
    with BagWriter(path, {}) as writer:
        for name in ('joint_state', 'co_contraction'):
            writer.add_topic(f'/knee/{name}', BY_NAME[name].type_name)
        for angle, now_ns in zip(angle_rad, stamp_ns):
            for name, message in (('joint_state', messages.JointAngle(now_ns, angle)),
                                  ('co_contraction', messages.Pressure(0, 3e5))):
                writer.write(f'/knee/{name}', codec.encode(name, message), now_ns, now_ns)
    return bag_info(path)


def test_the_angle_of_a_joint_is_looked_at(tmp_path):
    stamp_ns = [START_NS + i * STEP_NS for i in range(COUNT)]
    angle_rad = [0.1 * math.sin(0.05 * i) for i in range(COUNT)]
    good = joint_info(tmp_path / 'good', angle_rad, stamp_ns)
    assert not said(good, '/knee/')
    assert good.topic('/knee/co_contraction').rate_hz == pytest.approx(200.0)
    low, high = good.topic('/knee/joint_state').ranges['angle_rad']
    assert (low, high) == pytest.approx((-0.1, 0.1), rel=1e-2)
    assert '/knee/joint_state: -5.73 to 5.73 °' in render_text(good)
    lost = joint_info(tmp_path / 'lost', [math.nan] * COUNT, stamp_ns)
    assert said(lost, '/knee/joint_state', 'angle_rad are not finite (nan or inf), none can be')
    assert lost.has_findings
    holed = joint_info(tmp_path / 'holed', angle_rad, [
        now_ns + 4 * 10**9 * (i > 200) for i, now_ns in enumerate(stamp_ns)])
    assert said(holed, '/knee/joint_state: 1 gaps, the longest 4005 ms')


def test_foreign_topics_are_listed(tmp_path):
    with BagWriter(tmp_path / 'run', {}) as writer:
        writer.add_topic('/chatter', 'std_msgs/msg/String')
        for i in range(5):
            writer.write('/chatter', b'\x00\x01\x00\x00\x01\x00\x00\x00\x00', START_NS + i, 0)
    info = bag_info(tmp_path / 'run')
    assert info.topic('/chatter').count == 5 and info.namespaces == []
    assert said(info, 'no messages on any topic of a muscle')
    assert info.complete is None and '/chatter' in render_text(info)


def test_bag_that_ended_early(tmp_path):
    data = (write_bag(tmp_path / 'run', 1500) / 'run_0.mcap').read_bytes()
    cut = tmp_path / 'cut.mcap'
    cut.write_bytes(data[:len(data) // 2])
    with pytest.raises(InputError, match='ended early'):
        bag_info(cut)
    info = bag_info(cut, recover=True)
    assert info.recovered and info.complete is False and said(info, 'ended early')


class Thing:
    """Stands for an experiment, a rig or a controller."""

    name = 'sine'
    valve = 'hsv'

    def to_yaml(self):
        return 'a: 1\n'


def test_experiment_record():
    record = experiment_metadata(Thing(), Thing(), 'kind: pid\n', seed=3, origin='live')
    assert record['experiment_name'] == 'sine' and record['valve'] == 'hsv'
    assert record['rig'] == record['experiment'] == 'a: 1\n'
    assert record['controller'] == 'kind: pid\n' and record['seed'] == '3'
    assert record['units'] == UNITS and record['origin'] == 'live'
    assert record['software_version']
    assert all(isinstance(text, str) for text in record.values())
    assert 'controller' not in experiment_metadata(valve='ppr')
    with pytest.raises(InputError, match='xyz'):
        experiment_metadata(valve='xyz')

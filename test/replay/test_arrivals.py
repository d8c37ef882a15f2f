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

"""Arrivals read as arrays: message by message those that decoding one by one gives."""

from functools import partial
import math

import numpy as np
from pam_actuation import messages
from pam_actuation.bags import series
from pam_actuation.bags.info import bag_info
from pam_actuation.bags.load import load_run, topics_of
from pam_actuation.bags.load_joint import load_recording
from pam_actuation.bags.source import read_bag
from pam_actuation.bags.writer import BagWriter
from pam_actuation.loops.bus import Bus
from pam_actuation.replay.arrivals import (
    ORDER, recorded_topics, recorded_topics_of_joint, TICKED)
from pam_actuation.topics import codec
from pam_actuation.topics.table import BY_NAME, RECORDED
from pam_sim.errors import InputError
from process_replay import bag_of
import pytest

START_NS = 1_000_000_000_000
WALL_NS = 1_790_000_000_000_000_000


def arrivals(run, topics):
    """Return (time, topic, message) of some topics as a bus plays them."""
    bus, found = Bus(), []

    def note(topic, message, now_ns):
        found.append((now_ns, topic, message))

    for topic, recorded in recorded_topics(run, topics).items():
        recorded.play(bus, partial(note, topic))
    bus.run_until()
    return found


def one_by_one(run, topics):
    """Return the same, each message decoded by itself, sorted as a list."""
    found = []
    for short, topic in topics_of(read_bag(run.path), run.namespace).items():
        for raw, received_ns in zip(topic.payloads, topic.log_time_ns.tolist()):
            if short in topics:
                message = codec.decode(short, raw)
                time_ns = message.stamp_ns if short in TICKED else received_ns
                found.append((time_ns, short, message))
    return sorted(found, key=lambda one: (one[0], ORDER.index(one[1])))


def plain(arrival):
    """Return an arrival as values that compare, internals of a tick left out."""
    time_ns, topic, message = arrival
    if topic == 'controller_state':
        return time_ns, topic, message.stamp_ns, dict(
            zip(message.names, message.values)).get('learning')
    return time_ns, topic, repr(message)


def write(path, sample):
    """Write (short name, receive time, message) in this order; return the run."""
    with BagWriter(path, {'valve': 'ppr'}) as writer:
        for short in {short for short, _, _ in sample}:
            writer.add_topic(f'/muscle/{short}', RECORDED[short].type_name)
        for short, time_ns, message in sample:
            writer.write(f'/muscle/{short}', codec.encode(short, message), time_ns, time_ns)
    return load_run(path)


def messy(count=300):
    """Return messages of several topics out of order, doubled, with missing numbers."""
    random = np.random.default_rng(5)
    sample = []
    for i in range(count):
        stamp_ns = START_NS + i * 4_000_000
        late_ns = int(random.integers(0, 12)) * 1_000_000
        missing = math.nan if i % 7 == 0 else 0.01
        sample += [
            ('pressure', stamp_ns + late_ns, messages.Pressure(stamp_ns, 1e5 + i)),
            ('contraction', stamp_ns + late_ns,
             messages.Contraction(stamp_ns, 0.01 + 1e-5 * i, missing)),
            ('valve_signal', stamp_ns, messages.ValveSignal(
                stamp_ns - stamp_ns % 8_000_000, ('ppr_voltage',), (float(i),))),
            ('controller_state', stamp_ns, messages.ControllerState(
                stamp_ns, ('tick', 'learning')[:1 + i % 3], (float(i), 0.0)[:1 + i % 3]))]
        if i % 50 == 0:
            sample.append(('reference_trajectory', stamp_ns, messages.ReferenceTrajectory(
                stamp_ns, (0, 20_000_000), (0.01, 0.02), (0.0, 0.1))))
    return sample


def test_messy_arrivals_are_those_of_decoding_one_by_one(tmp_path):
    run = write(tmp_path / 'run', messy())
    found, expected = arrivals(run, ORDER), one_by_one(run, ORDER)
    assert len(found) == len(expected) == 4 * 300 + 6
    assert {topic for _, topic, _ in found} == {
        'pressure', 'valve_signal', 'contraction', 'controller_state', 'reference_trajectory'}
    for mine, theirs in zip(found, expected):
        mine, theirs = plain(mine), plain(theirs)
        if theirs[1] == 'controller_state' and theirs[3] is None:
            mine = (*mine[:3], None if math.isnan(mine[3]) else mine[3])
        assert mine == theirs
    topics = recorded_topics(run, ORDER)
    assert all(list(one.times()) == list(one.times()) for one in topics.values())      # again


def test_arrivals_of_a_recording_are_those_of_decoding_one_by_one():
    run = load_run(bag_of('pid_ppr'))
    topics = set(ORDER) - {'controller_state'}
    found = list(map(plain, arrivals(run, topics)))
    assert found == list(map(plain, one_by_one(run, topics))) and len(found) > 1000


def write_damaged(path, namespace, sent):
    """Write four messages a topic, of ``sent(stamp_ns)``; number 1 is damaged where it can."""
    with BagWriter(path, {}) as writer:
        for name in sent(0):
            writer.add_topic(f'{namespace}/{name}', BY_NAME[name].type_name)
        for i in range(4):
            now_ns = START_NS + i * 5_000_000
            for name, message in sent(now_ns).items():
                raw = codec.encode(name, message)
                damaged = i == 1 and name != 'joint_state'
                writer.write(f'{namespace}/{name}', raw[:9] if damaged else raw, now_ns, now_ns)


def test_a_message_that_is_none_is_left_out(tmp_path):
    write_damaged(tmp_path / 'run', '/muscle', lambda stamp_ns: {
        'pressure': messages.Pressure(stamp_ns, 1e-3 * (stamp_ns - START_NS)),
        'reference_trajectory': messages.ReferenceTrajectory(
            stamp_ns, (0, 20_000_000), (0.01, 0.02), (0.0, 0.1))})
    run = load_run(tmp_path / 'run')
    assert len(run.left_out) == 2
    topics = recorded_topics(run, ORDER)
    times = [START_NS + ms * 1_000_000 for ms in (0, 10, 15)]
    assert [list(topics[name].times()) for name in ('pressure', 'reference_trajectory')] == (
        [times, times])
    assert [one.pressure_pa for one in topics['pressure']] == [0.0, 1e4, 1.5e4]
    assert [one.stamp_ns for one in topics['reference_trajectory']] == times


def test_a_trajectory_of_a_joint_that_is_none_is_left_out_with_a_remark(tmp_path):
    write_damaged(tmp_path / 'run', '/knee', lambda stamp_ns: {
        'joint_state': messages.JointAngle(stamp_ns, 0.1),
        'joint_trajectory': messages.AngleTrajectory(
            stamp_ns, (0, 10), (0.1, 0.2), (0.0, 0.0))})
    run = load_recording(tmp_path / 'run')
    kind = BY_NAME['joint_trajectory'].type_name
    told = f'/knee/joint_trajectory: 1 messages are not {kind}, left out.'
    assert run.left_out == (told,) and told in run.remarks
    topics = recorded_topics_of_joint(run)
    assert {name: len(one) for name, one in topics.items()} == {
        'joint_state': 4, 'joint_trajectory': 3}


@pytest.mark.parametrize('stamp_ns', [0, WALL_NS + 20_000_000_000])
def test_a_stamp_that_tells_no_time_of_sending_is_no_other_clock(tmp_path, stamp_ns):
    # Zero: the trajectory begins now. Otherwise it begins later, here after 20 s.
    with BagWriter(tmp_path / 'run', {}) as writer:
        for name in ('joint_state', 'joint_trajectory', 'co_contraction'):
            writer.add_topic(f'/knee/{name}', BY_NAME[name].type_name)
        for i in range(10):
            now_ns = WALL_NS + i * 5_000_000
            sent = {'joint_state': messages.JointAngle(now_ns, 0.1)}
            if i in (4, 7):
                sent['joint_trajectory'] = messages.AngleTrajectory(
                    stamp_ns, (0, 10), (0.1, 0.2), (0.0, 0.0))
                sent['co_contraction'] = messages.Pressure(0, 3e5)
            for name, message in sent.items():
                writer.write(f'/knee/{name}', codec.encode(name, message), now_ns, now_ns)
    run = load_recording(tmp_path / 'run')
    assert run.remarks == () and run.start_ns == WALL_NS
    assert not any('stamp' in one for one in bag_info(tmp_path / 'run').remarks)
    received = [WALL_NS + 20_000_000, WALL_NS + 35_000_000]
    assert list(run['co_contraction'].stamp_ns) == received
    topics = recorded_topics_of_joint(run)
    for name in ('joint_trajectory', 'co_contraction'):
        assert list(topics[name].times()) == received
    # As it was sent: the controller reads the stamp of zero as it did.
    assert [one.stamp_ns for one in topics['joint_trajectory']] == [stamp_ns] * 2


def test_a_recording_without_stamps_is_refused_for_that(tmp_path):
    sample = [('pressure', WALL_NS + i * 5_000_000, messages.Pressure(0, 1e5)) for i in range(5)]
    run = write(tmp_path / 'run', sample)
    with pytest.raises(InputError, match='pressure: 5 of 5 messages have no header stamp'):
        recorded_topics(run, ORDER)


def test_only_the_named_values_are_read():
    raws = [codec.encode('controller_state', messages.ControllerState(
        i, ('tick', 'learning'), (float(i), 1.0))) for i in range(20)]
    stamp_ns, values, bad = series.table('controller_state', raws, only=('learning', 'other'))
    assert list(stamp_ns) == list(range(20)) and not bad.any()
    assert set(values) == {'learning'} and np.all(values['learning'] == 1.0)

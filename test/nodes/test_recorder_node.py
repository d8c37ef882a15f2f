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

"""Test the recorder as a process: splitting, further topics, a full disk, changing senders."""

import resource
import time

import pytest

pytest.importorskip('rclpy')

from live_rig import LiveRig, wait_for                                      # noqa: E402, I100
from pam_actuation.bags.check import independent_readers                    # noqa: E402
from pam_actuation.bags.ending import ending_of                            # noqa: E402
from pam_actuation.bags.info import bag_info                                # noqa: E402
from pam_actuation.bags.recover import recover_bag                          # noqa: E402
from pam_actuation.bags.source import read_bag                              # noqa: E402
from pam_actuation.messages import Pressure                                 # noqa: E402
from pam_actuation.nodes import qos                                         # noqa: E402
from pam_actuation.nodes.experiment_recorder import ExperimentRecorder      # noqa: E402
from pam_actuation.rigging import session                                   # noqa: E402
from pam_actuation.rigging.client import local_context                      # noqa: E402
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
from pam_actuation.rigging.plan import make_plan, RECORDER                  # noqa: E402
from pam_actuation.topics.codec import encode                                # noqa: E402
import rclpy                                                                # noqa: E402
from rclpy.parameter import Parameter                                       # noqa: E402
from sensor_msgs.msg import FluidPressure                                   # noqa: E402
from std_msgs.msg import String                                             # noqa: E402

pytestmark = pytest.mark.ros

LONG = """\
name: long
domain: pressure
segments:
  - rest: {duration_s: 0.2}
  - step: {to_pa: 300000.0, duration_s: 60.0}
"""
EXTRA = '/bench/supply'


def message(number):
    return encode('pressure', Pressure(time.time_ns(), 2e5 + number))


def test_split_files_further_topics_and_changing_publishers(tmp_path):
    bag = tmp_path / 'bag'
    rig = LiveRig(tmp_path)
    try:
        rig.start(
            RECORDER, output=str(bag), topics=['pressure', 'diagnostics'],
            extra_topics=[f'{EXTRA}=sensor_msgs/msg/FluidPressure'], max_bagfile_duration_s=0.5)
        rig.listen()
        wait_for(lambda: any(h.message == 'recording' for h in rig.health[RECORDER]), 30.0,
                 'the recorder')
        node = rig.node

        def send(topic, count, first=0):
            """Join late, send, leave: what a sensor does that is plugged in on the way."""
            publisher = node.create_publisher(FluidPressure, topic, qos.PUBLISHER)
            wait_for(lambda: publisher.get_subscription_count() >= node.count_subscribers(topic)
                     and node.count_subscribers(topic) > 0, 10.0, 'the subscription')
            for number in range(first, first + count):
                publisher.publish(message(number))
                time.sleep(0.01)
            time.sleep(0.1)
            node.destroy_publisher(publisher)

        send('/muscle/pressure', 60)
        send(EXTRA, 50)
        send('/muscle/pressure', 40, first=60)
        recorder = rig.processes[RECORDER]
        recorder.send_signal(15)
        assert recorder.wait(20.0) and recorder.exit_code == 0, recorder.last_line()
    finally:
        rig.close()
    info = bag_info(bag)
    for topic, count in (('/muscle/pressure', 100), (EXTRA, 50)):
        found = info.topic(topic)
        assert (found.count, found.lost, found.dropped, found.missed_at_start) == (
            count, 0, 0, 0)
    assert len(list(bag.glob('bag_*.mcap'))) >= 3
    for counts in independent_readers(bag).values():
        assert counts['/muscle/pressure'] == 100 and counts[EXTRA] == 50


def test_a_bag_of_its_own_is_written_each_time_the_node_is_activated(tmp_path):
    lock = DomainLock()
    context = local_context(lock.domain_id)
    recorder = ExperimentRecorder(
        context=context, namespace='/muscle', enable_rosout=False,
        parameter_overrides=[Parameter('output', value=str(tmp_path / 'first'))])
    try:
        recorder.trigger_configure()
        recorder.trigger_activate()
        told, = recorder.set_parameters([Parameter('output', value=str(tmp_path / 'second'))])
        assert told.successful
        recorder.trigger_deactivate()
        recorder.trigger_activate()
        recorder.trigger_deactivate()
        recorder.trigger_activate()
        assert recorder.core is None and 'overwrite:=true' in str(recorder.input_error)
    finally:
        recorder.destroy_node()
        rclpy.try_shutdown(context=context)
        lock.release()
    for name in ('first', 'second'):
        assert (tmp_path / name / 'metadata.yaml').is_file()


@pytest.fixture
def made(tmp_path):
    """Return a function that makes a recorder in this process."""
    lock, nodes = DomainLock(), []
    context = local_context(lock.domain_id)

    def make(**parameters):
        nodes.append(ExperimentRecorder(
            context=context, namespace='/muscle', enable_rosout=False, parameter_overrides=[
                Parameter(name, value=value) for name, value in {
                    'output': str(tmp_path / 'bag'), **parameters}.items()]))
        return nodes[-1]
    yield make
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown(context=context)
    lock.release()


@pytest.fixture
def told(capfd):
    """Return a function that gives what was logged by now."""
    texts = []

    def log():
        texts.append(''.join(capfd.readouterr()))
        return ''.join(texts)
    return log


def test_a_latched_topic_is_in_each_bag_although_it_was_sent_before(made, told, tmp_path):
    """As /tf_static and robot_description are; what plays the bag has to offer it latched."""
    topics = ['/robot_description', '/bench/nobody']
    recorder = made(topics=['pressure'], extra_topics=[
        f'{topic}=std_msgs/msg/String' for topic in topics])
    context = local_context(recorder.context.get_domain_id())
    other = rclpy.create_node('other', context=context)
    publisher = other.create_publisher(String, topics[0], qos.LATCHED)
    try:
        publisher.publish(String(data='a robot'))
        recorder.trigger_configure()
        for bag in ('first', 'second'):
            recorder.set_parameters([Parameter('output', value=str(tmp_path / bag))])
            recorder.trigger_activate()
            wait_for(lambda: recorder.loops.run_once() or topics[0] in recorder.known, 10.0,
                     'the description')
            recorder.trigger_deactivate()
            info = bag_info(tmp_path / bag)
            assert [(one.name, one.count, one.lost) for one in info.topics] == [
                (topics[0], 1, 0)]
            text = (tmp_path / bag / 'metadata.yaml').read_text()
            assert 'durability: transient_local' in text
    finally:
        recorder.finish('over')
        other.destroy_node()
        rclpy.try_shutdown(context=context)
    assert told().count('nothing came on /bench/nobody\n') == 2


def test_it_does_not_await_what_it_does_not_record(made, tmp_path):
    recorder = made(topics=['pressure'], await_topics=['pressure', 'force'])
    recorder.trigger_configure()
    assert str(recorder.input_error) == (
        "parameter await_topics: 'force' is not recorded, so it cannot be awaited; recorded are "
        'pressure')
    assert not recorder.subscriptions_polled and not (tmp_path / 'bag').exists()


@pytest.mark.parametrize('names, twice', [
    (['/muscle/pressure'], '/muscle/pressure'), (['pressure'], '/muscle/pressure'),
    (['/muscle/bench', 'bench'], '/muscle/bench')])
def test_a_topic_is_not_recorded_twice(names, twice, made, tmp_path):
    recorder = made(topics=['pressure', 'force'], extra_topics=[
        f'{name}=sensor_msgs/msg/FluidPressure' for name in names])
    recorder.trigger_configure()
    assert str(recorder.input_error) == (
        f'parameter extra_topics: {names[-1]!r} is {twice}, which is recorded anyway; '
        'leave it out')
    assert not recorder.subscriptions_polled and not (tmp_path / 'bag').exists()


@pytest.mark.parametrize('text', ['["a"]', '7', 'null'])
def test_a_metadata_file_holds_an_object(text, made, tmp_path):
    file = tmp_path / 'metadata.json'
    file.write_text(text)
    recorder = made(metadata_file=str(file))
    recorder.trigger_configure()
    assert str(recorder.input_error) == f'{file}: is no JSON object, {{"NAME": "TEXT"}}'
    assert not (tmp_path / 'bag').exists()


def test_a_bag_is_finished_where_the_activation_fails_after_it_was_opened(made, tmp_path):
    recorder = made()

    def broken():
        raise RuntimeError('broken on purpose')
    recorder._wait_for_publishers = broken
    recorder.trigger_configure()
    recorder.trigger_activate()
    assert recorder.core is None
    assert (tmp_path / 'bag' / 'metadata.yaml').is_file()


@pytest.mark.parametrize('lasts', [False, True])
def test_a_loop_that_fails_leaves_a_whole_bag(lasts, made, tmp_path):
    recorder = made()
    recorder.trigger_configure()
    recorder.trigger_activate()
    taken, take_all = [], recorder._take_all

    def broken():
        taken.append(1)
        if lasts or len(taken) == 1:
            raise RuntimeError('broken on purpose')
        return take_all()
    recorder._take_all = broken
    wait_for(lambda: recorder.loops.run_once() or recorder.exit_code, 5.0, 'the failure')
    recorder.finish('ended')
    assert len(taken) > 1 and recorder.core is None
    assert (recorder.exit_code, recorder.result_code) == (1, int(lasts))
    ending = ending_of(bag_info(tmp_path / 'bag').metadata)
    assert ending.ended == 'error'
    assert ending.because == 'the loop of this node failed: broken on purpose'


def test_the_bag_of_a_remapped_rig_says_which_topic_is_which(tmp_path):
    lock = DomainLock()
    context = local_context(lock.domain_id)
    recorder = ExperimentRecorder(
        context=context, namespace='/lab/arm', enable_rosout=False,
        cli_args=['--ros-args', '-r', 'pressure:=/daq/p1', '-r', '/diagnostics:=/lab/health'],
        parameter_overrides=[Parameter('output', value=str(tmp_path / 'bag')),
                             Parameter('topics', value=['pressure', 'force', 'diagnostics'])])
    sensor = rclpy.create_node('sensor', context=context)
    try:
        recorder.trigger_configure()
        recorder.trigger_activate()
        publisher = sensor.create_publisher(FluidPressure, '/daq/p1', qos.PUBLISHER)
        wait_for(lambda: publisher.get_subscription_count() > 0
                 and recorder.count_publishers('/daq/p1') > 0, 10.0, 'the subscription')
        for number in range(5):
            publisher.publish(message(number))
        recorder.trigger_deactivate()
    finally:
        sensor.destroy_node()
        recorder.destroy_node()
        rclpy.try_shutdown(context=context)
        lock.release()
    bag = read_bag(tmp_path / 'bag')
    assert bag.names == {'/lab/arm/pressure': '/daq/p1', '/diagnostics': '/lab/health'}
    assert bag.counts['/lab/arm/pressure'] == 5 and '/daq/p1' not in bag.counts


def test_nodes_that_come_up_with_the_recorder_are_recorded_from_their_first_message(tmp_path):
    bag, rig = tmp_path / 'bag', LiveRig(tmp_path)
    waiting = {'await_subscriber': f'/muscle/{RECORDER}', 'await_timeout_s': 60.0}
    try:
        for name in ('plant_simulator', 'valve_driver'):        # all at once, as launched
            rig.start(name, **waiting)
        rig.start(RECORDER, output=str(bag))
        rig.listen()
        wait_for(lambda: len(rig.heard['pressure']) > 200 and rig.heard['valve_signal'], 60.0,
                 'the rig')
        for name in ('plant_simulator', 'valve_driver', RECORDER):
            rig.processes[name].send_signal(2)
            assert rig.processes[name].wait(20.0)
    finally:
        rig.close()
    info = bag_info(bag)
    assert info.complete
    for topic in ('/muscle/pressure', '/muscle/valve_signal', '/diagnostics'):
        found = info.topic(topic)
        assert found.count and not (found.lost or found.missed_at_start), (topic, found)


def test_a_disk_that_refuses_ends_the_experiment_safely_and_keeps_the_record(tmp_path):
    bag = tmp_path / 'bag'
    plan = make_plan(LONG, 'dmsp_5_300_hanging_mass', None, 'ppr', bag)
    result = session.Result(str(bag))
    limited = []
    with session.RigSession(plan) as rig:
        def fill_the_disk(done_s, total_s):
            if done_s > 1.5 and not limited:
                size = sum(path.stat().st_size for path in bag.iterdir()) + 2000
                limited.append(size)
                resource.prlimit(
                    rig.processes[RECORDER].pid, resource.RLIMIT_FSIZE, (size, size))

        session.run_guarded(rig, result, fill_the_disk)
        driver = rig.group.started.statuses['/muscle/valve_driver']
    plan.remove()
    assert 'experiment_recorder ended with exit code 1' in result.failure
    assert 'writing failed (File too large)' in result.failure
    assert 2.0 < result.duration_s < 12.0
    assert result.exit_codes.pop(RECORDER) == 1 and set(result.exit_codes.values()) == {0}
    assert driver[1] == 'deactivated'           # with the signal that vents
    recover_bag(bag)
    info = bag_info(bag)
    assert sum(result.recorded.values()) == info.message_count
    assert info.message_count > 500 and info.complete is False
    for counts in independent_readers(bag).values():
        assert sum(counts.values()) == info.message_count

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

"""A publisher that a subscription cannot receive is named, with the line that helps."""

import time
from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy')

from live_rig import wait_for                                               # noqa: E402, I100
from pam_actuation.nodes import qos, simulated_time                         # noqa: E402
from pam_actuation.nodes.endpoints import PolledSubscription                # noqa: E402
from pam_actuation.nodes.lockstep import TickInputs                         # noqa: E402
from pam_actuation.nodes.parameters import unused_qos                       # noqa: E402
from pam_actuation.nodes.simulated_time import FollowedTime                 # noqa: E402
from pam_actuation.rigging.client import local_context                      # noqa: E402
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
from pam_actuation.topics.codec import Reader                               # noqa: E402
import rclpy                                                                # noqa: E402
from rclpy.node import Node                                                 # noqa: E402
from rclpy.parameter import Parameter                                       # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy       # noqa: E402
from rosgraph_msgs.msg import Clock                                         # noqa: E402
from sensor_msgs.msg import FluidPressure, JointState                       # noqa: E402
from std_msgs.msg import Float64                                            # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.shared]

BEST_EFFORT = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
WILLING = '/muscle/willing', '/lab/imu'      # in the namespace of the node, and elsewhere
LINE = 'qos_overrides./muscle/pressure.subscription.reliability'


@pytest.fixture(scope='module')
def nodes():
    """Return a node that subscribes and one that is a sensor, each a participant of its own."""
    lock = DomainLock()
    contexts = [local_context(lock.domain_id) for _ in range(2)]
    listener = Node('listener', namespace='/muscle', context=contexts[0], parameter_overrides=[
        Parameter(LINE.replace('/muscle/pressure', topic), value='best_effort')
        for topic in WILLING])
    sensor = Node('sensor', namespace='/lab', context=contexts[1])
    yield listener, sensor
    for node, context in zip((listener, sensor), contexts):
        node.destroy_node()
        rclpy.try_shutdown(context=context)
    lock.release()


def test_a_best_effort_sensor_is_named_as_long_as_it_is_there(nodes):
    listener, sensor = nodes
    subscription = PolledSubscription(listener, FluidPressure, 'pressure')
    assert subscription.mismatches.sentences() == []
    sound = sensor.create_publisher(FluidPressure, '/muscle/pressure', qos.PUBLISHER)
    wait_for(lambda: subscription.publishers == 1, 10.0, 'the reliable publisher')
    assert subscription.mismatches.sentences() == []
    deaf = sensor.create_publisher(FluidPressure, '/muscle/pressure', BEST_EFFORT)
    wait_for(subscription.mismatches.sentences, 10.0, 'the sentence')
    assert subscription.mismatches.sentences() == [
        '/lab/sensor sends /muscle/pressure best effort, which is not received here; let it '
        f'publish reliable, or start this node with -p {LINE}:=best_effort']
    sensor.destroy_publisher(deaf)
    wait_for(lambda: not subscription.mismatches.sentences(), 10.0, 'the end of the sentence')
    deaf = sensor.create_publisher(FluidPressure, '/muscle/pressure', BEST_EFFORT)
    wait_for(subscription.mismatches.sentences, 10.0, 'the sentence on another one')
    for publisher in (deaf, sound):
        sensor.destroy_publisher(publisher)
    subscription.destroy()


@pytest.mark.parametrize('topic', WILLING)
def test_the_line_of_the_sentence_helps(nodes, topic):
    listener, sensor = nodes
    subscription = PolledSubscription(listener, FluidPressure, topic.removeprefix('/muscle/'))
    publisher = sensor.create_publisher(FluidPressure, topic, BEST_EFFORT)
    wait_for(lambda: subscription.publishers == 1, 10.0, 'the publisher')
    publisher.publish(FluidPressure(fluid_pressure=2e5))
    wait_for(lambda: [message.fluid_pressure for message, _ in subscription.take()] == [2e5],
             10.0, 'the message')
    time.sleep(0.1)
    assert subscription.mismatches.sentences() == []
    subscription.destroy()
    # It changed this topic alone.
    assert qos.CONSUMER.reliability == qos.PUBLISHER.reliability == ReliabilityPolicy.RELIABLE


def test_a_line_that_no_topic_takes_is_told(nodes):
    listener, _ = nodes
    subscription = PolledSubscription(listener, FluidPressure, 'pressure')
    wrong = [f'qos_overrides.{name}' for name in (
        '/muscle/presure.subscription.depth', '/muscle/pressure.subscription.durability',
        '/clock.subscription.depth')]
    given = {name: Parameter(name, value=1) for name in (LINE, *wrong)}
    asked = SimpleNamespace(
        _parameter_overrides=given, get_parameters_by_prefix=listener.get_parameters_by_prefix)
    first, second = unused_qos(asked)
    assert first == (f'parameter {wrong[0]} is not known here, ignored; did you mean '
                     'qos_overrides./muscle/pressure.subscription.depth?')
    assert second.startswith(f'parameter {wrong[1]} is not known here, ignored')
    subscription.destroy()


def heard_clock(player, followed):
    """Return a publisher of ``/clock``, best effort, whose 42 s have arrived."""
    clock = player.create_publisher(Clock, '/clock', BEST_EFFORT)
    message = Clock()
    message.clock.sec = 42

    def arrived():
        clock.publish(message)
        followed.wait_until(0)
        return followed.now_ns() == 42_000_000_000

    wait_for(arrived, 10.0, 'the time of the clock')
    return clock


def test_a_clock_that_is_offered_best_effort_is_followed(nodes):
    """As ``ros2 bag play --clock`` and Gazebo offer it."""
    listener, player = nodes
    followed = FollowedTime(listener, TickInputs(list, False, print))
    followed.begin()
    clock = heard_clock(player, followed)
    followed.close()
    player.destroy_publisher(clock)


def test_a_time_that_stands_still_is_told(nodes, monkeypatch):
    """A node that waits for a clock does nothing, and would say that it is active."""
    listener, player = nodes
    monkeypatch.setattr(simulated_time, 'STANDS_STILL_S', 0.3)
    followed = FollowedTime(listener, TickInputs(list, False, print))
    followed.begin()
    assert followed.remarks() == []
    time.sleep(0.4)
    told = 'use_sim_time is set and nothing came on /clock {}, so this node stands still'
    assert followed.remarks() == [told.format('since it became active')]
    clock = heard_clock(player, followed)
    assert followed.remarks() == []
    time.sleep(0.4)
    assert followed.remarks() == [told.format('for 0 s')]
    followed.close()
    player.destroy_publisher(clock)


def test_a_message_of_several_joints_is_told(nodes):
    """As that of ``/joint_states``: the controller of either knee would follow the first one."""
    listener, sensor = nodes
    subscription = PolledSubscription(
        listener, JointState, '/joint_states', raw=True, read=Reader('joint_state'))
    publisher = sensor.create_publisher(JointState, '/joint_states', qos.PUBLISHER)
    wait_for(lambda: subscription.publishers == 1, 10.0, 'the publisher')

    def after(names):
        publisher.publish(JointState(name=names, position=[0.1] * len(names)))
        wait_for(subscription.take, 10.0, 'the message')
        return subscription.remarks()

    assert after(['left_knee']) == []
    assert after(['left_knee', 'right_knee']) == [
        '/joint_states has 2 entries (left_knee, right_knee), and the first one counts here; give '
        'each a topic of its own']
    assert after(['left_knee']) == []
    subscription.destroy()
    sensor.destroy_publisher(publisher)


def test_a_publisher_of_another_type_is_named(nodes):
    """Nothing of it arrives, and a driver then says that no pressure is measured."""
    listener, sensor = nodes
    subscription = PolledSubscription(listener, FluidPressure, 'bare')
    assert subscription.remarks() == []
    other = sensor.create_publisher(Float64, '/muscle/bare', qos.PUBLISHER)
    wait_for(subscription.remarks, 10.0, 'the sentence')
    assert subscription.remarks() == [
        '/lab/sensor sends /muscle/bare as std_msgs/msg/Float64, which is not received here; '
        'send it as sensor_msgs/msg/FluidPressure']
    sensor.destroy_publisher(other)
    wait_for(lambda: not subscription.remarks(), 10.0, 'the end of the sentence')
    subscription.destroy()


def test_another_mismatch_is_told_by_its_reason(nodes):
    listener, sensor = nodes
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    subscription = PolledSubscription(listener, FluidPressure, 'late', latched)
    sensor.create_publisher(FluidPressure, '/muscle/late', qos.PUBLISHER)
    wait_for(subscription.mismatches.sentences, 10.0, 'the sentence')
    sentence, = subscription.mismatches.sentences()
    assert sentence.startswith('/lab/sensor cannot be received on /muscle/late: ')
    assert 'volatile' in sentence.lower()
    subscription.destroy()

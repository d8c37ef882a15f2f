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

"""Test that a node which loses the processor takes nothing for a message from the future."""

import threading
import time

import pytest

pytest.importorskip('rclpy')

from pam_actuation.messages import Contraction, JointAngle                  # noqa: E402, I100
from pam_actuation.messages import Pressure, ValveSignal                    # noqa: E402
from pam_actuation.nodes import qos                                         # noqa: E402
from pam_actuation.nodes.interfaces import node_class                       # noqa: E402
from pam_actuation.nodes.ros_messages import class_of                       # noqa: E402
from pam_actuation.topics.codec import Writer                               # noqa: E402
from rclpy.node import Node                                                 # noqa: E402
from rclpy.parameter import Parameter                                       # noqa: E402

pytestmark = pytest.mark.ros

LOST_S = 0.04           # the processor is away, right after the clock was read
STEP_NS = 1_000_000     # of physics
OPENING = ValveSignal(0, ('ppr_voltage',), (2.0,))
SENT = {
    'pressure': lambda now_ns: Pressure(now_ns, 2e5 + now_ns % 1000),
    'pressure_command': lambda now_ns: Pressure(now_ns, 2e5),
    'contraction': lambda now_ns: Contraction(now_ns, 0.001 + now_ns % 1000 * 1e-9),
    'joint_state': lambda now_ns: JointAngle(now_ns, 0.1 + now_ns % 1000 * 1e-6),
    'valve_signal': lambda now_ns: ValveSignal(now_ns, OPENING.names, OPENING.efforts),
    'flexor/valve_signal': lambda now_ns: ValveSignal(now_ns, OPENING.names, OPENING.efforts)}


class Sender:
    """Send fresh messages on some topics every 4 ms."""

    def __init__(self, context, topics):
        self._node = Node('sender', namespace='/muscle', context=context)
        self._topics = {
            topic: (self._node.create_publisher(class_of(topic), topic, qos.PUBLISHER),
                    Writer(topic)) for topic in topics}
        self.last_ns = 0
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        while not self._ending.wait(0.004):
            now_ns = time.time_ns()
            for topic, (publisher, writer) in self._topics.items():
                publisher.publish(writer.fill(SENT[topic](now_ns)))

    def end(self):
        self._ending.set()
        self._thread.join()
        self._node.destroy_node()


def ticked(context, name, topics, look, lost_every=1, lost_s=LOST_S, **parameters):
    """Tick a node 12 times, in some the clock stands still after it was read; call ``look``."""
    class Preempted(node_class(name)):
        lost = False

        def now_ns(self):
            now_ns = super().now_ns()
            if self.lost:
                self.lost = False
                time.sleep(lost_s)
            return now_ns

    node = Preempted(context=context, namespace='/muscle', enable_rosout=False,
                     parameter_overrides=[Parameter(key, value=value) for key, value in (
                         ('autostart', False), *parameters.items())])
    sender = Sender(context, topics)
    try:
        node.trigger_configure()
        node.trigger_activate()
        deadline = time.monotonic() + 10.0
        while not all(one.publishers for one in node.subscriptions_polled
                      if one.topic.removeprefix('/muscle/') in topics):
            assert time.monotonic() < deadline
            time.sleep(0.01)
        time.sleep(0.1)
        node.tick()
        for k in range(12):
            node.lost = k % lost_every == 0
            node.tick()
            look(node)
    finally:
        sender.end()
        node.finish('over')
        node.destroy_node()


@pytest.mark.parametrize('name, topics', [
    ('pid_controller', ('contraction', 'pressure')), ('sofc_controller', ('contraction',)),
    ('joint_controller', ('joint_state',))])
def test_a_controller_does_not_read_the_clock_before_its_messages(context, name, topics):
    reasons = []
    ticked(context, name, topics, lambda node: reasons.append(node.loop.reason))
    assert {reason for reason in reasons if 'ahead' in reason} == set()
    assert reasons[-1] == 'no reference yet'


def test_the_driver_takes_nothing_for_a_message_from_the_future(context):
    problems = []

    def look(node):
        safety = node.loop.safety
        problems.extend((safety.pressure.problem, safety.command_problem))
        assert safety.pressure.received and safety.commands_received

    ticked(context, 'valve_driver', ('pressure', 'pressure_command'), look)
    # On a busy machine messages may come too late; nothing else may be wrong with them.
    assert [problem for problem in problems if problem and 'ms old' not in problem] == []


@pytest.mark.parametrize('name, topic', [
    ('plant_simulator', 'valve_signal'), ('joint_simulator', 'flexor/valve_signal')])
def test_physics_reaches_the_signals_it_takes(context, name, topic):
    ahead_ns = []
    steps = []

    def look(node):
        subscription = next(one for one in node.subscriptions_polled
                            if one.topic == f'/muscle/{topic}')
        steps.append(node.plant.steps)
        held_back = steps[-2:] == [steps[-1]] * 2       # late by 50 ms: it waits for the rest
        if subscription.newest is not None and not held_back:
            ahead_ns.append(subscription.newest.stamp_ns - node.plant.now_ns)

    ticked(context, name, (topic,), look)
    assert ahead_ns and max(ahead_ns) <= STEP_NS


def test_the_watchdog_counts_silence_from_when_it_listened(context):
    vents = []
    ticked(context, 'valve_watchdog', ('valve_signal',),
           lambda node: vents.append(node.watchdog.vents), lost_every=3, lost_s=0.25,
           timeout_s=0.2)
    assert vents[-1] == 0

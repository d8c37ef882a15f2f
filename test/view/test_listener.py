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

"""The listener on real DDS: it finds topics and drivers that come later, and lost ones."""

import math
import time
import urllib.error
import urllib.request

from pam_actuation import messages
import pytest

pytest.importorskip('rclpy')

from pam_actuation.nodes import qos  # noqa: E402, I100
from pam_actuation.nodes.operator import serving  # noqa: E402
from pam_actuation.nodes.ros_messages import class_of  # noqa: E402
from pam_actuation.nodes.view_listener import ViewListener  # noqa: E402
from pam_actuation.rigging.client import local_context  # noqa: E402
from pam_actuation.rigging.domain import DomainLock  # noqa: E402
from pam_actuation.rigging.view_process import page_beside  # noqa: E402
from pam_actuation.topics.codec import decode, encode  # noqa: E402
from pam_actuation.view.requests import Request  # noqa: E402
import rclpy  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.shared]


@pytest.fixture
def domain():
    """Return a ROS domain of its own."""
    lock = DomainLock()
    yield lock.domain_id
    lock.release()


def offering(context, namespace):
    """Return the node of a driver with its services, and the list of what it was asked."""
    node, calls = Node('valve_driver', namespace=namespace, context=context), []

    def answer(action):
        def called(request, response):
            calls.append(action)
            response.success, response.message = True, f'{action} done'
            return response
        return called

    for action in ('emergency_stop', 'reset'):
        node.create_service(Trigger, f'~/{action}', answer(action))
    return node, calls


@pytest.fixture
def driver(domain):
    """Return (node, executor, calls) of a driver that answers its services."""
    context = local_context(domain)
    node, calls = offering(context, '/muscle')
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    yield node, executor, calls
    executor.shutdown()
    node.destroy_node()
    rclpy.try_shutdown(context=context)


def until(listener, executor, condition, each=lambda: None, timeout_s=15.0):
    """Run listener and driver in turn until a condition holds."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline
        each()
        executor.spin_once(timeout_sec=0.0)
        listener.run_once()


def test_signals_states_and_the_emergency_stop_of_a_driver(domain, driver):
    node, executor, calls = driver
    listener = ViewListener(domain)
    try:
        pressure = node.create_publisher(class_of('pressure'), 'pressure', qos.PUBLISHER)
        health = node.create_publisher(class_of('diagnostics'), '/diagnostics', qos.PUBLISHER)

        def send():
            now_ns = time.time_ns()
            pressure.publish(encode('pressure', messages.Pressure(now_ns, 3.0e5)))
            health.publish(encode('diagnostics', messages.Status(
                now_ns, 2, '/muscle/valve_driver', 'vents: no command')))

        store = listener.store
        until(listener, executor, lambda: store.namespaces() == ['/muscle'] and listener.drivers()
              and store.state(store.now_ns())['nodes'], send)
        assert listener.drivers() == ['/muscle/valve_driver']
        history = store.histories['/muscle', 'pressure']
        assert (history.values('pressure_pa') == 3.0e5).all()
        known, = store.state(store.now_ns())['nodes']
        assert (known['level'], known['message']) == (2, 'vents: no command')
        answers = []
        listener.act(Request('emergency_stop'), answers.append)
        until(listener, executor, lambda: answers, send)
        assert calls == ['emergency_stop'] and answers[0] == [
            {'node': '/muscle/valve_driver', 'ok': True, 'message': 'emergency_stop done'}]
        # A driver that hangs: its executor does not run.
        answers.clear()
        listener.act(Request('reset', view='/muscle'), answers.append)
        begin_s = time.monotonic()
        while not answers:
            listener.run_once()
            assert time.monotonic() < begin_s + 10.0
        assert answers[0][0]['ok'] is False and 'no answer' in answers[0][0]['message']
    finally:
        listener.close()


def test_a_reset_goes_to_the_rig_that_is_shown_and_a_stop_to_all(domain, driver):
    node, executor, calls = driver
    other, calls_of_other = offering(node.context, '/right_knee/flexor')
    executor.add_node(other)
    listener = ViewListener(domain)
    try:
        until(listener, executor, lambda: len(listener.drivers()) == 2)
        for do, view, asked in (
                ('reset', '/muscle', (1, 0)), ('reset', '/right_knee', (0, 1)),
                ('reset', '/right', (0, 0)), ('reset', '', (1, 1)),
                ('emergency_stop', '/muscle', (1, 1))):
            answers = []
            listener.act(Request(do, view=view), answers.append)
            until(listener, executor, lambda: answers)
            assert (len(calls), len(calls_of_other)) == asked, (do, view)
            assert len(answers[0]) == sum(asked) and all(one['ok'] for one in answers[0])
            calls.clear()
            calls_of_other.clear()
    finally:
        executor.remove_node(other)
        other.destroy_node()
        listener.close()


def test_a_stop_reaches_a_driver_that_came_since_the_last_look(domain, driver):
    node, executor, calls = driver
    listener = ViewListener(domain)
    other, calls_of_other = None, []
    try:
        until(listener, executor, listener.drivers)
        listener._look_at_s = math.inf
        other, calls_of_other = offering(node.context, '/right_knee')
        executor.add_node(other)
        until(listener, executor, lambda: len(
            serving(listener._node, '', 'emergency_stop')) == 2)
        assert listener.drivers() == ['/muscle/valve_driver']
        answers = []
        listener.act(Request('emergency_stop'), answers.append)
        until(listener, executor, lambda: answers)
        assert calls == calls_of_other == ['emergency_stop']
        assert sorted(one['node'] for one in answers[0] if one['ok']) == [
            '/muscle/valve_driver', '/right_knee/valve_driver']
    finally:
        if other is not None:
            executor.remove_node(other)
            other.destroy_node()
        listener.close()


def test_a_marker_reaches_the_recorder_and_every_page(domain, driver):
    node, executor, _ = driver
    listener, other = ViewListener(domain), ViewListener(domain)
    recorder = Node('experiment_recorder', namespace='/muscle', context=node.context)
    try:
        pressure = node.create_publisher(class_of('pressure'), 'pressure', qos.PUBLISHER)
        recorded, stamps = [], []
        recorder.create_subscription(class_of('marker'), 'marker', recorded.append, 10, raw=True)
        executor.add_node(recorder)

        def send():
            stamps.append(time.time_ns())
            pressure.publish(encode('pressure', messages.Pressure(stamps[-1], 3.0e5)))
            other.run_once()

        answers = []

        def ready():
            # A subscription may be known before the name of its node is.
            names = [one.node_name for one in listener._node.get_subscriptions_info_by_topic(
                '/muscle/marker')]
            return node.count_subscribers('/muscle/marker') == 3 and (
                'experiment_recorder' in names
                and other.store.namespaces() and listener.store.namespaces())

        until(listener, executor, ready, send)
        listener.act(Request('mark', view='/muscle', text='valve open'), answers.append)
        until(listener, executor, lambda: recorded and other.store.markers, send)
        assert answers[0] == [{'node': '/muscle', 'ok': True, 'message': 'recorded'}]
        marker = decode('marker', recorded[0])
        assert marker.text == 'valve open' and marker.stamp_ns in stamps     # time of the rig
        assert '/pam_view_' in marker.source
        for store in (listener.store, other.store):     # once, though its own comes back too
            assert store.markers == [('/muscle', marker)]
        answers.clear()
        listener.act(Request('mark', view='/elsewhere', text='x'), answers.append)
        until(listener, executor, lambda: answers, send)
        assert answers[0] == [] and len(recorded) == 1
    finally:
        executor.remove_node(recorder)
        recorder.destroy_node()
        listener.close()
        other.close()


def test_publishers_keep_nothing_for_it(domain, driver):
    node, executor, _ = driver
    listener = ViewListener(domain)
    try:
        pressure = node.create_publisher(class_of('pressure'), 'pressure', qos.PUBLISHER)

        def send():
            pressure.publish(encode('pressure', messages.Pressure(time.time_ns(), 3.0e5)))

        until(listener, executor, listener.store.namespaces, send)
        # The listener takes nothing meanwhile; a reliable one would leave these unconfirmed.
        for _ in range(3000):
            send()
        assert pressure.wait_for_all_acked(rclpy.duration.Duration(seconds=0.0))
        infos = node.get_subscriptions_info_by_topic('/muscle/pressure')
        assert [info.qos_profile.reliability.name for info in infos] == ['BEST_EFFORT']
        listener.run_once()
        # Only its own last messages are there, and it tells how many are not.
        assert listener.store.lost['/muscle', 'pressure'] >= 2000
    finally:
        listener.close()


def test_a_page_beside_a_rig_is_there_while_the_rig_is(domain, tmp_path):
    with page_beside(domain, tmp_path) as url:
        with urllib.request.urlopen(url) as answer:
            assert b'<title>pam view</title>' in answer.read()
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(url)

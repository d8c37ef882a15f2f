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

"""Start nodes as processes and listen to them: what the tests of the nodes share."""

import collections
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray
from pam_actuation.messages import Pressure
from pam_actuation.nodes import qos
from pam_actuation.nodes.endpoints import PolledSubscription
from pam_actuation.nodes.ros_messages import class_of
from pam_actuation.rigging import node_template
from pam_actuation.rigging.client import local_context
from pam_actuation.rigging.domain import DomainLock
from pam_actuation.rigging.processes import end_all, node_environment, NodeProcess
from pam_actuation.topics.codec import Reader, Writer
from pam_actuation.topics.table import OF_A_RUN
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

NAMESPACE = '/muscle'
LISTEN_PERIOD_S = 0.002

Heard = collections.namedtuple('Heard', 'time_s plain sequence')
Health = collections.namedtuple('Health', 'time_s level message values')


class LiveRig:
    """Processes in a domain of their own, and a node that hears every topic of theirs."""

    def __init__(self, log_dir, namespace=NAMESPACE):
        self._log_dir = log_dir
        self._namespace = namespace
        self._lock = DomainLock()
        self.domain_id = self._lock.domain_id
        self.environment = node_environment(self.domain_id, log_dir)
        self.processes = {}
        self._started = []
        self.heard = {topic: [] for topic in OF_A_RUN}
        self.health = collections.defaultdict(list)
        self._context = None
        self._polled = []

    def start(self, name, below='', **parameters):
        """
        Start a node; real-time, where allowed, makes the tests bear a busy machine.

        ``below`` is a namespace under that of the rig; the process is ``below/name`` then.
        """
        parameters = {'realtime_priority': 1, **parameters}
        log_dir = self._log_dir / below
        log_dir.mkdir(exist_ok=True)
        process = NodeProcess(
            name, f'{self._namespace}/{below}'.rstrip('/'), parameters, self.environment,
            log_dir, template=node_template.template_for(
                node_template.OF_A_RUN, self.environment))
        # Also those that others replace by name: after a failed test they may still run.
        self._started.append(process)
        self.processes[f'{below}/{name}' if below else name] = process

    def listen(self, topics=tuple(OF_A_RUN)):
        """
        Join the graph; processes are started before (forking with threads is unsafe).

        By default to all topics of a muscle.
        """
        self._context = local_context(self.domain_id)
        self.node = Node('listener', namespace=self._namespace, context=self._context)
        for topic in topics:
            self.hear(class_of(topic), topic, self._hearer(topic), read=Reader(topic))
        self.hear(DiagnosticArray, '/diagnostics', self._on_diagnostics)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._ending = threading.Event()
        self._threads = [threading.Thread(target=self._spin, daemon=True),
                         threading.Thread(target=self._take, daemon=True)]
        for thread in self._threads:
            thread.start()

    def hear(self, message_type, topic, handler, profile=None, read=None):
        """
        Subscribe; the handler gets each message and what rclpy says about it.

        Messages are those of ROS, with ``read`` what it makes of their bytes.

        Polled: an executor waits anew on every entity for each message, and falls seconds
        behind a whole rig on a busy machine.
        """
        name = topic if topic.startswith('/') else f'{self._namespace}/{topic}'
        self._polled.append((
            PolledSubscription(self.node, message_type, name, profile or qos.reliable(1000),
                               raw=read is not None, read=read),
            handler))

    def _spin(self):
        try:
            self._executor.spin()       # what is left to it are the services
        except ExternalShutdownException:
            pass

    def _take(self):
        while not self._ending.wait(LISTEN_PERIOD_S):
            for subscription, handler in list(self._polled):
                for message, info in subscription.take():
                    handler(message, info)

    def _hearer(self, topic):
        def hear(message, info):
            self.heard[topic].append(Heard(
                time.monotonic(), message, info['publication_sequence_number']))
        return hear

    def _on_diagnostics(self, message, _):
        for status in message.status:
            self.health[status.name.rsplit('/', 1)[-1]].append(Health(
                time.monotonic(), status.level[0], status.message,
                {item.key: item.value for item in status.values}))

    def call(self, service_type, name, request=None, timeout_s=5.0):
        """Call a service of the rig and return its response."""
        client = self.node.create_client(service_type, f'{self._namespace}/{name}')
        assert client.wait_for_service(timeout_s), f'no service {name}'
        future = client.call_async(request or service_type.Request())
        wait_for(future.done, timeout_s, f'the answer of {name}')
        self.node.destroy_client(client)
        return future.result()

    def publisher(self, topic):
        """Return a publisher of the listener's own."""
        return self.node.create_publisher(class_of(topic), topic, qos.PUBLISHER)

    def close(self):
        """End everything."""
        end_all(self._started)
        if self._context is not None:
            self._ending.set()
            self._executor.shutdown(timeout_sec=1.0)
            for thread in self._threads:
                thread.join(2.0)
            self.node.destroy_node()
            rclpy.try_shutdown(context=self._context)
        self._lock.release()


class Commander:
    """Publish a constant pressure command at 100 Hz, stamped with the time."""

    def __init__(self, rig, command_pa):
        self._publisher = rig.publisher('pressure_command')
        self._writer = Writer('pressure_command')
        self._command_pa = command_pa
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        while not self._ending.wait(0.01):
            command = Pressure(time.time_ns(), self._command_pa)
            self._publisher.publish(self._writer.fill(command))

    def end(self):
        """Fall silent."""
        self._ending.set()
        self._thread.join()


def wait_for(condition, timeout_s, what):
    """Wait until a condition holds; fail with a sentence."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, f'{what} did not come within {timeout_s} s'
        time.sleep(0.005)

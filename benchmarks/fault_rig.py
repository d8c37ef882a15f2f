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

"""
The rig of the fault table: real nodes as processes, a relay that spoils sensors, a witness.

Run as a program it is the relay. Sensors of the plant come in on ``true/...`` and go out on the
topics of the rig. On the way they are spoiled as the lines on its standard input ask for.
"""

import collections
import math
import os
import re
import signal
import subprocess
import sys
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray
from pam_actuation.messages import Pressure, SAFE_EFFORTS
from pam_actuation.nodes import qos
from pam_actuation.nodes.endpoints import PolledSubscription
from pam_actuation.nodes.ros_messages import class_of
from pam_actuation.nodes.senders import WriterNames
from pam_actuation.rigging.client import RigClient
from pam_actuation.rigging.domain import DomainLock
from pam_actuation.rigging.processes import end_all, node_environment, NodeProcess
from pam_actuation.topics.codec import Reader, Writer
from pam_sim.units import NS_PER_S, P_ATM_PA
import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

NAMESPACE = '/muscle'
RIG = 'dmsp_5_300_realistic'
EXPERIMENT = """
name: swing
domain: contraction
segments:
  - ramp: {to_m: 0.004, duration_s: 1.0}
  - sine: {center_m: 0.014, amplitude_m: 0.010, frequency_hz: 0.5, cycles: 1000}
"""
RELAYED = ('pressure', 'supply_pressure', 'contraction')
HEARD = ('valve_signal', 'pressure_command', 'true/pressure')
# What each node says when all is well.
SOUND = {
    'experiment_recorder': 'recording', 'plant_simulator': 'active',
    'valve_driver': 'following the pressure command', 'valve_watchdog': 'hears the driver',
    'sofc_controller': 'following the reference',
    'pid_controller': 'following the reference', 'reference_generator': 'playing swing'}
HEALTH_PERIOD_S = 0.1       # so that a sound rig is noticed soon
FLOOD_PER_ROUND = 4         # messages, about every 2 ms
DELAY_S = 0.4
FAR_S = 1.0
NEAR_SUPPLY_PA = P_ATM_PA + 30_000.0
ABSURD = {'pressure': 3.0e6, 'supply_pressure': 3.0e7, 'contraction': 1.0}

Status = collections.namedtuple('Status', 'stamp_ns level message values')


class FaultRig:
    """
    Six nodes and the relay in a domain of their own.

    Parameters
    ----------
    valve : {'ppr', 'hsv'}
    folder : Path
        For bags and logs.
    controller : str
        Name of the controller node.
    experiment : str
        YAML text of what the reference plays.
    without : tuple of str
        Nodes that are left out.
    heard : tuple of str
        Topics that the witness hears.

    """

    def __init__(self, valve, folder, controller='sofc_controller', experiment=EXPERIMENT,
                 without=(), heard=HEARD):
        self.valve = valve
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self._lock = DomainLock()
        self.environment = node_environment(self._lock.domain_id, folder)
        experiment_file = folder / 'swing.yaml'
        experiment_file.write_text(experiment)
        kind = {'valve_type': valve}
        self._parameters = {
            'experiment_recorder': kind, 'plant_simulator': {**kind, 'rig': RIG},
            'valve_driver': {**kind, 'rig': RIG}, 'valve_watchdog': kind,
            controller: {**kind, 'rig': RIG},
            'reference_generator': {**kind, 'experiment': str(experiment_file)}}
        self._parameters = {name: given for name, given in self._parameters.items()
                            if name not in without}
        self.processes = {}
        self.bag = None
        self._bags = 0
        self._recorded_before = None
        self.stranger = None        # a process that may send what it should not
        self._relay = subprocess.Popen(
            [sys.executable, __file__], env=self.environment, stdin=subprocess.PIPE, text=True,
            start_new_session=True)
        for name in self._parameters:
            self.start(name)
        self.witness = Witness(self._lock.domain_id, valve, heard)

    def start(self, name):
        """Start a node, the recorder with a new bag."""
        parameters = {'realtime_priority': 1, 'diagnostics_period_s': HEALTH_PERIOD_S,
                      **self._parameters[name]}
        if name == 'experiment_recorder':
            self.bag = self.folder / f'bag_{self._bags}'
            self._bags += 1
            parameters['output'] = str(self.bag)
        remap = {topic: f'true/{topic}' for topic in RELAYED} if name == 'plant_simulator' else {}
        self.processes[name] = NodeProcess(
            name, NAMESPACE, parameters, self.environment, self.folder, remap)

    def spoil(self, topic, how):
        """Have the relay spoil a sensor, or stop it with ``none``."""
        self._relay.stdin.write(f'{topic} {how}\n')
        self._relay.stdin.flush()

    def signal(self, name, number):
        """Send a signal to a node."""
        self.processes[name].send_signal(number)

    def wait_until_sound(self, timeout_s):
        """Wait until every node says that all is well and the bag grows; return whether."""
        begin_ns = time.time_ns()
        self._recorded_before = None
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline and all(
                process.running for process in self.processes.values()):
            self.witness.listen(0.05)
            if self._sound(begin_ns):
                return True
        return False

    def what_nodes_say(self):
        """Return, for each node, whether its process runs and its newest status as text."""
        now_ns = time.time_ns()
        said = {}
        for name, process in self.processes.items():
            one = self.witness.last.get(name)
            text = 'nothing' if one is None else (
                f'{one.message} ({(now_ns - one.stamp_ns) * 1e-9:.1f} s ago)')
            said[name] = text if process.running else f'{text}; its process has ended'
        return said

    def _sound(self, since_ns):
        for name in self.processes:
            words = SOUND[name]
            said = self.witness.last.get(name)
            if said is None or said.stamp_ns < since_ns or not said.message.startswith(words):
                return False
        if 'experiment_recorder' not in self.processes:
            return True
        # Discovery takes its time on a busy machine: the bag must grow by what is sent now.
        counts = self.witness.last['experiment_recorder'].values
        recorded = int(counts.get(f'recorded.{NAMESPACE}/valve_signal', 0))
        if self._recorded_before is None:
            self._recorded_before = recorded
        return recorded > self._recorded_before

    def close(self):
        """End everything, the driver first, so that it vents; the recorder closes its bag."""
        for process in self.processes.values():
            process.send_signal(signal.SIGCONT)
        for name in ('valve_driver', 'experiment_recorder'):
            if name in self.processes:
                end_all([self.processes[name]], 30.0)
        end_all(self.processes.values())
        for process in filter(None, (self.stranger, self._relay)):
            process.terminate()
            process.wait(10.0)
        self.witness.close()
        self._lock.release()


class Witness:
    """
    A node that hears what is judged.

    Attributes
    ----------
    last : dict
        Node to its newest ``Status``.
    said : list of (str, Status)
        Every change of a status since ``forget``.
    heard : dict
        Topic to plain messages since ``forget``.
    writers : dict
        Topic to the writers of these messages, GIDs.

    """

    def __init__(self, domain_id, valve, heard=HEARD):
        self._heard = heard
        self._safe = SAFE_EFFORTS[valve]
        self._client = RigClient(domain_id)
        node = self._client.node
        self._sources = {
            topic: PolledSubscription(
                node, class_of(topic), f'{NAMESPACE}/{topic}', qos.RECORDER, raw=True,
                read=Reader(topic), writers=True) for topic in heard}
        self._health = PolledSubscription(node, DiagnosticArray, '/diagnostics', qos.RECORDER)
        self._name_of = WriterNames(node)
        self.last = {}
        self.heard = {}
        self._stood_safe = False
        self.forget()

    def forget(self):
        """Begin anew with what is heard and said; the last valve signal is remembered."""
        if self.heard.get('valve_signal'):
            self._stood_safe = self.heard['valve_signal'][-1].efforts == self._safe
        self.heard = {topic: [] for topic in self._heard}
        self.writers = {topic: [] for topic in self._heard}
        self.said = []

    def listen(self, duration_s):
        """Take what arrives for a while."""
        deadline = time.monotonic() + duration_s
        while True:
            for topic, source in self._sources.items():
                for plain, info in source.take():
                    self.heard[topic].append(plain)
                    self.writers[topic].append(info['writer'])
            for message, _ in self._health.take():
                self._note(message)
            left_s = deadline - time.monotonic()
            if left_s <= 0.0:
                return
            time.sleep(min(left_s, 0.02))

    def _note(self, message):
        for status in message.status:
            name = status.name.rsplit('/', 1)[-1]
            now = Status(NS_PER_S * message.header.stamp.sec + message.header.stamp.nanosec,
                         status.level[0], status.message,
                         {item.key: item.value for item in status.values})
            before = self.last.get(name)
            self.last[name] = now
            if before is None or before[1:3] != now[1:3]:
                self.said.append((name, now))

    def first_said(self, name, words, since_ns):
        """Return the first status of a node since a time that has some words, or None."""
        return next((status for who, status in self.said if who == name
                     and status.stamp_ns >= since_ns and re.search(words, status.message)), None)

    def safe_since(self, since_ns, without=()):
        """
        Return the stamp of the first of three safe valve signals in a row, None if none.

        The time itself where the valve stood at the safe signal already and nothing else came.
        What the writers ``without`` sent does not count.
        """
        after = sorted((one for one, writer in zip(
            self.heard['valve_signal'], self.writers['valve_signal'])
            if one.stamp_ns >= since_ns and writer not in without), key=lambda one: one.stamp_ns)
        if not after and self._stood_safe:
            return since_ns
        safe = [one.efforts == self._safe for one in after]
        return next((after[k].stamp_ns for k in range(len(safe) - 2) if all(safe[k:k + 3])), None)

    def wait_for_node(self, name, timeout_s):
        """Wait until a node is on the graph; TimeoutError if it does not come."""
        deadline = time.monotonic() + timeout_s
        while name not in self._client.node.get_node_names():
            if time.monotonic() > deadline:
                raise TimeoutError(f'{name} did not come up within {timeout_s:g} s')
            self.listen(0.1)

    def wait_for_publishers(self, topic, count, timeout_s):
        """Wait until a topic has some publishers; TimeoutError if they do not come."""
        deadline = time.monotonic() + timeout_s
        while self._client.node.count_publishers(f'{NAMESPACE}/{topic}') < count:
            if time.monotonic() > deadline:
                raise TimeoutError(f'{topic} has not {count} publishers after {timeout_s:g} s')
            self.listen(0.1)

    def new_publisher(self, topic):
        """Return a publisher of a topic of the rig."""
        return self._client.node.create_publisher(
            class_of(topic), f'{NAMESPACE}/{topic}', qos.PUBLISHER)

    def call(self, service_type, name, timeout_s=5.0):
        """Call a service of the rig; TimeoutError if it does not answer."""
        client = self._client.node.create_client(service_type, f'{NAMESPACE}/{name}')
        deadline = time.monotonic() + timeout_s
        while not client.service_is_ready() and time.monotonic() < deadline:
            self.listen(0.02)
        future = client.call_async(service_type.Request())
        while not future.done() and time.monotonic() < deadline:
            self._client.spin(0.01)
        self._client.node.destroy_client(client)
        if not future.done():
            raise TimeoutError(f'{name} did not answer within {timeout_s:g} s')

    def new_listener(self, name, topics):
        """Return a node of the rig's namespace that listens to some topics and does nothing."""
        node = Node(name, namespace=NAMESPACE, context=self._client.node.context,
                    enable_rosout=False, start_parameter_services=False)
        for topic in topics:
            kind = DiagnosticArray if topic == '/diagnostics' else class_of(topic)
            node.create_subscription(kind, topic, lambda message: None, qos.CONSUMER)
        return node

    def is_named(self, writer, name):
        """Tell whether a writer of ``valve_signal`` is that of a node of the rig."""
        return self._name_of(f'{NAMESPACE}/valve_signal', writer) == f'{NAMESPACE}/{name}'

    def atmosphere_since(self, since_ns):
        """Return the stamp of the first command of atmospheric pressure, None if none."""
        return next((one.stamp_ns for one in self.heard['pressure_command']
                     if one.stamp_ns >= since_ns and one.pressure_pa == P_ATM_PA), None)

    def highest_gauge_pa(self):
        """Return the highest gauge pressure [Pa] the plant's own sensor read since ``forget``."""
        return max((one.pressure_pa for one in self.heard['true/pressure']),
                   default=math.nan) - P_ATM_PA

    def close(self):
        """Leave the graph."""
        self._client.close()


def spoiled(topic, how, plain, memory):
    """
    Return the messages to send in place of a sound one.

    ``memory`` is a dict that lives as long as the topic is spoiled this way.
    """
    field = 'contraction_m' if topic == 'contraction' else 'pressure_pa'

    def altered(value=None, later_s=0.0):
        if value is None:
            value = getattr(plain, field)
        return type(plain)(plain.stamp_ns + round(later_s * 1e9), value)

    if how == 'nan':
        return [altered(math.nan)]
    if how == 'absurd':
        return [altered(ABSURD[topic])]
    if how == 'low':
        return [altered(NEAR_SUPPLY_PA)]
    if how == 'frozen':
        return [altered(memory.setdefault('value', getattr(plain, field)))]
    if how == 'silent':
        return []
    if how in ('ahead', 'past'):
        return [altered(later_s=FAR_S if how == 'ahead' else -FAR_S)]
    if how == 'travelling':
        memory['sign'] = -memory.get('sign', 1.0)
        return [altered(later_s=memory['sign'] * FAR_S)]
    if how == 'delayed':
        queue = memory.setdefault('queue', collections.deque())
        queue.append(plain)
        ripe_ns = plain.stamp_ns - DELAY_S * 1e9
        return [queue.popleft() for _ in range(len(queue)) if queue[0].stamp_ns <= ripe_ns]
    return [plain]


def relay():
    """Pass sensors on until stopped; spoil them as asked."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node('sensor_relay', namespace=NAMESPACE)
    sources = {topic: PolledSubscription(
        node, class_of(topic), f'true/{topic}', raw=True, read=Reader(topic))
               for topic in RELAYED}
    sinks = {topic: (node.create_publisher(class_of(topic), topic, qos.PUBLISHER),
                     Writer(topic)) for topic in RELAYED}
    modes = {topic: ('none', {}) for topic in (*RELAYED, 'pressure_command')}
    threading.Thread(target=_read_modes, args=(modes,), daemon=True).start()
    flood = None
    while True:
        sources['contraction'].wait(0.002)
        for topic, source in sources.items():
            publisher, writer = sinks[topic]
            how, memory = modes[topic]
            for message, _ in source.take():
                for plain in spoiled(topic, how, message, memory):
                    publisher.publish(writer.fill(plain))
        if modes['pressure_command'][0] == 'flood':
            flood = flood or (node.create_publisher(
                class_of('pressure_command'), 'pressure_command', qos.PUBLISHER),
                Writer('pressure_command'))
            for k in range(FLOOD_PER_ROUND):
                flood[0].publish(flood[1].fill(Pressure(time.time_ns(), P_ATM_PA + 1e5 * k)))
        elif flood is not None:
            node.destroy_publisher(flood[0])
            flood = None


def _read_modes(modes):
    for line in sys.stdin:
        topic, how = line.split()
        modes[topic] = (how, {})
    os._exit(0)             # whoever asks is gone


if __name__ == '__main__':
    relay()

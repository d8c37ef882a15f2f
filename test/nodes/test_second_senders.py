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

"""Test that two who drive one valve, command one muscle or measure it are vented and named."""

import signal
import subprocess
import sys
import threading
import time

import pytest

pytest.importorskip('rclpy')

from live_rig import Commander, LiveRig, wait_for                           # noqa: E402, I100
from pam_actuation.drivers.senders import is_safe                           # noqa: E402
from pam_actuation.messages import Contraction, Pressure, ValveSignal       # noqa: E402
from pam_actuation.topics.codec import Writer                               # noqa: E402
from pam_sim.units import P_ATM_PA                                          # noqa: E402
from rclpy.node import Node                                                 # noqa: E402

pytestmark = pytest.mark.ros

COMMAND_PA = P_ATM_PA + 300e3
ALLOWED_S = 0.3
DISCOVERED_S = 3.0
FILLING = ('fill_duty', 'vent_duty'), (1.0, 0.0)
KILLED_CONTROLLER = """
import time
from pam_actuation.messages import Pressure
from pam_actuation.nodes.ros_messages import class_of
from pam_actuation.topics.codec import Writer
import rclpy
rclpy.init()
node = rclpy.create_node('former', namespace='/muscle')
publisher = node.create_publisher(class_of('pressure_command'), 'pressure_command', 10)
writer = Writer('pressure_command')
while True:
    publisher.publish(writer.fill(Pressure(time.time_ns(), 401325.0)))
    time.sleep(0.01)
"""


class Stranger:
    """Once discovered, send what ``make`` returns for a time [ns], 500 times a second."""

    def __init__(self, rig, topic, make):
        self._publisher, self._writer = rig.publisher(topic), Writer(topic)
        self._rig, self._make = rig, make
        listening = rig.node.count_subscribers(self._publisher.topic_name)
        wait_for(lambda: self._publisher.get_subscription_count() >= listening, 10.0, 'discovery')
        time.sleep(0.1)             # the other side of it
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self.begin_s = time.monotonic()
        self._thread.start()

    def _run(self):
        while not self._ending.wait(0.002):
            self._publisher.publish(self._writer.fill(self._make(time.time_ns())))

    def end(self):
        self._ending.set()
        self._thread.join()
        self._rig.node.destroy_publisher(self._publisher)


@pytest.fixture(scope='module')
def rig(tmp_path_factory):
    live = LiveRig(tmp_path_factory.mktemp('second'))
    for name in ('plant_simulator', 'valve_driver', 'valve_watchdog'):
        live.start(name, valve_type='hsv', diagnostics_period_s=0.1)
    live.former = subprocess.Popen(
        [sys.executable, '-c', KILLED_CONTROLLER], env=live.environment)
    live.listen()
    yield live
    live.former.kill()
    live.close()


@pytest.fixture
def commander(rig):
    made = Commander(rig, COMMAND_PA)
    yield made
    end(rig, made)


@pytest.fixture(autouse=True)
def without_former(request, rig):
    """Let the former controller be there in the one test that kills it itself."""
    if 'killed_one' not in request.node.name:
        rig.former.kill()
        rig.former.wait()


def end(rig, commander):
    """Let a commander fall silent and leave the graph."""
    commander.end()
    rig.node.destroy_publisher(commander._publisher)


def gauge_pa(rig):
    heard = rig.heard['pressure']
    return heard[-1].plain.pressure_pa - P_ATM_PA if heard else 0.0


def wait_until_followed(rig):
    wait_for(lambda: abs(gauge_pa(rig) - 300e3) < 20e3, 30.0, 'the wanted pressure')
    wait_for(lambda: rig.health['valve_driver'], 10.0, 'the driver')
    deadline = time.monotonic() + 10.0
    while rig.health['valve_driver'][-1].level:
        assert time.monotonic() < deadline, rig.health['valve_driver'][-1].message
        time.sleep(0.01)


def first_said(rig, node, words, since_s):
    """Wait for a status with some words; return how long after a time it came [s]."""
    def found():
        return [said for said in rig.health[node] if said.time_s >= since_s and all(
            word in said.message for word in words)]
    wait_for(found, 5.0, f'{words} by {node}')
    assert found()[0].level > 0
    return found()[0].time_s - since_s


def test_a_controller_after_a_killed_one_is_not_two(rig):
    wait_until_followed(rig)
    rig.former.kill()
    assert rig.former.wait() == -signal.SIGKILL
    wait_for(lambda: 'no valid pressure command' in rig.health['valve_driver'][-1].message,
             5.0, 'the loss')
    since = len(rig.health['valve_driver'])
    commander = Commander(rig, COMMAND_PA)
    try:
        wait_until_followed(rig)
        wait_for(lambda: rig.node.count_publishers('/muscle/pressure_command') == 2, 5.0,
                 'the dead one beside it')
        time.sleep(1.2)             # the driver looks at the graph twice a second
        said = [one.message for one in rig.health['valve_driver'][since:]]
        assert not [one for one in said if 'publishers' in one], said
    finally:
        end(rig, commander)


def test_two_controllers_are_vented_and_named(rig, commander):
    wait_until_followed(rig)
    stranger = Stranger(rig, 'pressure_command', lambda now_ns: Pressure(now_ns, 4e5))
    try:
        assert first_said(rig, 'valve_driver', ['two publishers send pressure_command',
                          'two nodes named /muscle/listener'], stranger.begin_s) < ALLOWED_S
        assert is_safe(rig.heard['valve_signal'][-1].plain)
        wait_for(lambda: gauge_pa(rig) < 100e3, 2.0, 'the air to leave')
    finally:
        stranger.end()
    wait_until_followed(rig)


def test_a_single_controller_whose_clock_steps_back_is_not_called_two(rig):
    back_ns = 0
    own = Stranger(rig, 'pressure_command', lambda now_ns: Pressure(now_ns - back_ns, COMMAND_PA))
    try:
        wait_until_followed(rig)
        time.sleep(1.1)             # the controller of another test has gone for longer than 1 s
        since, begin_s, back_ns = len(rig.health['valve_driver']), time.monotonic(), 80_000_000
        assert first_said(rig, 'valve_driver', [
            'the commands of /muscle/listener, their only publisher, have stamps that do not '
            'rise, look at its clock'], begin_s) < ALLOWED_S
        wait_for(lambda: is_safe(rig.heard['valve_signal'][-1].plain), 1.0, 'the safe signal')
        assert rig.health['valve_driver'][-1].values['fault'] == 'command_clock'
        back_ns = 0
        wait_until_followed(rig)
        said = [one.message for one in rig.health['valve_driver'][since:]]
        assert not [one for one in said if 'two publishers' in one], said
    finally:
        own.end()


def test_two_pressure_sensors_are_vented_and_named(rig, commander):
    wait_until_followed(rig)
    stranger = Stranger(rig, 'pressure', lambda now_ns: Pressure(now_ns, 4e5 + now_ns % 100))
    try:
        assert first_said(rig, 'valve_driver', [
            'two publishers send pressure', '/muscle/plant_simulator', '/muscle/listener'],
            stranger.begin_s) < ALLOWED_S
        wait_for(lambda: is_safe(rig.heard['valve_signal'][-1].plain), 1.0, 'the safe signal')
    finally:
        stranger.end()
    wait_until_followed(rig)


def test_two_nodes_of_one_name_are_told(rig):
    namesake = Node('valve_watchdog', namespace='/muscle', context=rig.node.context)
    try:
        first_said(rig, 'valve_watchdog', ['2 nodes are named /muscle/valve_watchdog'],
                   time.monotonic())
    finally:
        namesake.destroy_node()
    wait_for(lambda: rig.health['valve_watchdog'][-1].message == 'hears the driver', 5.0, 'one')


def test_a_second_sender_of_the_signal_stays_vented_though_the_driver_is_killed(rig, commander):
    wait_until_followed(rig)
    stranger = Stranger(rig, 'valve_signal', lambda now_ns: ValveSignal(now_ns, *FILLING))
    try:
        for node in ('valve_driver', 'valve_watchdog'):
            assert first_said(rig, node, ['/muscle/listener'], stranger.begin_s) < ALLOWED_S
        rig.processes['valve_driver'].send_signal(signal.SIGKILL)
        wait_for(lambda: gauge_pa(rig) < 60e3, 2.0, 'the air to leave')
        since = len(rig.heard['pressure'])
        time.sleep(1.5)
        gauges_pa = [one.plain.pressure_pa - P_ATM_PA for one in rig.heard['pressure'][since:]]
        assert len(gauges_pa) > 200 and max(gauges_pa) < 60e3
        assert '/muscle/listener' in rig.health['valve_watchdog'][-1].message
    finally:
        stranger.end()
    wait_for(lambda: 'fell silent' in rig.health['valve_watchdog'][-1].message, 5.0, 'silence')
    assert ' ms (limit 50 ms)' in rig.health['valve_watchdog'][-1].message
    rig.start('valve_driver', valve_type='hsv', diagnostics_period_s=0.1)
    wait_until_followed(rig)


def test_two_contraction_sensors_are_named_and_atmosphere_is_commanded(rig):
    rig.start('pid_controller', valve_type='hsv')
    wait_for(lambda: rig.health['pid_controller'], 30.0, 'the controller')
    wait_for(lambda: rig.health['pid_controller'][-1].message == 'no reference yet', 10.0, 'ready')
    time.sleep(DISCOVERED_S)
    stranger = Stranger(rig, 'contraction', lambda now_ns: Contraction(now_ns, 0.004))
    try:
        assert first_said(rig, 'pid_controller', [
            'measured twice', '/muscle/plant_simulator', '/muscle/listener'],
            stranger.begin_s) < ALLOWED_S
        assert rig.heard['pressure_command'][-1].plain.pressure_pa == P_ATM_PA
    finally:
        stranger.end()
    wait_for(lambda: rig.health['pid_controller'][-1].message == 'no reference yet', 5.0, 'one')

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
"""Sensors and valve are a program of the user's own; the rig's nodes are the usual ones."""

import math
from pathlib import Path
import runpy
import signal
import subprocess
import time

import numpy as np
import pytest

pytest.importorskip('rclpy')

from live_rig import wait_for                                               # noqa: E402, I100
from own_programs import Processes                                          # noqa: E402
from pam_actuation.bags.load import load_run                                # noqa: E402
from pam_actuation.control.tick import CONTRACTION_OLD, NO_CONTRACTION      # noqa: E402
from pam_actuation.rigging import layouts                                   # noqa: E402
from pam_actuation.rigging.client import local_context                      # noqa: E402
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
import rclpy                                                                # noqa: E402
from rclpy.executors import SingleThreadedExecutor                          # noqa: E402
from rclpy.node import Node                                                 # noqa: E402
from sensor_msgs.msg import JointState                                      # noqa: E402

pytestmark = pytest.mark.ros

EXAMPLE = Path(__file__).resolve().parents[2] / 'examples' / 'own_hardware.py'


def names(nodes):
    return [f'{node.namespace}/{node.name}' for node in nodes]


def test_a_watchdog_takes_the_place_of_sensors_and_simulator():
    assert names(layouts.rig(hardware='topics')) == [
        '/muscle/sofc_controller', '/muscle/valve_watchdog', '/muscle/valve_driver']
    knee = names(layouts.knee(hardware='topics'))
    assert '/knee/flexor/valve_watchdog' in knee and '/knee/joint_controller' in knee
    assert not any('hardware_sensors' in name or 'simulator' in name for name in knee)


def test_the_reference_waits_for_sensors_that_come_late(tmp_path):
    with Processes(tmp_path) as processes:
        rig = processes.pam_up('--hardware', 'topics', '--seconds', '5',
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        wait_for(lambda: list(processes.bag.glob('*.mcap')), 60.0, 'the recording')
        time.sleep(1.0)         # the controller comes up as well
        processes.start(EXAMPLE, '--ros-args', '-r', '__ns:=/muscle')
        rig.wait(timeout=60)
    run = load_run(tmp_path / 'bag')
    reference, states = run.topics['reference'], run.topics['controller_state']
    at = np.searchsorted(states.stamp_ns, reference.stamp_ns[0])
    assert states.values['input_reason'][0] == NO_CONTRACTION
    assert states.values['input_reason'][at] not in (NO_CONTRACTION, CONTRACTION_OLD)


@pytest.fixture
def own():
    """Return the node of the example, and what sends a valve signal as one of two writers."""
    example = runpy.run_path(str(EXAMPLE))
    lock = DomainLock()
    context = local_context(lock.domain_id)
    node = example['OwnHardware'](example['Converter'](), context=context)
    other = Node('other', context=context)
    publishers = [other.create_publisher(JointState, 'valve_signal', 10) for _ in range(2)]
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def send(*signals):
        """Send (writer, names, efforts) in turn; spin for a moment."""
        for writer, names, efforts in signals:
            publishers[writer].publish(JointState(name=names, effort=efforts))
        deadline = time.monotonic() + 0.05
        while time.monotonic() < deadline:
            executor.spin_once(timeout_sec=0.01)
        return node.converter.volts

    wait_for(lambda: all(one.get_subscription_count() for one in publishers), 20.0, 'the node')
    yield send
    executor.shutdown()
    node.destroy_node()
    other.destroy_node()
    rclpy.try_shutdown(context=context)
    lock.release()


PPR, HSV = ['ppr_voltage'], ['fill_duty', 'vent_duty']


@pytest.mark.parametrize('stray', [
    (1, HSV, [0.0, 1.0]), (1, PPR, [math.nan]), (1, [], []), (1, PPR, [])])
def test_a_signal_of_which_nothing_can_be_used_is_ignored(own, stray):
    wait_for(lambda: own((0, PPR, [2.0])) == 2.0, 20.0, 'the signal')
    assert own((0, PPR, [2.0]), stray) == 2.0
    # It is no sign of life of the driver.
    wait_for(lambda: own(stray) == 0.0, 5.0, '0 V')


def test_of_two_senders_the_one_that_vents_is_followed(own):
    wait_for(lambda: own((0, PPR, [2.0])) == 2.0, 20.0, 'the signal')
    wait_for(lambda: own((1, PPR, [0.0])) == 0.0, 20.0, 'the other one')
    for _ in range(5):
        assert own((0, PPR, [2.0]), (1, PPR, [0.0]), (0, PPR, [2.0])) == 0.0
    wait_for(lambda: own((0, PPR, [2.0])) == 2.0, 5.0, 'the end of the other one')


ENDING = """\
import runpy, sys
example = runpy.run_path(sys.argv[1])
of_example = example['main'].__globals__
class Converter(example['Converter']):
    reads = 0
    def write(self, volts):
        with open(sys.argv[2], 'a') as file:
            print(volts, file=file)
    def read(self):
        self.reads += 1
        if self.reads == 3 and sys.argv[3] == 'error':
            raise OSError('the converter does not answer')
        if self.reads == 2:
            print('reads', flush=True)
        return super().read()
class Quiet(example['OwnHardware']):
    def listen(self):
        self.silent_s, self.held.efforts = 0.0, (2.0,)
of_example.update(Converter=Converter, OwnHardware=Quiet)
example['main']()
"""


@pytest.mark.parametrize('end', ['error', signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_the_example_sets_0_v_whatever_ends_it(tmp_path, end):
    written = tmp_path / 'written'
    with Processes(tmp_path) as processes:
        process = processes.start('-c', ENDING, EXAMPLE, written, end, stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE)
        assert process.stdout.readline() == 'reads\n'
        if end != 'error':
            process.send_signal(end)
        _, told = process.communicate(timeout=30)
    *before, last = written.read_text().split()
    assert set(before) == {'2.0'} and last == '0.0'
    assert (process.returncode == 1) == ('the converter does not answer' in told)


def test_the_example_is_moved_and_its_end_is_told_and_vents(tmp_path):
    with Processes(tmp_path) as processes:
        own = processes.start(EXAMPLE, '--ros-args', '-r', '__ns:=/muscle')
        rig = processes.pam_up(
            '--hardware', 'topics', stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        assert '5 nodes are active' in rig.stdout.readline()
        time.sleep(6.0)
        own.send_signal(signal.SIGKILL)
        time.sleep(1.5)
        rig.send_signal(signal.SIGINT)
        output, told = rig.communicate(timeout=30)
    assert rig.returncode == 1
    assert '/muscle/valve_driver: ' in told and 'finding: /muscle/valve_driver: ' in output
    run = load_run(tmp_path / 'bag')
    contraction, signals = run.topics['contraction'], run.topics['valve_signal']
    end_ns = contraction.stamp_ns[-1]
    held_m = contraction.values['contraction_m'][contraction.stamp_ns > end_ns - 5e8]
    assert held_m.mean() == pytest.approx(0.008, abs=0.001)
    assert (signals.values['ppr_voltage'][signals.stamp_ns > end_ns + 3e8] == 0.0).all()

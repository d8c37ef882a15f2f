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

"""Test that a terminal that is held (Ctrl-S) holds no node, whatever there is to log."""

import os
import pty
import signal
import subprocess
import sys
import time

import pytest

pytest.importorskip('rclpy')

from live_rig import wait_for                                               # noqa: E402, I100
from pam_actuation.nodes.node_log import OFF, with_own_terminal             # noqa: E402
from pam_actuation.rigging.client import local_context                      # noqa: E402
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
from pam_actuation.rigging.processes import node_environment                # noqa: E402
from rcl_interfaces.msg import Log                                          # noqa: E402
import rclpy                                                                # noqa: E402
from rclpy.executors import SingleThreadedExecutor                          # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile                          # noqa: E402
from sensor_msgs.msg import JointState                                      # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.shared]

HOLD = b'\x13'              # Ctrl-S


def test_a_driver_goes_on_and_ends_vented_on_a_held_terminal(tmp_path):
    lock = DomainLock()
    context = local_context(lock.domain_id)
    stack = rclpy.create_node('stack', context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(stack)
    master, terminal = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, '-m', 'pam_actuation.nodes.valve_driver', '--ros-args', '-r',
         '__ns:=/muscle'], env=node_environment(lock.domain_id, tmp_path), stdin=terminal,
        stdout=terminal, stderr=terminal)
    signals, logged = [], []
    latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    stack.create_subscription(JointState, '/muscle/valve_signal', signals.append, 1000)
    stack.create_subscription(Log, '/rosout', lambda one: logged.append(one.msg), latched)

    def heard(what, count):
        return lambda: executor.spin_once(timeout_sec=0.01) or len(what) >= count

    try:
        wait_for(heard(signals, 1), 60.0, 'the driver')
        os.write(master, HOLD)
        # One that asks for what the driver does not offer is told in the log.
        stack.create_subscription(JointState, '/muscle/valve_signal', print, latched)
        wait_for(lambda: heard(logged, 1)() and any(
            'a subscription of /muscle/valve_signal asks for another quality of service '
            '(DURABILITY)' in one for one in logged), 20.0, 'the log of ROS')
        wait_for(heard(signals, len(signals) + 100), 10.0, 'the driver after that')
        process.send_signal(signal.SIGTERM)
        begin_s = time.monotonic()
        wait_for(lambda: executor.spin_once(timeout_sec=0.01) or process.poll() is not None,
                 10.0, 'the end')
        assert process.returncode == 0 and time.monotonic() - begin_s < 8.0
        assert list(signals[-1].effort) == [0.0]
    finally:
        process.kill()
        process.wait()
        for end in (master, terminal):
            os.close(end)
        executor.shutdown()
        stack.destroy_node()
        rclpy.try_shutdown(context=context)
        lock.release()


def test_what_the_user_says_of_the_log_of_ros_stays():
    assert with_own_terminal(['node', '--ros-args', '-p', 'a:=1']) == (
        ['node', '--ros-args', OFF, '--', '--ros-args', '-p', 'a:=1'], True)
    for said in (OFF, '--enable-stdout-logs'):
        args = ['node', '--ros-args', said]
        assert with_own_terminal(args) == (args, False)

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

"""Test that a node leaves nothing in the middleware before its process ends."""

import signal
import subprocess
import sys
import time

import pytest

pytest.importorskip('rclpy')

from pam_actuation.cli.common import EXIT_BAD_INPUT                           # noqa: E402, I100
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
from pam_actuation.rigging.processes import (                               # noqa: E402
    LAUNCHED_BY, node_environment, NodeProcess)

pytestmark = [pytest.mark.ros, pytest.mark.shared]

# The threads of the participant are named dds.*; the watchdog belongs to the library.
PROGRAM = """
import os
from pam_actuation.nodes.pid_controller import PidNode
from pam_actuation.nodes.runner import run

code = run(PidNode)
threads = [open(f'/proc/self/task/{task}/comm').read().strip()
           for task in os.listdir('/proc/self/task')]
print('left:', sorted(name for name in threads if name.startswith('dds.')), flush=True)
raise SystemExit(code)
"""


@pytest.mark.skipif(sys.platform != 'linux', reason='thread names are read from /proc')
@pytest.mark.parametrize('parameter, code', [('controller:=nobody', 2), ('autostart:=true', 0)])
def test_participant_is_gone(tmp_path, parameter, code):
    lock = DomainLock()
    process = subprocess.Popen(
        [sys.executable, '-c', PROGRAM, '--ros-args', '-p', parameter],
        env=node_environment(lock.domain_id, tmp_path), text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        if code == 0:
            for line in process.stderr:
                if line.rstrip().endswith('active'):
                    break
            process.send_signal(signal.SIGTERM)
        output, errors = process.communicate()
    finally:
        process.kill()
        lock.release()
    assert process.returncode == code, errors
    assert "left: ['dds.shm.wdog']" in output or 'left: []' in output, output


# The middleware hangs with the lock of the interpreter held, as Fast DDS does now and then.
HANGING = """
import ctypes, sys
import rclpy
from pam_actuation.nodes import runner
from pam_actuation.nodes.pid_controller import PidNode

rclpy.try_shutdown = lambda: ctypes.PyDLL(None).sleep(600)
sys.exit(runner.run(PidNode))
"""


def test_a_node_ends_in_order_though_the_middleware_hangs(tmp_path):
    lock = DomainLock()
    process = NodeProcess(
        'pid_controller', '', {'autostart': True}, node_environment(lock.domain_id, tmp_path),
        tmp_path, program=(sys.executable, '-c', HANGING))
    try:
        while process.running and ']: active\n' not in process.log_file.read_text():
            time.sleep(0.05)
        process.send_signal(signal.SIGTERM)
        assert process.wait(300.0) and process.exit_code == 0, process.how_it_ended()
    finally:
        process.send_signal(signal.SIGKILL)
        lock.release()


HANGING_PAM = """
import ctypes, sys
import rclpy
from pam_actuation.cli.main import main

rclpy.try_shutdown = lambda context: ctypes.PyDLL(None).sleep(600)
sys.exit(main())
"""


def test_pam_tells_its_result_and_leaves_though_the_middleware_hangs(tmp_path):
    lock = DomainLock()
    try:
        done = subprocess.run(
            [sys.executable, '-c', HANGING_PAM, 'status', '--domain-id', str(lock.domain_id),
             '--wait', '0.1'], env=node_environment(lock.domain_id, tmp_path),
            capture_output=True, text=True, timeout=120)
    finally:
        lock.release()
    assert f'no node of a rig found in ROS domain {lock.domain_id}' in done.stderr
    assert done.returncode == EXIT_BAD_INPUT


# As ros2 launch does, which leaves its nodes behind when SIGTERM or SIGKILL ends it.
LAUNCHER = """
import os, subprocess, sys, time
os.environ['PAM_LAUNCHED_BY'] = str(os.getpid())
subprocess.Popen([sys.executable, '-m', 'pam_actuation.nodes.valve_driver', '--ros-args', '-p',
                  'end_with_parent:=true'])
time.sleep(600)
"""


@pytest.mark.skipif(sys.platform != 'linux', reason='Linux tells of the end of a parent')
def test_a_node_ends_in_order_with_the_process_that_started_it(tmp_path):
    lock = DomainLock()
    launcher = subprocess.Popen(
        [sys.executable, '-c', LAUNCHER], env=node_environment(lock.domain_id, tmp_path),
        text=True, stderr=subprocess.PIPE)
    try:
        assert any(line.endswith(']: active\n') for line in launcher.stderr)
        launcher.kill()
        # The node has the same end of the pipe: the text is over when it has ended, too.
        assert any(line.endswith('stopped by SIGTERM\n') for line in launcher.stderr)
    finally:
        launcher.kill()
        lock.release()


@pytest.mark.skipif(sys.platform != 'linux', reason='Linux tells of the end of a parent')
def test_a_node_does_not_begin_after_the_end_of_its_launch(tmp_path):
    """As where a launch fails while its first nodes still start, and others are their parent."""
    launch = subprocess.Popen(['true'])
    launch.wait()
    lock = DomainLock()
    environment = {**node_environment(lock.domain_id, tmp_path), LAUNCHED_BY: str(launch.pid)}
    done = subprocess.run(
        [sys.executable, '-m', 'pam_actuation.nodes.valve_driver', '--ros-args', '-p',
         'end_with_parent:=true'], env=environment, text=True, capture_output=True, timeout=60.0)
    lock.release()
    assert done.returncode == 1 and 'active' not in done.stderr

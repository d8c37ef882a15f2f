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

"""Test how long nodes that do not end may hold up those who end them."""

from functools import partial
import os
import signal
import subprocess
import sys
import time

import pytest

pytest.importorskip('rclpy')

from pam_actuation.rigging.processes import (                              # noqa: E402, I100
    end_all, end_with_parent, NodeProcess)

DEAF = 'import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); ' \
    'print(flush=True); time.sleep(60)'


class DeafNode(NodeProcess):
    """A process that hears no SIGTERM, as a node does while it compiles."""

    label = 'deaf'

    def __init__(self):
        self._process = subprocess.Popen(
            [sys.executable, '-c', DEAF], stdout=subprocess.PIPE, text=True)
        self._process.stdout.readline()


@pytest.mark.timed
def test_nodes_that_do_not_end_share_the_time_they_are_given():
    nodes = [DeafNode() for _ in range(4)]
    begin = time.monotonic()
    end_all(nodes, timeout_s=1.5)
    assert 1.5 <= time.monotonic() - begin < 4.5        # one after the other: 6 s
    assert [node.exit_code for node in nodes] == [-signal.SIGKILL] * 4
    assert nodes[0].how_it_ended() == 'deaf did not end within 1.5 s of SIGTERM and was killed'


@pytest.mark.skipif(sys.platform != 'linux', reason='asks Linux')
def test_a_node_whose_parent_died_while_it_started_ends():
    codes = [subprocess.run([sys.executable, '-c', ''],
                            preexec_fn=partial(end_with_parent, parent)).returncode
             for parent in (os.getpid(), os.getppid())]
    assert codes == [0, 1]


def test_a_node_of_somebody_else_gets_what_ros_takes(tmp_path):
    show = 'import sys; print(*sys.argv[1:])'
    node = NodeProcess('plant_simulator', '/muscle', {'seed': 3}, dict(os.environ), tmp_path,
                       program=(sys.executable, '-c', show, '--ros-args', '-p', 'mine:=7', '--'))
    assert node._process.wait(20.0) == 0
    assert node.last_line() == (
        '--ros-args -p mine:=7 -- --ros-args -r __ns:=/muscle -p seed:=3')

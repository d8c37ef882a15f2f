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

import signal
import time

import pytest

pytest.importorskip('rclpy')

from pam_actuation.rigging.processes import (                               # noqa: E402, I100
    end_all, node_environment, NodeProcess)


def test_nodes_that_do_not_end_share_the_time_they_are_given(tmp_path):
    """Nodes that compile hear no signal: five of them held up Ctrl-C five times as long."""
    environment = node_environment(0, tmp_path)
    nodes = [NodeProcess('reference_generator', '/muscle', {}, environment, tmp_path)
             for _ in range(4)]
    for node in nodes:
        node.send_signal(signal.SIGSTOP)
    begin = time.monotonic()
    end_all(nodes, timeout_s=1.5)
    assert 1.5 <= time.monotonic() - begin < 4.5
    assert all(node.exit_code < 0 for node in nodes)

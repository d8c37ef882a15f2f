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

"""Nodes as forks of a process that has imported everything: started, ended and told apart."""

import os
from pathlib import Path
import signal
import subprocess
import sys
import threading
import time

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

from pam_actuation.rigging.domain import DomainLock                            # noqa: E402, I100
from pam_actuation.rigging.node_template import (                              # noqa: E402
    COMPILES, NodeTemplate, OF_A_RUN, template_for)
from pam_actuation.rigging.processes import (                                  # noqa: E402
    end_all, node_environment, NodeProcess)

pytestmark = [
    pytest.mark.ros, pytest.mark.shared,
    pytest.mark.skipif(sys.platform != 'linux', reason='there is none on other systems')]
END_S = 20.0
PARENT = """
import sys, time
from pam_actuation.rigging.node_template import NodeTemplate
from pam_actuation.rigging.processes import node_environment, NodeProcess
environment = node_environment({domain}, {folder!r})
template = NodeTemplate(['valve_driver'], environment)
node = NodeProcess('valve_driver', '/muscle', {{}}, environment, {folder!r}, template=template)
print(node.pid, template.start(['valve_watchdog', '--help'], environment, '/dev/null').pid,
      flush=True)
time.sleep(60)
"""


@pytest.fixture(scope='module')
def environment(tmp_path_factory):
    """Return the environment of nodes in a domain of their own."""
    lock = DomainLock(None)
    yield node_environment(lock.domain_id, tmp_path_factory.mktemp('log'))
    lock.release()


@pytest.fixture(scope='module')
def template(environment):
    """Return a template of these tests only: one of them ends it."""
    template = NodeTemplate(['valve_driver', 'valve_watchdog'], environment)
    template.wait_until_ready()
    yield template
    template.close()


def process_name(pid):
    """Return the name of a process as the system knows it."""
    return Path(f'/proc/{pid}/comm').read_text().strip()


def parent_of(pid):
    """Return the process id of the parent of a process."""
    return int(Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()[1])


def waited_for(condition):
    """Wait until a condition holds; return whether it does."""
    deadline_s = time.monotonic() + END_S
    while not condition() and time.monotonic() < deadline_s:
        time.sleep(0.02)
    return condition()


def test_nodes_have_names_logs_and_ends_of_their_own(template, environment, tmp_path):
    driver = NodeProcess('valve_driver', '/muscle', {}, environment, tmp_path, template=template)
    refused = NodeProcess(
        'plant_simulator', '/muscle', {'rig': 'no_such_rig'}, environment, tmp_path,
        template=template)
    killed = NodeProcess(
        'valve_watchdog', '/muscle', {}, environment, tmp_path, template=template)
    try:
        assert process_name(driver.pid) == 'valve_driver'
        words = Path(f'/proc/{driver.pid}/cmdline').read_bytes().rstrip(b'\0').split(b'\0')
        assert words[:4] == [b'valve_driver', b'--ros-args', b'-r', b'__ns:=/muscle']
        assert len({parent_of(one.pid) for one in (driver, killed)} | {os.getpid()}) == 2
        assert os.getsid(driver.pid) == driver.pid
        killed.send_signal(signal.SIGKILL)
        assert killed.wait(END_S) and killed.exit_code == -signal.SIGKILL
        assert 'SIGKILL' in killed.how_it_ended()
        assert refused.wait(END_S) and refused.exit_code == 2
        assert 'no_such_rig' in refused.last_line()
        assert waited_for(lambda: 'active' in driver.log_file.read_text())
        assert driver.running and driver.cpu_s() is not None
        assert 'no_such_rig' not in driver.log_file.read_text()
    finally:
        end_all([driver, refused, killed], END_S)
    assert driver.exit_code == 0
    driver.send_signal(signal.SIGTERM)          # to nobody


def test_a_run_is_compiled_before_its_nodes_are_forked(template):
    template.compile_ahead(['dmsp_5_300_realistic', 'sofc_ppr'])
    assert template.wait_until_compiled() == ''
    template.compile_ahead(['no_such_rig'])
    assert 'no_such_rig' in template.wait_until_compiled()
    assert template.usable


def test_a_long_wait_without_compilation_is_not_called_one(template, environment, tmp_path):
    node = NodeProcess('valve_watchdog', '/held', {}, environment, tmp_path, template=template)
    held, said = parent_of(node.pid), []
    os.kill(held, signal.SIGSTOP)
    try:
        template.compile_ahead(['dmsp_5_300_realistic'])
        goes_on = threading.Timer(0.5, os.kill, (held, signal.SIGCONT))
        goes_on.start()
        assert template.wait_until_compiled(said.append, 0.1) == ''
        goes_on.join()
    finally:
        os.kill(held, signal.SIGCONT)
        end_all([node], END_S)
    assert said == []


def test_a_compilation_is_told(environment, tmp_path):
    class Told(Exception):
        pass

    def tell(text):
        raise Told(text)

    template = NodeTemplate([], {**environment, 'NUMBA_CACHE_DIR': str(tmp_path)})
    try:
        template.compile_ahead(['dmsp_5_300_realistic'])
        with pytest.raises(Told, match=COMPILES):
            template.wait_until_compiled(tell, 0.1)
    finally:
        template.close()


def test_a_folder_and_variables_may_change_between_nodes(
        template, environment, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    node = NodeProcess(
        'valve_watchdog', '/other', {}, {**environment, 'PAM_TEST': 'seen'}, tmp_path,
        template=template)
    try:
        assert Path(f'/proc/{node.pid}/cwd').resolve() == tmp_path.resolve()
        assert waited_for(lambda: 'active' in node.log_file.read_text())
    finally:
        end_all([node], END_S)
    assert node.exit_code == 0


def test_a_lost_template_ends_its_nodes_and_the_next_ones_start_by_themselves(
        template, environment, tmp_path):
    node = NodeProcess('valve_driver', '/muscle', {}, environment, tmp_path, template=template)
    assert waited_for(lambda: 'active' in node.log_file.read_text())
    os.kill(parent_of(node.pid), signal.SIGKILL)
    assert node.wait(END_S) and node.exit_code == -signal.SIGTERM
    assert 'SIGTERM' in node.log_file.read_text()       # it heard, and vented
    assert not template.usable
    alone = NodeProcess(
        'plant_simulator', '/muscle', {'rig': 'no_such_rig'}, environment, tmp_path,
        template=template)
    assert alone.wait(END_S) and alone.exit_code == 2


def test_a_template_that_ends_with_a_request_unread_leaves_the_nodes_to_themselves(monkeypatch):
    class Ends:

        def __init__(self, words, pass_fds, **_):
            self.end = os.dup(pass_fds[0])

        def poll(self):
            return None                     # it has just ended: the system has not told yet

        def wait(self, timeout_s=None):
            return 0

        kill = terminate = wait

    monkeypatch.setattr(subprocess, 'Popen', Ends)
    template = NodeTemplate([], {})
    template.compile_ahead(['dmsp_5_300_realistic'])
    os.close(template._process.end)
    assert template.wait_until_compiled() == '' and not template.usable
    assert template.start(['valve_driver'], {}, os.devnull) is None
    template.close()


def test_nodes_end_with_the_process_that_asked_for_them(environment, tmp_path):
    parent = subprocess.Popen(
        [sys.executable, '-c', PARENT.format(
            domain=environment['ROS_DOMAIN_ID'], folder=str(tmp_path))],
        stdout=subprocess.PIPE, text=True, env=environment)
    try:
        pid = int(parent.stdout.readline().split()[0])
        template = parent_of(pid)
    finally:
        parent.kill()
        parent.wait()
        parent.stdout.close()
    assert waited_for(lambda: not Path(f'/proc/{pid}').exists())
    assert waited_for(lambda: not Path(f'/proc/{template}').exists())


def test_one_template_for_all_sessions_of_a_process(environment):
    one = template_for(OF_A_RUN, environment)
    for own in ({'ROS_DOMAIN_ID': '7', 'ROS_LOG_DIR': '/'}, {'PYTEST_CURRENT_TEST': 'another'}):
        assert one is template_for((), {**environment, **own})
    other = template_for((), {**environment, 'RMW_IMPLEMENTATION': 'another'})
    assert other is not one
    other.close()
    assert not other.usable and one.usable

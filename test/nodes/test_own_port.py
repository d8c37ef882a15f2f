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

"""Test that a node whose shared-memory port was removed at its start is created once more."""

import os
from pathlib import Path
import signal
import subprocess
import sys
import time

from pam_actuation.nodes.own_port import numbers_kept_off, OwnPorts, port_files
from pam_actuation.nodes.own_port import PortWatch, stays_removed
import pytest

PORT = 'fastrtps_port11661'
PARTICIPANT = """
import sys
from pam_actuation.nodes.own_port import create, OwnPorts
from pam_actuation.rigging.client import local_context
import rclpy

def numbered():
    # those of the participant; the ones of its multicasts, below, have the same name in any domain
    return [name for name in OwnPorts().names() if int(name.removeprefix('fastrtps_port')) > 7400]

def new():
    node = rclpy.create_node('one', context=local_context(int(sys.argv[1])))
    print('ports', *numbered(), flush=True)
    return node

def end(node, why):
    print('again', why, flush=True)
    node.destroy_node()
    rclpy.try_shutdown(context=node.context)

node = create(new, end)
print('created', *numbered(), *OwnPorts().removed(), flush=True)
sys.stdin.readline()
node.destroy_node()
"""


@pytest.fixture
def system(tmp_path):
    """Return a made-up process that listens at PORT, and the folder of the ports."""
    process, ports = tmp_path / 'self', tmp_path / 'shm'
    (process / 'fd').mkdir(parents=True)
    ports.mkdir()
    for name in (PORT, f'{PORT}_el', 'fastrtps_port11663', 'fastrtps_00ab', f'sem.{PORT}_mutex'):
        (ports / name).touch()
    (process / 'fd' / '7').symlink_to(ports / f'{PORT}_el')
    (process / 'fd' / '8').symlink_to(ports / 'fastrtps_00ab')
    tell(process, ports)
    return process, ports


def tell(process, ports):
    """Let the system tell of the present files as those that are mapped."""
    (process / 'maps').write_text(''.join(
        f'7f00-7f08 rw-s 00000000 00:1a {(ports / name).stat().st_ino}     /dev/shm/{name}\n'
        for name in (PORT, 'fastrtps_port11663')) + '7f10-7f18 r-xp 00000000 fe:00 12 /lib/x.so\n')


def test_own_port_is_told_from_that_of_others(system):
    process, ports = system
    assert OwnPorts(str(process), str(ports)).names() == {PORT}
    assert set(port_files(str(ports))) == {PORT, 'fastrtps_port11663'}
    assert port_files(str(ports / 'nowhere')) == set()


@pytest.mark.parametrize('name, removed', [(PORT, {PORT}), ('fastrtps_port11663', set())])
@pytest.mark.parametrize('anew', [False, True])
def test_removed_or_created_anew_by_another(system, name, removed, anew):
    process, ports = system
    own = OwnPorts(str(process), str(ports))
    assert own.removed() == set()
    (ports / name).rename(ports / 'kept')       # so that its inode is not given to the next one
    if anew:
        (ports / name).touch()
    assert own.removed() == removed
    assert stays_removed(own, lambda _: None) == removed


def test_missing_for_a_moment_is_not_removed(system):
    process, ports = system
    (ports / PORT).rename(ports / 'kept')
    assert not stays_removed(
        OwnPorts(str(process), str(ports)), lambda _: (ports / 'kept').rename(ports / PORT)
        if (ports / 'kept').exists() else None)


def test_watch_tells_what_stays_removed(system):
    process, ports = system
    now = [0.0]
    watch = PortWatch(OwnPorts(str(process), str(ports)), lambda: now[0])
    (ports / PORT).rename(ports / 'kept')
    told = []
    for now[0] in (0.0, 0.5, 1.0, 3.0, 4.0):
        told.append(watch.removed())
    assert told == [set(), set(), set(), {PORT}, {PORT}]    # not at the first look
    (ports / 'kept').rename(ports / PORT)
    assert watch.removed() == set()


def test_watch_accepts_a_port_that_the_process_has_renewed(system):
    process, ports = system
    now = [0.0]
    watch = PortWatch(OwnPorts(str(process), str(ports)), lambda: now[0])
    (ports / PORT).rename(ports / 'kept')
    (ports / PORT).touch()
    tell(process, ports)
    for now[0] in (0.0, 3.0, 6.0):
        assert watch.removed() == set()


@pytest.mark.ros
def test_node_without_its_port_says_so(tmp_path):
    pytest.importorskip('rclpy')
    from live_rig import LiveRig, wait_for
    rig = LiveRig(tmp_path)
    try:
        rig.start('valve_watchdog', diagnostics_period_s=0.2)
        rig.listen({})
        told = rig.health['valve_watchdog']
        wait_for(lambda: told, 60.0, 'a status')
        assert 'removed' not in told[-1].message
        for name in OwnPorts(f'/proc/{rig.processes["valve_watchdog"].pid}').names():
            os.unlink(Path('/dev/shm') / name)
        wait_for(lambda: 'removed' in told[-1].message, 60.0, 'a status that tells it')
        assert 'start this node anew' in told[-1].message
    finally:
        rig.close()


def start(domain_id, folder):
    """Start a participant; return the process with the name of its port."""
    from pam_actuation.rigging.processes import node_environment
    process = subprocess.Popen(
        [sys.executable, '-c', PARTICIPANT, str(domain_id)],
        env=node_environment(domain_id, folder), text=True, stdin=subprocess.PIPE,
        stdout=subprocess.PIPE)
    said = process.stdout.readline().split()
    assert said[0] == 'ports' and len(said) == 2
    return process, said[1]


@pytest.mark.ros
def test_participant_is_created_until_its_port_stays(tmp_path):
    pytest.importorskip('rclpy')
    from pam_actuation.rigging.domain import DomainLock
    lock = DomainLock()
    first = second = None
    try:
        first, port = start(lock.domain_id, tmp_path)
        assert first.stdout.readline().split() == ['created', port]
        first.send_signal(signal.SIGKILL)
        first.wait()
        second, taken = start(lock.domain_id, tmp_path)
        assert taken == port                    # that of the dead one
        time.sleep(0.2)
        for attempt in range(2):
            os.unlink(Path('/dev/shm') / port)
            assert f'({port})' in second.stdout.readline()
            said = second.stdout.readline().split()
            assert (said[1] == port) == (attempt == 0)
        assert second.stdout.readline().split() == ['created', said[1]]
        second.communicate('\n', timeout=20)
        assert second.returncode == 0
    finally:
        for process in filter(None, (first, second)):
            process.kill()
            process.communicate()
        lock.release()


def test_a_number_is_kept_off_only_inside():
    import socket
    with numbers_kept_off({'fastrtps_port28411'}):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            with pytest.raises(OSError):
                other.bind(('127.0.0.1', 28410))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(('127.0.0.1', 28410))

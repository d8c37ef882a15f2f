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

"""Test that a process sees that others removed its shared-memory port, and starts anew."""

import contextlib
import os
from pathlib import Path
import socket
import sys
import time
import types

from pam_actuation.nodes import start_anew
from pam_actuation.nodes.own_port import locked_ports
from pam_actuation.nodes.own_port import mapped_ports
from pam_actuation.nodes.own_port import OwnPorts
from pam_actuation.nodes.own_port import REMOVED, SOUND, UNKNOWN
import pytest

PORT = 'fastrtps_port22661'
MAPS = b"""\
7f00-7f01 rw-s 00000000 00:1b 44                         /dev/shm/fastrtps_port7001
7f02-7f03 rw-s 00000000 00:1b 33                         /dev/shm/fastrtps_port22661 (deleted)
7f04-7f05 rw-s 00000000 00:1b 34                         /dev/shm/fastrtps_port22661
7f06-7f07 rw-s 00000000 00:1b 35                         /dev/shm/fastdds_port22666
7f08-7f09 rw-s 00000000 00:1b 36                         /dev/shm/fastrtps_72a4181e9125f237
7f0a-7f0b r-xp 00000000 08:02 37                         /opt/a folder/libfastrtps.so
7f0c-7f0d rw-p 00000000 00:00 0
"""


def test_maps_tell_ports_inodes_and_what_was_deleted():
    assert mapped_ports(MAPS) == {
        'fastrtps_port7001': {(44, False)}, PORT: {(33, True), (34, False)},
        'fastdds_port22666': {(35, False)}}
    assert mapped_ports(b'') == {}


def test_a_port_is_owned_by_who_holds_its_lock_deleted_or_not():
    assert locked_ports([
        'socket:[58178]', '/dev/shm/fastrtps_port22661_el', '/dev/shm/fastdds_port7_el (deleted)',
        '/dev/shm/fastrtps_port22663', '/dev/shm/fastrtps_37735965dd46f989_el',
        '/dev/shm/fastrtps_port22665_sl']) == {PORT, 'fastdds_port7'}


class Process:
    """What the system tells of a process that has one port, in a folder."""

    def __init__(self, folder):
        self.shm, self.proc = folder / 'shm', folder / 'proc'
        (self.proc / 'fd').mkdir(parents=True)
        self.shm.mkdir()
        self.file = self.shm / PORT
        self.file.touch()
        (self.proc / 'fd' / '15').symlink_to(f'/dev/shm/{PORT}_el')
        self.map()
        self.ports = OwnPorts(str(self.proc), str(self.shm))

    def map(self, deleted=''):
        inode = self.file.stat().st_ino
        (self.proc / 'maps').write_text(
            f'7f02-7f03 rw-s 00000000 00:1b {inode}    /dev/shm/{PORT}{deleted}\n')

    def take_away(self, create=True):
        self.file.rename(self.shm / 'taken_away')       # so that its inode is not used again
        if create:
            self.file.touch()

    def looks(self, count):
        return [self.ports.look() for _ in range(count)]


@pytest.fixture
def process(tmp_path):
    return Process(tmp_path)


def test_sound_port_stays_sound_and_needs_no_further_reading(process):
    assert process.looks(3) == [UNKNOWN, SOUND, SOUND]
    (process.proc / 'maps').unlink()
    assert process.looks(2) == [SOUND, SOUND]


@pytest.mark.parametrize('create', [True, False])
def test_port_removed_later_is_told_at_the_second_look(process, create):
    process.looks(2)
    process.take_away(create)
    assert process.looks(3) == [SOUND, REMOVED, REMOVED]
    assert process.ports.removed == {PORT}


def test_port_removed_before_the_first_look_is_told(process):
    process.map(' (deleted)')
    assert process.looks(3) == [UNKNOWN, SOUND, REMOVED]


def test_port_that_was_created_anew_by_its_owner_is_sound(process):
    process.looks(2)
    process.take_away()
    assert process.looks(1) == [SOUND]
    process.map()
    assert process.looks(2) == [SOUND, SOUND] and not process.ports.removed
    process.take_away_again = process.shm / 'taken_away'
    process.take_away_again.unlink()
    process.take_away()
    assert process.looks(2)[1] == REMOVED
    process.map()
    assert process.looks(1) == [SOUND]


def test_lock_that_is_only_tried_owns_nothing(process):
    process.looks(1)
    (process.proc / 'fd' / '15').unlink()
    process.take_away()
    assert process.looks(3) == [UNKNOWN] * 3


def test_nothing_is_known_without_ports_or_without_proc(tmp_path):
    (tmp_path / 'fd').mkdir()
    (tmp_path / 'maps').write_bytes(b'7f0c-7f0d rw-p 00000000 00:00 0\n')
    for process in (tmp_path, tmp_path / 'nowhere'):
        ports = OwnPorts(str(process), str(tmp_path))
        assert [ports.look() for _ in range(3)] == [UNKNOWN] * 3


class Ports:
    removed = {PORT}

    def __init__(self, *states):
        self._states = list(states)

    def look(self):
        return self._states.pop(0) if len(self._states) > 1 else self._states[0]


def watch(ports, alone=True, may=True, time_s=None):
    said = []
    node = types.SimpleNamespace(
        starts_anew=False, stopping=False, may_start_anew=lambda: may, said=said,
        diagnostics=types.SimpleNamespace(remark=''),
        get_logger=lambda: types.SimpleNamespace(error=said.append))
    return start_anew.PortWatch(node, alone, ports, time_s or iter(range(10**6)).__next__), node


def test_sound_and_unknown_ports_change_nothing():
    one, node = watch(Ports(UNKNOWN, UNKNOWN, SOUND))
    assert not any(one.look() for _ in range(40))
    assert not (node.stopping or node.starts_anew or node.said or node.diagnostics.remark)


def test_port_that_the_middleware_renews_itself_is_let_pass():
    one, node = watch(Ports(SOUND, REMOVED, SOUND, REMOVED, SOUND))
    assert not any(one.look() for _ in range(9))
    assert not (node.stopping or node.said or node.diagnostics.remark)


def test_removed_port_starts_the_node_anew_and_says_why():
    one, node = watch(Ports(SOUND, SOUND, REMOVED))
    assert [one.look() for _ in range(3)] == [False, False, True]
    assert node.stopping and node.starts_anew
    assert PORT in one.reason and '(1 of at most 5)' in one.reason


@pytest.mark.parametrize('alone, may, anew, begin_s', [
    (False, True, '0', 1.0), (True, False, '0', 1.0), (True, True, '5', 1.0),
    (True, True, 'many', 1.0), (True, True, '0', 16.0)])
def test_where_it_would_do_harm_a_node_only_tells(monkeypatch, alone, may, anew, begin_s):
    monkeypatch.setenv(start_anew.COUNTER, anew)
    now_s = [0.0]
    one, node = watch(
        Ports(SOUND, REMOVED, REMOVED, REMOVED, SOUND), alone, may, lambda: now_s[0])
    now_s[0] = begin_s - 1.0
    remarks = [one.look()]
    for step in range(3):
        now_s[0] = begin_s + step
        assert not one.look()
        remarks.append(node.diagnostics.remark)
    assert not node.stopping and len(node.said) == 1
    assert all('start this node anew' in remark for remark in remarks[1:3]) and remarks[3] == ''


def test_looks_are_frequent_at_first_and_rare_later():
    now_s = [0.0]
    one, _ = watch(Ports(SOUND), time_s=lambda: now_s[0])
    assert one.period_s == start_anew.EARLY_PERIOD_S
    now_s[0] = 6.0
    assert one.period_s == start_anew.PERIOD_S


def test_process_is_not_replaced_once_a_signal_came(monkeypatch):
    calls = []
    monkeypatch.setattr(os, 'execve', lambda *args: calls.append(args))
    monkeypatch.setattr(os, 'set_inheritable', lambda *args: None)
    start_anew.replace_process([PORT], lambda: False)
    assert not calls
    for _ in range(3):
        start_anew.replace_process([PORT, 'fastrtps_port7010'], lambda: True)
        program, arguments, environment = calls[-1]
        assert (program, arguments) == (sys.executable, sys.orig_argv)
        for name, value in environment.items():
            monkeypatch.setenv(name, value)
    assert [call[2][start_anew.COUNTER] for call in calls] == ['1', '2', '3']
    # The first time with the same number, then without.
    assert [call[2].get(start_anew.KEEP_OFF) for call in calls] == [
        None, '22660', '22660 22660']


def test_numbers_are_kept_off_for_a_while_only(monkeypatch):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(('0.0.0.0', 0))
        port = one.getsockname()[1]
    monkeypatch.setenv(start_anew.KEEP_OFF, f'{port} nonsense 99999')
    for inside in (True, False):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
            with start_anew.numbers_kept_off() if inside else contextlib.nullcontext():
                with pytest.raises(OSError) if inside else contextlib.nullcontext():
                    one.bind(('0.0.0.0', port))


@pytest.mark.parametrize('exit_code, result_code, fails, anew', [
    (None, 0, False, True), (0, 0, False, False), (1, 0, False, False), (None, 1, False, False),
    (None, 0, True, False)])
def test_node_that_is_done_or_failed_is_not_started_anew(exit_code, result_code, fails, anew):
    pytest.importorskip('rclpy')
    from pam_actuation.nodes import runner
    said = []

    def let_go():
        if fails:
            raise OSError('no')
    node = types.SimpleNamespace(
        exit_code=exit_code, result_code=result_code, let_go=let_go,
        get_logger=lambda: types.SimpleNamespace(error=said.append))
    assert runner._let_go(node) == anew
    assert bool(said) == fails and (node.exit_code == 1 or not fails)


def own_ports(pid):
    targets = []
    for link in Path(f'/proc/{pid}/fd').iterdir():
        with contextlib.suppress(FileNotFoundError):        # closed meanwhile
            targets.append(os.readlink(link))
    return locked_ports(targets)


@pytest.mark.ros
@pytest.mark.skipif(not Path('/proc/self/maps').exists(), reason='ports are read from /proc')
def test_node_whose_port_is_removed_comes_back_and_hears(tmp_path):
    pytest.importorskip('rclpy')
    from live_rig import LiveRig, wait_for
    from pam_actuation.messages import ValveSignal
    from pam_actuation.nodes.conversions import RosWriter

    rig = LiveRig(tmp_path)
    try:
        rig.start('valve_watchdog', diagnostics_period_s=0.1)
        process = rig.processes['valve_watchdog']
        domain_ports = range(7400 + 250 * rig.domain_id, 7650 + 250 * rig.domain_id)

        def port():
            return [name for name in own_ports(process.pid)
                    if int(name.split('port')[1]) in domain_ports]
        wait_for(port, 20.0, 'its port')
        wait_for(lambda: 'active' in process.log_file.read_text(), 20.0, 'its start')
        os.unlink(f'/dev/shm/{port()[0]}')
        # Whoever sends before that may hold a port without a name, and remove the next one.
        wait_for(lambda: process.log_file.read_text().count('active') == 2, 20.0, 'a new start')
        rig.listen({})
        publisher, writer = rig.publisher('valve_signal'), RosWriter('valve_signal')

        def hears():
            publisher.publish(writer.fill(ValveSignal(time.time_ns(), ('ppr_voltage',), (0.0,))))
            last = rig.health['valve_watchdog'][-1:]
            return last and last[0].message == 'hears the driver'

        wait_for(hears, 20.0, 'a node that hears')
        last = rig.health['valve_watchdog'][-1]
        assert last.values['started_anew'] == '1'
        assert process.running and 'starts itself anew (1 of' in process.log_file.read_text()
        assert port()
    finally:
        rig.close()
    assert process.exit_code == 0

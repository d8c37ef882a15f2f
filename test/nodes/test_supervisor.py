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

"""What a supervisor makes of the nodes on its domain, without any process."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy')

from pam_actuation.hardware.device_watchdog import OPENED                   # noqa: E402, I100
from pam_actuation.messages import NOT_BEGUN, START_NS, Status              # noqa: E402
from pam_actuation.nodes.parameters import COMMON_PARAMETERS                # noqa: E402
from pam_actuation.rigging import supervisor                                # noqa: E402
from pam_actuation.rigging.client import MOST_CHANGES, MOST_FAULTS, RigClient   # noqa: E402
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
from pam_actuation.rigging.node_spec import NodeSpec                        # noqa: E402
from pam_actuation.rigging.supervisor import HEARD_S, SILENT_S, Supervisor  # noqa: E402
from pam_actuation.topics import codec                                      # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.shared]

DRIVER, WATCHDOG = '/left/valve_driver', '/left/valve_watchdog'
SENSORS = '/left/hardware_sensors'
BY_HAND = 'the muscle may still be under pressure: shut the supply and open the dump valve'


class Rig:
    """A supervisor of nodes that were never started, and what it says."""

    def __init__(self, nodes=None):
        lock = DomainLock()
        domain_id = lock.domain_id
        lock.release()
        self.supervisor = Supervisor(nodes or [
            NodeSpec(name, '/left', {}) for name in (
                'experiment_recorder', 'valve_driver', 'sofc_controller', 'reference_generator')],
            domain_id)
        self.group = self.supervisor._group
        self.client = self.group.client = self.group._new_client(domain_id)
        self.told = []

    def hear(self, name, level, message, **values):
        """Take one status from the wire."""
        self.client._on_diagnostics(codec.encode('diagnostics', [
            Status(START_NS, level, name, message, tuple(values.items()))]))

    def tell(self):
        """Return what the supervisor tells of what it heard since."""
        self.told.clear()
        self.supervisor._hear(self.told.append, True)
        return list(self.told)


@pytest.fixture
def rig():
    found = Rig()
    yield found
    found.supervisor.__exit__()


def test_faults_of_other_benches_are_neither_told_nor_findings(rig):
    for other in ('/right/valve_driver', '/left2/valve_driver', '/valve_driver'):
        rig.hear(other, 2, 'vented because of something')
    assert rig.tell() == [] == rig.supervisor.faults
    rig.hear(DRIVER, 2, 'vented because of something')
    rig.hear('/left/own_program', 2, 'broken')      # in place of a node that was left out
    assert rig.tell() == rig.supervisor.faults == [
        f'{DRIVER}: vented because of something', '/left/own_program: broken']
    rig.hear(DRIVER, 0, 'following the pressure command')
    assert rig.tell() == [f'{DRIVER} is well again: following the pressure command']


@pytest.mark.parametrize('name, lost, held', [
    ('/left/sofc_controller', 'reference lost, asks for the atmosphere',
     'reference lost, holding its last position'),
    ('/left/joint_controller', 'wanted torque lost, asks for the atmosphere', 'following')])
def test_a_lost_reference_that_vents_is_told_and_a_finding(rig, name, lost, held):
    rig.hear(name, 1, held)
    assert rig.tell() == []
    rig.hear(name, 1, f'{lost}; /a and /b send one topic')
    finding = f'{name}: {lost}; /a and /b send one topic'
    assert rig.tell() == [finding] == rig.supervisor.faults == list(rig.client.faults)
    rig.hear(name, 0, 'tracking')
    assert rig.tell() == [f'{name} is well again: tracking']


TRIP = 'over-pressure trip: 400 kPa gauge measured, trip at 325 kPa'
REFUSES = 'the valve did not take its signal: no such device'
UNVENTED = 'the device may not be vented: no such device'
STOP, LATCHES = 'emergency stop: service call', {'state': 'emergency_stop'}


def test_only_an_emergency_stop_latches_without_being_a_finding(rig):
    rig.hear(DRIVER, 2, STOP, fault='emergency_stop', **LATCHES)
    assert rig.tell() == [f'{DRIVER}: {STOP}'] and rig.supervisor.faults == []
    rig.hear(DRIVER, 0, 'following the pressure command', state='ok', fault='')
    assert len(rig.tell()) == 1
    for fault, message in (('over_pressure', TRIP), ('device_refuses', REFUSES)):
        rig.hear(DRIVER, 2, message, fault=fault, **LATCHES)
        assert rig.tell() == [f'{DRIVER}: {message}'] == rig.supervisor.faults[-1:]
        rig.hear(DRIVER, 0, 'following the pressure command', state='ok', fault='')
        assert len(rig.tell()) == 1
    assert len(rig.supervisor.faults) == 2


def test_what_becomes_graver_is_told_though_a_fault_was_told_before(rig):
    rig.hear(DRIVER, 2, 'vented because of something', state='vented', fault='pressure_timeout')
    assert len(rig.tell()) == 1
    rig.hear(DRIVER, 2, 'vented because of another thing', state='vented', fault='no_command')
    assert rig.tell() == []
    rig.hear(DRIVER, 2, TRIP, fault='over_pressure', **LATCHES)
    assert rig.tell() == [f'{DRIVER}: {TRIP}']
    rig.hear(DRIVER, 2, f'{TRIP}; {UNVENTED}', fault='over_pressure', **LATCHES)
    assert rig.tell() == [f'{DRIVER}: {TRIP}; {UNVENTED}']
    for message in (TRIP, f'{TRIP}; {UNVENTED}'):       # no flood of a device that comes and goes
        rig.hear(DRIVER, 2, message, fault='over_pressure', **LATCHES)
        assert rig.tell() == []
    assert len(rig.supervisor.faults) == 3


def test_a_device_that_does_not_vent_again_after_a_while_is_told_anew(rig, monkeypatch):
    refused = f'{REFUSES}; {UNVENTED}'
    for calm_s, told in ((60.0, []), (0.0, [f'{DRIVER}: {refused}'])):
        monkeypatch.setattr(supervisor, 'CALM_S', calm_s)
        for message in (refused, REFUSES):
            rig.hear(DRIVER, 2, message, fault='device_refuses', **LATCHES)
            rig.tell()
        rig.hear(DRIVER, 2, refused, fault='device_refuses', **LATCHES)
        assert rig.tell() == told
        rig.hear(DRIVER, 2, f'{refused} ', fault='device_refuses', **LATCHES)
        assert rig.tell() == []
    rig.hear(DRIVER, 0, 'following the pressure command', state='ok', fault='')
    assert len(rig.tell()) == 1


def test_an_emergency_stop_that_the_device_does_not_take_is_a_finding(rig):
    rig.hear(DRIVER, 2, STOP, fault='emergency_stop', **LATCHES)
    assert len(rig.tell()) == 1 and rig.supervisor.faults == []
    rig.hear(DRIVER, 2, f'{STOP}; {UNVENTED}', fault='emergency_stop', **LATCHES)
    assert rig.tell() == [f'{DRIVER}: {STOP}; {UNVENTED}'] == rig.supervisor.faults


def test_a_rig_that_waits_for_its_first_reference_is_well(rig):
    rig.hear('/left/sofc_controller', 1, 'no reference yet')
    assert rig.tell() == [] == rig.supervisor.faults


def test_an_experiment_that_waits_is_told_once_and_a_finding_at_the_end(rig):
    name, waits = '/left/reference_generator', f'{NOT_BEGUN} /left/contraction'
    rig.supervisor.processes[name] = SimpleNamespace(full_name=name)
    rig.hear(name, 0, 'waiting for the start')
    assert rig.tell() == [] == rig.supervisor.not_begun()
    rig.hear(name, 1, waits)
    assert rig.tell() == [f'{name}: {waits}'] == rig.supervisor.not_begun()
    rig.hear(name, 1, f'{waits}, /left/valve_signal')
    assert rig.tell() == [] == rig.supervisor.faults
    rig.hear(name, 0, 'playing sine_quarter_hz')
    assert rig.tell() == [] == rig.supervisor.not_begun()
    del rig.supervisor.processes[name]


HOLDS = f'{DRIVER}: sent no status for 3 s: its valve holds the last signal, {BY_HAND}'
VENTS = f'{DRIVER}: sent no status for 3 s: its watchdog vents'
UNWATCHED = f'{WATCHDOG}: sent no status for 3 s: nothing vents if the driver stops'
HANGS = f'{SENSORS}: sent no status for 3 s: its back end may hang, and nothing is measured'
BOTH = f'{WATCHDOG}: sent no status for 3 s: its driver is silent too, {BY_HAND}'


@pytest.mark.parametrize('silent_s, told', [
    ([{DRIVER: 3.1}], [HOLDS]),                             # there is no watchdog
    ([{DRIVER: 3.1, WATCHDOG: 0.4}], [VENTS]),
    ([{DRIVER: 3.1, WATCHDOG: 2.6}, {DRIVER: 3.6, WATCHDOG: 3.1}], [HOLDS, BOTH]),
    ([{DRIVER: 0.0, WATCHDOG: 3.1}, {DRIVER: 3.1, WATCHDOG: 9.0}], [UNWATCHED, HOLDS]),
    ([{DRIVER: 3.1, WATCHDOG: 0.4}, {DRIVER: 6.0, WATCHDOG: 3.1}], [VENTS, BOTH]),
    ([{DRIVER: 0.2, WATCHDOG: 3.1}, {DRIVER: 0.2, WATCHDOG: 0.0}],
     [UNWATCHED, f'{WATCHDOG} is heard again']),
    ([{DRIVER: 0.2, SENSORS: 2.9}, {DRIVER: 0.2, SENSORS: 3.1}], [HANGS])])
def test_a_watchdog_is_said_to_vent_only_where_it_is_heard(rig, silent_s, told):
    for name in (DRIVER, WATCHDOG, SENSORS):
        rig.group.processes[name] = SimpleNamespace(running=True)
    said = []
    for moment in silent_s:
        rig.supervisor._tell_silence(moment, said.append)
        rig.supervisor._tell_silence(moment, said.append)       # once is enough
    rig.group.processes.clear()
    assert said == told
    assert rig.supervisor.faults == [one for one in told if 'heard again' not in one]


def test_drivers_watchdogs_and_sensors_are_listened_for(rig, monkeypatch):
    for name in (WATCHDOG, SENSORS):
        rig.group._nodes[name] = NodeSpec(name.rpartition('/')[2], '/left', {})
    looked = []
    monkeypatch.setattr(rig.supervisor, '_tell_silence',
                        lambda silent_s, tell: looked.append(set(silent_s)))
    rig.supervisor.watch(until=lambda: True)
    assert looked == [{DRIVER, WATCHDOG, SENSORS}]


def test_messages_of_other_benches_are_not_counted(rig):
    for name in ('/right/plant_simulator', '/left/plant_simulator'):
        rig.hear(name, 0, 'ok', **{f'published.{name}': '7'})
    assert rig.client.published() == {'/left/plant_simulator': 7}


def test_what_is_kept_of_a_status_that_flaps_for_days_is_bounded(rig):
    rig.hear('/left/valve_watchdog', 2, 'vents')
    for number in range(2 * MOST_FAULTS):
        rig.hear(DRIVER, 0, 'resuming')
        rig.hear(DRIVER, 2, f'vented for reason {number}')
    rig.hear('/left/valve_watchdog', 0, 'hears the driver')
    kept = rig.client.changes_since(0.0)
    assert len(kept) == MOST_CHANGES + 2 and kept == sorted(kept)
    assert [one[1:] for one in kept][-1] == ('/left/valve_watchdog', 0, 'hears the driver')
    assert (kept[0][1], kept[-2][3]) == (
        '/left/valve_watchdog', f'vented for reason {2 * MOST_FAULTS - 1}')
    assert rig.client.changes_since(kept[-2][0]) == kept[-1:]
    assert len(rig.client.faults) == MOST_FAULTS
    assert list(rig.client.faults)[:2] == [
        '/left/valve_watchdog: vents', f'{DRIVER}: vented for reason 0']


def test_a_client_of_no_namespaces_listens_to_all():
    lock = DomainLock()
    client = RigClient(lock.domain_id)
    try:
        client._on_diagnostics(codec.encode('diagnostics', [
            Status(START_NS, 0, '/any/node', 'ok', ())]))
        assert set(client.statuses) == {'/any/node'}
    finally:
        client.close()
        lock.release()


@pytest.mark.parametrize('backend, printed, told', [
    ('iio_dac', '', True), ('iio_dac', f'[INFO] [left.valve_driver]: {OPENED}', False),
    ('sim', '', False), ('dummy', '', False)])
@pytest.mark.parametrize('by', ['parameter', 'file', 'users_file'])
def test_a_driver_that_ends_before_it_opens_its_device_is_told(
        tmp_path, monkeypatch, backend, printed, told, by):
    file = tmp_path / 'hardware.yaml'
    file.write_text(f'/**/valve_driver:\n  ros__parameters: {{backend: {backend}}}\n'
                    '/right/valve_driver:\n  ros__parameters: {backend: iio_dac}\n')
    node = NodeSpec('valve_driver', '/left', {'backend': backend} if by == 'parameter' else {},
                    parameter_file=str(file) if by == 'file' else '',
                    users_file=str(file) if by == 'users_file' else '')
    rig = Rig([node])
    monkeypatch.setattr(rig.group, 'stop', lambda before_recorder: [])
    expected = [f'{DRIVER}: ended before it opened and vented its device, which may hold an old '
                'signal: shut the supply and open the dump valve']
    # One that was never started has touched nothing either.
    assert rig.supervisor.finish() == (expected if backend == 'iio_dac' else [])
    rig.group.processes[DRIVER] = SimpleNamespace(exit_code=0, printed=lambda: printed,
                                                  how_it_ended=lambda: '')
    assert rig.supervisor.finish() == (expected if told else [])
    rig.group.processes.clear()
    rig.supervisor.__exit__()


@pytest.mark.parametrize('failure, reference, told', [
    ('/left/valve_driver: was ended by SIGKILL', 'playing sine', 'error'),
    ('/left/valve_driver: was ended by SIGKILL', 'finished sine', None),
    ('', 'playing sine', None)])
def test_the_recorder_is_told_why_the_rig_failed(rig, monkeypatch, failure, reference, told):
    notes = Path(rig.group._nodes['/left/experiment_recorder'].parameters['notes_folder'])
    monkeypatch.setattr(rig.group, 'stop', lambda before_recorder: before_recorder() or [])
    rig.hear('/left/reference_generator', 0, reference)
    assert rig.supervisor.finish(failure) == []
    found = {file.name: json.loads(file.read_text()) for file in notes.iterdir()}
    assert found == ({'ended.json': {'ended': told, 'because': failure}} if told else {})
    rig.supervisor.__exit__()
    assert not notes.exists()


def test_a_node_whose_statuses_are_as_rare_as_allowed_is_not_silent():
    longest_s = next(one.upper for one in COMMON_PARAMETERS if one.name == 'diagnostics_period_s')
    assert longest_s < HEARD_S and 2.0 * longest_s < SILENT_S       # one may be lost

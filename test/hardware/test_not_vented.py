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

"""Test that the end of a rig says where a muscle may still be under pressure."""

import signal
from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy')

from fake_sysfs import make_dac, number_in                                  # noqa: E402, I100
from live_rig import Commander, LiveRig, wait_for                           # noqa: E402
from own_dac import BLOCKED, TIMED_OUT                           # noqa: E402
from pam_actuation.rigging.node_spec import NodeSpec                        # noqa: E402
from pam_actuation.rigging.supervisor import Supervisor                     # noqa: E402
from pam_actuation.rigging.transitions import SessionFailed                 # noqa: E402
from pam_actuation.rigging.venting import has_vented, NOT_KNOWN             # noqa: E402

pytestmark = pytest.mark.ros

NAME = '/muscle/valve_driver'


class Watched:
    """One driver under a supervisor, and a sender of commands."""

    def __init__(self, folder, under_pressure, **parameters):
        self.told, self.finding = [], ''
        self._under_pressure = under_pressure
        self._live = LiveRig(folder)
        self._supervisor = Supervisor(
            [NodeSpec('valve_driver', '/muscle', parameters)], self._live.domain_id)

    def __enter__(self):
        self._supervisor.__enter__()
        self._supervisor.start()
        self._live.listen()
        self._commander = Commander(self._live, 350_000.0)
        wait_for(self._under_pressure, 30.0, 'the pressure')
        return self

    def __exit__(self, *why):
        self._commander.end()
        self._supervisor.__exit__(*why)
        self._live.close()

    def kill(self):
        """Kill the driver."""
        self._supervisor.processes[NAME].send_signal(signal.SIGKILL)

    def watch(self, until=lambda told: False):
        """Watch until something was told, or the driver ends."""
        try:
            self._supervisor.watch(30.0, lambda: until(self.told), self.told.append)
        except SessionFailed as error:
            self.finding = str(error)

    def end(self):
        """End in order; return what did not go as it should."""
        return self._supervisor.finish()


@pytest.fixture
def own(tmp_path, own_dac_installed):
    """Return a rig on a back end that has ``write`` alone, and the file of what goes wrong."""
    file = tmp_path / 'signal'
    with Watched(tmp_path, lambda: float(file.read_text()) > 0.5, **{
            'backend': 'own_dac', 'own_dac.file': str(file)}) as rig:
        rig.fault = tmp_path / 'fault'
        yield rig


def test_a_killed_driver_without_a_watchdog_process(own):
    own.watch(lambda told: told)
    assert 'none, so nobody vents the device' in own.told[0]
    own.kill()
    own.watch()
    assert own.finding == f'{NAME}: valve_driver was ended by SIGKILL'
    assert own.end() == [own.finding, f'{NAME}: {NOT_KNOWN}']


def test_a_device_that_blocks(own):
    own.fault.write_text(BLOCKED)
    own.watch(lambda told: any('sent no status for 3 s: its valve holds' in one for one in told))
    assert 'open the dump valve' in own.told[-1]
    *ended, last = own.end()
    assert last == f'{NAME}: {NOT_KNOWN}'
    assert any('the device does not answer: NOT MADE SAFE' in one for one in ended)


def test_a_device_that_fails_when_it_is_to_vent(own):
    own.fault.write_text(TIMED_OUT)
    *ended, last = own.end()
    assert last == f'{NAME}: {NOT_KNOWN}'
    assert any('did not take the signal that vents' in one for one in ended)


def test_a_device_that_refused_the_safe_signal_is_not_known_to_be_vented():
    process = SimpleNamespace(exit_code=1, printed=lambda: '')
    values = {'device_watchdog_vents': '0', 'state': 'ended'}
    for message, vented in (('stopped', True), ('stopped, not vented: write failed', False),
                            ('latched; the device may not be vented: write failed', False)):
        assert has_vented(process, (2, message, values), '') == vented


def test_a_driver_whose_watchdog_process_vents_is_not_told_of(tmp_path):
    raw = make_dac(tmp_path)
    with Watched(tmp_path, lambda: (number_in(raw) or 0) > 1000, **{
            'backend': 'iio_dac', 'sysfs_root': str(tmp_path), 'dac.device': 'mcp4725'}) as rig:
        rig.kill()
        rig.watch()
        assert rig.end() == [f'{NAME}: valve_driver was ended by SIGKILL']
        assert number_in(raw) == 0
        assert not any('nobody vents the device' in one for one in rig.told)

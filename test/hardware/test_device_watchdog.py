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

"""Test the process that vents a device when the one that drives it is killed or stopped."""

import os
from pathlib import Path
import signal
import subprocess
import sys
import time

from fake_sysfs import break_attribute, duties, make_dac, make_pwm, number_in, PERIOD_NS, put
from pam_actuation.hardware import device_watchdog
from pam_actuation.hardware.device_watchdog import DeviceWatchdog
from pam_actuation.hardware.sysfs import DeviceError
from pam_actuation.hardware.valve_output import GuardedOutput, ValveOutput
import pytest

pytestmark = pytest.mark.timed

DRIVING = """
from pam_actuation.drivers.config import DriverConfig
from pam_actuation.hardware.back_ends import open_valve, parameters_of, VALVE_OUTPUTS
import sys
import time
values = {{p.name: p.default for p in parameters_of(VALVE_OUTPUTS)}}
values.update({{'sysfs_root': {root!r}, 'dac.device': 'mcp4725'}})
output = open_valve({backend!r}, {valve!r}, values, DriverConfig(), {safe}, 0.1)
output.send({efforts})
print('out', flush=True)
while True:
    output.send({efforts})
    time.sleep(0.005)
"""


class OneAttribute(ValveOutput):
    """A device of one attribute that takes whole volts."""

    safe_efforts = (0.0,)

    def __init__(self, path):
        super().__init__({}, None)
        self._path = path

    def write(self, efforts):
        put(self._path, round(efforts[0]))

    def safe_writes(self):
        return ((self._path, 0),)


def soon(condition, what):
    deadline_s = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < deadline_s, what
        time.sleep(0.005)


def gone(pid):
    """Tell whether a process has ended; one that nobody waited for counts as ended."""
    try:
        return ') Z ' in Path(f'/proc/{pid}/stat').read_text()
    except FileNotFoundError:
        return True


@pytest.fixture
def driving(tmp_path, request):
    """Return a function that starts a process which drives a device under ``tmp_path``."""
    started = []

    def start(backend, valve, safe, efforts):
        text = DRIVING.format(root=str(tmp_path), backend=backend, valve=valve, safe=safe,
                              efforts=efforts)
        started.append(subprocess.Popen(
            [sys.executable, '-c', text], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, start_new_session=True))
        assert started[-1].stdout.readline() == 'out\n'
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.communicate()


def test_a_killed_driver_leaves_a_vented_regulator_and_a_reason(tmp_path, driving):
    raw = make_dac(tmp_path)
    driver = driving('iio_dac', 'ppr', (0.0,), (3.0,))
    soon(lambda: number_in(raw) == 2000, 'driven')
    os.killpg(driver.pid, signal.SIGKILL)       # with all of its group
    soon(lambda: number_in(raw) == 0, 'vented')
    assert 'the valve driver is gone: vented' in driver.stderr.readline()


def test_a_stopped_driver_is_covered_until_it_goes_on(tmp_path, driving):
    chip = make_pwm(tmp_path)
    driver = driving('pwm_sysfs', 'hsv', (0.0, 1.0), (0.25, 0.0))
    driver.send_signal(signal.SIGSTOP)
    soon(lambda: duties(chip) == (0, PERIOD_NS), 'vented')
    driver.send_signal(signal.SIGCONT)
    soon(lambda: duties(chip) == (PERIOD_NS // 4, 0), 'driven again')
    driver.kill()
    soon(lambda: duties(chip) == (0, PERIOD_NS), 'vented again')


def test_it_is_silent_at_rest_and_ends_with_the_driver(tmp_path):
    path = tmp_path / 'volts'
    put(path, 0)
    watchdog = DeviceWatchdog([(path, 0)], 0.05)
    os.kill(watchdog.pid, signal.SIGTERM)       # what ends the driver does not end it
    watchdog.tell(False)
    put(path, 7)                                # another owner, later
    time.sleep(0.15)
    assert number_in(path) == 7 and watchdog.vents == 0
    watchdog.tell(True)
    soon(lambda: number_in(path) == 0, 'vented')
    soon(lambda: watchdog.vents == 1, 'counted')
    watchdog.tell(False)
    put(path, 7)
    pid = watchdog.pid
    watchdog.close(vented=True)
    assert gone(pid) and number_in(path) == 7


def test_a_device_that_refuses_is_tried_again(tmp_path):
    path = tmp_path / 'volts'
    put(path, 5)
    watchdog = DeviceWatchdog([(path, 0)], 0.05)
    break_attribute(path)
    watchdog.tell(True)
    time.sleep(0.15)
    assert watchdog.vents == 0
    path.unlink()
    put(path, 5)                                # it is back, with its old value
    soon(lambda: number_in(path) == 0, 'vented')
    watchdog.close(vented=True)


def test_a_watchdog_that_was_killed_is_a_fault_and_comes_back(tmp_path):
    path = tmp_path / 'volts'
    put(path, 0)
    watchdog = DeviceWatchdog([(path, 0)], 0.05)
    output = GuardedOutput(OneAttribute(path), watchdog)
    assert output.send((3.0,)) == '' and number_in(path) == 3
    first = watchdog.pid
    os.kill(first, signal.SIGKILL)
    soon(lambda: gone(first), 'killed')
    assert 'watchdog of the device: ended and was started again' in output.send((3.0,))
    assert number_in(path) == 0 and watchdog.pid != first
    assert output.send((0.0,)) == '' and output.send((2.0,)) == ''
    soon(lambda: number_in(path) == 0, 'vented by the new one')
    soon(lambda: output.watchdog_vents == 1, 'counted')
    assert output.close() == '' and output.watchdog_vents is None


def test_a_watchdog_that_is_stopped_is_a_fault_until_it_goes_on(tmp_path, monkeypatch):
    path = tmp_path / 'volts'
    put(path, 0)
    watchdog = DeviceWatchdog([(path, 0)], 60.0)
    output = GuardedOutput(OneAttribute(path), watchdog)
    for _ in range(100):                        # with the period of a driver
        assert output.send((3.0,)) == ''
        time.sleep(0.005)
    monkeypatch.setattr(device_watchdog, 'SILENCE_S', 0.2)
    os.kill(watchdog.pid, signal.SIGSTOP)
    soon(lambda: 'does not read what it is told' in output.send((3.0,)), 'noticed')
    assert number_in(path) == 0
    os.kill(watchdog.pid, signal.SIGCONT)
    soon(lambda: output.send((3.0,)) == '', 'goes on')
    assert number_in(path) == 3 and watchdog.vents == 0
    assert output.close() == '' and number_in(path) == 0


def test_a_driver_that_stood_still_is_no_fault_of_its_watchdog(tmp_path, monkeypatch):
    """Both may have, and the driver goes on first."""
    monkeypatch.setattr(device_watchdog, 'SILENCE_S', 0.05)
    path = tmp_path / 'volts'
    put(path, 0)
    watchdog = DeviceWatchdog([(path, 0)], 60.0)
    os.kill(watchdog.pid, signal.SIGSTOP)
    watchdog.tell(True)
    time.sleep(0.1)
    watchdog.tell(True)
    os.kill(watchdog.pid, signal.SIGCONT)
    watchdog.close(vented=True)


def test_one_that_is_started_again_knows_that_the_muscle_is_under_pressure(tmp_path):
    path = tmp_path / 'volts'
    put(path, 0)
    watchdog = DeviceWatchdog([(path, 0)], 0.05)
    first = watchdog.pid
    os.kill(first, signal.SIGKILL)
    soon(lambda: gone(first), 'killed')
    put(path, 5)
    with pytest.raises(DeviceError, match='ended and was started again'):
        watchdog.tell(True)                     # and then the driver stands still
    soon(lambda: number_in(path) == 0, 'vented')
    watchdog.close(vented=True)


@pytest.mark.parametrize('volts', [5.0, 0.0])
def test_a_device_that_refuses_to_the_end_is_vented_as_soon_as_it_takes_it(tmp_path, volts):
    path = tmp_path / 'volts'
    put(path, 0)
    watchdog = DeviceWatchdog([(path, 0)], 60.0)
    process = watchdog._process
    output = GuardedOutput(OneAttribute(path), watchdog)
    assert output.send((volts,)) == ''
    path.unlink()
    assert 'No such file' in output.close() and process.poll() is None
    put(path, 5)                                # it is back, with its old value or another one
    soon(lambda: number_in(path) == 0, 'vented')
    assert process.wait(5.0) == 0


def test_one_that_hangs_is_ended_with_a_driver_whose_device_is_vented(tmp_path, monkeypatch):
    monkeypatch.setattr(device_watchdog, 'END_TIMEOUT_S', 0.05)
    path = tmp_path / 'volts'
    put(path, 3)
    watchdog = DeviceWatchdog([(path, 0)], 60.0)
    pid = watchdog.pid
    os.kill(pid, signal.SIGSTOP)
    with pytest.raises(DeviceError, match='does not read'):
        while True:                             # until the pipe is full
            watchdog.tell(True)
    assert 'does not read' in GuardedOutput(OneAttribute(path), watchdog).close()
    assert number_in(path) == 0 and gone(pid)


def test_one_that_can_not_be_started_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, 'executable', str(tmp_path / 'python'))
    with pytest.raises(DeviceError, match='cannot be started'):
        DeviceWatchdog([(tmp_path / 'volts', 0)], 0.05)

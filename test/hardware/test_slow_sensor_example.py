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

"""The load cell that the guide of the hardware shows is read in a thread, and comes back."""

from pathlib import Path
import queue
import re
import sys
import threading
import time
from types import ModuleType

from pam_actuation.hardware.back_ends import open_sensors, SENSOR_INPUTS
from pam_actuation.hardware.sensor_input import NewReadings
from pam_actuation.hardware.sysfs import DeviceError
import pytest

GUIDE = Path(__file__).parents[2] / 'docs/guides/hardware.md'
SOON_S = 5.0


class Serial:
    """A line of pyserial: what a test gives is read, an exception is raised."""

    given = queue.Queue()

    def __init__(self, port, baud, timeout):
        assert port == '/dev/ttyACM0' and timeout <= 0.5

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def readline(self):
        try:
            line = self.given.get(timeout=0.05)
        except queue.Empty:
            return b''          # the time-out
        if isinstance(line, Exception):
            raise line
        return line


@pytest.fixture
def readings(monkeypatch):
    """Return what is new of the load cell of the guide."""
    serial = ModuleType('serial')
    serial.Serial = Serial
    monkeypatch.setitem(sys.modules, 'serial', serial)
    text = re.search(r'```python\n(import threading.*?)```', GUIDE.read_text(), re.S)[1]
    names = {}
    exec(compile(text, str(GUIDE), 'exec'), names)
    monkeypatch.setitem(SENSOR_INPUTS, 'load_cell', names['LoadCell'])
    before = {*threading.enumerate()}
    sensors = open_sensors('load_cell', {})
    thread, = {*threading.enumerate()} - before
    yield NewReadings(sensors, time.time_ns())
    sensors.close()
    thread.join(SOON_S)
    assert not thread.is_alive()


def comes(readings):
    """Wait for a new reading, or for what is wrong."""
    deadline = time.monotonic() + SOON_S
    while time.monotonic() < deadline:
        new = readings.take('force', time.time_ns())
        if new is not None:
            return new[0]
        time.sleep(0.005)
    raise AssertionError('no new reading')


def test_the_load_cell_of_the_guide_is_read_in_newtons_and_comes_back(readings):
    given = Serial.given
    assert readings.take('force', time.time_ns()) is None       # nothing yet
    for line in (b'5\n', b'1.0\n'):
        given.put(line)
    assert comes(readings) == pytest.approx(9.80665)
    assert readings.take('force', time.time_ns()) is None       # once
    given.put(b'1.')                                            # the board stops in a line
    given.put(b'5\n')
    assert comes(readings) == pytest.approx(1.5 * 9.80665)
    for broken, words in ((OSError(5, 'Input/output error'), 'Input/output error'),
                          (b'1.2.3\n', 'could not convert')):
        given.put(broken)
        with pytest.raises(DeviceError, match=f'/dev/ttyACM0: .*{words}'):
            comes(readings)
        for line in (b'0.5\n', b'3.0\n'):
            given.put(line)
        deadline = time.monotonic() + SOON_S
        while readings._sensors._problem and time.monotonic() < deadline:
            time.sleep(0.01)
        assert comes(readings) == pytest.approx(29.41995)
    assert readings.waits.count == 0

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

"""The serial lines that the guide of the hardware shows: a load cell and a regulator."""

from pathlib import Path
import queue
import re
import sys
import termios
import threading
import time
from types import ModuleType

from pam_actuation.drivers.config import DriverConfig
from pam_actuation.hardware.back_ends import open_sensors, open_valve
from pam_actuation.hardware.back_ends import SENSOR_INPUTS, VALVE_OUTPUTS
from pam_actuation.hardware.sensor_input import NewReadings
from pam_actuation.hardware.sysfs import DeviceError
import pytest

GUIDE = Path(__file__).parents[2] / 'docs/guides/hardware.md'
SOON_S = 5.0


class Serial:
    """A line of pyserial: what a test gives is read, an exception is raised."""

    given, opened = queue.Queue(), 0

    def __init__(self, port, baud, timeout):
        Serial.opened += 1
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
                          (termios.error(5, 'gone'), 'gone')):
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


@pytest.mark.parametrize('line', [b'1.2.3\n', b'\xf9T\n', b'\x8a' * 81])
def test_a_line_that_is_no_number_costs_one_reading_and_no_new_start(readings, line):
    given, opened = Serial.given, Serial.opened
    for one in (b'5\n', line):
        given.put(one)
    with pytest.raises(DeviceError, match='/dev/ttyACM0: b.* is no number: is the baud rate'):
        comes(readings)
    given.put(b'3.0\n')
    deadline = time.monotonic() + SOON_S
    while readings._sensors._problem and time.monotonic() < deadline:
        time.sleep(0.01)
    assert comes(readings) == pytest.approx(29.41995)
    assert Serial.opened <= opened + 1          # the port, which starts many boards anew


class Board:
    """The board of the regulator, by the rules of the guide, and its line."""

    plugged, hears, volts, opened = True, True, 5.0, 0
    answers = None

    def begin(self):
        """Start, or start anew."""
        self.volts, self._ready = 0.0, False

    def __call__(self, port, baud, timeout, write_timeout):
        assert port == '/dev/ttyACM1' and max(timeout, write_timeout) <= 0.05
        self.reset_input_buffer()
        self.opened += 1
        self.begin()
        return self

    def reset_input_buffer(self):
        if not self.plugged:
            raise termios.error(5, 'Input/output error')
        self._waiting = b''

    def write(self, line):
        if self.hears:
            volts = float(line.removeprefix(b'V '))
            self._ready = self._ready or volts == 0.0
            self.volts = volts if self._ready else 0.0
            self._waiting += self.answers or (b'OK\r\n' if self._ready else b'NO\r\n')

    def readline(self):
        return self._waiting

    def close(self):
        pass


def test_the_regulator_of_the_guide_is_driven_and_comes_back(monkeypatch):
    board = Board()
    monkeypatch.setitem(sys.modules, 'serial', ModuleType('serial'))
    sys.modules['serial'].Serial = board
    text = re.search(r'```python\n(import time\n.*?)```', GUIDE.read_text(), re.S)[1]
    names = {}
    exec(compile(text, str(GUIDE), 'exec'), names)
    monkeypatch.setitem(VALVE_OUTPUTS, 'regulator', names['Regulator'])
    monkeypatch.setattr(names['time'], 'sleep', lambda seconds: None)
    output = open_valve('regulator', 'ppr', {names['PORT'].name: '/dev/ttyACM1'}, DriverConfig(),
                        (0.0,))
    assert board.volts == 0.0 and output.send((2.5,)) == '' and board.volts == 2.5

    board.hears = False                         # it is late, and is not started anew
    assert output.send((2.0,)) == "/dev/ttyACM1: answered b'' in place of OK"
    assert output.unvented and board.opened == 1
    board.hears = True
    assert output.vent() == '' and board.volts == 0.0 and output.send((2.5,)) == ''

    board.begin()                               # a dip of its supply
    assert "answered b'NO" in output.send((2.5,)) and board.volts == 0.0
    assert output.unvented == '' and output.send((2.5,)) == ''

    board.plugged = False
    assert ": termios.error: (5, 'Input/output error')" in output.send((2.5,))
    assert output.vent() and board.opened == 1
    board.plugged = True
    assert output.vent() == '' and board.opened == 2 and output.send((2.5,)) == ''
    assert output.close() == '' and board.volts == 0.0

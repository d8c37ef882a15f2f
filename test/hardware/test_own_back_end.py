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

"""Test a back end that has ``write`` alone: it vents wherever those of this package do."""

import gc
import re
import signal
import time

from own_dac import BLOCKED, CANCELLED, EXITS, OPENINGS, SLOW, TIMED_OUT, WriteOnly
from pam_actuation.drivers.config import DriverConfig
from pam_actuation.hardware import back_ends
from pam_actuation.messages import SAFE_EFFORTS
from pam_sim.errors import InputError
import pytest

COMMAND_PA = 350_000.0


class Bench:
    """The file that stands for the device, and what goes wrong there."""

    def __init__(self, folder):
        self.file, self._fault = folder / 'signal', folder / 'fault'

    def breaks(self, how):
        """Let the device go wrong."""
        self._fault.write_text(how)

    def is_well(self):
        """Let the device be as it was."""
        self._fault.unlink(missing_ok=True)

    def signal(self):
        """Return what the valve gets."""
        text = self.file.read_text() if self.file.exists() else ''
        return tuple(float(part) for part in text.split())


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path)


@pytest.fixture
def opened(bench, monkeypatch):
    """Return a function that opens the back end behind the guard."""
    monkeypatch.setitem(back_ends.VALVE_OUTPUTS, 'own_dac', WriteOnly)

    def open_it(valve='ppr'):
        return back_ends.open_valve(
            'own_dac', valve, {'own_dac.file': str(bench.file)}, DriverConfig(),
            SAFE_EFFORTS[valve], 0.1)
    return open_it


@pytest.mark.parametrize('valve, signal_', [('ppr', (3.0,)), ('hsv', (0.25, 0.0))])
def test_it_vents_when_it_is_opened_told_to_and_closed(bench, opened, valve, signal_):
    safe = SAFE_EFFORTS[valve]
    bench.file.write_text('5 5')
    output = opened(valve)
    assert bench.signal() == safe
    for vent in (lambda: output.send(safe), output.vent, output.close):
        assert output.send(signal_) == '' and bench.signal() == signal_
        assert vent() == '' and bench.signal() == safe


def test_it_vents_when_nobody_holds_it_any_more(bench, opened):
    output = opened()
    output.send((3.0,))
    del output
    gc.collect()
    assert bench.signal() == (0.0,)


def test_what_it_raises_is_told_with_its_parameters_and_vents(bench, opened):
    output = opened()
    bench.breaks(TIMED_OUT)
    told = f'back end WriteOnly (own_dac.file {bench.file}): TimeoutError: timed out'
    assert output.send((3.0,)) == told and output.failures == 2
    assert output.close() == told
    with pytest.raises(InputError) as refused:
        opened()
    assert str(refused.value) == told
    bench.is_well()
    assert output.send((3.0,)) == ''
    bench.breaks(TIMED_OUT)
    output.send((2.0,))
    bench.is_well()
    assert output.send((0.0,)) == '' and bench.signal() == (0.0,)


@pytest.mark.parametrize('how, words', [(CANCELLED, 'CancelledError'), (EXITS, 'SystemExit: 3')])
def test_what_is_no_exception_is_a_fault_of_the_device(bench, opened, how, words):
    output = opened()
    assert output.send((3.0,)) == ''
    bench.breaks(how + OPENINGS)
    assert words in output.send((2.0,)) and output.unvented == ''
    assert bench.signal() == (0.0,)
    bench.breaks(how)
    assert words in output.send((2.0,)) and words in output.unvented
    assert words in output.vent() and words in output.close()
    with pytest.raises(InputError, match=words[:6]):
        opened()
    bench.file.write_text('5')
    bench.is_well()
    del output
    gc.collect()
    assert bench.signal() == (0.0,)


def test_ctrl_c_within_a_write_is_no_fault_of_the_device(opened, monkeypatch):
    def interrupted(device, efforts):
        raise KeyboardInterrupt
    output = opened()
    with monkeypatch.context() as patch:
        patch.setattr(WriteOnly, 'write', interrupted)
        with pytest.raises(KeyboardInterrupt):
            output.send((2.0,))
    assert output.close() == ''


def test_its_port_is_closed_after_the_last_signal(bench, opened, monkeypatch):
    gc.collect()            # outputs of other tests
    closed = []
    monkeypatch.setattr(WriteOnly, 'close', lambda device: closed.append(bench.signal()))
    output = opened()
    output.send((3.0,))
    assert output.close() == '' and closed == [(0.0,)]
    output = opened()
    bench.breaks(TIMED_OUT)
    assert 'timed out' in output.close() and len(closed) == 1       # a last try needs the port
    del output
    gc.collect()
    assert len(closed) == 2
    with pytest.raises(InputError, match='timed out'):
        opened()
    assert len(closed) == 3


def test_a_mistake_in_its_code_is_told_with_its_line(opened, monkeypatch):
    monkeypatch.setattr(WriteOnly, 'write', back_ends.ValveOutput.write)
    with pytest.raises(InputError, match=r'NotImplementedError \(valve_output.py:\d+\)'):
        opened()


@pytest.fixture
def rig(bench, tmp_path, own_dac_installed):
    """Start a driver on the back end and a sender of commands; the muscle is under pressure."""
    pytest.importorskip('rclpy')
    from live_rig import Commander, LiveRig, wait_for
    live = LiveRig(tmp_path)
    live.wait_for = wait_for
    live.start('valve_driver', **{'backend': 'own_dac', 'own_dac.file': str(bench.file)})
    live.listen()
    wait_for(lambda: live.health['valve_driver'], 60.0, 'the driver')
    live.commander = Commander(live, COMMAND_PA)
    live.follows = lambda: wait_for(lambda: bench.signal()[0] > 0.5, 20.0, 'the wanted voltage')
    live.follows()
    yield live
    bench.is_well()
    live.commander.end()
    live.close()


@pytest.mark.ros
def test_an_emergency_stop_and_ctrl_c_vent_it(bench, rig):
    from std_srvs.srv import Trigger
    assert rig.call(Trigger, 'valve_driver/emergency_stop').success
    assert bench.signal() == (0.0,)
    assert rig.call(Trigger, 'valve_driver/reset').success
    rig.follows()
    driver = rig.processes['valve_driver']
    driver.send_signal(signal.SIGINT)
    assert driver.wait(10.0) and driver.exit_code == 0
    assert bench.signal() == (0.0,)


@pytest.mark.ros
def test_a_device_that_times_out_is_a_fault_and_is_vented_when_it_answers(bench, rig):
    from std_srvs.srv import Trigger
    bench.breaks(TIMED_OUT)
    rig.wait_for(lambda: rig.health['valve_driver'][-1].level == 2, 10.0, 'the fault')
    assert 'TimeoutError: timed out' in rig.health['valve_driver'][-1].message
    bench.is_well()
    rig.wait_for(lambda: bench.signal() == (0.0,), 5.0, 'the safe voltage')
    assert rig.call(Trigger, 'valve_driver/reset').success
    rig.follows()


@pytest.mark.ros
def test_a_library_that_cancels_every_write_is_told_as_not_vented(bench, rig):
    bench.breaks(CANCELLED)
    rig.wait_for(lambda: rig.health['valve_driver'][-1].level == 2, 10.0, 'the fault')
    rig.wait_for(lambda: rig.heard['valve_signal'][-1].plain.efforts == (0.0,), 5.0, '0 V')
    rig.wait_for(lambda: 'the device may not be vented: back end WriteOnly' in
                 rig.health['valve_driver'][-1].message, 5.0, 'the word')
    assert '; shut the supply and open the dump valve' in rig.health['valve_driver'][-1].message
    driver = rig.processes['valve_driver']
    driver.send_signal(signal.SIGTERM)
    assert driver.wait(10.0) and driver.exit_code == 1
    rig.wait_for(lambda: 'not vented: back end WriteOnly' in
                 rig.health['valve_driver'][-1].message, 5.0, 'the last word')
    assert 'CancelledError' in rig.health['valve_driver'][-1].message


@pytest.mark.ros
def test_a_device_that_blocks_keeps_no_driver_alive(bench, rig):
    bench.breaks(BLOCKED)
    time.sleep(0.5)
    driver = rig.processes['valve_driver']
    driver.send_signal(signal.SIGTERM)
    assert driver.wait(10.0), 'the driver does not end'
    assert driver.exit_code == 1
    assert driver.last_line().endswith('the device does not answer: NOT MADE SAFE')


def test_a_write_that_waits_is_counted_and_told(bench, opened, monkeypatch):
    def slow(device, efforts):
        time.sleep(0.11)
        raise TimeoutError('no answer')
    output = opened()
    assert output.waits.says == ''
    with monkeypatch.context() as patch:
        patch.setattr(WriteOnly, 'write', slow)
        output.send((3.0,))
    assert re.fullmatch(r'the back end took [\d.]+ s to take a signal', output.waits.says)
    assert output.waits.count == 2          # the voltage and 0 V


@pytest.mark.ros
def test_a_device_that_blocked_for_a_moment_is_told_as_the_reason(bench, rig):
    bench.breaks(BLOCKED)
    time.sleep(1.0)
    bench.is_well()
    words = ' s to take a signal, and the driver stood still meanwhile: give write a'
    rig.wait_for(lambda: any(
        'driver itself was stopped' in said.message and words in said.message
        for said in rig.health['valve_driver']), 10.0, 'the reason')
    rig.follows()


@pytest.mark.ros
def test_a_device_slower_than_the_period_is_told(bench, rig):
    def said():
        return rig.health['valve_driver'][-1].message

    bench.breaks(SLOW)
    words = (r'.*; the back end takes [\d.]+ ms to take each signal, longer than the period of '
             '5 ms, so the driver does not keep its rate: use a faster line')
    rig.wait_for(lambda: re.fullmatch(words, said()), 10.0, 'the warning')
    assert rig.health['valve_driver'][-1].level == 1
    bench.is_well()
    rig.wait_for(lambda: 'back end' not in said(), 10.0, 'the end of it')

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

"""Test who counts as a second sender: by who is heard, not by who was there once."""

from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.drivers.senders import DriverSenders, is_safe, Senders, SignalSenders, told
from pam_actuation.messages import Pressure, ValveSignal
from pam_sim.units import P_ATM_PA
import pytest

MS = 1_000_000
NAMES = {b'a': '/muscle/sofc_controller', b'b': '/muscle/pid_controller', b'?': '',
         b'd': '/muscle/valve_driver', b'e': '/muscle/valve_driver',
         b'w': '/muscle/valve_watchdog'}


def heard(senders, writers, period_ms=10, begin_ms=0):
    """Let a string of writers be heard one after the other; return the time of the last [ns]."""
    now_ns = begin_ms * MS
    for k, writer in enumerate(writers):
        now_ns = (begin_ms + k * period_ms) * MS
        senders.heard(writer, now_ns)
    return now_ns


@pytest.mark.parametrize('writers', ['aaaaaa', 'aaabbb', 'abbbbb'])
def test_one_writer_and_one_that_takes_its_place_are_one_sender(writers):
    senders = Senders()
    assert senders.rivals(heard(senders, writers)) == ()


@pytest.mark.parametrize('writers', ['aba', 'aabbabb', 'abab'])
def test_a_writer_that_comes_back_shows_that_there_are_two(writers):
    senders = Senders()
    now_ns = heard(senders, writers)
    assert set(senders.rivals(now_ns)) == {'a', 'b'}
    assert senders.rivals(now_ns + 980 * MS)
    assert not senders.rivals(now_ns + 1001 * MS)


def test_a_writer_that_comes_back_after_a_second_of_silence_takes_the_place_again():
    senders = Senders()
    now_ns = heard(senders, 'a' * 10 + 'b' * 110 + 'a')
    assert not senders.rivals(now_ns) and senders.replaced('b') and not senders.replaced('a')
    assert not senders.replaced('c')
    assert set(senders.active(now_ns)) == {'a', 'b'}


def test_one_that_ended_just_before_is_not_taken_for_one_of_two():
    senders = Senders()
    now_ns = heard(senders, 'aaabbbcbcbc')
    assert set(senders.rivals(now_ns)) == {'b', 'c'}


def test_who_is_not_known_is_not_judged_and_a_clock_that_goes_back_begins_anew():
    senders = Senders()
    now_ns = heard(senders, [None, 'a', None, 'a'])
    assert not senders.rivals(now_ns)
    now_ns = heard(senders, 'aba', begin_ms=5000)
    assert senders.rivals(now_ns)
    assert not senders.rivals(heard(senders, 'b', begin_ms=100))


def test_the_driver_itself_and_the_safe_signal_of_its_watchdog_do_not_count():
    signals = SignalSenders(b'd', NAMES[b'w'])
    assert not signals.heard(b'd', NAMES[b'd'], False, 0)
    assert not signals.heard(b'w', NAMES[b'w'], True, 0)
    assert not signals.foreign(0)
    assert signals.heard(b'w', NAMES[b'w'], False, MS)       # a watchdog that opens is none
    assert signals.foreign(MS) == (b'w',)


def test_a_name_that_is_on_its_way_is_waited_for_but_not_with_an_open_valve():
    signals = SignalSenders(b'd', NAMES[b'w'])
    assert not signals.heard(b'?', '', True, 0) and not signals.heard(b'?', '', True, 199 * MS)
    assert signals.heard(b'?', '', True, 201 * MS)
    assert SignalSenders(b'd', NAMES[b'w']).heard(b'?', '', False, 0)


def test_names_are_told_as_words():
    assert told(['/b', '/a']) == '/a and /b'
    assert told(['/a', '/a']) == 'two nodes named /a'
    assert told(['/a', '/b', '/a', '/a']) == '3 nodes named /a and /b'
    assert told(['', '/a']) == 'a program without a node name and /a'


@pytest.mark.parametrize('names, efforts, safe', [
    (('ppr_voltage',), (0.0,), True), (('ppr_voltage',), (0.1,), False),
    (('fill_duty', 'vent_duty'), (0.0, 1.0), True), (('vent_duty',), (1.0,), False),
    (('vent_duty', 'fill_duty'), (1.0, 0.0), True), (('other',), (0.0,), False)])
def test_the_safe_signal_is_known_by_its_names(names, efforts, safe):
    assert is_safe(ValveSignal(0, names, efforts)) == safe


def driver_senders():
    return DriverSenders(b'd', NAMES[b'w'], lambda topic, writer: NAMES.get(writer, ''),
                         NAMES[b'd'])


def test_the_fault_names_whom_the_driver_saw():
    senders = driver_senders()
    assert senders.fault(0) is None
    now_ns = heard(senders.topics['pressure_command'], [b'a', b'b', b'a'])
    key, text = senders.fault(now_ns)
    assert key == 'two_publishers' and text == (
        'two publishers send pressure_command: /muscle/pid_controller and '
        '/muscle/sofc_controller, stop one of them')
    now_ns = heard(senders.topics['pressure'], [b'a', b'?', b'a'], begin_ms=5000)
    key, text = senders.fault(now_ns)
    assert key == 'two_sensors' and 'a program without a node name and /muscle/sofc' in text
    senders.signals.heard(b'e', NAMES[b'e'], True, now_ns)
    key, text = senders.fault(now_ns)
    assert key == 'second_driver' and 'another node named /muscle/valve_driver' in text


def test_the_only_one_who_commands_is_known_by_who_was_heard_on_both_topics():
    senders = driver_senders()
    assert senders.commander(0) == ''
    now_ns = heard(senders.topics['pressure_command'], [b'a', b'a'])
    assert senders.commander(now_ns) == '/muscle/sofc_controller'
    senders.topics['valve_command'].heard(b'b', now_ns)
    assert senders.commander(now_ns) == ''
    now_ns = heard(senders.topics['valve_command'], [b'?'], begin_ms=5000)
    assert senders.commander(now_ns) == 'a program without a node name'
    senders.topics['pressure_command'].heard(None, now_ns)
    assert senders.commander(now_ns + 1001 * MS) == ''


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_the_driver_vents_for_a_second_sender_and_rises_slowly_afterwards(valve):
    driver = DriverLoop(valve)

    def tick(now_ms, fault=None):
        driver.on_pressure(Pressure(now_ms * MS, P_ATM_PA + min(250.0 * now_ms, 390e3)))
        driver.on_command(Pressure(now_ms * MS, P_ATM_PA + 4e5))
        driver.set_sender_fault(fault)
        return driver.tick(now_ms * MS)

    for now_ms in range(0, 2000, 10):
        signal, status = tick(now_ms)
    assert status.level == 0 and not is_safe(signal)
    fault = 'second_driver', 'valve_signal is sent by /x as well as by this driver'
    signal, status = tick(2000, fault)
    assert is_safe(signal) and status.level == 2 and '/x' in status.message
    assert dict(status.values)['fault'] == 'second_driver'
    signal, status = tick(2010)
    assert 'no more than 500 kPa/s' in status.message
    assert float(dict(status.values)['target_kpa_gauge']) < 20.0

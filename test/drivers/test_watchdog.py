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

"""Test the watchdog: it vents a silent driver's valve, and is silent itself otherwise."""

from pam_actuation.drivers.watchdog import (
    CONTESTED, HEARS, machine_load, RESTS, SignalWatchdog, VENTS, WAITING)
from pam_actuation.messages import ValveSignal
import pytest

MS = 1_000_000
FILLING = {'ppr': (('ppr_voltage',), (3.0,)),
           'hsv': (('fill_duty', 'vent_duty'), (0.4, 0.0))}
SAFE = {'ppr': (0.0,), 'hsv': (0.0, 1.0)}


@pytest.fixture(params=['ppr', 'hsv'])
def valve(request):
    return request.param


def driven(valve, until_ms, efforts=None):
    """Return a watchdog that heard a driver every 5 ms up to a time."""
    watchdog = SignalWatchdog(valve, 0.05)
    names, filling = FILLING[valve]
    for now_ms in range(0, until_ms, 5):
        watchdog.on_signal(
            ValveSignal(now_ms * MS - 1, names, efforts or filling), now_ms * MS)
        assert watchdog.tick(now_ms * MS) is None and watchdog.state == HEARS
    return watchdog


def test_it_waits_for_a_driver(valve):
    watchdog = SignalWatchdog(valve, 0.05)
    assert all(watchdog.tick(k * 10 * MS) is None for k in range(100))
    assert watchdog.state == WAITING and watchdog.vents == 0


def test_it_vents_after_the_timeout_and_goes_on_although_it_hears_itself(valve):
    watchdog = driven(valve, 100)
    assert watchdog.tick(145 * MS) is None
    sent = []
    for now_ms in range(146, 500, 10):
        signal = watchdog.tick(now_ms * MS)
        sent.append(signal)
        watchdog.on_signal(signal, now_ms * MS + 1)
    assert {signal.efforts for signal in sent} == {SAFE[valve]}
    assert [signal.stamp_ns for signal in sent] == [k * MS for k in range(146, 500, 10)]
    assert watchdog.state == VENTS and watchdog.vents == 1


def test_the_stamp_of_its_signal_may_be_of_another_clock(valve):
    watchdog = driven(valve, 100)
    signal = watchdog.tick(200 * MS, 7)
    assert signal.stamp_ns == 7 and signal.efforts == SAFE[valve]
    watchdog.on_signal(signal, 201 * MS)
    # It did not take its own for the driver's.
    assert watchdog.tick(202 * MS, 8).stamp_ns == 8


def test_it_falls_silent_when_the_driver_speaks_again(valve):
    watchdog = driven(valve, 100)
    for now_ms in range(150, 200, 10):
        watchdog.on_signal(watchdog.tick(now_ms * MS), now_ms * MS)
    names, filling = FILLING[valve]
    watchdog.on_signal(ValveSignal(201 * MS, names, filling), 202 * MS)
    assert watchdog.tick(203 * MS) is None and watchdog.state == HEARS
    assert watchdog.tick(260 * MS).efforts == SAFE[valve]
    assert watchdog.vents == 2


def test_it_vents_the_valve_it_heard_whatever_it_was_told(valve):
    watchdog = SignalWatchdog({'ppr': 'hsv', 'hsv': 'ppr'}[valve], 0.05)
    names, filling = FILLING[valve]
    watchdog.on_signal(ValveSignal(1, names, filling), MS)
    signal = watchdog.tick(60 * MS)
    assert (signal.names, signal.efforts) == (names, SAFE[valve])
    assert watchdog.valve_type == valve


def test_a_driver_that_ended_safely_is_left_alone(valve):
    watchdog = driven(valve, 100)
    names, _ = FILLING[valve]
    watchdog.on_signal(ValveSignal(101 * MS, names, SAFE[valve]), 101 * MS)
    assert all(watchdog.tick(now_ms * MS) is None for now_ms in range(110, 400, 10))
    assert watchdog.state == RESTS and watchdog.vents == 0


def test_half_a_signal_is_not_taken_for_the_safe_one():
    watchdog = driven('hsv', 100)
    watchdog.on_signal(ValveSignal(101 * MS, ('vent_duty',), (1.0,)), 101 * MS)
    assert watchdog.tick(200 * MS).efforts == SAFE['hsv']


DRIVER, WATCHDOG, STRANGER = '/muscle/valve_driver', '/muscle/valve_watchdog', '/stranger'


class Scene:
    """A watchdog, and who speaks every 5 ms: writer to (name, efforts)."""

    def __init__(self, valve):
        self.valve = valve
        self.watchdog = SignalWatchdog(valve, 0.05, WATCHDOG, driver=DRIVER)
        self.now_ms = 0

    def speak(self, until_ms, **speakers):
        """Let some speak until a time; return the efforts the watchdog sent with each tick."""
        names, _ = FILLING[self.valve]
        sent = []
        for self.now_ms in range(self.now_ms, until_ms, 5):
            for writer, (name, efforts) in speakers.items():
                self.watchdog.on_signal(ValveSignal(
                    self.now_ms * MS - 1, names, efforts), self.now_ms * MS, writer, name)
            signal = self.watchdog.tick(self.now_ms * MS)
            sent.append(signal and signal.efforts)
            if signal:
                self.watchdog.on_signal(signal, self.now_ms * MS, 'own', WATCHDOG)
        self.now_ms += 5
        return sent


@pytest.fixture
def scene(valve):
    made = Scene(valve)
    made.filling, made.safe = FILLING[valve][1], SAFE[valve]
    assert set(made.speak(500, a=(DRIVER, made.filling))) == {None}
    return made


def test_a_second_sender_is_vented_and_named_until_it_is_silent_for_a_second(scene):
    sent = scene.speak(800, a=(DRIVER, scene.filling), x=(STRANGER, scene.filling))
    assert set(sent) == {scene.safe} and scene.watchdog.state == CONTESTED
    assert f'sent by {DRIVER} and {STRANGER}' in scene.watchdog.text
    sent = scene.speak(2000, a=(DRIVER, scene.filling))
    assert sent[0] == scene.safe and sent[-1] is None and scene.watchdog.state == HEARS
    assert scene.watchdog.vents == 1


def test_a_second_sender_that_goes_on_beyond_the_driver_does_not_take_its_place(scene):
    scene.speak(800, a=(DRIVER, scene.safe), x=(STRANGER, scene.filling))
    sent = scene.speak(4000, x=(STRANGER, scene.filling))       # the driver was killed
    assert set(sent) == {scene.safe} and STRANGER in scene.watchdog.text
    sent = scene.speak(6000)
    assert set(sent) == {scene.safe} and scene.watchdog.state == VENTS
    sent = scene.speak(7000, b=(DRIVER, scene.filling))         # a new one
    assert set(sent) == {None} and scene.watchdog.state == HEARS


def test_a_stranger_is_not_taken_for_a_killed_driver_but_may_follow_one_that_ended(scene):
    scene.speak(1000)
    assert scene.watchdog.state == VENTS
    assert set(scene.speak(2000, x=(STRANGER, scene.filling))) == {scene.safe}
    assert scene.watchdog.state == CONTESTED
    scene.speak(4000, b=(DRIVER, scene.filling))
    scene.speak(4005, b=(DRIVER, scene.safe))
    assert set(scene.speak(5000)) == {None} and scene.watchdog.state == RESTS
    assert set(scene.speak(6000, x=(STRANGER, scene.filling))) == {None}
    assert scene.watchdog.state == HEARS


def test_a_driver_that_is_stopped_replaced_and_continued_is_seen(scene):
    scene.speak(1000)
    assert set(scene.speak(2000, b=(DRIVER, scene.filling))) == {None}
    sent = scene.speak(2200, a=(DRIVER, scene.filling), b=(DRIVER, scene.filling))
    assert set(sent) == {scene.safe}
    assert f'two nodes named {DRIVER}' in scene.watchdog.text


def test_a_restarted_driver_whose_name_is_on_its_way_is_no_second_sender(scene):
    scene.speak(1000)
    assert set(scene.speak(1100, b=('', scene.safe))) == {scene.safe}
    assert scene.watchdog.state == VENTS
    assert set(scene.speak(1200, b=(DRIVER, scene.safe))) == {None}
    assert scene.watchdog.state == HEARS and scene.watchdog.vents == 1


def test_a_second_watchdog_is_no_second_sender(scene):
    sent = scene.speak(800, a=(DRIVER, scene.filling), y=(WATCHDOG, scene.safe))
    assert set(sent) == {None}


def test_the_driver_of_the_rig_takes_its_place_from_a_stranger_that_came_first(valve):
    scene = Scene(valve)
    scene.speak(500, x=(STRANGER, FILLING[valve][1]))
    scene.speak(2000, a=(DRIVER, FILLING[valve][1]))
    assert scene.watchdog.state == HEARS


def test_it_says_for_how_long_it_heard_nothing_and_how_busy_the_machine_is(valve):
    watchdog = SignalWatchdog(valve, 0.05, load=lambda: 'load 7.5 on 2 cores')
    names, filling = FILLING[valve]
    watchdog.on_signal(ValveSignal(1, names, filling), 0)
    watchdog.tick(10 * MS)
    watchdog.tick(20 * MS)
    assert watchdog.tick(57 * MS)
    assert watchdog.text == (
        'vented because the valve signal fell silent for 57 ms (limit 50 ms): driver killed or '
        'stopped, or the machine too busy (load 7.5 on 2 cores, this watchdog itself waited 37 ms '
        'for the processor)')
    for now_ms in range(67, 2500, 10):
        watchdog.tick(now_ms * MS)
    assert 'fell silent for 2000 ms' in watchdog.text and '37 ms' in watchdog.text
    assert ' cores' in machine_load()

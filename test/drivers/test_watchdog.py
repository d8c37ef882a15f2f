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

from pam_actuation.drivers.watchdog import HEARS, RESTS, SignalWatchdog, VENTS, WAITING
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

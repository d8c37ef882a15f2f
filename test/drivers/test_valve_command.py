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

"""The raw valve signal passes the same supervision as a pressure command."""

from dataclasses import replace
import math

from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.messages import Pressure, ValveSignal
from pam_sim.units import P_ATM_PA
import pytest

MS = 1_000_000
START = 1_700_000_000 * 1000 * MS
HSV = ('fill_duty', 'vent_duty')
SAFE = (0.0, 1.0)


class Bench:
    """A driver with a pressure sensor and a sender of valve commands."""

    def __init__(self, valve='hsv', **changes):
        """Start with 300 kPa measured and nothing commanded."""
        self.loop = DriverLoop(valve, changes)
        self.now = START
        self.kpa, self.efforts = 300.0, None

    def run(self, ms):
        """Tick for some ms; return (efforts, status) of the last tick."""
        for k in range(ms // 10):
            self.now += 10 * MS
            if self.kpa is not None:
                pressure_pa = P_ATM_PA + 1e3 * self.kpa + k % 2
                self.loop.on_pressure(Pressure(self.now - MS, pressure_pa))
            if self.efforts is not None:
                names = HSV if self.loop.is_hsv else ('ppr_voltage',)
                self.loop.on_valve_command(ValveSignal(self.now - MS, names, self.efforts))
            signal, status = self.loop.tick(self.now)
        return signal.efforts, status


@pytest.mark.parametrize('wanted, sent', [
    ((0.2, 0.0), (0.2, 0.0)), ((0.0, 0.4), (0.0, 0.4)), ((0.0, 0.0), (0.0, 0.0)),
    ((0.0, 1.0), SAFE), ((0.6, 0.5), (pytest.approx(0.1), 0.0)), ((3.0, 0.0), (1.0, 0.0))])
def test_duties_are_sent_as_commanded_and_never_both(wanted, sent):
    bench = Bench()
    bench.efforts = wanted
    efforts, status = bench.run(100)
    assert efforts == sent
    assert status.level == 0 and status.message == 'following the valve command'


@pytest.mark.parametrize('valve, efforts', [
    ('hsv', (0.2, 0.0)), ('hsv', (3.0, 0.0)), ('ppr', (3.0,))])
def test_an_exact_duplicate_is_no_fault_and_an_older_command_is_told(valve, efforts):
    bench = Bench(valve)
    bench.efforts = efforts
    send = bench.loop.on_valve_command
    bench.loop.on_valve_command = lambda message: (send(message), send(message))
    _, status = bench.run(100)
    assert bench.loop.safety.commands_ignored == 0 and status.level == 0
    bench.loop.on_valve_command = lambda message: (
        send(message), send(replace(message, stamp_ns=message.stamp_ns - MS)))
    _, status = bench.run(10)
    assert bench.loop.safety.commands_ignored == 1
    assert valve == 'ppr' or 'a valve command was ignored: it is not newer' in status.message


def test_voltage_is_sent_as_commanded_within_the_limit():
    bench = Bench('ppr', max_pressure_gauge_pa=400e3)
    bench.efforts = (3.0,)
    assert bench.run(2000)[0] == (pytest.approx(3.0),)     # the slow rise of the start is over
    bench.efforts = (5.0,)
    efforts, status = bench.run(100)
    assert efforts == (pytest.approx(4.0),) and 'cut to the limit' in status.message


@pytest.mark.parametrize('lowest_v, zero_v, wanted_v, sent_v', [
    (1.0, 1.0, 3.0, 3.0), (0.12, 0.12, 0.0, 0.12), (0.0, 0.04, 0.0, 0.04), (0.0, -0.05, 2.0, 2.0)])
def test_voltage_is_sent_as_commanded_where_the_input_has_a_zero(
        lowest_v, zero_v, wanted_v, sent_v):
    """A voltage below the zero asks for no less than the atmosphere."""
    bench = Bench('ppr', **{'ppr.lowest_v': lowest_v, 'ppr.atmospheric_v': zero_v})
    bench.efforts, bench.kpa = (wanted_v,), 100.0 * (sent_v - zero_v)
    efforts, status = bench.run(2000)
    assert efforts == (pytest.approx(sent_v),)
    assert status.level == 0 and status.message == 'following the pressure command'


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
@pytest.mark.parametrize('wanted', [math.nan, math.inf, -math.inf])
def test_a_value_that_is_not_finite_is_ignored(valve, wanted):
    bench = Bench(valve)
    bench.efforts = (wanted,) if valve == 'ppr' else (wanted, 0.0)
    bench.run(50)
    assert bench.loop.safety.commands_ignored == 5


@pytest.mark.parametrize('valve, wanted, safe', [
    ('hsv', (0.0, 0.0), SAFE), ('ppr', (3.0,), (0.0,))])
def test_vents_when_the_sender_stops(valve, wanted, safe):
    bench = Bench(valve)
    bench.efforts = wanted
    assert bench.run(1000)[0] == pytest.approx(wanted)
    bench.efforts = None
    efforts, status = bench.run(150)
    assert efforts == safe and status.level == 2


@pytest.mark.parametrize('fault', ['sender', 'sensor', 'nan', 'watchdog', 'stopped'])
def test_an_interrupted_sequence_of_duties_latches(fault):
    bench = Bench()
    bench.efforts = (0.1, 0.0)
    bench.run(100)
    if fault == 'sender':
        bench.efforts = None
    elif fault == 'sensor':
        bench.kpa = None
    elif fault == 'watchdog':
        bench.loop.vented_elsewhere(bench.now)
    elif fault == 'stopped':
        bench.loop.stop()
    else:
        bench.efforts = (math.nan, 0.0)
    assert bench.run(200)[0] == SAFE
    bench.efforts, bench.kpa = (0.1, 0.0), 300.0
    efforts, status = bench.run(500)
    assert efforts == SAFE and 'not taken up again' in status.message
    assert bench.loop.reset()[0]
    assert bench.run(50)[0] == (0.1, 0.0)


def test_losing_a_sender_that_vents_anyway_does_not_latch():
    bench = Bench()
    bench.efforts = SAFE
    bench.run(100)
    bench.efforts = None
    assert bench.run(200)[0] == SAFE
    bench.efforts = (0.1, 0.0)
    assert bench.run(50)[0] == (0.1, 0.0)


def test_no_filling_at_the_limit_and_a_trip_above_it():
    bench = Bench()
    bench.efforts = (0.5, 0.0)
    bench.kpa = 605.0
    efforts, status = bench.run(50)
    assert efforts == (0.0, 0.0) and 'stays shut' in status.message
    bench.kpa = 650.0
    efforts, status = bench.run(50)
    assert efforts == SAFE and 'over-pressure' in status.message


def test_emergency_stop_overrules_a_valve_command():
    bench = Bench()
    bench.efforts = (0.2, 0.0)
    bench.run(100)
    bench.loop.emergency_stop('test')
    assert bench.run(50)[0] == SAFE
    assert 'emergency stop' in bench.run(500)[1].message


def test_pressure_and_valve_commands_may_take_turns_but_not_mix():
    bench = Bench()
    bench.efforts = (0.0, 0.0)
    assert bench.run(100)[0] == (0.0, 0.0)
    bench.efforts = None
    for _ in range(10):
        bench.loop.on_command(Pressure(bench.now + 9 * MS, P_ATM_PA + 300e3))
        status = bench.run(10)[1]
    assert status.message.startswith('resuming')
    bench.efforts = (0.0, 0.0)
    for _ in range(10):
        bench.loop.on_command(Pressure(bench.now + 10 * MS, P_ATM_PA + 300e3))
        efforts, status = bench.run(10)
    assert efforts == SAFE and 'two publishers' in status.message

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

"""The driver loop with the simulated rig: whole chain, venting, status, bad input."""

from collections import deque
import math
import random

import numpy as np
from pam_actuation.drivers.config import DRIVER_PARAMETERS, DriverConfig
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.hsv import HsvLaw
from pam_actuation.drivers.hsv_config import PARAMETERS
from pam_actuation.drivers.hsv_model import STATE
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.loops.bus import Bus
from pam_actuation.loops.wiring import attach_plant, driver_tick
from pam_actuation.messages import Pressure, ValveSignal
from pam_actuation.plant_loop import PlantLoop
import pam_sim
from pam_sim.errors import InputError
from pam_sim.units import P_ATM_PA
import pytest

MS = 1_000_000
START = 1_700_000_000_123_456_789
SAFE = {'ppr': (0.0,), 'hsv': (0.0, 1.0)}


class Chain:
    """Driver and simulated rig on one bus; command and sensor can be switched off."""

    def __init__(self, valve, **changes):
        """Start at rest with a 5 ms sensor and command raster."""
        rig = pam_sim.load_rig('dmsp_5_300_realistic', valve=valve)
        self.loop = DriverLoop(valve, driver_config(rig, changes))
        self.plant = PlantLoop(rig, 3)
        self.now = START
        self.plant.advance_to(self.now)
        self.command_kpa = 300.0
        self.sensor = True
        self.signals, self.statuses, self.pressures_kpa = [], [], []
        self._bus = bus = Bus(on_sent=self._heard)
        self._measure, self._act = attach_plant(bus, self.plant), driver_tick(
            bus, self.loop, done=lambda now_ns: self.statuses.append(self.loop.status()))
        for topic, take in self.loop.takes().items():
            bus.connect(topic, self._while_measured(take) if topic == 'pressure' else take)

    def _heard(self, topic, message, now_ns):
        if topic == 'valve_signal':
            self.signals.append(message)

    def _while_measured(self, take):
        return lambda message: take(message) if self.sensor else None

    def _sample(self, now_ns):
        self._measure(now_ns)
        self.pressures_kpa.append((self.plant.plant.pressure_pa - P_ATM_PA) * 1e-3)

    def _command(self, now_ns):
        if self.command_kpa is not None:
            self._bus.send('pressure_command', Pressure(
                now_ns, P_ATM_PA + 1e3 * self.command_kpa), now_ns)

    def run(self, ms):
        """Go on for some ms; return the last status."""
        times = range(self.now + 5 * MS, self.now + ms * MS + 1, 5 * MS)
        return self.at(times, times[::round(200 / self.loop.rate_hz)])

    def at(self, times, ticks):
        """Measure and command at some times, tick at others; return the last status."""
        for tick, when in ((self._sample, times), (self._command, times), (self._act, ticks)):
            self._bus.add(tick, when)
        self._bus.run_until()
        self.now = times[-1]
        return self.statuses[-1]


def test_the_signal_that_vents_a_regulator_is_no_voltage_whatever_its_range():
    loop = Chain('ppr', **{'ppr.lowest_v': 1.0}).loop
    assert loop.safe_signal(START).efforts == SAFE['ppr']


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_follows_and_vents_when_the_controller_dies(valve):
    """The pressure arrives; 0.3 s after the last command the safe signal is out."""
    chain = Chain(valve)
    status = chain.run(2000)
    assert status.level == 0 and status.message == 'following the pressure command'
    assert chain.pressures_kpa[-1] == pytest.approx(300.0, abs=3.0)
    chain.command_kpa = None
    died, count = chain.now, len(chain.signals)
    status = chain.run(300)
    safe = [s.stamp_ns for s in chain.signals[count:] if s.efforts == SAFE[valve]]
    assert safe and safe[0] - died <= 120 * MS
    assert status.level == 2 and 'no valid pressure command' in status.message
    messages = {s.message for s in chain.statuses[-20:]}
    assert len(messages) == 1
    chain.run(1500)
    assert chain.pressures_kpa[-1] < 15.0
    chain.command_kpa = 400.0
    chain.run(200)
    assert chain.pressures_kpa[-1] < 130.0           # 500 kPa/s at most
    assert chain.run(1500).level == 0
    assert chain.pressures_kpa[-1] == pytest.approx(400.0, abs=3.0)


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_sensor_lost(valve):
    """Without readings both valve types vent and say so."""
    chain = Chain(valve)
    chain.run(1000)
    chain.sensor = False
    status = chain.run(150)
    assert chain.signals[-1].efforts == SAFE[valve]
    assert 'no valid measured pressure' in status.message


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_emergency_stop_and_reset(valve):
    """Latched; after the reset the pressure climbs back without a jump."""
    chain = Chain(valve)
    chain.run(1000)
    assert chain.loop.emergency_stop('test')[0]
    status = chain.run(100)
    assert status.level == 2 and chain.signals[-1].efforts == SAFE[valve]
    chain.run(1000)
    assert chain.signals[-1].efforts == SAFE[valve]
    done, text = chain.loop.reset()
    assert done and 'emergency stop' in text
    chain.run(1500)
    assert chain.pressures_kpa[-1] == pytest.approx(300.0, abs=3.0)
    rise = [b - a for a, b in zip(chain.pressures_kpa[420:], chain.pressures_kpa[430:])]
    assert max(rise) < 0.05 * 500.0 + 12.0           # kPa in 50 ms


@pytest.mark.parametrize(('before', 'stuck', 'command'), [
    (300.0, 301.0, 550.0), (500.0, 501.0, 600.0), (520.0, 526.0, 600.0), (560.0, 561.0, 600.0),
    (590.0, 585.0, 600.0), (590.0, 591.0, 600.0)])
def test_frozen_sensor_with_hsv(before, stuck, command):
    """The reading sticks while the command rises: vents before the limit is passed."""
    chain = Chain('hsv')
    chain.command_kpa = before
    chain.run(1500)
    chain.command_kpa = command
    chain.sensor = False
    for _ in range(200):
        chain.loop.on_pressure(Pressure(chain.now + 5 * MS, P_ATM_PA + stuck * 1e3))
        chain.run(5)
    assert 'stands still' in chain.statuses[-1].message
    assert chain.signals[-1].efforts == (0.0, 1.0)
    assert max(chain.pressures_kpa) < 1.02 * 600.0


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_rest_is_still_signalled(valve):
    """At rest the signal goes on at the full rate with fresh stamps."""
    chain = Chain(valve)
    chain.run(2000)
    count = len(chain.signals)
    chain.run(1000)
    assert len(chain.signals) - count == round(chain.loop.rate_hz)
    stamps = [s.stamp_ns for s in chain.signals]
    assert all(b > a for a, b in zip(stamps, stamps[1:]))
    if valve == 'hsv':
        quiet = [s.efforts == (0.0, 0.0) for s in chain.signals[-50:]]
        assert sum(quiet) >= 45
    values = dict(chain.statuses[-1].values)
    assert float(values['rate_hz']) == pytest.approx(chain.loop.rate_hz, rel=0.02)
    assert values['state'] == 'ok' and float(values['command_age_ms']) < 6.0


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
@pytest.mark.parametrize('limits, told', [
    ({}, '600000'), ({'max_pressure_gauge_pa': 123e3}, '123000')])
def test_the_status_has_the_limit_in_force(valve, limits, told):
    """An operator can check it without the parameters of the node."""
    assert dict(Chain(valve, **limits).run(100).values)['max_pressure_gauge_pa'] == told


def test_never_both_valves_open_for_long():
    """Whatever the command does, fill and vent open together for short pulses only."""
    chain = Chain('hsv')
    for kpa in (300.0, 50.0, 600.0, 0.0, 900.0, 290.0, 310.0, math.nan, 200.0):
        chain.command_kpa = kpa
        chain.run(150)
    assert all(min(s.efforts) == 0.0 or max(s.efforts) <= 0.5 for s in chain.signals)
    assert all(0.0 <= effort <= 1.0 for s in chain.signals for effort in s.efforts)


def test_missed_ticks_keep_the_model_right():
    """
    After a gap of 8 periods with the fill valve open the law still knows the air inside.

    Else it takes the muscle for emptier than it is, fills too much and vents 54 kPa again.
    """
    chain = Chain('hsv')
    chain.run(1000)
    before = len(chain.pressures_kpa)
    chain.command_kpa = 500.0
    for _ in range(8):
        chain.run(20)
        chain.now += 70 * MS       # the plant goes on with the last signal
    chain.run(1500)
    rising = np.array(chain.pressures_kpa[before:])
    assert max(np.maximum.accumulate(rising) - rising) < 30.0
    assert chain.statuses[-1].level == 0
    assert chain.pressures_kpa[-1] == pytest.approx(500.0, abs=4.0)
    assert int(dict(chain.statuses[-1].values)['late_ticks']) >= 3


def test_a_driver_that_was_stopped_knows_that_the_valves_vented_meanwhile():
    loop = DriverLoop('hsv')

    def tick(now):
        loop.on_pressure(Pressure(now, 2e5 + now % 7))
        loop.on_command(Pressure(now, 4e5))
        return loop.act(now).efforts

    filling, _ = [tick(START + k * 20 * MS) for k in range(12)][-1]
    assert filling > 0.0
    loop.stop()
    assert tick(START + 420 * MS) == SAFE['hsv']        # nine periods were missed
    assert loop.safety.frozen.expected_pa < 0.0


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_a_signal_that_is_not_a_number_is_never_sent(valve):
    """It vents, latched, and begins with a new law after the reset."""
    chain = Chain(valve)
    chain.run(1000)
    if valve == 'ppr':
        chain.loop.law.step = lambda *inputs: math.nan
    else:
        chain.loop.law.par.view(PARAMETERS)['gain'] = math.nan
        chain.command_kpa = 310.0
    status = chain.run(100)
    assert all(math.isfinite(effort) for signal in chain.signals for effort in signal.efforts)
    assert chain.signals[-1].efforts == SAFE[valve]
    assert status.level == 2 and dict(status.values)['fault'] == 'signal_not_finite'
    assert 'calculated a signal that is not a number' in status.message
    assert chain.loop.reset()[0]
    chain.command_kpa = 300.0
    assert chain.run(1500).level == 0
    assert chain.pressures_kpa[-1] == pytest.approx(300.0, abs=3.0)


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_a_device_that_refuses_is_told_with_the_signal_that_it_refused(valve):
    """Not with the next one: its status said that the command is followed."""
    chain = Chain(valve)
    assert chain.run(2000).level == 0
    chain.loop.on_device('no such device')
    status = chain.loop.status()
    values = dict(status.values)
    assert status.level == 2 and values['fault'] == 'device_refuses' and values['vents'] == '1'
    assert status.message.startswith('the valve did not take its signal: no such device')
    assert chain.loop.followed().pressure_pa == P_ATM_PA
    assert dict(chain.run(100).values)['vents'] == '1'


def test_a_law_whose_model_runs_away_begins_anew():
    """As on a rig unlike the model: shut for one period, then the pressure is held again."""
    chain = Chain('hsv')
    chain.run(1500)
    chain.loop.law.state.view(STATE)['model_pa'] = math.nan
    chain.run(10)
    assert chain.signals[-1].efforts == (0.0, 0.0)
    status = chain.run(500)
    assert status.level == 1 and 'the model of the air ran away' in status.message
    assert chain.run(600).level == 0
    assert chain.pressures_kpa[-1] == pytest.approx(300.0, abs=3.0)


def test_a_law_whose_model_runs_away_again_vents_and_latches():
    chain = Chain('hsv')
    chain.run(1500)
    for _ in range(2):
        chain.run(500)
        chain.loop.law.state.view(STATE)['model_pa'] = math.nan
        status = chain.run(10)
    assert chain.signals[-1].efforts == SAFE['hsv']
    assert status.level == 2 and dict(status.values)['fault'] == 'signal_not_finite'
    assert 'call the service reset' in chain.run(1000).message and chain.pressures_kpa[-1] < 15.0


def test_readings_much_too_late_on_another_rig_vent_and_latch():
    """The model runs away there again and again; the muscle swung between empty and full."""
    chain = Chain('hsv', **{'hsv.swing_hz': 20.0, 'hsv.swing_lowest_hz': 15.0})
    take, under_way = chain.loop.safety.on_pressure, deque()

    def late(stamp_ns, pressure_pa):
        under_way.append((stamp_ns, pressure_pa))
        if len(under_way) > 16:     # of 5 ms
            take(*under_way.popleft())

    chain.loop.safety.on_pressure = late
    status = chain.run(10_000)
    assert dict(status.values)['fault'] == 'signal_not_finite'
    assert chain.signals[-1].efforts == SAFE['hsv'] and chain.pressures_kpa[-1] < 15.0


def test_the_model_of_the_air_does_not_stop_commanded_duties():
    """They do not come from it, and a rig that is yet to be identified may be unlike it."""
    chain = Chain('hsv')
    chain.run(500)
    chain.command_kpa = None
    chain.run(10)
    for _ in range(3):
        chain.loop.law.state.view(STATE)['model_pa'] = math.nan
        chain.loop.on_valve_command(ValveSignal(
            chain.now + MS, ('fill_duty', 'vent_duty'), (0.0, 0.2)))
        status = chain.run(20)
        assert chain.signals[-1].efforts == (0.0, 0.2) and status.level == 0


def test_safe_signal():
    """PPR 0 V; HSV fill 0, vent 1."""
    for valve, efforts in SAFE.items():
        signal = DriverLoop(valve).safe_signal(5)
        assert signal.efforts == efforts and signal.stamp_ns == 5
        assert signal.names == (('ppr_voltage',) if valve == 'ppr'
                                else ('fill_duty', 'vent_duty'))


@pytest.mark.parametrize('valve, config, words', [
    ('xyz', None, "unknown valve type 'xyz', choose ppr or hsv"),
    ('hsv', {'hsv.dead_tme_s': 0.03}, 'did you mean `hsv.dead_time_s`'),
    ('hsv', {'hsv.gain': 3.0}, '`hsv.gain` is 3; allowed 0.05 to 1'),
    ('hsv', {'hsv.period_s': 0.002},
     '`hsv.period_s` is 0.002 s, in which valves .* allowed are above 0.0038 to 0.01 s'),
    ('ppr', {'max_pressure_gauge_pa': 'high'},
     'must be a number, not .high.; allowed 1000 to 1e.06 Pa gauge'),
    ('ppr', {'max_pressure_gauge_pa': math.nan}, 'is nan; allowed 1000 to'),
    ('ppr', {'ppr.lowest_v': 5.0, 'ppr.highest_v': 4.0}, 'is not below')])
def test_bad_configuration(valve, config, words):
    """One sentence with place, value and allowed range."""
    with pytest.raises(InputError, match=words):
        DriverLoop(valve, config)


def test_parameters_round_trip():
    """The parameter table, the configuration and the flat dict agree."""
    names = [parameter.name for parameter in DRIVER_PARAMETERS]
    assert len(set(names)) == len(names)
    assert all(p.lower <= p.default <= p.upper and p.description for p in DRIVER_PARAMETERS)
    config = DriverConfig.from_parameters({'hsv.gain': 0.5, 'max_pressure_gauge_pa': 5e5})
    assert DriverConfig.from_parameters(config.as_parameters()) == config
    assert config.hsv.gain == 0.5 and config.safety.max_pressure_gauge_pa == 5e5


def scatter_kpa_with_ticks_up_to_3_ms_late():
    """Return how far the pressure scatters about a sine of 300 kPa +- 100 kPa it follows."""
    chain, draw = Chain('hsv'), random.Random(1)
    chain.run(1000)
    begin, rows = chain.now, []
    for k in range(1, 1000):
        tick = begin + k * 10 * MS + draw.randint(-3, 3) * MS
        turn = math.pi * (tick - begin) * 1e-9
        chain.command_kpa = 300.0 + 100.0 * math.sin(turn)
        chain.at([tick], [tick])
        waves = [f(n * turn) for n in (1, 2, 3, 4) for f in (math.sin, math.cos)]
        rows.append([chain.pressures_kpa[-1], 1.0, *waves])
    rows = np.array(rows[400:])
    smooth = np.linalg.lstsq(rows[:, 1:], rows[:, 0], rcond=None)[0]
    return np.std(rows[:, 0] - rows[:, 1:] @ smooth)


def test_late_ticks_are_counted_by_their_length(monkeypatch):
    """A duty held for 13 ms is more air than one held for 7 ms, and the law knows."""
    known = scatter_kpa_with_ticks_up_to_3_ms_late()
    monkeypatch.setattr(HsvLaw, 'lasted', lambda self, periods: None)
    unknown = scatter_kpa_with_ticks_up_to_3_ms_late()
    assert known < 0.9 * unknown

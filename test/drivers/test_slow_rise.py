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

"""The slow rise after a vent: no order of commands, vents and late ticks leads round it."""

import itertools
import random

import numpy as np
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.drivers.safety import SafetyLimits
from pam_actuation.loops.bus import Bus, every
from pam_actuation.loops.wiring import attach, attach_plant
from pam_actuation.messages import Pressure, START_NS
from pam_actuation.plant_loop import PlantLoop
from pam_actuation.slow_rise import (
    NEARLY_PA, RISE_PA_PER_S, SlowRise, UNDER_PRESSURE_PA, UNTIL_FOLLOWED_S, WAITS_LONG_S)
from pam_sim import load_rig
from pam_sim.units import P_ATM_PA
import pytest
from test_safety import Bench

FULL_PA = P_ATM_PA + 600e3
PERIOD_S = 0.005
MS_NS = 1_000_000


def rises(targets):
    """Return the largest rise [Pa/s] of followed pressures, None being a vent."""
    known = [P_ATM_PA if target is None else target for target in targets]
    return max(b - a for a, b in itertools.pairwise(known)) / PERIOD_S


def test_a_first_command_of_atmosphere_does_not_end_it():
    """The way round it: one command of atmospheric pressure, then all at once."""
    bench = Bench(SafetyLimits())
    for k in range(3):
        bench.command = P_ATM_PA
        bench.run(100 if k else 3000)
        bench.command = FULL_PA
        targets = [decision.pressure_pa for decision in bench.run(300)]
        assert rises(targets) <= RISE_PA_PER_S * 1.001
        bench.command = None            # lost: vented
        bench.run(300)


def test_it_begins_at_atmosphere_while_the_muscle_still_empties():
    bench = Bench(SafetyLimits())
    bench.run(3000)
    bench.command = None
    bench.run(150)
    bench.pressure = P_ATM_PA + 250e3
    bench.command = P_ATM_PA + 300e3
    assert bench.run(10)[-1].pressure_pa <= P_ATM_PA + 0.01 * RISE_PA_PER_S


@pytest.mark.parametrize('seed', range(20))
def test_no_order_of_commands_rises_faster_until_one_was_followed_under_pressure(seed):
    rng = random.Random(seed)
    bench = Bench(SafetyLimits())
    bench.run(rng.choice((0, 2500)))
    bench.command = None
    bench.run(200)
    targets, followed_s = [P_ATM_PA], 0.0
    while followed_s < 0.8:
        bench.command = rng.choice((
            P_ATM_PA, P_ATM_PA, FULL_PA, P_ATM_PA + rng.uniform(0.0, 600e3), P_ATM_PA - 5e3))
        for decision in bench.run(5 * rng.randint(1, 60)):
            targets.append(decision.pressure_pa)
            if bench.command == decision.pressure_pa > UNDER_PRESSURE_PA:
                followed_s += PERIOD_S
    assert rises(targets) <= RISE_PA_PER_S * 1.001


def test_it_ends_once_a_command_was_followed_for_a_second_and_begins_with_every_vent():
    bench = Bench(SafetyLimits())
    bench.command = P_ATM_PA + 100e3
    bench.run(150)
    assert 'no more than 500 kPa/s' in bench.last(10).message
    bench.run(1200)
    bench.command = FULL_PA
    assert bench.last(5).pressure_pa == FULL_PA
    bench.safety.emergency_stop('a test')
    bench.run(10)
    bench.safety.reset()
    assert bench.last(10).pressure_pa <= P_ATM_PA + 0.01 * RISE_PA_PER_S


def test_a_late_tick_does_not_make_up_for_the_time_it_missed():
    rise = SlowRise()
    rise.limited(FULL_PA, 0.005)
    before_pa = rise.limited(FULL_PA, 0.005)
    assert rise.limited(FULL_PA, 0.25) - before_pa <= 0.02 * RISE_PA_PER_S + 1e-6


def test_openings_of_the_valves_leave_it_as_it_is():
    rise = SlowRise()
    rise.limited(P_ATM_PA + 3e5, 0.02)
    rise.hold()
    assert rise.limited(FULL_PA, 0.01) == P_ATM_PA + 0.01 * RISE_PA_PER_S
    assert SafetyLimits().resume_rate_pa_per_s == RISE_PA_PER_S


def test_a_vent_of_the_watchdog_is_a_vent():
    """A driver that fell silent for a moment only does not take the pressure up at once."""
    bench = Bench(SafetyLimits())
    bench.run(3000)
    bench.safety.vented_elsewhere(bench.now)
    decisions = bench.run(200)
    assert decisions[0].pressure_pa <= P_ATM_PA + 0.01 * RISE_PA_PER_S
    assert rises([decision.pressure_pa for decision in decisions]) <= RISE_PA_PER_S * 1.001
    assert 'the watchdog vented' in decisions[-1].message


def largest_rise(valve, rig_name, blocked, duration_s=2.5):
    """
    Return the largest rise [Pa/s] over 0.2 s and the last pressure [Pa gauge].

    The driver is commanded 300 kPa from 0.3 s on. While ``blocked(time_s)`` somebody else
    vents the muscle, of whom the driver does not know.
    """
    rig = load_rig(rig_name, valve=valve)
    plant, driver, gauge_pa = PlantLoop(rig, seed=1), DriverLoop(valve, driver_config(rig)), []

    def heard(topic, message, now_ns):
        if topic == 'pressure':
            gauge_pa.append(message.pressure_pa - P_ATM_PA)

    def command(now_ns):
        bus.send('pressure_command', Pressure(now_ns, P_ATM_PA + 300e3), now_ns)

    def act(now_ns):
        signal = driver.act(now_ns)
        if blocked((now_ns - START_NS) // MS_NS * 1e-3):
            signal = driver.safe_signal(now_ns)
        bus.send('valve_signal', signal, now_ns)

    bus = Bus(on_sent=heard)
    attach(bus, driver)
    bus.add(attach_plant(bus, plant), every(250.0))
    bus.add(command, every(200.0, START_NS + 300 * MS_NS))
    bus.add(act, every(driver.rate_hz))
    bus.run_until(START_NS + round(duration_s * 1e9) - 1)
    smooth = np.convolve(gauge_pa, np.full(5, 0.2), 'valid')
    return (smooth[50:] - smooth[:-50]).max() / 0.2, gauge_pa[-1]


@pytest.mark.parametrize('rig_name', ['dmsp_5_300_realistic', 'dmsp_20_300_hanging_mass'])
@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
@pytest.mark.parametrize('from_s, to_s, every', [
    (0.3, 0.45, 1), (0.3, 0.7, 2), (0.6, 0.8, 1), (0.6, 1.0, 2)])
def test_nothing_rushes_in_when_somebody_else_has_stopped_venting(
        valve, rig_name, from_s, to_s, every):
    """A watchdog that takes the driver for dead vents each time, or in turn with the driver."""
    def blocked(time_s):
        return from_s <= time_s < to_s and round(time_s * 100.0) % every == 0

    rise_pa_per_s, last_gauge_pa = largest_rise(valve, rig_name, blocked)
    assert rise_pa_per_s <= 1.05 * RISE_PA_PER_S
    assert last_gauge_pa == pytest.approx(300e3, abs=4e3)


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_a_muscle_that_nobody_vents_is_not_waited_for(valve):
    rise_pa_per_s, _ = largest_rise(valve, 'dmsp_5_300_realistic', lambda time_s: False)
    assert 0.95 * RISE_PA_PER_S < rise_pa_per_s <= 1.02 * RISE_PA_PER_S


@pytest.mark.parametrize('gain, offset_pa', [(0.7, 0.0), (1.0, -60e3), (1.3, 20e3)])
def test_a_regulator_with_another_gain_or_an_offset_comes_up_all_the_same(gain, offset_pa):
    rise = SlowRise(lag_s=0.07, dead_time_s=0.03)
    measured_pa, allowed_pa, steps = P_ATM_PA, P_ATM_PA, 0
    while allowed_pa < P_ATM_PA + 400e3 and steps < 6000:
        allowed_pa = rise.limited(P_ATM_PA + 400e3, 0.005, measured_pa)
        given_pa = max(P_ATM_PA + gain * (allowed_pa - P_ATM_PA) + offset_pa, P_ATM_PA)
        measured_pa += 0.005 / 0.065 * (given_pa - measured_pa)
        steps += 1
    assert steps * 0.005 < 20.0
    assert (rise.waited_s > WAITS_LONG_S) == (gain < 1.0 or offset_pa < 0.0)


def test_a_long_wait_for_the_muscle_is_told():
    bench = Bench(SafetyLimits())
    bench.safety._rise = SlowRise(lag_s=0.05)
    bench.pressure = P_ATM_PA
    bench.command = P_ATM_PA + 300e3
    assert 'waits' not in bench.last(300).message
    assert ('waits for the measured pressure, which stays behind (sensor, air supply or gain, '
            'another node that vents?)') in bench.last(2000).message


def test_the_sensor_is_the_first_to_be_named_where_the_measured_pressure_does_not_rise():
    bench = Bench(needs_pressure=False)
    bench.run(100)
    bench.pressure = P_ATM_PA
    decision = bench.last(1000)
    assert decision.warnings == ('air_missing',)
    assert ('the measured pressure does not rise: sensor, air supply or gain? 0 kPa gauge '
            'measured at a command of 300 kPa; with a faulty sensor the muscle is under pressure'
            ) in decision.message


def test_a_command_with_noise_is_met_although_every_rise_of_it_is_limited():
    rise, strict = SlowRise(), SlowRise(nearly_pa=0.0)
    noise = np.random.default_rng(1).uniform(-0.4, 0.4, 2000) * NEARLY_PA
    ends_s = []
    for one in (rise, strict):
        limits, ticks = [P_ATM_PA], 0
        while one.active:
            limits.append(one.limited(P_ATM_PA + 3e5 + noise[ticks], PERIOD_S))
            ticks += 1
        assert rises(limits[:-1]) <= RISE_PA_PER_S * 1.001
        ends_s.append(ticks * PERIOD_S - 3e5 / RISE_PA_PER_S)
    assert ends_s[0] == pytest.approx(UNTIL_FOLLOWED_S, abs=0.05)
    assert ends_s[1] > 1.25 * UNTIL_FOLLOWED_S

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

"""The safety supervisor: each row of the fault table the driver can notice."""

import ast
import math
from pathlib import Path

from pam_actuation.drivers import safety
from pam_actuation.drivers.decision import EMERGENCY_STOP, OK, VENTED, WAITING
from pam_actuation.drivers.faults import FAULT_TABLE, fault_table_markdown, FAULTS
from pam_actuation.drivers.safety import SafetyLimits, SafetySupervisor
from pam_sim.units import P_ATM_PA
import pytest

MS = 1_000_000
START = 1_700_000_000 * 1000 * MS
FAST = SafetyLimits(resume_rate_pa_per_s=1e12)


class Bench:
    """A supervisor with a clock, a sensor and a controller that can be switched off."""

    def __init__(self, limits=FAST, needs_pressure=True):
        """Start with both inputs running and the pressure equal to the command."""
        self.safety = SafetySupervisor(limits, needs_pressure)
        self.now = START
        self.command, self.pressure, self.supply = P_ATM_PA + 300e3, P_ATM_PA + 300e3, None
        self.wiggle = 0.0

    def run(self, ms, period_ms=5):
        """Tick for some ms; return the decisions."""
        decisions = []
        for _ in range(ms // period_ms):
            self.now += period_ms * MS
            self.wiggle = 1.0 - self.wiggle
            if self.pressure is not None:
                self.safety.on_pressure(self.now - MS, self.pressure + self.wiggle)
            if self.supply is not None:
                self.safety.on_supply(self.now - MS, self.supply)
            if self.command is not None:
                self.safety.on_command(self.now - MS, self.command)
            decisions.append(self.safety.tick(self.now))
        return decisions

    def last(self, ms):
        """Tick for some ms; return the last decision."""
        return self.run(ms)[-1]


def test_waits_then_follows():
    """Without a command it waits and vents; with one it follows."""
    bench = Bench()
    bench.command = None
    decision = bench.last(500)
    assert decision.state == WAITING and decision.pressure_pa is None
    assert 'first pressure command' in decision.message
    bench.command = P_ATM_PA + 250e3
    decision = bench.last(50)
    assert decision.state == OK and decision.pressure_pa == P_ATM_PA + 250e3
    assert decision.level == 0


def test_command_timeout_is_self_resuming():
    """Vents 0.1 s after the last command, says so with figures, resumes by itself."""
    bench = Bench()
    bench.run(100)
    bench.command = None
    states = [decision.state for decision in bench.run(200)]
    assert states[:19] == [OK] * 19 and states[20] == VENTED
    decision = bench.last(1000)
    assert decision.fault == 'command_timeout' and 'limit 100 ms' in decision.message
    assert decision.message == bench.last(500).message      # does not flicker
    bench.command = P_ATM_PA + 300e3
    assert bench.last(20).state == OK
    assert bench.safety.vents == 1


@pytest.mark.parametrize('bad', [math.nan, math.inf, -math.inf])
def test_command_not_finite(bad):
    """Ignored at once, vented when nothing else comes."""
    bench = Bench()
    bench.run(100)
    bench.command = bad
    decision = bench.last(50)
    assert decision.state == OK and decision.level == 1 and 'not a number' in decision.message
    decision = bench.last(200)
    assert decision.state == VENTED and 'not a number' in decision.message


def test_command_clamped():
    """Above the limit: cut, counted, a warning that ends."""
    bench = Bench()
    bench.command = P_ATM_PA + 750e3
    decision = bench.last(50)
    assert decision.pressure_pa == P_ATM_PA + 600e3 and decision.level == 1
    assert '750 kPa gauge cut to the limit of 600 kPa' in decision.message
    bench.command = 50e3
    decision = bench.last(50)
    assert decision.pressure_pa == P_ATM_PA and 'below the atmosphere' in decision.message
    assert bench.safety.commands_clamped == 20
    bench.command = P_ATM_PA + 100e3
    assert bench.last(1200).message == 'following the pressure command'


def test_command_stamps():
    """Too old, without stamp, too far ahead: ignored; slightly ahead is fine."""
    for offset_ms, good in ((15, True), (25, False), (-95, True), (-105, False)):
        bench = Bench()
        bench.command = None
        bench.run(100)
        bench.safety.on_command(bench.now + 5 * MS + offset_ms * MS, P_ATM_PA + 2e5)
        assert (bench.last(5).state == OK) is good, offset_ms
    bench = Bench()
    bench.command = None
    bench.run(20)
    bench.safety.on_command(0, P_ATM_PA + 2e5)
    assert 'without a time stamp' in bench.last(5).message


@pytest.mark.parametrize('bad, word', [
    (None, 'no valid measured pressure'), (math.nan, 'not a number'),
    (P_ATM_PA - 25e3, 'reads -25 kPa gauge'), (1.6e6, 'believable')])
def test_pressure_lost(bad, word):
    """Missing, NaN and unbelievable readings vent after 0.1 s and resume."""
    bench = Bench()
    bench.run(100)
    bench.pressure = bad
    assert bench.last(90).state == OK
    decision = bench.last(50)
    assert decision.state == VENTED and decision.fault == 'pressure_timeout'
    assert word in decision.message
    bench.pressure = P_ATM_PA + 100e3
    assert bench.last(20).state == OK


def test_ppr_may_run_without_a_sensor_but_not_lose_it():
    """Never measured: vented at first, then a warning. Measured and lost: vent."""
    bench = Bench(needs_pressure=False)
    bench.pressure = None
    decision = bench.last(1900)
    assert decision.state == WAITING and decision.fault == 'no_pressure'
    decision = bench.last(200)
    assert decision.state == OK and 'not supervised' in decision.message
    bench.pressure = P_ATM_PA + 300e3
    bench.run(100)
    bench.pressure = None
    assert bench.last(150).fault == 'pressure_timeout'


def test_over_pressure_is_latched():
    """650 kPa gauge trips at once; reset only below the limit."""
    bench = Bench()
    bench.run(100)
    bench.pressure = P_ATM_PA + 638e3
    assert bench.last(50).state == OK
    bench.pressure = P_ATM_PA + 650e3
    decision = bench.run(5)[0]
    assert decision.state == EMERGENCY_STOP and decision.pressure_pa is None
    assert '650 kPa gauge measured, trip at 640 kPa' in decision.message
    done, text = bench.safety.reset()
    assert not done and '650 kPa' in text
    bench.pressure = P_ATM_PA + 100e3
    assert bench.last(500).state == EMERGENCY_STOP
    assert bench.safety.reset()[0]
    assert bench.last(10).state == OK


def test_emergency_stop():
    """Latched through any command until reset; then a new command is needed."""
    bench = Bench()
    bench.run(100)
    bench.safety.emergency_stop('button of the operator')
    decision = bench.last(500)
    assert decision.state == EMERGENCY_STOP and 'button of the operator' in decision.message
    bench.command = None
    done, text = bench.safety.reset()
    assert done and 'button of the operator' in text
    assert bench.safety.reset() == (True, 'Nothing was latched.')
    assert bench.last(20).state == WAITING


def test_two_publishers_by_stamp_and_by_sequence():
    """Two interleaved publishers vent, until one has gone for 1 s."""
    for by_sequence in (False, True):
        bench = Bench()
        bench.run(100)
        bench.command = None
        for k in range(30):
            bench.now += 5 * MS
            bench.safety.on_pressure(bench.now, P_ATM_PA + k)
            other = bench.now if by_sequence else bench.now - 3 * MS
            bench.safety.on_command(bench.now - MS, P_ATM_PA + 2e5, 5000 + k)
            bench.safety.on_command(other, P_ATM_PA + 4e5, k if by_sequence else None)
            decision = bench.safety.tick(bench.now)
        assert decision.fault == 'two_publishers' and decision.pressure_pa is None
        bench.command = P_ATM_PA + 2e5
        assert bench.last(900).state == VENTED
        assert bench.last(300).state == OK


@pytest.mark.parametrize('equal', [False, True])
def test_stamps_of_a_single_publisher_that_do_not_rise_are_told_as_its_clock(equal):
    bench = Bench()
    bench.run(100)
    bench.safety.commander = lambda now_ns: '/muscle/own'
    bench.command = None
    for k in range(30):
        bench.now += 5 * MS
        bench.safety.on_pressure(bench.now, P_ATM_PA + k)
        stamp_ns = bench.now - (0 if equal else k % 2 * 30 * MS)
        bench.safety.on_command(stamp_ns, P_ATM_PA + 2e5, 2 * k)
        if equal:
            bench.safety.on_command(stamp_ns, P_ATM_PA + 3e5, 2 * k + 1)
        decision = bench.safety.tick(bench.now)
    assert decision.state == VENTED and decision.fault == 'command_clock'
    assert decision.message == ('vented because the commands of /muscle/own, their only '
                                'publisher, have stamps that do not rise, look at its clock')
    bench.safety.commander = lambda now_ns: ''      # another one was heard as well
    assert bench.last(10).fault == 'two_publishers'
    bench.command = P_ATM_PA + 2e5
    assert bench.last(880).state == VENTED
    assert bench.last(300).state == OK


@pytest.mark.parametrize('sequence', [0, 2 ** 64 - 1, None])
def test_middleware_without_sequence_numbers(sequence):
    """A constant number means unknown, not two publishers."""
    bench = Bench()
    bench.command = None
    for k in range(50):
        bench.now += 5 * MS
        bench.safety.on_pressure(bench.now, P_ATM_PA + k)
        bench.safety.on_command(bench.now - MS, P_ATM_PA + 2e5, sequence)
        decision = bench.safety.tick(bench.now)
    assert decision.state == OK and decision.level == 0


def test_one_message_out_of_order_is_ignored():
    """A single late message or a restarted publisher is no fault."""
    bench = Bench()
    bench.run(100)
    bench.safety.on_command(bench.now - 20 * MS, P_ATM_PA + 500e3)
    decision = bench.last(5)
    assert decision.state == OK and decision.pressure_pa == P_ATM_PA + 300e3
    assert 'not newer' in decision.message
    bench.safety.publishers = 2
    assert '2 publishers' in bench.last(50).message


def test_frozen_reading():
    """Bit-identical although 100 kPa should have come: HSV vents, PPR warns."""
    for needs_pressure in (True, False):
        bench = Bench(needs_pressure=needs_pressure)
        bench.run(100)
        faults = []
        for _ in range(100):
            bench.now += 5 * MS
            bench.safety.on_pressure(bench.now, P_ATM_PA + 200e3)
            bench.safety.on_command(bench.now, P_ATM_PA + 300e3)
            bench.safety.flow(5e3)
            decision = bench.safety.tick(bench.now)
            faults.append(decision.fault)
        assert 'stands still at 200.0 kPa' in decision.message
        if needs_pressure:
            assert decision.fault == 'pressure_frozen'
            assert 35 <= faults.index('pressure_frozen') <= 45      # after 0.2 s
            assert bench.last(20).state == OK
        else:
            assert decision.state == OK and decision.level == 1


def test_a_frozen_reading_is_noticed_although_the_model_ran_away():
    bench = Bench(needs_pressure=True)
    bench.run(100)
    for k in range(100):
        bench.now += 5 * MS
        bench.safety.on_pressure(bench.now, P_ATM_PA + 200e3)
        bench.safety.on_command(bench.now, P_ATM_PA + 300e3)
        bench.safety.flow(math.nan if k == 5 else 5e3)
        decision = bench.safety.tick(bench.now)
    assert decision.fault == 'pressure_frozen'


def test_still_reading_without_flow_is_not_frozen():
    """A quiet noise-free sensor at rest is healthy."""
    bench = Bench()
    for _ in range(400):
        bench.now += 5 * MS
        bench.safety.on_pressure(bench.now, P_ATM_PA + 200e3)
        bench.safety.on_command(bench.now, P_ATM_PA + 200e3)
        decision = bench.safety.tick(bench.now)
    assert decision.state == OK and decision.level == 0


def test_reading_that_rests_above_the_atmosphere_while_vented_is_not_frozen():
    """A quiet sensor with an offset: the air that a vent should still move ends there."""
    bench = Bench()
    for k in range(1000):
        bench.now += 5 * MS
        bench.safety.on_pressure(bench.now, P_ATM_PA + 5e3)
        bench.safety.flow(-2e3)         # what the model of the open valve goes on saying
        decision = bench.safety.tick(bench.now)
        assert decision.fault == 'no_command'
    bench.safety.on_command(bench.now, P_ATM_PA + 5e3)
    assert bench.safety.tick(bench.now + MS).state == OK


def test_reading_frozen_under_pressure_is_noticed_while_emptying():
    """From 200 kPa gauge an open valve takes more than 100 kPa away."""
    bench = Bench()
    bench.run(100)
    for _ in range(100):
        bench.now += 5 * MS
        bench.safety.on_pressure(bench.now, P_ATM_PA + 200e3)
        bench.safety.on_command(bench.now, P_ATM_PA)
        bench.safety.flow(-3e3)
        decision = bench.safety.tick(bench.now)
    assert decision.fault == 'pressure_frozen'


def test_supply_loss_warns():
    """Supply below the command: warning with figures; NaN supply: nominal assumed."""
    bench = Bench()
    bench.supply = P_ATM_PA + 700e3
    assert bench.last(100).level == 0
    bench.supply = P_ATM_PA + 250e3
    assert 'supply of 250 kPa gauge is too low for the command of 300 kPa' in (
        bench.last(100).message)
    assert bench.safety.supply_pa(bench.now) == P_ATM_PA + 250e3
    bench.supply = math.nan
    assert 'nominal one is assumed' in bench.last(700).message
    assert math.isnan(bench.safety.supply_pa(bench.now))


def test_resumes_without_a_jump():
    """After a vent the target climbs from atmospheric pressure at the set rate."""
    bench = Bench(SafetyLimits(resume_rate_pa_per_s=400e3))
    bench.run(2000)
    bench.command = None
    bench.run(200)
    bench.pressure = P_ATM_PA + 50e3
    bench.run(50)
    bench.command = P_ATM_PA + 450e3
    targets = [d.pressure_pa for d in bench.run(1200) if d.pressure_pa is not None]
    assert targets[0] <= P_ATM_PA + 53e3
    rises = [b - a for a, b in zip(targets, targets[1:])]
    assert max(rises) <= 400e3 * 0.005 + 1e-6 and min(rises) >= 0.0
    assert targets[-1] == bench.command
    bench.command = P_ATM_PA + 100e3       # once resumed, the command acts at once
    assert bench.last(5).pressure_pa == bench.command


def test_what_is_latched_is_taken_over():
    """A driver that is configured anew stays stopped until reset."""
    bench, anew = Bench(), Bench()
    bench.run(100)
    bench.safety.emergency_stop('a test')
    anew.safety.take_over(bench.safety)
    decision = anew.last(500)
    assert decision.state == EMERGENCY_STOP and 'a test' in decision.message
    assert anew.safety.reset()[0]
    assert anew.last(50).state == OK


def test_pause_and_clock_set_back():
    """A stopped driver and a clock set back wait for new messages; a late tick does not."""
    for jump_ms, fault in ((2000, 'driver_paused'), (-5000, 'clock_back')):
        bench = Bench()
        bench.run(100)
        bench.now += jump_ms * MS
        bench.safety.on_command(bench.now - MS, P_ATM_PA + 3e5)
        decision = bench.safety.tick(bench.now)
        assert decision.fault == fault and decision.pressure_pa is None
        assert bench.last(20).state == OK
    bench = Bench()
    bench.run(100)
    bench.now += 150 * MS
    assert bench.safety.tick(bench.now).state == OK
    assert bench.last(50).state == OK
    bench.command = None
    assert bench.last(150).state == VENTED


def test_a_clock_set_ahead_is_no_stopped_driver():
    """A clock that nobody sets tells them apart."""
    for stood_ms, fault in ((5, 'clock_ahead'), (2000, 'driver_paused')):
        bench = Bench()
        bench.run(100)
        bench.safety.clock.steady(7 * MS)
        bench.last(5)
        bench.safety.clock.steady((7 + stood_ms) * MS)
        bench.now += 2000 * MS
        decision = bench.safety.tick(bench.now)
        assert decision.fault == fault and decision.pressure_pa is None
    assert 'stopped for 2000 ms' in decision.message
    bench = Bench()
    bench.run(100)
    for k in (0, 1):
        bench.safety.clock.steady(5 * k * MS)
        bench.now += 3_600_000 * k * MS
        decision = bench.safety.tick(bench.now)
    assert 'the clock was set ahead by 3599995 ms' in decision.message


def test_a_pressure_that_is_lost_again_and_again_latches():
    """A sensor with the wrong sign reads well at rest: fill and vent in turn end with a latch."""
    bench = Bench()
    for sound_pa, wrong_pa in ((P_ATM_PA, P_ATM_PA - 27e3), (P_ATM_PA, math.nan)):
        for _ in range(5):
            bench.pressure = sound_pa
            assert bench.last(50).state == OK
            bench.pressure = wrong_pa
            decision = bench.last(200)
            assert decision.pressure_pa is None
        assert decision.fault == 'pressure_relapses' and decision.state == EMERGENCY_STOP
        assert 'for the 5th time in 30 s: sign, range or wiring' in decision.message
        bench.pressure = sound_pa
        assert bench.last(1000).state == EMERGENCY_STOP
        assert bench.safety.reset()[0] and bench.last(50).state == OK
    for pause_ms, latched in ((8000, False), (6000, True)):
        bench = Bench()
        for _ in range(5):
            bench.pressure = P_ATM_PA
            bench.run(pause_ms)
            bench.pressure = math.nan
            decision = bench.last(200)
        assert (decision.state == EMERGENCY_STOP) == latched


def test_a_pressure_that_is_only_silent_again_and_again_does_not_latch():
    bench = Bench()
    for _ in range(8):
        bench.pressure = P_ATM_PA
        assert bench.last(50).state == OK
        bench.pressure = None
        assert bench.last(200).fault == 'pressure_timeout'


def test_a_device_that_refuses_latches_and_reset_waits_for_it():
    """A write that failed vents until reset, which needs a device that takes signals again."""
    bench = Bench()
    bench.run(100)
    bench.safety.on_device('out_voltage0_raw: cannot write 3000 (Remote I/O error)')
    decision = bench.last(5)
    assert decision.state == EMERGENCY_STOP and decision.pressure_pa is None
    assert decision.fault == 'device_refuses' and 'Remote I/O error' in decision.message
    done, text = bench.safety.reset()
    assert not done and 'Remote I/O error' in text
    bench.safety.on_device('')
    assert bench.last(100).state == EMERGENCY_STOP
    assert bench.safety.reset()[0]
    assert bench.last(50).state == OK


def named_in(source):
    """Return (keys of faults, all strings) of a module: keys are returned, warned of, latched."""
    keys, strings = set(), set()
    for node in ast.walk(ast.parse(source)):
        first = []
        if isinstance(node, ast.Return) and isinstance(node.value, ast.Tuple):
            first = node.value.elts[:1]
        elif isinstance(node, ast.Call) and getattr(node.func, 'attr', '') in ('warn', '_latch'):
            first = node.args[:1]
        keys |= {one.value for one in first if isinstance(getattr(one, 'value', 0), str)}
        if isinstance(node, ast.Constant):
            strings.add(node.value)
    return keys, strings


def test_every_fault_that_the_driver_names_is_a_row_and_every_row_is_named():
    folder = Path(safety.__file__).parent
    keys, strings = (set().union(*found) for found in zip(*(
        named_in((folder / name).read_text(encoding='utf-8'))
        for name in ('safety.py', 'monitors.py', 'senders.py', 'loop.py'))))
    assert len(keys) > 15 and keys <= set(FAULTS)
    assert set(FAULTS) - strings == {'driver_ends', 'driver_killed', 'reference_lost'}


def test_fault_table_is_complete():
    """The Markdown has every row, and the table says which faults are latched."""
    text = fault_table_markdown()
    assert len(FAULTS) == len(FAULT_TABLE)
    assert all(fault.title in text for fault in FAULT_TABLE)
    assert {fault.key for fault in FAULT_TABLE if fault.latched} == {
        'emergency_stop', 'over_pressure', 'valve_command_interrupted', 'device_refuses',
        'pressure_relapses', 'signal_not_finite'}
    assert text.count('\n') == len(FAULT_TABLE) + 2

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

"""A pressure sensor that speaks but was never valid is told from none at all."""

import math

from pam_actuation.drivers.decision import OK, VENTED, WAITING
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.drivers.monitors import stamp_problem
from pam_actuation.drivers.safety import SafetySupervisor
from pam_sim.units import P_ATM_PA
import pytest
from test_safety import Bench, FAST, MS, START

NOW_NS = 1_700_000_000 * 10 ** 9


@pytest.mark.parametrize('bad, word', [
    (math.nan, 'not a number'), (P_ATM_PA - 151e3, 'reads -151 kPa gauge'),
    (P_ATM_PA + 1.6e6, 'reads 1600 kPa gauge')])
@pytest.mark.parametrize('needs_pressure', [False, True])
def test_a_sensor_that_never_read_validly_is_not_the_same_as_none(bad, word, needs_pressure):
    bench = Bench(needs_pressure=needs_pressure)
    bench.pressure = bad
    decision = bench.last(1900)
    assert decision.state == WAITING and word in decision.message
    for pressure in (bad, None):        # also once it is silent
        bench.pressure = pressure
        decision = bench.last(1000)
        assert decision.state == VENTED and decision.fault == 'pressure_timeout'
        assert 'no valid measured pressure since the start' in decision.message
        assert word in decision.message and decision.level == 2
    bench.pressure = P_ATM_PA + 100e3
    assert bench.last(20).state == OK


def test_a_sensor_that_publishes_and_does_not_arrive_is_not_the_same_as_none():
    """As one that sends best effort, or another type: who has it believes in its limit."""
    bench = Bench(needs_pressure=False)
    bench.pressure = None
    loop = DriverLoop('ppr')
    loop.safety = bench.safety
    loop.set_pressure_publishers('/lab/sensor')
    decision = bench.last(5000)
    assert decision.state == WAITING and decision.fault == 'no_pressure'
    assert decision.message == ('waiting for the first measured pressure; /lab/sensor publishes '
                                'it, and nothing arrives (venting)')
    loop.set_pressure_publishers('')            # it ended: now there is none
    assert 'not supervised' in bench.last(200).message
    bench.pressure = P_ATM_PA + 100e3
    assert bench.last(20).state == OK
    loop.set_pressure_publishers('/lab/sensor')     # of which something arrived
    bench.pressure = None
    decision = bench.last(300)
    assert decision.fault == 'pressure_timeout' and 'nothing arrives' not in decision.message


def test_a_sensor_whose_clock_is_off_is_not_the_same_as_none():
    safety = SafetySupervisor(FAST, needs_pressure=False)
    for now in range(START, START + 3000 * MS, 5 * MS):
        safety.on_pressure(now - 5000 * MS, P_ATM_PA)
        safety.on_command(now, P_ATM_PA + 300e3)
        decision = safety.tick(now)
    assert decision.state == VENTED and 'came 5000 ms old' in decision.message


@pytest.mark.parametrize('stamp_ns, says', [
    (NOW_NS, ''), (NOW_NS - 200 * MS, 'came 200 ms old (limit 100 ms)'),
    (NOW_NS + 200 * MS, 'is stamped 200 ms in the future (limit 20 ms)'),
    (0, 'came without a time stamp (header.stamp is 0)'),
    (4321 * 10 ** 9, 'is stamped 19676 days ago, so by another clock than this one'),
    (2 * NOW_NS, 'is stamped 19676 days in the future, so by another clock than this one')])
def test_a_stamp_of_another_clock_is_told_as_one(stamp_ns, says):
    """One since the start of a computer, as of a board, is not 1700000000000 ms old."""
    assert stamp_problem(stamp_ns, NOW_NS, 0.1, 0.02) == says

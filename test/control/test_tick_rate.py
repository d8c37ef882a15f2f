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

"""A loop that is ticked off the rate of its controller says so, and calculates the same."""

import numpy as np
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.control.tick_rate import TickRate
from pam_actuation.messages import Contraction, Reference, START_NS
import pytest
from straight_rig import sofc

MS = 1_000_000


def says(gaps_ms, rate_hz=200.0):
    rate = TickRate(rate_hz)
    for gap_ms in gaps_ms:
        rate.take(round(gap_ms * MS))
    return rate.says


@pytest.mark.parametrize('period_ms, told', [
    (10.0, 'ticked at 100 Hz, the controller was made for 200 Hz'),
    (1.0, 'ticked at 1000 Hz, the controller was made for 200 Hz'),
    (7.4, ''), (5.0, ''), (3.4, '')])
def test_a_rate_that_is_steadily_off_is_told_and_one_nearby_is_not(period_ms, told):
    assert says([period_ms] * round(1_500 / period_ms)) == told
    assert says([period_ms] * round(900 / period_ms)) == ''


@pytest.mark.parametrize('gaps_ms', [
    [2.0, 8.0] * 300, [5.0] * 190 + [400.0] + [5.0] * 150, [5.0] * 200 + [5_000.0] * 2,
    [9.0] * 60 + [5.0] * 300], ids=['jitter', 'a stall', 'stopped', 'for half a second'])
def test_jitter_and_stalls_are_no_other_rate(gaps_ms):
    assert says(gaps_ms) == ''


def test_what_is_over_is_told_no_longer():
    assert says([10.0] * 300 + [5.0] * 401) == ''
    rate = TickRate(200.0)
    for _ in range(200):
        rate.take(10 * MS)
    rate.forget()
    assert rate.says == ''


def ticked(period_ms):
    """Return what a loop says and its last numbers."""
    loop = ControllerLoop(sofc())
    for k in range(400):
        now_ns = START_NS + round(k * period_ms * MS)
        loop.take('contraction', Contraction(now_ns, 0.01 + 1e-9 * (k % 7)))
        loop.take('reference', Reference(now_ns, 0.01, 0.0))
        (command,), state = loop.tick(now_ns)
    return loop, command


@pytest.mark.parametrize('period_ms, told', [
    (5.0, 'ok'), (10.0, 'ok; ticked at 100 Hz, the controller was made for 200 Hz'),
    (2.6, 'ok; ticked at 384.6 Hz, the controller was made for 200 Hz')])
def test_a_loop_tells_its_rate_beside_what_it_does(period_ms, told):
    loop, command = ticked(period_ms)
    assert loop.reason == told
    assert loop.valid and np.isfinite(command.pressure_pa)
    loop.forget()
    loop.tick(START_NS + 10_000 * MS)
    assert loop.reason == 'no contraction measured yet'

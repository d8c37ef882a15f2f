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

"""Test the loops of a node and their statistics, without ROS."""

from operator import sub
import time

from pam_actuation.nodes.loops import Loop, LoopSet, SteadyTime
from pam_actuation.nodes.timing import Latency, LoopTiming
import pytest

MS = 1_000_000


def test_a_late_tick_keeps_the_phase_and_is_not_made_up_for():
    loop = Loop(10 * MS, None, now_ns=0)
    assert loop.next_ns == 10 * MS
    loop.advance(10 * MS + 5)
    assert loop.next_ns == 20 * MS
    loop.advance(57 * MS)
    assert loop.next_ns == 60 * MS


class StandingTime:
    """A time that goes on only by hand."""

    def __init__(self):
        self.time_ns = 0

    def now_ns(self):
        return self.time_ns

    def wait_until(self, wake_ns):
        pass


class TimeThatJumps(StandingTime):
    """A time on which nothing lasts: waiting for a time is being there."""

    def wait_until(self, wake_ns):
        self.time_ns = max(self.time_ns, wake_ns)


def test_loops_run_at_their_own_rates_and_end_when_cleared():
    loops = LoopSet()
    loops.time = TimeThatJumps()
    calls = []
    loops.add(0.002, lambda: calls.append('fast'))
    loops.add(0.010, lambda: calls.append('slow'))
    while calls.count('slow') < 3:
        loops.run_once()
    assert calls == 3 * (5 * ['fast'] + ['slow'])
    loops.clear()
    assert not loops
    before = len(calls)
    loops.run_once()
    assert len(calls) == before


def test_on_the_clock_of_the_computer_no_tick_comes_early():
    loops = LoopSet()
    times_ns = []
    loops.add(0.002, lambda: times_ns.append(time.monotonic_ns()))
    start_ns = time.monotonic_ns()
    while len(times_ns) < 5:
        loops.run_once()
    assert times_ns[0] >= start_ns + 2 * MS
    assert times_ns[-1] >= start_ns + 10 * MS


def test_a_loop_may_end_all_loops():
    loops, calls = LoopSet(), []
    loops.add(0.001, loops.clear)
    loops.add(0.001, lambda: calls.append('after the end'))
    time.sleep(0.003)       # both are due
    loops.run_once()
    assert not loops and not calls


def test_loops_run_on_the_time_they_are_given():
    loops = LoopSet()
    loops.time = StandingTime()
    calls = []
    loops.add(0.01, lambda: calls.append('simulated'))
    loops.add(0.001, lambda: calls.append('steady'), SteadyTime())
    while calls.count('steady') < 5:
        loops.run_once()
    assert 'simulated' not in calls
    for _ in range(3):
        loops.time.time_ns += 10 * MS
        loops.run_once()
    assert calls.count('simulated') == 3


def test_a_time_that_begins_anew_stops_no_loop():
    loops = LoopSet()
    loops.time = StandingTime()
    ticks_ns = []
    loops.add(0.01, lambda: ticks_ns.append(loops.time.time_ns))
    for begin_ns in (0, 3_600_000 * MS, 5 * MS):
        ticks_ns.clear()
        for k in range(26):
            loops.time.time_ns = begin_ns + k * 4 * MS
            loops.run_once()
        assert 9 <= len(ticks_ns) <= 11
        assert all(7 * MS < gap < 13 * MS for gap in map(sub, ticks_ns[1:], ticks_ns))


def test_timing_counts_period_jitter_and_overruns():
    timing = LoopTiming(0.01)
    for start_ms in (0, 10, 20, 36, 40):
        timing.begin(start_ms * MS)
        timing.end((start_ms + 2) * MS)
    values = dict(timing.values())
    assert values['loop.ticks'] == '5'
    assert values['loop.period_mean_ms'] == '10.0000'
    assert values['loop.jitter_max_ms'] == '6.000'
    assert values['loop.overruns'] == '1'
    assert values['loop.missed'] == '0'         # it was late, but it ran
    assert values['loop.busy_mean_ms'] == '2.000'


def test_a_pause_is_no_overrun():
    timing = LoopTiming(0.01)
    timing.begin(0)
    timing.end(MS)
    timing.pause()
    timing.begin(500 * MS)
    timing.end(501 * MS)
    timing.begin(510 * MS)
    assert timing.overruns == 0
    assert dict(timing.values())['loop.period_mean_ms'] == '10.0000'


def test_ticks_that_did_not_run_are_missed():
    timing = LoopTiming(0.01)
    for start_ms in (0, 10, 35, 40, 50, 84, 90):
        timing.begin(start_ms * MS)
    assert timing.missed == 3                   # those at 20, 60 and 70 ms
    assert timing.overruns == 2


def test_quantiles_of_the_latency_are_right_to_two_percent():
    latency = Latency()
    assert latency.values('input') == ()
    for k in range(1, 1001):
        latency.add(k * 10_000)                 # 0.01 to 10 ms
    assert latency.quantile_ns(0.5) == pytest.approx(5e6, rel=0.02)
    assert latency.quantile_ns(0.99) == pytest.approx(9.9e6, rel=0.02)
    latency.add(-5)
    latency.add(60 * 10 ** 9)                   # beyond the last bin
    assert dict(latency.values('input'))['input.max_ms'] == '60000.000'
    assert latency.quantile_ns(0.0) <= 1020.0

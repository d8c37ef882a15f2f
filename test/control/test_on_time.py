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

"""Readings of a slow sensor are on time, stalls are not; learning that stands still is told."""

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.control.on_time import AFTER_LATE_NS, OnTime
from pam_actuation.messages import Contraction, Reference, START_NS
from pam_sim import load_rig
import pytest
from straight_rig import sofc

MS = 1_000_000


def judged(stamps_ms, delays_ms=1.0, rate_hz=200.0, until_ms=4_000):
    """Return times [ms] and verdicts of ticks with readings of these stamps, and the judge."""
    on_time = OnTime(rate_hz, 'contraction')
    period_ns = round(1e9 / rate_hz)
    stamps_ns = np.round(np.asarray(stamps_ms) * MS).astype(np.int64)
    arrive_ns = stamps_ns + np.round(np.asarray(delays_ms) * MS).astype(np.int64)
    verdicts = {}
    for now_ns in range(100 * MS, until_ms * MS, period_ns):
        newest_ns = stamps_ns[arrive_ns <= now_ns].max()
        verdicts[now_ns / MS] = on_time.judge(now_ns, period_ns, int(newest_ns), 0)
    return np.array(list(verdicts)), np.array(list(verdicts.values())), on_time


def every(period_ms, until_ms=4_000):
    return np.arange(0.0, until_ms, period_ms)


def blocks(of_ms):
    """Return stamps of a sensor of 1000 Hz and the delays of what arrives in blocks."""
    stamps = every(1.0)
    return stamps, np.ceil(stamps / of_ms) * of_ms - stamps + 1.0


def uneven(mean_ms):
    draw = np.random.default_rng(0).choice([0.3, 0.6, 1.0, 1.0, 1.5, 1.9], 1000)
    return np.cumsum(draw * mean_ms)


@pytest.mark.parametrize('readings', [
    (every(4.0),), (every(10.0),), (every(20.0),), (every(20.0), 6.0), blocks(10.0),
    blocks(20.0), (uneven(10.0),)],
    ids=['250 Hz', '100 Hz', '50 Hz', '50 Hz, delayed', 'blocks of 10 ms', 'blocks of 20 ms',
         'uneven 100 Hz'])
def test_readings_that_come_steadily_are_on_time(readings):
    times, verdicts, on_time = judged(*readings)
    assert verdicts[times > 1_000].mean() > 0.95 and on_time.says == ''


@pytest.mark.parametrize('period_ms, stall_ms', [(4.0, 30.0), (10.0, 45.0), (20.0, 80.0)])
def test_a_stall_of_the_sensor_is_no_slow_sensor(period_ms, stall_ms):
    stamps = every(period_ms)
    stamps = stamps[(stamps <= 2_000.0) | (stamps > 2_000.0 + stall_ms - period_ms)]
    times, verdicts, on_time = judged(stamps)
    (late,) = np.nonzero(~verdicts & (times > 1_000.0))
    assert 2_000.0 < times[late[0]] < 2_000.0 + stall_ms + 6.0
    assert times[late[-1]] - times[late[0]] >= 1e-6 * AFTER_LATE_NS
    assert verdicts[-1] and on_time.says == ''


@pytest.mark.parametrize('readings, age_ms', [
    ((every(80.0),), 80), ((every(1000.0 / 28.0),), 38), ((uneven(20.0),), 38),
    ((every(4.0), 70.0), 70)], ids=['12 Hz', '28 Hz', 'uneven 50 Hz', 'delayed'])
def test_readings_too_old_to_learn_from_are_told(readings, age_ms):
    times, verdicts, on_time = judged(*readings)
    assert verdicts[times > 1_000.0].mean() < 0.3
    words = on_time.says.split(' ms old')[0]
    assert words.startswith('learning mostly stands still: contraction is up to ')
    assert float(words.split()[-1]) == pytest.approx(age_ms, abs=10.0)


@pytest.mark.parametrize('silent_s', [0.06, 0.5, 60.0])
def test_after_a_long_silence_of_the_driver_learning_soon_goes_on(silent_s):
    on_time, silent_ns = OnTime(200.0, 'contraction'), round(silent_s * 1e9)
    assert not on_time.judge(silent_ns, 5 * MS, silent_ns, silent_ns)
    after_ms = 1e-6 * AFTER_LATE_NS + min(1e3 * silent_s, 1e-6 * AFTER_LATE_NS)
    for k in range(1, 200):
        now_ns = silent_ns + k * 5 * MS
        assert on_time.judge(now_ns, 5 * MS, now_ns, 0) == (k * 5 >= after_ms)


def test_what_is_forgotten_is_told_no_longer():
    _, _, on_time = judged(every(80.0))
    on_time.forget()
    assert on_time.says == '' and on_time.judge(0, 0, 0, 0)


def ticked(controller, period_ms, learning=True):
    """Return what a loop says, and the ticks that learned, with readings this far apart."""
    loop, learned = ControllerLoop(controller), []
    for k in range(800):
        now_ns = START_NS + k * 5 * MS
        if k * 5 % period_ms == 0:
            loop.take('contraction', Contraction(now_ns, 0.01 + 1e-9 * (k % 977)))
        loop.take('reference', Reference(now_ns, 0.01, 0.0))
        _, state = loop.tick(now_ns, learning)
        learned.append(dict(zip(state.names, state.values))['learning'])
    return loop.reason, np.array(learned)


def test_a_loop_with_a_sensor_of_50_hz_learns_and_one_of_12_hz_says_that_it_does_not():
    reason, learned = ticked(sofc(), 20)
    assert reason == 'ok' and learned[400:].all()
    reason, learned = ticked(sofc(), 80)
    assert reason.startswith('ok; learning mostly stands still: contraction is')
    assert not learned[200:].any()
    assert ticked(sofc(), 80, learning=False)[0] == 'ok'


def test_a_law_without_rules_has_nothing_to_tell():
    rig = load_rig('dmsp_5_300_realistic', valve='ppr')
    assert ticked(load_controller('pid', rig), 80)[0] == 'ok'
    assert 'learning mostly stands still' in ticked(load_controller('ilc_ppr', rig), 80)[0]

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

"""The motion that single messages ask for, with and without rates, clean and with noise."""

import math

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.control.modes.tracked import CONTRACTION, JOINT
from pam_actuation.control.reference_buffer import ReferenceBuffer, SCALES
from pam_actuation.control.reference_motion import LONGEST_S, ReferenceMotion
from pam_actuation.messages import Contraction, Pressure, Reference
from pam_sim import load_rig
import pytest

SCALE = SCALES[CONTRACTION]
MS = 1_000_000


def gait_m(time_s):
    """Return position [m] and rate of a motion with two harmonics."""
    w = 2.0 * math.pi * 0.8
    return (0.014 + 0.006 * math.sin(w * time_s) + 0.001 * math.sin(2.0 * w * time_s),
            0.006 * w * math.cos(w * time_s) + 0.002 * w * math.cos(2.0 * w * time_s))


def followed(rate_hz, rate_of, noise_m=0.0, seconds=6.0, motion_of=gait_m):
    """Return errors of position [m] and rate [m/s], seen at 200 Hz from 2 s on."""
    motion, noise = ReferenceMotion(SCALE), np.random.default_rng(4)
    every_ns, errors, next_ns = round(1e9 / rate_hz), [], 0
    for now_ns in range(0, round(seconds * 1e9), 5 * MS):
        while next_ns <= now_ns:
            position, rate = motion_of(next_ns * 1e-9)
            motion.take(next_ns, position + noise_m * noise.standard_normal(), rate_of(rate))
            next_ns += every_ns
        if now_ns >= 2_000 * MS:
            errors.append(np.subtract(motion.at(now_ns), motion_of(now_ns * 1e-9)))
    return np.sqrt(np.mean(np.square(errors), axis=0))


def told(rate):
    return rate


def not_told(rate):
    return math.nan


@pytest.mark.parametrize('rate_hz, rate_of, position_m, rate_m_per_s', [
    (200.0, told, 1e-9, 1e-9), (100.0, told, 1e-6, 2e-4), (50.0, told, 4e-6, 5e-4),
    (200.0, not_told, 1e-7, 2e-4), (100.0, not_told, 2e-6, 5e-4), (50.0, not_told, 2e-5, 2e-3),
    (30.0, not_told, 1e-4, 6e-3), (100.0, lambda rate: 0.0, 2e-6, 5e-4),
    (100.0, lambda rate: 57.3 * rate, 2e-6, 5e-4)],
    ids=lambda value: getattr(value, '__name__', str(value)).strip('<>'))
def test_a_smooth_motion_is_known_between_its_messages(
        rate_hz, rate_of, position_m, rate_m_per_s):
    """The rate itself is up to 40 mm/s; one may be told, or not, or be wrong."""
    assert (followed(rate_hz, rate_of) <= (position_m, rate_m_per_s)).all()


def test_noise_makes_the_memory_longer():
    """Differences of positions would have a rate of 0.1 mm * sqrt(2) / 10 ms, 14 mm/s."""
    position_m, rate_m_per_s = followed(100.0, not_told, noise_m=1e-4)
    assert position_m < 1e-4 and rate_m_per_s < 4e-3


def test_small_steps_are_no_motion():
    """A slider: the position stands still for half a second, then goes on by 0.5 mm."""
    steps = ReferenceMotion(SCALE)
    rates = []
    for k in range(400):
        steps.take(k * 10 * MS, 0.01 + 0.5e-3 * (k // 50))
        rates.append(abs(steps.at(k * 10 * MS + 5 * MS)[1]))
    assert max(rates) == 0.0


def test_a_jump_says_nothing_of_the_rate():
    for rate_of in (told, not_told):
        motion = ReferenceMotion(SCALE)
        for k in range(200):
            position, rate = gait_m(k * 0.01)
            motion.take(k * 10 * MS, position, rate_of(rate))
        before = motion.at(1995 * MS)[1]
        position, rate = gait_m(2.0)
        motion.take(2000 * MS, position + 0.005, rate_of(rate))
        assert motion.at(2000 * MS)[0] == pytest.approx(position + 0.005, abs=1e-9)
        assert motion.at(2000 * MS)[1] == pytest.approx(before, abs=2e-3)


def test_a_fast_motion_with_few_messages_is_no_row_of_jumps():
    """An angle at 3 rad/s and 20 Hz, seen from its midst: steps of 0.15 rad, jumps are 0.04."""
    motion = ReferenceMotion(SCALES[JOINT])
    for k in range(10):
        motion.take(k * 50 * MS, 0.15 * k)
    assert motion.at(450 * MS)[1] == pytest.approx(3.0)


def test_a_bend_nobody_foresaw_makes_no_kick():
    """A triangle: right after a corner the rate is the told one, not beyond it."""
    motion = ReferenceMotion(SCALE)
    worst = 0.0
    for k in range(600):
        phase = k % 100
        rate = 0.02 if phase < 50 else -0.02
        position = 0.01 + 2e-4 * (phase if phase < 50 else 100 - phase)
        motion.take(k * 10 * MS, position, rate)
        worst = max(worst, abs(motion.at(k * 10 * MS + 9 * MS)[1]))
    assert worst < 0.0205


def test_after_a_pause_the_motion_begins_anew():
    motion = ReferenceMotion(SCALE)
    for k in range(100):
        motion.take(k * 10 * MS, 1e-4 * k)
    assert motion.at(990 * MS)[1] == pytest.approx(0.01, rel=1e-6)
    motion.take(990 * MS + round(1.1e9 * LONGEST_S), 0.02)
    assert motion.at(2_000 * MS) == (0.02, 0.0)


def test_a_message_from_the_future_leaves_the_motion_as_it_was():
    buffer = ReferenceBuffer()
    for k in range(100):
        buffer.set_reference(Reference(k * 10 * MS, 1e-4 * k))
        buffer.refuse_ahead(k * 10 * MS)
        buffer.at(k * 10 * MS, k * 10 * MS)
    expected = buffer.at(995 * MS, 995 * MS)
    buffer.set_reference(Reference(1_500 * MS, 0.0))
    buffer.refuse_ahead(995 * MS)
    assert buffer.at(995 * MS, 995 * MS) == expected and buffer.refused == 1


def test_a_reference_that_is_silent_comes_to_rest():
    """The rate is that of the position at each time, and of the preview."""
    buffer = ReferenceBuffer()
    buffer.set_reference(Reference(0, 0.01, 0.06))
    buffer.judge(0)
    for ahead_ms in (-4, 0, 100):
        for now_ns in range(0, 600 * MS, 2 * MS):
            (before, _), (wanted, rate), (after, _) = (
                buffer.at(t, t + ahead_ms * MS) for t in (now_ns - MS, now_ns, now_ns + MS))
            if now_ns not in (200 * MS, 204 * MS, 500 * MS):    # where it bends
                assert rate == pytest.approx((after - before) / 2e-3, abs=1e-9)
    assert buffer.at(300 * MS, 300 * MS) == (pytest.approx(0.022), 0.0)
    assert buffer.at(500 * MS, 600 * MS) == (pytest.approx(0.022), 0.0)


@pytest.mark.parametrize('rate, learns', [(0.06, False), (0.0, True)])
def test_nothing_is_learned_where_a_motion_is_silent(rate, learns):
    loop, learned = ControllerLoop(load_controller('pid', load_rig('dmsp_5_300_hanging_mass'))), []
    loop.take('reference', Reference(0, 0.01, rate))
    for k in range(90):
        now_ns = k * 5 * MS
        loop.take('contraction', Contraction(now_ns, 0.014 + 1e-9 * k))
        _, state = loop.tick(now_ns)
        learned.append(dict(zip(state.names, state.values))['learning'] == 1.0)
    assert all(learned[:41]) and set(learned[41:]) == {learns}


def test_a_controller_sees_positions_alone_as_those_with_a_rate():
    """The reference of ``controller_state`` at 200 Hz, from 50 Hz of positions."""
    loop = ControllerLoop(load_controller('pid', load_rig('dmsp_5_300_hanging_mass')))
    errors = []
    for k in range(800):
        now_ns = k * 5 * MS
        loop.take('contraction', Contraction(now_ns, 0.014))
        loop.take('pressure', Pressure(now_ns, 3e5))
        position, rate = gait_m(now_ns * 1e-9)
        if k % 4 == 0:
            loop.take('reference', Reference(now_ns, position))
        _, state = loop.tick(now_ns)
        seen = dict(zip(state.names, state.values))
        errors.append((seen['reference_m'] - position, seen['reference_m_per_s'] - rate))
    assert (np.sqrt(np.mean(np.square(errors[400:]), axis=0)) < (2e-5, 2e-3)).all()

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

"""Dead time and lag from command to pressure, found from movement."""

import numpy as np
from pam_actuation.control.delay_estimate import DelayEstimator, estimate_path
from pam_sim.errors import InputError
from pam_sim.run import Run, Series
import pytest

RATE_HZ = 200.0


def commands(seconds, rate_hz, seed=0):
    """Return a command [Pa] of sines from 0.3 to 6 Hz, small ones among them."""
    random, time_s = np.random.default_rng(seed), np.arange(round(seconds * rate_hz)) / rate_hz
    command = np.full(time_s.size, 4e5)
    for hz, size_pa in ((0.3, 5e4), (0.8, 2e4), (2.5, 3e3), (4.0, 2e3), (6.0, 2e3)):
        command += size_pa * np.sin(2.0 * np.pi * (hz * time_s + random.random()))
    return command


def answered(command, rate_hz, delay_s, lag_s, gain=0.96, zero_pa=4e3, noise_pa=300.0, seed=1):
    """Return the measured pressure of a valve, by steps of 0.5 ms."""
    fine = round(2000.0 / rate_hz)
    held = np.repeat(command, fine)
    late = np.r_[np.full(round(2000.0 * delay_s), held[0]), held][:held.size]
    pressure, part = np.empty(held.size), 1.0 - np.exp(-0.0005 / lag_s)
    value = held[0]
    for k, wanted in enumerate(late):
        pressure[k] = value
        value += part * (wanted - value)
    noise = noise_pa * np.random.default_rng(seed).standard_normal(command.size)
    return gain * pressure[::fine] + zero_pa + noise


@pytest.mark.parametrize('delay_s, lag_s, rate_hz', [
    (0.0, 0.01, 200.0), (0.033, 0.06, 200.0), (0.0785, 0.03, 200.0), (0.021, 0.14, 200.0),
    (0.033, 0.06, 100.0), (0.033, 0.06, 1000.0)])
def test_dead_time_and_lag_are_found(delay_s, lag_s, rate_hz):
    command = commands(10.0, rate_hz)
    found = estimate_path(command, answered(command, rate_hz, delay_s, lag_s), rate_hz)
    assert found.delay_s == pytest.approx(delay_s, abs=0.004)
    assert abs(found.delay_s - delay_s) < found.uncertainty_s < 0.010
    assert found.lag_s == pytest.approx(lag_s, rel=0.1, abs=0.002)
    assert found.explained > 0.95


def test_tick_by_tick_has_the_bits_of_a_whole_row():
    command = commands(5.0, RATE_HZ)
    pressure = answered(command, RATE_HZ, 0.04, 0.05)
    one, whole = DelayEstimator(RATE_HZ), DelayEstimator(RATE_HZ)
    for pair in zip(command, pressure):
        sure = one.step(*pair)
    assert sure and whole.steps(command, pressure)
    assert one.estimate() == whole.estimate() is not None


def test_without_movement_there_is_no_answer():
    """Noise alone says nothing, before a motion and a long time after it."""
    still, moving = np.full(2000, 4e5), commands(8.0, RATE_HZ)
    moving += 4e5 - moving[0]
    command = np.r_[still, moving, np.full(8000, moving[-1])]
    pressure = answered(command, RATE_HZ, 0.05, 0.06)
    estimator, end = DelayEstimator(RATE_HZ), 2000 + moving.size
    assert not estimator.steps(command[:2000], pressure[:2000]) and estimator.estimate() is None
    assert estimator.steps(command[2000:end], pressure[2000:end])
    before = estimator.estimate()
    assert estimator.steps(command[end:], pressure[end:])
    assert estimator.estimate().delay_s == pytest.approx(before.delay_s, abs=0.002)


def test_a_change_is_found_and_a_gap_leaves_what_was_found():
    estimator, command = DelayEstimator(RATE_HZ), commands(50.0, RATE_HZ)
    estimator.steps(command[:4000], answered(command, RATE_HZ, 0.03, 0.06)[:4000])
    before = estimator.estimate()
    assert before.delay_s == pytest.approx(0.03, abs=0.004)
    estimator.steps(command[4000:4005], np.full(5, np.nan))
    assert estimator.estimate() == before
    assert estimator.steps(command[4005:], answered(command, RATE_HZ, 0.07, 0.06)[4005:])
    assert estimator.estimate().delay_s == pytest.approx(0.07, abs=0.006)
    estimator.reset()
    assert estimator.estimate(unsure=True) is None


def test_what_no_first_order_lag_explains_is_not_sure():
    command = commands(10.0, RATE_HZ)
    other = answered(commands(10.0, RATE_HZ, seed=3), RATE_HZ, 0.03, 0.06)
    estimator = DelayEstimator(RATE_HZ)
    assert not estimator.steps(command, other) and estimator.estimate() is None
    assert estimator.estimate(unsure=True).explained < 0.9
    with pytest.raises(InputError, match='no dead time with a first order lag explains'):
        estimate_path(command, other, RATE_HZ)


@pytest.mark.parametrize('command, pressure, rate_hz, message', [
    (np.zeros(5), np.zeros(4), 200.0, r'shapes \(5,\) and \(4,\)'),
    (np.zeros(900), np.zeros(900), 200.0, 'moves for 0.0 s; 3 s are needed'),
    (np.zeros(5), np.zeros(5), 0.0, 'rate_hz is 0.0')])
def test_bad_input_is_refused_in_a_sentence(command, pressure, rate_hz, message):
    with pytest.raises(InputError, match=message):
        estimate_path(command, pressure, rate_hz)


def test_a_report_names_them():
    from pam_actuation.report.command_path import command_path
    command = commands(8.0, RATE_HZ)
    pressure = answered(command, RATE_HZ, 0.034, 0.06)
    stamps = (1e9 + 5e6 * np.arange(command.size)).astype(np.int64)
    run = Run({'pressure_command': Series(stamps, {'pressure_pa': command}),
               'pressure': Series(stamps - 400_000, {'pressure_pa': pressure})}, {})
    found = command_path(run)
    assert found.delay_s == pytest.approx(0.034, abs=0.003)
    assert found.text() == (f'dead time {1e3 * found.delay_s:.0f} ms '
                            f'(±{1e3 * found.uncertainty_s:.0f}), lag {1e3 * found.lag_s:.0f} ms')
    still = Run({**run.topics, 'pressure_command': Series(stamps, {
        'pressure_pa': np.full(command.size, 4e5)})}, {})
    assert command_path(still) is None

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

"""Noise read from data: white, quantised, with motion in it."""

import numpy as np
from pam_sim.gap.data.noise import (
    autocorrelation_time, LAG_S, Noise, noise_of, noise_sd, quantisation_step, rms_rate)
import pytest


def test_white_noise_on_motion_and_steps():
    random = np.random.default_rng(0)
    t = np.arange(8000) / 200.0
    motion = 0.01 * np.sin(2 * np.pi * 0.5 * t) + np.where(t % 4 < 2, 0.0, 0.005)
    assert noise_sd(motion + 1e-5 * random.standard_normal(t.size)) == pytest.approx(
        1e-5, rel=0.05)


def test_a_quantised_signal_has_at_least_its_step():
    t = np.arange(4000) / 200.0
    coarse = np.round(0.01 * np.sin(t) / 1e-4) * 1e-4
    assert quantisation_step(coarse) == pytest.approx(1e-4, rel=1e-6)
    assert noise_sd(coarse) >= 1e-4 / np.sqrt(12.0) * 0.999


def test_a_free_signal_has_no_step():
    assert quantisation_step(np.random.default_rng(0).standard_normal(1000)) == 0.0
    assert noise_sd(np.ones(4)) == 0.0


def test_rate_of_a_sine():
    t = np.arange(8000) / 200.0
    x = np.sin(2 * np.pi * 0.5 * t) + 1e-3 * np.random.default_rng(0).standard_normal(t.size)
    assert rms_rate(t, x, 1e-3) == pytest.approx(np.pi / np.sqrt(2), rel=0.02)


def test_memory_of_white_and_smooth_residuals():
    random = np.random.default_rng(0)
    white = random.standard_normal(5000)
    assert autocorrelation_time(white) < 2.0
    smooth = np.convolve(white, np.ones(50) / 50, mode='same')
    assert autocorrelation_time(smooth) == pytest.approx(50, rel=0.3)
    assert autocorrelation_time(np.zeros(100)) == 1.0


def test_noise_of_a_slow_log_is_found_in_quick_motion_and_at_uneven_instants():
    random = np.random.default_rng(0)
    t = 0.02 * np.arange(1500) + random.uniform(0.0, 1.5e-3, 1500)
    motion = 0.01 * np.sin(2 * np.pi * 0.5 * t) + 0.002 * np.sin(2 * np.pi * 4.0 * t)
    read = motion + 1e-5 * random.standard_normal(t.size)
    assert noise_of(t, read).sd == pytest.approx(1e-5, rel=0.1)
    assert noise_sd(read) > 3e-5             # third differences of even samples hold the motion


def test_a_log_whose_samples_are_too_far_apart_finds_no_shorter_memory():
    random, true = np.random.default_rng(0), Noise(20.0, 150.0, 0.05)
    of_hz = {}
    for hz in (80.0, 100.0):
        t = np.arange(0.0, 400.0, 1.0 / hz)
        of_hz[hz] = noise_of(t, true.draw(t, random)).memory_s
    assert of_hz[80.0] == pytest.approx(of_hz[100.0], rel=0.35)


@pytest.mark.parametrize('hz', [100.0, 200.0, 1000.0])
def test_stamps_that_are_a_little_off_change_no_memory(hz):
    random, values = np.random.default_rng(0), Noise(60.0, 150.0, 0.03)
    t = np.arange(0.0, 40.0, 1.0 / hz)
    read = values.draw(t, random)
    found = noise_of(1.001 * t, read)
    assert found.memory_s > 0.5 * LAG_S and noise_of(1.002 * t, read) == found

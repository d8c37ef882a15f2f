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

"""Figures of merit on signals whose figures are known."""

import math

import numpy as np
from pam_actuation.valves import figures
from pam_actuation.valves.energy import power_arguments, power_values, pulse_energy_j
from pam_sim.errors import InputError
import pytest

DT_S = 0.001
LAG_S, DELAY_S = 0.060, 0.030


def lag(from_pa, to_pa, count=2000):
    time = np.maximum((np.arange(count) + 1) * DT_S - DELAY_S, 0.0)
    return to_pa + (from_pa - to_pa) * np.exp(-time / LAG_S)


@pytest.mark.parametrize('ends', [(100e3, 300e3), (500e3, 200e3)])
def test_figures_of_a_delayed_lag(ends):
    found = figures.step_figures(lag(*ends), *ends, DT_S)
    assert found.dead_time_s == pytest.approx(DELAY_S - LAG_S * math.log(0.98), abs=DT_S)
    assert found.rise_s == pytest.approx(LAG_S * math.log(9.0), abs=1e-4)
    assert found.settling_s == pytest.approx(DELAY_S + LAG_S * math.log(50.0), abs=2 * DT_S)
    assert found.overshoot == 0.0 and abs(found.error_pa) < 1e-3


def test_overshoot_error_and_what_is_never_reached():
    gauge = np.concatenate([np.linspace(100e3, 330e3, 200), np.full(800, 310e3)])
    found = figures.step_figures(gauge, 100e3, 300e3, DT_S)
    assert found.overshoot == pytest.approx(0.15)
    assert found.error_pa == pytest.approx(10e3)
    assert found.settling_s is None
    short = figures.step_figures(np.linspace(100e3, 200e3, 500), 100e3, 300e3, DT_S)
    assert short.rise_s is None and short.dead_time_s is not None


def test_straight_line_finds_gain_and_bend():
    command = np.linspace(0.0, 500e3, 11)
    reached = 2e3 + 0.98 * command
    assert figures.straight_line(command, reached) == pytest.approx((0.98, 2e3, 0.0), abs=1e-6)
    reached[5] += 5e3
    assert 0.005 < figures.straight_line(command, reached)[2] < 0.010


def test_bandwidth_of_a_lag():
    frequencies = (0.5, 1.0, 2.0, 2.5, 3.0, 8.0)
    time = np.arange(4000) * DT_S
    gains = []
    for frequency in frequencies:
        size = 1.0 / math.hypot(1.0, 2.0 * math.pi * frequency * LAG_S)
        gains.append(figures.sine_gain(
            size * np.sin(2.0 * math.pi * frequency * time + 0.7) + 5.0 + 3.0 * time, frequency,
            DT_S))
        assert gains[-1] == pytest.approx(size, rel=1e-9)
    assert figures.bandwidth(frequencies, gains) == pytest.approx(
        1.0 / (2.0 * math.pi * LAG_S), rel=0.01)
    assert figures.bandwidth(frequencies, [1.0] * 6) is None


def test_ripple_leaves_slow_changes_out():
    time = np.arange(5000) * DT_S
    slow = 1e5 + 200.0 * time
    rms, peak = figures.ripple(slow + np.sin(2.0 * math.pi * 100.0 * time), 20)
    assert rms == pytest.approx(math.sqrt(0.5), rel=1e-3)
    assert peak == pytest.approx(2.0, rel=0.05)
    assert figures.ripple(slow, 20) == pytest.approx((0.0, 0.0), abs=1e-6)


def test_pulses_join_over_full_duties():
    fill = [0.3, 0.0, 1.0, 1.0, 0.5, 0.0, 0.0]
    vent = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    duties = np.repeat(np.array([fill, vent]).T, 10, axis=0)
    found = figures.pulses(duties, 10, DT_S)
    assert found.count == 3
    assert sorted(found.lengths_s) == pytest.approx([0.003, 0.010, 0.025])
    assert found.on_s == pytest.approx(0.038)
    assert found.shut_share == pytest.approx(2 / 7)


def test_energy_is_peak_then_hold():
    power = power_values({'hsv_peak_power_w': 8.0, 'hsv_peak_time_s': 0.002,
                          'hsv_hold_power_w': 1.0})
    assert pulse_energy_j([0.001, 0.005], power) == pytest.approx(0.003 * 8.0 + 0.003 * 1.0)
    assert pulse_energy_j([], power) == 0.0


@pytest.mark.parametrize(('text', 'says'), [
    ('ppr_power_w', 'NAME=NUMBER'), ('ppr_power_w=much', 'NAME=NUMBER'),
    ('ppr_power=3', 'did you mean `ppr_power_w`'), ('ppr_power_w=-1', 'allowed 0 to 100 W')])
def test_power_numbers_are_checked(text, says):
    with pytest.raises(InputError, match=says):
        power_arguments([text])

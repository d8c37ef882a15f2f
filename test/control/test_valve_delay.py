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

"""Dead time from the duties of on/off valves to pressure, found from movement."""

import math

import numpy as np
from pam_actuation.control.valve_delay import ValveDelayEstimator
from pam_actuation.report.command_path import command_path
from pam_sim.errors import InputError
from pam_sim.run import Run, Series
from pam_sim.units import P_ATM_PA
from pam_sim.valve.flow import flow_function
import pytest

SUPPLY_PA, RATIO = 801_325.0, 0.38


def moved(delay_s, rate_hz=200.0, seconds=10.0, lag_s=0.0, seed=0, moving=True):
    """Return duties, pressure [Pa] and contraction [m] of a loop of on/off valves on a muscle."""
    random, fine = np.random.default_rng(seed), 1000
    every, period = round(fine / rate_hz), round(0.01 * fine)
    count = round(seconds * fine)
    time_s = np.arange(count) / fine
    x_m = 0.01 + 0.004 * moving * np.sin(2.0 * np.pi * 1.3 * time_s)
    wanted_pa = 4e5 + moving * (4e4 * np.sin(2.0 * np.pi * 0.7 * time_s)
                                + 1e4 * np.sin(2.0 * np.pi * 3.0 * time_s + 1.0))
    late = round(delay_s * fine)
    duties = np.zeros((count + late + 1, 2))
    pressure_pa, seen_pa, wait = 4e5, 4e5, late // period + 1
    rows = np.empty((count, 4))
    for k in range(count):
        volume_m3 = 9e-6 + 1.1e-4 * x_m[k]
        if k % period == 0:
            under_way = duties[max(k - late, 0):k].sum(axis=0) @ (1.0, -0.7) * 1e3
            error = wanted_pa[k] - seen_pa - 1.4 * under_way + 2e3 * random.standard_normal()
            duty = min(abs(error) / (14e3 * wait), 1.0) if abs(error) > 1e3 else 0.0
            duties[k:k + period] = (duty, 0.0) if error > 0.0 else (0.0, duty)
        rows[k] = *duties[k], seen_pa + 300.0 * random.standard_normal(), x_m[k]
        fill, vent = duties[k - late] if k >= late else (0.0, 0.0)
        flow = (fill * SUPPLY_PA * flow_function.py_func(pressure_pa / SUPPLY_PA, RATIO)
                - vent * pressure_pa * flow_function.py_func(P_ATM_PA / pressure_pa, RATIO))
        rate = 1.7e-5 * flow / volume_m3
        if k + 1 < count:
            rate -= pressure_pa * 1.1e-4 * (x_m[k + 1] - x_m[k]) * fine / volume_m3
        pressure_pa += rate / fine
        seen_pa += (pressure_pa - seen_pa) * (1.0 - math.exp(-1.0 / (fine * lag_s))
                                              if lag_s > 0.0 else 1.0)
    return rows[::every].T


def estimator_of(rows, rate_hz=200.0):
    """Return an estimator that has seen rows of fill, vent, pressure and contraction."""
    estimator = ValveDelayEstimator(rate_hz)
    estimator.steps(*rows)
    return estimator


@pytest.mark.parametrize('delay_s, rate_hz, lag_s', [
    (0.0, 200.0, 0.0), (0.033, 200.0, 0.0), (0.078, 200.0, 0.0), (0.033, 100.0, 0.0),
    (0.033, 1000.0, 0.0), (0.033, 200.0, 0.01)])
def test_the_dead_time_is_found(delay_s, rate_hz, lag_s):
    found = estimator_of(moved(delay_s, rate_hz, lag_s=lag_s), rate_hz).estimate()
    assert found.delay_s == pytest.approx(delay_s + lag_s, abs=0.004)
    assert found.uncertainty_s < 0.01 and found.explained > 0.9 and math.isnan(found.lag_s)


def test_rows_in_parts_have_the_bits_of_a_whole_and_a_gap_leaves_what_was_found():
    rows = moved(0.04)
    whole, parts = estimator_of(rows), ValveDelayEstimator(200.0)
    parts.steps(*rows[:, :777])
    parts.steps(*rows[:, 777:])
    before = whole.estimate()
    assert parts.estimate() == before is not None
    whole.steps(*np.full((4, 5), np.nan))
    assert whole.estimate() == before


def test_without_working_valves_or_a_fitting_pressure_it_is_not_sure():
    assert ValveDelayEstimator(200.0).estimate(unsure=True) is None
    still = estimator_of(moved(0.033, moving=False, seconds=3.0))
    assert still.estimate() is None and still.estimate(unsure=True).moved_s < 3.0
    rows = moved(0.033)
    rows[2] = moved(0.033, seed=1)[2][::-1]
    other = estimator_of(rows)
    assert other.estimate() is None and other.estimate(unsure=True).explained < 0.9


def test_a_rate_that_is_none_is_refused():
    with pytest.raises(InputError, match='rate_hz is 0.0'):
        ValveDelayEstimator(0.0)


def test_a_report_names_it():
    fill, vent, pressure, contraction = moved(0.034)
    stamps = (1e9 + 5e6 * np.arange(fill.size)).astype(np.int64)
    run = Run({
        'pressure_command': Series(stamps, {'pressure_pa': np.full(fill.size, 4e5)}),
        'valve_signal': Series(stamps[::2] + 400_000, {
            'fill_duty': fill[::2], 'vent_duty': vent[::2]}),
        'pressure': Series(stamps - 300_000, {'pressure_pa': pressure}),
        'contraction': Series(stamps - 300_000, {'contraction_m': contraction})}, {})
    found = command_path(run)
    assert found.delay_s == pytest.approx(0.034, abs=0.004)
    assert found.text() == ('dead time of the valves '
                            f'{1e3 * found.delay_s:.0f} ms (±{1e3 * found.uncertainty_s:.0f})')

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

"""The numbers in sentences of the table of faults, and of reasons, are those that count."""

from dataclasses import replace
import runpy

from pam_actuation.control import effort_buffer, inputs, reference_buffer, tick
from pam_actuation.control.effort_buffer import EffortBuffer
from pam_actuation.drivers import faults, limits, monitors, not_emptied, senders
from pam_actuation.drivers.limits import SafetyLimits
from pam_actuation.messages import NamedEfforts, START_NS
import pytest


def changed_rows():
    """Return the keys of the rows that read otherwise with the numbers of now."""
    told = runpy.run_path(faults.__file__)['FAULT_TABLE']
    return {now.key for now, usual in zip(told, faults.FAULT_TABLE)
            if vars(now) != vars(usual)}


@pytest.mark.parametrize('name, value, rows', [
    ('command_timeout_s', 0.2, {'command_timeout', 'command_stamp'}),
    ('measurement_timeout_s', 0.2, {'pressure_timeout'}),
    ('first_pressure_wait_s', 3.0, {'no_pressure', 'no_pressure_ppr', 'pressure_timeout'}),
    ('supply_timeout_s', 0.7, {'supply_stale'}),
    ('stamp_ahead_s', 0.03, {'command_stamp', 'pressure_timeout'}),
    ('lowest_plausible_gauge_pa', -10e3, {'pressure_timeout'}),
    ('highest_plausible_pa', 2e6, {'pressure_timeout'}),
    ('frozen_after_s', 0.3, {'pressure_frozen'}),
    ('frozen_change_pa', 50e3, {'pressure_frozen'}),
    ('pause_s', 0.4, {'driver_paused', 'clock_ahead'}),
    ('two_publishers_window_s', 0.6, {'two_publishers', 'command_clock'}),
    ('two_publishers_clear_s', 2.0, {'two_publishers', 'command_clock'}),
    ('supply_margin_pa', 25e3, {'supply_low'})])
def test_the_table_tells_the_limits_of_the_supervisor(monkeypatch, name, value, rows):
    assert changed_rows() == set()
    monkeypatch.setattr(
        limits, 'SafetyLimits', lambda: replace(SafetyLimits(), **{name: value}))
    assert changed_rows() == rows


@pytest.mark.parametrize('module, name, value, rows', [
    (limits, 'TRIP_SHARE', 1.1, {'over_pressure'}),
    (limits, 'TRIP_MARGIN_PA', 20e3, {'over_pressure'}),
    (limits, 'WATCHDOG_S', 0.07, {'driver_killed'}),
    (limits, 'DEVICE_WATCHDOG_S', 0.2, {'driver_killed'}),
    (monitors, 'SHORTEST', 0.5, {'pressure_frozen'}),
    (monitors, 'LEAST_CHANGE', 0.2, {'pressure_frozen'}),
    (monitors, 'MOST_RELAPSES', 6, {'pressure_relapses'}),
    (monitors, 'RELAPSES_WITHIN_S', 40.0, {'pressure_relapses', 'signal_not_finite'}),
    (monitors, 'MOST_RESTARTS', 3, {'signal_not_finite'}),
    (monitors, 'WARNING_HOLD_S', 2.0, {'command_above_limit', 'command_below_atmosphere'}),
    (monitors.AirMonitor, 'MISSING_PA', 60e3, {'air_missing'}),
    (monitors.AirMonitor, 'FALLS_S', 0.04, {'air_missing'}),
    (monitors.AirMonitor, 'EMPTY_GAUGE_PA', 30e3, {'air_missing'}),
    (monitors.AirMonitor, 'EMPTY_S', 0.3, {'air_missing'}),
    *((not_emptied, name, value, {'not_emptied'}) for name, value in (
        ('ABOVE_PA', 60e3), ('LEAST_GAUGE_PA', 90e3), ('LEAST_FALL_PA', 2e4), ('AFTER_S', 2.0))),
    (senders, 'CLEAR_S', 2.0, {'two_publishers', 'second_driver', 'two_sensors'})])
def test_the_table_tells_the_constants_of_the_monitors(monkeypatch, module, name, value, rows):
    monkeypatch.setattr(module, name, value)
    assert changed_rows() == rows


@pytest.mark.parametrize('module, name, value, words, count', [
    (inputs, 'MAX_AGE_S', 0.15, 'is older than 0.15 s', 3),
    (reference_buffer, 'MAX_AHEAD_NS', 30_000_000, 'is stamped more than 0.03 s ahead', 3)])
def test_the_reasons_of_a_tick_tell_what_a_stamp_may_be(
        monkeypatch, module, name, value, words, count):
    monkeypatch.setattr(module, name, value)
    reasons = runpy.run_path(tick.__file__)['REASONS']
    assert sum(words in reason for reason in reasons) == count
    assert sum(now != usual for now, usual in zip(reasons, tick.REASONS)) == count


@pytest.mark.parametrize('name, age_ms, words', [
    ('MAX_AGE_NS', 200, 'is older than 0.15 s'),
    ('MAX_AHEAD_NS', -200, 'is stamped more than 0.15 s ahead')])
def test_a_refused_torque_tells_what_its_stamp_may_be(monkeypatch, name, age_ms, words):
    monkeypatch.setattr(effort_buffer, name, 150_000_000)
    buffer = EffortBuffer('knee')
    buffer.take(NamedEfforts(START_NS - age_ms * 1_000_000, (), (1.0,)))
    buffer.judge(START_NS, angle_wanted=False)
    assert words in buffer.refusal

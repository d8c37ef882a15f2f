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

"""The PID baseline: tracks, does not wind up, starts without a step."""

from pam_actuation.control.pid import PidController
from pam_actuation.control.static_inverse import tabulate_static_inverse
import pytest
from straight_rig import SlowMuscle, StraightRig


def pid(settings=None):
    return PidController(tabulate_static_inverse(StraightRig()), settings, 'straight/ppr')


def run(controller, muscle, reference_m, ticks):
    for _ in range(ticks):
        muscle.advance(controller.step(
            muscle.contraction_m, reference_m, 0.0, reference_m, 0.0,
            pressure_pa=muscle.pressure_pa))
    return muscle.contraction_m


def test_no_error_is_left_with_and_without_static_inverse():
    for settings in ({}, {'use_static_inverse': 1}):
        assert run(pid(settings), SlowMuscle(bias_pa=2e4), 0.01, 2000) == pytest.approx(
            0.01, abs=1e-6)


def test_integral_does_not_wind_up_at_the_limit():
    controller, muscle = pid({'use_static_inverse': 1}), SlowMuscle()
    run(controller, muscle, 0.2, 2000)           # far beyond what 600 kPa can hold
    values = dict(zip(controller.state_names, controller.state_values()))
    assert values['saturated_high'] == 1.0
    lowest = min(run(controller, muscle, 0.01, 1) for _ in range(600))
    assert lowest > 0.008                        # no long stay at the limit, no deep undershoot
    assert muscle.contraction_m == pytest.approx(0.01, abs=2e-4)


def test_starts_where_muscle_and_pressure_are():
    controller = pid()
    command = controller.step(0.005, 0.015, 0.0, 0.015, 0.0, pressure_pa=3.5e5)
    assert command == pytest.approx(3.5e5, abs=1.0)


def test_pressure_stays_between_atmosphere_and_limit():
    controller = pid({'slew_pa_per_s': 1e9})
    for x, r in ((0.0, 0.2), (0.03, 0.0), (0.0, 0.2)):
        for _ in range(50):
            assert 101325.0 <= controller.step(x, r, 0.0, r, 0.0) <= 701325.0

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

"""The integral trim: its growth with contraction, disturbances, and what does not wind it up."""

import numpy as np
from pam_actuation.control.sofc import dynamics
from pam_actuation.control.sofc.records import STATE
from pam_actuation.control.sofc.settings import PARAMETERS
from pam_sim.records import fields
from pam_sim.units import P_ATM_PA
import pytest
from straight_rig import SlowMuscle, sofc

BARE = {'feedback_gain_pa': 0.0, 'proportional_pa_per_m': 0.0, 'derivative_pa_s_per_m': 0.0,
        'start_time_s': 0.01}


def named(controller):
    """Return the values of the last tick by name."""
    return dict(zip(controller.state_names, controller.state_values()))


def parameters(controller):
    """Return the compiled parameters of a controller by name."""
    return fields(controller.parameters, PARAMETERS)


def test_the_integral_grows_with_contraction_within_bounds():
    par = parameters(sofc({'integral_growth_per_m': 12.0}))
    assert dynamics.load_shape(par, 0.015) == 1.0
    assert dynamics.load_shape(par, 0.025) == pytest.approx(1.12)
    assert dynamics.load_shape(par, 0.005) == pytest.approx(0.88)
    assert dynamics.load_shape(par, 1.0) == 2.0 and dynamics.load_shape(par, -1.0) == 0.5
    assert dynamics.load_shape(parameters(sofc()), 0.025) == 1.0


def test_what_the_integral_holds_counts_by_its_growth():
    controller = sofc({**BARE, 'integral_growth_per_m': 12.0, 'integral_pa_per_m_s': 1e8,
                       'slew_pa_per_s': 1e9})
    for _ in range(40):
        controller.step(0.0145, 0.015, 0.0, 0.015, 0.0, False, pressure_pa=P_ATM_PA + 3.5e5)
    trims = []
    for r in (0.005, 0.015, 0.025):
        command = controller.step(r, r, 0.0, r, 0.0, False)
        trims.append(command - P_ATM_PA - 2e5 - 1e7 * r)
        assert named(controller)['integral_pa'] == pytest.approx(trims[-1])
    assert trims[1] > 1e3
    assert np.array(trims) / trims[1] == pytest.approx([0.88, 1.0, 1.12])


def test_rules_exchanged_away_from_the_middle_make_no_step_either():
    controller = sofc({**BARE, 'integral_growth_per_m': 20.0, 'slew_pa_per_s': 1e9})
    for _ in range(60):
        before = controller.step(0.025, 0.025, 0.0, 0.025, 0.0, False)
    other = controller.rules.copy()
    other.feedforward += 2e4
    controller.replace_rules(other)
    assert controller.step(0.025, 0.025, 0.0, 0.025, 0.0, False) == pytest.approx(before, abs=1.0)


@pytest.mark.parametrize('growth', [0.0, 20.0])
def test_the_way_up_from_atmosphere_does_not_wind_the_integral(growth):
    """At the start the command slews; no error of the muscle has anything to do with it."""
    controller = sofc({**BARE, 'integral_growth_per_m': growth, 'slew_pa_per_s': 1e6})
    slewed = []
    for _ in range(100):
        controller.step(0.02, 0.02, 0.0, 0.02, 0.0, False, pressure_pa=P_ATM_PA)
        slewed.append(named(controller)['slew_limited'])
        # The trim a start takes over from the measured pressure is all there is.
        assert -1.01e4 * dynamics.load_shape(parameters(controller), 0.02) <= (
            named(controller)['integral_pa'])
    assert sum(slewed) > 50.0 and slewed[-1] == 0.0


def test_the_integral_still_gives_way_at_the_limit_of_pressure():
    controller = sofc({**BARE, 'max_pressure_gauge_pa': 3e5, 'integral_pa_per_m_s': 1e8})
    for _ in range(2000):
        controller.step(0.01, 0.02, 0.0, 0.02, 0.0, False, pressure_pa=P_ATM_PA + 3e5)
    assert named(controller)['saturated_high'] == 1.0
    # At rest 0.2 s x 1e8 Pa/(m s) x 10 mm beyond the limit, 1e5 Pa above the static inverse.
    assert named(controller)['integral_pa'] == pytest.approx(0.2 * 1e8 * 0.01 - 1e5, rel=0.02)


def disturbed(factor):
    """Return the RMSE [mm] of the movement after a step of the load."""
    controller = sofc({
        **BARE, 'surprise_ratio': 5.0, 'surprise_integral': factor, 'integral_pa_per_m_s': 2e7,
        'guard_window_s': 1.0, 'credit_delay_s': 0.05, 'lead_s': 0.09})
    muscle, errors = SlowMuscle(), []
    for k in range(4800):
        muscle.bias_pa = 2e4 if k >= 4400 else 0.0
        phase, ahead = (2.0 * np.pi * (k + n) / 400 for n in (0, 18))
        muscle.advance(controller.step(
            muscle.contraction_m, 0.014 - 0.004 * np.cos(phase), 0.004 * np.pi * np.sin(phase),
            0.014 - 0.004 * np.cos(ahead), 0.004 * np.pi * np.sin(ahead)))
        errors.append(named(controller)['error_m'])
    return 1e3 * np.sqrt(np.mean(np.square(errors[4400:])))


def test_a_disturbance_is_integrated_faster():
    assert disturbed(2.5) < 0.8 * disturbed(1.0)


def test_standing_still_for_long_leaves_no_denormal_number():
    controller = sofc({**BARE, 'acceleration_feedforward_pa_s2_per_m': 2e4})
    for k in range(60):
        controller.step(0.01, 0.01, 0.002 * k, 0.01, 0.002 * k, False)
    *_, state, _, _ = controller.compiled_arguments()
    assert abs(fields(state, STATE).acceleration_m_per_s2) > 0.1
    for _ in range(20000):
        controller.step(0.01, 0.01, 0.0, 0.01, 0.0, False)
        small = np.abs(state[state != 0.0])
        assert small.min() > np.finfo(float).tiny
    assert fields(state, STATE).acceleration_m_per_s2 == 0.0

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

"""Feed-forward of known dynamics, and jumps of the reference made smooth moves."""

import numpy as np
from pam_actuation.control.sofc import dynamics
from pam_sim.units import P_ATM_PA
import pytest
from straight_rig import sofc

STILL = {'integral_pa_per_m_s': 0.0, 'feedback_gain_pa': 0.0, 'proportional_pa_per_m': 0.0,
         'derivative_pa_s_per_m': 0.0, 'start_time_s': 0.01}


@pytest.mark.parametrize('form', [0.0, 1.0])
def test_a_move_starts_and_ends_at_rest_and_its_rate_is_its_slope(form):
    assert dynamics.to_go(0.01, 0.3, 0.3, form) == (0.01, 0.0, 0.0)
    assert dynamics.to_go(0.01, 0.0, 0.3, form) == (0.0, 0.0, 0.0)
    assert dynamics.to_go(0.01, 0.15, 0.3, form)[0] == pytest.approx(0.005)
    assert dynamics.to_go(0.01, 0.4, 0.3, form) == (0.01, 0.0, 0.0)        # has not begun
    left = np.linspace(0.3, 0.0, 301)
    rest = np.array([dynamics.to_go(0.01, t, 0.3, form) for t in left])
    assert np.allclose(np.gradient(-rest[:, 0], 1e-3)[1:-1], rest[1:-1, 1], atol=3e-5)
    assert np.allclose(np.gradient(rest[:, 1], 1e-3)[1:-1], rest[1:-1, 2], atol=5e-3)
    jerk = np.abs(np.diff(rest[:, 1], 2))
    first = jerk[0] / jerk.max()
    assert (first < 0.1) if form else (first > 0.9)


def commands(controller, references, lead=0):
    """Run a controller on an ideal muscle; return commands and errors."""
    found, errors = [], []
    for k, wanted in enumerate(references):
        ahead = references[min(k + lead, len(references) - 1)]
        found.append(controller.step(wanted, wanted, 0.0, ahead, 0.0, False))
        errors.append(dict(zip(controller.state_names, controller.state_values()))['error_m'])
    return np.array(found), np.array(errors)


def test_a_jump_of_the_reference_becomes_a_smooth_move_of_the_command():
    references = np.r_[np.full(40, 0.008), np.full(160, 0.018)]
    jumping, _ = commands(sofc({**STILL, 'slew_pa_per_s': 1e9}), references)
    smooth, _ = commands(sofc({**STILL, 'jump_time_s': 0.3, 'slew_pa_per_s': 1e9}), references)
    assert np.max(np.diff(jumping)) > 9e4
    assert np.max(np.diff(smooth[20:])) < 4e3
    assert smooth[-1] == pytest.approx(jumping[-1])
    assert np.all(np.diff(smooth[40:]) >= -1e-9)


def test_a_jump_that_was_not_seen_ahead_waits_one_preview():
    references = np.r_[np.full(40, 0.008), np.full(160, 0.018)]
    settings = {**STILL, 'jump_time_s': 0.3, 'lead_s': 0.1}
    # Error of a muscle that stands at the wanted value at once: what is still to go.
    _, unseen = commands(sofc(settings), references)
    _, seen = commands(sofc(settings), references, lead=20)
    assert unseen[41] == pytest.approx(-0.01, rel=1e-6)
    assert unseen[40 + 20] == pytest.approx(-0.01, rel=1e-3)
    assert unseen[40 + 20 + 30] == pytest.approx(-0.005, rel=0.05)
    assert seen[40 + 30] == pytest.approx(-0.005, rel=0.05)


@pytest.mark.parametrize('form', [0, 1])
def test_the_acceleration_of_a_move_made_of_a_jump_is_exact(form):
    inertia, move_s, begin = 2e4, 0.3, 40
    settings = {**STILL, 'acceleration_feedforward_pa_s2_per_m': inertia, 'slew_pa_per_s': 1e9,
                'acceleration_filter_s': 0.05, 'jump_time_s': move_s, 'jump_form': form}
    references = np.r_[np.full(begin, 0.008), np.full(100, 0.018)]
    still, _ = commands(sofc({**settings, 'acceleration_feedforward_pa_s2_per_m': 0.0}),
                        references)
    exact, _ = commands(sofc({**settings, 'jump_acceleration': 1}), references)
    filtered, _ = commands(sofc(settings), references)
    left_s = move_s - 0.005 * np.arange(100)
    wanted = [inertia * dynamics.to_go(0.01, t, move_s, form)[2] for t in left_s]
    assert (exact - still)[begin:] == pytest.approx(wanted, abs=1e-6 * inertia)
    assert np.max(np.abs(filtered - exact)) > 0.3 * np.max(np.abs(wanted))


def learned_at_rest(**more):
    """Return what feed-forward and motion rules learn at rest after a jump, in all [Pa]."""
    controller = sofc({
        **STILL, 'jump_time_s': 0.1, 'slew_pa_per_s': 1e9, 'credit_delay_s': 0.02,
        'feedforward_learning': 0.1, 'motion_learning': 0.1, 'guard_ratio': 0.0, **more})
    for k in range(200):
        wanted = 0.008 if k < 40 else 0.018
        # The move is over after 40 ticks, preview included.
        controller.step(wanted, wanted - 1e-4, 0.0, wanted, 0.0, k >= 100)
    return np.array([np.abs(controller.rules.feedforward).sum(),
                     np.abs(controller.rules.motion).sum()])


def test_standing_still_just_after_a_jump_counts_for_more_passes():
    usual = learned_at_rest()
    assert np.all(usual > 0.0)
    long, short = ({'settling_passes': 4.0, 'settling_time_s': time_s} for time_s in (10.0, 0.01))
    assert learned_at_rest(**long) == pytest.approx(4.0 * usual, rel=0.02)
    assert learned_at_rest(**short) == pytest.approx(usual, rel=0.02)


@pytest.mark.parametrize('name', ['motion_at_rest', 'jump_motion_learning'])
def test_motion_rules_learn_less_at_rest_after_a_jump(name):
    feedforward, motion = learned_at_rest()
    assert learned_at_rest(**{name: 0.25}) == pytest.approx([feedforward, 0.25 * motion], rel=0.02)
    assert learned_at_rest(**{name: 0.0})[1] == 0.0


def test_moving_takes_damping_mass_and_the_lag_of_the_valve():
    rate, slope = 0.02, 1e7
    settings = {**STILL, 'rate_feedforward_pa_s_per_m': 1e5, 'valve_lag_s': 0.05}
    controller = sofc(settings)
    for k in range(60):
        r = 0.005 + rate * k * 0.005
        command = controller.step(r, r, rate, r, rate, False, pressure_pa=P_ATM_PA + 2.5e5)
    static = P_ATM_PA + 2e5 + slope * r
    assert command - static == pytest.approx(1e5 * rate + 0.05 * slope * rate, rel=1e-3)
    controller = sofc({**STILL, 'acceleration_feedforward_pa_s2_per_m': 2e4})
    for k in range(100):
        t = k * 0.005
        r, v = 0.005 + 0.5 * 0.1 * t * t, 0.1 * t
        command = controller.step(r, r, v, r, v, False, pressure_pa=P_ATM_PA + 2.5e5)
    assert command - (P_ATM_PA + 2e5 + slope * r) == pytest.approx(2e4 * 0.1, rel=0.02)


def test_slope_of_the_static_inverse_is_positive_even_beyond_its_table():
    table = sofc().static_inverse
    assert dynamics.slope_pa_per_m(table, 0.01) == pytest.approx(1e7)
    assert dynamics.slope_pa_per_m(table, 1.0) == pytest.approx(0.2e7)

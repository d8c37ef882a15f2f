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

"""Inference by hand, performance index, credit and rule modification."""

import numpy as np
from pam_actuation.control.sofc import credit, learning
from pam_actuation.control.sofc.membership import locate
from pam_actuation.control.sofc.performance_index import index_linear, index_table, TABLE
from pam_actuation.control.sofc.records import ENTRY
from pam_actuation.control.sofc.rule_table import (
    contracting_share, infer_feedback, infer_feedforward, linear_feedback_table)
import pytest
from straight_rig import sofc


def test_inference_of_a_hand_computed_example():
    table = np.zeros((2, 7, 7))
    # Error 0.25 -> sets 3 and 4 with degrees 0.25 and 0.75; change -0.5 -> sets 1 and 2, half.
    table[0, 3, 1], table[0, 3, 2], table[0, 4, 1], table[0, 4, 2] = 0.4, -0.2, 0.8, 0.1
    table[1, 4, 2] = -1.0
    i, wi = locate(0.25, -1.0, 1.0, 7)
    j, wj = locate(-0.5, -1.0, 1.0, 7)
    assert (i, j) == (3, 1)
    assert wi == pytest.approx(0.75)
    assert wj == pytest.approx(0.5)
    up = 0.25 * (0.5 * 0.4 + 0.5 * -0.2) + 0.75 * (0.5 * 0.8 + 0.5 * 0.1)
    down = 0.75 * 0.5 * -1.0
    assert infer_feedback(table, 1.0, i, wi, j, wj) == pytest.approx(up)
    assert infer_feedback(table, 0.8, i, wi, j, wj) == pytest.approx(0.8 * up + 0.2 * down)


def test_linear_initial_table_is_a_plane():
    table = linear_feedback_table()
    for error in (-0.9, -0.31, 0.0, 0.44, 1.0):
        for change in (-1.0, 0.12, 0.77):
            i, wi = locate(error, -1.0, 1.0, 7)
            j, wj = locate(change, -1.0, 1.0, 7)
            expected = 0.5 * (error + change)
            assert infer_feedback(table, 0.3, i, wi, j, wj) == pytest.approx(expected)


def test_feedforward_rules_interpolate_between_knots_and_directions():
    table = np.array([[0.0, 10.0, 20.0], [0.0, -10.0, -20.0]])
    assert infer_feedforward(table, 1.0, 1, 0.25) == pytest.approx(12.5)
    assert infer_feedforward(table, 0.5, 1, 0.25) == pytest.approx(0.0)


def test_direction_changes_over_a_way_after_a_reversal_and_stays_at_rest():
    assert contracting_share(1.0, 1e-4, 1e-3) == 1.0
    assert contracting_share(1.0, -1e-3, 1e-3) == 0.0
    assert contracting_share(0.25, 0.0, 1e-3) == 0.25
    assert contracting_share(0.5, 2.5e-4, 1e-3) == pytest.approx(0.75)


def test_linear_index_is_zero_on_the_wanted_decay_and_bounded():
    assert index_linear(1e-3, -1e-3 / 0.06, 0.06, 2e-3) == pytest.approx(0.0, abs=1e-12)
    assert index_linear(0.5, 0.0, 0.06, 2e-3) == 2e-3
    assert index_linear(-0.5, 0.0, 0.06, 2e-3) == -2e-3


def test_tabulated_index_is_antisymmetric_and_reads_the_published_entries():
    assert np.array_equal(TABLE, -TABLE[::-1, ::-1])
    assert index_table(1.0, 1.0, 6.0) == 6.0
    assert index_table(2.0 / 6.0, 3.0 / 6.0, 6.0) == 3.0
    assert index_table(0.0, 0.0, 6.0) == 0.0
    assert index_table(-1.0, 0.0, 6.0) == -6.0


def test_credit_goes_to_the_rules_active_the_delay_ago():
    ring = np.zeros(credit.ring_rows(5, 0), ENTRY)
    for tick in range(23):
        entry = ring[credit.row_of(ring, tick, 0)]
        credit.push_feedback(entry, tick % 6, 0.1, 0, 0.0, 1.0)
        credit.push_feedforward(entry, tick % 9, 0.2, tick % 3, 0.3, tick % 4, 0.4)
        credit.push_outcome(entry, 0.5, 0.25, 1e7, 0.0, 1.0, 1e5 + tick)
        if tick >= 5:
            entry = ring[credit.row_of(ring, tick, 5)]
            assert entry.error_set == (tick - 5) % 6
            assert entry.reference_knot == (tick - 5) % 9
            assert entry.motion_knot == (tick - 5) % 3
            assert entry.motion_rate_knot == (tick - 5) % 4
            assert entry.motion_pass == 0.25
            assert entry.command_pa == 1e5 + tick - 5


def test_credit_kernel_sums_to_one_and_peaks_in_the_middle():
    for spread in (0, 1, 4):
        weights = [credit.kernel_weight(k, spread) for k in range(-spread, spread + 1)]
        assert sum(weights) == pytest.approx(1.0)
        assert max(weights) == weights[spread]


def test_only_active_rules_change_and_stay_in_bounds():
    table, initial = linear_feedback_table(), linear_feedback_table()
    for _ in range(400):
        learning.modify_feedback(table, initial, 1.0, 3, 0.5, 3, 0.25, 0.5, 0.0, 0.02)
    changed = np.argwhere(table != initial)
    assert {tuple(cell) for cell in changed} == {
        (0, 3, 3), (0, 3, 4), (0, 4, 3), (0, 4, 4)}
    assert table.max() == 1.0
    knots = np.zeros((2, 9))
    for _ in range(400):
        learning.modify_feedforward(knots, knots * 0, 0.0, 4, 0.5, -900.0, 0.0, 1e3, 5e3)
    assert set(np.flatnonzero(knots[1])) == {4, 5}
    assert not knots[0].any()
    assert knots.min() == -5e3


def test_change_per_tick_is_limited_and_leak_returns_to_the_initial_rule():
    table, initial = linear_feedback_table(), linear_feedback_table()
    learning.modify_feedback(table, initial, 1.0, 3, 0.0, 3, 0.0, 9.0, 0.0, 0.02)
    assert table[0, 3, 3] - initial[0, 3, 3] == pytest.approx(0.02)
    for _ in range(100):
        learning.modify_feedback(table, initial, 1.0, 3, 0.0, 3, 0.0, 0.0, 0.1, 0.02)
    assert table[0, 3, 3] == pytest.approx(initial[0, 3, 3], abs=1e-5)


def feed(controller, ticks, error_m, reference_m=0.01, rate=0.01, learn=True, **more):
    """Run ticks at a standing error; return the last values by name."""
    for _ in range(ticks):
        controller.step(reference_m - error_m, reference_m, rate, reference_m, rate, learn, **more)
    return dict(zip(controller.state_names, controller.state_values()))


QUIET = {'integral_pa_per_m_s': 0.0, 'credit_delay_s': 0.05, 'start_time_s': 0.01,
         'feedback_leak_per_m_s': 0.0}


def ramp(controller, start_m, rate, ticks, error_m, learn=True):
    """Run ticks along a ramp of the reference at a standing error."""
    for tick in range(ticks):
        r = start_m + rate * tick * 0.005
        controller.step(r - error_m, r, rate, r, rate, learn)


def test_a_standing_positive_error_raises_the_rules_that_fired():
    controller = sofc({**QUIET, 'pass_time_s': 100.0})
    controller.step(0.008, 0.008, 0.01, 0.008, 0.01)
    ramp(controller, 0.008, 0.01, 100, 5e-4)
    assert controller.rules.feedforward[0].max() > 0.0
    moved = np.flatnonzero(controller.rules.feedforward[0])
    knots = controller.rules.tables()[1].antecedents[1].knots[moved]
    assert np.all((knots > 0.008 - 0.00125) & (knots < 0.013 + 0.00125))
    positions, rates = np.nonzero(controller.rules.motion)
    knots = controller.rules.tables()[2].antecedents
    assert np.all(np.abs(knots[0].knots[positions] - 0.0105) < 0.0045)
    assert np.all(np.abs(knots[1].knots[rates] - 0.01) < 0.006)
    assert controller.rules.motion.min() >= 0.0
    assert (controller.rules.feedback >= controller.rules.feedback_initial).all()
    assert controller.rules.feedback_fired.sum() == pytest.approx(101.0)
    assert controller.rules.motion_fired.sum() == pytest.approx(101.0)


def test_a_pass_teaches_the_same_fast_or_slowly():
    taught = []
    for rate in (0.005, 0.02):
        controller = sofc({**QUIET, 'pass_time_s': 100.0, 'motion_learning': 0.0,
                           'guard_ratio': 0.0})
        controller.step(0.004, 0.004, rate, 0.004, rate)
        ramp(controller, 0.004, rate, round(0.02 / rate / 0.005), 1e-4)
        taught.append(controller.rules.feedforward[0, 10])
    assert taught[0] == pytest.approx(taught[1], rel=0.15)
    # 0.2 of 0.1 mm at 10 kPa/mm, less what the neighbouring knots take.
    assert taught[0] == pytest.approx(0.2 * 1e-4 * 1e7, rel=0.2)


def test_direction_survives_standing_still():
    controller = sofc({**QUIET, 'direction_blend_m': 1e-3})
    ramp(controller, 0.008, 0.01, 60, 0.0, learn=False)
    for _ in range(50):
        controller.step(0.011, 0.011, 0.0, 0.011, 0.0, False)
    values = dict(zip(controller.state_names, controller.state_values()))
    assert values['contracting_share'] == 1.0


def test_dead_zone_freeze_and_start_leave_the_rules_alone():
    for settings, learn, error_m, reason in (
            (QUIET, False, 5e-4, learning.FROZEN_OFF),
            ({**QUIET, 'dead_zone_m': 1e-3}, True, 5e-4, learning.FROZEN_DEAD_ZONE)):
        controller = sofc(settings)
        controller.step(0.01, 0.01, 0.01, 0.01, 0.01)
        values = feed(controller, 60, error_m, learn=learn)
        assert values['learning_reason'] == reason
        assert not controller.rules.feedforward.any()
    controller = sofc(QUIET)
    controller.freeze_learning = True
    controller.step(0.01, 0.01, 0.01, 0.01, 0.01)
    assert feed(controller, 60, 5e-4)['learning_reason'] == learning.FROZEN_OFF
    controller = sofc(QUIET)
    assert feed(controller, 3, 5e-4)['learning_reason'] == learning.FROZEN_START


def test_learning_freezes_on_saturation_slack_valve_and_reference_jump():
    controller = sofc({**QUIET, 'max_pressure_gauge_pa': 1e5})
    controller.step(0.01, 0.01, 0.01, 0.01, 0.01)
    values = feed(controller, 60, 5e-4)
    assert values['learning_reason'] == learning.FROZEN_SATURATED
    assert values['saturated_high'] == 1.0
    controller = sofc(QUIET)
    controller.step(0.01, 0.01, 0.01, 0.01, 0.01)
    assert feed(controller, 60, 5e-4, force_n=0.1)['learning_reason'] == learning.FROZEN_SLACK
    values = feed(controller, 60, 5e-4, pressure_pa=101325.0)
    assert values['learning_reason'] == learning.FROZEN_VALVE
    assert not controller.rules.feedforward.any()
    values = feed(controller, 1, 5e-4, reference_m=0.02)
    assert values['learning_reason'] == learning.FROZEN_JUMP


def test_rules_that_were_active_in_a_jump_are_not_told_as_a_limit():
    for revision, told in ((1.0, learning.FROZEN_JUMP), (0.0, learning.FROZEN_SATURATED)):
        controller = sofc({**QUIET, 'revision': revision})
        controller.step(0.01, 0.01, 0.01, 0.01, 0.01)
        feed(controller, 60, 5e-4)
        reasons = {feed(controller, 1, 5e-4, reference_m=0.0115)['learning_reason']
                   for _ in range(200)}
        assert reasons == {learning.FROZEN_JUMP, learning.LEARNING, told}


def test_an_error_out_of_proportion_is_left_to_the_integral():
    controller = sofc({**QUIET, 'surprise_ratio': 10.0, 'guard_window_s': 1.0})
    for k in range(1200):
        phase = 2.0 * np.pi * k / 200
        r, v = 0.014 - 0.004 * np.cos(phase), 0.004 * np.sin(phase) * 2.0 * np.pi
        controller.step(r - 5e-5, r, v, r, v)
    before = controller.rules.motion.copy()
    values = feed(controller, 20, 5e-3, reference_m=r, rate=v)
    assert values['window_rms_error_m'] == pytest.approx(5e-5, rel=0.1)
    assert values['learning_reason'] == learning.FROZEN_SURPRISE
    assert np.array_equal(before, controller.rules.motion)


def test_rules_take_over_what_the_integral_adds_within_a_movement():
    taught = []
    for share in (0.0, 0.5):
        controller = sofc({**QUIET, 'integral_pa_per_m_s': 1e7, 'takeover': share})
        for k in range(400):
            phase = 2.0 * np.pi * k / 400
            r, v = 0.014 - 0.004 * np.cos(phase), 0.004 * np.sin(phase) * np.pi
            # A measured pressure lets it begin without slewing up from atmosphere.
            controller.step(r - 1e-4, r, v, r, v, pressure_pa=101325.0 + 2e5 + 1e7 * r)
        taught.append(controller.rules.motion.max())
    assert taught[1] > 1.2 * taught[0] > 0.0


def test_every_table_describes_itself():
    controller = sofc()
    tables = {table.name: table for table in controller.rules.tables()}
    assert set(tables) == {'feedback', 'feedforward', 'motion'}
    for name, table in tables.items():
        assert table.values is getattr(controller.rules, name)
        assert table.values.shape == tuple(len(a.knots) for a in table.antecedents)
        assert table.initial.shape == table.fired.shape == table.values.shape
    assert tables['feedforward'].antecedents[1].knots[-1] == 0.03
    assert tables['motion'].antecedents[1].knots[0] == pytest.approx(-0.12)
    assert tables['feedback'].scale == controller.settings['feedback_gain_pa']


def test_gaussian_sets_change_the_output_between_the_peaks_only():
    outputs = {}
    for form in (0.0, 1.0):
        controller = sofc({**QUIET, 'membership_form': form, 'proportional_pa_per_m': 0.0})
        controller.rules.feedback[...] = np.arange(7.0)[None, :, None] ** 2 / 36.0 - 0.5
        for error in (0.0, 2e-3 / 9.0):
            controller.pause()
            values = feed(controller, 40, error, learn=False, pressure_pa=4e5)
            outputs[form, error] = values['feedback_rules_pa']
    assert outputs[0.0, 0.0] == pytest.approx(outputs[1.0, 0.0])
    assert abs(outputs[0.0, 2e-3 / 9.0] - outputs[1.0, 2e-3 / 9.0]) > 20.0


def test_output_never_leaves_the_limits_and_the_slew():
    controller = sofc({'slew_pa_per_s': 1e6})
    former = 101325.0
    random = np.random.default_rng(1)
    for _ in range(500):
        reference = random.uniform(-0.05, 0.2)
        command = controller.step(random.uniform(0.0, 0.03), reference, 0.0, reference, 0.0)
        assert 101325.0 <= command <= 701325.0
        assert abs(command - former) <= 1e6 * 0.005 * (1 + 1e-9)
        former = command


def test_exchange_of_rules_makes_no_step_in_the_command():
    controller = sofc()
    for _ in range(100):
        before = controller.step(0.0098, 0.01, 0.0, 0.01, 0.0, learn=False)
    other = controller.rules.copy()
    other.feedforward += 2e4
    other.feedback[...] = 0.3
    controller.replace_rules(other)
    after = controller.step(0.0098, 0.01, 0.0, 0.01, 0.0, learn=False)
    assert abs(after - before) < 500.0
    assert controller.rules_replaced == 1

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

"""Places in the vectors of the controllers belong to the names they are given elsewhere."""

from pam_actuation.control.sofc import layout
from pam_actuation.control.sofc.settings import parameter_vector, SETTINGS

PARAMETERS = {
    'P_RATE': 'rate_hz',
    'P_LEAD': 'lead_s',
    'P_ERROR_UNIVERSE': 'error_universe_m',
    'P_CHANGE_UNIVERSE': 'change_universe_m_per_s',
    'P_FEEDBACK_GAIN': 'feedback_gain_pa',
    'P_PROPORTIONAL': 'proportional_pa_per_m',
    'P_INTEGRAL': 'integral_pa_per_m_s',
    'P_DERIVATIVE': 'derivative_pa_s_per_m',
    'P_INTEGRAL_LIMIT': 'integral_limit_pa',
    'P_INTEGRAL_GROWTH': 'integral_growth_per_m',
    'P_ANTI_WINDUP_TIME': 'anti_windup_time_s',
    'P_CHANGE_FILTER': 'change_filter_s',
    'P_DIRECTION_BLEND': 'direction_blend_m',
    'P_INDEX_FORM': 'index_form',
    'P_INDEX_TAU': 'index_tau_s',
    'P_INDEX_LIMIT': 'index_limit_m',
    'P_DEAD_ZONE': 'dead_zone_m',
    'P_CREDIT_DELAY': 'credit_delay_s',
    'P_CREDIT_SPREAD': 'credit_spread_s',
    'P_LEARNING_RATE': 'learning_rate',
    'P_FEEDBACK_LEARNING': 'feedback_learning_per_m_s',
    'P_FEEDFORWARD_LEARNING': 'feedforward_learning',
    'P_FEEDBACK_STEP_LIMIT': 'feedback_step_limit',
    'P_FEEDFORWARD_STEP_LIMIT': 'feedforward_step_limit_pa',
    'P_FEEDFORWARD_LIMIT': 'feedforward_limit_pa',
    'P_FEEDBACK_LEAK': 'feedback_leak_per_m_s',
    'P_FEEDFORWARD_LEAK': 'feedforward_leak_per_m_s',
    'P_REFERENCE_LOWER': 'reference_lower_m',
    'P_REFERENCE_UPPER': 'reference_upper_m',
    'P_REFERENCE_KNOTS': 'reference_knots',
    'P_MIN_PRESSURE_GAUGE': 'min_pressure_gauge_pa',
    'P_MAX_PRESSURE_GAUGE': 'max_pressure_gauge_pa',
    'P_MOTION_LEARNING': 'motion_learning',
    'P_PASS_TIME': 'pass_time_s',
    'P_TAKEOVER': 'takeover',
    'P_TAKEOVER_TIME': 'takeover_time_s',
    'P_CORRECTION': 'correction_pa_per_m',
    'P_MOTION_POSITION_KNOTS': 'motion_position_knots',
    'P_MOTION_RATE_KNOTS': 'motion_rate_knots',
    'P_MOTION_RATE_UPPER': 'motion_rate_upper_m_per_s',
    'P_MOTION_RATE_FINE': 'motion_rate_fine_m_per_s',
    'P_MEMBERSHIP_FORM': 'membership_form',
    'P_MEMBERSHIP_WIDTH': 'membership_width',
    'P_VALVE_LAG': 'valve_lag_s',
    'P_RATE_FEEDFORWARD': 'rate_feedforward_pa_s_per_m',
    'P_ACCELERATION_FEEDFORWARD': 'acceleration_feedforward_pa_s2_per_m',
    'P_ACCELERATION_FILTER': 'acceleration_filter_s',
    'P_JUMP_TIME': 'jump_time_s',
    'P_GUARD_RATIO': 'guard_ratio',
    'P_SURPRISE': 'surprise_ratio',
    'P_SURPRISE_INTEGRAL': 'surprise_integral',
    'P_ANNEAL': 'anneal',
    'P_ANNEAL_FLOOR': 'anneal_floor',
    'P_GUARD_WINDOW': 'guard_window_s',
    'P_SLEW': 'slew_pa_per_s',
    'P_START_TIME': 'start_time_s',
    'P_JUMP': 'jump_m',
    'P_JUMP_FREEZE': 'jump_freeze_s',
    'P_SLACK_FORCE': 'slack_force_n',
    'P_VALVE_GAP': 'valve_gap_pa',
    'P_JUMP_FORM': 'jump_form',
    'P_SETTLING_PASSES': 'settling_passes',
    'P_SETTLING_TIME': 'settling_time_s',
    'P_MOTION_AT_REST': 'motion_at_rest',
    'P_JUMP_MOTION_LEARNING': 'jump_motion_learning',
}
OUTPUTS = {
    'O_COMMAND': 'command_pa',
    'O_ERROR': 'error_m',
    'O_CHANGE': 'change_of_error_m_per_s',
    'O_INVERSE': 'inverse_pa',
    'O_DYNAMIC': 'dynamic_feedforward_pa',
    'O_FEEDBACK': 'feedback_rules_pa',
    'O_FEEDFORWARD': 'feedforward_rules_pa',
    'O_MOTION': 'motion_rules_pa',
    'O_PROPORTIONAL': 'proportional_pa',
    'O_INTEGRAL': 'integral_pa',
    'O_DERIVATIVE': 'derivative_pa',
    'O_UNLIMITED': 'unlimited_command_pa',
    'O_SAT_LOW': 'saturated_low',
    'O_SAT_HIGH': 'saturated_high',
    'O_SAT_SLEW': 'slew_limited',
    'O_SHARE': 'contracting_share',
    'O_ERROR_SET': 'error_set',
    'O_ERROR_DEGREE': 'error_degree',
    'O_CHANGE_SET': 'change_set',
    'O_CHANGE_DEGREE': 'change_degree',
    'O_KNOT': 'reference_knot',
    'O_KNOT_DEGREE': 'reference_knot_degree',
    'O_MOTION_KNOT': 'motion_knot',
    'O_MOTION_KNOT_DEGREE': 'motion_knot_degree',
    'O_RATE_KNOT': 'motion_rate_knot',
    'O_RATE_KNOT_DEGREE': 'motion_rate_knot_degree',
    'O_INDEX': 'performance_index_m',
    'O_REASON': 'learning_reason',
    'O_CREDIT': 'credited_tick_valid',
    'O_FEEDBACK_NORM': 'feedback_rule_change_norm_pa',
    'O_FEEDFORWARD_NORM': 'feedforward_rule_change_norm_pa',
    'O_MOTION_NORM': 'motion_rule_change_norm_pa',
    'O_OFFSET': 'start_offset_m',
    'O_JUMP': 'jump_to_go_m',
    'O_WINDOW': 'window_rms_error_m',
    'O_BEST': 'best_window_rms_error_m',
    'O_RATE_FACTOR': 'learning_rate_factor',
    'O_ROLLED_BACK': 'times_rolled_back',
}


def test_every_setting_reaches_the_place_of_its_own_name():
    values = {setting.name: 1.0 + i for i, setting in enumerate(SETTINGS)}
    vector = parameter_vector(values)
    assert sorted(PARAMETERS.values()) == sorted(values)
    for place, name in PARAMETERS.items():
        assert vector[getattr(layout, place)] == values[name], place


def test_every_output_is_published_under_its_own_name():
    assert sorted(OUTPUTS.values()) == sorted(layout.STATE_NAMES)
    for place, name in OUTPUTS.items():
        assert layout.STATE_NAMES[getattr(layout, place)] == name, place

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

"""Places of parameters, states and outputs in the vectors of the compiled controller."""

# Parameters, in the order of settings.SETTINGS, then what is derived from them.
P_RATE = 0
P_LEAD = 1
P_ERROR_UNIVERSE = 2
P_CHANGE_UNIVERSE = 3
P_FEEDBACK_GAIN = 4
P_PROPORTIONAL = 5
P_INTEGRAL = 6
P_DERIVATIVE = 7
P_INTEGRAL_LIMIT = 8
P_INTEGRAL_GROWTH = 9
P_ANTI_WINDUP_TIME = 10
P_CHANGE_FILTER = 11
P_DIRECTION_BLEND = 12
P_INDEX_FORM = 13
P_INDEX_TAU = 14
P_INDEX_LIMIT = 15
P_DEAD_ZONE = 16
P_CREDIT_DELAY = 17
P_CREDIT_SPREAD = 18
P_LEARNING_RATE = 19
P_FEEDBACK_LEARNING = 20
P_FEEDFORWARD_LEARNING = 21
P_FEEDBACK_STEP_LIMIT = 22
P_FEEDFORWARD_STEP_LIMIT = 23
P_FEEDFORWARD_LIMIT = 24
P_FEEDBACK_LEAK = 25
P_FEEDFORWARD_LEAK = 26
P_REFERENCE_LOWER = 27
P_REFERENCE_UPPER = 28
P_REFERENCE_KNOTS = 29
P_MIN_PRESSURE_GAUGE = 30
P_MAX_PRESSURE_GAUGE = 31
P_MOTION_LEARNING = 32
P_PASS_TIME = 33
P_TAKEOVER = 34
P_TAKEOVER_TIME = 35
P_CORRECTION = 36
P_MOTION_POSITION_KNOTS = 37
P_MOTION_RATE_KNOTS = 38
P_MOTION_RATE_UPPER = 39
P_MOTION_RATE_FINE = 40
P_MEMBERSHIP_FORM = 41
P_MEMBERSHIP_WIDTH = 42
P_VALVE_LAG = 43
P_RATE_FEEDFORWARD = 44
P_ACCELERATION_FEEDFORWARD = 45
P_ACCELERATION_FILTER = 46
P_JUMP_TIME = 47
P_GUARD_RATIO = 48
P_SURPRISE = 49
P_SURPRISE_INTEGRAL = 50
P_ANNEAL = 51
P_ANNEAL_FLOOR = 52
P_GUARD_WINDOW = 53
P_SLEW = 54
P_START_TIME = 55
P_JUMP = 56
P_JUMP_FREEZE = 57
P_SLACK_FORCE = 58
P_VALVE_GAP = 59
P_JUMP_FORM = 60
P_SETTLING_PASSES = 61
P_SETTLING_TIME = 62
P_MOTION_AT_REST = 63
P_JUMP_MOTION_LEARNING = 64
P_PERIOD = 65
P_DELAY = 66
P_SPREAD = 67
P_ANSWER = 68
PARAMETER_COUNT = 69

# State carried from tick to tick.
S_TICK = 0
S_STARTED = 1
S_OFFSET = 2
S_CONTRACTION = 3
S_RATE = 4
S_INTEGRAL = 5
S_OUTPUT = 6
S_REFERENCE = 7
S_LEAD_REFERENCE = 8
S_FREEZE_LEFT = 9
S_HISTORY = 10
S_LEAD_RATE = 11
S_ACCELERATION = 12
S_QUASI_STATIC = 13
S_JUMP = 14
S_JUMP_LEFT = 15
S_LEAD_JUMP = 16
S_LEAD_JUMP_LEFT = 17
S_PLACE = 18
S_MOTION_PLACE = 19
S_RATE_PLACE = 20
S_MOVING = 21
S_WINDOW_TICKS = 22
S_WINDOW_SQUARES = 23
S_WINDOW_TRAVEL = 24
S_TURNS = 25
S_BEST = 26
S_BEST_SPEED = 27
S_FORMER = 28
S_BAD_WINDOWS = 29
S_RATE_FACTOR = 30
S_ROLLED_BACK = 31
S_EXPECTED = 32
S_SHARE = 33
S_LEAD = 34
S_RATE_CEILING = 35
S_FIRST_BAD = 36
S_INTEGRAL_MEAN = 37
S_INTEGRAL_SHAPE = 38
S_SETTLING_LEFT = 39
S_JUMPED = 40
S_ERROR = 41
STATE_COUNT = 42

# Outputs of one tick; STATE_NAMES are their names on topic controller_state.
O_COMMAND = 0
O_ERROR = 1
O_CHANGE = 2
O_INVERSE = 3
O_DYNAMIC = 4
O_FEEDBACK = 5
O_FEEDFORWARD = 6
O_MOTION = 7
O_PROPORTIONAL = 8
O_INTEGRAL = 9
O_DERIVATIVE = 10
O_UNLIMITED = 11
O_SAT_LOW = 12
O_SAT_HIGH = 13
O_SAT_SLEW = 14
O_SHARE = 15
O_ERROR_SET = 16
O_ERROR_DEGREE = 17
O_CHANGE_SET = 18
O_CHANGE_DEGREE = 19
O_KNOT = 20
O_KNOT_DEGREE = 21
O_MOTION_KNOT = 22
O_MOTION_KNOT_DEGREE = 23
O_RATE_KNOT = 24
O_RATE_KNOT_DEGREE = 25
O_INDEX = 26
O_REASON = 27
O_CREDIT = 28
O_FEEDBACK_NORM = 29
O_FEEDFORWARD_NORM = 30
O_MOTION_NORM = 31
O_OFFSET = 32
O_JUMP = 33
O_WINDOW = 34
O_BEST = 35
O_RATE_FACTOR = 36
O_ROLLED_BACK = 37
OUTPUT_COUNT = 38

STATE_NAMES = (
    'command_pa', 'error_m', 'change_of_error_m_per_s', 'inverse_pa',
    'dynamic_feedforward_pa', 'feedback_rules_pa', 'feedforward_rules_pa', 'motion_rules_pa',
    'proportional_pa', 'integral_pa', 'derivative_pa', 'unlimited_command_pa',
    'saturated_low', 'saturated_high', 'slew_limited', 'contracting_share', 'error_set',
    'error_degree', 'change_set', 'change_degree', 'reference_knot', 'reference_knot_degree',
    'motion_knot', 'motion_knot_degree', 'motion_rate_knot', 'motion_rate_knot_degree',
    'performance_index_m', 'learning_reason', 'credited_tick_valid',
    'feedback_rule_change_norm_pa', 'feedforward_rule_change_norm_pa',
    'motion_rule_change_norm_pa', 'start_offset_m', 'jump_to_go_m', 'window_rms_error_m',
    'best_window_rms_error_m', 'learning_rate_factor', 'times_rolled_back')

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
P_ANTI_WINDUP_TIME = 9
P_CHANGE_FILTER = 10
P_DIRECTION_BLEND = 11
P_INDEX_FORM = 12
P_INDEX_TAU = 13
P_INDEX_LIMIT = 14
P_DEAD_ZONE = 15
P_CREDIT_DELAY = 16
P_CREDIT_SPREAD = 17
P_LEARNING_RATE = 18
P_FEEDBACK_LEARNING = 19
P_FEEDFORWARD_LEARNING = 20
P_FEEDBACK_STEP_LIMIT = 21
P_FEEDFORWARD_STEP_LIMIT = 22
P_FEEDFORWARD_LIMIT = 23
P_FEEDBACK_LEAK = 24
P_FEEDFORWARD_LEAK = 25
P_REFERENCE_LOWER = 26
P_REFERENCE_UPPER = 27
P_REFERENCE_KNOTS = 28
P_MIN_PRESSURE_GAUGE = 29
P_MAX_PRESSURE_GAUGE = 30
P_SLEW = 31
P_START_TIME = 32
P_JUMP = 33
P_JUMP_FREEZE = 34
P_SLACK_FORCE = 35
P_VALVE_GAP = 36
P_PERIOD = 37
P_DELAY = 38
P_SPREAD = 39
PARAMETER_COUNT = 40

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
STATE_COUNT = 11

# Outputs of one tick; STATE_NAMES are their names on topic controller_state.
O_COMMAND = 0
O_ERROR = 1
O_CHANGE = 2
O_INVERSE = 3
O_FEEDBACK = 4
O_FEEDFORWARD = 5
O_PROPORTIONAL = 6
O_INTEGRAL = 7
O_DERIVATIVE = 8
O_UNLIMITED = 9
O_SAT_LOW = 10
O_SAT_HIGH = 11
O_SAT_SLEW = 12
O_SHARE = 13
O_ERROR_SET = 14
O_ERROR_DEGREE = 15
O_CHANGE_SET = 16
O_CHANGE_DEGREE = 17
O_KNOT = 18
O_KNOT_DEGREE = 19
O_INDEX = 20
O_REASON = 21
O_CREDIT = 22
O_FEEDBACK_NORM = 23
O_FEEDFORWARD_NORM = 24
O_OFFSET = 25
OUTPUT_COUNT = 26

STATE_NAMES = (
    'command_pa', 'error_m', 'change_of_error_m_per_s', 'inverse_pa', 'feedback_rules_pa',
    'feedforward_rules_pa', 'proportional_pa', 'integral_pa', 'derivative_pa',
    'unlimited_command_pa', 'saturated_low', 'saturated_high', 'slew_limited',
    'contracting_share', 'error_set', 'error_degree', 'change_set', 'change_degree',
    'reference_knot', 'reference_knot_degree', 'performance_index_m', 'learning_reason',
    'credited_tick_valid', 'feedback_rule_change_norm_pa', 'feedforward_rule_change_norm_pa',
    'start_offset_m')

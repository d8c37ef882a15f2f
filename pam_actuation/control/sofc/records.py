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

"""State and outputs of the compiled controller, and what it remembers of one tick."""

from pam_actuation.control.sofc.muscle_model import MODEL
from pam_actuation.control.sofc.valve_lag import LAG
from pam_sim.records import record

# Which rules are active: of two neighbouring sets or knots the lower one, and the degree
# of the upper one.
ACTIVE_RULES = (
    'contracting_share',              # degree of direction 'contracting'
    'error_set', 'error_degree',
    'change_set', 'change_degree',
    'reference_knot', 'reference_knot_degree',              # of the feed-forward rules
    'motion_knot', 'motion_knot_degree',                    # of the motion rules: position
    'motion_rate_knot', 'motion_rate_knot_degree',          # and rate
)
# What a tick was told of the reference one preview ahead: as it was given, less its jumps; then
# what is used of it, and of that the move made of a jump.
TOLD = ('told_m', 'told_rate_m_per_s', 'lead_m', 'lead_rate_m_per_s', 'lead_move_m_per_s',
        'lead_move_m_per_s2', 'bend_m_per_s2')
# What of the past an exchange of rules leaves as it was.
KNOWN = ('command_pa', *TOLD)
# One tick in the credit memory.
ENTRY = record(
    *ACTIVE_RULES,
    'feedforward_pass',               # part of a pass this tick was, for the feed-forward rules
    'motion_pass',                    # the same for the motion rules
    'correction_pa_per_m',            # pressure that mends an index of 1 m there
    'valid',                          # 1, else less the reason why its rules get no credit
    *KNOWN,
    'index_m',                        # performance index, 0 where nothing was learned
    'integral_deviation_pa',          # of the integral from its mean
)
# A jump of the reference on its way as a smooth move.
MOVE = record('size_m', 'left_s')
# What the guard collects over a window of movements to and fro.
WINDOW = record(
    'ticks',
    'squares_m2',                     # sum of squared errors
    'speeds_m_per_s',                 # sum of the sizes of the rate
    'turns',                          # of the reference
)
STATE = record(
    'tick',
    'started',                        # 1 after the first tick
    'history_ticks',                  # since the start, or since the rules were exchanged
    # Of the tick before.
    'contraction_m',
    'reference_m',
    'reference_rate_m_per_s',
    'lead_reference_m',
    'gap_s',                          # before this tick: a period, or more after a late one
    'error_m',
    'command_pa',
    'jumps_m',                        # sum of those of the lead reference
    'lead_ticks',                     # since the start, of lead references
    'lead_m',                         # lead reference without what is to go of a move
    'contracting_share',
    'knot_place',                     # of the lead reference among the feed-forward knots
    'motion_knot_place',              # the same among those of the motion rules
    'motion_rate_place',
    # Filters.
    'change_m_per_s',                 # of the error
    'lead_rate_m_per_s',
    'acceleration_m_per_s2',          # of the lead reference
    'moves_m_per_s',                  # rate of the lead reference, with that of a move
    'moves_m_per_s2',                 # the same of its acceleration
    'quasi_static_pa',                # pressure without the lag of the valve
    'expected_pa',                    # pressure to be measured
    'arriving_pa_per_s',              # its rate of change
    ('lag', LAG),                     # of the valve
    'integral_pa',
    'integral_mean_pa',
    'integral_shape',                 # part of the integral that counts at this contraction
    # Start, jumps, pauses of learning.
    'offset_m',                       # of the reference, from the bumpless start
    ('move', MOVE),                   # of the reference
    ('lead_move', MOVE),              # of the lead reference
    'jumped',                         # 1 from a jump until the reference moves by itself
    'told_m2_per_s2',                 # mean square of what previews told beyond the present rate
    'untold_m2_per_s2',               # the same of what came and was not told
    'announced',                      # 0 to 1, share of the first
    'bend_m_per_s2',                  # acceleration of the reference, filtered
    'bend_m2_per_s2',                 # mean square of what it made expect of the rate
    'bent_m2_per_s2',                 # the same times what became of the rate
    'surprising',                     # 1 where that jump is one as if nobody had announced it
    'rules_share',                    # of feed-forward and motion rules that acts
    'rules_pa',                       # of both, in full, as pressure of the integral
    'balance_pa',                     # part of the integral that only undoes them
    'settling_left_s',
    'freeze_left_s',
    ('model', MODEL),                 # of the muscle
    # Guard.
    ('window', WINDOW),
    'direction',                      # sign of the last movement of the reference
    'best_rms_m',
    'best_speed_m_per_s',
    'former_rms_m',
    'bad_windows',
    'first_bad_rms_m',
    'unproven',                       # 1 until rules that were restored do as well as before
    'rate_factor',                    # of learning, by annealing
    'rate_ceiling',                   # the same, by roll-backs
    'times_rolled_back',
    'rolled_back',                    # 1 until the rules are exchanged from outside
)
# Of a controller with a model of the muscle; the last of ``OUTPUT``.
MODEL_OUTPUTS = (
    'path_rules_pa', 'disturbance_pa', 'predicted_feedback_pa', 'path_rule_change_norm_pa')
# The names on topic ``controller_state``.
OUTPUT = record(
    'command_pa', 'error_m', 'change_of_error_m_per_s', 'inverse_pa', 'dynamic_feedforward_pa',
    'feedback_rules_pa', 'feedforward_rules_pa', 'motion_rules_pa', 'proportional_pa',
    'integral_pa', 'derivative_pa', 'unlimited_command_pa', 'saturated_low', 'saturated_high',
    'slew_limited', *ACTIVE_RULES, 'performance_index_m', 'learning_reason',
    'credited_tick_valid', 'feedback_rule_change_norm_pa', 'feedforward_rule_change_norm_pa',
    'motion_rule_change_norm_pa', 'start_offset_m', 'jump_to_go_m', 'window_rms_error_m',
    'best_window_rms_error_m', 'learning_rate_factor', 'times_rolled_back',
    *MODEL_OUTPUTS)

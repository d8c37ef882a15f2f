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

"""
Settings of the self-organizing fuzzy controller and the record its compiled code reads.

A setting is one entry of ``SETTINGS``; its field in ``PARAMETERS``, its key, default and
range in files follow from it.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from pam_actuation.control.controller_text import INDEX_FORMS
from pam_actuation.control.settings import parameter_record, setting, switch
from pam_actuation.control.sofc.path_memory import path_widths_m
from pam_actuation.control.sofc.rule_text import MOST_SETS
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.records import values_of
from pam_sim.units import allowed_range

SETTINGS = (
    setting('rate_hz', 'Hz', 200.0, 20.0, 1000.0, 'control rate'),
    setting('lead_s', 's', 0.1, 0.0, 0.5, 'preview: how far ahead the reference is taken'),
    setting('error_universe_m', 'm', 2e-3, 1e-5, 0.1, 'error at which the outer set is full'),
    setting('change_universe_m_per_s', 'm/s', 0.04, 1e-4, 2.0, 'same for the change of error'),
    setting('feedback_gain_pa', 'Pa', 6e3, 0.0, 2e5, 'pressure of a feedback rule of value 1'),
    setting('proportional_pa_per_m', 'Pa/m', 8e5, 0.0, 5e7, 'proportional trim'),
    setting('integral_pa_per_m_s', 'Pa/(m s)', 1.2e7, 0.0, 1e9, 'integral trim'),
    setting('derivative_pa_s_per_m', 'Pa s/m', 8e4, 0.0, 5e6, 'derivative trim'),
    setting('integral_limit_pa', 'Pa', 1.5e5, 0.0, 8e5, 'bound of the integral'),
    setting('integral_growth_per_m', '1/m', 0.0, 0.0, 30.0,
            'growth of the integral with contraction, as the pressure of a load grows'),
    setting('anti_windup_time_s', 's', 0.2, 0.01, 10.0, 'back-calculation time constant'),
    setting('change_filter_s', 's', 0.02, 0.0, 0.5, 'low pass on the change of error'),
    setting('direction_blend_m', 'm', 3e-4, 1e-6, 0.1,
            'way after a reversal over which one direction takes over from the other'),
    switch('index_form', 0.0, INDEX_FORMS,
           'performance index: linear, or the 13-level table'),
    setting('index_tau_s', 's', 0.06, 0.0, 2.0, 'wanted decay time of the error'),
    setting('index_limit_m', 'm', 2e-3, 1e-6, 0.1, 'bound of the performance index'),
    setting('dead_zone_m', 'm', 1e-5, 0.0, 0.01, 'no learning below this error'),
    setting('credit_delay_s', 's', 0.09, 0.0, 1.0, 'how long ago the blamed rules were active'),
    setting('credit_spread_s', 's', 0.0, 0.0, 0.2, 'half width of the credit kernel'),
    setting('learning_rate', '-', 1.0, 0.0, 10.0, 'common factor of all rule changes'),
    setting('feedback_learning_per_m_s', '1/(m s)', 2e3, 0.0, 1e6,
            'change of a feedback rule per index and time'),
    setting('feedforward_learning', '-', 0.2, 0.0, 2.0,
            'share of the index a feed-forward rule mends per pass of the reference'),
    setting('feedback_step_limit', '-', 0.02, 0.0, 1.0, 'largest change per tick'),
    setting('feedforward_step_limit_pa', 'Pa', 1e3, 0.0, 1e5, 'largest change per tick'),
    setting('feedforward_limit_pa', 'Pa', 1.2e5, 0.0, 6e5, 'bound of a feed-forward rule'),
    setting('feedback_leak_per_m_s', '1/(m s)', 20.0, 0.0, 1e4,
            'forgetting of visited feedback rules per index and time'),
    setting('feedforward_leak_per_m_s', '1/(m s)', 0.0, 0.0, 1e4,
            'forgetting of visited feed-forward rules per index and time'),
    setting('reference_lower_m', 'm', 0.0, -0.05, 0.2, 'first knot of the feed-forward rules'),
    setting('reference_upper_m', 'm', 0.03, 0.001, 0.3, 'last knot of the feed-forward rules'),
    setting('reference_knots', '-', 25.0, 3.0, 401.0, 'number of knots'),
    setting('min_pressure_gauge_pa', 'Pa', 0.0, 0.0, 6e5, 'lowest command'),
    setting('max_pressure_gauge_pa', 'Pa', 6e5, 1e3, 1e6, 'highest command'),
    setting('motion_learning', '-', 0.4, 0.0, 2.0,
            'share of the index a motion rule mends per pass of the reference'),
    setting('pass_time_s', 's', 0.5, 0.05, 100.0,
            'standing still for so long counts as one pass'),
    setting('takeover', '-', 0.0, 0.0, 2.0,
            'share of what the integral adds within a movement that the rules take over'),
    setting('takeover_time_s', 's', 1.0, 0.05, 100.0,
            'what the integral adds for longer is its own'),
    setting('correction_pa_per_m', 'Pa/m', 0.0, 0.0, 1e9,
            'pressure that mends an index of 1 m; 0 = slope of the static inverse'),
    setting('motion_position_knots', '-', 16.0, 3.0, 201.0,
            'reference positions of the motion rules, over the same range'),
    setting('motion_rate_knots', '-', 21.0, 3.0, 201.0, 'reference rates of the motion rules'),
    setting('motion_rate_upper_m_per_s', 'm/s', 0.12, 1e-3, 5.0, 'last rate of the motion rules'),
    setting('motion_rate_fine_m_per_s', 'm/s', 2e-3, 1e-5, 5.0,
            'rates below are spaced evenly, those above logarithmically'),
    switch('membership_form', 0.0, ('triangular', 'gaussian'),
           'membership functions of error and change'),
    setting('membership_width', '-', 0.4, 0.2, 1.0,
            'standard deviation of a Gaussian set, in distances of two sets'),
    setting('valve_lag_s', 's', 0.0, 0.0, 0.5,
            'lag of the valve the feed-forward makes up for'),
    setting('lag_memory_s', 's', 0.0, 0.0, 1e3,
            'that lag is found in motion, with a memory of so long; 0 = the setting holds'),
    setting('dead_time_s', 's', 0.0, 0.0, 0.5,
            'dead time of the valve, at most lead_s, found together with that lag; 0 = lead_s'),
    setting('rate_feedforward_pa_s_per_m', 'Pa s/m', 0.0, 0.0, 1e7,
            'pressure per rate of the reference: damping over force per pressure'),
    setting('acceleration_feedforward_pa_s2_per_m', 'Pa s2/m', 0.0, 0.0, 1e7,
            'pressure per acceleration of the reference: mass over force per pressure; at least 1 '
            'with feedback on a predicted error'),
    setting('reference_bend_s', 's', 0.0, 0.0, 0.5,
            'low pass on the acceleration with which a reference that nobody announced goes on; '
            '0 = it goes on straight'),
    setting('acceleration_filter_s', 's', 0.01, 0.0, 0.5, 'low pass on that acceleration'),
    setting('jump_time_s', 's', 0.0, 0.0, 5.0,
            'a jump of the reference is made a smooth move of this duration'),
    setting('guard_ratio', '-', 1.5, 0.0, 100.0,
            'roll-back once the error exceeds its best by this factor; 0 = never'),
    setting('surprise_ratio', '-', 10.0, 0.0, 1e3,
            'an error beyond so many times that of the last window is a disturbance; 0 = never'),
    setting('surprise_integral', '-', 1.0, 1.0, 10.0,
            'factor of the integral trim while the error is that of a disturbance'),
    setting('anneal', '-', 0.9, 0.1, 1.0,
            'factor of the learning rate per window in which the error no longer falls'),
    setting('anneal_floor', '-', 0.15, 0.0, 1.0, 'least part of the learning rate left'),
    setting('guard_window_s', 's', 2.0, 0.1, 1e3,
            'shortest time over which errors are compared, whole to and fro'),
    setting('slew_pa_per_s', 'Pa/s', 3e6, 1e4, 1e9, 'fastest change of the command'),
    setting('start_time_s', 's', 0.25, 0.01, 10.0, 'decay of the bumpless start offset'),
    setting('jump_m', 'm', 1e-3, 1e-5, 0.1, 'reference jump that freezes learning'),
    setting('jump_freeze_s', 's', 0.6, 0.0, 10.0, 'for how long, beyond the credit delay'),
    setting('late_s', 's', 0.0, 0.0, 1.0,
            'readings this far apart: some loop was late, and no jump is what moved meanwhile; '
            '0 = never'),
    setting('slack_force_n', 'N', 1.0, -1.0, 1e3, 'force below which the muscle is slack'),
    setting('valve_gap_pa', 'Pa', 4e4, 1e3, 1e6,
            'expected minus measured pressure that freezes learning and integral'),
    switch('jump_form', 0.0, ('minimum_jerk', 'no_jerk_at_ends'),
           'move made of a jump: of minimum jerk, or without jerk at its ends'),
    setting('jump_acceleration', '-', 0.0, 0.0, 1.0,
            'acceleration of such a move: 0 through acceleration_filter_s, 1 exactly'),
    setting('settling_passes', '-', 1.0, 0.0, 20.0,
            'passes that standing still for pass_time_s counts just after such a move'),
    setting('settling_time_s', 's', 0.25, 0.0, 10.0, 'how long that is, from the end of the move'),
    setting('motion_at_rest', '-', 1.0, 0.0, 1.0,
            'share of what standing still counts that goes to the motion rules as well'),
    setting('jump_motion_learning', '-', 1.0, 0.0, 2.0,
            'factor of motion_learning from a jump until the reference moves by itself'),
    setting('jump_rules', '-', 1.0, 0.0, 1.0,
            'share of feed-forward and motion rules that acts and learns for that long'),
    setting('jump_disturbance', '-', 1.0, 0.0, 1.0,
            'share with which the disturbance follows its residual while such a move lasts'),
    setting('jump_forgetting', '-', 0.0, 0.0, 10.0,
            'such a move leaves exp(-this) of the disturbance of the rest before it'),
    switch('jump_announced', 1.0, ('no', 'yes'),
           'whether both hold after an announced jump too'),
    setting('path_sets', '-', 0.0, 0.0, float(MOST_SETS),
            'path rules: sets of the path, the first for any path; 0 = none'),
    setting('path_shortest_m', 'm', 1.4e-4, 1e-6, 0.1, 'shortest path they tell apart'),
    setting('path_longest_m', 'm', 2.5e-3, 1e-6, 0.1, 'longest path they tell apart'),
    setting('path_fading_sets', '-', 0.0, 0.0, float(MOST_SETS - 2),
            'of the sets of the path, the last so many fade with the way gone'),
    setting('path_fading_shortest_m', 'm', 2e-4, 1e-6, 0.1, 'shortest way over which one fades'),
    setting('path_fading_longest_m', 'm', 2e-3, 1e-6, 0.1, 'longest way over which one fades'),
    setting('path_pa', 'Pa', 2e4, 0.0, 1e6,
            'how large the friction number of a set is expected to be: its standard deviation '
            'before anything is measured'),
    setting('path_learning', '-', 0.02, 0.0, 1.0,
            'share of the residual the path rules mend per tick of a motion'),
    setting('path_learning_floor', '-', 0.0, 0.0, 1.0, 'least part of that left'),
    setting('path_settling_s', 's', 0.0, 0.0, 100.0,
            'time in which the path of a reference at rest goes over to that of the muscle; '
            '0 = never'),
    setting('lag_share', '-', 1.0, 0.0, 1.0,
            'share of the lag of the valve made up for in what rules of the path and numbers add'),
    setting('model_noise_pa', 'Pa', 0.0, 0.0, 1e6,
            'residual that no number of the model explains; 0 = the numbers are not looked for'),
    setting('damping_rate_m_per_s', 'm/s', 0.0, 0.0, 5.0,
            'rate at which half of the damping found is left, as friction grows no further; '
            '0 = it grows with the rate'),
    setting('friction_growth', '-', 0.0, 0.0, 1.0,
            'share of the friction found that grows with the pressure; 0 = the same everywhere'),
    setting('inertia_growth', '-', 0.0, 0.0, 1.0,
            'share of the inertia that grows with contraction as the integral does'),
    setting('inertia_feedforward', '-', 1.0, 0.5, 2.0,
            'factor of the inertia found in the feed-forward: creep and noise make it too small'),
    setting('model_drift_pa', 'Pa', 500.0, 0.0, 1e6, 'change of each such number in a second'),
    setting('creep_time_s', 's', 0.0, 0.0, 100.0,
            'time constant of the creep whose pressure is a number of the model; 0 = none'),
    setting('creep_pa', 'Pa', 2e4, 0.0, 1e6,
            'how large the creep after a way of 10 mm is expected to be: its standard deviation '
            'before anything is measured'),
    setting('model_filter_s', 's', 0.015, 0.0, 0.5,
            'both low passes on contraction and pressure for the residual'),
    setting('number_filter_s', 's', 0.0, 0.0, 0.5,
            'a further low pass on what the numbers are found from; 0 = none'),
    setting('inertia_range', '-', 2.0, 1.0, 10.0,
            'factor within which the inertia found stays about that of the feed-forward'),
    setting('disturbance_time_s', 's', 0.0, 0.0, 10.0,
            'time in which the residual the rules do not explain is made up for; 0 = never'),
    setting('predicted_proportional_pa_per_m', 'Pa/m', 0.0, 0.0, 5e7,
            'feedback on the error predicted for when the command arrives'),
    setting('predicted_derivative_pa_s_per_m', 'Pa s/m', 0.0, 0.0, 5e6, 'the same, on its change'),
    setting('predicted_reach_m', 'm', 0.0, 0.0, 0.3,
            'a predicted error beyond counts as this; its change counts in full; 0 = no bound'),
    setting('half_strength_m', 'm', 0.0, 0.0, 0.1,
            'mean error at which that feedback and the disturbance act half; 0 = always in full'),
    setting('strength_time_s', 's', 0.5, 0.01, 100.0, 'time over which that mean is taken'),
    setting('announced_strength_time_s', 's', 0.0, 0.0, 100.0,
            'the same where the reference comes as it was told ahead; 0 = no other'),
    setting('predicted_filter_s', 's', 0.005, 0.0, 0.5, 'low pass on that feedback'),
    setting('predicted_rate_filter_s', 's', 0.015, 0.0, 0.5,
            'low pass on the rate with which the prediction begins'),
    setting('unknown_acceleration_m_per_s2', 'm/s^2', 0.0, 0.0, 1e3,
            'what the model does not tell of the acceleration: an estimate with it and with the '
            'noise of the sensor begins the prediction; 0 = reading and filtered rate do'),
    setting('revision', '-', 2.0, 0.0, 2.0,
            'of this law: 2 the present one, 1 before its guard saw slow growth, 0 that of '
            'recordings and tuned files which do not say it'),
)

PARAMETERS = parameter_record(
    SETTINGS,
    'period_s',
    'delay_ticks',                    # credit delay
    'spread_ticks',                   # credit spread, at most the delay
    'answer_ticks',                   # from a command to the answer of the valve
    'has_model',                      # 1 where the model of the muscle does anything
    ('path_width_m', MOST_SETS),      # of the sets of the path; 0 for that of any path
)

# Settings of which one at least is not 0 where the model of the muscle does anything.
OF_MODEL = (
    'path_sets', 'model_noise_pa', 'disturbance_time_s', 'predicted_proportional_pa_per_m',
    'predicted_derivative_pa_s_per_m')

# The prediction divides by the inertia.
INERTIA, LEAST_INERTIA_PA_S2_PER_M = 'acceleration_feedforward_pa_s2_per_m', 1.0

# What rules mean depends on these; a file of rules must agree in all of them.
SCALING = (
    'rate_hz', 'error_universe_m', 'change_universe_m_per_s', 'feedback_gain_pa',
    'reference_lower_m', 'reference_upper_m', 'reference_knots', 'feedforward_limit_pa',
    'motion_position_knots', 'motion_rate_knots', 'motion_rate_upper_m_per_s',
    'motion_rate_fine_m_per_s')
# The same, where there are path rules.
PATH_SCALING = ('path_sets', 'path_shortest_m', 'path_longest_m')
# The same, where some of them fade.
FADING_SCALING = ('path_fading_sets', 'path_fading_shortest_m', 'path_fading_longest_m')


def predicted_gains(settings: Mapping[str, float]) -> list[str]:
    """Return the names of the gains on a predicted error that are not 0."""
    return [name for name in OF_MODEL if name.startswith('predicted_') and settings[name] > 0.0]


def check_inertia(settings: Mapping[str, float], given: Mapping[str, object],
                  where: Callable[[str], str]) -> None:
    """
    Refuse a law that predicts the error with next to no inertia.

    Parameters
    ----------
    settings : mapping
        All settings of the law.
    given : mapping
        Those that were stated: the place is that of the inertia, else of a predicted gain.
    where : callable
        Place of a setting for errors.

    Raises
    ------
    InputError
        The inertia is too small for a prediction.

    """
    gains = predicted_gains(settings)
    if gains and settings[INERTIA] < LEAST_INERTIA_PA_S2_PER_M:
        usual = next(one for one in SETTINGS if one.name == INERTIA)
        allowed = allowed_range(LEAST_INERTIA_PA_S2_PER_M, usual.upper, usual.unit, INERTIA)
        raise InputError(
            f'`{INERTIA}` is {settings[INERTIA]:g}; allowed {allowed} with feedback on a '
            'predicted error', where(INERTIA if INERTIA in given else gains[0]))


def scaling_of(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return what of checked settings says what rules mean."""
    names = (*SCALING, *PATH_SCALING * bool(settings['path_sets']),
             *FADING_SCALING * bool(settings['path_fading_sets']))
    return {name: settings[name] for name in names}


def parameter_array(values: Mapping[str, float]) -> FloatArray:
    """Return the array of ``PARAMETERS`` for checked settings."""
    period_s = 1.0 / values['rate_hz']
    delay = round(values['credit_delay_s'] / period_s)
    widths_m = np.zeros(MOST_SETS)
    given_m = path_widths_m(values)[:MOST_SETS]
    widths_m[:given_m.size] = given_m
    return values_of(PARAMETERS, {
        **values, 'path_width_m': widths_m,
        'has_model': float(any(values[name] for name in OF_MODEL)),
        'period_s': period_s, 'delay_ticks': delay,
        'spread_ticks': min(round(values['credit_spread_s'] / period_s), delay),
        # The preview covers the dead time; what the valve lags besides is filtered.
        'answer_ticks': round(values['lead_s'] / period_s)})

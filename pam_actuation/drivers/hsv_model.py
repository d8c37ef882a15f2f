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
Model of muscle and valves behind the HSV pressure loop: advance, observe, predict.

An isothermal chamber, ISO 6358 valves and a volume that rises with pressure, run on the
openings that have reached the muscle and corrected by the measured pressure. What it misses
is learned slowly: a gain of either flow, a drift (leak, moving volume), the dead time, and
what a pair of pulses fills too much.

Source: ISO 6358 (flow).
"""

import math

import numpy as np

from pam_actuation.drivers.hsv_config import SENT_SIZE
from pam_actuation.drivers.hsv_learned import find_pulses, note_pulses
from pam_actuation.drivers.hsv_motion import corrected_by_contraction
from pam_sim.compiled import compiled
from pam_sim.records import record
from pam_sim.units import GAS_CONSTANT_AIR, P_ATM_PA, TEMPERATURE_K
from pam_sim.valve.flow import mass_flow_kg_per_s

_DELAY_MEAN = 0.3       # of the running mean of what a wrong dead time does, per period
_LEARN_PAIR = 0.06      # of a pair's error taken over, per period
_PAIR_LIMIT = 0.5

# A period is one of the PWM.
STATE = record(
    'started',                        # 1 after the first measurement
    'age_s',                          # of the measurement, set by the caller
    'command_pa',                     # former command, NaN = none
    'command_change_pa',              # its former change in a period
    'at_work',                        # 1 from an error beyond the band to one within the fine
    # Model of the air and the load.
    'model_pa',                       # pressure now
    'flow_pa',                        # pressure change by the valves in the last period
    'volume_m3',
    'volume_change_m3',               # in a period
    # Learned.
    'drift_pa_per_period',
    'fill_gain',                      # of the flows
    'vent_gain',
    'dead_time_shift_periods',        # dead time less the one told of
    'dead_time_effect_pa',            # what a period less of it would have added to the reading
    'dead_time_effect_mean_pa',       # its running mean
    'pair_gain',                      # what a pair fills too much, share of its flow
    # Of the last periods, newest first.
    ('sent', SENT_SIZE),              # openings under way, fill > 0, vent < 0
    ('through_pa', SENT_SIZE),        # air through both valves
    # What is measured of the motion, set by the caller; NaN = not measured.
    'contraction_m',
    'contraction_age_s',
    'rest_m3',                        # volume at which the load would rest, less the known one
    # Learned of the pulses, see ``hsv_learned``.
    'fill_more',                      # what a pulse fills beside its length, part of a period
    'vent_more',
    ('pulse_covariance', 16),
    ('pulse_regressor', 4),           # of gain and more of filling, then of venting [Pa]
    ('pulse_step', 4),                # work space
    'pulse_rest_periods',             # for so long nothing is learned of them
    # Of the last periods, newest first.
    ('fill_sent', SENT_SIZE),         # openings as the data sheet says
    ('vent_sent', SENT_SIZE),
)


@compiled
def full_rate(state: np.record, par: np.record, p_pa: float, volume_m3: float, supply_pa: float,
              filling: bool) -> float:
    """Return the pressure change [Pa] in one period with one valve fully open."""
    if filling:
        flow = mass_flow_kg_per_s(
            supply_pa, p_pa, par.conductance_kg_per_s_pa, par.critical_ratio)
        flow *= state.fill_gain
    else:
        flow = -mass_flow_kg_per_s(
            p_pa, P_ATM_PA, par.conductance_kg_per_s_pa, par.critical_ratio)
        flow *= state.vent_gain
    return GAS_CONSTANT_AIR * TEMPERATURE_K * flow * par.period_s / volume_m3


@compiled
def _resting_m3(par: np.record, above_pa: float) -> float:
    """Return the volume [m^3] at which the load rests, so far above the lift-off."""
    volume: float = par.volume_m3 + above_pa * (
        par.volume_slope_m3_per_pa + above_pa * par.volume_curve_m3_per_pa2)
    return volume


@compiled
def _volume_pull(state: np.record, par: np.record, p_pa: float, volume_m3: float,
                 rate_m3: float) -> float:
    """
    Return the volume's acceleration [m^3 per period^2].

    The load swings about the volume that belongs to the pressure.
    """
    above = max(p_pa - P_ATM_PA - par.lift_off_gauge_pa, 0.0)
    rest = state.rest_m3 + _resting_m3(par, above)
    omega = max(par.swing_rad_per_period + above * par.swing_slope_rad_per_period_pa,
                par.swing_lowest_rad_per_period)
    return omega * (omega * (rest - volume_m3) - 2.0 * par.swing_damping * rate_m3)


@compiled
def advance(state: np.record, par: np.record, p_pa: float, volume_m3: float, rate_m3: float,
            opening: float, periods: float, supply_pa: float) -> tuple[float, float, float, float]:
    """
    Bring the model forward by a part of a period with a constant opening.

    Returns pressure [Pa], volume [m^3], its rate [m^3 per period] and the pressure
    change made by the valves [Pa].
    """
    flow_pa = 0.0
    substep = 0.5 * periods
    if substep <= 0.0:
        return p_pa, volume_m3, rate_m3, flow_pa
    for _ in range(2):
        rate_m3 += substep * _volume_pull(state, par, p_pa, volume_m3, rate_m3)
        volume_m3 += substep * rate_m3
        if volume_m3 < par.volume_m3:      # the load rests on its lower stop
            volume_m3 = par.volume_m3
            rate_m3 = max(rate_m3, 0.0)
        change = 0.0
        if opening != 0.0:
            filling = opening > 0.0
            size = abs(opening) * substep
            half = p_pa + 0.5 * size * full_rate(state, par, p_pa, volume_m3, supply_pa, filling)
            half = min(max(half, P_ATM_PA), max(supply_pa, p_pa))
            change = size * full_rate(state, par, half, volume_m3, supply_pa, filling)
        flow_pa += change
        after = p_pa + change + substep * (state.drift_pa_per_period - p_pa * rate_m3 / volume_m3)
        p_pa = max(after, P_ATM_PA) if after < p_pa else after
    return p_pa, volume_m3, rate_m3, flow_pa


@compiled
def _delay(state: np.record, par: np.record) -> tuple[int, float]:
    """Return the dead time as whole periods and the part of one that is left."""
    delay = min(max(par.dead_time_periods + state.dead_time_shift_periods, 0.0), SENT_SIZE - 2.0)
    whole = min(int(delay), SENT_SIZE - 3)
    return whole, delay - whole


@compiled
def _learn_delay(state: np.record, par: np.record, error: float) -> None:
    """
    Move the dead time where a change of the flow shows earlier or later than expected.

    With a dead time one period too long, a reading is wrong by the latest changes of the flow that
    the observer has not corrected. This is a normalised gradient step. Only the quick part of them
    tells: the slow one goes with the motion of the load, whose volume the model knows less well.
    """
    state.dead_time_effect_mean_pa += _DELAY_MEAN * (
        state.dead_time_effect_pa - state.dead_time_effect_mean_pa)
    effect = state.dead_time_effect_pa - state.dead_time_effect_mean_pa
    scale = par.flow_scale_pa
    shift = state.dead_time_shift_periods - (
        par.learn_dead_time * error * effect / (effect * effect + scale * scale))
    state.dead_time_shift_periods = min(
        max(shift, -par.dead_time_range_periods), par.dead_time_range_periods)
    state.dead_time_effect_pa *= 1.0 - par.correct


@compiled
def _bounded_gain(par: np.record, gain: float) -> float:
    """Return the gain of a flow within its limits."""
    return min(max(gain, 1.0 / par.gain_limit), par.gain_limit)


@compiled
def observe(state: np.record, par: np.record, p_meas_pa: float, supply_pa: float) -> None:
    """
    Bring the model one period further and correct it by a measurement.

    ``p_meas_pa`` NaN = no measurement this period. Start: the first measurement is the
    model pressure.
    """
    if state.started < 0.5:
        if not math.isfinite(p_meas_pa):
            return
        state.model_pa = p_meas_pa
        above = max(p_meas_pa - P_ATM_PA - par.lift_off_gauge_pa, 0.0)
        state.volume_m3 = _resting_m3(par, above)
        state.volume_change_m3 = 0.0
        state.started = 1.0
        return
    whole, part = _delay(state, par)
    before = state.model_pa
    early = state.sent[whole + 1]
    late = state.sent[whole]
    p_pa, vol, vrate, flow_early = advance(
        state, par, before, state.volume_m3, state.volume_change_m3, early, part, supply_pa)
    after, vol, vrate, flow_late = advance(
        state, par, p_pa, vol, vrate, late, 1.0 - part, supply_pa)
    flow = flow_early + flow_late
    through = (part * state.through_pa[whole + 1] + (1.0 - part) * state.through_pa[whole])
    state.dead_time_effect_pa += flow - state.flow_pa
    state.flow_pa = flow
    state.model_pa = after
    state.volume_m3 = vol
    state.volume_change_m3 = vrate
    if not math.isfinite(p_meas_pa):
        return
    rate = (after - before) / par.period_s
    error = p_meas_pa - (after - rate * state.age_s)
    corrected_pa = after + par.correct * error
    state.model_pa = corrected_pa
    _learn_delay(state, par, error)
    above = max(corrected_pa - P_ATM_PA - par.lift_off_gauge_pa, 0.0)
    told = corrected_by_contraction(state, par, _resting_m3(par, above))
    if not told and vol > par.volume_m3:
        # A reading above the model: the volume grows less than it thinks.
        per_pa = vol / after
        state.volume_m3 = max(vol + par.correct_volume * error * per_pa, par.volume_m3)
        state.volume_change_m3 = vrate - par.correct_rate * error * per_pa
    if par.pulse_noise_pa > 0.0:
        _find_pulses(state, par, whole, part, error, supply_pa)
    else:
        _learn_flows(state, par, error, flow, through)


@compiled
def _learn_flows(state: np.record, par: np.record, error: float, flow: float,
                 through: float) -> None:
    """
    Learn the gain of either flow, the drift and what a pair of pulses fills too much.

    A large flow points to a wrong flow gain, a pair of pulses to a wrong difference of two,
    anything else to a drift.
    """
    power = through * through + par.flow_scale_pa ** 2
    pair = state.pair_gain + _LEARN_PAIR * error * through / power
    state.pair_gain = min(max(pair, -_PAIR_LIMIT), _PAIR_LIMIT)
    share = 0.0
    if abs(flow) > par.flow_scale_pa:
        share = 1.0 - (par.flow_scale_pa / flow) ** 2
        factor = 1.0 + par.learn_gain * share * error / flow
        if flow > 0.0:
            state.fill_gain = _bounded_gain(par, state.fill_gain * factor)
        else:
            state.vent_gain = _bounded_gain(par, state.vent_gain * factor)
    rest = (1.0 - share) * (1.0 - through * through / power)
    drift = state.drift_pa_per_period + par.learn_drift * rest * error
    state.drift_pa_per_period = min(
        max(drift, -par.drift_limit_pa_per_period), par.drift_limit_pa_per_period)


@compiled
def _find_pulses(state: np.record, par: np.record, whole: int, part: float, error: float,
                 supply_pa: float) -> None:
    """Learn gain and offset of the pulses of each valve, and the drift."""
    p_pa, vol = state.model_pa, state.volume_m3
    note_pulses(
        state, par, whole, part,
        full_rate(state, par, p_pa, vol, supply_pa, True) / state.fill_gain,
        full_rate(state, par, p_pa, vol, supply_pa, False) / state.vent_gain)
    find_pulses(state, par, error)
    state.drift_pa_per_period = min(max(
        state.drift_pa_per_period + par.learn_drift * error, -par.drift_limit_pa_per_period),
        par.drift_limit_pa_per_period)


@compiled
def predict(state: np.record, par: np.record,
            supply_pa: float) -> tuple[float, float, float]:
    """
    Run the model over all openings under way.

    Returns pressure [Pa], volume [m^3] and its rate [m^3 per period] when the next
    opening begins to act.
    """
    whole, part = _delay(state, par)
    p_pa, vol, vrate, _ = advance(
        state, par, state.model_pa, state.volume_m3, state.volume_change_m3,
        state.sent[whole], part, supply_pa)
    for i in range(whole - 1, -1, -1):
        p_pa, vol, vrate, _ = advance(
            state, par, p_pa, vol, vrate, state.sent[i], 1.0, supply_pa)
    return p_pa, vol, vrate

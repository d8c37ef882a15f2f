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
Compiled core of the HSV pressure loop: the choice of the next pulses.

The opening of the next PWM period is the mass-flow inverse of the error left at the end of
the prediction of ``hsv_model`` over the openings under way.

Once the predicted error is inside the fine band, the valves rest with both duties exactly 0. They
rest until it leaves the set-point band, so that sensor noise does not start them. Where less is
wanted than the shortest possible pulse does, both valves open in the same period and the
difference of their pulses is the dose (``hsv_pulses``). Where that would take openings or duties
above ``LONGEST_OF_A_PAIR``, an error below a part of the shortest pulse's effect is left alone.
That is at low pressure, and sooner for valves that open later than they shut.
"""

from collections.abc import Callable
import math

import numpy as np
from pam_actuation.drivers.hsv_config import PARAMETERS, SENT_SIZE
from pam_actuation.drivers.hsv_learned import learned_opening, sheet_opening
from pam_actuation.drivers.hsv_model import advance, full_rate, observe, predict, STATE
from pam_actuation.drivers.hsv_pulses import (
    duty_of_opening, joined_opening, LONGEST_OF_A_PAIR, opening_of_duty, pair_openings,
    shortest_opening)
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled, entry_point, source_key
from pam_sim.records import record
from pam_sim.units import P_ATM_PA

OUTPUT = record(
    'fill_duty',                      # 0..1
    'vent_duty',                      # 0..1
    'predicted_pa',                   # pressure where the new opening begins to act
    'saturated',                      # -1 vent fully open, +1 fill fully open, 0 free
    'target_pa',                      # the command after the limits of atmosphere and supply
)


@compiled
def _push(state: np.record, par: np.record, opening: float, through_pa: float, fill_duty: float,
          vent_duty: float) -> None:
    for i in range(SENT_SIZE - 1, 0, -1):
        state.sent[i] = state.sent[i - 1]
        state.through_pa[i] = state.through_pa[i - 1]
        state.fill_sent[i] = state.fill_sent[i - 1]
        state.vent_sent[i] = state.vent_sent[i - 1]
    state.sent[0] = opening
    state.through_pa[0] = through_pa
    state.fill_sent[0] = opening_of_duty(fill_duty, par.open_part, par.close_part)
    state.vent_sent[0] = opening_of_duty(vent_duty, par.open_part, par.close_part)


@compiled
def _command_slope(state: np.record, par: np.record, p_cmd_pa: float) -> float:
    """
    Return the change [Pa per period] to feed forward.

    The smaller of the last two changes of the command where they agree in sign: a ramp
    or a sine passes, a step or noise does not.
    """
    slope = 0.0
    if math.isfinite(state.command_pa):
        slope = p_cmd_pa - state.command_pa
    former = state.command_change_pa
    state.command_pa = p_cmd_pa
    state.command_change_pa = slope
    if slope * former <= 0.0:
        return 0.0
    return par.slope_share * (slope if abs(slope) < abs(former) else former)


@compiled
def _free_error(state: np.record, par: np.record, p_pa: float, volume_m3: float, rate_m3: float,
                target_pa: float, supply_pa: float) -> float:
    """
    Return the error [Pa] that stays if the valves do nothing from now on.

    The smallest over the look-ahead, 0 where it changes sign: a swing of the load that
    will close the error is left to do so.
    """
    error = 0.0
    for i in range(max(int(par.look_ahead_periods), 1)):
        p_pa, volume_m3, rate_m3, _ = advance(
            state, par, p_pa, volume_m3, rate_m3, 0.0, 1.0, supply_pa)
        now = target_pa - p_pa
        if i == 0:
            error = now
        elif now * error <= 0.0:
            return 0.0
        elif abs(now) < abs(error):
            error = now
    return error


@compiled
def _wanted_openings(state: np.record, par: np.record, p_pa: float, volume_m3: float, error: float,
                     slope_pa: float, supply_pa: float) -> tuple[float, float]:
    """
    Return the openings (fill, vent) for the next period, of the data sheet.

    ``p_pa`` is the pressure it starts at, ``error`` what it has to change [Pa].
    """
    pairs = par.fine_band_pa > 0.0
    at_work = pairs and state.at_work > 0.0
    if abs(error) <= (par.fine_band_pa if at_work else par.band_pa):
        state.at_work = 0.0
        return 0.0, 0.0
    state.at_work = 1.0
    # The slope is part of the error one period on: only the rest is scaled by the gain.
    if slope_pa * error < 0.0:
        slope_pa = 0.0
    elif abs(slope_pa) > abs(error):
        slope_pa = error
    wanted = par.gain * (error - slope_pa) + slope_pa
    filling = error > 0.0
    middle = p_pa + 0.5 * wanted
    middle = max(middle, P_ATM_PA)
    if filling:
        middle = min(middle, supply_pa)
    full = abs(full_rate(state, par, middle, volume_m3, supply_pa, filling))
    if full <= 0.0:
        return 0.0, 0.0
    shortest = shortest_opening(par.open_part, par.close_part, par.pulse_margin_part)
    least = learned_opening(state, shortest, filling)
    if pairs and abs(wanted) < least * full:
        other = abs(full_rate(state, par, middle, volume_m3, supply_pa, not filling))
        if other > 0.0:
            through = shortest * min(full, other)
            fill, vent = pair_openings(
                wanted - state.pair_gain * through,
                full if filling else other, other if filling else full,
                learned_opening(state, shortest, True), learned_opening(state, shortest, False))
            fill, vent = sheet_opening(state, fill, True), sheet_opening(state, vent, False)
            # An output refuses longer pulses, and a pulse may be longer than its opening.
            if max(fill, vent, _duty(par, fill), _duty(par, vent)) <= LONGEST_OF_A_PAIR:
                return fill, vent
    if abs(error) < par.rest_share * least * full:
        return 0.0, 0.0
    opening = min(max(sheet_opening(state, abs(wanted) / full, filling), shortest), 1.0)
    return (opening, 0.0) if filling else (0.0, opening)


@compiled
def _joined(state: np.record, par: np.record, p_pa: float, volume_m3: float, supply_pa: float,
            fill_duty: float, vent_duty: float) -> tuple[float, float]:
    """Return the signed opening that acts like two duties, and the air through both [Pa]."""
    fill = learned_opening(
        state, opening_of_duty(fill_duty, par.open_part, par.close_part), True)
    vent = learned_opening(
        state, opening_of_duty(vent_duty, par.open_part, par.close_part), False)
    if fill <= 0.0 or vent <= 0.0:
        return fill - vent, 0.0
    fill_rate = full_rate(state, par, p_pa, volume_m3, supply_pa, True)
    vent_rate = -full_rate(state, par, p_pa, volume_m3, supply_pa, False)
    through = min(fill * fill_rate, vent * vent_rate)
    return joined_opening(
        fill, vent, fill_rate, vent_rate, state.pair_gain * through), through


@compiled
def _duty(par: np.record, opening: float) -> float:
    """Return the duty of an opening, exactly 0 for none."""
    if opening <= 0.0:
        return 0.0
    return duty_of_opening(opening, par.open_part, par.close_part, par.pulse_margin_part)


@compiled
def _step(state: np.record, par: np.record, p_cmd_pa: float, p_meas_pa: float, supply_pa: float,
          out: np.record) -> None:
    if not math.isfinite(supply_pa):
        supply_pa = par.supply_pa
    observe(state, par, p_meas_pa, supply_pa)
    slope = _command_slope(state, par, p_cmd_pa)
    # Beyond the supply nothing is filled, and what is there stays.
    highest = max(supply_pa - par.supply_margin_pa, state.model_pa)
    target = max(min(p_cmd_pa, highest), P_ATM_PA)
    out.target_pa = target
    out.fill_duty = 0.0
    out.vent_duty = 0.0
    out.saturated = 0.0
    out.predicted_pa = math.nan
    sent = 0.0
    through = 0.0
    if state.started > 0.5:
        predicted, vol, vrate = predict(state, par, supply_pa)
        out.predicted_pa = predicted
        error = _free_error(state, par, predicted, vol, vrate, target, supply_pa)
        fill, vent = _wanted_openings(state, par, predicted, vol, error, slope, supply_pa)
        out.fill_duty = _duty(par, fill)
        out.vent_duty = _duty(par, vent)
        if out.fill_duty >= 1.0 or out.vent_duty >= 1.0:
            out.saturated = 1.0 if out.fill_duty >= 1.0 else -1.0
        sent, through = _joined(
            state, par, predicted, vol, supply_pa, out.fill_duty, out.vent_duty)
    _push(state, par, sent, through, out.fill_duty, out.vent_duty)


@compiled
def _hold(state: np.record, par: np.record, fill_duty: float, vent_duty: float, p_meas_pa: float,
          supply_pa: float) -> None:
    if not math.isfinite(supply_pa):
        supply_pa = par.supply_pa
    observe(state, par, p_meas_pa, supply_pa)
    sent, through = _joined(state, par, state.model_pa, state.volume_m3, supply_pa,
                            fill_duty, vent_duty)
    _push(state, par, sent, through, fill_duty, vent_duty)
    state.command_pa = math.nan
    state.command_change_pa = 0.0


def _entries(key: int) -> tuple[Callable[..., None], Callable[..., None]]:
    """Return both entry points as units of compiled code, stored under ``key``."""
    @entry_point
    def hsv_step(state: FloatArray, par: FloatArray, p_cmd_pa: float, p_meas_pa: float,
                 supply_pa: float, out: FloatArray) -> None:
        """
        One PWM period of the pressure loop.

        Parameters
        ----------
        state, par, out : float64 arrays
            ``STATE``, ``PARAMETERS`` and ``OUTPUT``; ``state`` and ``out`` are written. Of the
            state ``age_s``, ``contraction_m`` and ``contraction_age_s`` may be set before.
        p_cmd_pa, p_meas_pa, supply_pa : float
            Wanted, measured and supply pressure, absolute [Pa]. A measurement of NaN means
            none this period, a supply of NaN the nominal one.

        """
        if key >= 0:      # always; makes the key part of what is stored
            _step(state.view(STATE)[0], par.view(PARAMETERS)[0], p_cmd_pa, p_meas_pa, supply_pa,
                  out.view(OUTPUT)[0])

    @entry_point
    def hsv_hold(state: FloatArray, par: FloatArray, fill_duty: float, vent_duty: float,
                 p_meas_pa: float, supply_pa: float) -> None:
        """One PWM period with imposed duties (vent, missed tick): only the model goes on."""
        if key >= 0:
            _hold(state.view(STATE)[0], par.view(PARAMETERS)[0], fill_duty, vent_duty,
                  p_meas_pa, supply_pa)

    return hsv_step, hsv_hold


hsv_step, hsv_hold = _entries(source_key(_step, _hold))

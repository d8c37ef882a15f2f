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
What the HSV pressure loop learns of the pulses of each valve: gain and offset.

A data sheet gives conductance and switching times. What a pulse does then is its flow times
the opening it should have. A real valve has another conductance, and opens for another time. So
each valve has two numbers, ``flow = rate (gain opening + more)``. Recursive least squares find all
four from what the readings differ from the model when the pulses have arrived. They have the form
of a Kalman filter whose numbers drift. A valve that is not pulsed keeps its numbers.

A wrong dead time looks like wrong pulses where the flow changes much. The more of an error a wrong
dead time could explain, the less it counts. It does not count where a valve is fully open, nor
where it is far from what was expected.

A pulse so short that the valve does not open fully is no straight line. Such pulses are left out
by ``pulse_margin_s``.
"""

import numpy as np

from pam_sim.compiled import compiled

_REST_PERIODS = 5.0     # after a valve was fully open nothing is learned for so long
_PULSE_SIZE = 4            # gain and more of filling, then of venting
_UNKNOWN = (0.15, 0.05)     # standard deviation of gain and more before the first pulse
_DRIFT = 1e-4           # its growth in a period
_MOST_MORE = 0.1        # of a period
_FAR = 4.0              # so many times the expected error tells nothing of pulses
_DOUBT_PERIODS = 0.5    # of the dead time


@compiled
def learned_opening(state: np.record, opening: float, filling: bool) -> float:
    """Return the opening that a pulse has, from that of the data sheet (parts of a period)."""
    if opening <= 0.0 or opening >= 1.0:
        return opening
    more = state.fill_more / state.fill_gain if filling else state.vent_more / state.vent_gain
    return max(opening + more, 0.0)


@compiled
def sheet_opening(state: np.record, opening: float, filling: bool) -> float:
    """Return the opening of the data sheet whose pulse has an opening; the way back."""
    more = state.fill_more / state.fill_gain if filling else state.vent_more / state.vent_gain
    return opening - more


@compiled
def note_pulses(state: np.record, par: np.record, whole: int, part: float, fill_rate_pa: float,
                vent_rate_pa: float) -> None:
    """
    Bring the regressors one period further.

    What a wrong number has done to the model fades as the observer corrects the pressure.

    Parameters
    ----------
    state, par : record
        ``STATE`` and ``PARAMETERS``.
    whole, part : int, float
        Dead time [periods]: the pulses of these act now.
    fill_rate_pa, vent_rate_pa : float
        Change of pressure in a period with one valve fully open, by the data sheet [Pa].

    """
    kept = 1.0 - par.correct
    phi = state.pulse_regressor
    for i in range(_PULSE_SIZE):
        phi[i] *= kept
    for ago, share in ((whole + 1, part), (whole, 1.0 - part)):
        fill, vent = state.fill_sent[ago], state.vent_sent[ago]
        if fill >= 1.0 or vent >= 1.0:
            state.pulse_rest_periods = _REST_PERIODS
        if 0.0 < fill < 1.0:
            phi[0] += share * fill_rate_pa * fill
            phi[1] += share * fill_rate_pa
        if 0.0 < vent < 1.0:
            phi[2] += share * vent_rate_pa * vent
            phi[3] += share * vent_rate_pa


@compiled
def find_pulses(state: np.record, par: np.record, error: float) -> None:
    """Correct the four numbers by what a reading differs from the model [Pa]."""
    phi, step, cov = state.pulse_regressor, state.pulse_step, state.pulse_covariance
    doubt_pa = _DOUBT_PERIODS * state.dead_time_effect_pa
    power = par.pulse_noise_pa * par.pulse_noise_pa + doubt_pa * doubt_pa
    if state.pulse_rest_periods > 0.0:
        state.pulse_rest_periods -= 1.0
        return
    if error * error > _FAR * _FAR * power:
        return
    for i in range(_PULSE_SIZE):
        at = i * _PULSE_SIZE + i
        unknown = _UNKNOWN[i % 2] * _UNKNOWN[i % 2]
        if cov[at] == 0.0:
            cov[at] = unknown
        elif cov[at] < unknown:
            cov[at] += _DRIFT * _DRIFT
    for i in range(_PULSE_SIZE):
        step[i] = 0.0
        for j in range(_PULSE_SIZE):
            step[i] += cov[i * _PULSE_SIZE + j] * phi[j]
        power += step[i] * phi[i]
    share = error / power
    limit: float = par.gain_limit
    fill_gain, fill_more, vent_gain, vent_more = step[0], step[1], step[2], step[3]
    state.fill_gain = min(max(state.fill_gain + fill_gain * share, 1.0 / limit), limit)
    state.vent_gain = min(max(state.vent_gain + vent_gain * share, 1.0 / limit), limit)
    state.fill_more = min(max(state.fill_more + fill_more * share, -_MOST_MORE), _MOST_MORE)
    state.vent_more = min(max(state.vent_more + vent_more * share, -_MOST_MORE), _MOST_MORE)
    for i in range(_PULSE_SIZE):
        for j in range(_PULSE_SIZE):
            cov[i * _PULSE_SIZE + j] -= step[i] * step[j] / power

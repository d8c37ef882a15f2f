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
LQI: linear-quadratic control with integral action on an identified linear model.

State feedback on the estimate of a Kalman filter, delay states and the
integral of the error (``lqi_gains``), about one operating point
(``lqi_model``). ``reference_feedforward`` adds, in that share, the pressure the
linear model needs at rest for the reference ``lead_s`` ahead. Anti-windup,
limits and bumpless start as the PID's, and the same interface; there are no
rules to learn.
"""

from numba import njit
from pam_actuation.control import inputs as place
from pam_actuation.control.fixed_law import FixedLawController
from pam_actuation.control.law_parts import (
    faded_offset, first_command_pa, held_offset, integral_growth, limited)
from pam_actuation.control.lqi_gains import (
    M_CONTRACTION, M_DELAY, M_HEAD, M_INTEGRAL_GAIN, M_ORDER, M_PA_PER_M, M_PRESSURE, pack)
from pam_actuation.control.settings import checked_settings, Setting
from pam_sim.compiled import compiled, source_key
from pam_sim.errors import InputError
from pam_sim.units import P_ATM_PA

SETTINGS = (
    Setting('rate_hz', 'Hz', 200.0, 20.0, 1000.0, 'control rate'),
    Setting('lead_s', 's', 0.0, 0.0, 0.5, 'preview of the feed-forward'),
    Setting('reference_feedforward', '-', 1.0, 0.0, 1.0,
            'share of the pressure at rest for the reference that is fed forward'),
    Setting('integral_weight', 'mm2/(mm s)2', 30.0, 1e-6, 1e8, 'weight of the integral'),
    Setting('command_weight', 'mm2/kPa2', 1e-2, 1e-8, 1e4, 'weight of the command'),
    Setting('disturbance_pa', 'Pa', 1e3, 1e-2, 1e6, 'disturbance the observer expects, a tick'),
    Setting('noise_m', 'm', 1e-5, 1e-8, 1e-2, 'sensor noise the observer expects'),
    Setting('anti_windup_time_s', 's', 0.05, 0.01, 10.0, 'back-calculation time constant'),
    Setting('min_pressure_gauge_pa', 'Pa', 0.0, 0.0, 6e5, 'lowest command'),
    Setting('max_pressure_gauge_pa', 'Pa', 6e5, 1e3, 1e6, 'highest command'),
    Setting('slew_pa_per_s', 'Pa/s', 3e6, 1e4, 1e9, 'fastest change of the command'),
    Setting('start_time_s', 's', 0.25, 0.01, 10.0, 'decay of the bumpless start offset'),
)
STATE_NAMES = (
    'command_pa', 'error_m', 'estimated_contraction_m', 'innovation_m', 'feedforward_pa',
    'state_feedback_pa', 'integral_pa', 'unlimited_command_pa', 'saturated_low',
    'saturated_high', 'slew_limited', 'start_offset_m')

(P_RATE, P_LEAD, P_FEEDFORWARD, P_INTEGRAL_WEIGHT, P_COMMAND_WEIGHT, P_DISTURBANCE, P_NOISE,
 P_ANTI_WINDUP_TIME, P_MIN, P_MAX, P_SLEW, P_START_TIME) = range(len(SETTINGS))
# State: these, then the estimate (order), commands on their way (delay) and the feed-forward
# they contained (delay), oldest first.
(S_STARTED, S_OFFSET, S_INTEGRAL, S_OUTPUT, S_ERROR, S_HEAD) = range(6)
_STALE_S = 0.1              # a longer gap between measurements restarts the estimate


@compiled
def _rest(model, st, contraction_m):
    """Set the estimate to rest at a deviation [m] from the operating point."""
    n = int(model[M_ORDER])
    for i in range(n):
        st[S_HEAD + i] = model[M_HEAD + 3 * n + i] * contraction_m


@compiled
def _state_feedback(model, st, target_m):
    """Return the feedback [Pa] of estimate and commands on their way about a target [m]."""
    n, d = int(model[M_ORDER]), int(model[M_DELAY])
    total = 0.0
    for i in range(n):
        wanted = model[M_HEAD + 3 * n + i] * target_m
        total -= model[M_HEAD + 4 * n + i] * (st[S_HEAD + i] - wanted)
    for i in range(d):
        total -= model[M_HEAD + 5 * n + i] * (st[S_HEAD + n + i] - st[S_HEAD + n + d + i])
    return total


@compiled
def _predict(model, st, command, feedforward):
    """Advance the estimate by one tick and put a command (deviation [Pa]) on its way."""
    n, d = int(model[M_ORDER]), int(model[M_DELAY])
    acting = command
    if d > 0:
        acting = st[S_HEAD + n]
        for i in range(d - 1):
            st[S_HEAD + n + i] = st[S_HEAD + n + i + 1]
            st[S_HEAD + n + d + i] = st[S_HEAD + n + d + i + 1]
        st[S_HEAD + n + d - 1] = command
        st[S_HEAD + n + 2 * d - 1] = feedforward
    first = st[S_HEAD]
    for i in range(n):
        following = st[S_HEAD + i + 1] if i + 1 < n else 0.0
        st[S_HEAD + i] = (
            following - model[M_HEAD + i] * first + model[M_HEAD + n + i] * acting)


@compiled
def _start(par, model, st, inp, feedforward):
    """Begin so that the reference starts where the muscle is and the command where it is."""
    n, d = int(model[M_ORDER]), int(model[M_DELAY])
    y = inp[place.IN_CONTRACTION] - model[M_CONTRACTION]
    st[S_STARTED] = 1.0
    _rest(model, st, y)
    st[S_OUTPUT] = first_command_pa(
        inp[place.IN_PRESSURE], P_ATM_PA + par[P_MIN], P_ATM_PA + par[P_MAX])
    deviation = st[S_OUTPUT] - model[M_PRESSURE]
    for i in range(d):
        st[S_HEAD + n + i] = deviation
        st[S_HEAD + n + d + i] = feedforward
    st[S_INTEGRAL] = deviation - feedforward - _state_feedback(
        model, st, par[P_FEEDFORWARD] * y)


@compiled
def _tick(par, model, st, inp, out):
    """Run one tick; see ``lqi_step``."""
    period = 1.0 / par[P_RATE]
    n = int(model[M_ORDER])
    x = inp[place.IN_CONTRACTION]
    y = x - model[M_CONTRACTION]
    begins = st[S_STARTED] < 0.5
    if begins:
        st[S_OFFSET] = inp[place.IN_REFERENCE] - x
    held_back = inp[place.IN_HELD_BACK]
    offset = held_offset(st[S_OFFSET], held_back, inp[place.IN_REFERENCE] - x, st[S_ERROR],
                         par[P_START_TIME], period)
    feedforward = par[P_FEEDFORWARD] * model[M_PA_PER_M] * (
        inp[place.IN_LEAD_REFERENCE] - offset - model[M_CONTRACTION])
    if begins:
        _start(par, model, st, inp, feedforward)
    st[S_OFFSET] = faded_offset(offset, par[P_START_TIME], period)

    # Correct the estimate; the same measurement once more tells nothing new.
    elapsed = inp[place.IN_ELAPSED]
    innovation = y - st[S_HEAD]
    if held_back != 0.0 or elapsed > _STALE_S:    # False for NaN: one period
        _rest(model, st, y)                # what moved it is not known
    elif not elapsed <= 0.0:
        for i in range(n):
            st[S_HEAD + i] += model[M_HEAD + 2 * n + i] * innovation

    error = inp[place.IN_REFERENCE] - offset - x
    st[S_ERROR] = error
    target = par[P_FEEDFORWARD] * (inp[place.IN_REFERENCE] - offset - model[M_CONTRACTION])
    feedback = _state_feedback(model, st, target)
    integral = st[S_INTEGRAL]
    estimate = st[S_HEAD] + model[M_CONTRACTION]
    wanted = model[M_PRESSURE] + feedforward + feedback + integral
    lowest = P_ATM_PA + par[P_MIN]
    highest = P_ATM_PA + par[P_MAX]
    inside, command = limited(wanted, st[S_OUTPUT], lowest, highest, par[P_SLEW] * period)
    st[S_OUTPUT] = command
    st[S_INTEGRAL] = integral + period * integral_growth(
        model[M_INTEGRAL_GAIN] * error, (command - wanted) / par[P_ANTI_WINDUP_TIME], held_back)
    _predict(model, st, command - model[M_PRESSURE], feedforward)
    out[0] = command
    out[1] = error
    out[2] = estimate
    out[3] = innovation
    out[4] = feedforward
    out[5] = feedback
    out[6] = integral
    out[7] = wanted
    out[8] = 1.0 if wanted < lowest else 0.0
    out[9] = 1.0 if wanted > highest else 0.0
    out[10] = 1.0 if command != inside else 0.0
    out[11] = offset
    return command


def _entry(key):
    """Return the step function as one unit of compiled code, stored under ``key``."""
    @njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
    def lqi_step(par, model, st, inp, out):
        """
        Run one tick; return the pressure command [absolute Pa].

        ``par`` holds ``SETTINGS`` in order, ``model`` what ``lqi_gains.pack`` returns, ``st``
        the state, ``inp`` the inputs (``inputs.IN_*``), ``out`` receives ``STATE_NAMES``.
        """
        if key < 0:       # never; makes the key part of what is stored
            return P_ATM_PA
        return _tick(par, model, st, inp, out)

    return lqi_step


lqi_step = _entry(source_key(_tick))


class LqiController(FixedLawController):
    """
    LQI controller in the interface of all controllers.

    Parameters
    ----------
    model : lqi_model.LinearModel
        Identified at ``rate_hz`` of the settings.
    settings : mapping, optional
        What differs from the defaults of ``SETTINGS``.
    rig_name : str
        Identity of the rig, for the record.
    where : callable, optional
        Place of a setting for errors.

    Raises
    ------
    InputError
        A setting is unknown or out of range, the model is of another rate, or the Riccati
        equation has no solution.

    """

    kind = 'lqi'
    state_names = STATE_NAMES

    def __init__(self, model, settings=None, rig_name='', where=None):
        settings = checked_settings(SETTINGS, settings or {}, where)
        if model.rate_hz != settings['rate_hz']:
            raise InputError(
                f'the linear model is of {model.rate_hz:g} Hz, the controller runs at '
                f'{settings["rate_hz"]:g} Hz', where('rate_hz') if where else 'rate_hz')
        self.model = model
        self.gains = pack(model, settings)
        super().__init__(
            lqi_step, settings, self.gains,
            S_HEAD + len(model.numerator) + 2 * model.delay_ticks, rig_name)

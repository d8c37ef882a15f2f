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

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.control.fixed_law import FixedLawController
from pam_actuation.control.inputs import INPUT, MAX_AGE_S
from pam_actuation.control.law_parts import first_command_pa, integral_growth, sent, tracked
from pam_actuation.control.lqi_gains import (
    MAX_DELAY_TICKS, MAX_ORDER, MODEL, observer_gains, pack, used_numbers)
from pam_actuation.control.lqi_model import LinearModel
from pam_actuation.control.observer import gains_at
from pam_actuation.control.settings import checked_settings, parameter_record, setting
from pam_sim.annotations import FloatArray
from pam_sim.compiled import Compiled, compiled, entry_point, inlined, source_key
from pam_sim.errors import InputError
from pam_sim.records import part, record
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.control.sofc.rule_table import RuleBase

SETTINGS = (
    setting('rate_hz', 'Hz', 200.0, 20.0, 1000.0, 'control rate'),
    setting('lead_s', 's', 0.0, 0.0, 0.5, 'preview of the feed-forward'),
    setting('reference_feedforward', '-', 1.0, 0.0, 1.0,
            'share of the pressure at rest for the reference that is fed forward'),
    setting('integral_weight', 'mm2/(mm s)2', 30.0, 1e-6, 1e8, 'weight of the integral'),
    setting('command_weight', 'mm2/kPa2', 1e-2, 1e-8, 1e4, 'weight of the command'),
    setting('disturbance_pa', 'Pa', 1e3, 1e-2, 1e6, 'disturbance the observer expects, a tick'),
    setting('noise_m', 'm', 1e-5, 1e-8, 1e-2, 'sensor noise the observer expects'),
    setting('anti_windup_time_s', 's', 0.05, 0.01, 10.0, 'back-calculation time constant'),
    setting('min_pressure_gauge_pa', 'Pa', 0.0, 0.0, 6e5, 'lowest command'),
    setting('max_pressure_gauge_pa', 'Pa', 6e5, 1e3, 1e6, 'highest command'),
    setting('slew_pa_per_s', 'Pa/s', 3e6, 1e4, 1e9, 'fastest change of the command'),
    setting('start_time_s', 's', 0.25, 0.01, 10.0, 'decay of the bumpless start offset'),
)
PARAMETERS = parameter_record(SETTINGS)
STATE = record(
    'started',                        # 1 after the first tick
    'offset_m',                       # of the reference, from the bumpless start
    'integral_pa',
    'command_pa',                     # of the tick before
    'error_m',                        # of the tick before
    ('estimate_m', MAX_ORDER),        # state of the model
    ('acting_pa', MAX_DELAY_TICKS),   # commands on their way, oldest first
    ('feedforward_pa', MAX_DELAY_TICKS),    # what they contain of it
    'unread_ticks',                   # since the last correction
)
# The names on topic ``controller_state``.
OUTPUT = record(
    'command_pa', 'error_m', 'estimated_contraction_m', 'innovation_m', 'feedforward_pa',
    'state_feedback_pa', 'integral_pa', 'unlimited_command_pa', 'saturated_low',
    'saturated_high', 'slew_limited', 'start_offset_m')


@compiled
def _rest(model: np.record, st: np.record, contraction_m: float) -> None:
    """Set the estimate to rest at a deviation [m] from the operating point."""
    n = int(model.order)
    for i in range(n):
        st.estimate_m[i] = model.rest[i] * contraction_m


@compiled
def _state_feedback(model: np.record, st: np.record, target_m: float) -> float:
    """Return the feedback [Pa] of estimate and commands on their way about a target [m]."""
    n, d = int(model.order), int(model.delay_ticks)
    total = 0.0
    for i in range(n):
        wanted = model.rest[i] * target_m
        total -= model.state_gain_pa_per_m[i] * (st.estimate_m[i] - wanted)
    for i in range(d):
        total -= model.delay_gain[i] * (st.acting_pa[i] - st.feedforward_pa[i])
    return total


@compiled
def _predict(model: np.record, st: np.record, command: float, feedforward: float) -> None:
    """Advance the estimate by one tick and put a command (deviation [Pa]) on its way."""
    n, d = int(model.order), int(model.delay_ticks)
    acting = command
    if d > 0:
        acting = st.acting_pa[0]
        for i in range(d - 1):
            st.acting_pa[i] = st.acting_pa[i + 1]
            st.feedforward_pa[i] = st.feedforward_pa[i + 1]
        st.acting_pa[d - 1] = command
        st.feedforward_pa[d - 1] = feedforward
    first = st.estimate_m[0]
    for i in range(n):
        following = st.estimate_m[i + 1] if i + 1 < n else 0.0
        st.estimate_m[i] = (
            following - model.denominator[i] * first + model.numerator_m_per_pa[i] * acting)


@compiled
def _start(par: np.record, model: np.record, st: np.record, inp: np.record,
           feedforward: float) -> None:
    """Begin so that the reference starts where the muscle is and the command where it is."""
    d = int(model.delay_ticks)
    y = inp.contraction_m - model.contraction_m
    st.started = 1.0
    _rest(model, st, y)
    st.command_pa = first_command_pa(
        inp.pressure_pa, P_ATM_PA + par.min_pressure_gauge_pa,
        P_ATM_PA + par.max_pressure_gauge_pa)
    deviation = st.command_pa - model.pressure_pa
    for i in range(d):
        st.acting_pa[i] = deviation
        st.feedforward_pa[i] = feedforward
    st.integral_pa = deviation - feedforward - _state_feedback(
        model, st, par.reference_feedforward * y)


@inlined
def _tick(par: np.record, model: np.record, observer: FloatArray, st: np.record, inp: np.record,
          out: np.record) -> float:
    """Run one tick; see ``lqi_step``."""
    period = 1.0 / par.rate_hz
    n = int(model.order)
    x = inp.contraction_m
    y = x - model.contraction_m
    begins = st.started < 0.5
    if begins:
        st.offset_m = inp.reference_m - x
    held_back = inp.held_back
    error, offset = tracked(par, st, inp, period)
    feedforward = par.reference_feedforward * model.pa_per_m * (
        inp.lead_reference_m - offset - model.contraction_m)
    if begins:
        _start(par, model, st, inp, feedforward)

    # Correct the estimate; the same measurement once more tells nothing new.
    elapsed = inp.elapsed_s
    innovation = y - st.estimate_m[0]
    if held_back != 0.0 or elapsed > MAX_AGE_S:    # False for NaN: one period
        _rest(model, st, y)                # what moved it is not known
        st.unread_ticks = 0.0
    elif not elapsed <= 0.0:
        at = gains_at(observer, n, st.unread_ticks)
        for i in range(n):
            st.estimate_m[i] += observer[at + i] * innovation
        st.unread_ticks = 0.0

    target = par.reference_feedforward * (inp.reference_m - offset - model.contraction_m)
    feedback = _state_feedback(model, st, target)
    integral = st.integral_pa
    estimate = st.estimate_m[0] + model.contraction_m
    wanted = model.pressure_pa + feedforward + feedback + integral
    _, command = sent(par, st, out, wanted, period)
    st.integral_pa = integral + period * integral_growth(
        model.integral_gain_pa_per_m_s * error, (command - wanted) / par.anti_windup_time_s,
        held_back)
    _predict(model, st, command - model.pressure_pa, feedforward)
    st.unread_ticks += 1.0
    out.error_m = error
    out.estimated_contraction_m = estimate
    out.innovation_m = innovation
    out.feedforward_pa = feedforward
    out.state_feedback_pa = feedback
    out.integral_pa = integral
    out.start_offset_m = offset
    return command


@inlined
def _step(par: FloatArray, model: FloatArray, observer: FloatArray, st: FloatArray,
          inp: FloatArray, out: FloatArray) -> float:
    """Run one tick on arrays; see ``lqi_step``."""
    return _tick(part(par, 0, PARAMETERS), part(model, 0, MODEL), observer, part(st, 0, STATE),
                 part(inp, 0, INPUT), part(out, 0, OUTPUT))


def _entry(key: int) -> Compiled[..., float]:
    """Return the step function as one unit of compiled code, stored under ``key``."""
    @entry_point
    def lqi_step(par: FloatArray, model: FloatArray, observer: FloatArray, st: FloatArray,
                 inp: FloatArray, out: FloatArray) -> float:
        """
        Run one tick; return the pressure command [absolute Pa].

        Arrays of ``PARAMETERS``, ``lqi_gains.MODEL``, rows of ``lqi_gains.observer_gains``,
        ``STATE``, ``inputs.INPUT`` and ``OUTPUT``; ``st`` and ``out`` are written.
        """
        if key < 0:       # never; makes the key part of what is stored
            return P_ATM_PA
        return _step(par, model, observer, st, inp, out)

    return lqi_step


lqi_step = _entry(source_key(_step))


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
        A setting is unknown or out of range, the model is of another rate or too long, or the
        Riccati equation has no solution.

    """

    kind = 'lqi'
    state_names = OUTPUT.names or ()

    def __init__(self, model: LinearModel, settings: Mapping[str, object] | None = None,
                 rig_name: str = '', where: Callable[[str], str] | None = None) -> None:
        checked = checked_settings(SETTINGS, settings, where)
        if model.rate_hz != checked['rate_hz']:
            raise InputError(
                f'the linear model is of {model.rate_hz:g} Hz, the controller runs at '
                f'{checked["rate_hz"]:g} Hz', where('rate_hz') if where else 'rate_hz')
        self.model = model
        rows = observer_gains(model, checked['disturbance_pa'], checked['noise_m'])
        self.gains, self.observer = pack(model, checked, rows[0]), rows.ravel()
        super().__init__(lqi_step, checked, self.gains, PARAMETERS, STATE, rig_name,
                         self.observer)

    def _fresh(self, settings: Mapping[str, object], rules: 'RuleBase | None') -> 'LqiController':
        return LqiController(self.model, settings, self.rig_name)

    def file_entries(self) -> dict[str, object]:
        """Return linear model and gains; an LQI controller has no static inverse."""
        return {
            'model': self.model.to_dict(),
            'gains': self.gains[used_numbers(self.gains)].tolist(),
            'observer_gains': self.observer.tolist()}

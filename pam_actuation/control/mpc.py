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
Linear model predictive control: a baseline that plans ahead on an identified model.

In every tick the commands of a horizon are chosen so that the model's contraction follows the
reference, see ``mpc_gains``; the first of them is sent. A Kalman filter estimates the state and a
disturbance of the command, so that nothing is left at rest. Its gain is that of the ticks between
readings (``observer``). As long as no command of the plan is
out of bounds, the plan is linear in what is known. Otherwise coordinate descent solves the
quadratic programme with bounds. That is a few microseconds of compiled code, with the same bits
everywhere; a general solver needs a library and a thousand times that.

The reference of the horizon is known ``lead_s`` ahead, from the previews of the ticks before.
Beyond it goes on at its rate.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.control.fixed_law import FixedLawController
from pam_actuation.control.inputs import INPUT, MAX_AGE_S
from pam_actuation.control.law_parts import first_command_pa, sent, tracked
from pam_actuation.control.lqi_gains import MAX_DELAY_TICKS, MAX_ORDER
from pam_actuation.control.lqi_model import LinearModel
from pam_actuation.control.mpc_gains import HORIZON, MODEL, MOVES, observer_gains, pack
from pam_actuation.control.observer import gains_at
from pam_actuation.control.settings import checked_settings, parameter_record, setting
from pam_actuation.control.static_inverse import inverse_pressure_pa, inverse_to_mapping
from pam_sim.annotations import FloatArray
from pam_sim.compiled import Compiled, compiled, entry_point, inlined, source_key
from pam_sim.errors import InputError
from pam_sim.records import part, record
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.control.sofc.rule_table import RuleBase

PREVIEW_SIZE = 500
SETTINGS = (
    setting('rate_hz', 'Hz', 200.0, 20.0, 1000.0, 'control rate'),
    setting('lead_s', 's', 0.2, 0.0, 0.5, 'preview: how far ahead the reference is known'),
    setting('command_weight', 'mm2/kPa2', 0.1, 1e-8, 1e4,
            'weight of the command beyond what holds the reference'),
    setting('change_weight', 'mm2/kPa2', 1e-2, 1e-8, 1e4,
            'weight of the change of the command from block to block'),
    setting('disturbance_pa', 'Pa', 1e2, 1e-2, 1e6, 'change of the disturbance, a tick'),
    setting('noise_m', 'm', 1e-5, 1e-8, 1e-2, 'sensor noise the observer expects'),
    setting('min_pressure_gauge_pa', 'Pa', 0.0, 0.0, 6e5, 'lowest command'),
    setting('max_pressure_gauge_pa', 'Pa', 6e5, 1e3, 1e6, 'highest command'),
    setting('slew_pa_per_s', 'Pa/s', 3e6, 1e4, 1e9, 'fastest change of the command'),
    setting('start_time_s', 's', 0.25, 0.01, 10.0, 'decay of the bumpless start offset'),
)
PARAMETERS = parameter_record(SETTINGS)
STATE = record(
    'started',                        # 1 after the first tick
    'ticks',
    'offset_m',                       # of the reference, from the bumpless start
    'command_pa',                     # of the tick before
    'error_m',                        # of the tick before
    'last_pa',                        # equivalent pressure of that command
    'disturbance_pa',
    'calm_pa',                        # the same behind a low pass
    ('estimate_m', MAX_ORDER),        # state of the model
    ('predicted_m', MAX_ORDER),       # the same when a command of now arrives
    ('acting_pa', MAX_DELAY_TICKS),   # commands on their way, oldest first
    ('preview_m', PREVIEW_SIZE),    # lead references of the ticks before
    ('reference_m', 2 * HORIZON),     # of the horizon and what follows
    ('plan_pa', MOVES),
    ('wanted_pa', MOVES),             # the same without bounds
    'unread_ticks',                   # since the last correction
)
OUTPUT = record(
    'command_pa', 'error_m', 'estimated_contraction_m', 'innovation_m', 'disturbance_pa',
    'bounded', 'unlimited_command_pa', 'saturated_low', 'saturated_high', 'slew_limited',
    'start_offset_m')
_CALM_S = 2.0
_SWEEPS, _HALVINGS = 40, 40
_CLOSE_PA = 1.0             # change of a plan in a sweep, below which it is done


@compiled
def _rest(model: np.record, st: np.record, contraction_m: float) -> None:
    """Set the estimate to rest at a deviation [m] from the operating point."""
    for i in range(int(model.order)):
        st.estimate_m[i] = model.rest[i] * contraction_m


@compiled
def _advance(model: np.record, values_m: FloatArray, acting_pa: float) -> None:
    """Advance a state of the model by one tick."""
    n = int(model.order)
    first = values_m[0]
    for i in range(n):
        following = values_m[i + 1] if i + 1 < n else 0.0
        values_m[i] = following - model.denominator[i] * first + (
            model.numerator_m_per_pa[i] * acting_pa)


@compiled
def _equivalent_pa(model: np.record, inverse: FloatArray, pressure_pa: float) -> float:
    """Return the equivalent pressure of a pressure, by halving; the inverse rises."""
    low: float = model.lowest_pa
    high: float = model.highest_pa
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if inverse_pressure_pa(
                inverse, model.contraction_m + middle / model.pa_per_m) < pressure_pa:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@compiled
def _wanted(par: np.record, model: np.record, st: np.record, inp: np.record,
            offset_m: float) -> None:
    """Fill the reference of the horizon, less the operating point."""
    tick, period = int(st.ticks), 1.0 / par.rate_hz
    lead = int(round(par.lead_s * par.rate_hz))
    st.preview_m[tick % PREVIEW_SIZE] = inp.lead_reference_m
    first = int(model.delay_ticks) + 1
    for i in range(HORIZON + int(model.lag_ticks)):
        ahead = first + i
        if ahead > lead:
            value = inp.lead_reference_m + (ahead - lead) * period * inp.lead_rate_m_per_s
        elif lead - ahead <= tick:
            value = st.preview_m[(tick - (lead - ahead)) % PREVIEW_SIZE]
        else:                         # it was not told yet
            share = ahead / lead
            value = (1.0 - share) * inp.reference_m + share * inp.lead_reference_m
        st.reference_m[i] = value - offset_m - model.contraction_m


@compiled
def _plan(model: np.record, st: np.record) -> bool:
    """Fill the plan; return whether a bound changed it."""
    bounded, lag = False, int(model.lag_ticks)
    for j in range(MOVES):
        total = model.last_gain[j] * st.last_pa - model.disturbance_gain[j] * st.disturbance_pa
        for i in range(HORIZON):
            at = j * HORIZON + i
            total += (model.reference_gain_pa_per_m[at] * st.reference_m[i]
                      + model.held_gain_pa_per_m[at] * st.reference_m[i + lag])
        for i in range(int(model.order)):
            at = j * MAX_ORDER + i
            total -= model.state_gain_pa_per_m[at] * st.predicted_m[i]
        st.wanted_pa[j] = total
        st.plan_pa[j] = min(max(total, model.lowest_pa), model.highest_pa)
        bounded = bounded or st.plan_pa[j] != total
    if not bounded:
        return False
    for _ in range(_SWEEPS):
        moved = 0.0
        for j in range(MOVES):
            slope = 0.0
            for i in range(MOVES):
                at = j * MOVES + i
                slope += model.hessian[at] * (st.plan_pa[i] - st.wanted_pa[i])
            best = min(max(st.plan_pa[j] - slope, model.lowest_pa), model.highest_pa)
            moved = max(moved, abs(best - st.plan_pa[j]))
            st.plan_pa[j] = best
        if moved < _CLOSE_PA:
            break
    return True


@inlined
def _tick(par: np.record, model: np.record, inverse: FloatArray, observer: FloatArray,
          st: np.record, inp: np.record, out: np.record) -> float:
    """Run one tick; see ``mpc_step``."""
    period = 1.0 / par.rate_hz
    n, d = int(model.order), int(model.delay_ticks)
    x = inp.contraction_m
    y = x - model.contraction_m
    begins = st.started < 0.5
    if begins:
        st.started = 1.0
        st.offset_m = inp.reference_m - x
        st.command_pa = first_command_pa(
            inp.pressure_pa, P_ATM_PA + par.min_pressure_gauge_pa,
            P_ATM_PA + par.max_pressure_gauge_pa)
        st.last_pa = _equivalent_pa(model, inverse, st.command_pa)
        st.disturbance_pa = model.rest_pa_per_m * y - st.last_pa
        st.calm_pa = st.disturbance_pa
        for i in range(d):
            st.acting_pa[i] = st.last_pa
    held_back = inp.held_back
    error, offset = tracked(par, st, inp, period)

    # Correct the estimate; the same measurement once more tells nothing new.
    elapsed = inp.elapsed_s
    innovation = y - st.estimate_m[0]
    if begins or held_back != 0.0 or elapsed > MAX_AGE_S:    # False for NaN: one period
        # What moved it is no disturbance of the command, nor what led up to it.
        _rest(model, st, y)
        st.disturbance_pa = st.calm_pa
        st.unread_ticks = 0.0
    elif not elapsed <= 0.0:
        at = gains_at(observer, n + 1, st.unread_ticks)
        for i in range(n):
            st.estimate_m[i] += observer[at + i] * innovation
        st.disturbance_pa += observer[at + n] * innovation
        st.unread_ticks = 0.0
        st.calm_pa += period / (_CALM_S + period) * (st.disturbance_pa - st.calm_pa)
    for i in range(n):
        st.predicted_m[i] = st.estimate_m[i]
    for i in range(d):
        _advance(model, st.predicted_m, st.acting_pa[i] + st.disturbance_pa)

    _wanted(par, model, st, inp, offset)
    bounded = _plan(model, st)
    wanted = inverse_pressure_pa(inverse, model.contraction_m + st.plan_pa[0] / model.pa_per_m)
    _, command = sent(par, st, out, wanted, period)
    last = st.plan_pa[0] if command == wanted else _equivalent_pa(model, inverse, command)
    acting = last
    if d > 0:
        acting = st.acting_pa[0]
        for i in range(d - 1):
            st.acting_pa[i] = st.acting_pa[i + 1]
        st.acting_pa[d - 1] = last
    estimate = st.estimate_m[0] + model.contraction_m
    _advance(model, st.estimate_m, acting + st.disturbance_pa)
    st.last_pa = last
    st.ticks += 1.0
    st.unread_ticks += 1.0
    out.error_m = error
    out.estimated_contraction_m = estimate
    out.innovation_m = innovation
    out.disturbance_pa = st.disturbance_pa
    out.bounded = 1.0 if bounded else 0.0
    out.saturated_low = 1.0 if st.plan_pa[0] <= model.lowest_pa else 0.0
    out.saturated_high = 1.0 if st.plan_pa[0] >= model.highest_pa else 0.0
    out.start_offset_m = offset
    return command


@inlined
def _step(par: FloatArray, model: FloatArray, inverse: FloatArray, observer: FloatArray,
          st: FloatArray, inp: FloatArray, out: FloatArray) -> float:
    """Run one tick on arrays; see ``mpc_step``."""
    return _tick(part(par, 0, PARAMETERS), part(model, 0, MODEL), inverse, observer,
                 part(st, 0, STATE), part(inp, 0, INPUT), part(out, 0, OUTPUT))


def _entry(key: int) -> Compiled[..., float]:
    """Return the step function as one unit of compiled code, stored under ``key``."""
    @entry_point
    def mpc_step(par: FloatArray, model: FloatArray, inverse: FloatArray, observer: FloatArray,
                 st: FloatArray, inp: FloatArray, out: FloatArray) -> float:
        """
        Run one tick; return the pressure command [absolute Pa].

        Arrays of ``PARAMETERS``, ``mpc_gains.MODEL``, the static inverse, rows of
        ``mpc_gains.observer_gains``, ``STATE``, ``inputs.INPUT`` and ``OUTPUT``; ``st`` and
        ``out`` are written.
        """
        if key < 0:       # never; makes the key part of what is stored
            return P_ATM_PA
        return _step(par, model, inverse, observer, st, inp, out)

    return mpc_step


mpc_step = _entry(source_key(_step))


class MpcController(FixedLawController):
    """
    Model predictive control in the interface of all controllers.

    Parameters
    ----------
    model : lqi_model.LinearModel
        Of ``mpc_gains.identify_behind_inverse``, at ``rate_hz`` of the settings.
    static_inverse : numpy.ndarray
        The table it was identified behind.
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

    kind = 'mpc'
    state_names = OUTPUT.names or ()

    def __init__(self, model: LinearModel, static_inverse: FloatArray,
                 settings: Mapping[str, object] | None = None, rig_name: str = '',
                 where: Callable[[str], str] | None = None) -> None:
        checked = checked_settings(SETTINGS, settings, where)
        if model.rate_hz != checked['rate_hz']:
            raise InputError(
                f'the linear model is of {model.rate_hz:g} Hz, the controller runs at '
                f'{checked["rate_hz"]:g} Hz', where('rate_hz') if where else 'rate_hz')
        self.model = model
        self.static_inverse = np.ascontiguousarray(static_inverse, dtype=float)
        rows = observer_gains(model, checked['disturbance_pa'], checked['noise_m'])
        self.gains, self.observer = pack(
            model, self.static_inverse, checked, rows[0]), rows.ravel()
        super().__init__(mpc_step, checked, self.gains, PARAMETERS, STATE, rig_name,
                         self.static_inverse, self.observer)

    def _fresh(self, settings: Mapping[str, object], rules: 'RuleBase | None') -> 'MpcController':
        return MpcController(self.model, self.static_inverse, settings, self.rig_name)

    def file_entries(self) -> dict[str, object]:
        """Return linear model, gains and static inverse."""
        return {'static_inverse': inverse_to_mapping(self.static_inverse),
                'model': self.model.to_dict(), 'gains': self.gains.tolist(),
                'observer_gains': self.observer.tolist()}

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
PID with anti-windup, optionally on top of the static inverse: the baseline.

Derivative on the filtered change of error, back-calculation against the real
limits of pressure and of its rate, bumpless start. Same interface as the
self-organizing controller; it has no rules to learn.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.control.fixed_law import FixedLawController
from pam_actuation.control.inputs import INPUT
from pam_actuation.control.law_parts import (
    filtered_change, first_command_pa, integral_growth, sent, settled_part, tracked)
from pam_actuation.control.settings import checked_settings, parameter_record, setting, switch
from pam_actuation.control.static_inverse import inverse_pressure_pa
from pam_sim.annotations import FloatArray
from pam_sim.compiled import Compiled, compiled, entry_point, inlined, source_key
from pam_sim.records import part, record
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.control.sofc.rule_table import RuleBase

SETTINGS = (
    setting('rate_hz', 'Hz', 200.0, 20.0, 1000.0, 'control rate'),
    setting('lead_s', 's', 0.0, 0.0, 0.5, 'preview of the static inverse'),
    switch('use_static_inverse', 0.0, ('no', 'yes'), 'whether the static inverse is added'),
    setting('proportional_pa_per_m', 'Pa/m', 2e6, 0.0, 5e7, 'proportional gain'),
    setting('integral_pa_per_m_s', 'Pa/(m s)', 2.5e7, 0.0, 1e9, 'integral gain'),
    setting('derivative_pa_s_per_m', 'Pa s/m', 1.5e5, 0.0, 5e6, 'derivative gain'),
    setting('anti_windup_time_s', 's', 0.2, 0.01, 10.0, 'back-calculation time constant'),
    setting('change_filter_s', 's', 0.02, 0.0, 0.5, 'low pass on the change of error'),
    setting('min_pressure_gauge_pa', 'Pa', 0.0, 0.0, 6e5, 'lowest command'),
    setting('max_pressure_gauge_pa', 'Pa', 6e5, 1e3, 1e6, 'highest command'),
    setting('slew_pa_per_s', 'Pa/s', 3e6, 1e4, 1e9, 'fastest change of the command'),
    setting('start_time_s', 's', 0.25, 0.01, 10.0, 'decay of the bumpless start offset'),
    setting('forget_catch_up', '-', 0.0, 0.0, 1.0,
            'share of the error of the way back after a fault that the integral leaves out'),
)

PARAMETERS = parameter_record(SETTINGS)
STATE = record(
    'started',                        # 1 after the first tick
    'offset_m',                       # of the reference, from the bumpless start
    'contraction_m',                  # measured before
    'change_m_per_s',                 # of the error, filtered
    'integral_pa',
    'command_pa',                     # of the tick before
    'history_ticks',                  # ticks since the start
    'error_m',                        # of the tick before
    'catches_up',                     # 1 since the driver did not follow, until the offset is 0
)
# The names on topic ``controller_state``.
OUTPUT = record(
    'command_pa', 'error_m', 'change_of_error_m_per_s', 'inverse_pa', 'proportional_pa',
    'integral_pa', 'derivative_pa', 'unlimited_command_pa', 'saturated_low', 'saturated_high',
    'slew_limited', 'start_offset_m')


@compiled
def _start(par: np.record, st: np.record, inp: np.record) -> None:
    """Begin so that the reference starts where the muscle is and the command where it is."""
    st.started = 1.0
    st.offset_m = inp.reference_m - inp.contraction_m
    st.change_m_per_s = 0.0
    st.history_ticks = 0.0
    st.catches_up = 0.0
    st.command_pa = first_command_pa(
        inp.pressure_pa, P_ATM_PA + par.min_pressure_gauge_pa,
        P_ATM_PA + par.max_pressure_gauge_pa)
    st.integral_pa = 0.0
    if par.use_static_inverse < 0.5:
        st.integral_pa = st.command_pa - P_ATM_PA


@inlined
def tracking_error(par: np.record, st: np.record, inp: np.record, has_former: bool
                   ) -> tuple[float, float]:
    """
    Return error and offset of the reference [m]; note what the next tick needs of this one.

    ``par``, ``st`` and ``inp`` are records with the fields of ``PARAMETERS``, ``STATE`` and
    ``inputs.INPUT``; ``has_former`` tells whether a contraction was measured before.
    """
    period = 1.0 / par.rate_hz
    x = inp.contraction_m
    st.change_m_per_s = filtered_change(
        st.change_m_per_s, par.change_filter_s, inp.reference_rate_m_per_s,
        x - st.contraction_m, inp.elapsed_s, period, has_former)
    st.contraction_m = x
    return tracked(par, st, inp, period)


@inlined
def command_of(par: np.record, st: np.record, inp: np.record, out: np.record, error: float,
               offset: float, remembered: float, base_pa: float, added_pa: float) -> float:
    """
    Return the command [absolute Pa] for an error, write the outputs, let the integral grow.

    It grows on ``remembered``, that part of the error [m]. ``base_pa`` is what the terms of the
    PID are added to, ``added_pa`` what comes beside them.
    Records as of ``tracking_error``, and ``OUTPUT``.
    """
    period = 1.0 / par.rate_hz
    proportional = par.proportional_pa_per_m * error
    derivative = par.derivative_pa_s_per_m * st.change_m_per_s
    integral = st.integral_pa
    wanted = base_pa + proportional + integral + derivative + added_pa
    _, command = sent(par, st, out, wanted, period)
    st.integral_pa = integral + period * integral_growth(
        par.integral_pa_per_m_s * remembered,
        (command - wanted) / par.anti_windup_time_s, inp.held_back)
    out.error_m = error
    out.change_of_error_m_per_s = st.change_m_per_s
    out.inverse_pa = base_pa
    out.proportional_pa = proportional
    out.integral_pa = integral
    out.derivative_pa = derivative
    out.start_offset_m = offset
    return command


@compiled
def _remembered(par: np.record, st: np.record, inp: np.record, error: float,
                offset: float) -> float:
    """Return the part of the error [m] that the integral grows on."""
    if inp.held_back != 0.0:
        st.catches_up = 1.0
    elif offset == 0.0:
        st.catches_up = 0.0
    if st.catches_up < 0.5:
        return error
    return error + par.forget_catch_up * (settled_part(error, offset) - error)


@inlined
def _tick(par: np.record, inverse: FloatArray, st: np.record, inp: np.record,
          out: np.record) -> float:
    """Run one tick; see ``pid_step``."""
    if st.started < 0.5:
        _start(par, st, inp)
    error, offset = tracking_error(par, st, inp, st.history_ticks > 0.0)
    st.history_ticks += 1.0
    base = P_ATM_PA
    if par.use_static_inverse > 0.5:
        base = inverse_pressure_pa(inverse, inp.lead_reference_m - offset)
    remembered = _remembered(par, st, inp, error, offset)
    return command_of(par, st, inp, out, error, offset, remembered, base, 0.0)


@inlined
def _step(par: FloatArray, inverse: FloatArray, st: FloatArray, inp: FloatArray,
          out: FloatArray) -> float:
    """Run one tick on arrays; see ``pid_step``."""
    return _tick(part(par, 0, PARAMETERS), inverse, part(st, 0, STATE), part(inp, 0, INPUT),
                 part(out, 0, OUTPUT))


def _entry(key: int) -> Compiled[..., float]:
    """Return the step function as one unit of compiled code, stored under ``key``."""
    @entry_point
    def pid_step(par: FloatArray, inverse: FloatArray, st: FloatArray, inp: FloatArray,
                 out: FloatArray) -> float:
        """
        Run one tick; return the pressure command [absolute Pa].

        ``par``, ``st``, ``inp`` and ``out`` are arrays of ``PARAMETERS``, ``STATE``,
        ``inputs.INPUT`` and ``OUTPUT``; ``st`` and ``out`` are written. ``inverse`` is the
        static inverse table.
        """
        if key < 0:       # never; makes the key part of what is stored
            return P_ATM_PA
        return _step(par, inverse, st, inp, out)

    return pid_step


pid_step = _entry(source_key(_step))


class PidController(FixedLawController):
    """
    PID controller in the interface of all controllers.

    Parameters
    ----------
    static_inverse : numpy.ndarray
        Table of ``static_inverse.tabulate_static_inverse``; used if ``use_static_inverse`` is 1.
    settings : mapping, optional
        What differs from the defaults of ``SETTINGS``.
    rig_name : str
        Identity of the rig, for the record.
    where : callable, optional
        Place of a setting for errors.

    Raises
    ------
    InputError
        A setting is unknown or out of range.

    """

    kind = 'pid'
    state_names = OUTPUT.names or ()

    def __init__(self, static_inverse: FloatArray, settings: Mapping[str, object] | None = None,
                 rig_name: str = '', where: Callable[[str], str] | None = None) -> None:
        self.static_inverse = np.ascontiguousarray(static_inverse, dtype=float)
        super().__init__(
            pid_step, checked_settings(SETTINGS, settings, where),
            self.static_inverse,
            PARAMETERS, STATE, rig_name)

    def _fresh(self, settings: Mapping[str, object], rules: 'RuleBase | None') -> 'PidController':
        return PidController(self.static_inverse, settings, self.rig_name)

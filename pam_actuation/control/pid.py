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

from numba import njit
import numpy as np
from pam_actuation.control import inputs as place
from pam_actuation.control.fixed_law import FixedLawController
from pam_actuation.control.law_parts import (
    faded_offset, filtered_change, first_command_pa, held_offset, integral_growth, limited)
from pam_actuation.control.settings import checked_settings, Setting
from pam_actuation.control.static_inverse import inverse_pressure_pa
from pam_sim.compiled import compiled, source_key
from pam_sim.units import P_ATM_PA

SETTINGS = (
    Setting('rate_hz', 'Hz', 200.0, 20.0, 1000.0, 'control rate'),
    Setting('lead_s', 's', 0.0, 0.0, 0.5, 'preview of the static inverse'),
    Setting('use_static_inverse', '-', 0.0, 0.0, 1.0, '1 = add the static inverse'),
    Setting('proportional_pa_per_m', 'Pa/m', 2e6, 0.0, 5e7, 'proportional gain'),
    Setting('integral_pa_per_m_s', 'Pa/(m s)', 2.5e7, 0.0, 1e9, 'integral gain'),
    Setting('derivative_pa_s_per_m', 'Pa s/m', 1.5e5, 0.0, 5e6, 'derivative gain'),
    Setting('anti_windup_time_s', 's', 0.2, 0.01, 10.0, 'back-calculation time constant'),
    Setting('change_filter_s', 's', 0.02, 0.0, 0.5, 'low pass on the change of error'),
    Setting('min_pressure_gauge_pa', 'Pa', 0.0, 0.0, 6e5, 'lowest command'),
    Setting('max_pressure_gauge_pa', 'Pa', 6e5, 1e3, 1e6, 'highest command'),
    Setting('slew_pa_per_s', 'Pa/s', 3e6, 1e4, 1e9, 'fastest change of the command'),
    Setting('start_time_s', 's', 0.25, 0.01, 10.0, 'decay of the bumpless start offset'),
)

(P_RATE, P_LEAD, P_INVERSE, P_PROPORTIONAL, P_INTEGRAL, P_DERIVATIVE, P_ANTI_WINDUP_TIME,
 P_CHANGE_FILTER, P_MIN, P_MAX, P_SLEW, P_START_TIME) = range(len(SETTINGS))
(S_STARTED, S_OFFSET, S_CONTRACTION, S_RATE, S_INTEGRAL, S_OUTPUT, S_HISTORY, S_ERROR) = range(8)
STATE_COUNT = 8
STATE_NAMES = (
    'command_pa', 'error_m', 'change_of_error_m_per_s', 'inverse_pa', 'proportional_pa',
    'integral_pa', 'derivative_pa', 'unlimited_command_pa', 'saturated_low', 'saturated_high',
    'slew_limited', 'start_offset_m')


@compiled
def _start(par, inverse, st, inp):
    """Begin so that the reference starts where the muscle is and the command where it is."""
    st[S_STARTED] = 1.0
    st[S_OFFSET] = inp[place.IN_REFERENCE] - inp[place.IN_CONTRACTION]
    st[S_RATE] = 0.0
    st[S_HISTORY] = 0.0
    st[S_OUTPUT] = first_command_pa(
        inp[place.IN_PRESSURE], P_ATM_PA + par[P_MIN], P_ATM_PA + par[P_MAX])
    st[S_INTEGRAL] = 0.0
    if par[P_INVERSE] < 0.5:
        st[S_INTEGRAL] = st[S_OUTPUT] - P_ATM_PA


@compiled
def _tick(par, inverse, st, inp, out):
    """Run one tick; see ``pid_step``."""
    period = 1.0 / par[P_RATE]
    if st[S_STARTED] < 0.5:
        _start(par, inverse, st, inp)
    x = inp[place.IN_CONTRACTION]
    st[S_RATE] = filtered_change(
        st[S_RATE], par[P_CHANGE_FILTER], inp[place.IN_REFERENCE_RATE],
        x - st[S_CONTRACTION], inp[place.IN_ELAPSED], period, st[S_HISTORY] > 0.0)
    st[S_CONTRACTION] = x
    st[S_HISTORY] += 1.0
    held_back = inp[place.IN_HELD_BACK]
    offset = held_offset(st[S_OFFSET], held_back, inp[place.IN_REFERENCE] - x, st[S_ERROR],
                         par[P_START_TIME], period)
    st[S_OFFSET] = faded_offset(offset, par[P_START_TIME], period)
    error = inp[place.IN_REFERENCE] - offset - x
    st[S_ERROR] = error
    base = P_ATM_PA
    if par[P_INVERSE] > 0.5:
        base = inverse_pressure_pa(inverse, inp[place.IN_LEAD_REFERENCE] - offset)
    proportional = par[P_PROPORTIONAL] * error
    derivative = par[P_DERIVATIVE] * st[S_RATE]
    integral = st[S_INTEGRAL]
    wanted = base + proportional + integral + derivative
    lowest = P_ATM_PA + par[P_MIN]
    highest = P_ATM_PA + par[P_MAX]
    inside, command = limited(wanted, st[S_OUTPUT], lowest, highest, par[P_SLEW] * period)
    st[S_OUTPUT] = command
    st[S_INTEGRAL] = integral + period * integral_growth(
        par[P_INTEGRAL] * error, (command - wanted) / par[P_ANTI_WINDUP_TIME], held_back)
    out[0] = command
    out[1] = error
    out[2] = st[S_RATE]
    out[3] = base
    out[4] = proportional
    out[5] = integral
    out[6] = derivative
    out[7] = wanted
    out[8] = 1.0 if wanted < lowest else 0.0
    out[9] = 1.0 if wanted > highest else 0.0
    out[10] = 1.0 if command != inside else 0.0
    out[11] = offset
    return command


def _entry(key):
    """Return the step function as one unit of compiled code, stored under ``key``."""
    @njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
    def pid_step(par, inverse, st, inp, out):
        """
        Run one tick; return the pressure command [absolute Pa].

        ``par`` holds ``SETTINGS`` in order, ``inverse`` the static inverse table, ``st`` the
        state, ``inp`` the inputs (``inputs.IN_*``), ``out`` receives ``STATE_NAMES``.
        """
        if key < 0:       # never; makes the key part of what is stored
            return P_ATM_PA
        return _tick(par, inverse, st, inp, out)

    return pid_step


pid_step = _entry(source_key(_tick))


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
    state_names = STATE_NAMES

    def __init__(self, static_inverse, settings=None, rig_name='', where=None):
        self.static_inverse = np.ascontiguousarray(static_inverse, dtype=float)
        super().__init__(
            pid_step, checked_settings(SETTINGS, settings or {}, where), self.static_inverse,
            STATE_COUNT, rig_name)

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
The lag of the valve, found in motion.

The commands of one preview ago, the dead time, behind a low pass of first order, are the
pressure to be expected. The measured pressure differs from it. This difference is correlated with
what another lag would change, which gives the lag. The method is recursive least squares with
forgetting, on the output of the model itself (an output error method, Ljung 1999). A zero error
of the sensor or of the valve is behind a slow mean. An error of the dead time goes into the lag,
which makes up for it.

Where ``dead_time_s`` is set, the dead time is a second number of the same least squares. It is at
most the preview. Between two ticks the command is that of a straight line.
"""

import math

import numpy as np
from pam_actuation.control.inputs import MAX_AGE_S
from pam_actuation.control.sofc import credit
from pam_actuation.control.sofc.credit import Ring
from pam_sim.compiled import compiled
from pam_sim.records import record

_MEAN_TIME_S = 2.0        # the slow mean of what the pressure differs
_PRIOR_PA2_PER_S2 = 5e11  # what the setting counts: a second of slow motion
_REST_S = 1.0             # after a valve or driver that did not follow nothing is learned
_RANGE = 2.0              # the lag stays within the setting over and times this

LAG = record(
    'lag_s',
    'sensitivity_pa_per_s',           # of the expected pressure to the lag
    'information_pa2_per_s2',         # sum of its squares, with forgetting
    'dead_s',                         # from a command to its arrival
    'dead_sensitivity_pa_per_s',      # of the expected pressure to that dead time
    'both_information_pa2_per_s2',
    'dead_information_pa2_per_s2',
    'mean_pa',                        # of measured less expected pressure
    'rest_s',                         # for how long nothing is learned yet
)


@compiled
def _both(par: np.record, st: np.record, sensitivity: float, delayed: float, information: float,
          difference_pa: float) -> float:
    """Correct the dead time; return the correction of the lag that goes with it [s]."""
    forgotten = par.period_s / par.lag_memory_s
    both: float = st.both_information_pa2_per_s2
    own: float = st.dead_information_pa2_per_s2
    both += sensitivity * delayed - forgotten * both
    own += delayed * delayed - forgotten * own
    st.both_information_pa2_per_s2 = both
    st.dead_information_pa2_per_s2 = own
    first = information + _PRIOR_PA2_PER_S2
    second = own + _PRIOR_PA2_PER_S2
    whole = first * second - both * both
    dead_s = st.dead_s + difference_pa * (first * delayed - both * sensitivity) / whole
    st.dead_s = min(max(dead_s, par.dead_time_s / _RANGE), par.lead_s)
    return difference_pa * (second * sensitivity - both * delayed) / whole


@compiled
def ticks_of(par: np.record, st: np.record, age_s: float) -> tuple[int, float]:
    """
    Return how many ticks ago the command was sent that arrived ``age_s`` ago.

    Whole ticks and the rest; ``age_s`` is that of a measurement, ``st`` a ``LAG``.
    """
    ticks = min(age_s, MAX_AGE_S) / par.period_s
    ticks += st.dead_s / par.period_s if par.dead_time_s > 0.0 else par.answer_ticks
    whole = int(ticks)
    return whole, ticks - whole


@compiled
def command_of(ring: Ring, tick: int, whole: int, rest: float) -> float:
    """Return the command [Pa] of so many ticks ago."""
    newer: float = ring[credit.row_of(ring, tick, whole)].command_pa
    if rest > 0.0:
        newer += rest * (ring[credit.row_of(ring, tick, whole + 1)].command_pa - newer)
    return newer


@compiled
def _find(par: np.record, st: np.record, arrived_pa: float, arrived_pa_per_s: float,
          expected_pa: float, measured_pa: float) -> None:
    """
    Correct lag and dead time by one measurement; ``st`` is a ``LAG``.

    The command of one dead time ago has arrived and is expected behind the lag. A pressure that is
    not finite, or far from the expected one, tells nothing.
    """
    if not (par.lag_memory_s > 0.0 and st.lag_s > 0.0):
        return
    period: float = par.period_s
    setting_s: float = par.valve_lag_s
    lag_s: float = st.lag_s
    sensitivity: float = st.sensitivity_pa_per_s
    mean_pa: float = st.mean_pa
    information: float = st.information_pa2_per_s2
    slope = (arrived_pa - expected_pa) / lag_s
    sensitivity -= period / (lag_s + period) * (slope + sensitivity)
    st.sensitivity_pa_per_s = sensitivity
    delayed: float = st.dead_sensitivity_pa_per_s
    delayed -= period / (lag_s + period) * (arrived_pa_per_s + delayed)
    st.dead_sensitivity_pa_per_s = delayed
    difference = measured_pa - expected_pa
    if st.rest_s > 0.0 or not abs(difference) <= par.valve_gap_pa:
        return
    mean_pa += period / (_MEAN_TIME_S + period) * (difference - mean_pa)
    information += sensitivity * sensitivity - period / par.lag_memory_s * information
    if par.dead_time_s > 0.0:
        lag_s += _both(par, st, sensitivity, delayed, information, difference - mean_pa)
    else:
        lag_s += sensitivity * (difference - mean_pa) / (information + _PRIOR_PA2_PER_S2)
    st.mean_pa = mean_pa
    st.information_pa2_per_s2 = information
    st.lag_s = min(max(lag_s, setting_s / _RANGE), setting_s * _RANGE)


@compiled
def pressure_then(st: np.record, inp: np.record) -> float:
    """Return the measured pressure [Pa] at the time of the measured contraction."""
    measured: float = inp.pressure_pa
    return measured + (inp.pressure_age_s - inp.age_s) * st.arriving_pa_per_s


@compiled
def expected_then(st: np.record, inp: np.record) -> float:
    """Return the expected pressure [Pa] at the time of the measured contraction."""
    expected: float = st.expected_pa
    return expected - inp.age_s * st.arriving_pa_per_s


@compiled
def falls_behind(par: np.record, ring: Ring, st: np.record, inp: np.record) -> bool:
    """
    Tell whether the measured pressure is far from what the commands should have made of it.

    Expected is the command of one dead time ago behind the lag of the valve. ``st`` is a
    ``STATE``.
    """
    first = par.answer_ticks + (1.0 if par.dead_time_s > 0.0 else 0.0)
    if credit.known_ticks(par, st) < first:
        st.expected_pa = inp.pressure_pa
        if par.revision > 0.5 and not math.isfinite(inp.pressure_pa):
            st.expected_pa = st.command_pa
        st.lag.rest_s = _REST_S
        return False
    tick = int(st.tick)
    whole, rest = ticks_of(par, st.lag, 0.0)
    arrived = command_of(ring, tick, whole, rest)
    arrives = 0.0                     # rate of change of that command
    if par.dead_time_s > 0.0:
        arrives = (command_of(ring, tick, whole, 0.0)
                   - command_of(ring, tick, whole + 1, 0.0)) / par.period_s
    expected: float = st.expected_pa
    measured: float = inp.pressure_pa
    if not math.isfinite(expected):
        expected = arrived
    expected += par.period_s / (st.lag.lag_s + par.period_s) * (arrived - expected)
    st.expected_pa = expected
    st.arriving_pa_per_s = (arrived - expected) / st.lag.lag_s if st.lag.lag_s > 0.0 else 0.0
    measured += inp.pressure_age_s * st.arriving_pa_per_s
    gap = abs(expected - measured)
    if gap > par.valve_gap_pa or inp.held_back != 0.0:
        st.lag.rest_s = _REST_S
    else:
        st.lag.rest_s = max(st.lag.rest_s - par.period_s, 0.0)
    _find(par, st.lag, arrived, arrives, expected, measured)
    return gap > par.valve_gap_pa          # False for NaN: pressure is optional

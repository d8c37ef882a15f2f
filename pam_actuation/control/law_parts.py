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

"""What compiled control laws share: start, change of error, limits of the actuator."""

import math

import numpy as np
from pam_actuation.control.inputs import MAX_AGE_S
from pam_sim.compiled import compiled, inlined
from pam_sim.units import P_ATM_PA

_OFFSET_FLOOR_M = 1e-9    # then it is gone, before it becomes a denormal number
_CHANGE_FLOOR_M_PER_S = 1e-12                    # the same


@compiled
def first_command_pa(pressure_pa: float, lowest_pa: float, highest_pa: float) -> float:
    """Return where a bumpless start begins: at the measured pressure, NaN = atmosphere."""
    if not math.isfinite(pressure_pa):
        return P_ATM_PA
    return min(max(pressure_pa, lowest_pa), highest_pa)


@compiled
def faded_offset(offset_m: float, time_s: float, period_s: float) -> float:
    """Return the offset of a bumpless start one period later."""
    if abs(offset_m) > _OFFSET_FLOOR_M:
        return offset_m * (time_s / (time_s + period_s))
    return 0.0


@compiled
def filtered_change(
        change: float, filter_s: float, reference_rate: float, moved_m: float, elapsed_s: float,
        period_s: float, known: bool) -> float:
    """
    Return the filtered change of error [m/s], from the contraction alone.

    ``change`` is the former one, ``moved_m`` what the contraction did in ``elapsed_s`` (NaN:
    one period), ``known`` whether there was a former contraction.
    """
    if not math.isfinite(elapsed_s):
        elapsed_s = period_s
    if elapsed_s > MAX_AGE_S:       # a longer gap restarts the filter
        return 0.0
    if elapsed_s > 0.0 and known:
        raw = reference_rate - moved_m / elapsed_s
        change += elapsed_s / (filter_s + elapsed_s) * (raw - change)
    return change if abs(change) > _CHANGE_FLOOR_M_PER_S else 0.0


@compiled
def held_offset(
        offset_m: float, held_back: float, away_m: float, error_m: float, time_s: float,
        period_s: float) -> float:
    """
    Return the offset of a bumpless start while the driver does not follow the command.

    The reference then goes with the muscle, and the law starts from where that is once its
    command counts again. The error fades: at once gone, it would take the command back with it.

    Parameters
    ----------
    offset_m : float
        Offset while the command is followed.
    held_back : float
        A code of ``following``.
    away_m : float
        Reference less contraction.
    error_m : float
        Error of the tick before.
    time_s, period_s : float
        Time in which the error fades, period of the ticks.

    """
    if held_back == 0.0:
        return offset_m
    return away_m - error_m * (time_s / (time_s + period_s))


@inlined
def tracked(par: np.record, st: np.record, inp: np.record, period_s: float
            ) -> tuple[float, float]:
    """
    Return the error [m] and the offset of a bumpless start [m], and let that fade.

    Records have the fields of ``PARAMETERS`` and ``STATE`` of a law, and of ``inputs.INPUT``.
    """
    offset = held_offset(st.offset_m, inp.held_back, inp.reference_m - inp.contraction_m,
                         st.error_m, par.start_time_s, period_s)
    st.offset_m = faded_offset(offset, par.start_time_s, period_s)
    error = inp.reference_m - offset - inp.contraction_m
    st.error_m = error
    return error, offset


@compiled
def settled_part(error_m: float, offset_m: float) -> float:
    """
    Return the part of an error that the offset of a bumpless start does not cause.

    While the offset fades, the reference runs after the one that is wanted, faster than that.
    The error of this chase is not one that an integral should remember.
    """
    if offset_m == 0.0:
        return error_m
    return error_m * (abs(error_m) / (abs(error_m) + abs(offset_m)))


@compiled
def integral_growth(by_error: float, by_limits: float, held_back: float) -> float:
    """
    Return the rate at which an integral grows, by the error and by the limits of the law.

    While the driver does not follow the command, it may only go to where the driver is;
    ``held_back`` is a code of ``following``.
    """
    if held_back == 0.0:
        return by_error + by_limits
    if held_back == 1.0:
        return min(by_error, 0.0)
    if held_back == -1.0:
        return max(by_error, 0.0)
    return 0.0


@inlined
def sent(par: np.record, st: np.record, out: np.record, wanted_pa: float, period_s: float
         ) -> tuple[float, float]:
    """
    Return the command within the limits of pressure, and the one that is sent, slow enough too.

    Records have the fields of ``PARAMETERS``, ``STATE`` and ``OUTPUT`` of a law; both commands
    and which limits acted are written.
    """
    lowest = P_ATM_PA + par.min_pressure_gauge_pa
    highest = P_ATM_PA + par.max_pressure_gauge_pa
    reach, former = par.slew_pa_per_s * period_s, st.command_pa
    inside = min(max(wanted_pa, lowest), highest)
    command = min(max(inside, former - reach), former + reach)
    st.command_pa = command
    out.command_pa = command
    out.unlimited_command_pa = wanted_pa
    out.saturated_low = 1.0 if wanted_pa < lowest else 0.0
    out.saturated_high = 1.0 if wanted_pa > highest else 0.0
    out.slew_limited = 1.0 if command != inside else 0.0
    return inside, command

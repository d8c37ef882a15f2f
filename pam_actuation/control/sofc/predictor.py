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
Feedback on the error that is on its way.

The model of the muscle goes on from the last measurement with the commands under way. It predicts
contraction and rate for the moment at which a command of now arrives. Feedback on that error has
no dead time in its loop (Smith 1957; in the time domain Manitius and Olbrot 1979).
"""

import math

import numpy as np
from pam_actuation.control.sofc import motion_estimate, valve_lag
from pam_actuation.control.sofc.credit import Ring
from pam_actuation.control.sofc.muscle_model import inertia_pa_s2_per_m, unbalanced_pa
from pam_actuation.control.sofc.path_memory import go
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled


@compiled
def engage(par: np.record, st: np.record, error_m: float, announced: float) -> None:
    """
    Decide how much predicted feedback and disturbance act.

    Where errors are large they act in full. Where the rules already do it, they step back:
    a strong feedback adds noise and takes the rules the error they learn from. ``announced``:
    how far the reference comes as its previews told, 0 to 1.
    """
    if not par.half_strength_m > 0.0:
        st.strength = 1.0
        return
    square = error_m * error_m
    time_s: float = par.strength_time_s
    if par.announced_strength_time_s > 0.0:
        time_s += announced * (par.announced_strength_time_s - time_s)
    share = par.period_s / (time_s + par.period_s)
    st.squared_error_m2 += share * (square - st.squared_error_m2)
    half = par.half_strength_m * par.half_strength_m
    st.strength = st.squared_error_m2 / (st.squared_error_m2 + half)


@compiled
def fast_rate(par: np.record, st: np.record, contraction_m: float, elapsed_s: float) -> float:
    """
    Return the filtered rate [m/s] of a measured contraction.

    ``elapsed_s`` lies between this measurement and the one before. A sensor has a rate of its own:
    at 250 Hz, three of four ticks at 200 Hz see 4 ms of motion, and one 8 ms.
    """
    if elapsed_s > 0.0:
        part = elapsed_s / (par.predicted_rate_filter_s + elapsed_s)
        moved = part * (contraction_m - st.fast_contraction_m)
        st.fast_contraction_m += moved
        st.fast_rate_m_per_s = moved / elapsed_s
    return float(st.fast_rate_m_per_s)


@compiled
def motion(par: np.record, inverse: FloatArray, rules: FloatArray, st: np.record,
           contraction_m: float, elapsed_s: float, pressure_pa: float) -> tuple[float, float]:
    """Return contraction [m] and rate [m/s] at the reading; see ``motion_estimate``."""
    fast = fast_rate(par, st, contraction_m, elapsed_s)
    if not par.unknown_acceleration_m_per_s2 > 0.0:
        return contraction_m, fast
    now = st.motion
    if not math.isfinite(now.pressure_pa + pressure_pa):      # none is known yet
        motion_estimate.begin(now, contraction_m, fast, pressure_pa)
    elif elapsed_s > 0.0:
        inertia = inertia_pa_s2_per_m(par, st, now.contraction_m)
        # In the middle of the time between the readings.
        middle_m = now.contraction_m + 0.5 * elapsed_s * now.rate_m_per_s
        accelerates_pa = unbalanced_pa(
            par, inverse, rules, st, st.path, middle_m, now.rate_m_per_s,
            0.5 * (now.pressure_pa + pressure_pa))
        motion_estimate.correct(
            now, contraction_m, fast, elapsed_s, accelerates_pa / inertia, pressure_pa,
            par.unknown_acceleration_m_per_s2, math.sqrt(now.unsure_pa2) / inertia)
    return (contraction_m + now.trust * (now.contraction_m - contraction_m),
            fast + now.trust * (now.rate_m_per_s - fast))


@compiled
def predict(par: np.record, inverse: FloatArray, rules: FloatArray, ring: Ring, tick: int,
            st: np.record, contraction_m: float, begins_m: float, begins_m_per_s: float,
            age_s: float, pressure_pa: float, valve: np.record) -> tuple[float, float]:
    """
    Return contraction [m] and rate [m/s] for the moment at which a command of now arrives.

    The model goes on from the measurement, which is ``age_s`` old, with the commands of one dead
    time before. ``begins_m`` and ``begins_m_per_s`` are those of ``motion``. ``pressure_pa`` is
    the pressure of that time, ``valve`` a ``LAG``.
    """
    period = par.period_s
    x, rate, p = begins_m, begins_m_per_s, pressure_pa
    for q in range(int(par.path_sets)):
        st.predicted_path[q] = st.path[q]
    inertia = inertia_pa_s2_per_m(par, st, contraction_m)
    whole, rest = valve_lag.ticks_of(par, valve, age_s)
    for ago in range(whole, -1 if rest > 0.0 else 0, -1):
        # At last the rest of a tick, with the newest command.
        step = period if ago > 0 else rest * period
        command = (valve_lag.command_of(ring, tick, ago, rest) if ago > 0
                   else valve_lag.command_of(ring, tick, 1, 0.0))
        p += step / (valve.lag_s + step) * (command - p)
        go(par, st.predicted_path, rate * step)
        accelerates_pa = unbalanced_pa(par, inverse, rules, st, st.predicted_path, x, rate, p)
        rate += step * accelerates_pa / inertia
        x += step * rate
    return x, rate


@compiled
def predicted_feedback_pa(par: np.record, st: np.record, error_m: float, change_m_per_s: float,
                          lag_s: float) -> float:
    """Return the feedback on the predicted error and its change [Pa], ahead of the valve's lag."""
    near_m = error_m
    if par.predicted_reach_m > 0.0:
        near_m = min(max(error_m, -par.predicted_reach_m), par.predicted_reach_m)
    raw = st.strength * (
        par.predicted_proportional_pa_per_m * near_m
        + par.predicted_derivative_pa_s_per_m * change_m_per_s)
    step = par.period_s / (par.predicted_filter_s + par.period_s) * (raw - st.feedback_pa)
    st.feedback_pa += step
    return st.feedback_pa + lag_s * step / par.period_s

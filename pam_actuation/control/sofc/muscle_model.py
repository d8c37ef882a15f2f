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
A model of the muscle within the controller, learned from the measured pressure.

The static inverse and the feed-forward of moving give the pressure a motion should take. What is
measured differs by friction, creep, load and errors of the force map::

    residual = p - p_static(x) - k_v dx/dt - k_a d2x/dt2

Contraction and pressure pass the same two low passes, so that they belong to the same moment.
The residual has neither dead time nor lag of the valve in it, and needs no reference.

A few *numbers* hold everywhere: offset, slope, friction for every set of the path, damping,
inertia and creep. Recursive least squares find them within seconds. The creep is that of one
element of Maxwell: a spring that gives way with ``creep_time_s``. *Path rules* learn the rest as a
function of contraction and of the path before. This is direct inverse learning (Jordan and
Rumelhart 1992). The degrees of the path are those of play operators of several widths, so the
rules are the inverse of a Prandtl-Ishlinskii operator whose weights depend on the contraction.
Some sets may fade instead, as the friction of Dahl does (``path_memory``).
What is not explained yet is the *disturbance* (observer of Ohnishi). All are added to the
feed-forward.
"""

import math

import numpy as np
from pam_actuation.control.sofc import motion_estimate
from pam_actuation.control.sofc.dynamics import load_shape
from pam_actuation.control.sofc.membership import locate
from pam_actuation.control.sofc.path_memory import go
from pam_actuation.control.sofc.rule_table import infer_path
from pam_actuation.control.sofc.rule_text import MOST_SETS, NUMBERS
from pam_actuation.control.static_inverse import inverse_pressure_pa
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled
from pam_sim.records import record
from pam_sim.units import P_ATM_PA

LIFTED_M = 5e-4          # below this contraction the pressure says nothing of the muscle
_MOVES_M_PER_S = 2e-3     # from this rate on a residual counts in full: at rest friction hides it
_FRICTION_AT_PA = 4e5     # gauge: what the numbers of the path are at
_FADE = 0.99              # per tick, of a disturbance that is not observed any more

# Numbers of the model that hold everywhere: offset, slope, the first sets of the path beyond that
# of any path, damping, inertia, creep, the further sets. Files from before the creep or the
# further sets lack what comes last.
_FIRST_SETS = 6
RATE, ACCELERATION, CREEP = 1 + _FIRST_SETS, 2 + _FIRST_SETS, 3 + _FIRST_SETS
# What a number of the model is per: contraction, also of the creep, rate, acceleration.
SCALES = _SPAN_M, _RATE_M_PER_S, _ACCELERATION_M_PER_S2 = 0.01, 0.05, 0.5
_FILE_DOUBT = 0.5         # standard deviation added to a number of a file, in that of the start
_UNKNOWN_PA = 2e4         # standard deviation of each before the first measurement

MODEL = record(
    'known',                          # 1 once the filters have begun
    'contraction_once_m',             # behind the first low pass
    'contraction_m',                  # behind both
    'rate_m_per_s',
    'pressure_once_pa',
    'pressure_pa',
    'acceleration_m_per_s2',
    ('number_pa', NUMBERS),           # the numbers of the model
    ('covariance_pa2', NUMBERS * NUMBERS),
    ('gain', NUMBERS),                # work space of the update
    ('now', NUMBERS),                 # what the numbers multiply
    ('regressor', NUMBERS),           # the same behind a further low pass
    'unexplained_pa',                 # innovation behind that low pass
    ('path', MOST_SETS),              # degrees of the measured path
    ('lead_path', MOST_SETS),         # the same of the reference one preview ahead
    ('predicted_path', MOST_SETS),
    'slow_m',                         # contraction behind the time of the creep
    'innovation_pa',                  # residual less the path rules
    'disturbance_pa',
    'held',                           # part of its change that is held back, 0 = none
    'fast_contraction_m',             # for the rate the prediction begins with
    'fast_rate_m_per_s',              # that rate
    ('motion', motion_estimate.MOTION),     # estimated, to begin the prediction with
    'feedback_pa',                    # on the predicted error, filtered
    'squared_error_m2',               # of the reference, mean
    'strength',                       # 0 to 1, of that feedback and of the disturbance
)


@compiled
def number_of(q: int) -> int:
    """Return the place of the number of set ``q`` of the path, 1 to ``MOST_SETS`` - 1."""
    return q + 1 if q < _FIRST_SETS else q + 4


@compiled
def rules_pa(par: np.record, rules: FloatArray, path: FloatArray, contraction_m: float) -> float:
    """Return what the path rules add at a contraction [Pa]."""
    if par.path_sets < 1.0:
        return 0.0
    k, wk = locate(contraction_m, par.reference_lower_m, par.reference_upper_m, rules.shape[1])
    return infer_path(rules, path, k, wk)


@compiled
def _crept(par: np.record, st: np.record, contraction_m: float) -> float:
    """Return how far a contraction is from where the creep has come to, in units of its number."""
    if not par.creep_time_s > 0.0:
        return 0.0
    return (contraction_m - st.slow_m) / _SPAN_M


@compiled
def _creep(par: np.record, st: np.record, contraction_m: float) -> None:
    """Let the creep go on for a period."""
    if par.creep_time_s > 0.0:
        st.slow_m = _low_pass(
            st.slow_m, contraction_m, par.period_s / (par.creep_time_s + par.period_s))


@compiled
def forget(par: np.record, st: np.record) -> None:
    """
    Forget a part of the disturbance in a tick of a move made of a jump.

    After a long rest it is creep for the most part, and the move begins that anew.
    """
    part = min(par.jump_forgetting * par.period_s / par.jump_time_s, 1.0)
    st.disturbance_pa -= part * st.disturbance_pa


@compiled
def friction_shape(par: np.record, contraction_m: float, static_pa: float) -> float:
    """
    Return by what friction is larger than at 400 kPa in the middle of the range.

    Friction grows with the pressure (Tondu and Lopez 2000), and a force takes the more pressure
    the further the muscle has contracted (``load_shape``). ``static_pa`` holds the contraction.
    """
    if not par.friction_growth > 0.0:
        return 1.0
    gauge = max(static_pa - P_ATM_PA, 0.0)
    shape = load_shape(par, contraction_m) * gauge / _FRICTION_AT_PA
    return 1.0 + par.friction_growth * (shape - 1.0)


@compiled
def numbers_pa(par: np.record, st: np.record, path: FloatArray, contraction_m: float,
               static_pa: float) -> float:
    """Return what offset, slope, path and creep of the model add at a contraction [Pa]."""
    if not par.model_noise_pa > 0.0:
        return 0.0
    middle = 0.5 * (par.reference_lower_m + par.reference_upper_m)
    total: float = st.number_pa[0] + st.number_pa[1] * (contraction_m - middle) / _SPAN_M
    shape = friction_shape(par, contraction_m, static_pa)
    for q in range(1, int(par.path_sets)):
        total += shape * st.number_pa[number_of(q)] * path[q]
    return total + st.number_pa[CREEP] * _crept(par, st, contraction_m)


@compiled
def _saturation(par: np.record, rate_m_per_s: float) -> float:
    """Return which part of a rate counts for the number of the damping."""
    if not par.damping_rate_m_per_s > 0.0:
        return 1.0
    return par.damping_rate_m_per_s / (par.damping_rate_m_per_s + abs(rate_m_per_s))


@compiled
def damping_pa_s_per_m(par: np.record, st: np.record, rate_m_per_s: float) -> float:
    """Return the pressure per rate: the setting and what the model found."""
    number: float = st.number_pa[RATE] * _saturation(par, rate_m_per_s)
    found: float = par.rate_feedforward_pa_s_per_m + number / _RATE_M_PER_S
    return max(found, 0.0)


@compiled
def inertia_pa_s2_per_m(par: np.record, st: np.record, contraction_m: float) -> float:
    """Return the pressure per acceleration: the setting and what the model found."""
    setting: float = par.acceleration_feedforward_pa_s2_per_m
    found = setting + st.number_pa[ACCELERATION] / _ACCELERATION_M_PER_S2
    middle: float = min(max(found, setting / par.inertia_range), par.inertia_range * setting)
    return middle * (1.0 + par.inertia_growth * (load_shape(par, contraction_m) - 1.0))


@compiled
def unbalanced_pa(par: np.record, inverse: FloatArray, rules: FloatArray, st: np.record,
                  path: FloatArray, contraction_m: float, rate_m_per_s: float,
                  pressure_pa: float) -> float:
    """Return by what a pressure exceeds that of a steady motion [Pa]: what accelerates."""
    static_pa = inverse_pressure_pa(inverse, contraction_m)
    return float(
        pressure_pa - static_pa - damping_pa_s_per_m(par, st, rate_m_per_s) * rate_m_per_s
        - numbers_pa(par, st, path, contraction_m, static_pa)
        - rules_pa(par, rules, path, contraction_m) - st.disturbance_pa)


@compiled
def _unknown_pa2(par: np.record, i: int) -> float:
    """Return the variance [Pa^2] of a number before the first measurement."""
    unknown: float = _UNKNOWN_PA
    if i == CREEP:
        unknown = par.creep_pa
    elif 2 <= i < RATE or i > CREEP:
        unknown = par.path_pa
    return unknown * unknown


def doubt_numbers(par: np.record, covariance_pa2: FloatArray) -> None:
    """
    Make the numbers of a rule file less sure, in place; ``covariance_pa2`` is (N, N).

    They may come from a model or from another day. A number that is taken for sure is not found
    anew within minutes. With numbers of another rig, one of the 200 rigs of ``tracking.py`` had 40
    times the error that it has untaught.
    """
    for i in range(NUMBERS):
        if covariance_pa2[i, i] > 0.0:
            covariance_pa2[i, i] += _FILE_DOUBT * _FILE_DOUBT * _unknown_pa2(par, i)


@compiled
def find_numbers(par: np.record, inverse: FloatArray, st: np.record, surprised: bool) -> None:
    """
    Correct the numbers of the model by the innovation: recursive least squares.

    In the form of a Kalman filter whose numbers drift: one that the motion does not tell keeps its
    value, and its variance ends at that of the start. Noise of the acceleration makes the inertia
    too small, so innovation and regressor pass one low pass more.
    """
    if not par.model_noise_pa > 0.0 or st.contraction_m < LIFTED_M or st.known < 0.5:
        return
    middle = 0.5 * (par.reference_lower_m + par.reference_upper_m)
    now, phi, gain, cov = st.now, st.regressor, st.gain, st.covariance_pa2
    now[0] = 1.0
    now[1] = (st.contraction_m - middle) / _SPAN_M
    shape = friction_shape(par, st.contraction_m, inverse_pressure_pa(inverse, st.contraction_m))
    for q in range(1, MOST_SETS):
        now[number_of(q)] = shape * st.path[q] if q < par.path_sets else 0.0
    now[RATE] = st.rate_m_per_s * _saturation(par, st.rate_m_per_s) / _RATE_M_PER_S
    now[ACCELERATION] = st.acceleration_m_per_s2 / _ACCELERATION_M_PER_S2
    now[CREEP] = _crept(par, st, st.contraction_m)
    if par.number_filter_s > 0.0:
        part = par.period_s / (par.number_filter_s + par.period_s)
        for i in range(NUMBERS):
            phi[i] = _low_pass(phi[i], now[i], part)
        st.unexplained_pa = _low_pass(st.unexplained_pa, st.innovation_pa, part)
    else:
        for i in range(NUMBERS):
            phi[i] = now[i]
        st.unexplained_pa = st.innovation_pa
    drift = par.model_drift_pa * par.model_drift_pa * par.period_s
    if surprised:
        for i in range(2):
            for j in range(NUMBERS):
                cov[i * NUMBERS + j] = 0.0
                cov[j * NUMBERS + i] = 0.0
    for i in range(NUMBERS):
        at = i * NUMBERS + i
        first = _unknown_pa2(par, i)
        if cov[at] == 0.0:
            cov[at] = first
        elif cov[at] < first:
            cov[at] += drift
    moves = min(abs(st.rate_m_per_s) / _MOVES_M_PER_S, 1.0)
    if moves < 0.1:
        return
    noise = par.model_noise_pa * par.model_noise_pa / moves
    power = noise
    for i in range(NUMBERS):
        gain[i] = 0.0
        for j in range(NUMBERS):
            gain[i] += cov[i * NUMBERS + j] * phi[j]
        power += gain[i] * phi[i]
    st.motion.unsure_pa2 = max(power - noise, 0.0)
    for i in range(NUMBERS):
        st.number_pa[i] += gain[i] * st.unexplained_pa / power
        for j in range(NUMBERS):
            cov[i * NUMBERS + j] -= gain[i] * gain[j] / power


@compiled
def begin_motion(st: np.record, contraction_m: float, pressure_pa: float) -> None:
    """Begin what the prediction begins with; the numbers of the model count as unknown."""
    st.fast_contraction_m = contraction_m
    st.fast_rate_m_per_s = 0.0
    motion_estimate.begin(st.motion, contraction_m, 0.0, pressure_pa)
    st.motion.unsure_pa2 = _UNKNOWN_PA * _UNKNOWN_PA


@compiled
def _begin(par: np.record, inverse: FloatArray, st: np.record, contraction_m: float,
           elapsed_s: float, pressure_pa: float) -> None:
    """Begin the filters where the muscle is, as if it had moved there with its present rate."""
    st.known = 1.0
    if par.revision < 0.5 or st.motion.noise_m == 0.0:
        begin_motion(st, contraction_m, pressure_pa)
    st.contraction_once_m = contraction_m
    st.contraction_m = contraction_m
    st.pressure_once_pa = pressure_pa
    st.pressure_pa = pressure_pa
    if par.revision < 0.5:
        return
    rate: float = st.fast_rate_m_per_s
    once_m = contraction_m - (elapsed_s + par.model_filter_s) * rate
    x = once_m - par.model_filter_s * rate
    beyond_pa = pressure_pa - inverse_pressure_pa(inverse, contraction_m)
    st.contraction_once_m, st.contraction_m, st.rate_m_per_s = once_m, x, rate
    st.pressure_once_pa = beyond_pa + inverse_pressure_pa(inverse, once_m)
    st.pressure_pa = beyond_pa + inverse_pressure_pa(inverse, x)
    st.unexplained_pa = 0.0
    for i in range(NUMBERS):
        st.regressor[i] = 0.0


@compiled
def _low_pass(former: float, value: float, part: float) -> float:
    return former + part * (value - former)


@compiled
def observe(par: np.record, inverse: FloatArray, rules: FloatArray, st: np.record,
            contraction_m: float, elapsed_s: float, pressure_pa: float) -> None:
    """
    Compare one measurement with the model; ``st`` is a ``MODEL``.

    ``elapsed_s`` lies between this contraction and the one before. A pressure that is not finite
    leaves the disturbance to fade.
    """
    period = par.period_s
    if not math.isfinite(pressure_pa):
        st.known = 0.0
        st.innovation_pa = 0.0
        _creep(par, st, contraction_m)
        st.disturbance_pa *= _FADE
        return
    if st.known < 0.5:
        _begin(par, inverse, st, contraction_m, elapsed_s, pressure_pa)
    former_m, former_rate = st.contraction_m, st.rate_m_per_s
    once_m, x, rate = st.contraction_once_m, former_m, former_rate
    once_pa, p = st.pressure_once_pa, st.pressure_pa
    if elapsed_s > 0.0:
        share = elapsed_s / (par.model_filter_s + elapsed_s)
        once_m = _low_pass(once_m, contraction_m, share)
        x = _low_pass(former_m, once_m, share)
        rate = (x - former_m) / elapsed_s
        once_pa = _low_pass(once_pa, pressure_pa, share)
        p = _low_pass(p, once_pa, share)
    acceleration = (rate - former_rate) / (elapsed_s if elapsed_s > 0.0 else period)
    st.contraction_once_m, st.contraction_m = once_m, x
    st.pressure_once_pa, st.pressure_pa = once_pa, p
    st.rate_m_per_s, st.acceleration_m_per_s2 = rate, acceleration
    _creep(par, st, x)
    go(par, st.path, x - former_m)
    static_pa = inverse_pressure_pa(inverse, x)
    innovation = (
        p - static_pa - damping_pa_s_per_m(par, st, rate) * rate
        - inertia_pa_s2_per_m(par, st, x) * acceleration
        - numbers_pa(par, st, st.path, x, static_pa) - rules_pa(par, rules, st.path, x))
    st.innovation_pa = innovation
    if not par.disturbance_time_s > 0.0 or x < LIFTED_M:
        st.disturbance_pa *= _FADE
        return
    kept = (1.0 - st.held) * st.strength * period / (par.disturbance_time_s + period)
    limit = par.integral_limit_pa
    disturbance = _low_pass(st.disturbance_pa, innovation, kept)
    st.disturbance_pa = min(max(disturbance, -limit), limit)


@compiled
def learn(par: np.record, rules: FloatArray, fired: FloatArray, st: np.record) -> float:
    """
    Change the path rules by what the model did not explain; return the squared norm [Pa^2].

    Normalised least mean squares: the active rules together mend ``path_learning`` of it.
    """
    if par.path_sets < 1.0 or st.contraction_m < LIFTED_M or st.known < 0.5:
        return 0.0
    k, wk = locate(st.contraction_m, par.reference_lower_m, par.reference_upper_m, rules.shape[1])
    moves = min(abs(st.rate_m_per_s) / _MOVES_M_PER_S, 1.0)
    power = 0.0
    sets = int(par.path_sets)
    for q in range(sets):
        power += st.path[q] * st.path[q]
    power *= (1.0 - wk) * (1.0 - wk) + wk * wk
    rate = par.path_learning * max(st.strength, par.path_learning_floor)
    gain = rate * moves * st.innovation_pa / power
    squares = 0.0
    for q in range(sets):
        for a in range(2):
            degree = st.path[q] * (wk if a == 1 else 1.0 - wk)
            step = min(max(gain * degree, -par.feedforward_step_limit_pa),
                       par.feedforward_step_limit_pa)
            limit = par.feedforward_limit_pa
            new = min(max(rules[q, k + a] + step, -limit), limit)
            squares += (new - rules[q, k + a]) * (new - rules[q, k + a])
            rules[q, k + a] = new
            fired[q, k + a] += abs(degree)
    return squares

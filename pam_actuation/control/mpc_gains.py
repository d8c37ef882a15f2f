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
What model predictive control knows of a muscle: a linear model behind the static inverse.

The model is written in an *equivalent pressure*: the contraction that the static inverse gives to
a pressure, times the slope of the inverse at the operating point. So the force map, the largest
nonlinearity, is no error of the model. From equivalent pressure to contraction it is a delay, a
lag and a mass on a damped spring. They are found by least squares from the record that the LQI is
identified on, together with a gain. That gain is about 0.8 of what the static inverse says: dry
friction and creep hold back a part of a fast motion. A fit without it explains that part by a lag
twice as long and no delay. The model then gets the gain of the static inverse, which holds at rest
and in large motions. What friction and creep hold back is a disturbance to the observer. The model
of the LQI, of free form, was tried first: it explains the record as well, and its inverse is far
too lively to plan with.

A step of the horizon is a tick. The commands are constant over blocks of ticks that grow. With
the outputs of the horizon as ``y = F x + G w + P u``, the commands minimise::

    sum (r - y)^2 + c sum (u - u_r)^2 + s sum (u_j - u_{j-1})^2       y, r [mm], u [kPa]

where ``u_r`` is what holds the reference against the disturbance, taken as much earlier as the
model lags, and of a block its mean. The minimum is a linear function of the state ``x``, the
disturbance ``w``, the last command and the reference ``r`` as long as no bound is met.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np
from pam_actuation.control.lqi_gains import MAX_DELAY_TICKS, MAX_ORDER, padded, state_matrices
from pam_actuation.control.lqi_model import LinearModel
from pam_actuation.control.observer import kalman_gains
from pam_actuation.control.static_inverse import GRID, GRID_SIZE
from pam_sim import load_rig
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.records import fields, record, values_of
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA

BLOCKS = (2, 4, 6, 8, 12, 18)             # ticks over which a command of the horizon stays
MOVES, HORIZON = len(BLOCKS), sum(BLOCKS)
MAX_DELAY_S = 0.07
DRIFT_HZ = 0.3                            # corner of the high-pass
# Of the fit: lag [s], rate of the mass [rad/s], damping, gain over that of the static inverse.
_STARTS = 0.05, 30.0, 0.3, 1.0
_LOWEST = 1e-3, 3.0, 0.01, 0.05
_HIGHEST = 2.0, 500.0, 10.0, 20.0
# Difference step of the fit, of a logarithm: far above rounding, and small enough for a slope.
# From the default of SciPy up to 1e-4 it ends at the same model.
_DIFF_STEP = 1e-6
_EVALUATIONS = 50
MODEL = record(
    'order',
    'delay_ticks',
    'lag_ticks',                              # of the model without its delay
    'contraction_m',                          # operating point
    'pa_per_m',                               # of the static inverse there
    'lowest_pa', 'highest_pa',                # equivalent pressure less that of the point
    ('denominator', MAX_ORDER),
    ('numerator_m_per_pa', MAX_ORDER),
    ('observer_gain', MAX_ORDER),
    'disturbance_observer_pa_per_m',
    ('rest', MAX_ORDER),                      # state at rest per contraction
    'rest_pa_per_m',                          # command at rest per contraction
    # The best commands of all blocks, one row each.
    ('reference_gain_pa_per_m', MOVES * HORIZON),
    ('held_gain_pa_per_m', MOVES * HORIZON),  # of the reference so much later
    ('state_gain_pa_per_m', MOVES * MAX_ORDER),
    ('disturbance_gain', MOVES),
    ('last_gain', MOVES),
    ('hessian', MOVES * MOVES),               # diagonal 1
)
_MM, _KPA = 1e3, 1e-3


def equivalent_pa(table: FloatArray, pressure_pa: FloatArray | float,
                  contraction_m: float) -> tuple[FloatArray, float]:
    """
    Return (equivalent pressures less that of the operating point [Pa], slope there [Pa/m]).

    Parameters
    ----------
    table : numpy.ndarray
        Static inverse.
    pressure_pa : float or array_like
        Absolute pressures; beyond the ends of the table those at its ends.
    contraction_m : float
        Operating point.

    """
    grid, nodes = fields(table, GRID), table[GRID_SIZE:]
    places = grid.lower_m + grid.step_m * np.arange(nodes.size)
    # Where nodes repeat the last pressure that can be held, the first of them counts.
    rising = np.r_[True, np.diff(nodes) > 0.0]
    held_m = np.interp(pressure_pa, nodes[rising], places[rising])
    around = np.interp([contraction_m - 2e-3, contraction_m + 2e-3], places, nodes)
    slope = float(around[1] - around[0]) / 4e-3
    return (held_m - contraction_m) * slope, slope


def identify_behind_inverse(rig: Rig, table: FloatArray, rate_hz: float) -> LinearModel:
    """
    Return the model of a rig with a hanging mass, identified in simulation as for the LQI.

    Its pressures are equivalent ones, with ``pressure_pa`` 0 at the operating point.

    Raises
    ------
    InputError
        The load does not move with the pressure, or nothing stable explains the record.

    """
    if rig.is_driven:
        raise InputError(f'load `{rig.load}` does not move with the pressure', rig.name)
    return _identified(rig.to_yaml(), table.tobytes(), rate_hz)


@lru_cache(maxsize=16)      # seconds each; the same rig is asked for again and again
def _identified(rig_text: str, table: bytes, rate_hz: float) -> LinearModel:
    from pam_actuation.control.identification_run import identification_record, MIDDLE_M
    command_pa, moved_m = identification_record(load_rig(rig_text), rate_hz)
    equivalent, slope = equivalent_pa(np.frombuffer(table), command_pa, MIDDLE_M)
    found = identify_lag_and_mass(equivalent, moved_m, rate_hz, slope)
    return replace(found, contraction_m=MIDDLE_M, pressure_pa=0.0)


def identify_lag_and_mass(command_pa: FloatArray, contraction_m: FloatArray, rate_hz: float,
                          pa_per_m: float) -> LinearModel:
    """
    Return the model of a delay, a lag and a mass on a damped spring that explains a record best.

    Parameters
    ----------
    command_pa, contraction_m : numpy.ndarray, shape (N,)
        Equivalent pressure and contraction, one pair a tick.
    rate_hz : float
        Of the ticks.
    pa_per_m : float
        Slope of the static inverse, which holds at rest: the model gets its gain. ``fit`` is
        that of the gain that explains the record best.

    """
    from scipy.optimize import least_squares
    from scipy.signal import butter, lfilter
    high_pass = butter(2, DRIFT_HZ, 'high', fs=rate_hz)
    # Both in metres: next to a denominator of order one, a numerator in m/Pa drowns in rounding.
    u, y = (lfilter(*high_pass, one - one[0]) for one in (command_pa / pa_per_m, contraction_m))
    spread = np.std(y)

    best = None
    for delay in range(round(MAX_DELAY_S * rate_hz) + 1):
        late = np.r_[np.zeros(delay), u][:u.size]
        found = least_squares(
            lambda logs, late=late: (
                lfilter(*_lag_and_mass(np.exp(logs), rate_hz), late) - y) / spread,
            np.log(_STARTS), bounds=(np.log(_LOWEST), np.log(_HIGHEST)),
            diff_step=_DIFF_STEP, max_nfev=_EVALUATIONS)
        if best is None or found.cost < best[0]:
            best = found.cost, delay, found.x
    assert best is not None
    numerator, denominator = _lag_and_mass(np.r_[np.exp(best[2][:3]), 1.0], rate_hz)
    return LinearModel(
        rate_hz, best[1], tuple(denominator[1:].tolist()),
        tuple((numerator[1:] / pa_per_m).tolist()), 0.0, 0.0, 1.0 - 2.0 * float(best[0]) / y.size)


def _lag_and_mass(values: FloatArray, rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """
    Return (numerator, denominator) of lag [s], rate [rad/s], damping and gain, input held a tick.

    ``scipy.signal.cont2discrete`` gives the same, but the numerator as a difference of two
    polynomials, which leaves too few digits of it for the differences of a fit.
    """
    from scipy.linalg import expm
    lag_s, rate, damping, gain = values
    # State: pressure behind the lag, contraction, its speed over the rate; last the input.
    held = expm(np.array([
        [-1.0 / lag_s, 0.0, 0.0, 1.0 / lag_s],
        [0.0, 0.0, rate, 0.0],
        [rate, -rate, -2.0 * damping * rate, 0.0],
        [0.0, 0.0, 0.0, 0.0]]) / rate_hz)
    advance, arriving = held[:3, :3], held[:3, 3]
    contraction = np.array([0.0, 1.0, 0.0])
    pulse = np.array([contraction @ np.linalg.matrix_power(advance, k) @ arriving
                      for k in range(3)])
    root = np.sqrt(complex(damping ** 2 - 1.0))
    denominator = np.real(np.poly(np.exp(np.array([
        -1.0 / lag_s, rate * (-damping + root), rate * (-damping - root)]) / rate_hz)))
    numerator = gain * np.convolve(denominator, pulse)[:3]
    return np.r_[0.0, numerator], denominator


def observer_gains(model: LinearModel, disturbance_pa: float, noise_m: float) -> FloatArray:
    """
    Return the gains on the innovation, one row for each interval of readings.

    They correct the state [-] and, last, the disturbance [Pa/m].
    """
    a, b, c = state_matrices(model)
    n = len(b)
    big = np.block([[a, b[:, None]], [np.zeros((1, n)), np.ones((1, 1))]])
    seen = np.r_[c, 0.0]
    spread = 1e-6 * (noise_m * _MM) ** 2 * np.eye(n + 1)
    spread[-1, -1] = (disturbance_pa * _KPA) ** 2
    noise = (noise_m * _MM) ** 2
    rows = kalman_gains(big, seen, spread, noise, model.rate_hz)
    rows[:, n] *= _MM / _KPA
    return rows


def gains_of_every_tick(gains: FloatArray) -> FloatArray:
    """Return the gains of the observer for readings of every tick, of an array of ``MODEL``."""
    model = fields(gains, MODEL)
    return np.r_[model.observer_gain[:int(model.order)], model.disturbance_observer_pa_per_m]


def _horizon(model: LinearModel) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (P, F, G) of the outputs of the horizon, in mm and kPa."""
    a, b, c = state_matrices(model)
    free, pulse = np.empty((HORIZON, len(b))), np.empty(HORIZON)
    state, moved = np.eye(len(b)), b
    for i in range(HORIZON):
        pulse[i] = c @ moved
        state, moved = a @ state, a @ moved
        free[i] = c @ state
    by_tick = np.array([[pulse[i - j] if j <= i else 0.0 for j in range(HORIZON)]
                        for i in range(HORIZON)])
    ends = np.cumsum(BLOCKS)
    moves = np.column_stack([by_tick[:, end - size:end].sum(axis=1)
                             for end, size in zip(ends, BLOCKS)])
    return moves, free, by_tick.sum(axis=1)


def _lag_ticks(model: LinearModel) -> int:
    """Return how much a slow contraction lags the command [ticks], without the delay."""
    places = np.arange(len(model.numerator) + 1)
    numerator, denominator = np.r_[0.0, model.numerator], np.r_[1.0, model.denominator]
    lag = places @ numerator / numerator.sum() - places @ denominator / denominator.sum()
    return int(min(max(round(float(lag)) - 1, 0), HORIZON))


def pack(model: LinearModel, table: FloatArray, settings: Mapping[str, float],
         observer: FloatArray) -> FloatArray:
    """
    Return model and gains as an array of ``MODEL``; ``observer`` are those of every tick.

    Raises
    ------
    InputError
        Order or delay are beyond ``MAX_ORDER`` and ``MAX_DELAY_TICKS``.

    """
    a, b, _ = state_matrices(model)
    n = len(b)
    if n > MAX_ORDER or model.delay_ticks > MAX_DELAY_TICKS:
        raise InputError(
            f'the linear model has order {n} and {model.delay_ticks} ticks of delay; at most '
            f'{MAX_ORDER} and {MAX_DELAY_TICKS} are allowed')
    moves, free, steady = _horizon(model)
    change = np.eye(MOVES) - np.eye(MOVES, k=-1)
    weight = settings['change_weight']
    si = _MM / _KPA             # kPa/mm to Pa/m
    held = settings['command_weight'] * np.repeat(np.eye(MOVES), BLOCKS, axis=1)
    hessian = moves.T @ moves + held @ held.T / settings['command_weight'] + (
        weight * change.T @ change)
    inverse = np.linalg.inv(hessian)
    (lowest, highest), slope = equivalent_pa(
        table, np.array([settings[f'{end}_pressure_gauge_pa'] + P_ATM_PA
                         for end in ('min', 'max')]), model.contraction_m)
    state = np.zeros((MOVES, MAX_ORDER))
    state[:, :n] = inverse @ moves.T @ free * si
    diagonal = np.diag(hessian)
    rest = np.linalg.solve(np.eye(n) - a, b) / (model.gain_m_per_pa * si)
    return values_of(MODEL, {
        'order': n, 'delay_ticks': model.delay_ticks, 'lag_ticks': _lag_ticks(model),
        'contraction_m': model.contraction_m,
        'pa_per_m': slope, 'lowest_pa': lowest, 'highest_pa': highest,
        'denominator': padded(model.denominator, MAX_ORDER),
        'numerator_m_per_pa': padded(model.numerator, MAX_ORDER),
        'observer_gain': padded(observer[:n], MAX_ORDER),
        'disturbance_observer_pa_per_m': observer[n],
        'rest': padded(rest, MAX_ORDER), 'rest_pa_per_m': 1.0 / model.gain_m_per_pa,
        'reference_gain_pa_per_m': (inverse @ moves.T * si).ravel(),
        'held_gain_pa_per_m': (inverse @ held / model.gain_m_per_pa).ravel(),
        'state_gain_pa_per_m': state.ravel(),
        'disturbance_gain': inverse @ (moves.T @ steady + held.sum(axis=1)),
        'last_gain': weight * inverse[:, 0],
        'hessian': (hessian / diagonal[:, None]).ravel()})

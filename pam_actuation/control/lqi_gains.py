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
Gains of the LQI controller: state feedback, integral and observer for a linear model.

The model's state is augmented by the commands on their way (the delay) and by
the integral of the error; the gains minimise::

    sum y^2 + w_i q^2 + w_u u^2        y [mm], q [mm s], u [kPa]

(discrete algebraic Riccati equation, ``scipy.linalg.solve_discrete_are``). A command acts one
delay later, at a state that is known by then. The gains of the augmented system are therefore
those of the system without delay, on the state predicted so far ahead. Only the small equation is
solved. The observer is the stationary Kalman filter of the model with a disturbance of the command
and noise of the sensor.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike
from pam_actuation.control.lqi_model import LinearModel
from pam_actuation.control.observer import kalman_gains, riccati
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.errors import InputError
from pam_sim.records import fields, record, values_of, zeros

MAX_ORDER = 10
MAX_DELAY_TICKS = 200
# Model and gains for the compiled step, in SI; arrays are used up to order or delay.
MODEL = record(
    'order',
    'delay_ticks',
    'contraction_m',                          # operating point
    'pressure_pa',                            # of it, absolute
    'pa_per_m',                               # pressure per contraction at rest
    'integral_gain_pa_per_m_s',
    ('denominator', MAX_ORDER),
    ('numerator_m_per_pa', MAX_ORDER),
    ('observer_gain', MAX_ORDER),
    ('rest', MAX_ORDER),                      # state at rest per contraction
    ('state_gain_pa_per_m', MAX_ORDER),
    ('delay_gain', MAX_DELAY_TICKS),          # of commands on their way, oldest first
)
_MM, _KPA = 1e3, 1e-3           # what a metre and a pascal are in the units of the weights


def state_matrices(model: LinearModel) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (A, B, C) of a model without its delay, observer form, in mm and kPa."""
    n = len(model.denominator)
    a = np.zeros((n, n))
    a[:, 0] = -np.asarray(model.denominator)
    a[:-1, 1:] = np.eye(n - 1)
    b = np.asarray(model.numerator) * _MM / _KPA
    c = np.zeros(n)
    c[0] = 1.0
    return a, b, c


def feedback_gains(model: LinearModel, integral_weight: float,
                   command_weight: float) -> tuple[FloatArray, FloatArray, float]:
    """
    Return (state gains [kPa/mm], delay gains [-], integral gain [kPa/(mm s)]).

    The delay gains belong to the commands of ``delay_ticks`` ago to one tick ago.
    """
    a, b, c = state_matrices(model)
    n, d = len(b), model.delay_ticks
    big_a, big_b = np.zeros((n + 1, n + 1)), np.zeros((n + 1, 1))
    big_a[:n, :n], big_b[:n, 0] = a, b
    big_a[-1, :n] = -c / model.rate_hz
    big_a[-1, -1] = 1.0
    weight = np.zeros((n + 1, n + 1))
    weight[:n, :n] = np.outer(c, c)
    weight[-1, -1] = integral_weight
    p = riccati(big_a, big_b, weight, np.array([[command_weight]]))
    gains = np.linalg.solve(command_weight + big_b.T @ p @ big_b, big_b.T @ p @ big_a)
    delay = np.empty(d)
    for j in range(d - 1, -1, -1):
        delay[j] = (gains @ big_b).item()
        gains = gains @ big_a
    gains = gains.ravel()
    return gains[:n], delay, -gains[-1]


def observer_gains(model: LinearModel, disturbance_pa: float, noise_m: float) -> FloatArray:
    """
    Return the gains [-] by which a measured difference corrects the estimated state.

    One row for each interval of readings.
    """
    a, b, c = state_matrices(model)
    noise = (noise_m * _MM) ** 2
    spread = np.outer(b, b) * (disturbance_pa * _KPA) ** 2 + 1e-6 * noise * np.eye(len(b))
    return kalman_gains(a, c, spread, noise, model.rate_hz)


def pack(model: LinearModel, settings: Mapping[str, float], observer: FloatArray) -> FloatArray:
    """
    Return model and gains as an array of ``MODEL``; ``observer`` are those of every tick.

    Raises
    ------
    InputError
        Order or delay are beyond ``MAX_ORDER`` and ``MAX_DELAY_TICKS``, or the Riccati
        equation has no solution.

    """
    a, b, _ = state_matrices(model)
    if len(b) > MAX_ORDER or model.delay_ticks > MAX_DELAY_TICKS:
        raise InputError(
            f'the linear model has order {len(b)} and {model.delay_ticks} ticks of delay; at most '
            f'{MAX_ORDER} and {MAX_DELAY_TICKS} are allowed')
    state, delay, integral = feedback_gains(
        model, settings['integral_weight'], settings['command_weight'])
    per_pa = model.gain_m_per_pa
    rest = np.linalg.solve(np.eye(len(b)) - a, b) / (per_pa * _MM / _KPA)
    si = _MM / _KPA             # kPa/mm to Pa/m
    return values_of(MODEL, {
        'order': len(b), 'delay_ticks': model.delay_ticks,
        'contraction_m': model.contraction_m, 'pressure_pa': model.pressure_pa,
        'pa_per_m': 1.0 / per_pa, 'integral_gain_pa_per_m_s': integral * si,
        'denominator': padded(model.denominator, MAX_ORDER),
        'numerator_m_per_pa': padded(model.numerator, MAX_ORDER),
        'observer_gain': padded(observer, MAX_ORDER), 'rest': padded(rest, MAX_ORDER),
        'state_gain_pa_per_m': padded(state * si, MAX_ORDER),
        'delay_gain': padded(delay, MAX_DELAY_TICKS)})


def gains_of_every_tick(gains: FloatArray) -> FloatArray:
    """Return the gains of the observer for readings of every tick, of an array of ``MODEL``."""
    model = fields(gains, MODEL)
    return np.array(model.observer_gain[:int(model.order)])


def padded(values: ArrayLike, size: int) -> FloatArray:
    """Return values with zeros behind them."""
    row = np.zeros(size)
    row[:np.size(values)] = values
    return row


def used_numbers(gains: FloatArray) -> BoolArray:
    """Return where an array of ``MODEL`` holds numbers of its order and delay, in order."""
    model, used = fields(gains, MODEL), zeros(MODEL)
    marked = fields(used, MODEL)
    lengths = {(MAX_ORDER,): int(model.order), (MAX_DELAY_TICKS,): int(model.delay_ticks)}
    for name in MODEL.names or ():
        shape = MODEL[name].shape
        if shape:
            marked[name][:lengths[shape]] = 1.0
        else:
            marked[name] = 1.0
    return used > 0.0

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

(discrete algebraic Riccati equation, ``scipy.linalg.solve_discrete_are``). What
a command does begins one delay later, at a state that is known by then: the
gains of the augmented system are those of the system without delay on the state
predicted so far ahead, so that the equation solved is the small one. The
observer is the stationary Kalman filter of the model with a disturbance of the
command and noise of the sensor.
"""

import numpy as np
from pam_sim.errors import InputError
from scipy.linalg import solve_discrete_are

# Places in the vector ``pack`` returns; what follows the head are a, b, observer gains, rest
# state per contraction, state gains (order each), delay gains (delay).
(M_ORDER, M_DELAY, M_CONTRACTION, M_PRESSURE, M_PA_PER_M, M_INTEGRAL_GAIN, M_HEAD) = range(7)
_MM, _KPA = 1e3, 1e-3           # what a metre and a pascal are in the units of the weights


def state_matrices(model):
    """Return (A, B, C) of a model without its delay, observer form, in mm and kPa."""
    n = len(model.denominator)
    a = np.zeros((n, n))
    a[:, 0] = -np.asarray(model.denominator)
    a[:-1, 1:] = np.eye(n - 1)
    b = np.asarray(model.numerator) * _MM / _KPA
    c = np.zeros(n)
    c[0] = 1.0
    return a, b, c


def feedback_gains(model, integral_weight, command_weight):
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
    p = _riccati(big_a, big_b, weight, np.array([[command_weight]]))
    gains = np.linalg.solve(command_weight + big_b.T @ p @ big_b, big_b.T @ p @ big_a)
    delay = np.empty(d)
    for j in range(d - 1, -1, -1):
        delay[j] = (gains @ big_b).item()
        gains = gains @ big_a
    gains = gains.ravel()
    return gains[:n], delay, -gains[-1]


def observer_gains(model, disturbance_pa, noise_m):
    """Return the gains [-] by which a measured difference corrects the estimated state."""
    a, b, c = state_matrices(model)
    noise = (noise_m * _MM) ** 2
    spread = np.outer(b, b) * (disturbance_pa * _KPA) ** 2 + 1e-6 * noise * np.eye(len(b))
    p = _riccati(a.T, c[:, None], spread, np.array([[noise]]))
    return p @ c / (c @ p @ c + noise)


def _riccati(a, b, q, r):
    try:
        return solve_discrete_are(a, b, q, r)
    except np.linalg.LinAlgError:
        raise InputError('the Riccati equation has no solution for this model and these '
                         'weights') from None


def pack(model, settings):
    """Return model and gains as one vector in SI for the compiled step."""
    a, b, _ = state_matrices(model)
    state, delay, integral = feedback_gains(
        model, settings['integral_weight'], settings['command_weight'])
    observer = observer_gains(model, settings['disturbance_pa'], settings['noise_m'])
    per_pa = model.gain_m_per_pa
    rest = np.linalg.solve(np.eye(len(b)) - a, b) / (per_pa * _MM / _KPA)
    si = _MM / _KPA             # kPa/mm to Pa/m
    head = np.zeros(M_HEAD)
    head[M_ORDER], head[M_DELAY] = len(b), model.delay_ticks
    head[M_CONTRACTION], head[M_PRESSURE] = model.contraction_m, model.pressure_pa
    head[M_PA_PER_M], head[M_INTEGRAL_GAIN] = 1.0 / per_pa, integral * si
    return np.concatenate([
        head, model.denominator, model.numerator, observer, rest, state * si, delay])

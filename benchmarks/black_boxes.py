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
Black-box models of a measured record, linear and not, judged in free run.

Used by ``real_records.py``. Two kinds: ARX by least squares, and NARX with the products of its
regressors up to a degree, by ridge regression of scikit-learn. Both are fitted to the equation
error, one step ahead. Order, delay, degree and penalty are those whose free run is best on the
fitted part. In a free run the model feeds back its own output, as a simulation does.
"""

import itertools

import numpy as np
from pam_sim.compiled import compiled

ORDERS, DELAYS = (1, 2, 3), range(16)
DEGREES, PENALTIES = (2, 3), (1e-8, 1e-4, 1e-2)
WORST = 1e3                  # of the range: a free run that is further off has run away


def rms(values):
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def table_of(u, y, order, inputs, delay, begins=(0,)):
    """
    Return (rows, regressors): past outputs, then inputs ``delay`` samples ago and before.

    ``begins`` are the first samples of recordings that stand one after the other in ``u``.
    """
    first = max(order, inputs + delay)
    ends = (*begins[1:], len(u))
    rows = np.concatenate([np.arange(begin + first, end) for begin, end in zip(begins, ends)])
    return rows, np.column_stack([
        *(y[rows - k] for k in range(1, order + 1)),
        *(u[rows - delay - k] for k in range(inputs))])


def powers_of(count, degree):
    """Return the places of the factors of each product of ``count`` regressors."""
    return [one for size in range(1, degree + 1)
            for one in itertools.combinations_with_replacement(range(count), size)]


def expanded(table, powers):
    """Return the products of columns."""
    return np.column_stack([np.prod(table[:, one], axis=1) for one in powers])


def free_run(u, y, order, inputs, delay, powers, weights, offset):
    """Return the free run from the first measured samples; it is cut where it runs away."""
    first = max(order, inputs + delay)
    run = y.copy()
    limit = WORST * max(float(np.ptp(y)), 1e-9)
    places = np.array([[*one, *[order + inputs] * (max(map(len, powers)) - len(one))]
                       for one in powers])
    row = np.ones(order + inputs + 1)
    _run_on(run, u, row, first, order, inputs, delay, places, weights, offset, limit)
    return run


@compiled
def _run_on(run, u, row, first, order, inputs, delay, places, weights, offset, limit):
    """Put the free run into ``run`` from sample ``first`` on; ``row`` ends in 1."""
    for i in range(first, len(u)):
        for k in range(order):
            row[k] = run[i - 1 - k]
        for k in range(inputs):
            row[order + k] = u[i - delay - k]
        value = offset
        for k in range(places.shape[0]):
            product = weights[k]
            for place in places[k]:
                product *= row[place]
            value += product
        if not abs(value) < limit:
            run[i:] = limit
            return
        run[i] = value


def _scaled(values):
    """Return values from about -1 to 1, with their middle and half range."""
    low, high = float(np.min(values)), float(np.max(values))
    half = max(0.5 * (high - low), 1e-12)
    return (values - 0.5 * (high + low)) / half, 0.5 * (high + low), half


def _best(u, y, part, fits, begins):
    """Return (free run, one step ahead, label) of the model that runs best on a part."""
    pieces = [slice(*one) for one in zip(begins, (*begins[1:], len(u)))]
    scaled_u, _, _ = _scaled(u)
    scaled_y, middle, half = _scaled(y)
    best, least = None, np.inf
    for order, inputs, delay, degree, fit in fits:
        powers = powers_of(order + inputs, degree)
        rows, table = table_of(scaled_u, scaled_y, order, inputs, delay, begins)
        products = expanded(table, powers)
        weights, offset = fit(products[part[rows]], scaled_y[rows][part[rows]])
        run = np.concatenate([
            free_run(scaled_u[one], scaled_y[one], order, inputs, delay, powers, weights, offset)
            for one in pieces])
        off = rms((run - scaled_y)[part])
        if off < least:
            ahead = scaled_y.copy()
            ahead[rows] = products @ weights + offset
            least, best = off, (middle + half * run, middle + half * ahead, (
                f'{order} outputs, {inputs} inputs, delay {delay}'
                + (f', degree {degree}' if degree > 1 else '')))
    return best


def arx(u, y, part, delays=DELAYS, begins=(0,)):
    """
    Return (free run, one step ahead, label) of the ARX model that runs best on a part.

    Recordings may stand one after the other, each from one of ``begins`` on.
    """
    def least_squares(products, target):
        weights = np.linalg.lstsq(np.column_stack([products, np.ones(len(products))]), target,
                                  rcond=None)[0]
        return weights[:-1], float(weights[-1])
    return _best(u, y, part, ((order, inputs, delay, 1, least_squares) for order, inputs, delay
                              in itertools.product(ORDERS, ORDERS, delays)), begins)


def narx(u, y, part, delays=DELAYS, begins=(0,)):
    """
    Return (free run, one step ahead, label) of the NARX model that runs best on a part.

    Recordings may stand one after the other, each from one of ``begins`` on.

    Raises
    ------
    ModuleNotFoundError
        scikit-learn is missing; it is in ``pip install 'pam_actuation[bench]'``.

    """
    from sklearn.linear_model import Ridge

    def ridge(penalty):
        def fit(products, target):
            model = Ridge(alpha=penalty).fit(products, target)
            return model.coef_, float(model.intercept_)
        return fit
    return _best(u, y, part, (
        (order, inputs, delay, degree, ridge(penalty)) for order, inputs, delay, degree, penalty
        in itertools.product((1, 2, 3), (1, 2), delays, DEGREES, PENALTIES)), begins)

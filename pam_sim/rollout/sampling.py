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

"""A simulation compared with measured samples, in compiled code."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.compiled import allocating_entry_point
from pam_sim.declared import shown
from pam_sim.errors import InputError
from pam_sim.response import COLUMNS
from pam_sim.short_repr import short_repr


@short_repr
@dataclass(frozen=True, eq=False)
class Measured:
    """
    Samples of one signal.

    Parameters
    ----------
    signal : str
        Name in the Response, for instance ``pressure_pa``.
    time_s : array_like, shape (M,)
        Seconds since the start of the record, in any order.
    value : array_like, shape (M,)
        SI unit of the signal.
    weight : float or array_like, shape (M,)
        Of the residuals, usually one over the standard deviation of the noise.

    """

    signal: str
    time_s: ArrayLike
    value: ArrayLike
    weight: ArrayLike = 1.0


class Placed:
    """
    Measured samples with their places between the steps of a simulation.

    Parameters
    ----------
    measured : Measured
    steps : int
        Steps of the simulation.
    dt_s : float
        Step, s.

    Raises
    ------
    InputError
        Unknown signal, arrays that do not fit, a number not finite, an instant outside
        the simulation.

    """

    def __init__(self, measured: Measured, steps: int, dt_s: float) -> None:
        name = measured.signal
        if name not in tuple(COLUMNS):
            raise InputError(f'`{name}` is no signal; allowed: {", ".join(COLUMNS)}', 'measured')
        self._column = COLUMNS[name]
        time_s = np.atleast_1d(_array(measured.time_s, 'time_s', name))
        self._value = np.ascontiguousarray(_array(measured.value, 'value', name))
        if time_s.ndim != 1 or self._value.shape != time_s.shape:
            raise InputError(f'`time_s` has shape {time_s.shape} and `value` '
                             f'{self._value.shape}; equal ones are needed', name)
        try:
            weight = np.broadcast_to(_array(measured.weight, 'weight', name), time_s.shape)
        except InputError:
            raise
        except ValueError:
            raise InputError(f'`weight` has shape {np.shape(measured.weight)}; one number or '
                             f'{time_s.shape} expected', name) from None
        self._weight = np.ascontiguousarray(weight)
        if not (np.isfinite(self._value).all() and np.isfinite(weight).all()):
            raise InputError('a measured value or its weight is not finite', name)
        end_s = steps * dt_s
        outside = ~((time_s >= -1e-9) & (time_s <= end_s + 1e-9))
        if outside.any():
            raise InputError(f'`time_s` is {time_s[outside][0]:g}; allowed 0 to {end_s:g} s', name)
        place = time_s / dt_s
        self._row = np.clip(np.floor(place), 0, steps - 1).astype(np.int64)
        self._share = np.clip(place - self._row, 0.0, 1.0)

    def sample(self, outputs: FloatArray) -> FloatArray:
        """Return the simulated values at the instants, shape (M,)."""
        found = np.empty_like(self._value)
        sample_into(outputs, self._column, self._row, self._share, found)
        return found

    def residual_sum(self, outputs: FloatArray) -> float:
        """Return the sum of (weight (simulated - measured))^2."""
        return residual_sum(outputs, self._column, self._row, self._share, self._value,
                            self._weight)


def _array(values: ArrayLike, what: str, signal: str) -> FloatArray:
    """Return an array of floats; refuse what is none."""
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f'`{what}` is no array of numbers: {shown(values)}', signal) from None


@allocating_entry_point
def sample_into(outputs: FloatArray, column: int, row: IntArray, share: FloatArray,
                found: FloatArray) -> None:
    """Fill ``found`` with one column of the rollout, linear between its rows."""
    for j in range(row.size):
        low = outputs[row[j], column]
        found[j] = low + share[j] * (outputs[row[j] + 1, column] - low)


@allocating_entry_point
def residual_sum(outputs: FloatArray, column: int, row: IntArray, share: FloatArray,
                 value: FloatArray, weight: FloatArray) -> float:
    """Return the weighted sum of squares of one column less the measured values."""
    total = 0.0
    for j in range(row.size):
        low = outputs[row[j], column]
        residual = weight[j] * (
            low + share[j] * (outputs[row[j] + 1, column] - low) - value[j])
        total += residual * residual
    return total

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
Dead time and lag between pressure command and measured pressure, found from ordinary movement.

First order models of a grid of dead times and lags run side by side on the command. Command and
pressure pass the same band, in which creep, zero errors and noise say little. Each model has a
gain of its own, by recursive least squares with forgetting. The model whose error has the least
power is the best; a paraboloid through it and its neighbours gives what lies between them.

Time is forgotten only while something moves, and a large move counts no more than a small one.
A second lag, such as that of a sensor, is found as half dead time and half lag.
"""

from dataclasses import dataclass
import math

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.compiled import Compiled, compiled, entry_point, source_key
from pam_sim.errors import InputError
from pam_sim.records import fields, part, record, zeros

STEP_S = 5e-3             # between two dead times of the grid; at least one tick
LAGS, DELAYS = 11, 27
_SHORTEST_S, _LONGEST_S = 6e-3, 0.25        # lags, evenly spaced in their logarithm
HIGH_PASS_HZ, LOW_PASS_HZ = 3.0, 25.0      # the band, second order each
STILL_PA = 200.0          # what in the band says as much as noise
MEMORY_S = 10.0           # of movement
LOCAL_S = 1.0             # over which the power of a movement is taken
_EVERY = 20               # steps between two estimates
FREE = 0.2                # share of the steps in the band that are independent
_BEYOND = 1.5             # grid steps a paraboloid may reach beyond its middle
SPREADS = 3.0             # standard deviations taken as the uncertainty
_MODEL_S = 2e-3           # error a valve that is not of first order leaves
LEAST_MOVED_S, LEAST_EXPLAINED, MOST_UNCERTAIN_S = 3.0, 0.9, 1e-2

WAY = record(
    'running',                        # 1 once the filters have begun
    'steps',                          # of the grid since then
    'ticks',                          # of the step that is being gathered
    'command_sum_pa', 'pressure_sum_pa',
    'command_origin_pa', 'pressure_origin_pa',
    ('command_filter_pa', 4), ('pressure_filter_pa', 4),
    'former_pa',                      # command in the band, one step ago
    'command_power_pa2', 'pressure_power_pa2',
    ('model_pa', LAGS),               # outputs of the lags
    ('past_pa', LAGS * (DELAYS + 1)),
    # Sums with forgetting.
    ('own', LAGS * DELAYS),           # of the squares of a model's output
    ('common', LAGS * DELAYS),        # of its output times the pressure
    'power',                          # of the squares of the pressure
    'moved_s',                        # time in which something moved
    # The estimate.
    'delay_s', 'lag_s', 'explained', 'uncertainty_s', 'at_end',
)


@compiled
def _lag_s(place: float) -> float:
    """Return the lag [s] at a place of the grid, 0 for the shortest."""
    return _SHORTEST_S * math.exp(math.log(_LONGEST_S / _SHORTEST_S) * place / (LAGS - 1))


@compiled
def _in_band(filters: FloatArray, value: float, step_s: float) -> float:
    """Return a value behind two high passes and two low passes."""
    share = 1.0 - math.exp(-2.0 * math.pi * HIGH_PASS_HZ * step_s)
    for j in range(2):
        filters[j] += share * (value - filters[j])
        value -= filters[j]
    share = 1.0 - math.exp(-2.0 * math.pi * LOW_PASS_HZ * step_s)
    for j in range(2, 4):
        filters[j] += share * (value - filters[j])
        value = filters[j]
    return value


@compiled
def pause(st: np.record) -> None:
    """Begin anew with the next measurement, but keep what was found; ``st`` is a ``WAY``."""
    st.running = 0.0


@compiled
def _begin(st: np.record, command_pa: float, pressure_pa: float) -> None:
    st.running = 1.0
    st.steps = 0.0
    st.ticks = 0.0
    st.command_sum_pa = 0.0
    st.pressure_sum_pa = 0.0
    st.command_origin_pa = command_pa
    st.pressure_origin_pa = pressure_pa
    st.former_pa = 0.0
    st.command_power_pa2 = 0.0
    st.pressure_power_pa2 = 0.0
    for j in range(4):
        st.command_filter_pa[j] = 0.0
        st.pressure_filter_pa[j] = 0.0
    for i in range(LAGS):
        st.model_pa[i] = 0.0


@compiled
def observe(st: np.record, period_s: float, command_pa: float, pressure_pa: float) -> None:
    """
    Take in the command and the measured pressure of one tick.

    Parameters
    ----------
    st : record
        A ``WAY``.
    period_s : float
        Between two ticks.
    command_pa : float
        Sent in this tick, acts from now on.
    pressure_pa : float
        Measured in this tick, before the command. NaN: the filters begin anew later.

    """
    if not math.isfinite(pressure_pa):
        pause(st)
        return
    if st.running < 0.5:
        _begin(st, command_pa, pressure_pa)
    stride = max(1.0, float(round(STEP_S / period_s)))
    command: float = st.command_sum_pa + command_pa - st.command_origin_pa
    pressure: float = st.pressure_sum_pa + pressure_pa - st.pressure_origin_pa
    ticks: float = st.ticks + 1.0
    st.ticks = ticks
    if ticks < stride:
        st.command_sum_pa = command
        st.pressure_sum_pa = pressure
        return
    st.command_sum_pa = 0.0
    st.pressure_sum_pa = 0.0
    st.ticks = 0.0
    _gather(st, stride * period_s, command / stride, pressure / stride)
    if st.steps % _EVERY == 0.0 and st.moved_s > 0.0:
        _estimate(st, stride * period_s, 0.5 * (stride - 1.0) * period_s)


@compiled
def _gather(st: np.record, step_s: float, command_pa: float, pressure_pa: float) -> None:
    """Advance filters and models by one step of the grid and add to the sums."""
    u = _in_band(st.command_filter_pa, command_pa, step_s)
    y = _in_band(st.pressure_filter_pa, pressure_pa, step_s)
    rows = DELAYS + 1
    row = int(st.steps) % rows
    for i in range(LAGS):
        keep = math.exp(-step_s / _lag_s(i))
        st.model_pa[i] = keep * st.model_pa[i] + (1.0 - keep) * st.former_pa
        st.past_pa[i * rows + row] = st.model_pa[i]
    st.former_pa = u
    local = 1.0 - math.exp(-step_s / LOCAL_S)
    sent: float = st.command_power_pa2
    sent += local * (u * u - sent)
    seen: float = st.pressure_power_pa2
    seen += local * (y * y - seen)
    st.command_power_pa2 = sent
    st.pressure_power_pa2 = seen
    steps: float = st.steps + 1.0
    st.steps = steps
    if steps <= DELAYS:
        return
    still = STILL_PA * STILL_PA
    moves = sent / (sent + still)
    weight = moves / (seen + still)
    keep = math.exp(-step_s * moves / MEMORY_S)
    st.power = keep * st.power + weight * y * y
    st.moved_s = keep * st.moved_s + moves * step_s
    for i in range(LAGS):
        for d in range(DELAYS):
            output = st.past_pa[i * rows + (row - d) % rows]
            at = i * DELAYS + d
            st.own[at] = keep * st.own[at] + weight * output * output
            st.common[at] = keep * st.common[at] + weight * output * y


@compiled
def _error(st: np.record, i: int, d: int) -> float:
    """Return the power of the error of a model with its best gain, which is never negative."""
    at = i * DELAYS + d
    common = max(st.common[at], 0.0)
    own: float = st.own[at]
    power: float = st.power
    return power - common * common / own if own > 0.0 else power


@compiled
def _estimate(st: np.record, step_s: float, late_s: float) -> None:
    """Find the best model and what lies between it and its neighbours."""
    least, best_i, best_d = math.inf, 0, 0
    for i in range(LAGS):
        for d in range(DELAYS):
            error = _error(st, i, d)
            if error < least:
                least, best_i, best_d = error, i, d
    i, d = min(max(best_i, 1), LAGS - 2), min(max(best_d, 1), DELAYS - 2)
    slope_i, slope_d, bend_i, bend_d = 0.0, 0.0, 0.0, 0.0
    for a in range(-1, 2):
        for b in range(-1, 2):
            error = _error(st, i + a, d + b) / 3.0
            slope_i += 0.5 * a * error
            slope_d += 0.5 * b * error
            bend_i += error if a != 0 else -2.0 * error
            bend_d += error if b != 0 else -2.0 * error
    twist = 0.25 * (_error(st, i + 1, d + 1) - _error(st, i + 1, d - 1)
                    - _error(st, i - 1, d + 1) + _error(st, i - 1, d - 1))
    curved = bend_i * bend_d - twist * twist
    off_i, off_d = float(best_i - i), float(best_d - d)
    uncertainty_s = math.inf
    if curved > 0.0 and bend_i > 0.0:
        off_i = -(bend_d * slope_i - twist * slope_d) / curved
        off_d = -(bend_i * slope_d - twist * slope_i) / curved
        free = FREE * st.moved_s / step_s
        spread = math.sqrt(2.0 * max(least, 0.0) / free * bend_i / curved) * step_s
        uncertainty_s = SPREADS * spread + _MODEL_S
    off_i = min(max(off_i, -_BEYOND), _BEYOND)
    off_d = min(max(off_d, -_BEYOND), _BEYOND)
    st.delay_s = max((d + off_d) * step_s + late_s, 0.0)
    st.lag_s = _lag_s(i + off_i)
    st.explained = 1.0 - least / st.power if st.power > 0.0 else 0.0
    st.uncertainty_s = uncertainty_s
    st.at_end = 1.0 if best_i == LAGS - 1 or best_d == DELAYS - 1 else 0.0


@compiled
def confident(st: np.record) -> bool:
    """Tell whether enough moved, one model explains it, and its dead time is sharp."""
    return (st.moved_s >= LEAST_MOVED_S and st.explained >= LEAST_EXPLAINED
            and st.uncertainty_s <= MOST_UNCERTAIN_S and st.at_end < 0.5)


@compiled
def _observe_all(state: FloatArray, period_s: float, command_pa: FloatArray,
                 pressure_pa: FloatArray) -> bool:
    st = part(state, 0, WAY)
    for k in range(command_pa.shape[0]):
        observe(st, period_s, command_pa[k], pressure_pa[k])
    return confident(st)


def _entry(key: int) -> Compiled[..., bool]:
    """Return the function over whole arrays as one unit of compiled code."""
    @entry_point
    def observe_all(state: FloatArray, period_s: float, command_pa: FloatArray,
                    pressure_pa: FloatArray) -> bool:
        """Take in a row of ticks; return whether the estimate is confident."""
        if key < 0:       # never; makes the key part of what is stored
            return False
        return _observe_all(state, period_s, command_pa, pressure_pa)

    return observe_all


observe_all = _entry(source_key(_observe_all))


@dataclass(frozen=True)
class PathEstimate:
    """
    What was found of the way from command to pressure.

    Attributes
    ----------
    delay_s : float
        Dead time, with that of driver and messages, without the hold of a command for a tick.
    lag_s : float
        First order lag; NaN where the pressure has none of its own, behind on/off valves.
    explained : float
        Share of the pressure in the band that the model explains.
    uncertainty_s : float
        Of the dead time: three standard deviations, and 2 ms for the form of the model.
    moved_s : float
        Time of movement it rests on, at most about 10 s.

    """

    delay_s: float
    lag_s: float
    explained: float
    uncertainty_s: float
    moved_s: float

    def text(self) -> str:
        """Return the estimate as one line for people."""
        size = f'{1e3 * self.delay_s:.0f} ms (±{1e3 * self.uncertainty_s:.0f})'
        if math.isnan(self.lag_s):
            return f'dead time of the valves {size}'
        return f'dead time {size}, lag {1e3 * self.lag_s:.0f} ms'


class DelayEstimator:
    """
    Finds dead time and lag while a controller runs; the same numbers for the same ticks.

    Parameters
    ----------
    rate_hz : float
        Ticks per second.

    Raises
    ------
    InputError
        The rate is not a positive number.

    """

    def __init__(self, rate_hz: float) -> None:
        if not (math.isfinite(rate_hz) and rate_hz > 0.0):
            raise InputError(f'rate_hz is {rate_hz}; allowed are positive numbers', 'rate_hz')
        self.period_s = 1.0 / rate_hz
        self._state = zeros(WAY)
        self._command, self._pressure = np.zeros(1), np.zeros(1)

    def step(self, command_pa: float, pressure_pa: float) -> bool:
        """
        Take in one tick; return whether the estimate is confident.

        Parameters
        ----------
        command_pa : float
            Command of this tick [Pa].
        pressure_pa : float
            Pressure measured in this tick [Pa]; NaN where none was.

        """
        self._command[0], self._pressure[0] = command_pa, pressure_pa
        return observe_all(self._state, self.period_s, self._command, self._pressure)

    def steps(self, command_pa: FloatArray, pressure_pa: FloatArray) -> bool:
        """Take in rows of ticks, shape (N,) each; return whether the estimate is confident."""
        return observe_all(self._state, self.period_s, np.ascontiguousarray(command_pa, float),
                           np.ascontiguousarray(pressure_pa, float))

    def estimate(self, unsure: bool = False) -> PathEstimate | None:
        """Return what was found; None while it is not confident and ``unsure`` is False."""
        st = fields(self._state, WAY)
        if st.explained == 0.0 or not (unsure or confident.py_func(st)):
            return None
        return PathEstimate(*(float(st[name]) for name in (
            'delay_s', 'lag_s', 'explained', 'uncertainty_s', 'moved_s')))

    def pause(self) -> None:
        """Forget the motion, for instance after a gap, and keep what was found."""
        pause.py_func(fields(self._state, WAY))

    def reset(self) -> None:
        """Forget everything."""
        self._state[:] = 0.0


def estimate_path(command_pa: FloatArray, pressure_pa: FloatArray, rate_hz: float
                  ) -> PathEstimate:
    """
    Return dead time and lag of a recorded command and pressure.

    Parameters
    ----------
    command_pa, pressure_pa : array_like, shape (N,)
        Command and measured pressure [Pa] at equidistant times.
    rate_hz : float
        Samples per second of both.

    Raises
    ------
    InputError
        Shapes differ, too little moves, or no first order lag explains the pressure.

    """
    command, pressure = np.asarray(command_pa, float), np.asarray(pressure_pa, float)
    if command.ndim != 1 or command.shape != pressure.shape:
        raise InputError(
            f'command and pressure have shapes {command.shape} and {pressure.shape}; both must '
            'be one equal row of samples', 'recording')
    estimator = DelayEstimator(rate_hz)
    sure = estimator.steps(command, pressure)
    found = estimator.estimate(unsure=True)
    if found is None or found.moved_s < LEAST_MOVED_S:
        moved_s = 0.0 if found is None else found.moved_s
        raise InputError(
            f'the command moves for {moved_s:.1f} s; {LEAST_MOVED_S:g} s are needed to tell '
            'dead time and lag', 'recording')
    if not sure:
        raise InputError(
            'no dead time with a first order lag explains the pressure: '
            f'{100.0 * found.explained:.0f} % explained, dead time known to '
            f'±{1e3 * found.uncertainty_s:.0f} ms', 'recording')
    return found

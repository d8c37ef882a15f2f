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
Dead time from the duties of on/off valves to measured pressure, found from ordinary movement.

Behind on/off valves a driver makes the pressure follow. It corrects by its own model, so command
and pressure tell little of the valves. The duties do: each valve lets in or out what ISO 6358 says
of its opening. A moving muscle changes the pressure as well, by ``-p dV / V``. So the pressure is
a sum of three parts, each with a gain of its own: air let in, air let out, and motion. Conductance
and volume need not be known.

Sums with forgetting run side by side for a grid of dead times. All signals pass the same band, in
which zero errors, creep and noise say little. The dead time that leaves the least error is the
best; a parabola through it and its neighbours gives what lies between them. The lag of a pressure
sensor is found as dead time.
"""

import math

import numpy as np
from pam_actuation.control.delay_estimate import (
    FREE, HIGH_PASS_HZ, LEAST_EXPLAINED, LEAST_MOVED_S, LOCAL_S, LOW_PASS_HZ, MEMORY_S,
    MOST_UNCERTAIN_S, PathEstimate, SPREADS, STEP_S, STILL_PA)
from pam_sim.annotations import FloatArray
from pam_sim.compiled import Compiled, compiled, entry_point, source_key
from pam_sim.errors import InputError
from pam_sim.parameters import check_parameters
from pam_sim.records import fields, part, record, zeros
from pam_sim.units import P_ATM_PA
from pam_sim.valve import hsv
from pam_sim.valve.flow import flow_function

DELAYS = 27
PARTS = 3                 # air let in, air let out, motion
_MODEL_S = 3e-3           # error that volume, valves and sensors unlike these leave
_ABSENT = 1e-9            # of a part, left by those before it: it says nothing of its own
_RIG = check_parameters(hsv.PARAMETERS, {})
_PAIRS = PARTS * (PARTS + 1) // 2

VALVES = record(
    'running',                        # 1 once the filters have begun
    'steps',                          # of the grid since then
    'ticks',                          # of the step that is being gathered
    'fill_sum', 'vent_sum', 'pressure_sum_pa', 'contraction_sum_m',
    'former_pa', 'former_m',
    ('fill_past', DELAYS), ('vent_past', DELAYS),
    ('pressure_filter', 4), ('motion_filter', 4),
    ('fill_filter', 4 * DELAYS), ('vent_filter', 4 * DELAYS),
    'active',                         # share of the steps with an open valve
    'pressure_power_pa2',
    # Sums with forgetting.
    ('own', _PAIRS * DELAYS),         # of products of the parts
    ('common', PARTS * DELAYS),       # of the parts times the pressure
    'power',                          # of the squares of the pressure
    'moved_s',                        # time in which the valves worked
)


@compiled
def _in_band(filters: FloatArray, at: int, change: float, keep: float, share: float) -> float:
    """
    Return a signal behind two high passes and two low passes, from its change in a step.

    ``keep`` and ``share`` are what a high pass keeps and a low pass takes over in a step.
    """
    filters[at] = keep * (filters[at] + change)
    filters[at + 1] += (1.0 - keep) * (filters[at] - filters[at + 1])
    filters[at + 2] += share * (filters[at] - filters[at + 1] - filters[at + 2])
    filters[at + 3] += share * (filters[at + 2] - filters[at + 3])
    value: float = filters[at + 3]
    return value


@compiled
def _begin(st: np.record, pressure_pa: float, contraction_m: float) -> None:
    st.running = 1.0
    st.steps = 0.0
    st.ticks = 0.0
    st.fill_sum = 0.0
    st.vent_sum = 0.0
    st.pressure_sum_pa = 0.0
    st.contraction_sum_m = 0.0
    st.former_pa = pressure_pa
    st.former_m = contraction_m
    st.active = 0.0
    st.pressure_power_pa2 = 0.0
    for j in range(4):
        st.pressure_filter[j] = 0.0
        st.motion_filter[j] = 0.0
    for j in range(4 * DELAYS):
        st.fill_filter[j] = 0.0
        st.vent_filter[j] = 0.0
    for d in range(DELAYS):
        st.fill_past[d] = 0.0
        st.vent_past[d] = 0.0


@compiled
def _gather(st: np.record, step_s: float, fill: float, vent: float, pressure_pa: float,
            contraction_m: float, supply_pa: float, critical_ratio: float) -> None:
    """Advance all filters by one step of the grid and add to the sums."""
    high = math.exp(-2.0 * math.pi * HIGH_PASS_HZ * step_s)
    low = 1.0 - math.exp(-2.0 * math.pi * LOW_PASS_HZ * step_s)
    y = _in_band(st.pressure_filter, 0, pressure_pa - st.former_pa, high, low)
    motion = _in_band(
        st.motion_filter, 0, pressure_pa * (contraction_m - st.former_m), high, low)
    st.former_pa = pressure_pa
    st.former_m = contraction_m
    let_in = step_s * supply_pa * flow_function(pressure_pa / supply_pa, critical_ratio)
    let_out = step_s * pressure_pa * flow_function(P_ATM_PA / pressure_pa, critical_ratio)
    local = 1.0 - math.exp(-step_s / LOCAL_S)
    works = 1.0 if fill > 0.0 or vent > 0.0 else 0.0
    moves: float = st.active
    moves += local * (works - moves)
    seen: float = st.pressure_power_pa2
    seen += local * (y * y - seen)
    st.active = moves
    st.pressure_power_pa2 = seen
    steps: float = st.steps + 1.0
    st.steps = steps
    counts = steps > DELAYS
    weight = moves / (seen + STILL_PA * STILL_PA)
    keep = 1.0
    if counts:
        keep = math.exp(-step_s * moves / MEMORY_S)
        st.power = keep * st.power + weight * y * y
        st.moved_s = keep * st.moved_s + moves * step_s
    rows = DELAYS
    newest = int(steps) % rows
    for d in range(DELAYS):
        ago = (newest - 1 - d) % rows
        a = _in_band(st.fill_filter, 4 * d, st.fill_past[ago] * let_in, high, low)
        b = _in_band(st.vent_filter, 4 * d, st.vent_past[ago] * let_out, high, low)
        if not counts:
            continue
        at = _PAIRS * d
        st.own[at] = keep * st.own[at] + weight * a * a
        st.own[at + 1] = keep * st.own[at + 1] + weight * a * b
        st.own[at + 2] = keep * st.own[at + 2] + weight * b * b
        st.own[at + 3] = keep * st.own[at + 3] + weight * a * motion
        st.own[at + 4] = keep * st.own[at + 4] + weight * b * motion
        st.own[at + 5] = keep * st.own[at + 5] + weight * motion * motion
        at = PARTS * d
        st.common[at] = keep * st.common[at] + weight * a * y
        st.common[at + 1] = keep * st.common[at + 1] + weight * b * y
        st.common[at + 2] = keep * st.common[at + 2] + weight * motion * y
    st.fill_past[newest] = fill
    st.vent_past[newest] = vent


@compiled
def _observe_all(state: FloatArray, period_s: float, critical_ratio: float, fill: FloatArray,
                 vent: FloatArray, pressure_pa: FloatArray, contraction_m: FloatArray,
                 supply_pa: FloatArray) -> None:
    st = part(state, 0, VALVES)
    stride = max(1.0, float(round(STEP_S / period_s)))
    for k in range(fill.shape[0]):
        p_pa, x_m = pressure_pa[k], contraction_m[k]
        if not (math.isfinite(p_pa + x_m + fill[k] + vent[k] + supply_pa[k]) and p_pa > 0.0):
            st.running = 0.0
            continue
        if st.running < 0.5:
            _begin(st, p_pa, x_m)
        st.fill_sum += fill[k]
        st.vent_sum += vent[k]
        st.pressure_sum_pa += p_pa
        st.contraction_sum_m += x_m
        st.ticks += 1.0
        if st.ticks < stride:
            continue
        _gather(st, stride * period_s, st.fill_sum / stride, st.vent_sum / stride,
                st.pressure_sum_pa / stride, st.contraction_sum_m / stride, supply_pa[k],
                critical_ratio)
        st.fill_sum = 0.0
        st.vent_sum = 0.0
        st.pressure_sum_pa = 0.0
        st.contraction_sum_m = 0.0
        st.ticks = 0.0


def _entry(key: int) -> Compiled[..., None]:
    """Return the function over whole arrays as one unit of compiled code."""
    @entry_point
    def observe_all(state: FloatArray, period_s: float, critical_ratio: float, fill: FloatArray,
                    vent: FloatArray, pressure_pa: FloatArray, contraction_m: FloatArray,
                    supply_pa: FloatArray) -> None:
        """Take in a row of ticks."""
        if key >= 0:      # always; makes the key part of what is stored
            _observe_all(state, period_s, critical_ratio, fill, vent, pressure_pa, contraction_m,
                         supply_pa)

    return observe_all


_observe = _entry(source_key(_observe_all))


class ValveDelayEstimator:
    """
    Finds the dead time of on/off valves; the same numbers for the same ticks.

    Parameters
    ----------
    rate_hz : float
        Ticks per second.
    critical_ratio : float
        Critical pressure ratio b of each valve, ISO 6358.

    Raises
    ------
    InputError
        The rate is not a positive number.

    """

    def __init__(self, rate_hz: float, critical_ratio: float = _RIG['b']) -> None:
        if not (math.isfinite(rate_hz) and rate_hz > 0.0):
            raise InputError(f'rate_hz is {rate_hz}; allowed are positive numbers', 'rate_hz')
        self.period_s = 1.0 / rate_hz
        self._critical_ratio = critical_ratio
        self._state = zeros(VALVES)

    def steps(self, fill_duty: FloatArray, vent_duty: FloatArray, pressure_pa: FloatArray,
              contraction_m: FloatArray, supply_pa: 'float | FloatArray' = _RIG['supply_pa']
              ) -> None:
        """
        Take in rows of ticks, shape (N,) each.

        Parameters
        ----------
        fill_duty, vent_duty : array_like
            Sent in each tick, 0 to 1; they act from then on.
        pressure_pa, contraction_m : array_like
            Measured in each tick, before the duties. After a NaN the filters begin anew.
        supply_pa : float or array_like
            Absolute supply pressure [Pa].

        """
        fill = np.ascontiguousarray(fill_duty, float)
        supply = np.array(np.broadcast_to(np.asarray(supply_pa, float), fill.shape))
        _observe(self._state, self.period_s, self._critical_ratio, fill,
                 np.ascontiguousarray(vent_duty, float), np.ascontiguousarray(pressure_pa, float),
                 np.ascontiguousarray(contraction_m, float), supply)

    def estimate(self, unsure: bool = False) -> PathEstimate | None:
        """
        Return what was found; None while it is not sure and ``unsure`` is False.

        Its lag is NaN: the pressure behind a valve has none of its own.
        """
        st = fields(self._state, VALVES)
        power, moved_s = float(st.power), float(st.moved_s)
        if power <= 0.0 or moved_s <= 0.0:
            return None
        error = np.array([power - _explained(
            st.own[_PAIRS * d:_PAIRS * (d + 1)], st.common[PARTS * d:PARTS * (d + 1)])
            for d in range(DELAYS)])
        best = int(np.argmin(error))
        stride = max(1, round(STEP_S / self.period_s))
        step_s = stride * self.period_s
        middle = min(max(best, 1), DELAYS - 2)
        below, least, above = error[middle - 1:middle + 2]
        bend = below - 2.0 * least + above
        place, uncertainty_s = float(best), math.inf
        if bend > 0.0:
            place = middle + float(np.clip(0.5 * (below - above) / bend, -1.0, 1.0))
            free = FREE * moved_s / step_s
            uncertainty_s = SPREADS * step_s * math.sqrt(
                2.0 * max(error[best], 0.0) / (free * bend)) + _MODEL_S
        found = PathEstimate(
            max(place * step_s + 0.5 * (stride - 1) * self.period_s, 0.0), math.nan,
            1.0 - float(error[best]) / power, uncertainty_s, moved_s)
        sure = (moved_s >= LEAST_MOVED_S and found.explained >= LEAST_EXPLAINED
                and uncertainty_s <= MOST_UNCERTAIN_S and best < DELAYS - 1)
        return found if sure or unsure else None


def _explained(own: FloatArray, common: FloatArray) -> float:
    """Return the power of the pressure that the parts explain with their best gains."""
    lower, rest = np.zeros((PARTS, PARTS)), np.zeros(PARTS)
    for i in range(PARTS):          # Cholesky; a part that says nothing of its own is left out
        row = own[i * (i + 1) // 2:]
        for j in range(i):
            if lower[j, j] > 0.0:
                lower[i, j] = (row[j] - lower[i, :j] @ lower[j, :j]) / lower[j, j]
        left = float(row[i] - lower[i, :i] @ lower[i, :i])
        if left > _ABSENT * row[i]:
            lower[i, i] = math.sqrt(left)
            rest[i] = (common[i] - lower[i, :i] @ rest[:i]) / lower[i, i]
    return float(rest @ rest)

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
Holds of a recording: where the pressure stood still, and what was measured there.

Only measured pressure and contraction are looked at, no command, so that a
recording of any origin will do. Increments must be 5 kPa or more and holds
1 s or longer.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.run import Run
from pam_sim.units import P_ATM_PA

BIN_S = 0.1                 # pressure is averaged over such bins before its rate is judged
STILL_PA = 1.5e3            # change over two bins below which the pressure stands still
SHORTEST_S = 1.0            # shorter stillness is no hold
LONGEST_S = 1e6             # a longer recording has a wrong stamp
SLOW_BINS = 1.1             # between readings of the pressure; with more, most bins are empty
LONGEST_WINDOW_S = 2.0      # averaged: the last half of a hold, at most this much
BLOCKS = 5                  # parts of the window whose means tell drift from noise
SETTLED_STRAIN = 4e-4       # largest spread of these means in a settled hold, of L0
SETTLED_PA = 2e3            # the same for the pressure


@dataclass(frozen=True)
class Hold:
    """
    Means over the end of one hold.

    Parameters
    ----------
    start_s, end_s : float
        Of the averaged window, after the first pressure message.
    pressure_gauge_pa, contraction_m, force_n : float
        Means; force is NaN where none was measured.
    pressure_u_pa, contraction_u_m : float
        Standard uncertainty of these means from their scatter.
    contraction_sd_m : float
        Standard deviation of the contraction samples.
    drift_m : float
        Spread of the contraction within the window, what noise explains taken away.
    branch : str
        ``up`` where the pressure before was lower (or none), ``down`` where it was higher.
    settled : bool

    """

    start_s: float
    end_s: float
    pressure_gauge_pa: float
    contraction_m: float
    force_n: float
    pressure_u_pa: float
    contraction_u_m: float
    contraction_sd_m: float
    drift_m: float
    branch: str
    settled: bool


def find_holds(run: Run, length_m: float) -> list[Hold]:
    """
    Return the holds of a run in order of time, the unsettled ones included.

    Parameters
    ----------
    run : pam_sim.run.Run
        With ``pressure`` and ``contraction``; ``force`` is used where present.
    length_m : float
        Length of the muscle at rest, for what counts as settled.

    Raises
    ------
    InputError
        Pressure or contraction missing, shorter than one hold, a pressure that is read too
        seldom, or a stamp far from the others.

    """
    origin = int(np.min(run.require('pressure').stamp_ns))
    pressure_t, pressure = samples_of(run, 'pressure', 'pressure_pa', origin)
    contraction = samples_of(run, 'contraction', 'contraction_m', origin)
    force = samples_of(run, 'force', 'force_n', origin) if 'force' in run else (
        np.zeros(0), np.zeros(0))
    if pressure_t[-1] - pressure_t[0] < SHORTEST_S:
        raise InputError(f'is shorter than one hold of {SHORTEST_S:g} s', run.path)
    holds: list[Hold] = []
    for begin, end in still_spans(pressure_t, pressure, path=run.path):
        # The last bin already feels the next increment.
        stop = end - 0.5 * BIN_S
        start = stop - min(0.5 * (end - begin), LONGEST_WINDOW_S)
        hold = _means(start, stop, (pressure_t, pressure), contraction, force, length_m, holds)
        if hold is not None:
            holds.append(hold)
    return holds


def samples_of(run: Run, topic: str, key: str, origin_ns: int) -> tuple[FloatArray, FloatArray]:
    """Return (time [s], value) of the finite samples of one topic, times ascending."""
    series = run.require(topic)
    value = np.asarray(series.values[key], dtype=float)
    good = np.isfinite(value)
    if np.count_nonzero(good) < 2:
        raise InputError(f'has {np.count_nonzero(good)} finite `{topic}` values; at least 2 are '
                         'needed', run.path)
    time = series.time_s(origin_ns)[good]
    order = np.argsort(time, kind='stable')
    return time[order], value[good][order]


def still_spans(time: FloatArray, pressure: FloatArray, bin_s: float = BIN_S,
                shortest_s: float = SHORTEST_S, path: str = '') -> list[tuple[float, float]]:
    """
    Return (begin, end) [s] of every stretch of at least a hold without pressure change.

    Raises
    ------
    InputError
        The times span more than any recording, or most bins are empty; ``path`` is named.

    """
    span_s = float(time[-1] - time[0])
    if span_s > LONGEST_S:
        raise InputError(f'its stamps of the pressure span {span_s:.2g} s; allowed is at most '
                         f'{LONGEST_S:g} s', path)
    step_s = float(np.median(np.diff(time)))
    if step_s > SLOW_BINS * bin_s:
        raise InputError(f'its pressure comes every {step_s:.3g} s; to see where it stands still, '
                         f'a reading each {bin_s:g} s or more often is needed', path)
    index = np.floor((time - time[0]) / bin_s).astype(int)
    count = np.bincount(index)
    with np.errstate(invalid='ignore'):
        mean = np.bincount(index, pressure) / count
    noise = 1.05 * np.median(np.abs(np.diff(pressure))) / np.sqrt(max(np.median(count), 1.0))
    still = np.zeros(mean.size, dtype=bool)
    still[1:-1] = np.abs(mean[2:] - mean[:-2]) < max(STILL_PA, 6.0 * noise)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    spans = [[a, b] for a, b in zip(edges[::2], edges[1::2])]
    joined = spans[:1]
    for begin, end in spans[1:]:
        before = joined[-1]
        # A lone disturbance does not end a hold.
        same = abs(_level(mean[before[0]:before[1]]) - _level(mean[begin:end])) < STILL_PA
        if begin - before[1] <= 3 and same:
            before[1] = end
        else:
            joined.append([begin, end])
    return [(time[0] + bin_s * a, time[0] + bin_s * b) for a, b in joined
            if bin_s * (b - a) >= shortest_s - 1e-9]


def _level(mean: FloatArray) -> float:
    """Return the mean of bins, NaN where all are empty."""
    filled = mean[np.isfinite(mean)]
    return float(filled.mean()) if filled.size else np.nan


def _blocks(
        start: float, stop: float,
        series: tuple[FloatArray, FloatArray]) -> tuple[FloatArray, FloatArray, float] | None:
    """Return (samples, block means, standard error of one block mean) in a window."""
    time, value = series
    inside = (time >= start) & (time < stop)
    time, value = time[inside], value[inside]
    block = np.minimum(((time - start) / (stop - start) * BLOCKS).astype(int), BLOCKS - 1)
    if value.size == 0 or np.any(np.bincount(block, minlength=BLOCKS) < 2):
        return None
    means = np.bincount(block, value) / np.bincount(block)
    scatter = np.std(value - means[block])
    return value, means, scatter / np.sqrt(value.size / BLOCKS)


def _means(
        start: float, stop: float, pressure: tuple[FloatArray, FloatArray],
        contraction: tuple[FloatArray, FloatArray], force: tuple[FloatArray, FloatArray],
        length_m: float, before: Sequence[Hold]) -> Hold | None:
    """Return the Hold of a window, None where it has too few samples."""
    p, x, f = (_blocks(start, stop, series) for series in (pressure, contraction, force))
    if p is None or x is None:
        return None
    gauge = float(np.mean(p[0])) - P_ATM_PA
    branch = 'up'
    if before:
        change = gauge - before[-1].pressure_gauge_pa
        branch = before[-1].branch if abs(change) < STILL_PA else 'up' if change > 0 else 'down'
    drift = max(float(np.ptp(x[1])) - 3.0 * x[2], 0.0)
    settled = (np.ptp(x[1]) <= SETTLED_STRAIN * length_m + 5.0 * x[2]
               and np.ptp(p[1]) <= SETTLED_PA + 5.0 * p[2])
    # Rounded far below what any sensor resolves, so that a written hold is the same hold.
    return Hold(
        round(float(start), 4), round(float(stop), 4), round(gauge, 2),
        round(float(np.mean(x[0])), 10),
        round(float(np.mean(f[0])), 4) if f is not None else float('nan'),
        round(_standard_error(p), 2), round(_standard_error(x), 10),
        round(float(np.std(x[0])), 10), round(drift, 10), branch, bool(settled))


def _standard_error(blocks: tuple[FloatArray, FloatArray, float]) -> float:
    """Return the standard error of the mean, by single samples or by blocks, the larger."""
    value, means, _ = blocks
    return float(max(np.std(value) / np.sqrt(value.size), np.std(means) / np.sqrt(BLOCKS)))

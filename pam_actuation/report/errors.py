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

"""The error of a reference that was tracked, over a run and over the cycles in it."""

from collections.abc import Sequence
import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from pam_actuation.control.sent_reference import wanted_at
from pam_actuation.report import signals
from pam_actuation.report.begun import begun_s
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.run import Run

Signal = tuple[FloatArray, FloatArray]          # time [s], values
Cycles = tuple[float, float, int]               # start [s], period [s], count
# By the domain of an experiment: topic and field of its reference, and of what follows it.
_ASKED = {'contraction': ('reference', 'contraction_m', 'contraction', 'contraction_m'),
          'force': ('reference', 'force_n', 'force', 'force_n'),
          'joint_angle': ('joint_reference', 'angle_rad', 'joint_state', 'angle_rad')}


def rmse(error: ArrayLike) -> float | None:
    """Return the root mean square of the finite values, or None if there is none."""
    values = np.asarray(error, dtype=float)
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(values ** 2))) if values.size else None


def difference(reference: Signal | None, measured: Signal | None) -> Signal | None:
    """Return (time_s, reference - measured) where both exist, or None."""
    if reference is None or measured is None or len(reference[0]) < 2:
        return None
    (tr, r), (tx, x) = reference, measured
    inside = (tx >= tr[0]) & (tx <= tr[-1])
    if not inside.any():
        return None
    return tx[inside], wanted_at(tx[inside], tr, r) - x[inside]


def split_rmse(time_s: ArrayLike, error: ArrayLike, period_s: float, start_s: float,
               count: int | None = None) -> FloatArray:
    """
    Return the RMSE of every complete period from start_s on, as an array.

    Parameters
    ----------
    time_s, error : array_like, shape (N,)
        Samples of the error over time.
    period_s, start_s : float
        Length of a cycle and start of the first one [s].
    count : int, optional
        Number of cycles; by default as many as are complete.

    """
    time, errors = np.asarray(time_s, dtype=float), np.asarray(error, dtype=float)
    if time.size < 2 or period_s <= 0.0:
        return np.empty(0)
    # The last sample lies up to one sample before the end of the last cycle.
    complete = int(np.floor((time[-1] - start_s) / period_s + 0.02))
    complete = max(complete if count is None else min(complete, int(count)), 0)
    values = []
    for k in range(complete):
        inside = ((time >= start_s + k * period_s)
                  & (time < start_s + (k + 1) * period_s))
        value = rmse(errors[inside])
        values.append(np.nan if value is None else value)
    return np.array(values)


def find_parts(run: 'Run') -> tuple[Cycles, ...]:
    """
    Return (start_s, period_s, count) of every part of the reference that repeats itself.

    Read from the experiment in the bag's metadata, without the cycles that had begun before the
    first messages. A foreign bag is searched for equally spaced rising crossings of the
    reference's middle value, which give one part.
    """
    text = run.metadata.get('experiment') if run.metadata else None
    if text:
        from pam_actuation.experiments import load_experiment
        try:
            experiment = load_experiment(text)
        except InputError:
            experiment = None
        if experiment is not None:
            return _recorded(run, experiment)
    reference = signals.series(run, 'reference')
    found = None if reference is None else cycles_of_signal(*reference)
    return () if found is None else (found,)


def _recorded(run: 'Run', experiment: 'Experiment') -> tuple[Cycles, ...]:
    """Return the cycles of an experiment that begin after the first messages of a run."""
    topic, field, followed, read = _ASKED.get(experiment.domain, ('', '', '', ''))
    reference, measured = signals.series(run, topic, field), signals.series(run, followed, read)
    if reference is None or measured is None:
        return experiment.periodic_parts
    begun = begun_s(experiment, *reference)
    first_s, left = max(float(measured[0][0]), 0.0), []
    for start_s, period_s, count in experiment.periodic_parts:
        start_s -= begun
        # As at the end, where the last sample lies up to one sample before that of the cycle.
        over = max(math.ceil((first_s - start_s) / period_s - 0.02), 0)
        if over < count or not over:
            left.append((start_s + over * period_s, period_s, count - over))
    return tuple(left)


def cycles_of_signal(time_s: ArrayLike, value: ArrayLike) -> Cycles | None:
    """Return (start_s, period_s, count) of an evenly repeating signal, or None."""
    time, values = np.asarray(time_s, dtype=float), np.asarray(value, dtype=float)
    if values.size < 8 or np.ptp(values) <= 0.0:
        return None
    centred = values - 0.5 * (values.max() + values.min())
    rising = np.flatnonzero((centred[:-1] < 0.0) & (centred[1:] >= 0.0))
    if rising.size < 3:
        return None
    share = -centred[rising] / (centred[rising + 1] - centred[rising])
    crossing = time[rising] + share * (time[rising + 1] - time[rising])
    gaps = np.diff(crossing)
    period = float(np.median(gaps))
    even = np.abs(gaps - period) < 0.03 * period
    if even.sum() < 2 or even.sum() < 0.8 * even.size:
        return None
    start = float(crossing[np.flatnonzero(even)[0]])
    return start, period, int((time[-1] - start) / period + 0.02)


def part_rmse(error: Signal | None, parts: Sequence[Cycles]) -> list[FloatArray]:
    """Return the RMSE of every complete cycle, one array for each part."""
    return [np.empty(0) if error is None else split_rmse(*error, period_s, start_s, count)
            for start_s, period_s, count in parts]


def joined(values: Sequence[FloatArray]) -> FloatArray:
    """Return the values of all parts in one array."""
    return np.concatenate([np.empty(0), *values])


def counted(parts: Sequence[Cycles], *values: Sequence[FloatArray]) -> tuple[Cycles, ...]:
    """Return the parts with the number of their complete cycles, less those without any."""
    counts = [max(map(len, of_part)) for of_part in zip(*values)]
    return tuple((start_s, period_s, count)
                 for (start_s, period_s, _), count in zip(parts, counts) if count)


def by_part(values: FloatArray, parts: Sequence[Cycles]) -> list[tuple[str, FloatArray]]:
    """Return (frequency in words, values) of each part; '' for the frequency of a single one."""
    if not len(values):
        return []
    split = np.split(values, np.cumsum([count for _, _, count in parts])[:-1])
    return [('' if len(parts) == 1 else f'{1.0 / period_s:.3g} Hz', of_part)
            for (_, period_s, _), of_part in zip(parts, split)]


def parts_as_data(parts: Sequence[Cycles]) -> list[dict[str, float]]:
    """Return the parts as plain data."""
    return [dict(zip(('start_s', 'period_s', 'count'), part)) for part in parts]

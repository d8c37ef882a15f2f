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

"""Rows that repeat an old reading, since the logger asks more often than the sensor answers."""

from dataclasses import replace

import numpy as np
from pam_actuation.messages import VALVE_NAMES
from pam_actuation.tables.importer import Recording
from pam_actuation.tables.resample import is_measured
from pam_sim.annotations import BoolArray, FloatArray, IntArray
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.duties import period_of_changes_s, rows_of_periods
from pam_sim.gap.data.noise import smallest_step

QUICK_STEPS = 4.0            # of the resolution, in one row: then a fresh reading must change
FEWEST = 10                  # quick changes, one after the other; a record of steps has few
HALF = 0.5                   # of them; fewer that follow a repeat are rests of the motion
AT_REST_PERCENT = 90.0       # of the runs: a longer one is a signal at rest
SLOWEST_S = 0.15             # of a reading; what stands still for longer moves in jumps


def without_repeats(recording: Recording) -> Recording:
    """
    Return a recording without the rows that repeat an old reading.

    A logger that writes a row each 10 ms repeats a load cell that answers each 90 ms nine times.
    Taken for readings, the repeats are a signal that stands still and jumps. Such a signal is
    known by its quick changes. Where it moves by several steps of its resolution from row to row,
    a fresh reading never equals the one before. Of a signal at rest one row in as many as a
    reading lasts is kept.

    A reading that is new in a row came at some time since the row before. Its stamp is the middle
    between the two, for the time of the row is late by half a row, as a lag of the sensor is.

    Parameters
    ----------
    recording : Recording
        With a row of every signal at each time. Commands are not readings, and stay, except
        duties of on/off valves: one a period is one pulse.

    """
    signals, told = dict(recording.signals), []
    for name, (stamps, values) in recording.signals.items():
        if not is_measured(name):
            continue
        known = np.isfinite(values)
        fresh = fresh_rows(stamps[known], values[known])
        if fresh.all():
            continue
        signals[name] = _between_rows(stamps[known])[fresh], values[known][fresh]
        told.append(f'{name}: rows repeat old readings, {int(fresh.sum())} of {fresh.size} were '
                    'kept')
    for name in recording.signals:
        place, _, last = name.rpartition('/')
        if last == VALVE_NAMES['hsv'][0]:
            told += _without_duties(f'{place}/' if place else '', signals)
    return replace(recording, signals=signals, told=[*recording.told, *told])


def _without_duties(place: str, signals: dict[str, tuple[IntArray, FloatArray]]) -> list[str]:
    """Keep the duties of a pair of valves once for each of their periods; return what is told."""
    names = [place + name for name in VALVE_NAMES['hsv']]
    (stamps, _), (others, _) = (signals[name] for name in names)
    if not np.array_equal(stamps, others):
        return []
    duties = np.column_stack([signals[name][1] for name in names])
    known = np.isfinite(duties).all(axis=1)
    period_s = period_of_changes_s(stamps[known], duties[known])
    # A slower signal stays: what of it is a period, the model of the rig tells.
    if not 0.0 < period_s * CRITERIA.min_pulse_rate_hz <= 1.0:
        return []
    rows = rows_of_periods(stamps, duties, period_s)
    if rows is None or not rows.size:
        return []
    signals |= {name: (stamps[rows], signals[name][1][rows]) for name in names}
    return [f'{" and ".join(names)}: rows repeat duties that change every {1e3 * period_s:.3g} ms '
            f'at most, {rows.size} of {stamps.size} were kept']


def _between_rows(stamps: IntArray) -> IntArray:
    """Return the middle between each row and the one before, as rows usually follow."""
    before = np.diff(stamps, prepend=stamps[:1])
    return stamps - np.minimum(before, int(np.median(before))) // 2


def fresh_rows(stamps: IntArray, values: FloatArray) -> BoolArray:
    """
    Return which rows are to be kept: all where none repeats an old reading.

    Parameters
    ----------
    stamps : ndarray, shape (rows,)
        Times of the rows [ns].
    values : ndarray, shape (rows,)
        One signal, without missing values.

    """
    kept = np.ones(values.size, bool)
    changes = np.flatnonzero(np.diff(values) != 0.0) + 1
    if changes.size <= FEWEST:
        return kept
    steps = np.abs(values[changes] - values[changes - 1])
    quick = steps >= (QUICK_STEPS - 1e-6) * smallest_step(np.unique(values))
    runs = np.diff(changes)[quick[1:] & quick[:-1]]
    if runs.size < FEWEST or np.mean(runs > 1) < HALF:
        return kept
    longest = max(int(np.percentile(runs, AT_REST_PERCENT)), 2)
    if 1e-9 * longest * float(np.median(np.diff(stamps))) > SLOWEST_S:
        return kept
    starts = np.concatenate([[0], changes])
    since = np.arange(values.size) - np.repeat(
        starts, np.diff(np.append(starts, values.size)))
    return since % longest == 0

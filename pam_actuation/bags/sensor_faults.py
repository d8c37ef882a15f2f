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

"""Faults of a sensor that show in the course of its values, each as a sentence."""

from typing import NamedTuple

import numpy as np
from pam_sim.annotations import FloatArray, IntArray

# A load that moves so far within one sample is accelerated by more: of the end of a muscle, m/s²,
# and of a limb, rad/s².
MOST_ACCELERATION = {'contraction_m': 100.0, 'angle_rad': 1000.0}
MOST_SLIPS = 3                  # in one recording, all in one direction
FASTEST = 3.0                   # times the largest other step
STILL = 0.2                     # of a step, by which the samples before and after it move
AROUND, LATER = 5, 50           # samples on either side that are still, and that stay apart
KEPT = 0.5                      # of a step, still there
FEWEST_SAMPLES = 100
FEWEST_CHANGES = 0.1            # the shortest tenth of the times between changes


class Slip(NamedTuple):
    """A step of a sensor that no load can make: seconds after the first sample, and size."""

    time_s: float
    size: float


def course_remarks(name: str, stamp_ns: IntArray, column: FloatArray) -> list[str]:
    """
    Return a sentence on each fault that shows in the course of the values of a sensor.

    Parameters
    ----------
    name : str
        Of the value, with its unit, such as ``contraction_m``.
    stamp_ns : ndarray of int64
        Stamps.
    column : ndarray
        Values, NaN where missing.

    """
    return _slip_remarks(name, stamp_ns, column)


def _slip_remarks(name: str, stamp_ns: IntArray, column: FloatArray) -> list[str]:
    if name not in MOST_ACCELERATION:
        return []
    found = slips(stamp_ns, column, MOST_ACCELERATION[name])
    if not found:
        return []
    factor, unit = (1e3, 'mm') if name == 'contraction_m' else (1.0, 'rad')
    jumps = ' and '.join(f'by {factor * one.size:+.3g} {unit} at {one.time_s:.3f} s'
                         for one in found)
    return [f'{name} jumps within one sample {jumps} after its first message and stays there, '
            'faster than any load moves. Did the encoder slip? Its zero is another from then on: '
            'use the part before or after.']


def slips(stamp_ns: IntArray, column: FloatArray, most_acceleration: float) -> list[Slip]:
    """
    Return where an encoder slips, a list of Slip.

    A slip is a step from one sample to the next that stays. It is far larger than any other
    step, the samples on both sides are still, and no load could come so far in that time.

    Parameters
    ----------
    stamp_ns : ndarray of int64
        Stamps, rising.
    column : ndarray
        Values, NaN where missing.
    most_acceleration : float
        What no load exceeds, in the unit of the values and 1/s².

    """
    known = np.isfinite(column)
    values, time_s = column[known], (stamp_ns[known] - stamp_ns[0]) * 1e-9
    if len(values) < FEWEST_SAMPLES:
        return []
    steps = np.abs(np.diff(values))
    largest = np.argsort(steps)[:-MOST_SLIPS - 2:-1]
    sizes = steps[largest]
    count = next((n for n in range(1, MOST_SLIPS + 1) if sizes[n - 1] > FASTEST * sizes[n]), 0)
    changes_s = np.diff(time_s[np.flatnonzero(steps)])
    if not count or not len(changes_s):
        return []
    # A slow sensor may be sent several times a reading.
    usual_s = float(np.median(np.diff(time_s)))
    reading_s = max(usual_s, float(np.quantile(changes_s, FEWEST_CHANGES)))
    found = []
    for k in np.sort(largest[:count]).tolist():
        size, step_s = float(values[k + 1] - values[k]), time_s[k + 1] - time_s[k]
        if 0.0 < step_s < 1.5 * usual_s and abs(size) > most_acceleration * reading_s**2 and (
                _stays(values, k, size)):
            found.append(Slip(float(time_s[k + 1]), size))
    same_way = abs(sum(np.sign(one.size) for one in found)) == count
    return found if same_way else []


def _stays(values: FloatArray, k: int, size: float) -> bool:
    """Return whether the samples on either side of the step after ``k`` are still, and apart."""
    before, after = values[max(k + 1 - LATER, 0):k + 1], values[k + 1:k + 1 + LATER]
    near = before[-AROUND:], after[:AROUND]
    if min(len(side) for side in near) < AROUND:
        return False
    moved = max(float(np.abs(np.diff(side)).max()) for side in near)
    later = float(np.median(after) - np.median(before))
    return moved < STILL * abs(size) and later / size > KEPT

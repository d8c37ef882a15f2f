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
from pam_sim.units import P_ATM_PA

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
LEAST_CLIPPED, LEAST_HELD = 0.01, 10    # share of the samples at the limit, and in one stay
MOST_REPEATED = 0.01            # of the other samples: those of a coarse sensor repeat
LEAST_FROZEN, MOST_ALIKE = 20, 5         # samples that are equal: of a dropout, and elsewhere
LEAST_NOISE = 2e-5              # of the range, just before it: a model without noise comes to rest
QUIETEST, LEAST_EVEN = 2.0, 0.1          # per cent of the stretches; their noise, of the usual one
LEAST_TURNS = 0.25              # of the bends elsewhere, that noise turns round one by one
# Where a rig is at rest, and how far from it a sensor may begin: it is no fault to see no less.
RESTS = {'pressure_pa': (P_ATM_PA, 5e3), 'contraction_m': (0.0, 1e-3), 'force_n': (0.0, 5.0)}
_SHOWN = {'pressure_pa': (1e-3, -P_ATM_PA, 'kPa gauge'), 'contraction_m': (1e3, 0.0, 'mm'),
          'force_n': (1.0, 0.0, 'N'), 'angle_rad': (1.0, 0.0, 'rad')}


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
    # Where a dropout ends, the signal jumps as well.
    return (_freeze_remarks(name, stamp_ns, column) or _slip_remarks(name, stamp_ns, column)
            ) + _clip_remarks(name, column)


def _slip_remarks(name: str, stamp_ns: IntArray, column: FloatArray) -> list[str]:
    if name not in MOST_ACCELERATION:
        return []
    found = slips(stamp_ns, column, MOST_ACCELERATION[name])
    if not found:
        return []
    factor, _, unit = _SHOWN[name]
    jumps = ' and '.join(f'by {factor * one.size:+.3g} {unit} at {one.time_s:.3f} s'
                         for one in found)
    return [f'{name} jumps within one sample {jumps} after its first message and stays there, '
            'faster than any load moves. Did the encoder slip? Its zero is another from then on: '
            'use the part before or after.']


def _clip_remarks(name: str, column: FloatArray) -> list[str]:
    values = column[np.isfinite(column)]
    if name not in _SHOWN or len(values) < FEWEST_SAMPLES:
        return []
    low, high = float(values.min()), float(values.max())
    rest, margin = RESTS.get(name, (low, -1.0))
    factor, zero, unit = _SHOWN[name]
    return [
        f'{name} is clipped: it stays at its {which} value, exactly '
        f'{factor * (limit + zero):.5g} {unit}, for {100.0 * share:.0f} % of the time, and its '
        'noise is gone there. What the sensor or its converter cannot read is lost: look for its '
        'range.'
        for which, limit in (('largest', high), ('smallest', low))
        if not (limit == low and abs(limit - rest) <= margin)
        and (share := clipped_share(values, limit))]


def _freeze_remarks(name: str, stamp_ns: IntArray, column: FloatArray) -> list[str]:
    known = np.isfinite(column)
    if name not in _SHOWN or known.sum() < FEWEST_SAMPLES:
        return []
    time_s = (stamp_ns[known] - stamp_ns[0]) * 1e-9
    found = freezes(column[known])
    if not found:
        return []
    factor, zero, unit = _SHOWN[name]
    first, last = found[0]
    whole_s = sum(float(time_s[end - 1] - time_s[begin]) for begin, end in found)
    others = len(found) - 1
    more = f', and {others} more time{"s"[:others > 1]}' if others else ''
    return [f'{name} stands still at exactly {factor * (float(column[known][first]) + zero):.5g} '
            f'{unit} from {time_s[first]:.2f} to {time_s[last - 1]:.2f} s after its first '
            f'message{more}, {whole_s:.2g} s in all, and its noise is gone there. Did the sensor '
            'or its line drop out, so that the last value was repeated?']


def freezes(values: FloatArray) -> list[tuple[int, int]]:
    """
    Return where a sensor repeats its last value: begin and end of each stretch.

    Noise moves it all the time elsewhere. At its largest and smallest value it may be clipped.

    Parameters
    ----------
    values : ndarray
        Finite values.

    """
    edges = np.flatnonzero(np.diff(values, prepend=np.nan, append=np.nan))
    lengths = np.diff(edges)
    limits, least = (values.min(), values.max()), LEAST_NOISE * float(np.ptp(values))
    found = [(int(begin), int(begin + length)) for begin, length in zip(edges, lengths)
             if length >= LEAST_FROZEN and values[begin] not in limits and begin >= LEAST_FROZEN
             and _bends(values[begin - LEAST_FROZEN:begin]) > least]
    others = lengths[lengths < LEAST_FROZEN]
    if not found or len(others) < FEWEST_SAMPLES or others.max() > MOST_ALIKE:
        return []
    if len(found) > 1 and len({float(values[begin]) for begin, _ in found}) == 1:
        return []               # a load that rests on its friction or a stop
    is_frozen = np.zeros(len(values), dtype=bool)
    for begin, end in found:
        is_frozen[begin:end] = True
    bends = np.diff(values[~is_frozen], 2)
    turns = bends[1:] * bends[:-1] < 0.0
    return found if turns.mean() > LEAST_TURNS and _is_noisy_throughout(bends) else []


def _is_noisy_throughout(bends: FloatArray) -> bool:
    """Tell whether second differences have about one size: a model without noise glides, too."""
    rows = np.abs(bends[:len(bends) // LEAST_FROZEN * LEAST_FROZEN]).reshape(-1, LEAST_FROZEN)
    sizes = np.median(rows, axis=1)
    return bool(np.percentile(sizes, QUIETEST) > LEAST_EVEN * np.median(sizes))


def _bends(values: FloatArray) -> float:
    """Return the median size of the second differences of values."""
    return float(np.median(np.abs(np.diff(values, 2))))


def clipped_share(values: FloatArray, limit: float) -> float:
    """
    Return the share of the values at a limit of the sensor, 0 where it is not clipped.

    A clipped sensor stays at the limit to the bit, although noise moves it all the time elsewhere.
    A muscle at rest or on its stop has noise there too. A coarse sensor repeats elsewhere too, and
    a simulated one without noise goes smoothly.

    Parameters
    ----------
    values : ndarray
        Finite values.
    limit : float
        The largest or the smallest of them.

    """
    is_there = values == limit
    share = float(is_there.mean())
    edges = np.flatnonzero(np.diff(is_there, prepend=False, append=False))
    if share < LEAST_CLIPPED or int((edges[1::2] - edges[::2]).max()) < LEAST_HELD:
        return 0.0
    steps, is_other = np.diff(values), ~(is_there[1:] | is_there[:-1])
    if is_other.sum() < FEWEST_SAMPLES or (steps[is_other] == 0.0).mean() > MOST_REPEATED:
        return 0.0
    bends = np.diff(steps)
    turns = (bends[1:] * bends[:-1] < 0.0)[is_other[2:] & is_other[1:-1] & is_other[:-2]]
    return share if len(turns) and turns.mean() > LEAST_TURNS else 0.0


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
    if known.sum() < FEWEST_SAMPLES:
        return []
    values, time_s = column[known], (stamp_ns[known] - stamp_ns[0]) * 1e-9
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

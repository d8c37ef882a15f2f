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
What changed over time, since when, and how certain that is.

Four shapes are fitted to every series by weighted least squares: constant, a line over all days,
a step on a day, a line that begins on a day. BIC chooses (Schwarz, Annals of Statistics 6, 1978).
The p of the F-test against the constant is corrected by Bonferroni: for the days on which the
change may begin, and for the number of series and shapes. The scatter is that of the residuals,
and at least a tenth of what the intervals of single recordings say.
"""

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np
from pam_actuation.campaign.series import IN_95, Series
from pam_sim.annotations import BoolArray, FloatArray, IntArray
from pam_sim.gap.data.noise import MAD_TO_SD

LEVEL = 0.01            # of significance, over all tests of a campaign together
FEWEST = 8              # values of a series that is tested
FEWEST_NAMED = 3        # of them, that the recordings name
AT_END = 3              # values before a beginning and from it on, at least
LEAST_SCATTER = 0.1     # in standard deviations of single recordings
FAR = 5.0               # standard deviations from its neighbours at which a value is left out
WINDOW = 5              # values that are neighbours
MOST_LEFT_OUT = 0.1     # share of a series
SHAPES = ('line', 'step', 'ramp')


@dataclass
class Change:
    """
    A change of one series.

    Attributes
    ----------
    series : Series
    shape : str
        ``step``: from one day on another value. ``ramp``: from one day on a line. ``line``: a
        line over all days.
    begin : int
        Place in the series of the first value that is changed; 0 of a line.
    earliest, latest : int
        Its 95 % interval.
    before, after : float
        Fitted values at the first and at the last day, SI.
    amount, amount_sd : float
        Of a step its height, else the slope per day, SI.
    p : float
        Probability of as much by chance in any of the tests.
    left_out : list of int
        Places of values far from their neighbours.

    """

    series: Series
    shape: str
    begin: int
    earliest: int
    latest: int
    before: float
    after: float
    amount: float
    amount_sd: float
    p: float
    left_out: list[int]

    def fitted(self) -> FloatArray:
        """Return the fitted value of every day, shape (N,)."""
        time = self.series.time
        if self.shape == 'step':
            return np.where(np.arange(len(time)) < self.begin, self.before, self.after)
        since = np.maximum(time - time[self.begin], 0.0)
        return np.asarray(self.before + self.amount * since)


def changes_of(several: Sequence[Series], level: float = LEVEL) -> list[Change]:
    """
    Return the changes that are significant, by rig and name.

    Parameters
    ----------
    several : list of Series
        All of a campaign: their number corrects the level.
    level : float
        Probability of any change found where there is none.

    """
    tested = list(filter(is_tested, several))
    tests = len(tested) * len(SHAPES)
    found = [change for one in tested if (change := _change(one, tests)) is not None]
    return [one for one in found if one.p <= level]


def is_tested(series: Series) -> bool:
    """Tell whether a series has values enough, names among them, and two times, for a test."""
    return (len(series) >= FEWEST and int(series.named.sum()) >= FEWEST_NAMED
            and float(np.ptp(series.time)) > 0.0)


def _change(series: Series, tests: int) -> Change | None:
    """Return the likeliest change of a series, None where constant is likelier."""
    kept = np.flatnonzero(~far_from_neighbours(series))
    time, value, sd = (of[kept] for of in (series.time, series.value, series.sd))
    if not np.ptp(time) > 0.0:
        return None         # the only other day is far from its neighbours
    count, weight = len(kept), sd**-2.0 / np.sum(sd**-2.0)
    total, floor = float(np.sum(sd**-2.0)), len(kept) * LEAST_SCATTER**2
    mean = float(weight @ value)
    off = value - mean

    def residual(column: FloatArray) -> tuple[float, float, float, float]:
        """Return residual, level, amount and 1 / variance of it for unit scatter."""
        middle = float(weight @ column)
        about = column - middle
        known = float(weight @ about**2)
        amount = float(weight @ (about * off)) / known
        rest = total * float(weight @ (off - amount * about)**2)
        return rest, mean - amount * middle, amount, total * known

    def bic(rest: float, numbers: int) -> float:
        return count * math.log((rest + floor) / count) + numbers * math.log(count)

    constant = total * float(weight @ off**2)
    best_score, best = bic(constant, 1), None
    for shape in SHAPES:
        starts = [0] if shape == 'line' else _starts(shape, time)
        rests = [residual(_column(shape, time, start)) for start in starts]
        if not rests:
            continue
        least = int(np.argmin([rest for rest, *_ in rests]))
        score = bic(rests[least][0], 2 if shape == 'line' else 3)
        if score < best_score:
            best_score, best = score, (shape, starts, rests, least)
    if best is None:
        return None
    shape, starts, rests, least = best
    rest, level, amount, known = rests[least]
    scatter = max(rest / (count - 2), LEAST_SCATTER**2)
    p = min(1.0, _tail((constant - rest) / scatter, count - 2) * len(starts) * tests)
    limit = rest + scatter * _quantile(count - 3)
    possible = [start for start, (other, *_) in zip(starts, rests) if other <= limit]
    fitted = level + amount * _column(shape, time, starts[least])
    if abs(fitted[-1] - fitted[0]) < IN_95 * float(np.median(sd)):
        return None         # less than what one recording can tell
    left_out = [int(k) for k in range(len(series)) if k not in kept]
    return Change(
        series, shape, int(kept[starts[least]]), int(kept[min(possible)]),
        int(kept[max(possible)]), float(fitted[0]), float(fitted[-1]), float(amount),
        math.sqrt(scatter / known), p, left_out)


def _starts(shape: str, time: FloatArray) -> list[int]:
    """Return the places at which a shape may begin; of equal times the first."""
    places = range(AT_END, len(time) - AT_END + 1)
    return [k for k in places if time[k] > time[k - 1]
            and (shape == 'step' or time[-1] > time[k])]    # a line needs a later time


def _column(shape: str, time: FloatArray, start: int) -> FloatArray:
    """Return what a shape does with time, before its amount."""
    if shape == 'step':
        return np.asarray(time >= time[start], dtype=float)
    return np.maximum(time - time[start], 0.0)


def far_from_neighbours(series: Series) -> BoolArray:
    """
    Return which values are far from their neighbours, shape (N,); none where they are many.

    Far from the median of them, which follows a step, and from a robust line through the
    others, which follows a slope.
    """
    count = len(series)
    off = np.zeros(count)
    for k in range(count):
        near = _window(k, count)
        off[k] = min(abs(series.value[k] - np.median(series.value[near])),
                     abs(series.value[k] - _robust_line(series, near[near != k], k)))
    scatter = np.maximum(MAD_TO_SD * float(np.median(off)), series.sd)
    far = off > FAR * scatter
    if int(far.sum()) > MOST_LEFT_OUT * count:
        far[:] = False
    return far


def _robust_line(series: Series, near: IntArray, k: int) -> float:
    """Return the value at a place of the line of Theil and Sen through other places."""
    time, value = series.time[near], series.value[near]
    run, rise = (of[None, :] - of[:, None] for of in (time, value))
    slopes = rise[run > 0.0] / run[run > 0.0]
    slope = float(np.median(slopes)) if len(slopes) else 0.0
    return float(np.median(value - slope * (time - series.time[k])))


def _window(k: int, count: int) -> IntArray:
    low = min(max(k - WINDOW // 2, 0), max(count - WINDOW, 0))
    return np.arange(low, min(low + WINDOW, count))


def _tail(f: float, freedom: int) -> float:
    """Return the probability of a larger F with 1 and ``freedom`` degrees of freedom."""
    from scipy.special import fdtrc
    return float(fdtrc(1, freedom, max(f, 0.0)))


def _quantile(freedom: int) -> float:
    """Return the F that is exceeded by chance in 5 %."""
    from scipy.special import fdtri
    return float(fdtri(1, freedom, 0.95))

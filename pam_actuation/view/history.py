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

"""The newest minute of one topic at full rate, and how it is thinned for the screen."""

from typing import Final

import numpy as np
from pam_sim.annotations import FloatArray, IntArray

FIRST_ROWS: Final = 4096
MOST_ROWS: Final = 1 << 19          # 60 s at 8 kHz; a faster topic keeps less than 60 s
RESTART_NS: Final = 1_000_000_000   # a stamp this far back is a clock that was set back


class History:
    """
    The rows of one topic in order of their stamps, the oldest dropped after ``span_ns``.

    The rows stand in one piece of memory, so that they can be read without a copy.

    Parameters
    ----------
    names : tuple of str
        Names of the K values of a row.
    span_ns : int, optional
        Time kept [ns]; None keeps everything.

    Attributes
    ----------
    end : int
        Number of rows ever appended. A reader that remembers it finds what is new.
    epoch : int
        Number of times the clock was set back; the rows from before are dropped.
    late : int
        Number of rows left out because their stamp was older than that of the row before.

    """

    def __init__(self, names: tuple[str, ...], span_ns: int | None = None) -> None:
        self.names = names
        self.end = self.epoch = self.late = 0
        self._span_ns = span_ns
        self._begin = self._stop = 0            # of the rows in use
        self._times = np.zeros(FIRST_ROWS, dtype=np.int64)
        self._values = np.zeros((len(names), FIRST_ROWS))

    def __len__(self) -> int:
        """Return the number of rows kept."""
        return self._stop - self._begin

    @property
    def times_ns(self) -> IntArray:
        """Return the stamps of all rows kept [ns], ascending, shape (N,); a view."""
        return self._times[self._begin:self._stop]

    def values(self, name: str) -> FloatArray:
        """Return one value of all rows kept, SI, shape (N,); a view."""
        return self._values[self.names.index(name), self._begin:self._stop]

    @property
    def newest_ns(self) -> int | None:
        """Return the newest stamp [ns], None where there is no row."""
        return int(self._times[self._stop - 1]) if len(self) else None

    def append(self, times_ns: IntArray, values: FloatArray) -> None:
        """
        Add rows.

        Parameters
        ----------
        times_ns : ndarray of int64, shape (N,)
            Stamps in order of arrival [ns].
        values : ndarray of float64, shape (K, N)
            SI values, NaN where a message does not carry one.

        """
        if len(times_ns) and len(self) and self._times[self._stop - 1] - times_ns[-1] > RESTART_NS:
            self.epoch += 1
            self._begin = self._stop
        newest = self.newest_ns
        highest = np.maximum.accumulate(times_ns)
        ordered = times_ns >= highest
        if newest is not None:
            ordered &= times_ns >= newest
        if not ordered.all():
            self.late += int((~ordered).sum())
            times_ns, values = times_ns[ordered], values[:, ordered]
        if not len(times_ns):
            return
        self._make_room(len(times_ns), int(times_ns[-1]))
        stop = self._stop + len(times_ns)
        if stop > len(self._times):             # more at once than there is room for
            skipped = stop - len(self._times)
            times_ns, values = times_ns[skipped:], values[:, skipped:]
            self.end += skipped
            stop = len(self._times)
        self._times[self._stop:stop] = times_ns
        self._values[:, self._stop:stop] = values
        self.end += len(times_ns)
        self._stop = stop

    def _make_room(self, count: int, newest_ns: int) -> None:
        """Move what is still wanted to the front when the end of the memory is reached."""
        if self._span_ns is not None and len(self):
            self._begin += int(np.searchsorted(self.times_ns, newest_ns - self._span_ns))
        if self._stop + count <= len(self._times):
            return
        wanted = len(self) + count
        size = len(self._times)
        while size < 2 * wanted:
            size *= 2
        if self._span_ns is not None:
            size = min(size, MOST_ROWS)
            if wanted > size:                   # a part is moved each time, not a row
                self._begin = min(self._stop, self._begin + wanted - size + size // 8)
        kept = slice(self._begin, self._stop)
        times, values = self._times[kept].copy(), self._values[:, kept].copy()
        if size != len(self._times):
            self._times = np.zeros(size, dtype=np.int64)
            self._values = np.zeros((len(self.names), size))
        self._begin, self._stop = 0, len(times)
        self._times[:self._stop] = times
        self._values[:, :self._stop] = values

    def first_new(self, end: int) -> int:
        """Return the place in ``times_ns`` of the first row after the ``end``-th ever appended."""
        return max(len(self) - (self.end - end), 0)


def columns(times_ns: IntArray, values: FloatArray,
            width_ns: int) -> tuple[IntArray, FloatArray, FloatArray]:
    """
    Return the extremes of each column of the screen, so that no peak is lost.

    Parameters
    ----------
    times_ns : ndarray of int64, shape (N,)
        Ascending stamps [ns].
    values : ndarray of float64, shape (N,)
        What is drawn; NaN is left out.
    width_ns : int
        Time that one column shows [ns].

    Returns
    -------
    column : ndarray of int64, shape (M,)
        Numbers of the columns with at least one value, counted from time 0.
    first, second : ndarray of float64, shape (M,)
        The lowest and the highest value, in the order in which the signal goes through them:
        lowest first where it rises.

    """
    if not len(times_ns):
        return np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0)
    finite = np.isfinite(values)
    if not finite.all():
        times_ns, values = times_ns[finite], values[finite]
        if not len(times_ns):
            return columns(times_ns, values, width_ns)
    numbers = times_ns // width_ns
    starts = np.flatnonzero(np.diff(numbers, prepend=numbers[0] - 1))
    lowest = np.minimum.reduceat(values, starts)
    highest = np.maximum.reduceat(values, starts)
    lasts = np.append(starts[1:], len(values)) - 1
    rises = values[lasts] >= values[starts]
    return (numbers[starts], np.where(rises, lowest, highest), np.where(rises, highest, lowest))

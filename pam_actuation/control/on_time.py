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
Whether all loops were on time of late: what an error is due to otherwise, is no error of rules.

The controller itself is seen by its ticks, a driver by what it tells, the sensors by the age of
what is tracked. How old a reading may be goes by the interval at which the readings come: one of
a slow sensor is no sign of a stall.
"""

from collections import deque
from statistics import median_low

LATE_NS = 20_000_000        # a loop this late leaves an error
# For a slow sensor. With readings 30 ms apart a law that learns may swing, on on/off valves first.
LATEST_NS = 35_000_000
AFTER_LATE_NS = 250_000_000     # for so long, credit delay included, and at most so long again
_INTERVALS = 41             # of which the middle one is that of the sensor
_AT_LEAST = 11              # of these before they count
_AGES = 2                   # intervals that a reading may be old: uneven ones, and a way
_SHARE_NS = 1_000_000_000   # over which the share of ticks on time is averaged


class OnTime:
    """
    Judges in every tick whether all loops were on time of late.

    Parameters
    ----------
    rate_hz : float
        Of the ticks.
    topic : str
        Where what is tracked is measured.

    Attributes
    ----------
    late_ns : int
        A tick or a driver this late leaves an error.
    says : str
        Why learning stands still for most of the time, '' if it does not.

    """

    def __init__(self, rate_hz: float, topic: str) -> None:
        self.late_ns = max(LATE_NS, round(3e9 / rate_hz))
        self._period_ns = round(1e9 / rate_hz)
        self._topic = topic
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self.says = ''
        self._from_ns = 0           # from when on no stall is felt
        self._share, self._worst_ns = 1.0, 0     # of ticks on time; age of the oldest reading
        self._reading_ns: int | None = None
        self._intervals_ns: deque[int] = deque(maxlen=_INTERVALS)

    def judge(self, now_ns: int, gap_ns: int, reading_ns: int, silent_ns: int) -> bool:
        """
        Return whether rules may learn from the error of a tick.

        Parameters
        ----------
        now_ns, gap_ns : int
            Time of the tick and since the one before.
        reading_ns : int
            Stamp of what is tracked.
        silent_ns : int
            For how long a driver has told nothing.

        """
        self._measure(reading_ns)
        age_ns = now_ns - reading_ns
        late_ns = max(gap_ns, age_ns, silent_ns)
        # Asked for where it counts alone: at most sensors no reading is ever that old.
        old = age_ns > self.late_ns and age_ns > self._oldest_ns()
        if old or max(gap_ns, silent_ns) > self.late_ns:
            self._from_ns = now_ns + min(late_ns, AFTER_LATE_NS) + AFTER_LATE_NS
        # The clock may have been set back.
        self._from_ns = min(self._from_ns, now_ns + 2 * AFTER_LATE_NS)
        on_time = now_ns >= self._from_ns
        self._tell(on_time, age_ns if old else 0)
        return on_time

    def _tell(self, on_time: bool, old_ns: int) -> None:
        """Say what keeps rules from learning for most of the time, once it does."""
        self._share += self._period_ns / _SHARE_NS * (on_time - self._share)
        self._worst_ns = max(self._worst_ns, old_ns)
        if self._share > 0.5:
            self.says, self._worst_ns = '', old_ns
        elif self._worst_ns and not self.says:
            self.says = (f'learning mostly stands still: {self._topic} is up to '
                         f'{1e-6 * self._worst_ns:.0f} ms old, at most '
                         f'{1e-6 * self._oldest_ns():.0f} ms count as on time')

    def _measure(self, reading_ns: int) -> None:
        """Take the stamp of the newest reading."""
        before_ns, self._reading_ns = self._reading_ns, reading_ns
        if before_ns is not None and reading_ns > before_ns:
            self._intervals_ns.append(reading_ns - before_ns)

    def _oldest_ns(self) -> int:
        """Return how old a reading may be."""
        if len(self._intervals_ns) < _AT_LEAST:
            return self.late_ns
        wanted_ns = _AGES * median_low(self._intervals_ns) + self._period_ns
        return max(self.late_ns, min(wanted_ns, LATEST_NS))

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

"""How regularly a loop runs and how late its inputs are, clocks that were set; no ROS."""

import math

# Bins of the latency: 2 % wide from 1 us to 10 s.
_BIN = math.log(1.02)
_SHORTEST_NS, _BINS = 1000, math.ceil(math.log(1e7) / _BIN) + 1


class Latency:
    """Distribution of a latency over a whole run, to 2 %, in a few thousand numbers."""

    def __init__(self) -> None:
        self.count = 0
        self.max_ns = 0
        self._counts = [0] * _BINS
        self._used_ns: int | None = None        # stamp of the input used last

    def add(self, latency_ns: int) -> None:
        """Note one; below 0 (clocks of two machines) counts as 0."""
        self.count += 1
        self.max_ns = max(self.max_ns, latency_ns)
        ratio = max(latency_ns, _SHORTEST_NS) / _SHORTEST_NS
        self._counts[min(int(math.log(ratio) / _BIN), _BINS - 1)] += 1

    def used(self, stamp_ns: int | None, now_ns: int) -> None:
        """Note the age of an input when it is used first; None for a stamp: there is none."""
        if stamp_ns is not None and stamp_ns != self._used_ns:
            self._used_ns = stamp_ns
            self.add(now_ns - stamp_ns)

    def quantile_ns(self, share: float) -> float:
        """Return the latency [ns] that a share of all does not exceed, NaN before the first."""
        wanted, seen = share * self.count, 0
        for index, count in enumerate(self._counts):
            seen += count
            if count and seen >= wanted:
                return min(_SHORTEST_NS * math.exp((index + 1) * _BIN), self.max_ns)
        return math.nan

    def values(self, name: str) -> tuple[tuple[str, str], ...]:
        """Return (key, text) pairs for a diagnostic status; times in ms."""
        if not self.count:
            return ()
        return tuple(
            (f'{name}.{key}_ms', f'{time_ns * 1e-6:.3f}') for key, time_ns in (
                ('p50', self.quantile_ns(0.5)), ('p99', self.quantile_ns(0.99)),
                ('max', self.max_ns)))


class ClockSteps:
    """
    Tells whether the clock of the stamps was set since ``begin``.

    Each method takes the time by that clock, read between two times of the clock that the loops
    run on. A process that stood still between two of the readings thus proves nothing. The
    ``ClockMonitor`` of a driver judges one tick, this one all since ``begin``. All times in ns.
    """

    def __init__(self) -> None:
        self._begin_ns: tuple[int, int, int] | None = None

    def begin(self, before_ns: int, now_ns: int, after_ns: int) -> None:
        """Note where both clocks are."""
        self._begin_ns = before_ns, now_ns, after_ns

    def step_s(self, before_ns: int, now_ns: int, after_ns: int) -> float:
        """Return by how much the clock was set [s], at least that; 0 before ``begin``."""
        if self._begin_ns is None:
            return 0.0
        first_before_ns, first_ns, first_after_ns = self._begin_ns
        passed_ns = now_ns - first_ns
        ahead_ns = passed_ns - (after_ns - first_before_ns)
        back_ns = passed_ns - (before_ns - first_after_ns)
        return (max(ahead_ns, 0) + min(back_ns, 0)) * 1e-9


class LoopTiming:
    """
    Statistics of a periodic loop, cheap enough for every tick.

    Parameters
    ----------
    period_s : float
        Wanted period [s]. A tick that comes later than 1.5 periods after the one before
        counts as an overrun; a tick that did not run at all, because the next one was due
        already, counts as missed.

    """

    def __init__(self, period_s: float) -> None:
        self.period_ns = round(period_s * 1e9)
        self.ticks = 0
        self.overruns = 0
        self._last_ns: int | None = None
        self._intervals = 0
        self._span_ns = 0
        self.max_jitter_ns = 0
        self._busy_ns = 0
        self.max_busy_ns = 0

    def begin(self, now_ns: int) -> None:
        """Note the start of a tick; ``now_ns`` comes from a steady clock."""
        if self._last_ns is not None:
            interval = now_ns - self._last_ns
            self._intervals += 1
            self._span_ns += interval
            self.max_jitter_ns = max(self.max_jitter_ns, abs(interval - self.period_ns))
            if interval > 1.5 * self.period_ns:
                self.overruns += 1
        self._last_ns = now_ns
        self.ticks += 1

    @property
    def missed(self) -> int:
        """Return how many ticks did not run: the periods that passed against the ticks."""
        return max(round(self._span_ns / self.period_ns) - self._intervals, 0)

    def since_last_s(self, now_ns: int) -> float:
        """Return the time since the last tick began [s], infinite before the first."""
        return math.inf if self._last_ns is None else (now_ns - self._last_ns) * 1e-9

    def end(self, now_ns: int) -> None:
        """Note the end of the tick begun last."""
        if self._last_ns is None:
            return                  # paused by the tick itself
        busy = now_ns - self._last_ns
        self._busy_ns += busy
        if busy > self.max_busy_ns:
            self.max_busy_ns = busy

    def pause(self) -> None:
        """Forget the last tick, so that a pause does not count as an overrun."""
        self._last_ns = None

    def values(self) -> tuple[tuple[str, str], ...]:
        """Return (key, text) pairs for a diagnostic status; times in ms."""
        if not self._intervals:
            return (('loop.ticks', str(self.ticks)),)
        mean_ns = self._span_ns / self._intervals
        return (
            ('loop.ticks', str(self.ticks)),
            ('loop.period_wanted_ms', f'{self.period_ns * 1e-6:.3f}'),
            ('loop.period_mean_ms', f'{mean_ns * 1e-6:.4f}'),
            ('loop.jitter_max_ms', f'{self.max_jitter_ns * 1e-6:.3f}'),
            ('loop.overruns', str(self.overruns)),
            ('loop.missed', str(self.missed)),
            ('loop.busy_mean_ms', f'{self._busy_ns / self.ticks * 1e-6:.3f}'),
            ('loop.busy_max_ms', f'{self.max_busy_ns * 1e-6:.3f}'),
        )

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

"""How regularly a loop runs: period, jitter, overruns, time spent; no ROS here."""

import math


class LoopTiming:
    """
    Statistics of a periodic loop, cheap enough for every tick.

    Parameters
    ----------
    period_s : float
        Wanted period [s]. A tick that comes later than 1.5 periods after the one before
        counts as an overrun.

    """

    def __init__(self, period_s):
        self.period_ns = round(period_s * 1e9)
        self.ticks = 0
        self.overruns = 0
        self._last_ns = None
        self._intervals = 0
        self._span_ns = 0
        self.max_jitter_ns = 0
        self._busy_ns = 0
        self.max_busy_ns = 0

    def begin(self, now_ns):
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

    def since_last_s(self, now_ns):
        """Return the time since the last tick began [s], infinite before the first."""
        return math.inf if self._last_ns is None else (now_ns - self._last_ns) * 1e-9

    def end(self, now_ns):
        """Note the end of the tick begun last."""
        if self._last_ns is None:
            return                  # paused by the tick itself
        busy = now_ns - self._last_ns
        self._busy_ns += busy
        if busy > self.max_busy_ns:
            self.max_busy_ns = busy

    def pause(self):
        """Forget the last tick, so that a pause does not count as an overrun."""
        self._last_ns = None

    def values(self):
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
            ('loop.busy_mean_ms', f'{self._busy_ns / self.ticks * 1e-6:.3f}'),
            ('loop.busy_max_ms', f'{self.max_busy_ns * 1e-6:.3f}'),
        )

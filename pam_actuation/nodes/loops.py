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
Periodic work on the steady clock (or a simulated one), without an executor's cost per tick.

rclpy's executor rebuilds its list of everything a node owns for every wake-up, which takes longer
than a tick of a control loop. The loops of a node therefore run in the main thread on plain
sleeps. The executor serves services and parameters in a second thread, which sleeps until a
request arrives. A lock keeps the two apart.
"""

from collections.abc import Callable
import threading
import time
from typing import Protocol

NOT_SERVED = ('nothing runs the loop of this node, so it does nothing: an executor answers its '
              'services only, start it as a process of its own')
LONGEST_SLEEP_NS = 100_000_000     # how soon an idle node notices that it is to end


class LoopTime(Protocol):
    """A time that loops run on."""

    def now_ns(self) -> int:
        """Return the time [ns]."""

    def wait_until(self, wake_ns: int) -> None:
        """Wait for a time [ns], at most 0.1 s."""


class Loop:
    """
    One callback every ``period_ns``; ticks that were missed are not made up for.

    ``clock`` is what the period is counted on, by default ``SteadyTime``.
    """

    def __init__(self, period_ns: int, callback: Callable[[], object], now_ns: int,
                 clock: LoopTime | None = None) -> None:
        self.period_ns = period_ns
        self.callback = callback
        self.next_ns = now_ns + period_ns
        self._seen_ns = now_ns
        self.clock: LoopTime = clock or SteadyTime()

    def every(self, period_s: float) -> None:
        """Change the period, from the next tick on."""
        self.period_ns = round(period_s * 1e9)

    def due(self, now_ns: int) -> bool:
        """Return whether a tick is due; where the time begins anew, so does the period."""
        if now_ns < self._seen_ns:
            self.next_ns = now_ns + self.period_ns
        self._seen_ns = now_ns
        return self.next_ns <= now_ns

    def advance(self, now_ns: int) -> None:
        """Set the time of the next tick, in step with the former ones."""
        late_ns = now_ns - self.next_ns
        self.next_ns += self.period_ns * (1 + max(late_ns, 0) // self.period_ns)


class SteadyTime:
    """The time loops run on: here the steady clock of the computer."""

    def now_ns(self) -> int:
        """Return the time [ns]."""
        return time.monotonic_ns()

    def wait_until(self, wake_ns: int) -> None:
        """Wait for a time [ns], at most 0.1 s."""
        sleep_ns = min(wake_ns - time.monotonic_ns(), LONGEST_SLEEP_NS)
        if sleep_ns > 0:
            time.sleep(sleep_ns * 1e-9)


class LoopSet:
    """
    The loops of a node; ``lock`` is held while one of them runs.

    ``time`` is what they run on, ``SteadyTime`` or something like it. ``served`` tells whether
    somebody calls ``run_once``, again and again.
    """

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.time: LoopTime = SteadyTime()
        self._loops: list[Loop] = []
        self.served = False

    def __bool__(self) -> bool:
        """Tell whether there is any loop."""
        return bool(self._loops)

    def add(self, period_s: float, callback: Callable[[], object],
            clock: LoopTime | None = None) -> Loop:
        """
        Call ``callback`` every ``period_s`` from now on; ``clock`` if not on ``time``.

        Returns the ``Loop``.
        """
        clock = clock or self.time
        with self.lock:
            loop = Loop(round(period_s * 1e9), callback, clock.now_ns(), clock)
            self._loops.append(loop)
        return loop

    def clear(self) -> None:
        """End all loops."""
        with self.lock:
            self._loops = []

    def run_once(self) -> None:
        """Sleep until the next tick is due, at most 0.1 s, and run what is due."""
        self.served = True
        loops = self._loops
        if not loops:
            time.sleep(LONGEST_SLEEP_NS * 1e-9)
            return
        self.time.wait_until(min(
            (loop.next_ns for loop in loops if loop.clock is self.time),
            default=self.time.now_ns() + LONGEST_SLEEP_NS))
        with self.lock:
            for loop in self._loops:
                now_ns = loop.clock.now_ns()
                if loop.due(now_ns) and self._loops:      # one before may have ended all
                    loop.advance(now_ns)
                    loop.callback()

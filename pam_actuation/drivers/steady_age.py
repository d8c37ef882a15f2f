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
Commands that act at a steady age, whatever the phase between their sender and the driver.

A driver that ticks by its own clock finds a newest command of some age. Where the command arrives
just before the tick, it is as old as its transport. Where it arrives just after, the tick takes
the one before, which is older by a whole period of the sender. With both close together, jitter
decides, and the age of what acts changes at random. A pair of valves answers each change with
pulses, and learning cannot make up for it.

``SteadyAge`` therefore lets commands wait until the age that the latest of them need, and
interpolates between the two about it. It finds that age by itself: the highest of late, within
one and a half periods of the sender above the lowest. While all ages are the same, that is the
age of the newest command, which then acts unchanged. A later command acts as it comes. A command
to vent never waits.
"""

from collections import deque
from statistics import median_low

from pam_sim.units import P_ATM_PA

_KEPT = 32                  # commands
_INTERVALS = 9              # of which the middle one is the period of the sender
_PERIODS = 1.5              # the most a command waits: a period of the sender, and its jitter
_NEARER = 5_000             # part of a period by which both ends of the ages come closer a tick
_SMOOTH = 16                # ticks over which the jitter of the driver is averaged


class SteadyAge:
    """
    The newest commands, and what of them acts at a time.

    Parameters
    ----------
    longest_wait_ns : int
        The most that a command waits beyond the lowest age; 0: none waits.

    Attributes
    ----------
    age_ns : int or None
        Age of what acted last, None before.

    """

    def __init__(self, longest_wait_ns: int, period_ns: int) -> None:
        self._longest_wait_ns = longest_wait_ns
        self._period_ns = period_ns
        self.forget()

    def forget(self) -> None:
        """Begin anew with the next command, as after a vent."""
        # (stamp [ns], pressure)
        self._commands: deque[tuple[int, float]] = deque(maxlen=_KEPT)
        self._intervals_ns: deque[int] = deque(maxlen=_INTERVALS)
        self._lowest_ns = self._steady_ns = 0
        self._tick_ns: int | None = None
        self.age_ns: int | None = None

    def take(self, stamp_ns: int, pressure_pa: float) -> None:
        """Take a command [absolute Pa]; stamps in rising order."""
        if self._commands:
            self._intervals_ns.append(stamp_ns - self._commands[-1][0])
        self._commands.append((stamp_ns, pressure_pa))

    def at(self, now_ns: int, newest_pa: float) -> float:
        """
        Return the pressure [absolute Pa] that acts at a tick.

        Parameters
        ----------
        now_ns : int
            Time of the tick.
        newest_pa : float
            The newest command, which acts where nothing better is known.

        """
        if not self._commands:
            return newest_pa
        newest_ns = self._commands[-1][0]
        self.age_ns = age_ns = now_ns - newest_ns
        if self._longest_wait_ns == 0:
            return newest_pa
        tick_ns = self._tick(now_ns)
        self._learn(age_ns, tick_ns - newest_ns)
        due_ns = tick_ns - self._steady_ns
        if due_ns >= newest_ns or newest_pa <= P_ATM_PA:
            return newest_pa
        later_ns, later_pa = newest_ns, newest_pa
        for stamp_ns, pressure_pa in reversed(self._commands):
            if stamp_ns <= due_ns:
                self.age_ns = now_ns - due_ns
                share = (due_ns - stamp_ns) / (later_ns - stamp_ns) if later_ns > stamp_ns else 0.0
                return pressure_pa + share * (later_pa - pressure_pa)
            later_ns, later_pa = stamp_ns, pressure_pa
        self.age_ns = now_ns - later_ns
        return later_pa

    def _tick(self, now_ns: int) -> int:
        """Return the time of this tick without its jitter: the law counts in whole periods."""
        if self._tick_ns is None:
            self._tick_ns = now_ns
            return now_ns
        self._tick_ns += round((now_ns - self._tick_ns) / self._period_ns) * self._period_ns
        self._tick_ns += (now_ns - self._tick_ns) // _SMOOTH
        return self._tick_ns

    def _learn(self, age_ns: int, tick_age_ns: int) -> None:
        """Follow the lowest and the highest age, less what lies outside one and a half periods."""
        if not self._intervals_ns:
            self._lowest_ns, self._steady_ns = age_ns, tick_age_ns
            return
        wait_ns = min(round(_PERIODS * median_low(self._intervals_ns)), self._longest_wait_ns)
        nearer_ns = self._period_ns // _NEARER
        self._lowest_ns = min(age_ns, self._lowest_ns + nearer_ns)
        self._steady_ns = min(max(tick_age_ns, self._steady_ns - nearer_ns),
                              self._lowest_ns + wait_ns)

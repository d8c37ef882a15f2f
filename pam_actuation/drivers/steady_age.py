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
interpolates between the two about it. It finds that age by itself. A change of the age costs
tracking until it is learned. After the first 2 s the age therefore rises only when more than 3 %
of the commands within 2 s are older, and falls slowly, when none needed it for 10 s. While all
ages are the same, the newest command acts unchanged. A later command acts as it comes. A command
to vent never waits.
"""

from collections import deque
from statistics import median_low

from pam_sim.units import P_ATM_PA

_KEPT = 32                  # commands
_INTERVALS = 9              # of which the middle one is the period of the sender
_PERIODS = 1.5              # the most a command waits: a period of the sender, and its jitter
_AGES = 200                 # ticks of which the ages are known
_ONE_IN = 33                # so many may be older than the steady age, or younger than the lowest
_AT_START = 2               # so many in the first 2 s, where a change costs nothing
_HELD = 1_000               # ticks for which the steady age stays although none needs it
_FALL_NS = 2_000            # by which it falls a tick then
_ALMOST_NS = 500_000        # an age this little below still needs it
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
        self._ages_ns: deque[int] = deque(maxlen=_AGES)
        self._steady_ns = self._spare = 0       # spare: ticks since the steady age was needed
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
        self._learn(age_ns)
        due_ns = self._tick(now_ns) - self._steady_ns
        if age_ns >= self._steady_ns or due_ns >= newest_ns or newest_pa <= P_ATM_PA:
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

    def _learn(self, age_ns: int) -> None:
        """Follow the highest age, within one and a half periods of the sender."""
        settled = len(self._ages_ns) == _AGES
        self._ages_ns.append(age_ns)
        if not self._intervals_ns:
            self._steady_ns = age_ns
            return
        ages_ns = sorted(self._ages_ns)
        few = len(ages_ns) // _ONE_IN
        limit_ns = ages_ns[few] + min(
            round(_PERIODS * median_low(self._intervals_ns)), self._longest_wait_ns)
        highest_ns = min(ages_ns[-1 - (few if settled else min(few, _AT_START))], limit_ns)
        needed = age_ns >= self._steady_ns - _ALMOST_NS
        self._spare = 0 if needed else self._spare + 1
        if not settled or highest_ns > self._steady_ns:
            self._steady_ns = highest_ns
        elif self._spare > _HELD:
            self._steady_ns = max(highest_ns, self._steady_ns - _FALL_NS)

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
The slow rise after every vent: the pressure goes up at no more than a given rate.

The driver rises slowly after it vented, a controller after it asked for atmospheric pressure.

It begins at atmospheric pressure, whatever is measured: a muscle that is still emptying
would else be filled by a valve that catches up. It follows the command down at once and up
at the rate. It ends only when the muscle was under pressure and the command was met for some
time. A command with noise goes up and down in each tick, so one that is nearly met counts.
Commands of atmospheric pressure do not count, however many there are, so no order of commands
leads round it.

It waits for the muscle: it is ahead of the measured pressure by what the valve lags at that rate
and no more. Somebody else may vent, such as a watchdog or a dump valve; a valve that had meanwhile
been commanded to the full pressure would then fill at once. A first-order valve rises at no more
than the rate if the command is ahead by its time constant. Its rise within one dead time predicts
its pressure after another one. A valve that is slower than it is said to be rises more slowly. So
that an offset of a regulator does not stop it for good, the command goes ahead a little further as
long as it has to wait.
"""

from collections import deque
import math

from pam_sim.units import P_ATM_PA

RISE_PA_PER_S = 500_000.0
UNTIL_FOLLOWED_S = 1.0
UNDER_PRESSURE_PA = P_ATM_PA + 20_000.0
LONGEST_STEP_S = 0.02       # a late tick must not make up for the time it missed
WHILE_WAITING = 0.01        # share of the rate by which it goes further ahead of the muscle
NEARLY_PA = 10_000.0        # a command is met that far below: it may carry noise
WAITS_LONG_S = 1.0          # and from when it does so, and that is worth a word


class SlowRise:
    """
    Limits a pressure while it is ``active``.

    Attributes
    ----------
    active : bool
        Whether the rise is limited now.
    limiting : bool
        Whether the last command was above what was allowed, by more than ``nearly_pa``.
    waited_s : float
        How long, in all, it has waited for the measured pressure [s].

    Parameters
    ----------
    rate_pa_per_s : float
        Fastest rise [Pa/s].
    until_followed_s : float
        How long, in all, a command under pressure must have been met before it ends [s].
    active : bool
        Whether it begins limited; else only with ``begin``.
    lag_s : float
        Time constant of the pressure behind a command, with the age of a reading [s].
    dead_time_s : float
        Time before the pressure answers at all [s].
    nearly_pa : float
        A command that is limited by no more than this counts as met [Pa].

    """

    def __init__(self, rate_pa_per_s: float = RISE_PA_PER_S,
                 until_followed_s: float = UNTIL_FOLLOWED_S, active: bool = True,
                 lag_s: float = math.inf, dead_time_s: float = 0.0,
                 nearly_pa: float = NEARLY_PA) -> None:
        self._rate_pa_per_s = rate_pa_per_s
        self._until_followed_s = until_followed_s
        self._lag_s, self._dead_time_s = lag_s, dead_time_s
        self._nearly_pa = nearly_pa
        self.begin()
        self.active = active

    def begin(self) -> None:
        """Begin anew at atmospheric pressure: the muscle is vented."""
        self.active = True
        self.limiting = False
        self.waited_s = 0.0
        self._allowed_pa = P_ATM_PA
        self._followed_s = 0.0
        self._time_s = 0.0
        # (time [s], pressure) within the dead time
        self._measured: deque[tuple[float, float]] = deque()

    def hold(self) -> None:
        """Begin anew where something else than a pressure is commanded."""
        if self.active:
            self.begin()

    def limited(self, command_pa: float, elapsed_s: float, measured_pa: float = math.nan) -> float:
        """
        Return the pressure [absolute Pa] that a command may have now.

        Parameters
        ----------
        command_pa : float
            Wanted absolute pressure.
        elapsed_s : float
            Time since the last tick [s].
        measured_pa : float
            Newest measured absolute pressure; NaN where none is known.

        """
        if not self.active:
            return command_pa
        elapsed_s = min(elapsed_s, LONGEST_STEP_S)
        reach_pa = self._allowed_pa + self._rate_pa_per_s * elapsed_s
        nearest_pa = self._near_muscle(measured_pa, elapsed_s)
        if min(command_pa, reach_pa) > nearest_pa:
            self.waited_s += elapsed_s
            reach_pa = nearest_pa
        self.limiting = command_pa > reach_pa + self._nearly_pa
        self._allowed_pa = min(command_pa, reach_pa)
        if not self.limiting and command_pa > UNDER_PRESSURE_PA:
            self._followed_s += elapsed_s
            self.active = self._followed_s < self._until_followed_s
        return self._allowed_pa

    def _near_muscle(self, measured_pa: float, elapsed_s: float) -> float:
        """Return the highest pressure that the muscle follows at the rate, inf if not known."""
        if not math.isfinite(measured_pa):
            return math.inf
        self._time_s += elapsed_s
        self._measured.append((self._time_s, measured_pa))
        while self._time_s - self._measured[0][0] > self._dead_time_s:
            self._measured.popleft()
        risen_pa = min(max(measured_pa - self._measured[0][1], 0.0),
                       self._rate_pa_per_s * self._dead_time_s)
        ahead_s = self._lag_s + WHILE_WAITING * max(self.waited_s - WAITS_LONG_S, 0.0)
        return max(measured_pa, P_ATM_PA) + risen_pa + self._rate_pa_per_s * ahead_s

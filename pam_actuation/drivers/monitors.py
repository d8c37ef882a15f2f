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
Judges of single inputs: is a stamp usable, is a reading believable, who commands.

Used by the safety supervisor. No clock of their own: the time of every question is
passed in, so that live nodes, simulation and replay give the same answers.
"""

from collections import deque
import math

from pam_sim.units import gauge_kpa, NS_PER_S, P_ATM_PA

_NO_SEQUENCE = 2 ** 63     # middleware without sequence numbers gives 0 or all bits set
# A frozen reading near the pressure limit: full times and changes count with 1.5 times the change
# of room or more, and never less than these parts of them.
_SAFE_ROOM = 1.5
LEAST_CHANGE, SHORTEST = 0.1, 0.3
MOST_RELAPSES, RELAPSES_WITHIN_S = 5, 30.0
MOST_RESTARTS = 2           # of the model of the air, within the same time
_DAY_NS = 86_400 * NS_PER_S
WARNING_HOLD_S = 1.0        # a warning stays in the message after its last cause


def stamp_problem(stamp_ns: int, now_ns: int, oldest_s: float, ahead_s: float) -> str:
    """Return why a stamp cannot be used at ``now_ns``, or '' if it can."""
    age_ns = now_ns - stamp_ns
    if age_ns > oldest_s * NS_PER_S and stamp_ns == 0:
        return 'came without a time stamp (header.stamp is 0)'
    if abs(age_ns) > _DAY_NS:
        return (f'is stamped {abs(age_ns) / _DAY_NS:.0f} days '
                f'{"ago" if age_ns > 0 else "in the future"}, so by another clock than this one')
    if age_ns > oldest_s * NS_PER_S:
        return f'came {age_ns * 1e-6:.0f} ms old (limit {oldest_s * 1e3:.0f} ms)'
    if -age_ns > ahead_s * NS_PER_S:
        return f'is stamped {-age_ns * 1e-6:.0f} ms in the future (limit {ahead_s * 1e3:.0f} ms)'
    return ''


class ClockMonitor:
    """
    Tells a clock that was set from a driver that was stopped, by a clock that nobody sets.

    Without the time of that clock a clock set ahead counts as a stop.
    """

    def __init__(self, pause_s: float) -> None:
        """Call it a stop from ``pause_s`` [s] between two ticks."""
        self._pause_ns = pause_s * NS_PER_S
        self._steady_ns: int | None = None
        self._stood_ns: int | None = None       # between two ticks

    def steady(self, steady_ns: int) -> None:
        """Tell, before a tick, the time [ns] of a clock that nobody sets."""
        self._stood_ns = None if self._steady_ns is None else steady_ns - self._steady_ns
        self._steady_ns = steady_ns

    def fault(self, gap_ns: int, stopped: bool = False) -> tuple[str, str] | None:
        """
        Return what is wrong with the time [ns] between two ticks, None if nothing.

        ``stopped``: the driver is known to have been stopped, for however short a time.
        """
        if gap_ns < 0:
            return 'clock_back', (
                f'the clock was set back by {-gap_ns * 1e-6:.0f} ms, waiting for new messages')
        if gap_ns <= self._pause_ns and not stopped:
            return None
        if self._stood_ns is not None and self._stood_ns <= self._pause_ns and not stopped:
            return 'clock_ahead', (
                f'the clock was set ahead by {(gap_ns - self._stood_ns) * 1e-6:.0f} ms, waiting '
                'for new messages')
        return 'driver_paused', (
            f'the driver itself was stopped for {gap_ns * 1e-6:.0f} ms, waiting for new messages')


class Relapses:
    """Notices that something happens again and again."""

    def __init__(self, most: int, window_s: float) -> None:
        """Call ``most`` times within ``window_s`` [s] too often."""
        self.most, self.window_s = most, window_s
        self._at_ns: deque[int] = deque(maxlen=most)

    def forget(self) -> None:
        """Begin anew."""
        self._at_ns.clear()

    def too_often(self, now_ns: int) -> bool:
        """Note that it happened; return whether that is too often."""
        self._at_ns.append(now_ns)
        return len(self._at_ns) == self.most and (
            0 <= now_ns - self._at_ns[0] <= self.window_s * NS_PER_S)


class Channel:
    """
    The newest valid reading of one pressure topic and why later ones were refused.

    Attributes: ``stamp_ns`` and ``pressure_pa`` belong to the newest valid reading (None before
    the first), ``problem`` to the newest refused one ('' if none since). ``refused`` and
    ``received`` count readings. ``sender`` names who publishes the topic, as far as known, while
    no reading has arrived.
    """

    def __init__(self, oldest_s: float, ahead_s: float, lowest_pa: float,
                 highest_pa: float) -> None:
        """Accept readings of lowest_pa..highest_pa with stamps -ahead_s..oldest_s old."""
        self.oldest_s = oldest_s
        self.ahead_s = ahead_s
        self.lowest_pa = lowest_pa
        self.highest_pa = highest_pa
        self.received = 0
        self.refused = 0
        self.sender = ''
        self.forget()

    @property
    def why(self) -> str:
        """Return the end of a sentence on a missing reading: what is known of the reason."""
        if self.problem:
            return f'; the last one {self.problem}'
        return self.sender and f'; {self.sender} publishes it, and nothing arrives'

    def forget(self) -> None:
        """Drop the reading (clock change, pause); the counters go on."""
        self.stamp_ns: int | None = None
        self.pressure_pa = math.nan
        self.problem = ''
        self.implausible = False        # the value of the newest reading, whatever its stamp

    def offer(self, stamp_ns: int, pressure_pa: float, now_ns: int) -> bool:
        """Judge a reading; return True if it became the newest valid one."""
        self.received += 1
        self.sender = ''
        self.implausible = not self.lowest_pa <= pressure_pa <= self.highest_pa     # so NaN
        problem = stamp_problem(stamp_ns, now_ns, self.oldest_s, self.ahead_s)
        if not math.isfinite(pressure_pa):
            problem = f'is not a number ({pressure_pa})'
        elif pressure_pa < self.lowest_pa or pressure_pa > self.highest_pa:
            problem = (f'reads {gauge_kpa(pressure_pa):.0f} kPa gauge, believable are '
                       f'{gauge_kpa(self.lowest_pa):.0f} to {gauge_kpa(self.highest_pa):.0f}')
        if problem:
            self.problem = problem
            self.refused += 1
            return False
        if self.stamp_ns is not None and stamp_ns <= self.stamp_ns:
            return False
        self.stamp_ns = stamp_ns
        self.pressure_pa = pressure_pa
        self.problem = ''
        return True

    def age_s(self, now_ns: int) -> float:
        """Return the age of the newest valid reading [s], infinite before the first."""
        return math.inf if self.stamp_ns is None else (now_ns - self.stamp_ns) / NS_PER_S


class FrozenMonitor:
    """
    Notices a reading that stays bit-identical although air flowed.

    ``expected_pa`` accumulates the pressure change the valve flow should have made
    since the reading last changed.
    """

    def __init__(self, after_s: float, change_pa: float) -> None:
        """Call it frozen after ``after_s`` [s] and ``change_pa`` [Pa] without a change."""
        self.after_s = after_s
        self.change_pa = change_pa
        self.forget()

    def forget(self) -> None:
        """Start anew with the next reading."""
        self._value_pa: float | None = None
        self._since_ns = 0
        self.expected_pa = 0.0
        self.frozen = False

    def reading(self, stamp_ns: int, pressure_pa: float) -> None:
        """Take a valid reading."""
        if pressure_pa != self._value_pa:
            self._value_pa = pressure_pa
            self._since_ns = stamp_ns
            self.expected_pa = 0.0
            self.frozen = False

    def flow(self, change_pa: float) -> None:
        """
        Add the pressure change [Pa] expected from the flow of one tick.

        Emptying ends at the atmosphere: a sensor that reads a little above it at rest, and
        always the same, is not frozen.
        """
        self.expected_pa += change_pa
        if self._value_pa is not None:
            self.expected_pa = max(self.expected_pa, min(P_ATM_PA - self._value_pa, 0.0))

    def check(self, stamp_ns: int, room_pa: float = math.inf) -> bool:
        """
        Return True while the reading is frozen as of the newest stamp.

        Parameters
        ----------
        stamp_ns : int
            Of the newest reading.
        room_pa : float
            From the reading to the pressure limit [Pa]. Where filling blindly would soon be
            beyond it, less air and a shorter time are enough.

        """
        part = 1.0
        if self.expected_pa > 0.0:
            part = min(room_pa / (_SAFE_ROOM * self.change_pa), 1.0)
        if self._value_pa is not None and (
                abs(self.expected_pa) > max(part, LEAST_CHANGE) * self.change_pa):
            if stamp_ns - self._since_ns >= max(part, SHORTEST) * self.after_s * 1e9:
                self.frozen = True
        return self.frozen

    def unchanged_s(self, stamp_ns: int) -> float:
        """Return for how long [s] the reading has not changed."""
        return 0.0 if self._value_pa is None else (stamp_ns - self._since_ns) / NS_PER_S


class CommandOrder:
    """
    Notices commands of two publishers mixed on one topic.

    One publisher on a reliable topic gives rising stamps and rising publisher sequence
    numbers. A single step back is a restart or a late message; two within
    ``window_s`` are two publishers.
    """

    def __init__(self, window_s: float, clear_s: float) -> None:
        """Set the window [s] for two steps back and the quiet time [s] that ends it."""
        self.window_s = window_s
        self.clear_s = clear_s
        self.steps_back = 0
        self.forget()

    def forget(self) -> None:
        """Drop the history (clock change); the counter goes on."""
        self._stamp_ns: int | None = None
        self._pressure_pa = math.nan
        self._sequence: int | None = None
        self._recent_ns: deque[int] = deque(maxlen=2)
        self._mixed_ns: int | None = None

    def offer(self, stamp_ns: int, pressure_pa: float, sequence: int | None,
              now_ns: int) -> bool:
        """Note a command; return True if its stamp is newer than all before."""
        newer = self._stamp_ns is None or stamp_ns > self._stamp_ns
        same = stamp_ns == self._stamp_ns and pressure_pa == self._pressure_pa
        back = not newer and not same
        if sequence is not None and 0 < sequence < _NO_SEQUENCE:
            if self._sequence is not None and sequence <= self._sequence:
                back = True
            self._sequence = sequence
        if back:
            self.steps_back += 1
            self._recent_ns.append(now_ns)
            if len(self._recent_ns) == 2 and (
                    self._recent_ns[1] - self._recent_ns[0] <= self.window_s * NS_PER_S):
                self._mixed_ns = now_ns
        if newer:
            self._stamp_ns = stamp_ns
            self._pressure_pa = pressure_pa
        return newer

    def mixed(self, now_ns: int) -> bool:
        """Return True while two publishers are evident at ``now_ns``."""
        if self._mixed_ns is not None and now_ns - self._mixed_ns > self.clear_s * NS_PER_S:
            self._mixed_ns = None
        return self._mixed_ns is not None


class AirMonitor:
    """
    Notices that a regulator seems to get no air: the pressure falls although more is commanded.

    A pressure that rises is only late. Lowest of what was commanded within lag and dead time is
    what the muscle must have at least.

    Parameters
    ----------
    lag_s, dead_time_s : float
        Of the pressure behind a command [s]; an infinite lag counts as none.

    """

    MISSING_PA, EMPTY_GAUGE_PA = 50_000.0, 20_000.0
    FALLS_S, EMPTY_S = 0.03, 0.2
    _FALL_PA = 1_000.0

    def __init__(self, lag_s: float = math.inf, dead_time_s: float = 0.0) -> None:
        self._window_s = 2.0 * (lag_s if math.isfinite(lag_s) else 0.0) + dead_time_s + 0.05
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self._commands: deque[tuple[float, float]] = deque()       # time [s], pressure
        self._readings: deque[tuple[float, float]] = deque()
        self._time_s = 0.0
        self._falls_s = 0.0
        self._empty_s = 0.0

    def missing(self, command_pa: float, measured_pa: float, elapsed_s: float) -> bool:
        """
        Take one tick; return whether no air comes.

        Parameters
        ----------
        command_pa, measured_pa : float
            Pressure that is followed, and newest measured one [absolute Pa]; NaN: not known.
        elapsed_s : float
            Time since the former tick [s].

        """
        self._time_s += elapsed_s
        now_s = self._time_s
        # A command that a later one goes below is never the lowest again: the first one kept is.
        while self._commands and self._commands[-1][1] >= command_pa:
            self._commands.pop()
        for kept, value, longest_s in ((self._commands, command_pa, self._window_s),
                                       (self._readings, measured_pa, self.FALLS_S)):
            kept.append((now_s, value))
            while now_s - kept[0][0] > longest_s:
                kept.popleft()
        if not measured_pa < self._commands[0][1] - self.MISSING_PA:
            self._falls_s = self._empty_s = 0.0
            return False
        if measured_pa < self._readings[0][1] - self._FALL_PA:
            self._falls_s += elapsed_s
        if measured_pa < P_ATM_PA + self.EMPTY_GAUGE_PA:
            self._empty_s += elapsed_s
        return self._falls_s >= self.FALLS_S or self._empty_s >= self.EMPTY_S

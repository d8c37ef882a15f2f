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
Whether the driver follows the commands of a controller, as it tells on ``followed_pressure``.

While the driver vents or limits a command, the controller does not cause the error. An integral
that grew on it would ask for too much once the command is followed again. A controller that knows
holds its integral and its rules. No ROS inside.
"""

from collections import deque
import math
from typing import TYPE_CHECKING

from pam_actuation.control.inputs import MAX_AGE_NS
from pam_actuation.control.reference_buffer import MAX_AHEAD_NS
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.messages import Pressure

FOLLOWS, LESS, MORE, UNKNOWN = 0.0, 1.0, -1.0, 2.0      # what the driver does: ``held_back``
TOLERANCE_PA = 2_000.0
ON_THE_WAY_NS = 40_000_000  # a period of either, and what a busy machine takes
_STANDS_NS = 200_000_000
_INTRODUCED_NS = 5_000_000_000     # by then driver and controller have found each other
_GAP_PA = 100_000.0
_FILTER_S = 0.1             # of the pressure expected in the muscle
# A driver that begins anew from the atmosphere tells less than the first, and fell by the second.
_ANEW_PA, _FALL_PA = P_ATM_PA + 50_000.0, 20_000.0


class CommandFollowing:
    """
    Compares what the driver follows with the commands sent just before.

    One for each driver. A driver that never told is trusted, as long as the pressure that was
    measured before still is: a driver that supervises it vents without. In the first 5 s, while
    driver and controller may not have found each other, the measured pressure must come along.

    Attributes
    ----------
    fell_ns : int or None
        When the driver last fell to the atmosphere although pressure was commanded: it vented, or
        heard that another node did. From there it rises slowly. None: it never did.
    recovers : bool
        Whether it has not met the commands since then.

    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin anew, as before the first message."""
        self._followed: Pressure | None = None        # newest message
        self._sent: deque[tuple[int, float]] = deque()         # (time, command), the newest last
        self._first_ns: int | None = None        # when the first command was sent
        self._measured = False      # whether a pressure ever was
        self._reading_pa = math.nan
        self._since_ns = 0
        self._expected_pa = math.nan
        self.fell_ns: int | None = None
        self.recovers = False
        self._obeyed_ns: int | None = None      # when it did not vent against a command

    def on_followed(self, message: 'Pressure') -> None:
        """Take the ``Pressure`` that the driver follows; atmosphere while it vents."""
        if not math.isfinite(message.pressure_pa):
            return
        before, self._followed = self._followed, message
        if before is not None and self._sent:
            self._note_fall(before.pressure_pa, message.pressure_pa, message.stamp_ns)

    def _note_fall(self, before_pa: float, followed_pa: float, stamp_ns: int) -> None:
        """Take note of a driver that begins anew from the atmosphere, or that has recovered."""
        lowest_pa, _ = self._sent_before(stamp_ns)
        short_pa = min(lowest_pa, self._sent[-1][1]) - followed_pa
        if short_pa <= TOLERANCE_PA:
            self.recovers = False
        elif followed_pa < _ANEW_PA and min(short_pa, before_pa - followed_pa) > _FALL_PA:
            self.fell_ns, self.recovers = stamp_ns, True

    @property
    def told(self) -> bool:
        """Tell whether the driver ever told what it follows."""
        return self._followed is not None

    @property
    def followed_pa(self) -> float:
        """Return the pressure [absolute Pa] that the driver told last, NaN before."""
        return math.nan if self._followed is None else self._followed.pressure_pa

    def silent_ns(self, now_ns: int) -> int:
        """Return for how long [ns] a driver that once told has told nothing; 0 before."""
        return 0 if self._followed is None else now_ns - self._followed.stamp_ns

    @property
    def gives_air(self) -> bool:
        """Return whether the driver told last that it follows more than the atmosphere."""
        # A slow rise is above the atmosphere from its first tick on.
        return self.followed_pa > P_ATM_PA + 1.0

    def asks_for_none(self, now_ns: int) -> bool:
        """Return whether nothing above the atmosphere was commanded of late."""
        _, highest_pa = self._sent_before(now_ns)
        return -math.inf < highest_pa <= P_ATM_PA + TOLERANCE_PA

    def vents(self, now_ns: int) -> bool:
        """Return whether the driver tells that it vents although pressure is commanded."""
        if self._followed is None or self.gives_air or (
                self.silent_ns(now_ns) > MAX_AGE_NS):
            return False
        lowest_pa, _ = self._sent_before(self._followed.stamp_ns)
        return P_ATM_PA + TOLERANCE_PA < lowest_pa < math.inf

    def vented_ns(self, now_ns: int) -> int:
        """Return for how long [ns] it has vented against the commands, asked at each tick."""
        if self._obeyed_ns is None or not self.vents(now_ns):
            self._obeyed_ns = now_ns
        return now_ns - self._obeyed_ns

    def _sent_before(self, stamp_ns: int) -> tuple[float, float]:
        """
        Return the lowest and highest command [Pa] of which one was followed at a time.

        Where none was sent, infinite and minus infinite.
        """
        oldest_ns = stamp_ns - ON_THE_WAY_NS
        lowest_pa, highest_pa = math.inf, -math.inf
        for time_ns, command_pa in reversed(self._sent):
            if time_ns < oldest_ns:
                break
            if time_ns <= stamp_ns:
                if command_pa < lowest_pa:
                    lowest_pa = command_pa
                if command_pa > highest_pa:
                    highest_pa = command_pa
        return lowest_pa, highest_pa

    def sent(self, now_ns: int, command_pa: float) -> None:
        """Take note of a command [absolute Pa] sent now."""
        oldest_ns = now_ns - MAX_AGE_NS - ON_THE_WAY_NS
        while self._sent and self._sent[0][0] < oldest_ns:
            self._sent.popleft()
        if self._sent and self._sent[-1][0] >= now_ns:
            self._sent.clear()      # the clock was set back
        if self._first_ns is None:
            self._first_ns = now_ns
        dt_s = (now_ns - self._sent[-1][0]) * 1e-9 if self._sent else 0.0
        self._sent.append((now_ns, command_pa))
        arrives_pa = self.followed_pa if self.told else command_pa
        if not math.isfinite(self._expected_pa):
            self._expected_pa = arrives_pa
        self._expected_pa += dt_s / (_FILTER_S + dt_s) * (arrives_pa - self._expected_pa)

    def judge(self, now_ns: int, pressure_pa: float) -> float:
        """
        Return what the driver does with the commands.

        Parameters
        ----------
        now_ns : int
            Time of the tick.
        pressure_pa : float
            Measured absolute pressure, NaN where none is fresh.

        Returns
        -------
        float
            ``FOLLOWS``; ``LESS`` or ``MORE`` where it gives less or more than commanded;
            ``UNKNOWN`` where it fell silent, or the pressure it needs is lost.

        """
        known = math.isfinite(pressure_pa)
        self._measured = self._measured or known
        if self._followed is None:
            return self._untold(now_ns, pressure_pa)
        age_ns = now_ns - self._followed.stamp_ns
        if not -MAX_AHEAD_NS <= age_ns <= MAX_AGE_NS:
            return UNKNOWN
        lowest_pa, highest_pa = self._sent_before(self._followed.stamp_ns)
        if lowest_pa > highest_pa:      # none
            return FOLLOWS
        followed_pa = self._followed.pressure_pa
        if followed_pa < max(lowest_pa, P_ATM_PA) - TOLERANCE_PA:
            return LESS
        return MORE if followed_pa > max(highest_pa, P_ATM_PA) + TOLERANCE_PA else FOLLOWS

    def _untold(self, now_ns: int, pressure_pa: float) -> float:
        if not math.isfinite(pressure_pa):
            return UNKNOWN if self._measured else FOLLOWS
        if self._first_ns is None or now_ns - self._first_ns > _INTRODUCED_NS:
            return FOLLOWS
        gap_pa = self._expected_pa - pressure_pa
        if abs(gap_pa) <= _GAP_PA:
            return FOLLOWS
        return LESS if gap_pa > 0.0 else MORE

    def expected_pa(self, now_ns: int, pressure_pa: float) -> float:
        """
        Return the pressure to be expected in the muscle [absolute Pa], NaN while it is measured.

        A reading that has stood still to the last bit for 0.2 s is none. Without a word of the
        driver its own commands count, but only while there is a reading at all.

        Parameters
        ----------
        now_ns : int
            Time of the tick.
        pressure_pa : float
            Measured absolute pressure, NaN where none is fresh.

        """
        if not math.isfinite(pressure_pa):
            return self._expected_pa if self.told else math.nan
        if pressure_pa != self._reading_pa or now_ns < self._since_ns:
            self._reading_pa, self._since_ns = pressure_pa, now_ns
        stands = now_ns - self._since_ns >= _STANDS_NS
        return self._expected_pa if stands else math.nan

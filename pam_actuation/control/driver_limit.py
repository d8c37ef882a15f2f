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
The pressure limit of a driver, found from what it tells that it follows. No ROS inside.

A driver that cuts a command to its limit follows the same pressure to the last bit. One that
vents follows atmospheric pressure, and a slow rise or a weak supply changes all the time.
"""

import math

from pam_sim.units import P_ATM_PA

STANDS_NS = 300_000_000     # how long, in all, it must have been cut to the same pressure
BEYOND_PA = 1_000.0         # commands go this far above, so that the end of the limit is seen
_LONGEST_NS = 20_000_000    # of one tick, so that a pause does not count
_ABOVE_PA = 0.5 * BEYOND_PA


class DriverLimit:
    """
    Finds the limit of one driver, and its end.

    Attributes
    ----------
    limit_pa : float
        Highest pressure that the driver lets pass, absolute; NaN where none is known.

    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin anew, as before the first message."""
        self.limit_pa = self._cut_pa = math.nan
        self._cut_ns = 0
        self._last_ns: int | None = None

    def look(self, now_ns: int, followed_pa: float, cut: bool) -> None:
        """
        Take what the driver does at a tick.

        Parameters
        ----------
        now_ns : int
            Time of the tick.
        followed_pa : float
            Pressure that it follows [absolute Pa], NaN where it told none.
        cut : bool
            Whether that is less than commanded.

        """
        elapsed_ns = 0 if self._last_ns is None else now_ns - self._last_ns
        self._last_ns = now_ns
        if followed_pa > self.limit_pa + _ABOVE_PA:
            self.limit_pa = math.nan
        if not cut or followed_pa <= P_ATM_PA + 1.0:
            return
        if followed_pa != self._cut_pa:
            self._cut_pa, self._cut_ns = followed_pa, 0
            return
        self._cut_ns += min(max(elapsed_ns, 0), _LONGEST_NS)
        if self._cut_ns >= STANDS_NS:
            self.limit_pa = followed_pa

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
Notices a muscle that keeps its pressure although the driver empties it.

With a valve that is stuck or a vent that is blocked, the driver can only tell.
"""

import math

from pam_sim.units import gauge_kpa, NS_PER_S, P_ATM_PA

AFTER_S = 1.0
ABOVE_PA = 50_000.0         # what is asked for
LEAST_GAUGE_PA = 80_000.0   # below, a slow vent or an error of the sensor may be all
LEAST_FALL_PA = 10_000.0    # within ``AFTER_S``
OPEN_DUTY = 0.9             # from which on a vent valve counts as open


class NotEmptiedMonitor:
    """Judges, tick by tick, whether the measured pressure falls where it should."""

    def __init__(self) -> None:
        """Begin without a reading."""
        self._since_s = self._from_pa = math.nan
        self.problem = ''

    def judge(self, now_ns: int, asked_pa: float, measured_pa: float) -> None:
        """
        Take what has been asked for since the last tick; ``problem`` then tells what is wrong.

        Parameters
        ----------
        now_ns : int
            Time of the tick.
        asked_pa : float
            Absolute pressure down to which the valve empties the muscle; NaN where it does not.
        measured_pa : float
            Newest valid reading, absolute; NaN where there is none.

        """
        now_s = now_ns / NS_PER_S
        if not (measured_pa - asked_pa > ABOVE_PA
                and measured_pa - P_ATM_PA > LEAST_GAUGE_PA):
            self._since_s, self.problem = math.nan, ''
            return
        if not 0.0 <= now_s - self._since_s or measured_pa < self._from_pa - LEAST_FALL_PA:
            self._since_s, self._from_pa, self.problem = now_s, measured_pa, ''
        elif now_s - self._since_s >= AFTER_S and not self.problem:
            self.problem = (
                f'the measured pressure stays at {gauge_kpa(measured_pa):.0f} kPa gauge although '
                'the valve empties the muscle: valve stuck or vent blocked; shut the supply and '
                'open the dump valve')

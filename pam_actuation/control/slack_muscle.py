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
Notices that one muscle of a joint is not under air although the controller wants it to be.

Its driver may have vented it (emergency stop, lost sensor, device refusing) or its supply is
gone. The other muscle alone would then pull the limb to its stop.
"""

import math

from pam_actuation.control.frozen import RESUME_NS
from pam_sim.units import P_ATM_PA

WANTED_PA = P_ATM_PA + 100_000.0    # commanded at least
SLACK_PA = P_ATM_PA + 30_000.0      # measured at most
AFTER_NS = 1_000_000_000            # a slow valve fills a large muscle beyond that in this time
LOST_NS = 300_000_000               # its driver vents after 0.1 s


class SlackMuscle:
    """
    Compares the command of one muscle with its measured pressure.

    ``slack`` stays for 2 s at least: both muscles are vented meanwhile, and filling is then tried
    again.
    """

    def __init__(self):
        self.forget()

    def forget(self):
        """Begin anew, as before the first reading."""
        self.slack = False
        self._measured_ns = None    # newest fresh reading
        self._followed_ns = None    # when it was last under air, or not wanted to be
        self._noticed_ns = 0

    def judge(self, now_ns, command_pa, pressure_pa):
        """
        Take the newest reading; return whether the muscle is slack.

        Parameters
        ----------
        now_ns : int
            Time of the tick.
        command_pa : float
            Absolute pressure commanded last.
        pressure_pa : float
            Measured absolute pressure, NaN where none is fresh. A muscle whose pressure was
            never measured is not judged; one whose reading is lost counts as slack.

        """
        if math.isfinite(pressure_pa):
            self._measured_ns = now_ns
        if self._measured_ns is None:
            return False
        if self._followed_ns is None or command_pa < WANTED_PA or pressure_pa > SLACK_PA:
            self._followed_ns = now_ns
        lost = now_ns - self._measured_ns >= LOST_NS
        if lost or now_ns - self._followed_ns >= AFTER_NS:
            self.slack = True
            self._noticed_ns = now_ns
        elif now_ns - self._noticed_ns >= RESUME_NS:
            self.slack = False
        return self.slack

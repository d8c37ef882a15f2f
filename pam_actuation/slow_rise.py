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
time. Commands of atmospheric pressure do not count, however many there are, so no order of
commands leads round it.
"""

from pam_sim.units import P_ATM_PA

RISE_PA_PER_S = 500_000.0
UNTIL_FOLLOWED_S = 1.0
UNDER_PRESSURE_PA = P_ATM_PA + 20_000.0
LONGEST_STEP_S = 0.02       # a late tick must not make up for the time it missed


class SlowRise:
    """
    Limits a pressure while it is ``active``.

    Attributes
    ----------
    active : bool
        Whether the rise is limited now.
    limiting : bool
        Whether the command of the last tick was above what was allowed.

    Parameters
    ----------
    rate_pa_per_s : float
        Fastest rise [Pa/s].
    until_followed_s : float
        How long, in all, a command under pressure must have been met before it ends [s].
    active : bool
        Whether it begins limited; else only with ``begin``.

    """

    def __init__(self, rate_pa_per_s=RISE_PA_PER_S, until_followed_s=UNTIL_FOLLOWED_S,
                 active=True):
        self._rate_pa_per_s = rate_pa_per_s
        self._until_followed_s = until_followed_s
        self.begin()
        self.active = active

    def begin(self):
        """Begin anew at atmospheric pressure: the muscle is vented."""
        self.active = True
        self.limiting = False
        self._allowed_pa = P_ATM_PA
        self._followed_s = 0.0

    def hold(self):
        """Begin anew where something else than a pressure is commanded."""
        if self.active:
            self.begin()

    def limited(self, command_pa, elapsed_s):
        """
        Return the pressure [absolute Pa] that a command may have now.

        Parameters
        ----------
        command_pa : float
            Wanted absolute pressure.
        elapsed_s : float
            Time since the last tick [s].

        """
        if not self.active:
            return command_pa
        elapsed_s = min(elapsed_s, LONGEST_STEP_S)
        reach_pa = self._allowed_pa + self._rate_pa_per_s * elapsed_s
        self.limiting = command_pa > reach_pa
        self._allowed_pa = min(command_pa, reach_pa)
        if not self.limiting and command_pa > UNDER_PRESSURE_PA:
            self._followed_s += elapsed_s
            self.active = self._followed_s < self._until_followed_s
        return self._allowed_pa

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

Its driver may have vented it (emergency stop, lost sensor, device refusing) or has fallen silent,
or its supply is gone. The other muscle alone would then pull the limb to its stop. So it would
while a driver that vented for a moment lets its muscle rise slowly from the atmosphere, unless
both drivers vented together.
"""

from collections.abc import Collection
import math

from pam_actuation.control.following import CommandFollowing
from pam_actuation.control.frozen import RESUME_NS
from pam_sim.units import P_ATM_PA

WANTED_PA = P_ATM_PA + 100_000.0    # commanded at least
SLACK_PA = P_ATM_PA + 30_000.0      # measured at most
AFTER_NS = 1_000_000_000            # a slow valve fills a large muscle beyond that in this time
LOST_NS = 300_000_000               # its driver vents after 0.1 s
VENTS_NS = 100_000_000              # beyond what a command needs to its driver
TOGETHER_NS = 100_000_000           # two drivers that begin anew within this time rise together
PROOF_PA = P_ATM_PA + 50_000.0      # turns a limb by a few degrees


class SlackMuscle:
    """
    Compares the command of one muscle with what its driver tells and with its pressure.

    ``slack`` stays for 2 s at least, with both muscles vented. Then only the slack muscle is
    commanded a little pressure, until its driver follows and the pressure is reached. A latched
    stop may last; the other muscle stays vented meanwhile.

    Parameters
    ----------
    following : CommandFollowing
        Of the muscle's driver.

    Attributes
    ----------
    slack : bool
        As of the last ``judge``.
    why : str
        What is wrong with the muscle while it is slack, else ''.

    """

    def __init__(self, following: CommandFollowing) -> None:
        self._following = following
        self.forget()

    def forget(self) -> None:
        """Begin anew, as before the first reading."""
        self.slack, self.why = False, ''
        self._measured_ns: int | None = None     # newest fresh reading
        self._judged_ns: int | None = None
        self._empty_ns = 0          # how long it was wanted under air and was not
        self._awaited_ns: int | None = None      # since when its driver's first word is due
        self._noticed_ns = 0

    def judge(self, now_ns: int, command_pa: float, pressure_pa: float,
              others: Collection[CommandFollowing] = ()) -> bool:
        """
        Take the newest reading; return whether the muscle is slack.

        Parameters
        ----------
        now_ns : int
            Time of the tick.
        command_pa : float
            Absolute pressure commanded last.
        pressure_pa : float
            Measured absolute pressure, NaN where none is fresh. Of a muscle whose pressure was
            never measured the word of its driver counts alone; one whose reading is lost
            counts as slack.
        others : collection of CommandFollowing
            Of the drivers of the other muscles. Where one of them ever told what it follows, this
            one is expected to tell as well.

        """
        if math.isfinite(pressure_pa):
            self._measured_ns = now_ns
        # The clock may have been set back.
        self._noticed_ns = min(self._noticed_ns, now_ns)
        if self._measured_ns is not None:
            self._measured_ns = min(self._measured_ns, now_ns)
        self._count(now_ns, command_pa, pressure_pa)
        vented_ns = self._following.vented_ns(now_ns)
        lost = self._measured_ns is not None and now_ns - self._measured_ns >= LOST_NS
        silent = self._silent_ns(now_ns, any(other.told for other in others)) >= LOST_NS
        why = ''
        if lost:
            why = f'its pressure has not been measured for {LOST_NS * 1e-9:g} s'
        elif silent:
            why = f'its driver has been silent for {LOST_NS * 1e-9:g} s'
        elif not self.slack:
            why = self._found(now_ns, vented_ns, others)
        if why:
            self.slack, self.why, self._noticed_ns = True, why, now_ns
        elif self.slack and now_ns - self._noticed_ns >= RESUME_NS and self._proven(pressure_pa):
            self.slack, self.why = False, ''
        return self.slack

    def _found(self, now_ns: int, vented_ns: int, others: Collection[CommandFollowing]) -> str:
        """Return what is wrong with a muscle that was sound until now, '' for nothing."""
        if vented_ns >= VENTS_NS:
            return 'its driver vents although pressure is commanded'
        if self._rises_alone(now_ns, others):
            return 'its driver vented and begins anew from the atmosphere'
        if self._empty_ns >= AFTER_NS:
            return f'it gets no air although {(WANTED_PA - P_ATM_PA) * 1e-3:g} kPa are commanded'
        return ''

    def _rises_alone(self, now_ns: int, others: Collection[CommandFollowing]) -> bool:
        """Return whether its driver began anew from the atmosphere, and another did not."""
        fell_ns = self._following.fell_ns
        if fell_ns is None or not self._following.recovers or now_ns - fell_ns < VENTS_NS:
            return False
        return any(other.fell_ns is None or abs(other.fell_ns - fell_ns) >= TOGETHER_NS
                   for other in others)

    def _silent_ns(self, now_ns: int, others_told: bool) -> int:
        """Return for how long [ns] its driver has told nothing, although it does or should."""
        if self._following.told or not others_told:
            self._awaited_ns = None
            return self._following.silent_ns(now_ns)
        if self._awaited_ns is None or now_ns < self._awaited_ns:
            self._awaited_ns = now_ns
        return now_ns - self._awaited_ns

    def _count(self, now_ns: int, command_pa: float, pressure_pa: float) -> None:
        """Add up how long the muscle was empty; commands that come and go count in part."""
        passed_ns = 0 if self._judged_ns is None else max(now_ns - self._judged_ns, 0)
        self._judged_ns = now_ns
        if not pressure_pa <= SLACK_PA or passed_ns > LOST_NS:
            self._empty_ns = 0
        elif command_pa >= WANTED_PA:
            self._empty_ns += passed_ns
        else:
            self._empty_ns = max(self._empty_ns - passed_ns, 0)

    def _proven(self, pressure_pa: float) -> bool:
        """Return whether the muscle gets the air it is asked for."""
        if self._measured_ns is not None and not pressure_pa > SLACK_PA:
            return False
        return not self._following.told or self._following.followed_pa > SLACK_PA

    @property
    def waits(self) -> bool:
        """Return whether it is slack and its driver gives no air yet."""
        return self.slack and not self._following.gives_air

    def proves(self, now_ns: int) -> bool:
        """Return whether ``PROOF_PA`` is to be asked of it while both muscles are vented."""
        return self.slack and now_ns - self._noticed_ns >= RESUME_NS

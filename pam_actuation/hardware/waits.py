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

"""How long a back end made its node wait: nothing else is done meanwhile."""

import math
import time

LONGEST_S = 0.1         # from then on the driver vents
SHOWN_S = 60.0
MEAN_OF = 50            # calls
WELL_SHARE = 0.8        # of the period, below which a back end keeps up again


class Waits:
    """
    Notes what a back end took long for, by a clock that nobody sets.

    Attributes
    ----------
    count : int
        How often it took 0.1 s or more.

    """

    def __init__(self) -> None:
        self.count = 0
        self._longest_s, self._ended_s, self._says = 0.0, -math.inf, ''
        self._calls, self._mean_s = 0, 0.0
        self._behind_s, self._behind = 0.0, ''

    def note(self, begun_s: float, what: str) -> None:
        """
        Tell, after a call of the back end, what it was for.

        Parameters
        ----------
        begun_s : float
            ``time.monotonic()`` before the call.
        what : str
            Completes the sentence "the back end took 2.0 s to ...".

        """
        now_s = time.monotonic()
        took_s = now_s - begun_s
        self._calls = min(self._calls + 1, MEAN_OF)
        self._mean_s += (took_s - self._mean_s) / self._calls
        if took_s < LONGEST_S:
            return
        self.count += 1
        if took_s > self._longest_s or not self.says:
            self._longest_s = took_s
            self._says = f'the back end took {took_s:.1f} s to {what}'
        self._ended_s = now_s

    @property
    def says(self) -> str:
        """Return a sentence on the longest wait that is shown, for a minute after the last one."""
        return self._says if time.monotonic() - self._ended_s <= SHOWN_S else ''

    def behind(self, period_s: float, calls: int, what: str) -> str:
        """
        Return a sentence on a back end that takes longer than the period, '' if it keeps up.

        The number in it stays until it grows by half, so that nobody is told of every change.

        Parameters
        ----------
        period_s : float
            In which it is called [s].
        calls : int
            How often it is called in a period.
        what : str
            Completes the sentence "the back end takes 30 ms to ...".

        """
        usual_s = calls * self._mean_s
        if self._calls < MEAN_OF or usual_s < WELL_SHARE * period_s:
            self._behind = ''
        elif usual_s > (1.5 * self._behind_s if self._behind else period_s):
            self._behind_s = usual_s
            self._behind = (f'the back end takes {1e3 * usual_s:.3g} ms to {what}, longer than '
                            f'the period of {1e3 * period_s:.3g} ms')
        return self._behind

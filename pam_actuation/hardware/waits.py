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

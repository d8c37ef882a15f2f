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
Notices a sensor that is wrong again and again, such as one with the wrong sign.

Such a sensor drives the muscle to where its readings are impossible. Vented, it reads what is
possible, and the muscle would be filled and dropped every few seconds.
"""

from pam_actuation.drivers.monitors import MOST_RELAPSES, Relapses, RELAPSES_WITHIN_S

HELD_NS = 30_000_000_000
SAYS = (f'{MOST_RELAPSES} times within {RELAPSES_WITHIN_S:g} s: sign, range or wiring of the '
        f'sensor? Vented for {HELD_NS * 1e-9:g} s')


class Implausible:
    """
    Keeps a measurement implausible for a while that was so too often.

    Attributes
    ----------
    holds : bool
        Whether it is kept so now.

    """

    def __init__(self) -> None:
        self._relapses = Relapses(MOST_RELAPSES, RELAPSES_WITHIN_S)
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self.holds, self._is = False, False
        self._held_ns: int | None = None    # since when it was kept so the last time
        self._relapses.forget()

    def judge(self, now_ns: int, implausible: bool) -> bool:
        """Take whether the newest reading is implausible; return whether it counts as that."""
        began, self._is = implausible and not self._is, implausible
        self.holds = self._held_within(now_ns, HELD_NS)
        if began and not self.holds and (
                self._relapses.too_often(now_ns) or self._held_within(now_ns, 2 * HELD_NS)):
            self.holds, self._held_ns = True, now_ns
        return implausible or self.holds

    def _held_within(self, now_ns: int, time_ns: int) -> bool:
        """Return whether it began to be kept so within this time; not by a clock that was set."""
        return self._held_ns is not None and 0 <= now_ns - self._held_ns <= time_ns

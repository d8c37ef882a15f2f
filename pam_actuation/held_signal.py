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

"""The valve signal that a simulated valve holds, and why nothing of one can be used."""

from collections.abc import Hashable
import math

from pam_actuation.messages import SAFE_EFFORTS, VALVE_NAMES, ValveSignal

SAFE_COUNTS_NS = 100_000_000     # a safe signal against the openings of others
UNUSABLE_NS = 500_000_000        # without a usable entry, until it is told
_MOST_TOLD = 4                   # names in a sentence


class HeldSignal:
    """
    The valve signal that acts: the last effort of each name, held without limit.

    Where several send, as a driver and somebody who should not, one of them saying *vent* is
    enough: its safe signal acts for 0.1 s, whatever the others say. Of two openings the later
    one acts, as on a valve.

    Parameters
    ----------
    valve : {'ppr', 'hsv'}

    Attributes
    ----------
    taken, unusable : int
        Messages, and those of which nothing could be used.
    ignored : int
        Entries that were unknown or not finite.

    """

    def __init__(self, valve: str) -> None:
        self._valve, self._names = valve.upper(), VALVE_NAMES[valve]
        self._safe = SAFE_EFFORTS[valve]
        self._last = self.efforts = (0.0,) * len(self._names)
        # writer to the time until which its safe signal counts
        self._safe_until_ns: dict[Hashable, int] = {}
        self.taken = 0
        self.ignored = 0
        self.unusable = 0
        self._got: ValveSignal | None = None        # the last one, if nothing of it could be used
        self._since_ns = 0                          # the first such one in a row

    def take(self, message: ValveSignal, writer: Hashable = None, now_ns: int = 0) -> None:
        """
        Take efforts by name; anything not finite or unknown is ignored and counted.

        ``writer`` is who sent it, None where that is not known; ``now_ns`` the time of the plant.
        """
        self.taken += 1
        usable, efforts = False, list(self._last)
        for name, effort in zip(message.names, message.efforts):
            if name in self._names and math.isfinite(effort):
                efforts[self._names.index(name)] = float(effort)
                usable = True
            else:
                self.ignored += 1
        self._last = self.efforts = tuple(efforts)
        if not usable:
            self.unusable += 1
            if self._got is None:
                self._since_ns = now_ns
        self._got = None if usable else message
        if writer is not None and self._another_vents(writer, now_ns):
            self.efforts = self._safe

    def _another_vents(self, writer: Hashable, now_ns: int) -> bool:
        if self._last == self._safe:
            self._safe_until_ns[writer] = now_ns + SAFE_COUNTS_NS
        else:
            self._safe_until_ns.pop(writer, None)
        self._safe_until_ns = {one: until_ns for one, until_ns in self._safe_until_ns.items()
                               if now_ns <= until_ns <= now_ns + SAFE_COUNTS_NS}
        return bool(self._safe_until_ns.keys() - {writer})

    def problem(self, topic: str, now_ns: int) -> str:
        """
        Return what is wrong where nothing of the signal could be used for a while, else ''.

        ``topic`` is how the sentence names it. The next message that can be used ends it.
        """
        if self._got is None or now_ns - self._since_ns < UNUSABLE_NS:
            return ''
        return (f'nothing of {topic} can be used: it has {_told(self._got, self._names)}; '
                f'this {self._valve} valve needs {", ".join(self._names)}')


def _told(message: ValveSignal, known: tuple[str, ...]) -> str:
    efforts = dict(zip(message.names, message.efforts))
    words = [f'{name} {efforts.get(name, math.nan)}' if name in known else name
             for name in message.names]
    if len(words) > _MOST_TOLD:
        words[_MOST_TOLD:] = [f'{len(words) - _MOST_TOLD} more']
    return ', '.join(words) or 'no names'

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

"""The disturbance of a simulated rig: what acts, and what is to act at a stamp that lies ahead."""

from bisect import insort
from collections.abc import Iterator
import math
from operator import itemgetter

from pam_sim.units import NS_PER_S

MOST_AHEAD_S = 10.0         # of a stamp
MOST_WAITING = 1000         # as many as a subscription keeps
WARNING_HOLD_S = 1.0        # a refusal is told for so long
_STAMP = itemgetter(0)


class Disturbance:
    """
    The value that acts, held until the next, and those whose stamps lie ahead.

    A value acts from its stamp on, or at once if that has passed. Of equal stamps the value that
    arrived last acts.

    Parameters
    ----------
    topic : str
        As it is named where a value is refused.
    dt_ns : int
        Step of the physics [ns]; a value acts from the step on that its stamp is within.

    Attributes
    ----------
    acts : float
        The value that acts: force on a load [N], torque on a limb [N m].
    refused : int
        Values whose stamps lie too far ahead, or that are too many.
    refusal : str
        Why the last one of these was refused, '' if none was.

    """

    def __init__(self, topic: str, dt_ns: int) -> None:
        self._topic, self._dt_ns = topic, dt_ns
        self._ahead: list[tuple[int, float]] = []       # stamp [ns] and value, in order
        self.acts = 0.0
        self.refused = 0
        self.refusal = ''
        self._refused_ns = 0

    @property
    def waiting(self) -> int:
        """Return how many values are to act later."""
        return len(self._ahead)

    def take(self, stamp_ns: int, value: float, now_ns: int | None) -> None:
        """Take a value at a time of the plant, None before its start; not finite is ignored."""
        if not math.isfinite(value):
            return
        ahead_ns = 0 if now_ns is None else stamp_ns - now_ns
        if now_ns is None or ahead_ns < self._dt_ns:
            self.acts = float(value)
        elif ahead_ns > MOST_AHEAD_S * NS_PER_S:
            self._refuse(f'it is stamped {ahead_ns / NS_PER_S:.3f} s ahead '
                         f'(limit {MOST_AHEAD_S:g} s)', now_ns)
        elif len(self._ahead) >= MOST_WAITING:
            self._refuse(f'{MOST_WAITING} that lie ahead are kept already', now_ns)
        else:
            insort(self._ahead, (stamp_ns, float(value)), key=_STAMP)

    def _refuse(self, why: str, now_ns: int) -> None:
        self.refused += 1
        self.refusal, self._refused_ns = why, now_ns

    def parts(self, count: int, now_ns: int | None) -> Iterator[int]:
        """Divide steps from a time on at what begins to act within; ``acts`` is of each part."""
        done = 0
        while self._ahead and now_ns is not None:
            begin = (self._ahead[0][0] - now_ns) // self._dt_ns
            if begin >= count:
                break
            if begin > done:
                yield begin - done
                done = begin
            self.acts = self._ahead.pop(0)[1]
        yield count - done

    def problem(self, now_ns: int) -> str:
        """Return why a value was refused within the last second, '' if none was."""
        if self.refused and 0 <= now_ns - self._refused_ns <= WARNING_HOLD_S * NS_PER_S:
            return f'an {self._topic} was ignored: {self.refusal}'
        return ''

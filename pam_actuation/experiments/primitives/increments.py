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

"""Move in equal increments, each followed by a hold."""

from dataclasses import dataclass

from pam_actuation.experiments.primitives.base import key, least_jerk, Primitive


@dataclass
class Increments(Primitive):
    """Equal smooth moves to a value, each of ``move_s`` and followed by a hold of ``hold_s``."""

    QUANTITIES = ('to',)
    start: float
    to: float = key('value at the end')
    steps: int = key('number of moves')
    move_s: float = key('time of each move')
    hold_s: float = key('time of each hold')

    @property
    def duration_s(self) -> float:
        """Length of all moves and holds together."""
        return int(self.steps) * (self.move_s + self.hold_s)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return value and rate: the path of least jerk in a move, rate 0 in a hold."""
        each = self.move_s + self.hold_s
        size = (self.to - self.start) / int(self.steps)
        done = min(int(t_s / each), int(self.steps) - 1)
        value, rate = least_jerk(0.0, size, self.move_s, t_s - done * each)
        return self.start + done * size + value, rate


PRIMITIVE = Increments

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

"""Push for a moment, again and again."""

from dataclasses import dataclass

from pam_actuation.experiments.primitives.base import key, Primitive

_ROUNDING_S = 1e-9       # a time of an edge may be rounded below it, and counts as the edge


@dataclass
class Pulses(Primitive):
    """Rectangular pulses of ``height`` above the value before, one every ``every_s``."""

    JUMPS = True
    QUANTITIES = ('height',)
    start: float
    height: float = key('height above the value before')
    width_s: float = key('length of a pulse')
    every_s: float = key('from one pulse to the next')
    count: int = key('number of pulses')

    def problem(self) -> str:
        """Refuse pulses that would run into each other."""
        return '' if self.width_s < self.every_s else 'width_s must be below every_s'

    @property
    def duration_s(self) -> float:
        """Length of all pulses and the pauses after them."""
        return self.every_s * int(self.count)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return the value and rate 0; a pulse begins each interval."""
        t_s += _ROUNDING_S
        inside = t_s < self.duration_s and t_s % self.every_s < self.width_s
        return self.start + (self.height if inside else 0.0), 0.0


PRIMITIVE = Pulses

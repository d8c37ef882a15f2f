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

"""Repeat a sine."""

from dataclasses import dataclass

from pam_actuation.experiments.primitives.base import key, Primitive, raised_cosine


@dataclass
class Sine(Primitive):
    """Sine about a centre, starting at its lowest point with rate 0."""

    QUANTITIES = ('center', 'amplitude')
    start: float
    center: float = key('centre of the motion')
    amplitude: float = key('half of the way from end to end')
    frequency_hz: float = key('repetitions per second')
    cycles: float = key('how often it is repeated')

    @property
    def duration_s(self) -> float:
        """Length of all cycles together."""
        return self.cycles / self.frequency_hz

    @property
    def periods(self) -> tuple[float, int]:
        """Return (period in s, whole cycles)."""
        return 1.0 / self.frequency_hz, int(self.cycles)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return centre - amplitude cos(2 pi f t) and its rate."""
        return raised_cosine(self.center, self.amplitude, self.frequency_hz, t_s)


PRIMITIVE = Sine

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

"""Sweep the frequency."""

from dataclasses import dataclass
import math

from pam_actuation.experiments.primitives.base import key, Primitive


@dataclass
class Chirp(Primitive):
    """Sine about a centre whose frequency grows linearly with time."""

    QUANTITIES = ('center', 'amplitude')
    start: float
    center: float = key('centre of the motion')
    amplitude: float = key('half of the way from end to end')
    from_hz: float = key('frequency at the start')
    to_hz: float = key('frequency at the end')
    duration_s: float = key('how long it lasts')

    def at(self, t_s: float) -> tuple[float, float]:
        """Return value and rate of the chirp, starting at the lowest point."""
        slope = (self.to_hz - self.from_hz) / self.duration_s
        phase = 2.0 * math.pi * (self.from_hz * t_s + 0.5 * slope * t_s * t_s)
        w = 2.0 * math.pi * (self.from_hz + slope * t_s)
        return (self.center - self.amplitude * math.cos(phase),
                self.amplitude * w * math.sin(phase))


PRIMITIVE = Chirp

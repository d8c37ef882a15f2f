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

"""Move smoothly."""

from dataclasses import dataclass

from pam_actuation.experiments.primitives.base import key, least_jerk, Primitive


@dataclass
class Ramp(Primitive):
    """Move smoothly to a value: the path of least jerk, at rest at both ends."""

    QUANTITIES = ('to',)
    start: float
    to: float = key('value at the end')
    duration_s: float = key('how long it lasts')

    def at(self, t_s: float) -> tuple[float, float]:
        """Return value and rate on the minimum-jerk path."""
        return least_jerk(self.start, self.to, self.duration_s, t_s)


PRIMITIVE = Ramp

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
Notices a measured motion that stands still although the pressure moved the muscle.

A frozen sensor goes on sending its last value with new stamps. It is told from a muscle at
rest by the pressure: a value that stays the same to the last bit while the measured pressure
changes by far more than friction can hold is not what the muscle does. At its resting length,
or without a force, a muscle may lie on a stop, and pressure moves nothing until it lifts its
load; a sensor that is frozen there is not noticed.
"""

import math

AFTER_NS = 200_000_000
SWING_PA = 150_000.0         # twice the dry friction of a bad rig holds it over 110 kPa
RESUME_NS = 2_000_000_000


class FrozenMeasurement:
    """
    Compares the newest value of what is tracked with the range of the pressure.

    ``frozen`` stays until the value has changed and is still changing 2 s later: a muscle that
    is blocked looks the same, and must not be filled against the obstacle again at once.

    Parameters
    ----------
    resting : float
        Contraction [m] or force [N] up to which the muscle may lie on a stop.

    """

    def __init__(self, resting):
        self.resting = resting
        self.frozen = False
        self._value = math.nan
        self._since_ns = 0
        self._noticed_ns = 0
        self._lowest_pa, self._highest_pa = math.inf, -math.inf

    def judge(self, now_ns, stamp_ns, value, pressure_pa):
        """
        Take the newest readings; return whether the value is frozen.

        Parameters
        ----------
        now_ns, stamp_ns : int
            Time of the tick, and stamp of the value.
        value : float
            Measured contraction [m] or force [N], finite.
        pressure_pa : float
            Measured absolute pressure, NaN where none is fresh: then nothing is noticed.

        """
        if value != self._value or stamp_ns < self._since_ns:
            self._value, self._since_ns = value, stamp_ns
            self._lowest_pa, self._highest_pa = math.inf, -math.inf
            if self.frozen and now_ns - self._noticed_ns >= RESUME_NS:
                self.frozen = False
        if value > self.resting and math.isfinite(pressure_pa):
            self._lowest_pa = min(self._lowest_pa, pressure_pa)
            self._highest_pa = max(self._highest_pa, pressure_pa)
        if (self._highest_pa - self._lowest_pa > SWING_PA
                and stamp_ns - self._since_ns >= AFTER_NS):
            self.frozen = True
            self._noticed_ns = now_ns
        return self.frozen

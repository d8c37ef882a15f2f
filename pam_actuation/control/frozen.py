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
changes by far more than friction can hold is not what the muscle does; of a joint it is the
difference of both pressures. At its resting length, or without a force, a muscle may lie on a
stop, as a joint at the ends of its range, and pressure moves nothing; a sensor that is frozen
there is not noticed.
"""

import math

AFTER_NS = 200_000_000
SWING_PA = 150_000.0         # twice the dry friction of a bad rig holds it over 110 kPa
JOINT_SWING_PA = 300_000.0   # that of the realistic rigs holds a joint over 100 to 215 kPa
RESUME_NS = 2_000_000_000


class FrozenMeasurement:
    """
    Compares the newest value of what is tracked with the range of the pressure.

    ``frozen`` stays until the value has changed, for 2 s at least: a muscle that is blocked
    looks the same, and must not be filled against the obstacle again at once.

    Parameters
    ----------
    lowest, highest : float
        Contraction [m], force [N] or angle [rad] up to which, and from which on, the muscle or
        joint may lie on a stop.
    swing_pa : float
        More pressure than friction can hold [Pa].

    """

    def __init__(self, lowest, highest=math.inf, swing_pa=SWING_PA):
        self._between = lowest, highest
        self._swing_pa = swing_pa
        self.forget()

    def forget(self):
        """Begin anew."""
        self.frozen = False
        self._value = math.nan
        self._since_ns = 0
        self._noticed_ns = 0
        self._changed = False       # since it was noticed
        self._lowest_pa, self._highest_pa = math.inf, -math.inf

    def pause(self):
        """Forget the pressures, not what was found: what comes now is not compared with them."""
        self._lowest_pa, self._highest_pa = math.inf, -math.inf

    def judge(self, now_ns, stamp_ns, value, pressure_pa):
        """
        Take the newest readings; return whether the value is frozen.

        Parameters
        ----------
        now_ns, stamp_ns : int
            Time of the tick, and stamp of the value.
        value : float
            Measured contraction [m], force [N] or angle [rad], finite.
        pressure_pa : float
            Measured absolute pressure, of a joint that of the flexor less that of the extensor;
            NaN where none is fresh: then nothing is noticed.

        """
        if value != self._value or stamp_ns < self._since_ns:
            self._value, self._since_ns = value, stamp_ns
            self._changed = True
            self.pause()
        if self._between[0] < value < self._between[1] and math.isfinite(pressure_pa):
            self._lowest_pa = min(self._lowest_pa, pressure_pa)
            self._highest_pa = max(self._highest_pa, pressure_pa)
        if (self._highest_pa - self._lowest_pa > self._swing_pa
                and stamp_ns - self._since_ns >= AFTER_NS):
            self.frozen = True
            self._noticed_ns = now_ns
            self._changed = False
        elif self._changed and now_ns - self._noticed_ns >= RESUME_NS:
            self.frozen = False
        return self.frozen

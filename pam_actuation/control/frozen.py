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

A frozen sensor goes on sending its last value with new stamps. The pressure distinguishes it from
a muscle at rest. A value is frozen if it stays the same to the last bit while the measured
pressure changes by far more than friction can hold. The readings of a broken encoder may still
have noise: their mean is frozen if it stays within a narrow band meanwhile. For a joint the
difference of both pressures counts. At its resting length, or without a force, a muscle may lie on
a stop, as a joint at the ends of its range, and pressure moves nothing. If a muscle has left its
stop before, the pressure at which it did limits the rise there. A force, the ends of a joint, and
a muscle that has not moved yet are not judged.
"""

from collections import deque
import math
from statistics import median

from pam_sim.units import P_ATM_PA

AFTER_NS = 200_000_000
SWING_PA = 150_000.0         # twice the dry friction of a bad rig holds it over 110 kPa
JOINT_SWING_PA = 300_000.0   # that of the realistic rigs holds a joint over 100 to 215 kPa
STOP_SWING_PA = 200_000.0    # beyond the pressure that lifted the load the last times
LEAST_LIFT_PA = P_ATM_PA + 150_000.0     # below it a hand may have lifted it
LIFTS = 5
RESUME_NS = 2_000_000_000
MEAN_S = 0.05                # of the readings whose noise is averaged


class FrozenMeasurement:
    """
    Compares the newest value of what is tracked with the range of the pressure.

    ``frozen`` stays until the value has changed, for 2 s at least. A blocked muscle looks the
    same, and must not be filled against the obstacle again at once.

    Parameters
    ----------
    lowest, highest : float
        Contraction [m], force [N] or angle [rad] up to which, and from which on, the muscle or
        joint may lie on a stop.
    swing_pa : float
        More pressure than friction can hold [Pa].
    stop_swing_pa : float
        More pressure, beyond that at which the value rose above ``lowest``, than a muscle stays
        on its stop with [Pa]; infinite where a stop is not left by pressure alone.
    band : float
        The mean of the readings stands still up to so far from where it came to rest; 0: each
        reading does, to the last bit.

    """

    def __init__(self, lowest: float, highest: float = math.inf, swing_pa: float = SWING_PA,
                 stop_swing_pa: float = math.inf, band: float = 0.0) -> None:
        self._between = lowest, highest
        self._band = band
        self._swing_pa, self._stop_swing_pa = swing_pa, stop_swing_pa
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self.frozen = False
        self._value = math.nan
        self._since_ns = 0
        self._mean, self._mean_ns = math.nan, 0
        self._noticed_ns = 0
        self._changed = False       # since it was noticed
        self._lifts_pa: deque[float] = deque(maxlen=LIFTS)
        self.pause()

    def pause(self) -> None:
        """Forget the pressures, not what was found: what comes now is not compared with them."""
        self._lowest_pa, self._highest_pa = math.inf, -math.inf
        self._highest_on_stop_pa = -math.inf
        self._moved_ns = -1         # stamp since when the pressure has changed enough

    def judge(self, now_ns: int, stamp_ns: int, value: float, pressure_pa: float) -> bool:
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
        # The clock may have been set back.
        self._noticed_ns = min(self._noticed_ns, now_ns)
        if self._band:
            value = self._averaged(stamp_ns, value)
        if not abs(value - self._value) <= self._band or stamp_ns < self._since_ns:
            if self._value <= self._between[0] < value and math.isfinite(pressure_pa):
                self._lifts_pa.append(pressure_pa)
            self._value, self._since_ns = value, stamp_ns
            self._changed = True
            self.pause()
        if math.isfinite(pressure_pa):
            self._take(value, pressure_pa)
        if self._moved_without_it() and stamp_ns - self._still_since_ns(stamp_ns) >= AFTER_NS:
            # A mean leaves its band late.
            if not (self._band and self.frozen):
                self._noticed_ns = now_ns
            self.frozen = True
            self._changed = False
        elif self._changed and now_ns - self._noticed_ns >= RESUME_NS:
            self.frozen = False
        return self.frozen

    def _averaged(self, stamp_ns: int, value: float) -> float:
        """Return the mean of the latest readings, the newer the more weight."""
        passed_s = (stamp_ns - self._mean_ns) * 1e-9
        if not 0.0 <= passed_s < 1.0 or not math.isfinite(self._mean):
            self._mean = value
        else:
            self._mean += (value - self._mean) * passed_s / (MEAN_S + passed_s)
        self._mean_ns = stamp_ns
        return self._mean

    def _still_since_ns(self, stamp_ns: int) -> int:
        """Return since when the value should have moved; within a band it may begin to."""
        if not self._band:
            return self._since_ns
        if self._moved_ns < 0:
            self._moved_ns = stamp_ns
        return self._moved_ns

    def _take(self, value: float, pressure_pa: float) -> None:
        lowest, highest = self._between
        if lowest < value < highest:
            self._lowest_pa = min(self._lowest_pa, pressure_pa)
            self._highest_pa = max(self._highest_pa, pressure_pa)
        elif value <= lowest:
            self._highest_on_stop_pa = max(self._highest_on_stop_pa, pressure_pa)

    def _moved_without_it(self) -> bool:
        """Return whether the pressure changed by more than leaves a value where it was."""
        if self._highest_pa - self._lowest_pa > self._swing_pa:
            return True
        if not self._lifts_pa:
            return False
        # Not the last one alone: an obstacle or a fast step may have held one back.
        lift_pa = max(median(self._lifts_pa), LEAST_LIFT_PA)
        return self._highest_on_stop_pa - lift_pa > self._stop_swing_pa

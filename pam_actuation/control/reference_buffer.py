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
The wanted contraction now and a little ahead, from what was published.

``reference`` alone is extrapolated with its rate; a ``reference_trajectory``
is interpolated (cubic through positions and rates). Rules:

* A trajectory counts while its stamp is at most ``TRAJECTORY_LIFE_S`` old and its end
  has not passed; then its times are absolute and each message replaces the former.
  Beyond its end the last point goes on with its rate.
* Otherwise the newest ``reference`` counts. Its rate is trusted for ``TRUST_S``, after
  that the position stands still; the preview fades out until ``LOST_S``.
* After ``LOST_S`` without either the reference is lost: the last position is held with
  zero rate until ``HOLD_S``, then there is none and the muscle is to be vented. A new
  message resumes at once.
"""

from bisect import bisect_right
import math

TRAJECTORY_LIFE_S = 1.0
TRUST_S = 0.2
LOST_S = 0.5
HOLD_S = 2.0

NONE, FRESH, HELD, LOST = range(4)      # what ``state`` can be


class ReferenceBuffer:
    """Newest reference and trajectory; answers what is wanted at a time."""

    def __init__(self):
        self.reference = None
        self.trajectory = None
        self._times_ns = ()

    def set_reference(self, message):
        """Take a ``Reference``; one that is not finite is ignored and False returned."""
        if not math.isfinite(message.contraction_m):
            return False
        self.reference = message
        return True

    def set_trajectory(self, message):
        """
        Take a ``ReferenceTrajectory``; an unusable one is ignored and False returned.

        Usable: at least one point, equal lengths, finite, times strictly rising.
        """
        times = tuple(message.stamp_ns + offset for offset in message.time_from_start_ns)
        usable = (
            len(times) > 0 and len(times) == len(message.contraction_m)
            and all(a < b for a, b in zip(times, times[1:]))
            and all(math.isfinite(x) for x in message.contraction_m))
        if usable:
            self.trajectory = message
            self._times_ns = times
        return usable

    def clear(self):
        """Forget everything."""
        self.__init__()

    def uses_trajectory(self, now_ns):
        """Return whether the trajectory is the one that counts now."""
        if self.trajectory is None or now_ns > self._times_ns[-1]:
            return False
        newest_ns = self.trajectory.stamp_ns
        if now_ns - newest_ns <= TRAJECTORY_LIFE_S * 1e9:
            return True
        return self.reference is None      # a whole movement sent once, nothing else known

    def state(self, now_ns):
        """Return ``NONE``, ``FRESH``, ``HELD`` or ``LOST`` for a time."""
        if self.uses_trajectory(now_ns):
            return FRESH
        if self.reference is None and self.trajectory is None:
            return NONE
        age_s = (now_ns - self._last_ns()) * 1e-9
        if age_s <= LOST_S:
            return FRESH
        return HELD if age_s <= HOLD_S else LOST

    def _last_ns(self):
        """Return the latest time anything was known for [ns]."""
        times = []
        if self.reference is not None:
            times.append(self.reference.stamp_ns)
        if self.trajectory is not None:
            times.append(self._times_ns[-1])
        return max(times)

    def at(self, now_ns, time_ns):
        """
        Return (position m, rate m/s) wanted at ``time_ns``, judged at ``now_ns``.

        Only valid unless ``state`` is ``NONE``.
        """
        if self.uses_trajectory(now_ns):
            return self._interpolate(time_ns)
        if self.reference is None:
            return self.trajectory.contraction_m[-1], 0.0
        reference = self.reference
        rate = reference.velocity_m_per_s
        if not math.isfinite(rate):
            rate = 0.0
        age_s = (now_ns - reference.stamp_ns) * 1e-9
        ahead_s = (time_ns - now_ns) * 1e-9
        trusted_s = min(age_s, TRUST_S)
        fade = min(max((LOST_S - age_s) / (LOST_S - TRUST_S), 0.0), 1.0)
        position = reference.contraction_m + rate * (trusted_s + ahead_s * fade)
        return position, rate * fade

    def _interpolate(self, time_ns):
        """Return position and rate of the trajectory, straight beyond its ends."""
        times, trajectory = self._times_ns, self.trajectory
        after = bisect_right(times, time_ns)
        if after == 0 or after == len(times):
            i = 0 if after == 0 else after - 1
            rate = self._rate(i)
            return trajectory.contraction_m[i] + rate * (time_ns - times[i]) * 1e-9, rate
        i = after - 1
        span_s = (times[after] - times[i]) * 1e-9
        part = (time_ns - times[i]) * 1e-9 / span_s
        x0, x1 = trajectory.contraction_m[i], trajectory.contraction_m[after]
        v0, v1 = self._rate(i, None), self._rate(after, None)
        if v0 is None or v1 is None:
            return x0 + (x1 - x0) * part, (x1 - x0) / span_s
        a, b = span_s * v0 - (x1 - x0), (x1 - x0) - span_s * v1
        bend = part * (1.0 - part) * ((1.0 - part) * a + part * b)
        slope = ((1.0 - 2.0 * part) * ((1.0 - part) * a + part * b)
                 + part * (1.0 - part) * (b - a))
        return x0 + (x1 - x0) * part + bend, ((x1 - x0) + slope) / span_s

    def _rate(self, index, missing=0.0):
        """Return the rate of a point, ``missing`` where there is none."""
        rates = self.trajectory.velocity_m_per_s
        if index < len(rates) and math.isfinite(rates[index]):
            return rates[index]
        return missing

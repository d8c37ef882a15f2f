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

"""Errors of a tracked experiment, over spans of time and over its cycles."""

import math

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError


Cycles = tuple[float, float, int]       # start [s], period [s], count


class TrackingErrors:
    """
    What results of closed loops have in common.

    Subclasses have ``time_s``, ``error`` (reference minus what was reached, same length) and
    ``cycle_s``: (start, period, count) of the periodic part or None.
    """

    time_s: FloatArray
    cycle_s: Cycles | None

    @property
    def error(self) -> FloatArray:
        """Return reference minus what was reached."""
        raise NotImplementedError

    def rmse(self, start_s: float = 0.0, end_s: float = math.inf) -> float:
        """Return the root mean square error within a span of time."""
        chosen = (self.time_s >= start_s) & (self.time_s < end_s)
        if not chosen.any():
            raise InputError(f'no samples between {start_s} and {end_s} s')
        return float(np.sqrt(np.mean(self.error[chosen] ** 2)))

    def cycle_rmse(self) -> FloatArray:
        """Return the root mean square error of every cycle, shape (cycles,)."""
        if self.cycle_s is None:
            raise InputError('the experiment has no periodic part')
        start_s, period_s, count = self.cycle_s
        return np.array([
            self.rmse(start_s + k * period_s, start_s + (k + 1) * period_s)
            for k in range(count)])

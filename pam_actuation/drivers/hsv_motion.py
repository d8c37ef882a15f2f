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
The volume of the muscle from a measured contraction, for the HSV pressure loop.

A moving muscle changes its volume, and with it the pressure: at 25 mm/s by 1 kPa in a PWM period.
The pressure alone tells of that late, behind the noise of its sensor. A measured contraction
tells it at once. It corrects volume, its rate, and the volume at which the load would rest.
The last holds what friction and load differ from those of the data sheet.

Without a reading, or with one that is not finite, the pressure corrects the volume as before. A
reading far off the model begins it anew, at rest. A sensor that stands still or jumps therefore
costs what the contraction would have told, and the measured pressure still leads.
"""

import math

import numpy as np

from pam_sim.compiled import compiled

_MOST_M = 1e-3          # a reading farther off than this begins the model anew
_FADE = 0.99            # of the rest without a reading, per period


@compiled
def corrected_by_contraction(state: np.record, par: np.record, resting_m3: float) -> bool:
    """
    Correct volume, rate and rest of the model by the contraction; tell whether it was.

    ``resting_m3`` is the volume at which the load rests under the pressure of the model [m^3].
    """
    x_m: float = state.contraction_m
    state.contraction_m = math.nan
    if not (par.correct_by_contraction > 0.0 and math.isfinite(x_m)):
        state.rest_m3 *= _FADE
        return False
    x_m = min(max(x_m, 0.0), 1.5 * par.contraction_at_600kpa_m)
    age = state.contraction_age_s / par.period_s
    measured_m3 = par.volume_m3 + x_m * (
        par.volume_slope_m3_per_m + x_m * par.volume_curve_m3_per_m2)
    error = measured_m3 + age * state.volume_change_m3 - state.volume_m3
    if abs(error) > _MOST_M * par.volume_slope_m3_per_m:
        state.volume_m3 = max(measured_m3, par.volume_m3)
        state.volume_change_m3 = 0.0
        state.rest_m3 = measured_m3 - resting_m3
        return True
    # Corrected is the model of then; what its rate changes has moved the volume since.
    gain = par.correct_by_contraction + age * par.correct_rate_by_contraction
    state.volume_m3 = max(state.volume_m3 + gain * error, par.volume_m3)
    state.volume_change_m3 += par.correct_rate_by_contraction * error
    limit = par.volume_at_600kpa_m3 - par.volume_m3
    rest = state.rest_m3 + par.correct_rest_by_contraction * error
    state.rest_m3 = min(max(rest, -limit), limit)
    return True

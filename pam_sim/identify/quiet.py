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
A measured pressure with less noise, for use as an input.

Noise of the pressure goes straight into the force, and a recording at rest would seem to tell mass
and damping. So every sample is that of a parabola through a window around it. A window that
reaches over a kink would smear it by many times the noise, on every edge alike. Each sample has
therefore the longest window whose parabola agrees with those of all shorter ones, within their
noise (intersection of confidence intervals: Goldenshluger and Nemirovski 1997, Mathematical
Methods of Statistics 6, 135; Katkovnik 1999, IEEE Transactions on Signal Processing 47, 2567).
What the load follows, up to some hertz, stays in the signal. No window of this length removes it.
"""

from collections.abc import Iterator
import copy
import math

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.data.noise import Noise, SMALLEST
from pam_sim.gap.data.recording import Recording

SHORT_S = 0.05               # longest window
FEWEST = 5                   # samples of the shortest one
LONGER = 1.4                 # from one window to the next
AGREES_SD = 1.5              # half width of the intervals that must have a point in common


def with_quiet_pressure(recording: Recording, noise: Noise) -> Recording:
    """
    Return a recording whose measured pressure has less noise.

    Parameters
    ----------
    recording : Recording
        It stays as it is; a log too slow for the shortest window is returned itself.
    noise : Noise
        Of its pressure.

    """
    p = recording.measured['pressure']
    period_s = float(np.median(np.diff(recording.time_s['pressure'])))
    if p.size <= SHORT_S / period_s + 1.0 or SHORT_S / period_s < FEWEST - 1.0:
        return recording
    white_sd = max(noise.white_sd, SMALLEST['pressure'])
    alike = 2.0 * noise.memory_s / period_s            # samples that the slow part stays alike
    calm, low, high = np.array(p), np.full(p.size, -np.inf), np.full(p.size, np.inf)
    agrees = np.ones(p.size, bool)
    for average, share in _averages(p, period_s):
        half = AGREES_SD * np.hypot(share * white_sd,
                                    min(share * np.sqrt(alike), 1.0) * noise.slow_sd)
        low, high = np.maximum(low, average - half), np.minimum(high, average + half)
        agrees &= low <= high
        calm[agrees] = average[agrees]
    if np.std(average) < white_sd:            # at rest: all that is left is noise
        calm = np.full(p.size, np.mean(p))
    quiet = copy.copy(recording)
    quiet.measured = {**recording.measured, 'pressure': calm}
    return quiet


def drawn_pa(raw: Recording, noise: Noise, quiet: Recording, random: np.random.Generator
             ) -> FloatArray:
    """Return what noise like that of a pressure leaves of itself in the averaged one."""
    noisy = copy.copy(raw)
    noisy.measured = {**raw.measured, 'pressure': raw.measured['pressure'] + noise.draw(
        raw.time_s['pressure'], random)}
    twice = Noise(math.sqrt(2.0) * noise.white_sd, math.sqrt(2.0) * noise.slow_sd, noise.memory_s)
    return with_quiet_pressure(noisy, twice).measured['pressure'] - quiet.measured['pressure']


def _averages(p: FloatArray, period_s: float) -> Iterator[tuple[FloatArray, float]]:
    """Give (averaged values, what is left of white noise), with ever longer windows."""
    from scipy.signal import savgol_coeffs, savgol_filter       # slow to import

    yield p, 1.0
    window = FEWEST
    while (window - 1) * period_s <= SHORT_S:
        yield savgol_filter(p, window, 2), float(np.linalg.norm(savgol_coeffs(window, 2)))
        window = 2 * int(0.5 * LONGER * window) + 1

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
What sensors, quantisation and stamps explain: the floor below which no gap is seen.

Noise is read from third differences, which take the motion out: for white noise
of standard deviation s they have sqrt(20) s. The median makes it blind to steps
and outliers. A slow log moves too far between two samples for that. There divided
differences of a higher order take the motion out, at the instants as they are.
"""

from dataclasses import dataclass

import numpy as np
from pam_sim.annotations import FloatArray

THIRD_DIFFERENCE_GAIN = np.sqrt(20.0)      # 1, 3, 3, 1 squared and summed
SLOW_S = 1.0 / 90.0          # between samples: a log is slow above that
SLOW_ORDER = 8               # of the differences of a slow log
MAD_TO_SD = 1.4826                          # of a normal distribution
QUIET_S, MEAN_S, LAG_S = 0.4, 0.05, 0.01    # windows at rest, means in them, autocovariance
QUIET_MEANS = 1.2            # scatter of the means, in standard deviations of the white noise
SLOW_SHARE = 0.15            # of the white variance, below which noise counts as white
# Stamp jitter and skew up to 0.5 ms are normal on a measured bag; uniform, that is
# this standard deviation.
STAMP_SD_S = 0.5e-3 / np.sqrt(3.0)
# Below this no sensor of such a rig resolves anything, and numerics begin to show.
SMALLEST = {'pressure': 30.0, 'contraction': 2e-6, 'force': 0.02}


def noise_sd(values: FloatArray) -> float:
    """
    Return the standard deviation of the white noise in equally spaced samples.

    Never below the quantisation step over sqrt(12); 0 with fewer than 8 samples.
    """
    values = np.asarray(values, dtype=float)
    if values.size < 8:
        return 0.0
    third = np.diff(values, 3)
    spread = MAD_TO_SD * float(np.median(np.abs(third - np.median(third))))
    return max(spread / THIRD_DIFFERENCE_GAIN, quantisation_step(values) / np.sqrt(12.0))


def slow_noise_sd(time_s: FloatArray, values: FloatArray) -> float:
    """
    Return the same of the samples of a slow log at rising instants.

    Each difference is a weighted sum that is zero for every polynomial of lower order. Its
    weights have the length 1, so that it scatters as the noise does.
    """
    values, count = np.asarray(values, dtype=float), SLOW_ORDER + 1
    if values.size < 2 * count:
        return noise_sd(values)
    at, near = (np.lib.stride_tricks.sliding_window_view(v, count) for v in (time_s, values))
    apart = (at[:, :, np.newaxis] - at[:, np.newaxis, :]) / np.median(np.diff(time_s))
    apart[:, np.arange(count), np.arange(count)] = 1.0
    weights = 1.0 / apart.prod(axis=2)
    difference = (weights * near).sum(axis=1) / np.linalg.norm(weights, axis=1)
    return max(MAD_TO_SD * float(np.median(np.abs(difference))),
               quantisation_step(values) / np.sqrt(12.0))


@dataclass(frozen=True)
class Noise:
    """
    Noise of a signal: a white part and a slower one.

    Parameters
    ----------
    white_sd, slow_sd : float
        Standard deviations.
    memory_s : float
        Correlation time of the slow part.

    """

    white_sd: float
    slow_sd: float = 0.0
    memory_s: float = 0.0

    @property
    def sd(self) -> float:
        """Return the standard deviation of both parts together."""
        return float(np.hypot(self.white_sd, self.slow_sd))

    def draw(self, time_s: FloatArray, random: np.random.Generator) -> FloatArray:
        """Return noise like it at rising instants, shape of ``time_s``."""
        from scipy.signal import lfilter       # slow to import
        found = self.white_sd * random.standard_normal(time_s.size)
        if self.slow_sd > 0.0:
            period = float(np.median(np.diff(time_s)))
            keep = np.exp(-period / self.memory_s)
            driven = self.slow_sd * np.sqrt(1.0 - keep ** 2) * random.standard_normal(time_s.size)
            found += lfilter([1.0], [1.0, -keep], driven)
        return found


def noise_of(time_s: FloatArray, values: FloatArray) -> Noise:
    """
    Return the Noise of a signal.

    The slow part shows where the signal rests: windows in which means over 50 ms
    scatter no more than noise does. Without such windows the noise is taken for white.
    """
    period = float(np.median(np.diff(time_s)))
    white = slow_noise_sd(time_s, values) if period > SLOW_S else noise_sd(values)
    window, part = int(QUIET_S / period), max(int(MEAN_S / period), 1)
    lag = max(int(round(LAG_S / period)), 1)
    if white <= 0.0 or window < 4 * part or window <= 2 * lag:
        return Noise(white)
    rows = values[:values.size // window * window].reshape(-1, window)
    slope = np.arange(window) - 0.5 * (window - 1)
    rows = rows - rows.mean(axis=1, keepdims=True)
    rows = rows - np.outer(rows @ slope / (slope @ slope), slope)
    means = rows[:, :window // part * part].reshape(rows.shape[0], -1, part).mean(axis=2)
    quiet = rows[means.std(axis=1) < QUIET_MEANS * white]
    if len(quiet) < 2:
        return Noise(white)
    # Medians: a window in which a motion just begins must not count.
    total = float(np.median(np.mean(quiet ** 2, axis=1)))
    together = [float(np.median(np.mean(quiet[:, k:] * quiet[:, :-k], axis=1)))
                for k in (lag, 2 * lag)]
    if total < (1.0 + SLOW_SHARE) * white ** 2 or together[0] <= SLOW_SHARE * white ** 2:
        return Noise(white)
    ratio = min(max(together[1] / together[0], 0.05), 0.95)
    # Longer where samples are too far apart. A little more is how stamps scatter, and a shorter
    # one counts as 10 ms: in windows so short the memory is found too short already.
    lag_s = lag * period if lag * period > 1.02 * LAG_S else LAG_S
    return Noise(white, float(np.sqrt(total - white ** 2)), -lag_s / float(np.log(ratio)))


def quantisation_step(values: FloatArray) -> float:
    """Return the step of a quantised signal, 0.0 for one that takes values freely."""
    values = np.asarray(values, dtype=float)
    distinct = np.unique(values)
    # A quantised signal repeats its values; a free one hardly ever does.
    return smallest_step(distinct) if distinct.size <= 0.5 * values.size else 0.0


def smallest_step(distinct: FloatArray) -> float:
    """Return the smallest difference between rising values; 0 without one."""
    steps = np.diff(distinct)
    steps = steps[steps > 1e-9 * np.ptp(distinct)] if steps.size else steps
    return float(steps.min()) if steps.size else 0.0


def sensor_floor(time_s: FloatArray, values: FloatArray, signal: str, inputs_sd: float = 0.0
                 ) -> float:
    """
    Return the standard deviation that noise and stamps give the residual of a signal, SI.

    Quadrature sum of sensor noise, of the stamp error times the rms rate of the
    signal, and of ``inputs_sd``, the noise that the inputs bring along.
    """
    noise = noise_of(time_s, values)
    return float(np.sqrt(
        noise.sd ** 2 + (STAMP_SD_S * rms_rate(time_s, values, noise.white_sd)) ** 2
        + inputs_sd ** 2 + SMALLEST[signal] ** 2))


def rms_rate(time_s: FloatArray, values: FloatArray, noise: float = 0.0) -> float:
    """Return the rms rate of change over 20 ms spans, noise taken out, unit per second."""
    time_s = np.asarray(time_s, dtype=float)
    period = float(np.median(np.diff(time_s)))
    span = max(int(round(0.02 / max(period, 1e-6))), 1)
    if len(values) <= span:
        return 0.0
    seconds = np.maximum(time_s[span:] - time_s[:-span], 1e-6)
    change = np.asarray(values)[span:] - np.asarray(values)[:-span]
    squared = float(np.mean((change / seconds) ** 2)) - 2.0 * (noise / (span * period)) ** 2
    return float(np.sqrt(max(squared, 0.0)))


def autocorrelation_time(values: FloatArray) -> float:
    """
    Return the integrated autocorrelation time in samples, at least 1.

    Summed up to the first negative value, as is usual for noisy estimates.
    """
    values = np.asarray(values, dtype=float) - np.mean(values)
    n = values.size
    if n < 8 or not np.any(values):
        return 1.0
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.fft.rfft(values, size)
    correlation = np.fft.irfft(spectrum * np.conj(spectrum), size)[:n]
    correlation /= correlation[0]
    negative = np.flatnonzero(correlation < 0.0)
    stop = negative[0] if negative.size else n
    total = 1.0 + 2.0 * float(correlation[1:stop].sum())
    return min(max(total, 1.0), n / 10.0)
